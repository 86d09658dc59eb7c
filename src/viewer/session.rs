//! The state of a viewer session (camera, look, technique, tolerance) and the effect of each action on it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::bindings::Action;
use super::camera::{Camera, Motion};
use super::hud::HudRow;
use super::renderer::FrameStats;
use super::setup::Setup;
use super::site::Site;
use super::times::Smoothed;
use crate::lod::budget::{Controller, RANGE_PX, Target};
use crate::lod::{Entry, Settings};
use crate::plan::{Colour, Look};
use crate::view::{Metric, Tolerance, View};

/// Time that a note is shown.
const NOTE: Duration = Duration::from_secs(4);

/// State of the viewer.
pub struct Session {
    /// The camera.
    pub camera: Camera,
    /// The terrain under the camera.
    site: Site,
    /// Shading and colour options.
    pub look: Look,
    /// The technique and its settings.
    pub technique: (&'static Entry, Settings),
    /// True if the draw list is frozen.
    pub frozen: bool,
    /// True if the help is shown.
    pub shows_help: bool,
    /// True if the next frame is to be saved to a file.
    pub wants_copy: bool,
    shows_numbers: bool,
    tolerance: Tolerance,
    /// Controller of the tolerance; `None` for a fixed tolerance.
    budget: Option<Controller>,
    /// Colour mode that level colours toggle back to.
    base_colour: Colour,
    note: Option<(String, Instant)>,
    frame: Smoothed,
    select: Smoothed,
    gpu: Smoothed,
}

/// The change to the renderer that an action requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// No change.
    Nothing,
    /// New pipelines for the look.
    Look,
    /// Preparation of the new technique.
    Technique,
    /// End of the program.
    Quit,
}

impl Session {
    /// Creates the state at the start of a session.
    pub fn new(setup: &Setup) -> Self {
        Self {
            camera: Camera::of(&setup.view),
            site: Site::new(&setup.field),
            look: setup.look,
            technique: setup.technique.clone(),
            frozen: false,
            shows_help: false,
            wants_copy: false,
            shows_numbers: true,
            tolerance: setup.view.tolerance,
            budget: setup.target.map(|target| Controller::new(target, setup.view.tolerance.px, RANGE_PX)),
            base_colour: if setup.look.colour == Colour::Level { Colour::Height } else { setup.look.colour },
            note: None,
            frame: Smoothed::default(),
            select: Smoothed::default(),
            gpu: Smoothed::default(),
        }
    }

    /// Performs an immediate action. Movement is handled by [`Camera::advance`].
    pub fn perform(&mut self, setup: &Setup, action: Action) -> Request {
        match action {
            Action::Move(_) | Action::Fast | Action::Turn | Action::Speed => {}
            Action::Camera => self.camera.next_mode(&self.site),
            Action::Home => self.camera = Camera::of(&setup.view),
            Action::Technique(k) => return self.set_technique(setup, setup.techniques.entries()[k], None),
            Action::Variant => {
                let (entry, settings) = &self.technique;
                let names: Vec<_> = std::iter::once(None).chain(entry.variants.iter().map(|v| Some(v.name))).collect();
                let current = names.iter().position(|name| *name == settings.variant()).unwrap_or(0);
                return self.set_technique(setup, entry, names[(current + 1) % names.len()]);
            }
            Action::Tolerance(factor) => {
                // A manual tolerance ends the budget control.
                self.budget = None;
                self.tolerance.px = (self.tolerance.px * factor).clamp(RANGE_PX[0], RANGE_PX[1]);
            }
            Action::Wireframe => {
                self.look.wireframe = !self.look.wireframe;
                return Request::Look;
            }
            Action::LevelColours => {
                let is_level = self.look.colour == Colour::Level;
                self.look.colour = if is_level { self.base_colour } else { Colour::Level };
                return Request::Look;
            }
            Action::Colour => {
                self.look.colour = next_colour(self.look.colour, OverlayKind::of(setup));
                self.base_colour = if self.look.colour == Colour::Level { self.base_colour } else { self.look.colour };
                return Request::Look;
            }
            Action::Freeze => self.frozen = !self.frozen,
            Action::Screenshot => self.wants_copy = true,
            Action::Hud => self.shows_numbers = !self.shows_numbers,
            Action::Help => self.shows_help = !self.shows_help,
            Action::Quit => return Request::Quit,
        }
        Request::Nothing
    }

    /// Selects a technique and variant.
    fn set_technique(&mut self, setup: &Setup, entry: &'static Entry, variant: Option<&str>) -> Request {
        // Settings of the command line apply to its technique only.
        let is_own = entry.name == setup.technique.0.name;
        let choices = if is_own { setup.choices.as_slice() } else { &[] };
        let settings = Settings::new(entry, variant, choices).unwrap_or_else(|_| Settings::defaults(entry));
        self.technique = (entry, settings);
        self.frozen = false;
        Request::Technique
    }

    /// Moves the camera and records the statistics of the last frame. `dt` is the frame time in seconds, or 0 after a
    /// pause.
    pub fn advance(&mut self, motion: &Motion, stats: &FrameStats, dt: f64) {
        self.camera.advance(&self.site, motion, dt);
        if dt == 0.0 {
            return;
        }
        self.frame.add(dt * 1e3, dt);
        self.select.add(stats.select_ms, dt);
        self.gpu.add(stats.gpu_ms, dt);
        if !self.frozen {
            self.update_tolerance(stats, dt);
        }
    }

    /// Adjusts the tolerance by the cost of the last frame.
    fn update_tolerance(&mut self, stats: &FrameStats, dt: f64) {
        let Some(budget) = &mut self.budget else { return };
        let cost = match budget.target() {
            Target::Triangles(_) => stats.triangles as f64,
            Target::FrameMs(_) => dt * 1e3,
        };
        budget.learn(stats.tolerance_px, cost);
        self.tolerance.px = budget.tolerance_px();
    }

    /// Returns the view of a frame.
    pub fn view(&self, setup: &Setup, size: [u32; 2]) -> View {
        View { size, tolerance: self.tolerance, ..self.camera.view(&self.site, &setup.view, setup.near) }
    }

    /// Returns the technique as on the command line: `name` or `name:variant`.
    pub fn technique_name(&self) -> String {
        let (entry, settings) = &self.technique;
        settings.variant().map_or(entry.name.to_string(), |variant| format!("{}:{variant}", entry.name))
    }

    /// Returns the window's title.
    pub fn title(&self, setup: &Setup) -> String {
        format!("cuesta: {}, {}", setup.name, self.technique_name())
    }

    /// Shows a note for [`NOTE`].
    pub fn show_note(&mut self, text: String) {
        self.note = Some((text, Instant::now()));
    }

    /// Returns the current note.
    pub fn note(&self) -> Option<&str> {
        self.note.as_ref().filter(|(_, since)| since.elapsed() < NOTE).map(|(text, _)| text.as_str())
    }

    /// Returns the budget as text.
    fn target_text(&self) -> String {
        match self.budget.as_ref().map(Controller::target) {
            None => String::new(),
            Some(Target::Triangles(count)) => format!(", target {} triangles", with_thousands(count as u64)),
            Some(Target::FrameMs(ms)) => format!(", target {ms} ms"),
        }
    }

    /// Returns the statistics for the HUD.
    pub fn rows(&self, stats: &FrameStats) -> Vec<HudRow> {
        if !self.shows_numbers {
            return Vec::new();
        }
        let row = |name: &str, value: String| (name.to_string(), value);
        let frame = self.frame.get();
        let rate = if frame > 0.0 { 1e3 / frame } else { 0.0 };
        let [x, y, z] = self.camera.eye.to_array();
        let metric = if self.tolerance.metric == Metric::Certified { "certified" } else { "paper" };
        let frozen = if self.frozen { ", frozen" } else { "" };
        // Resolves at least a hundredth of the terrain.
        let digits = (2.0 - self.site.diagonal().log10()).ceil().clamp(0.0, 9.0) as usize;
        let wide = self.camera.width().map(|width| format!(", {} wide", length_text(width))).unwrap_or_default();
        let wire = if self.look.wireframe { ", edges" } else { "" };
        let mut rows = vec![
            row("frame", format!("{frame:.1} ms, {rate:.0} fps")),
            row("select", format!("{:.2} ms", self.select.get())),
            row("gpu", format!("{:.1} ms", self.gpu.get())),
            row("triangles", with_thousands(stats.triangles)),
            row("draws", with_thousands(stats.draws as u64)),
            row("technique", format!("{}{frozen}", self.technique_name())),
            row(
                "tolerance",
                format!(
                    "{:.2} px {metric}{}{}",
                    self.tolerance.px,
                    self.target_text(),
                    scale_text(stats.tolerance_scale)
                ),
            ),
            row("colours", format!("{}{wire}", self.look.colour.name())),
            row(
                "camera",
                format!("{}, {}/s{wide}", self.camera.mode_name(), length_text(self.camera.speed(&self.site))),
            ),
            row("position", format!("{x:.digits$} {y:.digits$} {z:.digits$} m")),
            row("above ground", length_text(self.camera.above_ground(&self.site))),
        ];
        rows.extend(stats.maps.map(|maps| row("texels", maps.to_string())));
        rows
    }
}

/// Returns a text for a tolerance that was raised to fit the draw list's limits.
fn scale_text(factor: f64) -> String {
    if factor > 1.0 { format!(" x {factor:.2} (draw list full)") } else { String::new() }
}

/// Returns the first unused screenshot path in the current directory.
pub fn free_path() -> PathBuf {
    let path = |k: u32| PathBuf::from(format!("cuesta-{k:03}.png"));
    path((1..).find(|k| !path(*k).exists()).unwrap_or(0))
}

/// Kind of overlay image available.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OverlayKind {
    /// No overlay.
    None,
    /// An image that fits one texture.
    Whole,
    /// An image that needs a virtual texture.
    Virtual,
}

impl OverlayKind {
    fn of(setup: &Setup) -> Self {
        match &setup.overlay {
            None => OverlayKind::None,
            Some(picture) if setup.look.holds(picture.dimensions().into()) => OverlayKind::Whole,
            Some(_) => OverlayKind::Virtual,
        }
    }
}

fn next_colour(colour: Colour, picture: OverlayKind) -> Colour {
    match colour {
        Colour::Height if picture != OverlayKind::None => Colour::Overlay,
        Colour::Overlay if picture == OverlayKind::Virtual => Colour::Maps,
        Colour::Height | Colour::Overlay | Colour::Maps => Colour::Ground,
        Colour::Ground => Colour::Nodes,
        Colour::Nodes => Colour::Level,
        Colour::Level => Colour::Error,
        Colour::Error => Colour::Normal,
        Colour::Normal => Colour::Batch,
        Colour::Batch => Colour::Height,
    }
}

/// Formats a length in metres with about two digits.
fn length_text(metres: f64) -> String {
    match metres.abs() {
        size if size >= 10.0 => format!("{metres:.0} m"),
        size if size >= 0.1 || size == 0.0 => format!("{metres:.1} m"),
        _ => format!("{metres:.1e} m"),
    }
}

/// Formats a number with spaces between thousands.
fn with_thousands(value: u64) -> String {
    let digits = value.to_string();
    let groups = digits.as_bytes().rchunks(3).rev().map(|g| String::from_utf8_lossy(g).into_owned());
    groups.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_modes_cycle() {
        for (count, picture) in (8..).zip([OverlayKind::None, OverlayKind::Whole, OverlayKind::Virtual]) {
            let mut seen = vec![Colour::Height];
            while seen.len() < 12 && (seen.len() == 1 || seen.last() != Some(&Colour::Height)) {
                seen.push(next_colour(seen[seen.len() - 1], picture));
            }
            assert_eq!(seen.len(), count);
            assert_eq!(seen.contains(&Colour::Overlay), picture != OverlayKind::None);
            assert_eq!(seen.contains(&Colour::Maps), picture == OverlayKind::Virtual);
        }
    }

    #[test]
    fn thousands_are_separated() {
        assert_eq!([0, 999, 1000, 12_345_678].map(with_thousands), ["0", "999", "1 000", "12 345 678"]);
    }
}
