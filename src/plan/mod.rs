//! The plan of a scene: the features it needs, and those that are omitted.
//!
//! It is made before any object on the device, and alone decides which objects exist.

mod builder;
mod colour;
mod constants;
mod decisions;
mod device_limits;
pub mod features;
pub mod forced;
mod forced_set;
mod look;
mod mipmaps;
mod pages;
mod scene_plan;

pub use builder::ScenePlanBuilder;
pub use colour::Colour;
pub use constants::SceneConstants;
pub use decisions::Decision;
pub use device_limits::DeviceLimits;
pub use features::{FEATURES, Feature};
pub use forced_set::Forced;
pub use look::Look;
pub use mipmaps::mip_levels;
pub use scene_plan::ScenePlan;
