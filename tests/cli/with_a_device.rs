//! Subcommands that need a device. Without one the tests print so and pass, unless REQUIRE_GPU=1.

use super::*;

/// Returns true if there is a device; prints a line if not.
pub(super) fn has_device() -> bool {
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
    // A whole circle in few frames: the view changes faster than one step of the controller can follow.
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
    // Times differ between machines; the test checks only that the tolerance moved.
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
        json(folder.path(), &[&view[..], &["--technique", "clusters", "--set", "block=8", "--set", &setting]].concat())
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
fn texture_memory_is_kept_to_or_refused() {
    if !has_device() {
        return;
    }
    let folder = folder();
    image::RgbaImage::new(1024, 1024).save(folder.path().join("large.png")).unwrap();
    let view = ["render", "demo", "-o", "p.png", "--size", "64x36", "--texture-memory", "1"];
    refused(folder.path(), &[&view[..], &["--colour", "ground"]].concat(), &["1 MB: expected at least 2 MB"]);
    assert!(!folder.path().join("p.png").exists());
    // With 4 MB of texels the overlay is streamed, and the picture is complete.
    let rendered = json(folder.path(), &[&view[..], &["--overlay", "large.png"]].concat());
    assert!(rendered["texture_maps"]["bytes"].as_u64().unwrap() <= 1_000_000, "{rendered}");
    let rendered = json(folder.path(), &["render", "demo", "-o", "p.png", "--size", "64x36", "--colour", "ground"]);
    assert_eq!(rendered["texture_maps"]["waiting"], 0);
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
    let stats = plan["figures"].as_array().unwrap();
    let value = |name: &str| stats.iter().find(|f| f["name"] == name).and_then(|f| f["value"].as_f64()).unwrap();
    assert!(value("index bytes, six classes") < value("index bytes, sixteen masks"));
}

/// Compares a table of a profile with its document, cell by cell.
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

/// The layer's best practices warn of common calls, such as naming objects.
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

/// Builds a library of RenderDoc's name that records the calls of its frame capture.
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

/// A failed run leaves the old picture or the new one. Measured rows stay, and the same command continues.
#[test]
fn a_device_that_is_lost_is_told_and_takes_nothing_with_it() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let at = folder.path();
    synth(at, "fractal", "65x65", "land.tif");
    std::fs::write(at.join("p.png"), "old").unwrap();
    let picture = ["render", "land.tif", "-o", "p.png", "--size", "64x36", "--lose-device"];
    for calls in ["0", "3", "7"] {
        refused(at, &[&picture[..], &[calls]].concat(), &["the device is lost"]);
        assert_eq!(std::fs::read(at.join("p.png")).unwrap(), b"old");
    }
    assert_eq!(code(&cuesta(at, &[&picture[..], &["100000"]].concat())), 0);
    image::open(at.join("p.png")).expect("a picture");
    let bench = ["bench", "land.tif", "--out", "b", "--technique", "geomipmap", "--tolerance", "2", "--size", "64x36"];
    let bench = [&bench[..], &["--frames", "4", "--rounds", "2"]].concat();
    refused(at, &[&bench[..], &["--lose-device", "40"]].concat(), &["the device is lost", "rows are kept"]);
    let lines = || std::fs::read_to_string(at.join("b/rows.jsonl")).unwrap().lines().count();
    assert!(lines() >= 1 && lines() < 4, "{} lines", lines());
    assert_eq!(json(at, &bench)["rows"].as_u64(), Some(3));
    let stress = ["stress", "--case", "flat", "--technique", "brute-force", "--lose-device", "5", "--json"];
    let output = cuesta(at, &stress);
    let told: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert!(code(&output) == 1 && told["ended"].as_str().unwrap().contains("the device is lost"), "{told}");
    let failed = told["cases"].as_array().unwrap().iter().filter(|case| case["pass"] == false);
    assert_eq!(failed.count(), 1, "the loss is told once, and what was found without a device stays: {told}");
}

/// The first Ctrl-C ends a benchmark after the current row, and a picture at once.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_rows_and_pictures() {
    use super::robust::interrupted_when;
    if !has_device() {
        return;
    }
    let folder = folder();
    let at = folder.path();
    synth(at, "fractal", "129x129", "land.tif");
    let bench = ["bench", "land.tif", "--out", "b", "--technique", "geomipmap,clusters", "--tolerance", "1,2,4"];
    let bench = [&bench[..], &["--size", "96x54", "--frames", "8", "--rounds", "3"]].concat();
    let lines = || std::fs::read_to_string(at.join("b/rows.jsonl")).map_or(0, |text| text.lines().count());
    let mut stops = 0;
    for kept in [1, 3, 8, 14] {
        let min = kept.max(lines());
        let (output, was_running) = interrupted_when(at, &bench, || lines() > min);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let is_stopped = said.contains("the same command resumes");
        assert_eq!(code(&output), i32::from(is_stopped), "{said}");
        assert!(at.join("b/index.html").is_file() && lines() > kept);
        stops += u32::from(was_running && is_stopped);
    }
    assert!(stops >= 2, "{stops} runs were stopped");
    let done = json(at, &bench);
    assert_eq!((done["rows"].as_u64(), done["complete"].as_bool(), lines()), (Some(24), Some(true), 25));
    let start = |text: &str| std::fs::write(at.join("p.png"), text).unwrap();
    let picture = ["render", "land.tif", "-o", "p.png", "--size", "320x200", "--repeat", "20"];
    for ms in [0, 30, 60, 100, 150, 250, 400, 700] {
        start("old");
        let begun = std::time::Instant::now();
        let (output, _) = interrupted_when(at, &picture, || begun.elapsed().as_millis() >= ms);
        let is_old = std::fs::read(at.join("p.png")).unwrap() == b"old";
        let is_stopped = output.status.code().is_none_or(|code| code == 2);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(is_stopped || code(&output) == 0, "{ms} ms: {:?} {said}", output.status);
        assert!(is_old || image::open(at.join("p.png")).is_ok_and(|p| p.width() == 320), "{ms} ms");
        assert!(is_stopped || !is_old, "{ms} ms");
    }
    let beside = std::fs::read_dir(at).unwrap().count();
    assert_eq!(beside, 3, "land.tif, p.png and b, and nothing else");
}

/// Loaders without a driver, and with the same driver twice.
#[test]
fn drivers_that_are_missing_or_there_twice_are_told() {
    if !has_device() {
        return;
    }
    let folder = folder();
    let at = folder.path();
    let with_drivers = |files: &str, arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
        command.env("VK_DRIVER_FILES", files).env("VK_ICD_FILENAMES", files).env("VK_LOADER_DRIVERS_DISABLE", "");
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        command.args(arguments).current_dir(at).output().expect("the program starts")
    };
    for arguments in
        [&["render", "demo", "-o", "p.png"][..], &["bench", "demo", "--out", "b"], &[], &["info", "--devices"]]
    {
        let output = with_drivers("/nowhere/at/all.json", arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(code(&output), 2, "{arguments:?}: {said}");
        assert!(
            said.lines().last().is_some_and(|line| line.starts_with("error: ") && line.contains("Vulkan")),
            "{said}"
        );
    }
    let stress = ["stress", "--case", "flat", "--technique", "brute-force"];
    let output = with_drivers("/nowhere/at/all.json", &stress);
    assert!(
        code(&output) == 0 && String::from_utf8_lossy(&output.stderr).contains("no pictures"),
        "no device is needed"
    );
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let file = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let Some(file) = file.map(|entry| entry.path()).find(|path| path.to_string_lossy().contains("lvp")) else {
        println!("skipped: no driver of which there could be two");
        return;
    };
    std::fs::copy(&file, at.join("again.json")).unwrap();
    let both = format!("{}:{}", file.display(), at.join("again.json").display());
    let output = with_drivers(&both, &["info", "--devices", "--json"]);
    let told: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert_eq!(told["devices"].as_array().unwrap().len(), 2, "{told}");
    for device in ["cpu", "llvmpipe"] {
        let arguments =
            ["render", "demo", "-o", "p.png", "--size", "64x36", "--device", device, "--validate", "--json"];
        assert_eq!(code(&with_drivers(&both, &arguments)), 0, "{device}");
    }
}

/// A display without a server, and no display.
#[cfg(feature = "viewer")]
#[test]
fn without_a_display_the_window_says_so() {
    let folder = folder();
    refused(folder.path(), &["view", "demo"], &["no display"]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
    let output = command.args(["view", "demo"]).env("DISPLAY", ":4711").env_remove("WAYLAND_DISPLAY").output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(code(&output) == 2 && said.starts_with("error: no window") && said.lines().count() == 1, "{said}");
}
