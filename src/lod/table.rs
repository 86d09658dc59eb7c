//! The table of the built-in techniques.

use super::entry::Entry;
use super::{brute_force, clusters, geomipmap, smooth_tiles, sorted_strips, sphere_tree};

/// All techniques. The table feeds the command line, the viewer's keys, the invariants, the golden pictures, the
/// benchmarks and the reports.
pub const TECHNIQUES: &[Entry] = &[
    brute_force::ENTRY,
    geomipmap::ENTRY,
    smooth_tiles::ENTRY,
    sorted_strips::ENTRY,
    sphere_tree::ENTRY,
    clusters::ENTRY,
];

/// The row with this name.
pub fn find(name: &str) -> Option<&'static Entry> {
    TECHNIQUES.iter().find(|entry| entry.name == name)
}
