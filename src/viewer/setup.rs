//! Settings of a window session, and its summary.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;

use super::times::Percentiles;
use crate::gpu::Choice;
use crate::height::Field;
use crate::lod::budget::Target;
use crate::lod::{Entry, Settings};
use crate::plan::Look;
use crate::view::View;

/// Terrain, view and options of a window session.
pub struct Setup {
    /// The terrain's name, for the title.
    pub name: String,
    /// The land.
    pub field: Arc<Field>,
    /// From where, and in a window of what size.
    pub view: View,
    /// Near plane, metres, unless it follows the height above ground.
    pub near: Option<f64>,
    /// The technique and its settings.
    pub technique: (&'static Entry, Settings),
    /// Settings chosen for that technique.
    pub choices: Vec<(String, String)>,
    /// Cost that frames are held at by moving the view's tolerance.
    pub target: Option<Target>,
    /// Appearance of the terrain.
    pub look: Look,
    /// A picture laid over it, for when the colours are its.
    pub overlay: Option<image::RgbaImage>,
    /// Choice of device.
    pub choice: Choice,
    /// Validation layers on.
    pub validate: bool,
    /// Frames wait for the display.
    pub vsync: bool,
    /// Ends after this many seconds.
    pub seconds: Option<f64>,
    /// Writes a screenshot.
    pub save: fn(&Path, &image::RgbaImage) -> Result<()>,
    /// Takes what is to be done when the user interrupts the program.
    pub on_interrupt: fn(Box<dyn FnOnce() + Send>),
}

/// Summary of a session.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The device's name.
    pub device: String,
    /// Frames shown.
    pub frames: u64,
    /// Seconds that the window was open.
    pub seconds: f64,
    /// Times from frame to frame, milliseconds.
    pub frame_ms: Percentiles,
    /// Messages of the validation layers, up to shutdown.
    pub messages: Vec<String>,
}
