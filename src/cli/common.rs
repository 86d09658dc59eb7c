//! Flags that every subcommand has, and the outcome of a subcommand.

use clap::Args;

use crate::lod::Techniques;

/// Flags that every subcommand has, and the techniques that `--technique` chooses from.
#[derive(Args, Debug, Clone, Default)]
pub struct Common {
    /// Print the result as one JSON document on stdout.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print no progress and no warnings.
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Vulkan device: part of its name, or `cpu` for a software device.
    #[arg(long, global = true, value_name = "NAME")]
    pub device: Option<String>,
    /// Turn Vulkan's validation layers on. Any message makes the exit code 1.
    #[arg(long, global = true)]
    pub validate: bool,
    /// For tests: fail every allocation of device memory after the first N.
    #[arg(long, global = true, value_name = "N")]
    pub allocations: Option<u64>,
    /// For tests: report the device as lost after N calls that can notice it.
    #[arg(long, global = true, value_name = "N")]
    pub lose_device: Option<u64>,
    /// The techniques that `--technique` chooses from.
    #[arg(skip)]
    pub techniques: Techniques,
}

/// Outcome of a subcommand that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Finished: exit code 0.
    Done,
    /// Finished with a missed limit (a crack, too large an error, a validation message), or stopped early: exit code 1.
    LimitMissed,
}
