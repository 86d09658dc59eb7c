//! The program, run as a person runs it.

mod endless;
mod info;
mod numbers;
#[cfg(feature = "vulkan")]
mod overlays;
mod robust;
mod several;
mod watchdog;
#[cfg(feature = "vulkan")]
mod with_a_device;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::bench::mock;

/// Runs the program in a folder.
fn cuesta(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
    command.args(arguments).current_dir(folder).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.output().expect("the program starts")
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("it ended by itself")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

/// Runs it with --json and returns the document, which is all of stdout.
fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = cuesta(folder, &[arguments, &["--json"]].concat());
    assert_eq!(code(&output), 0, "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&stdout(&output)).expect("one JSON document")
}

/// Holds that a call fails as promised: exit code 2, nothing on stdout, one line on stderr with these parts.
fn refused(folder: &Path, arguments: &[&str], parts: &[&str]) {
    let output = cuesta(folder, arguments);
    let line = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(code(&output), 2, "{arguments:?}: {line}");
    assert_eq!(stdout(&output), "", "{arguments:?}");
    assert!(line.starts_with("error: ") && line.trim_end().lines().count() == 1, "{arguments:?}: {line}");
    for part in parts {
        assert!(line.contains(part), "{arguments:?}: {line:?} lacks {part:?}");
    }
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder for a test")
}

fn synth(folder: &Path, kind: &str, size: &str, file: &str) -> PathBuf {
    json(folder, &["synth", kind, "--size", size, "-o", file]);
    folder.join(file)
}

#[test]
fn info_prints_the_contract() {
    let info = json(folder().path(), &["info", "demo"]);
    for field in [
        "format",
        "width",
        "height",
        "spacing_m",
        "origin",
        "crs",
        "min_m",
        "max_m",
        "mean_m",
        "hole_count",
        "sample_type",
        "exact_in_16_bit",
    ] {
        assert!(info.get(field).is_some(), "{field}");
    }
    assert_eq!((info["width"].as_u64(), info["height"].as_u64()), (Some(1025), Some(1025)));
    assert_eq!(info["spacing_m"][0].as_f64(), Some(25.0));
    assert_eq!(info["exact_in_16_bit"].as_bool(), Some(true));
}

#[test]
fn options_change_what_is_read() {
    let folder = folder();
    let arguments =
        ["info", "demo", "--crop", "100,200,30,20", "--spacing", "7,9", "--height-scale", "2", "--tile", "2,3"];
    let info = json(folder.path(), &arguments);
    let lowered = json(folder.path(), &[&arguments[..], &["--height-offset", "-5"]].concat());
    assert!((lowered["max_m"].as_f64().unwrap() + 5.0 - info["max_m"].as_f64().unwrap()).abs() < 1e-3);
    assert_eq!((info["width"].as_u64(), info["height"].as_u64()), (Some(60), Some(60)));
    assert_eq!(
        info["spacing_m"].as_array().map(|s| s.iter().map(|v| v.as_f64().unwrap()).collect()),
        Some(vec![7.0, 9.0])
    );
    let plain = json(folder.path(), &["info", "demo", "--crop", "100,200,30,20"]);
    let double = 2.0 * plain["max_m"].as_f64().unwrap();
    assert!((info["max_m"].as_f64().unwrap() - double).abs() < 1e-3 * double);
}

#[test]
fn synth_writes_what_info_reads_in_every_format() {
    let folder = folder();
    for file in ["a.tif", "a.png", "a.asc"] {
        let made = json(folder.path(), &["synth", "cliff", "--size", "33x17", "--seed", "3", "-o", file]);
        let read = json(folder.path(), &["info", file]);
        for field in ["width", "height", "min_m", "max_m"] {
            assert_eq!(made[field], read[field], "{file}: {field}");
        }
    }
    synth(folder.path(), "fractal", "33x17", "a.r16");
    let raw = json(folder.path(), &["info", "a.r16", "--raw", "33x17:u16le"]);
    assert_eq!(raw["width"].as_u64(), Some(33));
    let again = std::fs::read(synth(folder.path(), "fractal", "33x17", "b.r16")).unwrap();
    assert_eq!(std::fs::read(folder.path().join("a.r16")).unwrap(), again, "the same seed, the same bytes");
}

#[test]
fn stress_prints_the_contract_and_writes_a_page() {
    let folder = folder();
    let arguments = ["stress", "--family", "file", "--case", "odd tiles", "--no-device", "--out", "kept"];
    let found = json(folder.path(), &arguments);
    let cases = found["cases"].as_array().expect("rows");
    assert!(cases.len() >= 3);
    for field in ["family", "name", "technique", "check", "value", "limit", "pass"] {
        assert!(cases.iter().all(|case| case.get(field).is_some()), "{field}");
    }
    let kept = std::fs::read_to_string(folder.path().join("kept/stress.json")).expect("rows");
    assert_eq!(serde_json::from_str::<Value>(&kept).expect("JSON"), found);
    let page = folder.path().join("kept/index.html");
    std::fs::remove_file(&page).expect("a page");
    json(folder.path(), &["report", "kept"]);
    assert!(std::fs::read_to_string(page).expect("a page again").contains("<h1>Stress suite</h1>"));
    refused(folder.path(), &["stress", "--family", "weather"], &["--family weather", "position", "stiff"]);
    refused(folder.path(), &["stress", "--case", "weather"], &["--case weather"]);
    refused(folder.path(), &["stress", "--technique", "clusters:x"], &["--technique clusters:x", "gpu-driven"]);
}

#[test]
fn export_writes_meshes_that_others_read() {
    let folder = folder();
    synth(folder.path(), "fractal", "65x49", "a.tif");
    for (file, magic) in [("m.ply", &b"ply\n"[..]), ("m.obj", b"# x east"), ("m.glb", b"glTF")] {
        let counts = json(folder.path(), &["export", "a.tif", "-o", file, "--technique", "brute-force"]);
        assert_eq!(counts["triangles"].as_u64(), Some(2 * 64 * 48), "{file}");
        assert_eq!(counts["vertices"].as_u64(), Some(65 * 49), "{file}");
        assert!(std::fs::read(folder.path().join(file)).unwrap().starts_with(magic), "{file}");
    }
    let coarse = json(folder.path(), &["export", "a.tif", "-o", "c.obj", "--tolerance", "64"]);
    assert!(coarse["triangles"].as_u64().unwrap() < 2 * 64 * 48);
    let obj = std::fs::read_to_string(folder.path().join("c.obj")).unwrap();
    let faces = obj.lines().filter(|line| line.starts_with("f ")).count();
    assert_eq!(faces as u64, coarse["triangles"].as_u64().unwrap());
}

#[test]
fn a_setting_that_does_nothing_is_told() {
    let folder = folder();
    synth(folder.path(), "fractal", "65x49", "a.tif");
    let export = ["export", "a.tif", "-o", "m.ply", "--technique", "sorted-strips", "--set", "blend=end"];
    let told = |more: &[&str]| {
        let output = cuesta(folder.path(), &[&export[..], more].concat());
        assert_eq!(code(&output), 0);
        String::from_utf8_lossy(&output.stderr).contains("warning: --set blend=end does nothing with level=certified")
    };
    assert!(told(&[]) && !told(&["--quiet"]) && !told(&["--set", "level=uniform"]));
}

/// Every edge joins as many triangles one way as the other way, but at the field's rim.
#[test]
fn an_exported_cave_is_closed() {
    let folder = folder();
    for kind in ["cave-floor", "cave-ceiling"] {
        synth(folder.path(), kind, "129x97", &format!("{kind}.tif"));
    }
    let args = ["export", "cave-floor.tif", "--ceiling", "cave-ceiling.tif", "-o", "cave.obj"];
    let counts = json(folder.path(), &[&args[..], &["--technique", "sorted-strips"]].concat());
    assert!(counts["triangles"].as_u64().unwrap() > 2000);
    let painter = [&args[..], &["--technique", "sorted-strips", "--set", "order=painter"]].concat();
    refused(folder.path(), &painter, &["ceiling", "order=painter"]);
    let obj = std::fs::read_to_string(folder.path().join("cave.obj")).unwrap();
    let lines = |first: &str| obj.lines().filter_map(move |line| line.strip_prefix(first)).collect::<Vec<_>>();
    let vertices: Vec<Vec<f64>> =
        lines("v ").iter().map(|line| line.split(' ').map(|n| n.parse().unwrap()).collect()).collect();
    let mut balance = std::collections::HashMap::new();
    for face in lines("f ") {
        let corners: Vec<usize> = face.split(' ').map(|k| k.parse::<usize>().unwrap() - 1).collect();
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
            *balance.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    let is_rim = |k: usize| [0.0, 128.0].contains(&vertices[k][0]) || [0.0, 96.0].contains(&vertices[k][2]);
    let open: Vec<_> = balance.iter().filter(|(_, balance)| **balance != 0).map(|(edge, _)| *edge).collect();
    assert!(!open.is_empty() && open.iter().all(|&(a, b)| is_rim(a) && is_rim(b)), "{} open edges", open.len());
}

#[test]
fn wrong_use_is_one_line_and_exit_code_2() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("torn.tif"), b"II*\0\x08\0\0\0\xff\xff").unwrap();
    std::fs::write(at.join("words.txt"), "these are no heights").unwrap();
    std::fs::write(at.join("huge.asc"), "ncols 9000000\nnrows 9000000\nxllcorner 0\nyllcorner 0\ncellsize 1\n")
        .unwrap();
    refused(at, &["info", "nothing.tif"], &["nothing.tif"]);
    refused(at, &["info", "torn.tif"], &["torn.tif"]);
    refused(at, &["info", "words.txt"], &["words.txt", "--raw"]);
    refused(at, &["info", "huge.asc"], &["huge.asc", "--max-samples"]);
    refused(at, &["info"], &[]);
    refused(at, &["info", "demo", "--spacing=-3"], &["--spacing"]);
    refused(at, &["info", "demo", "--crop", "1,2"], &["--crop"]);
    refused(at, &["info", "demo", "--crop", "0,0,5000,5"], &["crop"]);
    refused(at, &["info", "demo", "--max-samples", "1000"], &["--max-samples"]);
    refused(at, &["export", "demo", "-o", "m.stl"], &["m.stl", ".ply"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--ceiling", "demo"], &["ceiling", "sorted-strips", "geomipmap"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--technique", "magic"], &["magic", "geomipmap"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--technique", "geomipmap:magic"], &["magic", "draw-per-block"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--set", "block=66"], &["block=66", "65"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--set", "colour=red"], &["colour", "block"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--tolerance", "0"], &["--tolerance"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--fov", "180"], &["--fov"]);
    refused(at, &["export", "demo", "-o", "m.ply", "--eye", "1,2"], &["--eye"]);
    refused(at, &["export", "demo", "-o", "no/such/folder/m.ply"], &["m.ply"]);
    refused(at, &["synth", "castle", "-o", "a.tif"], &["castle"]);
    refused(at, &["synth", "flat", "--size", "1x1", "-o", "a.tif"], &["--size"]);
    refused(at, &["synth", "flat", "-o", "a.doc"], &["a.doc"]);
    refused(at, &["bench", "demo"], &["--out"]);
    refused(at, &["bench", "--out", "run"], &["TERRAIN"]);
    refused(at, &["bench", "demo", "--out", "run", "--rounds", "0"], &["--rounds"]);
    refused(at, &["bench", "demo", "--out", "run", "--metric", "best"], &["--metric"]);
    refused(at, &["bench", "compare", "a"], &["<B>"]);
    refused(at, &["bench", "--kit", "--only", "moon", "--out", "run"], &["moon", "peers-1 2049x2049, fly"]);
    refused(at, &["bench", "demo", "--only", "peers", "--out", "run"], &["--kit"]);
    refused(at, &["bench", "compare", "a", "b"], &["rows.jsonl"]);
    refused(at, &["report", "nowhere"], &["nowhere", "rows.jsonl"]);
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 3, "nothing is left behind");
}

#[test]
fn help_names_every_technique() {
    let help = stdout(&cuesta(folder().path(), &["export", "--help"]));
    for entry in cuesta::internal::lod::TECHNIQUES {
        assert!(help.contains(entry.name), "{}", entry.name);
    }
}

#[test]
fn help_lists_the_settings_of_a_named_technique() {
    for entry in cuesta::internal::lod::TECHNIQUES {
        for words in
            [vec!["--technique".to_string(), entry.name.to_string()], vec![format!("--technique={}", entry.name)]]
        {
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let help = stdout(&cuesta(folder().path(), &[&["export", "--help"], &words[..]].concat()));
            assert!(entry.settings.iter().all(|s| help.contains(&format!("--set {}=", s.key))), "{words:?}: {help}");
            assert!(entry.variants.iter().all(|v| help.contains(&format!("{}:{}", entry.name, v.name))), "{help}");
        }
    }
}

/// Views and lights that make no sense are refused, whatever else would be drawn.
#[test]
fn angles_are_finite_and_the_eye_looks_elsewhere() {
    let export = ["export", "demo", "-o", "m.obj"];
    for (flag, value) in [("--yaw", "nan"), ("--pitch", "inf"), ("--roll", "-inf")] {
        refused(folder().path(), &[&export[..], &[flag, value]].concat(), &[flag, "degrees"]);
    }
    let at_itself = ["--eye", "5000,3000,5000", "--look", "5000,3000,5000"];
    refused(folder().path(), &[&export[..], &at_itself].concat(), &["--look", "another point"]);
}

#[cfg(not(feature = "vulkan"))]
#[test]
fn without_vulkan_bench_says_so() {
    refused(folder().path(), &["bench", "demo", "--out", "run"], &["built without Vulkan"]);
}

#[test]
fn compare_and_report_work_from_rows_alone() {
    let (folder, fields) = (folder(), vec![mock::field(33)]);
    for run in ["before", "after"] {
        mock::run(&folder.path().join(run), fields.clone(), mock::cases(&fields, &["spin"]), 3);
    }
    let same = json(folder.path(), &["bench", "compare", "before", "after"]);
    assert_eq!((same["matched"].as_u64(), same["regressions"].as_array().unwrap().len()), (Some(11), 0));
    let report = json(folder.path(), &["report", "before"]);
    for file in ["report", "results"] {
        assert!(folder.path().join(report[file].as_str().unwrap()).is_file(), "{file}");
    }

    let rows = folder.path().join("after/rows.jsonl");
    let text = std::fs::read_to_string(&rows).unwrap();
    let worse = text.replacen("\"watertight\":true", "\"watertight\":false", 1);
    std::fs::write(&rows, worse).unwrap();
    let output = cuesta(folder.path(), &["bench", "compare", "before", "after", "--json"]);
    assert_eq!(code(&output), 1);
    let told: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert!(told["regressions"][0].as_str().unwrap().contains("not watertight 1 instead of 0"), "{told}");
}

#[test]
fn a_field_too_large_for_a_technique_is_refused() {
    let folder = folder();
    let tiled = ["export", "demo", "--tile", "400,400", "-o", "m.obj", "--technique"];
    refused(folder.path(), &[&tiled[..], &["sphere-tree"]].concat(), &["sphere-tree", "samples", "at most"]);
    refused(folder.path(), &[&tiled[..], &["smooth-tiles"]].concat(), &["smooth-tiles", "samples", "at most"]);
}
