//! Options of a viewer session, and the statistics at its end.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;

use super::times::Percentiles;
use crate::gpu::Choice;
use crate::height::Field;
use crate::lod::budget::Target;
use crate::lod::{Entry, Settings, Techniques};
use crate::plan::Look;
use crate::view::View;

/// Options of a viewer session.
pub struct Setup {
    /// Name of the terrain, for the title.
    pub name: String,
    /// The terrain.
    pub field: Arc<Field>,
    /// View at the start; its size is that of the window, pixels.
    pub view: View,
    /// Distance of the near plane, metres; `None` to follow the height above ground.
    pub near: Option<f64>,
    /// The techniques that keys choose from.
    pub techniques: Techniques,
    /// Technique and settings at the start.
    pub technique: (&'static Entry, Settings),
    /// Settings given on the command line for that technique: key and value.
    pub choices: Vec<(String, String)>,
    /// Budget per frame, kept by adjusting the tolerance; `None` for a fixed tolerance.
    pub target: Option<Target>,
    /// Shading and colour options.
    pub look: Look,
    /// Overlay image for the overlay colour modes.
    pub overlay: Option<image::RgbaImage>,
    /// Device to use.
    pub choice: Choice,
    /// True to enable the validation layers.
    pub validate: bool,
    /// True to wait for the display's refresh.
    pub vsync: bool,
    /// Session length, seconds; `None` for unlimited.
    pub seconds: Option<f64>,
    /// Function that is called once the first technique is prepared.
    pub on_prepared: Box<dyn Fn()>,
    /// Function that saves a screenshot.
    pub save: fn(&Path, &image::RgbaImage) -> Result<()>,
    /// Function that registers a handler for user interrupts (Ctrl-C).
    pub on_interrupt: fn(Box<dyn FnOnce() + Send>),
}

/// Statistics of a session.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Name of the device.
    pub device: String,
    /// Number of frames shown.
    pub frames: u64,
    /// Time that the window was open, seconds.
    pub seconds: f64,
    /// Percentiles of frame times, milliseconds.
    pub frame_ms: Percentiles,
    /// Validation messages, including those of shutdown.
    pub messages: Vec<String>,
}
