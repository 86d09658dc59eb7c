//! Executes draw lists on Vulkan. The only module that names `ash` or says `unsafe`.
//!
//! It does not depend on any technique. One [`frame_renderer`] draws every frame as a list of [`passes`] to a
//! [`target`]. All objects are made in advance; nothing is created inside a frame.
#![allow(unsafe_code)]

mod bindings;
pub mod clock;
pub mod device;
pub mod embedded;
pub mod embedded_target;
pub mod formats;
pub mod frame_renderer;
pub mod frames;
pub mod gpu_selection;
pub mod gpu_tile_cache;
pub mod height_pages;
pub mod instance;
pub mod lent;
mod live;
mod loss;
mod materials;
pub mod memory;
pub mod pass;
mod pass_list;
pub mod passes;
pub mod pipelines;
pub mod position_check;
pub mod probe;
pub mod renderdoc;
pub mod requirements;
#[cfg(feature = "viewer")]
pub mod screenshot;
pub mod shaders;
pub mod slot;
#[cfg(feature = "viewer")]
pub mod swapchain;
pub mod target;
pub mod terrain;
#[cfg(feature = "viewer")]
pub mod window_target;

pub use device::{Choice, Gpu};
pub use instance::Instance;
