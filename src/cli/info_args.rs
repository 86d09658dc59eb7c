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
    /// List the features that this scene needs on the device, and those that it leaves out.
    #[arg(long, requires = "terrain")]
    pub plan: bool,
    /// Measure each feature that is left out: each is kept once, for FRAMES frames of the view.
    #[arg(long, value_name = "FRAMES", requires = "plan", num_args = 0..=1, default_missing_value = "30")]
    pub measure: Option<usize>,
    /// Draw the nodes of a map of 2^36 texels over the field that the view needs, by level, as a .png.
    #[arg(long, value_name = "FILE", requires = "terrain", conflicts_with = "plan")]
    pub working_set: Option<PathBuf>,
    /// The view for the plan and the working set.
    #[command(flatten)]
    pub view: ViewArgs,
    /// List Vulkan devices, and the features that each lacks.
    #[arg(long)]
    pub devices: bool,
    /// The technique of the plan.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The look of the plan.
    #[command(flatten)]
    pub look: LookArgs,
}
