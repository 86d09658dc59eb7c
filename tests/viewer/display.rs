//! A virtual X display for tests, with key and mouse events sent by `xdotool`.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A virtual X server, stopped when dropped.
pub struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// Starts a server on a free display number. Fails with the missing program.
    ///
    /// A server resets when its last client disconnects, and drops clients that connect meanwhile. Each `xdotool`
    /// call is such a client, hence `-noreset`.
    pub fn start() -> Result<Self, String> {
        let started = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = started.map_err(|e| format!("Xvfb: {e}"))?;
        let mut line = String::new();
        let read = server.stdout.take().map(|out| BufReader::new(out).read_line(&mut line));
        let display = Self { server, name: format!(":{}", line.trim()) };
        match read {
            Some(Ok(bytes)) if bytes > 1 => {}
            _ => return Err("Xvfb did not start".to_string()),
        }
        Command::new("xdotool").arg("version").output().map_err(|e| format!("xdotool: {e}"))?;
        Ok(display)
    }

    /// Makes a command run on this display.
    pub fn on<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("DISPLAY", &self.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET")
    }

    /// Sends real key and mouse events: runs `xdotool` with the given words and returns its output.
    pub fn xdotool(&self, words: &str) -> String {
        let output = self.on(Command::new("xdotool").args(words.split_whitespace())).output().expect("xdotool runs");
        assert!(output.status.success(), "xdotool {words}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).trim().to_string()
    }

    /// Returns the id of the window whose title contains `title`, opened by a running program.
    pub fn window(&self, title: &str, program: &mut Child) -> String {
        eventually("a window", || {
            if program.try_wait().expect("a child").is_some() {
                let mut output = String::new();
                program.stderr.take().map(|mut err| err.read_to_string(&mut output));
                panic!("the program ended before it had a window: {output}");
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

/// Polls until there is a result.
///
/// # Panics
/// After three minutes, which is ample for a software device.
pub fn eventually<T>(what: &str, mut poll: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(found) = poll() {
            return found;
        }
        assert!(started.elapsed() < Duration::from_secs(180), "timed out waiting for {what}");
        std::thread::sleep(Duration::from_millis(30));
    }
}

/// Waits for an image file that a program writes, and loads it.
pub fn picture(path: &Path) -> image::RgbImage {
    let what = path.display().to_string();
    eventually(&what, || path.exists().then_some(()));
    image::open(path).expect("a whole picture").into_rgb8()
}
