//! Executes draw lists on Vulkan: the only module that names `ash` or says `unsafe`.
//!
//! It cannot tell which technique it draws. Offscreen pictures and windows are two targets with the same two
//! steps. Everything is made at start; nothing is created inside a frame.
#![allow(unsafe_code)]

mod bindings;
pub mod capture;
pub mod clock;
pub mod device;
pub mod driven;
pub mod floor;
pub mod frames;
#[cfg(feature = "viewer")]
pub mod hud;
pub mod instance;
mod live;
mod loss;
mod materials;
pub mod memory;
pub mod oracle;
pub mod pages;
pub mod pipelines;
pub mod probe;
pub mod renderdoc;
#[cfg(feature = "viewer")]
pub mod screenshot;
pub mod shaders;
pub mod slot;
#[cfg(feature = "viewer")]
pub mod swapchain;
pub mod target;
pub mod terrain;
pub mod texture_slots;
pub mod twin;

pub use device::{Choice, Gpu};
pub use instance::Instance;
