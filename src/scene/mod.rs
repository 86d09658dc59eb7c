//! A field drawn offscreen by a technique on a device: pictures, draw lists and times.

pub mod capture;
pub mod holes;
pub mod picture;
mod plan;
pub mod probed;
mod renderer;
pub mod savings;
mod source;
mod times;

pub use plan::plan;
pub use renderer::{Copy, RenderResult, Scene, SceneRenderer};
pub use times::Times;
