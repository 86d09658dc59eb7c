//! The procedural terrain `endless`, which has no stored samples.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, anyhow, bail};

use crate::height::bezier::{Bezier, LAYERS};
use crate::height::{Field, Footprint, Loaded, Options};

/// Returns the terrain named `endless` or `endless:SEED`, unless a file has that name.
pub fn named(terrain: &str, options: &Options) -> Option<Result<Loaded>> {
    let rest = terrain.strip_prefix("endless").filter(|_| !Path::new(terrain).exists())?;
    let seed = match rest.strip_prefix(':') {
        None if rest.is_empty() => Ok(1),
        None => return None,
        Some(seed) => seed.parse().map_err(|_| anyhow!("{terrain}: seed: expected a whole number from 0 on")),
    };
    Some(seed.and_then(|seed| endless(terrain, seed, options)))
}

/// Returns true if [`named`] finds a terrain of this name, even one with a wrong seed.
pub fn is_named(terrain: &str) -> bool {
    named(terrain, &Options::default()).is_some()
}

/// Makes the terrain.
///
/// # Errors
/// If an option about samples is given, such as a spacing or a crop.
fn endless(terrain: &str, seed: u64, options: &Options) -> Result<Loaded> {
    let Options { max_samples, hole_fill, .. } = *options;
    if *options != (Options { max_samples, hole_fill, ..Options::default() }) {
        bail!("{terrain}: procedural terrain has no samples to space, scale, crop or repeat");
    }
    let field = Field::endless(Arc::new(Bezier::new(seed, LAYERS)));
    let sample_type = "f32".to_string();
    Ok(Loaded {
        field,
        format: "endless",
        sample_type,
        exact_in_16_bit: false,
        footprint: Footprint::default(),
        warnings: Vec::new(),
        sources: Vec::new(),
    })
}

/// Checks that a terrain has samples. `what` is the command or flag that reads all of them.
///
/// # Errors
/// If the terrain is procedural.
pub fn need_samples(field: &Field, what: &str) -> Result<()> {
    if field.procedural().is_some() {
        bail!("{what}: reads every sample, but procedural terrain has none");
    }
    Ok(())
}
