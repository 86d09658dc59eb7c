//! Flags of every subcommand, and the outcome of a run.

use clap::Args;

/// Flags of every subcommand.
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
    /// Device memory runs out after N allocations, for testing.
    #[arg(long, global = true, value_name = "N")]
    pub allocations: Option<u64>,
    /// The device is lost after N calls that would notice, for testing.
    #[arg(long, global = true, value_name = "N")]
    pub lose_device: Option<u64>,
}

/// Outcome of a run that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything asked for was done: exit code 0.
    Done,
    /// A limit was missed — a crack, an error, a validation message — or not all was tried: exit code 1.
    LimitMissed,
}
