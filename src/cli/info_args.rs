//! Arguments of `cuesta info`.

use std::path::PathBuf;

use clap::Args;

use super::scene::{LookArgs, ReadArgs, ViewArgs};
use super::technique::TechniqueArgs;

/// Arguments of `cuesta info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Height files of any supported format, or folders of them, as one field; a folder of web-map tiles; or `demo`.
    #[arg(required_unless_present = "devices")]
    pub terrain: Vec<String>,
    /// Options for reading them.
    #[command(flatten)]
    pub reading: ReadArgs,
    /// Print the scene plan: the features that this scene needs on the device, and those that it leaves out.
    #[arg(long, requires = "terrain")]
    pub plan: bool,
    /// Measure the cost of each feature that is left out, by drawing FRAMES frames of the view with it.
    #[arg(long, value_name = "FRAMES", requires = "plan", num_args = 0..=1, default_missing_value = "30")]
    pub measure: Option<usize>,
    /// Write a .png that shows which tiles of a virtual texture with 2^36 texels over the field the view needs, by
    /// level.
    #[arg(long, value_name = "FILE", requires = "terrain", conflicts_with = "plan")]
    pub working_set: Option<PathBuf>,
    /// The view for `--measure` and `--working-set`.
    #[command(flatten)]
    pub view: ViewArgs,
    /// List the Vulkan devices, and the required features that each lacks.
    #[arg(long)]
    pub devices: bool,
    /// The technique for the plan and the working set.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The look for the plan.
    #[command(flatten)]
    pub look: LookArgs,
}
