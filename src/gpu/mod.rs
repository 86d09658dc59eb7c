//! Executes draw lists on Vulkan. Besides [`embed`](crate::embed), it is the only module that names `ash` or says `unsafe`.
//!
//! It cannot tell which technique it draws. Offscreen pictures and windows are two targets with the same two
//! steps. Everything is made at start; nothing is created inside a frame.
#![allow(unsafe_code)]

mod bindings;
pub mod capture;
pub mod clock;
pub mod device;
pub mod error_pass;
pub mod frames;
pub mod gpu_selection;
pub mod gpu_tile_cache;
pub mod height_pages;
#[cfg(feature = "viewer")]
pub mod hud;
pub mod instance;
pub mod lent;
mod live;
mod loss;
mod materials;
pub mod memory;
pub mod pipelines;
pub mod position_check;
pub mod probe;
pub mod renderdoc;
pub mod requirements;
#[cfg(feature = "viewer")]
pub mod screenshot;
pub mod shaders;
pub mod shading_only;
pub mod slot;
#[cfg(feature = "viewer")]
pub mod swapchain;
pub mod target;
pub mod terrain;

pub use device::{Choice, Gpu};
pub use instance::Instance;
