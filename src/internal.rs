//! All modules of the crate, for its own program and tests. No promise of stability.
//!
//! In dependency order; each uses only those above it (`tests/architecture` enforces this).

#[path = "view/mod.rs"]
pub mod view;

#[path = "height/mod.rs"]
pub mod height;

#[path = "draw/mod.rs"]
pub mod draw;

#[path = "texture/mod.rs"]
pub mod texture;

#[path = "renamed.rs"]
pub mod renamed;

#[path = "lod/mod.rs"]
pub mod lod;

#[path = "plan/mod.rs"]
pub mod plan;

#[cfg(feature = "vulkan")]
#[path = "gpu/mod.rs"]
pub mod gpu;

#[path = "measure/mod.rs"]
pub mod measure;

#[cfg(feature = "vulkan")]
#[path = "scene/mod.rs"]
pub mod scene;

#[cfg(feature = "vulkan")]
#[path = "embed/mod.rs"]
pub mod embed;

#[cfg(feature = "bench")]
#[path = "bench/mod.rs"]
pub mod bench;

#[cfg(feature = "bench")]
#[path = "profile/mod.rs"]
pub mod profile;

#[cfg(feature = "bench")]
#[path = "stress/mod.rs"]
pub mod stress;

#[cfg(feature = "bench")]
#[path = "report/mod.rs"]
pub mod report;

#[cfg(feature = "viewer")]
#[path = "viewer/mod.rs"]
pub mod viewer;

#[cfg(feature = "cli")]
#[path = "cli/mod.rs"]
pub mod cli;
