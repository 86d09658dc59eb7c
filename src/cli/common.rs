//! Flags of every subcommand, and the outcome of a run.

use clap::Args;

/// What every subcommand takes.
#[derive(Args, Debug, Clone, Default)]
pub struct Common {
    /// One JSON document on stdout and nothing else there.
    #[arg(long, global = true)]
    pub json: bool,
    /// Say only what was asked for.
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Vulkan device: part of its name, or `cpu` for a software device.
    #[arg(long, global = true, value_name = "NAME")]
    pub device: Option<String>,
    /// Validation layers on; any message makes the exit code 1.
    #[arg(long, global = true)]
    pub validate: bool,
    /// Device memory is out after so many allocations: to try what happens then.
    #[arg(long, global = true, value_name = "N")]
    pub allocations: Option<u64>,
    /// The device is lost after so many calls that would notice: to try what happens then.
    #[arg(long, global = true, value_name = "N")]
    pub lose_device: Option<u64>,
}

/// How a run ended, if it did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything asked for was done: exit code 0.
    Done,
    /// A limit was missed — a crack, an error, a validation message — or not all was tried: exit code 1.
    LimitMissed,
}
