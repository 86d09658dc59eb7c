//! A display of its own for a test, and the hands that press its keys and move its mouse.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A virtual X server; gone when dropped.
pub struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// Starts one on a free number, or says what is missing.
    ///
    /// A server resets when its last client leaves, and drops whoever connects meanwhile: `-noreset`, as every
    /// question to `xdotool` is a client that leaves.
    pub fn start() -> Result<Self, String> {
        let started = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = started.map_err(|e| format!("Xvfb: {e}"))?;
        let mut line = String::new();
        let told = server.stdout.take().map(|out| BufReader::new(out).read_line(&mut line));
        let display = Self { server, name: format!(":{}", line.trim()) };
        match told {
            Some(Ok(bytes)) if bytes > 1 => {}
            _ => return Err("Xvfb did not start".to_string()),
        }
        Command::new("xdotool").arg("version").output().map_err(|e| format!("xdotool: {e}"))?;
        Ok(display)
    }

    /// Makes a command run on it.
    pub fn on<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("DISPLAY", &self.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET")
    }

    /// Real key and mouse events: what `xdotool` understands, in words.
    pub fn act(&self, words: &str) -> String {
        let output = self.on(Command::new("xdotool").args(words.split_whitespace())).output().expect("xdotool runs");
        assert!(output.status.success(), "xdotool {words}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).trim().to_string()
    }

    /// The number of the window whose title contains this, opened by a program that still runs.
    pub fn window(&self, title: &str, program: &mut Child) -> String {
        eventually("a window", || {
            if program.try_wait().expect("a child").is_some() {
                let mut told = String::new();
                program.stderr.take().map(|mut err| err.read_to_string(&mut told));
                panic!("the program ended before it had a window: {told}");
            }
            let found = self.on(Command::new("xdotool").args(["search", "--onlyvisible", "--name", title])).output();
            let text = String::from_utf8(found.expect("xdotool runs").stdout).expect("digits");
            text.lines().next().map(str::to_string)
        })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Waits until there is something.
///
/// # Panics
/// If there is nothing after three minutes: the software device is slow, but not that slow.
pub fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(started.elapsed() < Duration::from_secs(180), "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(30));
    }
}

/// A picture that a program writes, once it is there.
pub fn picture(path: &Path) -> image::RgbImage {
    let what = path.display().to_string();
    eventually(&what, || path.exists().then_some(()));
    image::open(path).expect("a whole picture").into_rgb8()
}
