//! Soak test: random flights, teleports and technique switches for `CUESTA_SOAK_S` seconds, or 20 s.
//!
//! No device memory leaks, no chunk is lost, no list exceeds its limits and no validation message appears. With
//! `CUESTA_SOAK_S` a second test runs in a process of its own without validation layers: the process must not grow
//! from the second to the last fifth of its flights.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::{TECHNIQUES, Technique};
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene};
use cuesta::internal::view::{Lens, View};
use glam::DVec3;

use super::{aslant, on_device, on_device_with, technique};

/// Default duration, seconds.
const SECONDS: u64 = 20;

/// Frames per flight.
const FRAMES: u32 = 60;

/// Maximum growth of the process from the second fifth to the last; allocators retain some memory.
const GROWTH_BYTES: u64 = 16 << 20;

struct Random(u64);

impl Random {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one_of<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[(self.number() * of.len() as f64) as usize]
    }
}

/// Returns every technique and variant with defaults, and chunk settings short of time or memory.
fn forms() -> Vec<(String, Vec<&'static str>)> {
    let of = |entry: &'static cuesta::internal::lod::Entry| {
        let variants = entry.variants.iter().map(|variant| format!("{}:{}", entry.name, variant.name));
        std::iter::once(entry.name.to_string()).chain(variants)
    };
    let plain = TECHNIQUES.iter().flat_map(of).map(|name| (name, Vec::new()));
    let short = [vec!["tile=9", "rebuild=1"], vec!["tile=17", "memory=1"], vec!["tile=9", "clock=frames"]];
    plain.chain(short.map(|settings| ("smooth-tiles".to_string(), settings))).collect()
}

/// Returns the next view: a step, a turn, the same view, or a teleport.
fn next(field: &Field, start: &View, view: &View, random: &mut Random) -> View {
    let [w, h] = field.size().map(f64::from);
    let step = DVec3::new(random.number() - 0.5, random.number() - 0.5, random.number() - 0.5) * 60.0;
    let time_s = view.time_s + *random.one_of(&[0.0, 1.0 / 60.0, 1.0 / 60.0, 5.0]);
    let turned = View::turned(360.0 * random.number(), -60.0 * random.number(), 0.0);
    match (random.number() * 10.0) as u32 {
        0 => View { time_s, ..*view },
        1 => View { world_from_eye: turned, time_s, ..*view },
        2 => {
            let eye = field.world_at(w * random.number(), h * random.number(), 900.0 * random.number());
            let lens = Lens::Perspective { fov_x: 0.1 + 2.0 * random.number() };
            View { eye, world_from_eye: turned, lens, time_s, ..*start }
        }
        _ => View { eye: view.eye + step, time_s, ..*view },
    }
}

/// Runs one flight with one technique. Returns the device bytes during it.
fn fly(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &mut dyn Technique, name: &str, random: &mut Random) -> u64 {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    let scene = Scene { gpu, field, plan: &plan, look: &look, overlay: None };
    let start = aslant(field, [160, 100], *random.one_of(&[1.0, 2.0, 8.0]));
    let mut renderer = scene.renderer(technique, start.size).unwrap();
    let made = gpu.device_bytes().values().sum();
    let mut view = start;
    for frame in 0..FRAMES {
        renderer.draw(technique, &view, Copy::Nothing).unwrap();
        let (size, limits) = (renderer.list.size(), technique.limits());
        assert!(limits.hold(&size), "{name}, frame {frame}: {size:?} exceeds {limits:?}");
        let figure = |name: &str| technique.stats().into_iter().find(|f| f.0 == name).map(|f| f.1);
        assert_eq!(figure("chunks in use"), figure("tiles"), "{name}, frame {frame}: a chunk a tile");
        view = next(field, &start, &view, random);
    }
    assert_eq!(gpu.device_bytes().values().sum::<u64>(), made, "{name}: nothing is made inside a frame");
    made
}

/// Returns the resident memory of the process, bytes.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches(" kB").parse::<u64>().ok().map(|kilobytes| kilobytes << 10)
}

/// Runs random flights for a duration. Returns the resident memory after each, bytes.
fn soak(gpu: &Arc<Gpu>, lasts: Duration) -> Vec<u64> {
    let field = Arc::new(synth::synth(synth::Kind::Fractal, [385, 321], 3));
    let (random, forms) = (&mut Random(0x50a4), forms());
    let bytes = || gpu.device_bytes().values().sum::<u64>();
    let (started, empty) = (Instant::now(), bytes());
    let mut held = Vec::new();
    while started.elapsed() < lasts || held.len() < forms.len() {
        // Each configuration once, then random ones.
        let (name, settings) =
            forms.get(held.len()).unwrap_or_else(|| &forms[(random.number() * forms.len() as f64) as usize]);
        let mut technique = technique(&field, name, settings);
        assert!(fly(gpu, &field, technique.as_mut(), name, random) > empty, "{name}: a flight allocates device memory");
        drop(technique);
        assert_eq!(bytes(), empty, "{name} {settings:?}: bytes left on the device");
        let messages = gpu.instance.messages.lock().unwrap().join("\n");
        assert!(messages.is_empty(), "{name} {settings:?}: {messages}");
        held.push(resident_bytes().unwrap_or(0));
    }
    held
}

/// Returns the duration in `CUESTA_SOAK_S`, seconds.
fn asked() -> Option<u64> {
    std::env::var("CUESTA_SOAK_S").ok().map(|s| s.parse().expect("CUESTA_SOAK_S: seconds"))
}

#[test]
fn random_flights_leak_no_device_memory() {
    let lasts = Duration::from_secs(asked().unwrap_or(SECONDS));
    on_device(|gpu| println!("{} flights", soak(gpu, lasts).len()));
}

/// Settings that make glibc's allocator return large blocks at once. Without them fragmentation over hundreds of
/// flights is indistinguishable from a leak. Other allocators ignore them.
const GIVE_BACK: [(&str, &str); 3] =
    [("MALLOC_MMAP_THRESHOLD_", "131072"), ("MALLOC_TRIM_THRESHOLD_", "131072"), ("MALLOC_ARENA_MAX", "1")];

/// Runs `the_process_does_not_grow` in a process with [`GIVE_BACK`].
fn alone() -> std::process::ExitStatus {
    let test = "gpu::soak::the_process_does_not_grow";
    let mut process = std::process::Command::new(std::env::current_exe().unwrap());
    process.args([test, "--exact", "--nocapture"]).envs(GIVE_BACK).status().unwrap()
}

/// Runs without validation layers, which retain about 0.1 MiB per flight.
#[test]
fn the_process_does_not_grow() {
    let Some(seconds) = asked() else { return println!("skipped: runs only with CUESTA_SOAK_S") };
    if GIVE_BACK.iter().any(|(name, _)| std::env::var_os(name).is_none()) {
        return assert!(alone().success());
    }
    on_device_with(false, |gpu| {
        let held = soak(gpu, Duration::from_secs(seconds));
        // Medians ignore momentary peaks.
        let median = |flights: &[u64]| {
            let mut sorted = flights.to_vec();
            sorted.sort_unstable();
            sorted[sorted.len() / 2]
        };
        let fifths: Vec<u64> = held.chunks(held.len().div_ceil(5)).map(median).collect();
        println!("{} flights, MiB by fifths: {:?}", held.len(), fifths.iter().map(|n| n >> 20).collect::<Vec<_>>());
        assert!(fifths[fifths.len() - 1] <= fifths[1] + GROWTH_BYTES, "{fifths:?}");
    });
}
