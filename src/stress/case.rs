//! A row of the suite.

use super::finding::Finding;
use super::flight::Flight;
use super::forms::Form;
use super::terrain::StressTerrain;

/// The check of a case.
pub enum Kind {
    /// Every technique draws a field from views, and every law is held against what it draws.
    Terrain(fn() -> StressTerrain),
    /// Every technique, in every word of its settings, is flown; each frame is one surface within its tolerance.
    Flight(fn() -> Flight),
    /// Something of its own is done with every technique.
    Each(fn(&Form) -> Vec<Finding>),
    /// No technique takes part: whose it is, and what is done.
    Alone(&'static str, fn() -> Vec<Finding>),
}

/// A row of the suite.
pub struct Case {
    /// Part of the suite: `data`, `position`, `view`, `time`, `arithmetic`, `stiff`, `file` or `sweep`.
    pub family: &'static str,
    /// Its name.
    pub name: &'static str,
    /// The check.
    pub kind: Kind,
}
