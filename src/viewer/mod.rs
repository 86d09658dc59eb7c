//! The interactive viewer: a camera over the terrain, key bindings from one table, statistics over the image.

mod app;
pub mod bindings;
pub mod camera;
pub mod hud;
mod renderer;
mod session;
mod setup;
pub mod site;
pub mod times;

use anyhow::{Context, Result, anyhow};
use winit::event_loop::EventLoop;

use app::{App, QuitEvent};
pub use setup::{Setup, Summary};

/// Opens the window and returns when it is closed.
pub fn run(setup: &Setup) -> Result<Summary> {
    let event_loop = EventLoop::<QuitEvent>::with_user_event().build();
    // The window system's message names its source files only; replaced by a helpful one.
    let event_loop = event_loop.map_err(|_| anyhow!("no window: the display cannot be reached"))?;
    let proxy = event_loop.create_proxy();
    (setup.on_interrupt)(Box::new(move || {
        let _ = proxy.send_event(QuitEvent);
    }));
    let mut app = App::new(setup);
    event_loop.run_app(&mut app).context("the window system")?;
    app.into_summary()
}
