//! A case with one technique and its settings: the unit of work of the suite.

use super::case::{Case, Kind};
use super::finding::Finding;
use super::forms::{self, TechniqueConfig};
use super::{flight, panics, terrain};
use crate::lod::Techniques;

/// A case with one technique, or without one if it is standalone.
pub struct CaseRun {
    /// The case.
    pub case: &'static Case,
    /// The technique and its settings; `None` for a standalone case.
    pub config: Option<TechniqueConfig>,
}

impl CaseRun {
    /// Returns the name of the technique with its settings, or of a standalone case's subject.
    pub fn technique(&self) -> String {
        match (&self.config, &self.case.kind) {
            (Some(config), _) => config.name.clone(),
            (None, Kind::Standalone(subject, _)) => subject.to_string(),
            (None, _) => unreachable!("only standalone cases have no technique"),
        }
    }

    /// Returns true if an [`ImageChecker`] draws the run: terrain and flights, with the default settings of each
    /// variant.
    pub fn is_drawn(&self) -> bool {
        let has_picture = matches!(self.case.kind, Kind::Terrain(_) | Kind::Flight(_));
        has_picture && self.config.as_ref().is_some_and(|config| config.choices.is_empty())
    }

    /// Runs all checks that need no GPU. A panic becomes a finding.
    pub fn run(&self) -> Vec<Finding> {
        let findings = panics::caught(|| match (&self.case.kind, &self.config) {
            (Kind::Terrain(terrain), Some(config)) => terrain::examine(&terrain(), config),
            (Kind::Flight(flight), Some(config)) => flight::examine(&flight(), config),
            (Kind::PerTechnique(examine), Some(config)) => examine(config),
            (Kind::Standalone(_, examine), _) => examine(),
            (_, None) => Vec::new(),
        });
        findings.unwrap_or_else(|text| vec![Finding::within("panics", 1.0, 0.0).with_reason(Some(text))])
    }
}

/// Combines cases with the techniques named (`name` or `name:variant`), or with all. Flights use every word of every
/// setting, other cases the default settings.
///
/// # Errors
/// If a name is unknown.
pub fn case_runs(cases: &[&'static Case], techniques: &Techniques, names: &[String]) -> Result<Vec<CaseRun>, String> {
    let mut runs = Vec::new();
    for &case in cases {
        let configs = match case.kind {
            Kind::Terrain(_) | Kind::PerTechnique(_) => forms::with_defaults(techniques, names)?,
            Kind::Flight(_) => forms::with_each_word(techniques, names)?,
            Kind::Standalone(..) => Vec::new(),
        };
        if let Kind::Standalone(..) = case.kind {
            runs.push(CaseRun { case, config: None });
        }
        runs.extend(configs.into_iter().map(|config| CaseRun { case, config: Some(config) }));
    }
    Ok(runs)
}
