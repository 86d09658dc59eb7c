//! A technique as a row of a table: name, publication, variants, settings, and the function that prepares it.

use std::sync::Arc;

use super::settings::{Need, Setting, Settings};
use super::technique::Technique;
use crate::height::Field;

/// A named form of a technique, chosen as `technique:variant`.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// Its name.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
}

/// One row of the table of techniques.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name on the command line.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    /// Publication it implements.
    pub paper: &'static str,
    /// Forms beside the default one.
    pub variants: &'static [Variant],
    /// Settings with their defaults.
    pub settings: &'static [Setting],
    /// Settings that have no effect beside some values of others.
    pub needs: &'static [Need],
    /// Maximum number of samples of a field, tiling included. Memory or time per frame grow with it.
    pub max_samples: u64,
    /// Maximum number of samples along a side of a field, tiling included.
    pub max_side: u32,
    /// True if it can draw terrain without samples ([`Field::procedural`]).
    pub takes_endless: bool,
    /// Prepares the technique for a field within these limits.
    pub build: fn(Arc<Field>, &Settings) -> Box<dyn Technique>,
}
