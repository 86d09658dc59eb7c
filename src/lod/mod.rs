//! Level-of-detail techniques: each a module that implements [`Technique`] and has a row in [`TECHNIQUES`].
//!
//! Pure computation without devices, files or clocks. Techniques never use each other.

pub mod brute_force;
pub mod budget;
mod choices;
pub mod clusters;
mod entry;
pub mod geomipmap;
mod prepare;
pub mod registry;
pub mod settings;
pub mod smooth_tiles;
pub mod sorted_strips;
pub mod sphere_tree;
mod table;
mod technique;
mod within_limits;

pub use entry::{Entry, Variant};
pub use registry::{TechniqueSpec, Techniques};
pub use settings::{Need, Setting, Settings, Values};
pub use table::{TECHNIQUES, find};
pub use technique::{Diagnostics, Gradual, Omitted, SelectInParts, SelectOnGpu, Technique};
