//! Tests of the viewer window with real key and mouse events on a virtual display, checked by screenshots. Skipped
//! without Xvfb and xdotool, unless REQUIRE_GPU=1.

mod display;

use std::cell::Cell;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use display::{Display, eventually, picture};
use image::RgbImage;

/// A running viewer on a display.
struct Viewer<'a> {
    display: &'a Display,
    program: Option<Child>,
    window: String,
    folder: tempfile::TempDir,
    pictures: Cell<u32>,
}

impl<'a> Viewer<'a> {
    fn open(display: &'a Display, terrain: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
        command.arg("view").args(terrain).args(["--size", "320x240", "--tolerance", "2", "--validate", "--json"]);
        // Ends even if a key event is lost.
        command.args(["--seconds", "600"]).current_dir(folder.path()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program = display.on(&mut command).spawn().expect("the program starts");
        let window = display.window("cuesta", &mut program);
        let viewer = Self { display, program: Some(program), window, folder, pictures: Cell::new(0) };
        viewer.focus();
        viewer
    }

    fn focus(&self) {
        self.display.xdotool(&format!("windowfocus --sync {}", self.window));
    }

    /// Presses keys in sequence.
    fn press(&self, keys: &str) {
        self.display.xdotool(&format!("key {keys}"));
    }

    fn hold(&self, key: &str, time: Duration) {
        self.display.xdotool(&format!("keydown {key}"));
        std::thread::sleep(time);
        self.display.xdotool(&format!("keyup {key}"));
    }

    /// Takes a screenshot, after the effects of all keys pressed before.
    fn screenshot(&self) -> RgbImage {
        self.press("p");
        self.pictures.set(self.pictures.get() + 1);
        picture(&self.folder.path().join(format!("cuesta-{:03}.png", self.pictures.get())))
    }

    /// Presses keys and takes a screenshot.
    fn screenshot_after(&self, keys: &str) -> RgbImage {
        self.press(keys);
        self.screenshot()
    }

    fn resize(&self, [width, height]: [u32; 2]) {
        self.display.xdotool(&format!("windowsize --sync {} {width} {height}", self.window));
    }

    fn quit(mut self) -> Output {
        self.press("Escape");
        self.program.take().expect("it runs").wait_with_output().expect("it ends")
    }
}

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        if let Some(mut program) = self.program.take() {
            let _ = program.kill();
            let _ = program.wait();
        }
        if std::thread::panicking() {
            self.folder.disable_cleanup(true);
            println!("pictures: {}", self.folder.path().display());
        }
    }
}

/// Returns the share of pixels that differ by more than noise.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let differs = |(p, q): &(&image::Rgb<u8>, &image::Rgb<u8>)| p.0.iter().zip(q.0).any(|(x, y)| x.abs_diff(y) > 12);
    a.pixels().zip(b.pixels()).filter(differs).count() as f64 / f64::from(a.width() * a.height())
}

/// Returns the mean brightness of a rectangle: x, y, width, height as fractions of the image.
fn brightness(picture: &RgbImage, [x, y, w, h]: [f64; 4]) -> f64 {
    let (width, height) = (f64::from(picture.width()), f64::from(picture.height()));
    let at = |share: f64, of: f64| (share * of) as u32;
    let part = image::imageops::crop_imm(picture, at(x, width), at(y, height), at(w, width), at(h, height)).to_image();
    let sum: f64 = part.pixels().map(|p| p.0.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0).sum();
    sum / f64::from(part.width() * part.height())
}

fn on_display(test: impl FnOnce(&Display)) {
    match Display::start() {
        Ok(display) => test(&display),
        Err(missing) => {
            assert!(std::env::var("REQUIRE_GPU").as_deref() != Ok("1"), "{missing}");
            println!("skipped: {missing}");
        }
    }
}

#[test]
fn all_keys_work_in_the_window() {
    on_display(|display| {
        let viewer = Viewer::open(display, &["demo"]);
        numbers_and_help(&viewer);
        let start = viewer.screenshot();
        assert!(brightness(&start, [0.6, 0.0, 0.4, 0.1]) > 180.0, "sky above");
        assert!(brightness(&start, [0.3, 0.4, 0.4, 0.4]) < 150.0, "terrain below");
        colour_modes(&viewer, &start);
        technique_and_tolerance(&viewer, &start);
        movement(&viewer, &start);
        resizing(&viewer);
        end(viewer);
    });
}

/// Checks the statistics at the top left and the help in the middle. Leaves both off.
fn numbers_and_help(viewer: &Viewer) {
    let background = [0.03, 0.04, 0.1, 0.1];
    let with_numbers = viewer.screenshot();
    let with_help = viewer.screenshot_after("h");
    let bare = viewer.screenshot_after("h u");
    assert!(brightness(&with_numbers, background) < 120.0, "statistics have a dark background");
    assert!(brightness(&bare, background) > 180.0, "sky without statistics");
    let text = |p: &RgbImage| p.pixels().filter(|p| p.0.iter().all(|&c| c > 190)).count();
    let corner = |p: &RgbImage| image::imageops::crop_imm(p, 120, 10, 140, 70).to_image();
    assert!(text(&corner(&with_numbers)) > 50, "light text");
    assert!(brightness(&with_help, [0.4, 0.2, 0.2, 0.6]) < brightness(&bare, [0.4, 0.2, 0.2, 0.6]) - 20.0, "help");
}

/// Each colour mode differs from the others, and toggling back restores the image exactly.
fn colour_modes(viewer: &Viewer, start: &RgbImage) {
    let level = viewer.screenshot_after("l");
    assert!(difference(start, &level) > 0.15, "level colours: {}", difference(start, &level));
    let wire = viewer.screenshot_after("l f");
    assert!(difference(start, &wire) > 0.02, "wireframe: {}", difference(start, &wire));
    assert_eq!(difference(start, &viewer.screenshot_after("f")), 0.0, "and back");
    // All colour modes: ground, nodes, level, error, normal, batch, height; then the first one again.
    let mut seen = vec![start.clone()];
    for _ in 0..7 {
        let next = viewer.screenshot_after("c");
        // Ground colours resemble height colours, except for details narrower than samples.
        let min = if seen.len() == 7 { 0.005 } else { 0.05 };
        assert!(seen.iter().all(|other| difference(other, &next) > min), "colours number {}", seen.len());
        seen.push(next);
    }
    assert_eq!(difference(start, &viewer.screenshot_after("c")), 0.0, "and round");
}

/// The window title names the technique, and a larger tolerance changes the levels.
fn technique_and_tolerance(viewer: &Viewer, start: &RgbImage) {
    let title = || viewer.display.xdotool(&format!("getwindowname {}", viewer.window));
    for (k, entry) in cuesta::internal::lod::TECHNIQUES.iter().enumerate() {
        viewer.press(&format!("{}", k + 1));
        eventually("the title", || (title() == format!("cuesta: demo, {}", entry.name)).then_some(()));
        let drawn = viewer.screenshot();
        assert!(difference(start, &drawn) < 0.1, "{}: {}", entry.name, difference(start, &drawn));
    }
    let geomipmap =
        cuesta::internal::lod::TECHNIQUES.iter().position(|entry| entry.name == "geomipmap").expect("in the table");
    let fine = viewer.screenshot_after(&format!("{} l", geomipmap + 1));
    let coarse = viewer.screenshot_after("plus plus plus plus plus plus");
    assert!(difference(&fine, &coarse) > 0.1, "tolerance: {}", difference(&fine, &coarse));
    assert_eq!(difference(&fine, &viewer.screenshot_after("minus minus minus minus minus minus")), 0.0);
    // A frozen list keeps the levels of the old eye position.
    viewer.press("z");
    viewer.hold("s", Duration::from_millis(1500));
    let frozen = viewer.screenshot();
    assert!(difference(&fine, &frozen) > 0.1, "the eye has moved");
    let followed = viewer.screenshot_after("z");
    assert!(difference(&frozen, &followed) > 0.02, "freeze: {}", difference(&frozen, &followed));
    assert_eq!(difference(start, &viewer.screenshot_after("l Home")), 0.0, "home again");
}

/// Keys and mouse move the camera; `Home` returns it.
fn movement(viewer: &Viewer, start: &RgbImage) {
    for camera in ["fly", "orbit", "walk"] {
        viewer.hold("w", Duration::from_millis(600));
        let before = viewer.screenshot();
        if camera != "walk" {
            assert!(difference(start, &before) > 0.1, "{camera}: {}", difference(start, &before));
        }
        viewer.display.xdotool("mousemove 160 120 mousedown 1 mousemove_relative 60 15");
        let turned = viewer.screenshot();
        viewer.display.xdotool("mouseup 1 click 4 click 4 click 5");
        assert!(difference(&before, &turned) > 0.1, "{camera}, dragged: {}", difference(&before, &turned));
        viewer.press("Tab");
    }
    assert_eq!(difference(start, &viewer.screenshot_after("Home")), 0.0, "home again");
}

/// The window is resized, hidden and shown; every screenshot has the window's size.
fn resizing(viewer: &Viewer) {
    for size in [[500, 300], [1, 1], [640, 420], [321, 239], [200, 600], [320, 240]] {
        viewer.resize(size);
        assert_eq!(
            eventually("the size", || Some(viewer.screenshot()).filter(|p| p.dimensions() == size.into())).dimensions(),
            size.into()
        );
    }
    for _ in 0..2 {
        viewer.display.xdotool(&format!("windowunmap --sync {}", viewer.window));
        std::thread::sleep(Duration::from_millis(300));
        viewer.display.xdotool(&format!("windowmap --sync {}", viewer.window));
        viewer.focus();
        viewer.screenshot();
    }
}

/// The program exits with 0 and without validation messages.
fn end(viewer: Viewer) {
    let output = viewer.quit();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON document");
    assert_eq!(summary["validation_messages"], serde_json::json!([]));
    assert!(summary["frames"].as_u64() > Some(30), "{summary}");
    assert!(summary["frame_ms"]["p99"].as_f64() >= summary["frame_ms"]["p50"].as_f64(), "{summary}");
    assert!(!stderr.contains("validation"), "{stderr}");
}

/// Returns the share of pixels that are not sky.
fn terrain_share(picture: &RgbImage) -> f64 {
    let sky = picture.get_pixel(picture.width() - 1, 0);
    let differs = |p: &&image::Rgb<u8>| p.0.iter().zip(sky.0).any(|(x, y)| x.abs_diff(y) > 12);
    picture.pixels().filter(differs).count() as f64 / f64::from(picture.width() * picture.height())
}

/// Terrain a hand wide, in all camera modes: terrain stays in view.
#[test]
fn terrain_of_millimetres_stays_in_view() {
    on_display(|display| {
        let model = ["--spacing", "0.005", "--height-scale", "0.0002", "--crop", "100,100,65,65"];
        let viewer = Viewer::open(display, &[&["demo"], &model[..]].concat());
        let start = viewer.screenshot_after("u");
        assert!(terrain_share(&start) > 0.1, "{} of the image is terrain", terrain_share(&start));
        for camera in ["fly", "orbit", "walk"] {
            for key in ["w", "d", "s", "Shift+s"] {
                viewer.hold(key, Duration::from_millis(500));
            }
            let seen = viewer.screenshot();
            assert!(
                terrain_share(&seen) > 0.01 && difference(&start, &seen) > 0.02,
                "{camera}: terrain share {}",
                terrain_share(&seen)
            );
            viewer.press("Tab");
        }
        assert_eq!(difference(&start, &viewer.screenshot_after("Home")), 0.0, "home again");
        end(viewer);
    });
}

/// Moving back widens an orthographic image, moving forward narrows it.
#[test]
fn keys_and_wheel_zoom_an_orthographic_view() {
    on_display(|display| {
        let viewer = Viewer::open(display, &["demo", "--ortho", "15000"]);
        let start = viewer.screenshot_after("u");
        viewer.display.xdotool("keydown Shift_L");
        viewer.hold("s", Duration::from_millis(2500));
        viewer.display.xdotool("keyup Shift_L");
        let wide = viewer.screenshot();
        assert!(
            terrain_share(&wide) > 0.01 && terrain_share(&wide) < 0.9 * terrain_share(&start),
            "{} of {}",
            terrain_share(&wide),
            terrain_share(&start)
        );
        viewer.hold("w", Duration::from_millis(1500));
        let closer = viewer.screenshot();
        assert!(
            terrain_share(&closer) > 1.1 * terrain_share(&wide),
            "W: {} after {}",
            terrain_share(&closer),
            terrain_share(&wide)
        );
        viewer.display.xdotool("mousemove 160 120 click 5 click 5 click 5");
        let wider = viewer.screenshot();
        assert!(
            terrain_share(&wider) < terrain_share(&closer),
            "wheel: {} after {}",
            terrain_share(&wider),
            terrain_share(&closer)
        );
        viewer.press("Tab");
        viewer.hold("a", Duration::from_millis(800));
        let orbited = viewer.screenshot();
        assert!(
            terrain_share(&orbited) > 0.01 && difference(&wider, &orbited) > 0.01,
            "orbit: {}",
            terrain_share(&orbited)
        );
        assert_eq!(difference(&start, &viewer.screenshot_after("Home")), 0.0, "home again");
        end(viewer);
    });
}

#[test]
fn the_session_ends_after_the_given_seconds() {
    on_display(|display| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
        command.args(["view", "demo", "--size", "64x48", "--seconds", "1", "--vsync", "off", "--quiet", "--validate"]);
        let output = display.on(&mut command).output().expect("the program runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stdout.is_empty());
    });
}

#[test]
fn a_missing_display_is_a_one_line_error() {
    for display in [None, Some(":987654")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cuesta"));
        command.args(["view", "demo", "--quiet"]).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        match display {
            Some(name) => command.env("DISPLAY", name),
            None => command.env_remove("DISPLAY"),
        };
        let output = command.current_dir(Path::new("/")).output().expect("the program runs");
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.starts_with("error: ") && stderr.lines().count() == 1 && stderr.contains("display"), "{stderr}");
    }
}
