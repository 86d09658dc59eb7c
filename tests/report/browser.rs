//! The page in headless Chromium, spoken to by the DevTools protocol over a pipe: real pointers, keys and widths.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

use super::page::drawn;

/// Names that the browser goes by.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// A browser with one page; gone when dropped.
struct Browser {
    process: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: Option<String>,
    sent: u64,
}

impl Browser {
    /// Starts one; `None`, said aloud, where there is none.
    fn start(profile: &Path) -> Option<Self> {
        let found =
            NAMES.iter().find(|name| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success()));
        let Some(name) = found else {
            assert!(std::env::var("REQUIRE_GPU").as_deref() != Ok("1"), "no Chromium");
            println!("skipped: no Chromium");
            return None;
        };
        // Chromium reads commands from file 3 and answers to file 4, each ended by a zero byte.
        let script = "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>/dev/null";
        let profile = format!("--user-data-dir={}", profile.display());
        let words =
            ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", "--hide-scrollbars", &profile];
        let mut command = Command::new("sh");
        command.args(["-c", script, "sh", name]).args(words).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn().expect("sh starts");
        let to = process.stdin.take().expect("piped");
        let from = BufReader::new(process.stdout.take().expect("piped"));
        let mut browser = Self { process, to, from, session: None, sent: 0 };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attached = browser.call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }));
        browser.session = Some(attached["sessionId"].as_str().expect("a session").to_string());
        Some(browser)
    }

    /// Sends a command and waits for its answer.
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.sent += 1;
        let mut message = json!({ "id": self.sent, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = session.clone().into();
        }
        write!(self.to, "{message}\0").and_then(|()| self.to.flush()).expect("the browser listens");
        loop {
            let mut bytes = Vec::new();
            self.from.read_until(0, &mut bytes).expect("the browser speaks");
            assert!(!bytes.is_empty(), "the browser ended at {method}");
            let answer: Value = serde_json::from_slice(&bytes[..bytes.len() - 1]).expect("JSON");
            if answer["id"] == self.sent {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// The value of an expression in the page.
    fn ask(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let answer = self.call("Runtime.evaluate", parameters);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Opens a file in a window of this width and waits until it is there.
    fn open(&mut self, file: &Path, width: u32, dark: bool) {
        let size = json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500 });
        self.call("Emulation.setDeviceMetricsOverride", size);
        let scheme = if dark { "dark" } else { "light" };
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", features);
        self.call("Page.navigate", json!({ "url": format!("file://{}", file.display()) }));
        let loaded = "new Promise(done => document.readyState === 'complete' && location.href !== 'about:blank' \
                      ? done(true) : addEventListener('load', () => done(true)))";
        assert_eq!(self.ask(loaded), true);
    }

    /// Moves the pointer over the middle of an element.
    fn point_at(&mut self, selector: &str) {
        let place = format!(
            "(() => {{ const e = document.querySelector(`{selector}`); e.scrollIntoView({{block: 'center'}}); \
             const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
        );
        let place = self.ask(&place);
        self.next_frame();
        self.call("Input.dispatchMouseEvent", json!({ "type": "mouseMoved", "x": place[0], "y": place[1] }));
        self.next_frame();
    }

    /// Waits until what happened so far is on the screen.
    fn next_frame(&mut self) {
        self.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))");
    }

    /// Presses a key.
    fn press(&mut self, key: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Writes what is seen into the folder that `SCREENSHOTS` names, if it names one.
    fn picture(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("SCREENSHOTS") else { return };
        use base64::Engine;
        let whole = json!({ "format": "png", "captureBeyondViewport": true });
        let data = self.call("Page.captureScreenshot", whole)["data"].clone();
        let bytes = base64::engine::general_purpose::STANDARD.decode(data.as_str().expect("base64")).expect("base64");
        std::fs::write(Path::new(&folder).join(name), bytes).expect("a folder for pictures");
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        self.session = None;
        let _ = write!(self.to, "{}\0", json!({ "id": 0, "method": "Browser.close" })).and_then(|()| self.to.flush());
        let _ = self.process.wait();
    }
}

/// The text of the value shown, or nothing.
const TIP: &str = "(tip => tip.hidden ? '' : tip.textContent)(document.getElementById('tip'))";
/// The first point of geomipmap's first plot.
const POINT: &str = "section.scene:not([hidden]) .own .series[data-series=geomipmap] .point";

#[test]
fn the_page_works_in_a_browser() {
    let folder = tempfile::tempdir().unwrap();
    let profile = tempfile::tempdir().unwrap();
    drawn(folder.path());
    let page = folder.path().canonicalize().unwrap().join("index.html");
    let Some(mut browser) = Browser::start(profile.path()) else { return };
    browser.open(&page, 1280, false);
    browser.picture("wide.png");
    values_are_read_back(&mut browser, folder.path());
    techniques_axes_and_scenes_are_chosen(&mut browser);
    keys_are_enough(&mut browser);
    for (width, dark) in [(390, false), (390, true), (1280, true), (320, false)] {
        browser.open(&page, width, dark);
        // Not `innerWidth`: on a telephone that grows with what sticks out.
        let scroll = browser.ask("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(scroll <= u64::from(width), "sideways scrolling at {width}: {scroll}");
        let smallest = "Math.min(...[...document.querySelectorAll('section.scene:not([hidden]) .own text')].map(t => \
                        (m => Math.hypot(m.a, m.b))(t.getScreenCTM()) * parseFloat(getComputedStyle(t).fontSize)))";
        let smallest = browser.ask(smallest).as_f64().unwrap();
        assert!(smallest >= if width < 390 { 8.5 } else { 10.0 }, "text of {smallest} px at {width}");
        browser.picture(&format!("{width}{}.png", if dark { "-dark" } else { "" }));
    }
}

/// Hovering shows the value that the results hold, at the place that the axes say.
fn values_are_read_back(browser: &mut Browser, folder: &Path) {
    let results = cuesta::internal::bench::results::Results::read(folder).unwrap();
    let result = results.cases.iter().find(|r| r.case.series() == "geomipmap").unwrap();
    let frame_ms = result.time.as_ref().unwrap().frame_ms.value;
    let error_px = result.errors.as_ref().unwrap().error_px.max;
    let values = browser.ask(&format!("({{...document.querySelector(`{POINT}`).dataset}})"));
    assert_eq!(values["y"].as_str().unwrap().parse(), Ok(frame_ms));
    assert_eq!(values["x"].as_str().unwrap().parse(), Ok(error_px));
    assert_eq!(browser.ask(TIP), "");
    browser.point_at(POINT);
    let shown = browser.ask(TIP);
    let shown = shown.as_str().unwrap();
    assert!(shown.contains("geomipmap, 0.5 px") && shown.contains(&format!("{frame_ms:.1} ms")), "{shown}");
    let inside = browser
        .ask("(b => b.left >= 0 && b.right <= innerWidth)(document.getElementById('tip').getBoundingClientRect())");
    assert_eq!(inside, true);
    // Twice the error lies further right by as much, wherever it is: the axis is logarithmic.
    let lefts = "[...document.querySelectorAll(`section.scene:not([hidden]) figure:first-of-type .own .series[data-series=geomipmap] .point`)]\
                 .map(p => p.getCTM().e)";
    let lefts = browser.ask(lefts);
    let gap = |k: usize| lefts[k + 1].as_f64().unwrap() - lefts[k].as_f64().unwrap();
    assert!(gap(0) > 10.0 && (gap(0) - gap(2)).abs() < 0.5, "{lefts}");
}

/// Of a selector, how many elements take up room.
fn seen(browser: &mut Browser, selector: &str) -> u64 {
    let count = format!("[...document.querySelectorAll(`{selector}`)].filter(e => e.getClientRects().length).length");
    browser.ask(&count).as_u64().unwrap()
}

fn techniques_axes_and_scenes_are_chosen(browser: &mut Browser) {
    let drawn = "section.scene .series[data-series=geomipmap] .point";
    assert!(seen(browser, drawn) > 10);
    browser.ask("document.querySelector('[data-toggle=geomipmap]').click()");
    assert_eq!(seen(browser, "[data-series=geomipmap]"), 0);
    assert!(seen(browser, "section.scene .series[data-series=brute-force] .point") > 0);
    browser.ask("document.querySelector('[data-toggle=geomipmap]').click()");
    assert!(seen(browser, drawn) > 10);

    assert_eq!(seen(browser, ".two .linear"), 0);
    browser.ask("document.getElementById('logarithm').click()");
    assert_eq!(seen(browser, ".two .own"), 0);
    assert!(seen(browser, ".two .linear") > 0);
    browser.ask("document.getElementById('logarithm').click()");

    assert_eq!(seen(browser, "section.scene"), 1);
    browser.ask("(s => { s.value = ''; s.dispatchEvent(new Event('change')); })(document.getElementById('scene'))");
    assert_eq!(seen(browser, "section.scene"), 4);
    browser
        .ask("(s => { s.selectedIndex = 0; s.dispatchEvent(new Event('change')); })(document.getElementById('scene'))");
}

/// The tab key goes to the controls and the points; a point in focus shows its value, Escape hides it.
fn keys_are_enough(browser: &mut Browser) {
    // Where the first Tab begins is the browser's choice after a pointer was there: it is to be the page's start.
    browser.ask("document.body.tabIndex = -1");
    browser.ask("document.body.focus()");
    let focus =
        "document.activeElement.id || document.activeElement.getAttribute('class') || document.activeElement.type";
    let mut reached = Vec::new();
    for _ in 0..8 {
        browser.press("Tab", 9);
        reached.push(browser.ask(focus).as_str().unwrap_or_default().to_string());
    }
    for control in ["scene", "checkbox", "logarithm", "point"] {
        assert!(reached.iter().any(|r| r == control), "{control}: {reached:?}");
    }
    let shown = browser.ask(TIP);
    assert!(shown.as_str().unwrap().contains("ms"), "{shown}");
    browser.press("Escape", 27);
    assert_eq!(browser.ask(TIP), "");
}
