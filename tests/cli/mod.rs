//! The program, run as a person runs it.

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
    refused(at, &["export", "demo", "-o", "m.ply", "--ceiling", "demo"], &["--ceiling", "sorted-strips", "geomipmap"]);
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
    for entry in cuesta::lod::TECHNIQUES {
        assert!(help.contains(entry.name), "{}", entry.name);
    }
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

#[cfg(feature = "vulkan")]
mod with_a_device {
    use super::*;

    /// Whether there is a device; without one, says so.
    fn has_device() -> bool {
        let output = cuesta(folder().path(), &["info", "--devices", "--json"]);
        let found = code(&output) == 0 && stdout(&output).contains("\"usable\": true");
        assert!(found || std::env::var("REQUIRE_GPU").as_deref() != Ok("1"), "no device");
        if !found {
            println!("skipped: no Vulkan device");
        }
        found
    }

    #[test]
    fn render_measures_what_it_drew() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let view = ["render", "demo", "-o", "p.png", "--size", "160x90", "--measure", "--validate"];
        for technique in ["brute-force", "geomipmap"] {
            let rendered = json(folder.path(), &[&view[..], &["--technique", technique]].concat());
            for field in [
                "technique",
                "metric",
                "tolerance_px",
                "size",
                "triangles",
                "vertices",
                "draws",
                "commands",
                "batches",
                "levels",
                "select_ms",
                "record_ms",
                "gpu_ms",
                "device_bytes",
                "validation_messages",
                "error_px",
                "error_m",
                "hole_pixels",
                "skirt_pixels",
                "watertight",
            ] {
                assert!(rendered.get(field).is_some(), "{field}");
            }
            assert_eq!(rendered["hole_pixels"].as_u64(), Some(0));
            assert_eq!(rendered["watertight"].as_bool(), Some(true));
            let error = rendered["error_px"]["max"].as_f64().unwrap();
            assert!(if technique == "brute-force" { error < 1e-6 } else { error > 0.05 && error <= 1.0 }, "{error}");
            let picture = image::open(folder.path().join("p.png")).unwrap();
            assert_eq!((picture.width(), picture.height()), (160, 90));
        }
    }

    #[test]
    fn a_field_too_large_for_a_technique_is_refused() {
        let folder = folder();
        let tiled = ["export", "demo", "--tile", "400,400", "-o", "m.obj", "--technique"];
        refused(folder.path(), &[&tiled[..], &["sphere-tree"]].concat(), &["sphere-tree", "samples", "at most"]);
        refused(folder.path(), &[&tiled[..], &["smooth-tiles"]].concat(), &["smooth-tiles", "samples", "at most"]);
    }

    #[test]
    fn a_benchmark_holds_what_it_is_asked_for() {
        let folder = folder();
        for wrong in ["0", "inf", "many"] {
            refused(folder.path(), &["bench", "demo", "--out", "b", "--triangles", wrong], &["--triangles", wrong]);
            refused(folder.path(), &["bench", "demo", "--out", "b", "--frame-time", wrong], &["--frame-time", wrong]);
        }
        if !has_device() {
            return;
        }
        synth(folder.path(), "eroded", "257x257", "land.tif");
        // A whole circle in so few frames: what is in sight changes faster than one step can follow.
        let case = ["--technique", "sorted-strips", "--path", "circle", "--frames", "40", "--size", "160x90"];
        let goals = ["--triangles", "3000,10000", "--frame-time", "4", "--rounds", "1", "--out", "b"];
        let output = cuesta(folder.path(), &[&["bench", "land.tif"][..], &case, &goals].concat());
        assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.path().join("b/results.json")).unwrap();
        let results: Value = serde_json::from_str(&text).unwrap();
        let cases = results["cases"].as_array().unwrap();
        assert_eq!(cases.len(), 3);
        for (case, target) in cases.iter().zip([3000.0, 10000.0]) {
            assert_eq!(case["case"]["goal"]["triangles"].as_f64(), Some(target), "{case}");
            let mean = case["time"]["triangles"].as_f64().unwrap() / target;
            assert!((0.9..1.1).contains(&mean), "{target}: {mean} of it on average");
            assert!(case["time"]["held"]["within"].as_f64().unwrap() > 0.1, "{case}");
        }
        // Milliseconds are the machine's own: what counts is that the tolerance moved.
        let tolerance = &cases[2]["time"]["held"]["tolerance_px"];
        assert_eq!(cases[2]["case"]["goal"]["frame_ms"].as_f64(), Some(4.0));
        assert!(tolerance["max"].as_f64() > tolerance["mean"].as_f64(), "{tolerance}");
    }

    #[test]
    fn skirt_pixels_are_counted() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let view = ["render", "demo", "-o", "p.png", "--size", "640x360", "--measure", "--tolerance", "2"];
        let of = |seams: &str| {
            let setting = format!("seams={seams}");
            json(
                folder.path(),
                &[&view[..], &["--technique", "clusters", "--set", "block=8", "--set", &setting]].concat(),
            )
        };
        for (seams, has) in [("stitched", false), ("skirts", true)] {
            let rendered = of(seams);
            for count in ["skirt_pixels", "skirt_triangles"] {
                assert_eq!(rendered[count].as_u64().unwrap() > 0, has, "{seams} {rendered}");
            }
            assert_eq!((rendered["hole_pixels"].as_u64(), rendered["watertight"].as_bool()), (Some(0), Some(true)));
        }
    }

    #[test]
    fn without_a_subcommand_and_a_display_a_picture_is_drawn() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let output = cuesta(folder.path(), &[]);
        assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
        assert!(String::from_utf8_lossy(&output.stderr).contains("cuesta.png"));
        assert!(folder.path().join("cuesta.png").is_file());
    }

    #[test]
    fn what_the_device_cannot_do_is_named() {
        if !has_device() {
            return;
        }
        let folder = folder();
        refused(folder.path(), &["render", "demo", "-o", "p.png", "--device", "no such device"], &["no such device"]);
        refused(folder.path(), &["render", "demo", "-o", "p.png", "--size", "99999x10"], &["maxImageDimension2D"]);
        refused(folder.path(), &["render", "demo", "-o", "p.jpg"], &["p.jpg", ".png"]);
        assert!(!folder.path().join("p.png").exists(), "no half a picture");
    }

    #[test]
    fn the_plan_says_what_is_left_out() {
        if !has_device() {
            return;
        }
        let plan = json(folder().path(), &["info", "demo", "--plan"]);
        let names = |list: &str| -> Vec<String> {
            plan[list].as_array().unwrap().iter().map(|d| d["feature"].as_str().unwrap().to_string()).collect()
        };
        assert!(names("kept").contains(&"overlay".to_string()));
        assert!(names("left_out").contains(&"fog".to_string()) && names("left_out").contains(&"hole mask".to_string()));
        let figures = plan["figures"].as_array().unwrap();
        let value = |name: &str| figures.iter().find(|f| f["name"] == name).and_then(|f| f["value"].as_f64()).unwrap();
        assert!(value("index bytes, six classes") < value("index bytes, sixteen masks"));
    }

    /// A table of a profile against the same rows of its document: every cell.
    fn assert_same_rows(folder: &Path, table: &str, rows: &Value) {
        let mut reader = csv::Reader::from_path(folder.join(table)).unwrap();
        let heads = reader.headers().unwrap().clone();
        let lines: Vec<_> = reader.records().map(|record| record.unwrap()).collect();
        let rows = rows.as_array().unwrap();
        assert!(!rows.is_empty() && lines.len() == rows.len(), "{table}: {} lines", lines.len());
        for (line, row) in lines.iter().zip(rows) {
            assert_eq!(heads.len(), row.as_object().unwrap().len(), "{table}");
            for (head, cell) in heads.iter().zip(line) {
                let same = match &row[head] {
                    Value::Null => cell.is_empty(),
                    Value::String(text) => cell == text,
                    number => cell.parse() == Ok(number.as_f64().unwrap()),
                };
                assert!(same, "{table}: {head} is {cell}, {}", row[head]);
            }
        }
    }

    #[test]
    fn profile_writes_tables_a_document_and_a_trace_that_agree() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let arguments = ["profile", "demo", "--out", "new/p", "--size", "160x90", "--frames", "2", "--validate"];
        let printed = json(folder.path(), &arguments);
        let out = folder.path().join("new/p");
        let read = |name: &str| -> Value { serde_json::from_slice(&std::fs::read(out.join(name)).unwrap()).unwrap() };
        assert_eq!(printed, read("profile.json"), "what is printed is what is written");
        assert_eq!(printed["schema"], 1);
        assert!(["calibrated", "aligned, not calibrated"].map(Value::from).contains(&printed["clock"]));
        assert_eq!(printed["frames"], 2);
        assert_eq!(printed["trace"], "new/p/trace.json");
        for table in ["passes", "draws", "modes"] {
            assert_same_rows(&out, &format!("{table}.csv"), &printed[table]);
        }
        let slices = crate::profile::trace_format::check(&read("trace.json")).expect("a valid trace");
        let drawn = slices.iter().filter(|s| s.category == "draw").count();
        assert_eq!(drawn, printed["draws"].as_array().unwrap().len());
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), 5, "nothing else is left there");
    }

    /// The layer's best practices warn of what every tool does (naming objects, for one).
    #[test]
    fn a_validation_message_ends_with_exit_code_1() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let calls: [&[&str]; 3] = [
            &["render", "demo", "-o", "a.png", "--size", "64x36"],
            &["profile", "demo", "--out", "profile", "--size", "64x36", "--frames", "1"],
            &[
                "bench",
                "demo",
                "--out",
                "bench",
                "--size",
                "64x36",
                "--quick",
                "--technique",
                "geomipmap",
                "--tolerance",
                "9",
            ],
        ];
        for arguments in calls {
            let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
            command.env("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT");
            let output = command.args(arguments).args(["--validate", "--json"]).current_dir(folder.path()).output();
            let output = output.expect("the program starts");
            let document: Value = serde_json::from_str(&stdout(&output)).expect("one JSON document");
            let messages = document["validation_messages"].as_array().map_or(0, Vec::len);
            assert!(code(&output) == 1 && messages > 0, "{arguments:?}: exit code {}, {messages}", code(&output));
        }
    }

    #[test]
    fn profile_says_in_one_line_what_it_cannot_do() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let arguments = ["profile", "demo", "--out", "p", "--size", "64x36", "--frames", "1", "--renderdoc"];
        let output = cuesta(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(code(&output), 0, "{said}");
        assert_eq!(said.lines().filter(|line| line.contains("RenderDoc's library is not loaded")).count(), 1, "{said}");
        let table = stdout(&output);
        for part in ["terrain", "geomipmap lattice triangles level", "geomipmap:draw-per-block direct", "trace.json"] {
            assert!(table.contains(part), "{table}");
        }
        std::fs::write(folder.path().join("file"), "").unwrap();
        refused(folder.path(), &["profile", "demo", "--out", "file", "--frames", "1"], &["file", "folder"]);
        refused(folder.path(), &["profile", "demo", "--out", "q", "--frames", "0"], &["--frames"]);
        refused(folder.path(), &["profile", "demo"], &["--out"]);
        assert!(!folder.path().join("q").exists());
    }

    /// A library of RenderDoc's name whose frame capture notes what it was called for.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_loaded_renderdoc_captures_the_slowest_mode() {
        if !has_device() {
            return;
        }
        let folder = folder();
        let at = folder.path();
        std::fs::write(at.join("fake.c"), include_str!("renderdoc.c")).unwrap();
        let built = Command::new("cc")
            .args(["-shared", "-fPIC", "-Wl,-soname,librenderdoc.so", "-o", "librenderdoc.so", "fake.c"])
            .current_dir(at)
            .status();
        assert!(built.expect("a C compiler, which building needs too").success());
        let profile = |variable: &str, value: PathBuf| -> Value {
            let output = Command::new(env!("CARGO_BIN_EXE_cuesta"))
                .args(["profile", "demo", "--out", "p", "--size", "64x36", "--frames", "1", "--renderdoc", "--json"])
                .current_dir(at)
                .env(variable, value)
                .output()
                .unwrap();
            assert_eq!(code(&output), 0, "{}", String::from_utf8_lossy(&output.stderr));
            serde_json::from_str(&stdout(&output)).unwrap()
        };
        let printed = profile("LD_LIBRARY_PATH", at.to_path_buf());
        assert!(printed.get("capture").is_none() && !at.join("calls").exists(), "it is not loaded where it can be");
        let printed = profile("LD_PRELOAD", at.join("librenderdoc.so"));
        assert_eq!(printed["capture"]["file"], "/captures/frame_0.rdc");
        assert!(printed["capture"]["mode"].as_str().unwrap().starts_with("geomipmap"));
        assert_eq!(std::fs::read_to_string(at.join("calls")).unwrap(), "start\nend\n");
    }
}
