//! Command lines: words of every subcommand, right and wrong, up to the point where a device or window would be opened.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use clap::Arg;
use cuesta::internal::cli::bench::{BenchArgs, MeasureArgs};
use cuesta::internal::cli::cases::Planned;
use cuesta::internal::cli::scene::{LookArgs, ReadArgs, ViewArgs};
use cuesta::internal::cli::technique::TechniqueArgs;
use cuesta::internal::cli::{Cli, Command, Common, one_line};
use cuesta::internal::height::{Field, save, synth};
use cuesta::internal::lod::Techniques;
use fastrand::Rng;

use super::views::check_list;
use super::{fuzz, mutate};

/// Largest field, samples, on which techniques are prepared.
const MAX_SAMPLES: u64 = 1 << 16;

/// Values of flags, valid and almost valid, beside [`mutate::WORDS`] and the words that flags list themselves.
const VALUES: [&str; 26] = [
    "3",
    "0.25",
    "17",
    "320x200",
    "1x1",
    "16384x1",
    "0x9",
    "5,7",
    "0.5,1,8",
    "3,2,9,8",
    "0,0,33,17",
    "4,+20,6",
    "16,+0,8",
    "1e7,-3,2",
    "-45",
    "180",
    "359.9",
    "block=17",
    "block=32",
    "morph=on",
    "seams=skirts",
    "order=painter",
    "level=4",
    "33x17:u16le",
    "1000000,1000000",
    "4294967295,1",
];

/// A small file to read.
static TERRAIN: LazyLock<(tempfile::TempDir, String)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("land.tif");
    save::save(&synth::synth(synth::Kind::Fractal, [33, 17], 2), &path).expect("a small file");
    (folder, path.display().to_string())
});

fn value(random: &mut Rng, argument: &Arg) -> String {
    let own = argument.get_possible_values();
    let technique = |random: &mut Rng| {
        let entry = mutate::one(random, cuesta::internal::lod::TECHNIQUES);
        let variant = entry.variants.get(random.usize(..4)).map(|variant| format!(":{}", variant.name));
        format!("{}{}", entry.name, variant.unwrap_or_default())
    };
    match random.u8(..6) {
        0 => mutate::one(random, &mutate::WORDS).to_string(),
        _ if !own.is_empty() => mutate::one(random, &own).get_name().to_string(),
        _ if argument.get_id() == "technique" => technique(random),
        1 => format!("{},{}", mutate::one(random, &mutate::WORDS), mutate::one(random, &VALUES)),
        _ => mutate::one(random, &VALUES).to_string(),
    }
}

/// Generates a command line without the program's name.
fn words(random: &mut Rng) -> Vec<String> {
    let root = cuesta::internal::cli::command();
    let commands: Vec<_> = root.get_subcommands().collect();
    let command = mutate::one(random, &commands);
    let mut words = vec![command.get_name().to_string()];
    let flags: Vec<_> = command.get_arguments().chain(root.get_arguments()).collect();
    let positions = flags.iter().filter(|flag| flag.is_positional()).count();
    words.extend((0..positions).map(|_| if random.u8(..8) == 0 { value(random, flags[0]) } else { TERRAIN.1.clone() }));
    // Arguments that every call needs.
    words.extend(
        flags
            .iter()
            .filter(|flag| flag.is_required_set() && !flag.is_positional())
            .flat_map(|flag| [format!("--{}", flag.get_long().unwrap_or_default()), "out.ply".to_string()]),
    );
    for _ in 0..random.usize(..7) {
        let flag = mutate::one(random, &flags);
        let Some(long) = flag.get_long() else { continue };
        words.push(format!("--{long}"));
        if flag.get_action().takes_values() {
            words.push(value(random, flag));
        }
    }
    if random.u8(..4) == 0 {
        let at = random.usize(..words.len());
        let mut bytes = words[at].clone().into_bytes();
        mutate::bytes(random, &mut bytes, b"--,=:x");
        words[at] = String::from_utf8_lossy(&bytes).into_owned();
    }
    words
}

/// Asserts that an error is one line.
fn outcome_of<T>(result: anyhow::Result<T>) -> Option<T> {
    let error = match result {
        Ok(value) => return Some(value),
        Err(error) => format!("{error:#}"),
    };
    assert!(!error.is_empty() && !error.contains('\n'), "{error:?}");
    None
}

fn quiet() -> Common {
    Common { quiet: true, ..Common::default() }
}

/// Reads the field, and selects in the view if that is fast.
fn looked(reading: &ReadArgs, view: &ViewArgs, technique: &TechniqueArgs, look: Option<&LookArgs>) {
    let Some(loaded) =
        outcome_of(ReadArgs { no_cache: true, ..reading.clone() }.load(&quiet(), std::slice::from_ref(&TERRAIN.1)))
    else {
        return;
    };
    look.map(|look| outcome_of(look.build(&quiet(), &TERRAIN.1, (&loaded.field, &loaded.footprint))));
    let Some((entry, settings)) = outcome_of(technique.settings(&Techniques::built_in())) else { return };
    let field: Arc<Field> = Arc::new(loaded.field);
    let Some(view) = outcome_of(technique.tolerance().and_then(|tolerance| view.build(&field, tolerance))) else {
        return;
    };
    let [w, h] = field.size().map(u64::from);
    if w * h <= MAX_SAMPLES {
        let prepared = entry.prepare(&field, &settings).map_err(anyhow::Error::msg);
        if let Some(mut technique) = outcome_of(prepared) {
            check_list(&field, &view, technique.as_mut());
        }
    }
}

fn measured(args: &MeasureArgs) {
    let is_small = args.terrain.iter().all(|file| *file == TERRAIN.1) && args.reading.tile.is_none() && !args.kit;
    if is_small {
        outcome_of(Planned::new(&quiet(), args));
    }
}

fn check(words: &[String]) {
    let cli = match Cli::parse_words(std::iter::once("cuesta").chain(words.iter().map(String::as_str))) {
        Ok(cli) => cli,
        Err(error) => {
            let line = one_line(&error);
            assert!(!line.is_empty() && !line.contains('\n'), "{line:?}");
            return;
        }
    };
    match cli.command {
        Some(Command::Export(args)) => looked(&args.terrain.reading, &args.view, &args.technique, None),
        Some(Command::Info(args)) => looked(&args.reading, &args.view, &args.technique, Some(&args.look)),
        #[cfg(feature = "vulkan")]
        Some(Command::Render(args)) => {
            looked(&args.terrain.reading, &args.view, &args.technique, Some(&args.look));
        }
        #[cfg(feature = "vulkan")]
        Some(Command::Profile(args)) => {
            looked(&args.terrain.reading, &args.view, &args.technique, Some(&args.look));
        }
        Some(Command::Bench(BenchArgs { action: None, measure })) => measured(&measure),
        _ => {}
    }
}

#[test]
fn whatever_the_words_an_answer_or_one_line() {
    assert!(Path::new(&TERRAIN.1).is_file());
    fuzz("arguments", words, check);
}
