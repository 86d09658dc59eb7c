//! Faults around the program: a full disk, an unwritable path, a closed pipe, Ctrl-C. The program prints one line, exits
//! with code 2, and leaves the old file or the new one, and nothing else.
#![cfg(unix)]

use std::os::unix::fs::symlink;
use std::process::Stdio;
use std::time::{Duration, Instant};

use super::*;
use crate::height::tiff_file::{Tag, TiffFile};

/// Limits the size of every written file, kibibytes: a full disk without special rights.
fn with_room(folder: &Path, kib: u32, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_cuesta");
    // Without the signal a write fails as on a full disk.
    let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", 2 * kib);
    let mut command = Command::new("sh");
    command.args(["-c", &script, "sh", program]).args(arguments).current_dir(folder);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").output().expect("a shell")
}

/// Returns the names in a folder.
fn listing(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let mut files: Vec<_> = entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).expect("a file")))
        .collect();
    files.sort();
    files
}

fn assert_one_line(output: &Output, parts: &[&str], what: &str) {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(code(output), 2, "{what}: {said}");
    assert!(said.starts_with("error: ") && said.trim_end().lines().count() == 1, "{what}: {said}");
    assert!(parts.iter().all(|part| said.contains(part)), "{what}: {said}");
}

/// Returns every command that writes a file without a device.
const WRITERS: [&[&str]; 8] = [
    &["synth", "fractal", "--size", "257x257", "-o", "out.tif"],
    &["synth", "fractal", "--size", "257x257", "-o", "out.png"],
    &["synth", "fractal", "--size", "257x257", "-o", "out.asc"],
    &["synth", "fractal", "--size", "257x257", "-o", "out.r16"],
    &["export", "land.tif", "-o", "out.ply", "--tolerance", "0.01"],
    &["export", "land.tif", "-o", "out.obj", "--tolerance", "0.01"],
    &["export", "land.tif", "-o", "out.glb", "--tolerance", "0.01"],
    &["info", "land.tif", "--working-set", "out.png", "--size", "320x200", "--technique", "sphere-tree"],
];

#[test]
fn a_full_disk_leaves_the_file_that_was_there() {
    let folder = folder();
    synth(folder.path(), "fractal", "129x129", "land.tif");
    for arguments in WRITERS {
        let name = arguments[arguments.iter().position(|word| word.starts_with("out.")).unwrap()];
        std::fs::write(folder.path().join(name), "what was there").unwrap();
        let before = listing(folder.path());
        for kib in [0, 1, 8] {
            let output = with_room(folder.path(), kib, arguments);
            assert_one_line(&output, &[name], &format!("{arguments:?}, {kib} KiB"));
            assert_eq!(listing(folder.path()), before, "{arguments:?}: {kib} KiB");
        }
        assert_eq!(code(&with_room(folder.path(), 1 << 20, arguments)), 0, "{arguments:?}: there is room");
        assert_ne!(listing(folder.path()), before, "{arguments:?}");
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
}

#[test]
fn a_full_disk_leaves_the_rows_and_their_report() {
    let (folder, fields) = (folder(), vec![mock::field(33)]);
    let run = folder.path().join("run");
    mock::run(&run, fields.clone(), mock::cases(&fields, &["spin"]), 2);
    json(folder.path(), &["report", "run"]);
    let before = listing(&run);
    for kib in [0, 1, 20] {
        assert_one_line(&with_room(folder.path(), kib, &["report", "run"]), &["run"], &format!("{kib} KiB"));
        assert_eq!(listing(&run), before, "{kib} KiB");
    }
    let stress = ["stress", "--case", "flat", "--technique", "brute-force", "--no-device", "--out", "kept"];
    let output = with_room(folder.path(), 0, &stress);
    assert_one_line(&output, &["kept", "stress.json"], "stress");
    assert!(stdout(&output).contains("checks passed"), "what was found is said all the same");
    assert!(listing(&folder.path().join("kept")).is_empty(), "no part of a file");
}

/// Returns paths that not even the superuser can write to: below a file, and where the kernel refuses.
#[test]
fn what_cannot_be_written_is_named() {
    let folder = folder();
    synth(folder.path(), "fractal", "65x65", "land.tif");
    std::fs::write(folder.path().join("file"), "").unwrap();
    let before = listing(folder.path());
    let places = ["file/", "/proc/"].into_iter().filter(|place| *place != "/proc/" || Path::new("/proc/self").exists());
    for place in places {
        for arguments in WRITERS {
            let words: Vec<_> = arguments.iter().map(|word| word.replace("out.", &format!("{place}out."))).collect();
            let words: Vec<_> = words.iter().map(String::as_str).collect();
            assert_one_line(&cuesta(folder.path(), &words), &[place], &format!("{words:?}"));
        }
        let kept = format!("{place}kept");
        let stress = ["stress", "--family", "file", "--case", "odd tiles", "--no-device", "--out", &kept];
        assert_one_line(&cuesta(folder.path(), &stress), &[place], "stress");
        assert_one_line(&cuesta(folder.path(), &["report", &kept]), &[place], "report");
    }
    assert_eq!(listing(folder.path()), before);
    std::fs::create_dir(folder.path().join("folder.tif")).unwrap();
    refused(folder.path(), &["synth", "flat", "-o", "folder.tif"], &["folder.tif"]);
}

/// Runs a command with its outputs redirected.
fn to(folder: &Path, arguments: &[&str], out: Stdio, err: Stdio) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
    command.args(arguments).current_dir(folder).stdout(out).stderr(err).output().expect("the program starts")
}

#[test]
fn a_reader_that_has_gone_is_no_failure() {
    let folder = folder();
    synth(folder.path(), "fractal", "65x65", "land.tif");
    let calls: [&[&str]; 6] = [
        &["info", "land.tif", "--json"],
        &["info", "land.tif"],
        &["--help"],
        &["export", "land.tif", "-o", "out.ply", "--json"],
        &["stress", "--list"],
        &["stress", "--family", "file", "--case", "odd tiles", "--no-device"],
    ];
    for arguments in calls {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = to(folder.path(), arguments, writer.into(), Stdio::piped());
        assert_eq!((code(&output), output.stderr.len()), (0, 0), "{arguments:?}: {:?}", output.stderr);
        // Nor may an output contain one of the faults.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let wrong = [&["--no-such-flag"], arguments].concat();
        assert_eq!(code(&to(folder.path(), &wrong, Stdio::null(), writer.into())), 2, "{wrong:?}");
    }
    assert!(folder.path().join("out.ply").is_file(), "the work is done all the same");
}

#[cfg(target_os = "linux")]
#[test]
fn no_room_for_what_is_said_is_a_failure() {
    let folder = folder();
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    for arguments in [&["info", "demo", "--json"][..], &["info", "demo"], &["--help"], &["stress", "--list"]] {
        let output = to(folder.path(), arguments, full().into(), Stdio::piped());
        assert_one_line(&output, &["stdout"], &format!("{arguments:?}"));
        assert_eq!(code(&to(folder.path(), arguments, full().into(), full().into())), 2, "{arguments:?}");
    }
    symlink("/dev/full", folder.path().join("full.png")).unwrap();
    let output = cuesta(folder.path(), &["synth", "flat", "--size", "9x9", "-o", "full.png"]);
    assert_eq!(code(&output), 0, "the link is replaced, as any file is");
}

/// Interrupts a command after a delay. Returns true if it was still running.
fn interrupted(folder: &Path, arguments: &[&str], after: Duration) -> (Output, bool) {
    let start = Instant::now();
    interrupted_when(folder, arguments, || start.elapsed() >= after)
}

/// Interrupts a command as soon as a condition holds.
pub(super) fn interrupted_when(folder: &Path, arguments: &[&str], is_time: impl Fn() -> bool) -> (Output, bool) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
    command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut program = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").spawn().expect("it starts");
    while !is_time() && program.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let was_running = program.try_wait().expect("a child").is_none();
    if was_running {
        let sent = Command::new("kill").args(["-INT", &program.id().to_string()]).status();
        assert!(sent.expect("kill").success());
    }
    (program.wait_with_output().expect("it ends"), was_running)
}

/// A quarter of a second is too short for any result; four seconds are enough for all.
#[test]
fn an_interrupt_at_any_moment_leaves_whole_files_only() {
    let folder = folder();
    synth(folder.path(), "fractal", "257x257", "land.tif");
    let mut stopped = 0;
    for arguments in [WRITERS[0], WRITERS[2], WRITERS[5]] {
        let larger: Vec<_> = arguments.iter().map(|word| word.replace("257x257", "1500x1500")).collect();
        let larger: Vec<_> = larger.iter().map(String::as_str).collect();
        let name = arguments[arguments.iter().position(|word| word.starts_with("out.")).unwrap()];
        let path = folder.path().join(name);
        let started = Instant::now();
        assert_eq!(code(&cuesta(folder.path(), &larger)), 0);
        let (whole, takes) = (std::fs::read(&path).unwrap(), started.elapsed());
        for part in 0..12 {
            std::fs::write(&path, "old").unwrap();
            let (output, was_running) = interrupted(folder.path(), &larger, takes.mul_f64(f64::from(part) / 11.0));
            let found = std::fs::read(&path).unwrap();
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            // At its very start a signal ends any program.
            let is_stopped = output.status.code().is_none_or(|code| code == 2);
            assert!(is_stopped || code(&output) == 0, "{arguments:?}: {said}");
            assert!(found == b"old" || found == whole, "{arguments:?}: {} bytes", found.len());
            assert!(is_stopped || found == whole, "{arguments:?}: {said}");
            stopped += u32::from(is_stopped && was_running);
            let names: Vec<_> = listing(folder.path()).into_iter().map(|(name, _)| name).collect();
            assert_eq!(names, ["land.tif", name].map(String::from), "nothing is left beside it");
        }
        std::fs::remove_file(&path).unwrap();
    }
    assert!(stopped > 6, "{stopped} calls were stopped");
}

/// A stopped suite prints its findings, and that it was stopped.
#[test]
fn an_interrupted_suite_tells_what_it_found() {
    let folder = folder();
    let arguments = ["stress", "--family", "file", "--family", "data", "--no-device", "--out", "kept", "--json"];
    for wait in 1..40 {
        let (output, was_running) = interrupted(folder.path(), &arguments, Duration::from_millis(100 * wait));
        let told: Option<Value> = serde_json::from_str(&stdout(&output)).ok();
        // The signal came before the handler was installed, or after the end.
        let Some(told) = told.filter(|_| was_running) else { continue };
        let Some(why) = told["ended"].as_str() else { continue };
        assert!(why.contains("stopped") && code(&output) == 1, "{why}, exit code {}", code(&output));
        let cases = told["cases"].as_array().unwrap();
        assert!(!cases.is_empty() && cases.iter().all(|case| case["pass"] == true), "{told}");
        let kept: Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("kept/stress.json")).unwrap()).unwrap();
        assert_eq!(kept, told);
        assert!(
            std::fs::read_to_string(folder.path().join("kept/index.html")).unwrap().contains("runs were not executed")
        );
        return;
    }
    panic!("the suite was never stopped in time");
}

/// Found by fuzzing: a text that claims more than the file holds made the decoder print to stderr.
#[test]
fn a_text_longer_than_its_file_is_one_line() {
    let folder = folder();
    let file = TiffFile::new([5, 4], 16, 2).tag(42112, Tag::Text("a text of more than four bytes".to_string()));
    let mut bytes = file.bytes(|i, j| (i * j) as f64);
    let entry = bytes.windows(4).position(|four| four == [0x80, 0xa4, 2, 0]).expect("its entry");
    bytes[entry + 4..entry + 8].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
    std::fs::write(folder.path().join("claim.tif"), bytes).unwrap();
    refused(folder.path(), &["info", "claim.tif"], &["claim.tif", "directory", "42112"]);
}

/// Found by fuzzing: no tolerance suffices beyond the range of f64, and 10^-300 px took an hour.
#[test]
fn lengths_beyond_reason_are_refused_and_fine_tolerances_are_not_slow() {
    let folder = folder();
    let endless = ["export", "endless", "--technique", "sphere-tree", "-o", "m.ply"];
    for (flag, value) in [
        ("--eye", "0,1e268,9e24"),
        ("--ortho", "2.2e-308"),
        ("--near", "1e-300"),
        ("--tolerance", "1e-300"),
        ("--look", "1e13,0,0"),
        ("--eye", "5,+1e300,5"),
    ] {
        refused(folder.path(), &[&endless[..], &[flag, value]].concat(), &[flag, value]);
    }
    refused(folder.path(), &["info", "demo", "--spacing", "1e-300"], &["--spacing", "1e-9"]);
    let near = ["--eye", "200000,+3,200000", "--pitch", "-20", "--tolerance", "1e-9"];
    assert!(json(folder.path(), &[&endless[..], &near].concat())["triangles"].as_u64() > Some(1000));
}
