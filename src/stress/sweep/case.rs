//! A sweep case as plain data, and its check against every invariant.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::terrain::Terrain;
use super::viewpoint::Viewpoint;
use crate::height::Field;
use crate::lod::{Entry, Settings};
use crate::stress::invariants::{self, Subject, Violation};
use crate::stress::panics;
use crate::view::{Metric, Tolerance, View};

/// A technique with settings, terrain, a view and a tolerance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepCase {
    /// Name of the technique.
    pub technique: String,
    /// Variant, unless it is the default one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Keys and values that differ from the defaults.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub settings: Vec<(String, String)>,
    /// The terrain.
    pub terrain: Terrain,
    /// The view, relative to the terrain.
    pub view: Viewpoint,
    /// Tolerance, pixels.
    pub tolerance_px: f64,
    /// True for the paper's error metric, false for the certified one.
    #[serde(default)]
    pub paper_metric: bool,
}

/// A case that violates an invariant.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The case.
    pub case: SweepCase,
    /// Name of the invariant.
    pub invariant: &'static str,
    /// The violation.
    pub violation: Violation,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}\n  SWEEP_CASE='{}'", self.invariant, self.violation.why, self.case)
    }
}

impl SweepCase {
    /// Creates the terrain and the view.
    pub fn scene(&self) -> (Arc<Field>, View) {
        let field = Arc::new(self.terrain.field());
        let metric = if self.paper_metric { Metric::Paper } else { Metric::Certified };
        let view = self.view.view(&field, Tolerance { px: self.tolerance_px, metric });
        (field, view)
    }

    /// Checks every invariant with the table entry of the technique. Returns the first failure; a panic is a failure.
    pub fn check(&self, entry: &Entry) -> Result<(), Box<Failure>> {
        let (field, view) = self.scene();
        let views = [("the case's view", view)];
        match panics::caught(|| self.keeps_invariants(entry, &field, &views)) {
            Ok(outcome) => outcome.map_err(|(invariant, violation)| self.fails(invariant, violation)),
            Err(text) => Err(self.fails("no panic", Violation::new(views[0], text))),
        }
    }

    fn fails(&self, invariant: &'static str, violation: Violation) -> Box<Failure> {
        Box::new(Failure { case: self.clone(), invariant, violation })
    }

    fn keeps_invariants(
        &self,
        entry: &Entry,
        field: &Arc<Field>,
        views: &[(&'static str, View)],
    ) -> Result<(), (&'static str, Violation)> {
        let settings = Settings::new(entry, self.variant.as_deref(), &self.settings);
        let prepared = settings.and_then(|settings| entry.prepare(field, &settings));
        let mut technique = prepared.map_err(|why| ("it can be prepared", Violation::new(views[0], why)))?;
        let tolerances_px = [1.0, 2.0, 16.0].map(|factor| factor * self.tolerance_px);
        let mut subject = Subject { tolerances_px: &tolerances_px, ..Subject::new(field, &mut *technique, views) };
        invariants::of_technique(&self.technique)
            .try_for_each(|invariant| (invariant.check)(&mut subject).map_err(|violation| (invariant.name, violation)))
    }
}

impl fmt::Display for SweepCase {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| fmt::Error)?)
    }
}

impl FromStr for SweepCase {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        serde_json::from_str(line).map_err(|error| error.to_string())
    }
}
