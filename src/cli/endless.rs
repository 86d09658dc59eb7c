//! The procedural terrain named `endless`, without stored samples.

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
        Some(seed) => seed.parse().map_err(|_| anyhow!("{terrain}: seed: expected a number of 0 or more")),
    };
    Some(seed.and_then(|seed| endless(terrain, seed, options)))
}

/// Returns true for the name of such a terrain.
pub fn is_named(terrain: &str) -> bool {
    named(terrain, &Options::default()).is_some()
}

/// Makes the terrain. Options about samples do not apply to it and are refused.
fn endless(terrain: &str, seed: u64, options: &Options) -> Result<Loaded> {
    let Options { max_samples, hole_fill, .. } = *options;
    if *options != (Options { max_samples, hole_fill, ..Options::default() }) {
        bail!("{terrain}: it is worked out as it is looked at: it has no samples to space, scale, crop or repeat");
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

/// Refuses a terrain without samples.
pub fn need_samples(field: &Field, what: &str) -> Result<()> {
    if field.procedural().is_some() {
        bail!("{what}: it looks at every sample, and this land has none");
    }
    Ok(())
}
