//! What the user has chosen so far: camera, look, technique, tolerance; and what each action does to it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::Setup;
use super::bindings::Action;
use super::camera::{Camera, Motion};
use super::hud::Row;
use super::renderer::FrameStats;
use super::site::Site;
use super::times::Smoothed;
use crate::lod::budget::{Controller, RANGE_PX, Target};
use crate::lod::{Entry, Settings};
use crate::plan::{Colour, Look};
use crate::view::{Metric, Tolerance, View};

/// How long a note stays.
const NOTE: Duration = Duration::from_secs(4);

/// The state of the window.
pub struct Session {
    /// The camera.
    pub camera: Camera,
    /// The terrain under it.
    site: Site,
    /// How the land looks.
    pub look: Look,
    /// The technique.
    pub technique: (&'static Entry, Settings),
    /// Whether the selection stays as it is.
    pub frozen: bool,
    /// Whether the help is shown.
    pub helps: bool,
    /// Whether the next frame is copied to a file.
    pub wants_copy: bool,
    shows_numbers: bool,
    tolerance: Tolerance,
    /// What moves the tolerance, if anything does.
    budget: Option<Controller>,
    /// The colours that level colours go back to.
    plain: Colour,
    note: Option<(String, Instant)>,
    frame: Smoothed,
    select: Smoothed,
    gpu: Smoothed,
}

/// What an action asks of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Nothing.
    Nothing,
    /// Pipelines for the new look.
    Look,
    /// The new technique's geometry.
    Technique,
    /// The end.
    Quit,
}

impl Session {
    /// As it is at the start.
    pub fn new(setup: &Setup) -> Self {
        Self {
            camera: Camera::of(&setup.view),
            site: Site::new(&setup.field),
            look: setup.look,
            technique: setup.technique.clone(),
            frozen: false,
            helps: false,
            wants_copy: false,
            shows_numbers: true,
            tolerance: setup.view.tolerance,
            budget: setup.target.map(|target| Controller::new(target, setup.view.tolerance.px, RANGE_PX)),
            plain: if setup.look.colour == Colour::Level { Colour::Height } else { setup.look.colour },
            note: None,
            frame: Smoothed::default(),
            select: Smoothed::default(),
            gpu: Smoothed::default(),
        }
    }

    /// Does what is done at once; movement is for [`Camera::advance`].
    pub fn perform(&mut self, setup: &Setup, action: Action) -> Request {
        match action {
            Action::Move(_) | Action::Fast | Action::Look | Action::Speed => {}
            Action::Camera => self.camera.next_mode(&self.site),
            Action::Home => self.camera = Camera::of(&setup.view),
            Action::Technique(k) => return self.take(setup, setup.techniques.entries()[k], None),
            Action::Variant => {
                let (entry, settings) = &self.technique;
                let names: Vec<_> = std::iter::once(None).chain(entry.variants.iter().map(|v| Some(v.name))).collect();
                let current = names.iter().position(|name| *name == settings.variant()).unwrap_or(0);
                return self.take(setup, entry, names[(current + 1) % names.len()]);
            }
            Action::Tolerance(factor) => {
                // Who sets it by hand no longer wants it moved.
                self.budget = None;
                self.tolerance.px = (self.tolerance.px * factor).clamp(RANGE_PX[0], RANGE_PX[1]);
            }
            Action::Wireframe => {
                self.look.wireframe = !self.look.wireframe;
                return Request::Look;
            }
            Action::LevelColours => {
                let is_level = self.look.colour == Colour::Level;
                self.look.colour = if is_level { self.plain } else { Colour::Level };
                return Request::Look;
            }
            Action::Colour => {
                self.look.colour = next_colour(self.look.colour, Picture::of(setup));
                self.plain = if self.look.colour == Colour::Level { self.plain } else { self.look.colour };
                return Request::Look;
            }
            Action::Freeze => self.frozen = !self.frozen,
            Action::Screenshot => self.wants_copy = true,
            Action::Hud => self.shows_numbers = !self.shows_numbers,
            Action::Help => self.helps = !self.helps,
            Action::Quit => return Request::Quit,
        }
        Request::Nothing
    }

    fn take(&mut self, setup: &Setup, entry: &'static Entry, variant: Option<&str>) -> Request {
        // What was set on the command line was set on its technique.
        let is_own = entry.name == setup.technique.0.name;
        let choices = if is_own { setup.choices.as_slice() } else { &[] };
        let settings = Settings::new(entry, variant, choices).unwrap_or_else(|_| Settings::defaults(entry));
        self.technique = (entry, settings);
        self.frozen = false;
        Request::Technique
    }

    /// Moves the camera, and takes the last frame's figures. After a break `dt` is 0: there was no frame.
    pub fn advance(&mut self, motion: &Motion, stats: &FrameStats, dt: f64) {
        self.camera.advance(&self.site, motion, dt);
        if dt == 0.0 {
            return;
        }
        self.frame.add(dt * 1e3, dt);
        self.select.add(stats.select_ms, dt);
        self.gpu.add(stats.gpu_ms, dt);
        if !self.frozen {
            self.hold(stats, dt);
        }
    }

    /// Moves the tolerance by what the last frame cost.
    fn hold(&mut self, stats: &FrameStats, dt: f64) {
        let Some(budget) = &mut self.budget else { return };
        let cost = match budget.target() {
            Target::Triangles(_) => stats.triangles as f64,
            Target::FrameMs(_) => dt * 1e3,
        };
        budget.learn(stats.tolerance_px, cost);
        self.tolerance.px = budget.tolerance_px();
    }

    /// The view of a frame.
    pub fn view(&self, setup: &Setup, size: [u32; 2]) -> View {
        View { size, tolerance: self.tolerance, ..self.camera.seen(&self.site, &setup.view, setup.near) }
    }

    /// The technique as it is written on the command line.
    pub fn technique_name(&self) -> String {
        let (entry, settings) = &self.technique;
        settings.variant().map_or(entry.name.to_string(), |variant| format!("{}:{variant}", entry.name))
    }

    /// The window's title.
    pub fn title(&self, setup: &Setup) -> String {
        format!("cuesta: {}, {}", setup.name, self.technique_name())
    }

    /// Shows a note for a while.
    pub fn tell(&mut self, text: String) {
        self.note = Some((text, Instant::now()));
    }

    /// The note, while it stays.
    pub fn note(&self) -> Option<&str> {
        self.note.as_ref().filter(|(_, since)| since.elapsed() < NOTE).map(|(text, _)| text.as_str())
    }

    /// What the tolerance holds.
    fn held(&self) -> String {
        match self.budget.as_ref().map(Controller::target) {
            None => String::new(),
            Some(Target::Triangles(count)) => format!(", holds {} triangles", grouped(count as u64)),
            Some(Target::FrameMs(ms)) => format!(", holds {ms} ms"),
        }
    }

    /// The numbers over the picture.
    pub fn rows(&self, stats: &FrameStats) -> Vec<Row> {
        if !self.shows_numbers {
            return Vec::new();
        }
        let row = |name: &str, value: String| (name.to_string(), value);
        let frame = self.frame.get();
        let rate = if frame > 0.0 { 1e3 / frame } else { 0.0 };
        let [x, y, z] = self.camera.eye.to_array();
        let metric = if self.tolerance.metric == Metric::Certified { "certified" } else { "paper" };
        let frozen = if self.frozen { ", frozen" } else { "" };
        // To a hundredth of the terrain at least.
        let digits = (2.0 - self.site.diagonal().log10()).ceil().clamp(0.0, 9.0) as usize;
        let wide = self.camera.width().map(|width| format!(", {} wide", length_text(width))).unwrap_or_default();
        let wire = if self.look.wireframe { ", edges" } else { "" };
        let mut rows = vec![
            row("frame", format!("{frame:.1} ms, {rate:.0} a second")),
            row("select", format!("{:.2} ms", self.select.get())),
            row("gpu", format!("{:.1} ms", self.gpu.get())),
            row("triangles", grouped(stats.triangles)),
            row("draws", grouped(stats.draws as u64)),
            row("technique", format!("{}{frozen}", self.technique_name())),
            row(
                "tolerance",
                format!(
                    "{:.2} px {metric}{}{}",
                    self.tolerance.px,
                    self.held(),
                    select_within_limits(stats.tolerance_scale)
                ),
            ),
            row("colours", format!("{}{wire}", colour_name(self.look.colour))),
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

/// What is said of a tolerance that was not kept.
fn select_within_limits(factor: f64) -> String {
    if factor > 1.0 { format!(", times {factor:.2}: too much to draw") } else { String::new() }
}

/// Where the next screenshot goes: the first free number in the current folder.
pub fn free_path() -> PathBuf {
    let path = |k: u32| PathBuf::from(format!("cuesta-{k:03}.png"));
    path((1..).find(|k| !path(*k).exists()).unwrap_or(0))
}

/// The picture there is to lay over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Picture {
    None,
    Whole,
    InParts,
}

impl Picture {
    fn of(setup: &Setup) -> Self {
        match &setup.overlay {
            None => Picture::None,
            Some(picture) if setup.look.holds(picture.dimensions().into()) => Picture::Whole,
            Some(_) => Picture::InParts,
        }
    }
}

fn next_colour(colour: Colour, picture: Picture) -> Colour {
    match colour {
        Colour::Height if picture != Picture::None => Colour::Overlay,
        Colour::Overlay if picture == Picture::InParts => Colour::Maps,
        Colour::Height | Colour::Overlay | Colour::Maps => Colour::Ground,
        Colour::Ground => Colour::Nodes,
        Colour::Nodes => Colour::Level,
        Colour::Level => Colour::Error,
        Colour::Error => Colour::Normal,
        Colour::Normal => Colour::Batch,
        Colour::Batch => Colour::Height,
    }
}

fn colour_name(colour: Colour) -> &'static str {
    match colour {
        Colour::Height => "height",
        Colour::Overlay => "overlay",
        Colour::Maps => "maps",
        Colour::Ground => "ground",
        Colour::Nodes => "nodes",
        Colour::Level => "level",
        Colour::Error => "error",
        Colour::Normal => "normal",
        Colour::Batch => "batch",
    }
}

/// Metres with about two digits.
fn length_text(metres: f64) -> String {
    match metres.abs() {
        size if size >= 10.0 => format!("{metres:.0} m"),
        size if size >= 0.1 || size == 0.0 => format!("{metres:.1} m"),
        _ => format!("{metres:.1e} m"),
    }
}

/// Digits in threes.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let groups = digits.as_bytes().rchunks(3).rev().map(|g| String::from_utf8_lossy(g).into_owned());
    groups.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_round() {
        for (count, picture) in (8..).zip([Picture::None, Picture::Whole, Picture::InParts]) {
            let mut seen = vec![Colour::Height];
            while seen.len() < 12 && (seen.len() == 1 || seen.last() != Some(&Colour::Height)) {
                seen.push(next_colour(seen[seen.len() - 1], picture));
            }
            assert_eq!(seen.len(), count);
            assert_eq!(seen.contains(&Colour::Overlay), picture != Picture::None);
            assert_eq!(seen.contains(&Colour::Maps), picture == Picture::InParts);
        }
    }

    #[test]
    fn digits_in_threes() {
        assert_eq!([0, 999, 1000, 12_345_678].map(grouped), ["0", "999", "1 000", "12 345 678"]);
    }
}
