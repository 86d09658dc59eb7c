//! The window: a camera over the land, keys from one table, numbers over the picture.

mod app;
pub mod bindings;
pub mod camera;
pub mod hud;
mod renderer;
mod session;
pub mod site;
pub mod times;

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow};
use winit::event_loop::EventLoop;

use crate::gpu::Choice;
use crate::height::Field;
use crate::lod::budget::Target;
use crate::lod::{Entry, Settings, Techniques};
use crate::plan::Look;
use crate::view::View;
use app::{App, Stop};
use times::Percentiles;

/// What is to be seen.
pub struct Setup {
    /// The terrain's name, for the title.
    pub name: String,
    /// The land.
    pub field: Arc<Field>,
    /// From where, and in a window of what size.
    pub view: View,
    /// Near plane, metres, unless it follows the height above ground.
    pub near: Option<f64>,
    /// The techniques that keys choose from.
    pub techniques: Techniques,
    /// The technique at the start, and its settings.
    pub technique: (&'static Entry, Settings),
    /// What was set on that technique.
    pub choices: Vec<(String, String)>,
    /// What a frame is to cost, by moving the view's tolerance.
    pub target: Option<Target>,
    /// How the land looks.
    pub look: Look,
    /// A picture laid over it, for when the colours are its.
    pub overlay: Option<image::RgbaImage>,
    /// Which device.
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

/// How a session went.
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
    /// What the validation layers said, to the end of everything.
    pub messages: Vec<String>,
}

/// Opens the window and returns when it is closed.
pub fn run(setup: &Setup) -> Result<Summary> {
    let event_loop = EventLoop::<Stop>::with_user_event().build();
    // The window system's own words name its source files, and nothing that helps.
    let event_loop = event_loop.map_err(|_| anyhow!("no window: the display cannot be reached"))?;
    let proxy = event_loop.create_proxy();
    (setup.on_interrupt)(Box::new(move || {
        let _ = proxy.send_event(Stop);
    }));
    let mut app = App::new(setup);
    event_loop.run_app(&mut app).context("the window system")?;
    app.into_summary()
}
