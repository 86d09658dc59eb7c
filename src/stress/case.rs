//! A case of the suite: its name, and the work to be done.

use std::sync::Arc;

use super::finding::Finding;
use super::forms::TechniqueConfig;
use crate::height::Field;
use crate::view::View;

/// The action of a case.
pub enum Kind {
    /// Draws a field from several views with every technique and checks every invariant.
    Terrain(fn() -> StressTerrain),
    /// Flies over a field with every technique and each of its settings' words. Each frame must be one surface within
    /// its tolerance.
    Flight(fn() -> Flight),
    /// Runs a custom check with every technique.
    PerTechnique(fn(&TechniqueConfig) -> Vec<Finding>),
    /// Runs a check without techniques; the first value names its subject.
    Standalone(&'static str, fn() -> Vec<Finding>),
}

/// A case of the suite.
pub struct Case {
    /// Family: `data`, `position`, `view`, `time`, `arithmetic`, `stiff`, `file` or `sweep`.
    pub family: &'static str,
    /// Name, unique in its family.
    pub name: &'static str,
    /// Action.
    pub kind: Kind,
}

/// A field with views.
pub struct StressTerrain {
    /// The field.
    pub field: Arc<Field>,
    /// Names and views.
    pub views: Vec<(&'static str, View)>,
}

/// A field and a sequence of views.
pub struct Flight {
    /// The field.
    pub field: Arc<Field>,
    /// One view per frame.
    pub views: Vec<View>,
}
