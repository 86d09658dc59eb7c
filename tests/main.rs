//! All integration tests in one binary; the modules mirror `src/`.

mod altered;
mod architecture;
mod bench;
mod cli;
mod conformance;
mod fuzz;
#[cfg(feature = "vulkan")]
mod gpu;
mod height;
mod lod;
mod measure;
mod profile;
mod readme;
mod report;
mod stress;
mod synth;
mod texture;
#[cfg(feature = "viewer")]
mod viewer;
