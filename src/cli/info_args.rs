//! Arguments of `cuesta info`.

use std::path::PathBuf;

use clap::Args;

use super::scene::{LookArgs, ReadArgs, ViewArgs};
use super::technique::TechniqueArgs;

/// Arguments.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Height files of any supported format, or folders of them, as one field; a directory of web-map tiles; or `demo`.
    #[arg(required_unless_present = "devices")]
    pub terrain: Vec<String>,
    /// Options for reading heights.
    #[command(flatten)]
    pub reading: ReadArgs,
    /// Show what this scene needs on the device, and what it leaves out.
    #[arg(long, requires = "terrain")]
    pub plan: bool,
    /// Also measure the cost of each feature that is left out: each is kept once, for FRAMES frames of the view.
    #[arg(long, value_name = "FRAMES", requires = "plan", num_args = 0..=1, default_missing_value = "30")]
    pub measure: Option<usize>,
    /// Draws which nodes of a map of 2^36 texels over the field the view needs, and how fine: a .png.
    #[arg(long, value_name = "FILE", requires = "terrain", conflicts_with = "plan")]
    pub working_set: Option<PathBuf>,
    /// The view that is needed for.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Vulkan devices, and what is missing on each.
    #[arg(long)]
    pub devices: bool,
    /// The technique planned for.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The look planned for.
    #[command(flatten)]
    pub look: LookArgs,
}
