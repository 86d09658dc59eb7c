//! Features that are kept or omitted by hand, to measure their cost.

use super::features::{FEATURES, Feature, Force};
use super::forced_set::Forced;
use super::scene_plan::ScenePlan;
use crate::draw::PipelineRequirements;

/// A feature's name on the command line.
pub fn word(feature: &Feature) -> String {
    feature.name.replace(' ', "-")
}

impl Forced {
    /// The set with one more feature, named by its [`word`].
    ///
    /// # Errors
    /// If there is no such feature, it cannot be forced so, or it is forced already.
    pub fn with(self, name: &str, keep: bool) -> Result<Self, String> {
        let Some(k) = FEATURES.iter().position(|feature| word(feature) == name) else {
            let known: Vec<_> = FEATURES.iter().filter(|f| f.can_be(true) || f.can_be(false)).map(word).collect();
            return Err(format!("{name}: no such feature: try {}", known.join(", ")));
        };
        let feature = &FEATURES[k];
        if !feature.can_be(keep) {
            let why = match feature.force {
                Force::Never(why) => why,
                _ => "what needs it would not be drawn right",
            };
            let how = if keep { "kept" } else { "left out" };
            return Err(format!("{name}: it cannot be {how} by hand: {why}"));
        }
        self.and(k, keep).ok_or_else(|| format!("{name}: forced twice"))
    }

    /// Each forced feature, with true if it is kept.
    pub(super) fn each(self) -> impl Iterator<Item = (&'static Feature, bool)> {
        FEATURES.iter().enumerate().filter_map(move |(k, feature)| Some((feature, self.state(k)?)))
    }

    /// Returns true if this feature is forced.
    pub(super) fn has(self, feature: &Feature) -> bool {
        self.each().any(|(forced, _)| forced.name == feature.name)
    }
}

impl ScenePlan {
    /// The plan of the same scene for another technique.
    pub fn with_requirements(&self, requirements: PipelineRequirements) -> Self {
        let mut plan = Self { requirements, draws: requirements.draws, ..self.clone() };
        plan.force();
        plan
    }

    /// Keeps and omits the forced features.
    pub(super) fn force(&mut self) {
        for (feature, keep) in self.forced.each() {
            feature.force(self, keep);
        }
    }

    /// The plan with one more feature, named by its [`word`], whether the scene needs it or not.
    ///
    /// # Errors
    /// If there is no such feature, or it cannot be forced.
    pub fn keeping(&self, name: &str) -> Result<Self, String> {
        let mut plan = self.clone();
        for (feature, keep) in Forced::default().with(name, true)?.each() {
            feature.force(&mut plan, keep);
        }
        Ok(plan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_forced_by_name_once_and_only_where_that_makes_sense() {
        assert!(FEATURES.len() <= 32, "a bit each");
        let fog = Forced::default().with("fog", true).unwrap();
        assert_eq!(fog.each().map(|(f, keep)| (f.name, keep)).collect::<Vec<_>>(), [("fog", true)]);
        assert!(fog.with("fog", false).unwrap_err().contains("forced twice"));
        let both = fog.with("queries", false).unwrap();
        assert_eq!(both.each().count(), 2);
        for (name, keep, expected) in [
            ("frog", true, "32-bit-heights"),
            ("ceiling", true, "--ceiling"),
            ("hole-mask", false, "cannot be left out"),
        ] {
            let refused = Forced::default().with(name, keep).unwrap_err();
            assert!(refused.contains(name) && refused.contains(expected), "{refused}");
        }
    }
}
