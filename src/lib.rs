//! **cuesta** draws large terrain with a bounded error: every family of continuous level of detail, side by
//! side, on the same data, through one executor on Vulkan.
//!
//! Modules in dependency order; each uses only those above it (`tests/architecture.rs` holds this):
//!
//! - [`view`]: eye, projection, frustum, tolerance.
//! - [`height`]: height data: files, synthesis, bounds, the surface between samples.
//! - [`draw`]: the draw list: a frame as plain data.
//! - [`texture`]: textures made at start.
//! - [`renamed`]: former names of JSON fields.
//! - [`lod`]: the techniques: from a view to a frame.
//! - [`plan`]: what a scene needs, and so what is left out.
//! - [`gpu`]: executes frames on Vulkan (feature `vulkan`).
//! - [`measure`]: numbers from triangles and pictures: errors, proofs.
//! - [`scene`]: a field with a look on a device, drawn offscreen (feature `vulkan`).
//! - [`mod@bench`]: error against run time, along named paths.
//! - [`profile`]: where a frame's time goes, draw by draw (measured with feature `vulkan`).
//! - [`stress`]: the invariants, and the suite of stiff and extreme cases.
//! - [`report`]: rows as a page and plots.
//! - [`viewer`]: the window (feature `viewer`).
//! - [`cli`]: the program.

pub mod view;

pub mod height;

pub mod draw;

pub mod texture;

pub mod renamed;

pub mod lod;

pub mod plan;

#[cfg(feature = "vulkan")]
pub mod gpu;

pub mod measure;

#[cfg(feature = "vulkan")]
pub mod scene;

#[cfg(feature = "bench")]
pub mod bench;

#[cfg(feature = "bench")]
pub mod profile;

#[cfg(feature = "bench")]
pub mod stress;

#[cfg(feature = "bench")]
pub mod report;

#[cfg(feature = "viewer")]
pub mod viewer;

#[cfg(feature = "cli")]
pub mod cli;
