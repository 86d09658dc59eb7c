//! All integration tests in one binary; the modules mirror `src/`.

#[cfg(feature = "bench")]
mod altered;
mod architecture;
#[cfg(feature = "bench")]
mod bench;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "bench")]
mod conformance;
#[cfg(feature = "cli")]
mod fuzz;
#[cfg(all(feature = "vulkan", feature = "bench"))]
mod gpu;
mod height;
#[cfg(feature = "bench")]
mod lod;
#[cfg(feature = "bench")]
mod measure;
mod prepared;
#[cfg(feature = "bench")]
mod profile;
#[cfg(feature = "cli")]
mod readme;
#[cfg(feature = "bench")]
mod report;
#[cfg(feature = "bench")]
mod stress;
mod synth;
mod texture;
#[cfg(all(feature = "viewer", feature = "cli"))]
mod viewer;
