//! The draw list of a frame, as plain data. It depends neither on the techniques that fill it nor on the renderer.

pub mod distance;
mod draws;
pub mod expand;
mod frame;
mod geometry;
pub mod gpu_selection;
pub mod layout;
mod limits;
mod list;
pub mod normals;
pub mod place;
mod relative;
mod requirements;
pub mod shared;
pub mod skirts;
pub mod weights;

pub use draws::{Draw, RESTART, Source, Topology};
pub use geometry::{Geometry, Upload};
pub use gpu_selection::GpuSelection;
pub use layout::{ExplicitVertex, Instance, LatticeVertex, VertexNormals};
pub use limits::{DeviceGeometry, Limits};
pub use list::{DrawList, Submission};
pub use requirements::{DepthMode, DrawKinds, Morph, Normals, PipelineRequirements, Seams};
