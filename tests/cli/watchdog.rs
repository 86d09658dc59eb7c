//! No command of the guide runs longer than its bound, whatever the field: what never ends is found here.

use std::collections::BTreeSet;
use std::process::Stdio;
use std::time::{Duration, Instant};

use cuesta::internal::height::save::save;
use cuesta::internal::lod::TECHNIQUES;
use cuesta::internal::stress::{self, Kind};
use rayon::prelude::*;

use super::*;

/// Time limit of a command on a field of the stress suite, seconds. Each takes a few seconds on a busy machine.
const BOUND_S: u64 = 120;

/// The guide's commands on a field, small ones: the number of frames and pixels is not what could make them run for ever. `T`
/// stands for a technique. Those after the first three need a device.
const COMMANDS: &[&[&str]] = &[
    &["info", "F"],
    &["info", "F", "--working-set", "set.png", "--size", "160x90", "--technique", "T"],
    &["export", "F", "-o", "mesh.ply", "--technique", "T", "--tolerance", "0.001"],
    &["info", "F", "--plan", "--measure", "1", "--size", "160x90", "--technique", "T"],
    &["render", "F", "-o", "a.png", "--size", "160x90", "--technique", "T", "--measure"],
    &["render", "F", "-o", "b.png", "--size", "160x90", "--technique", "T", "--tolerance", "1e-6"],
    &["render", "F", "-o", "c.png", "--size", "160x90", "--technique", "T", "--pitch", "-90", "--eye", "9,+1,9"],
    &["render", "F", "-o", "d.png", "--size", "160x90", "--colour", "ground", "--texture-memory", "2"],
    &["profile", "F", "--out", "profile", "--frames", "1", "--size", "160x90", "--technique", "T"],
    &[
        "bench",
        "F",
        "--out",
        "run",
        "--path",
        "circle,spin",
        "--technique",
        "T",
        "--frames",
        "2",
        "--rounds",
        "1",
        "--size",
        "160x90",
    ],
    &["bench", "compare", "run", "run"],
    &["report", "run"],
];
/// Number of commands that need no device.
const WITHOUT_A_DEVICE: usize = 3;
/// Commands of the guide that the list leaves out: a window, which has tests of its own, what reads no field, and the stress
/// suite itself.
const ELSEWHERE: [&str; 3] = ["view", "synth", "stress"];

/// Runs a command and kills it at its limit. Returns its exit status.
fn watched(folder: &Path, arguments: &[&str]) -> Result<i32, String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
    command.args(arguments).current_dir(folder).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("a child") {
            return status.code().ok_or_else(|| format!("{arguments:?} ended by {status}"));
        }
        if started.elapsed() > Duration::from_secs(BOUND_S) {
            child.kill().expect("it runs");
            child.wait().expect("it was killed");
            return Err(format!("{arguments:?} ran longer than {BOUND_S} s"));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn every_subcommand_of_the_guide_is_watched() {
    let guide = include_str!("../../docs/guide.md");
    let listed: BTreeSet<_> = guide
        .lines()
        .filter_map(|line| line.strip_prefix("cuesta ")?.split_whitespace().next())
        .filter(|name| name.starts_with(char::is_alphabetic) && !ELSEWHERE.contains(name))
        .collect();
    let watched: BTreeSet<_> = COMMANDS.iter().map(|command| command[0]).collect();
    assert_eq!(listed, watched);
}

#[test]
fn no_command_runs_longer_than_its_bound_on_a_hard_field() {
    #[cfg(feature = "vulkan")]
    let has_device = with_a_device::has_device();
    #[cfg(not(feature = "vulkan"))]
    let has_device = false;
    let commands = if has_device { COMMANDS } else { &COMMANDS[..WITHOUT_A_DEVICE] };
    let fields: Vec<_> = stress::cases()
        .filter(|case| case.family == "data")
        .filter_map(|case| if let Kind::Terrain(terrain) = &case.kind { Some((case.name, terrain)) } else { None })
        .collect();
    let failures: Vec<String> = (0..fields.len())
        .into_par_iter()
        .flat_map_iter(|k| {
            let ((name, terrain), folder) = (fields[k], folder());
            save(&terrain().field, &folder.path().join("field.tif")).expect("room for a field");
            // Techniques take turns: each draws some of the fields.
            let technique = TECHNIQUES[k % TECHNIQUES.len()].name;
            let word = |word: &'static str| match word {
                "F" => "field.tif",
                "T" => technique,
                other => other,
            };
            let run = |command: &&[&'static str]| {
                let arguments: Vec<_> = command.iter().map(|part| word(part)).collect();
                watched(folder.path(), &arguments).err().map(|why| format!("{name}: {why}"))
            };
            commands.iter().filter_map(run).collect::<Vec<_>>()
        })
        .collect();
    assert!(failures.is_empty(), "{failures:#?}");
}
