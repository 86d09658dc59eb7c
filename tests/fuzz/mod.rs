//! Fuzzing by seed: files, command lines, views, rows. Every input gives a result or an error of one line. Each target runs
//! for `FUZZ_SECONDS` (default 2) from the seed `FUZZ_SEED` (default 1), and prints its number of inputs. A failing input is
//! reduced. `./x fuzz` runs all targets for longer.

mod arguments;
mod files;
mod mutate;
mod results;
mod views;

use std::fmt::Debug;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

use fastrand::Rng;

/// Time limit of one input: beyond it the process aborts and prints the seed.
const HANG: Duration = Duration::from_secs(120);

/// Feeds `check` with the input that `generate` makes of each seed.
fn fuzz<T: Clone + Debug>(target: &'static str, generate: impl Fn(&mut Rng) -> Vec<T>, check: impl Fn(&[T])) {
    let number = |name| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("a whole number"));
    let (seconds, first) = (number("FUZZ_SECONDS").unwrap_or(2), number("FUZZ_SEED").unwrap_or(1));
    let end = Instant::now() + Duration::from_secs(seconds);
    let watched = Watched::new(target, first);
    let mut seed = first;
    while seed == first || Instant::now() < end {
        watched.seed.store(seed, Relaxed);
        let input = generate(&mut Rng::with_seed(seed));
        if let Some(said) = fault(&check, &input) {
            let small = smallest(input, |input| fault(&check, input).is_some());
            let said = fault(&check, &small).unwrap_or(said);
            panic!("{target}, FUZZ_SEED={seed}: {said}\nsmallest input that fails: {small:?}");
        }
        seed += 1;
    }
    println!("{target}: {} inputs, {seconds} s, seeds from {first}", seed - first);
}

/// Returns the message of a panic in `check`.
fn fault<T>(check: impl Fn(&[T]), input: &[T]) -> Option<String> {
    let panic = catch_unwind(AssertUnwindSafe(|| check(input))).err()?;
    let text = panic.downcast_ref::<String>().cloned();
    Some(text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default())
}

/// Removes parts of an input, large ones first, while the rest still fails (Zeller & Hildebrandt 2002, without the
/// complements).
fn smallest<T: Clone>(mut input: Vec<T>, fails: impl Fn(&[T]) -> bool) -> Vec<T> {
    let mut part = input.len() / 2;
    while part > 0 {
        let mut at = 0;
        while at < input.len() {
            let end = (at + part).min(input.len());
            let rest = [&input[..at], &input[end..]].concat();
            if fails(&rest) {
                input = rest;
            } else {
                at = end;
            }
        }
        part /= 2;
    }
    input
}

/// Aborts the process if a seed takes too long.
struct Watched {
    /// The current seed; 0 after the last one.
    seed: Arc<AtomicU64>,
}

impl Watched {
    fn new(target: &'static str, first: u64) -> Self {
        let seed = Arc::new(AtomicU64::new(first));
        let watched = Arc::clone(&seed);
        std::thread::spawn(move || watch(target, &watched));
        Self { seed }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.seed.store(0, Relaxed);
    }
}

fn watch(target: &str, seed: &AtomicU64) {
    let mut last = (0, Instant::now());
    while seed.load(Relaxed) != 0 {
        if seed.load(Relaxed) != last.0 {
            last = (seed.load(Relaxed), Instant::now());
        } else if last.1.elapsed() > HANG {
            eprintln!("{target}, FUZZ_SEED={}: no end after {} s", last.0, HANG.as_secs());
            std::process::abort();
        }
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn a_fault_is_found_and_made_small() {
    let check = |input: &[u8]| assert!(!input.windows(2).any(|pair| pair == [7, 9]), "seven nine");
    let found = catch_unwind(|| fuzz("a made-up fault", |random| (0..200).map(|_| random.u8(..16)).collect(), check));
    let said = *found.unwrap_err().downcast::<String>().expect("a message");
    assert!(said.contains("seven nine") && said.ends_with("fails: [7, 9]"), "{said}");
}
