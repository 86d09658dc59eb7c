//! The choices of a caller, checked once against what a technique declares.

use super::entry::Entry;
use super::settings::{Need, Settings};
use crate::height::progress::Progress;

impl Settings {
    /// Returns the settings of `entry` with `choices` in place of defaults.
    ///
    /// # Errors
    /// If a variant, a key or a value is unknown. The error lists the allowed ones.
    pub fn new(entry: &Entry, variant: Option<&str>, choices: &[(String, String)]) -> Result<Self, String> {
        let variant = match variant {
            None => None,
            Some(name) => Some(entry.variants.iter().find(|v| v.name == name).ok_or_else(|| {
                let known: Vec<_> = entry.variants.iter().map(|v| v.name).collect();
                format!("{} has no variant {name}, expected one of: {}", entry.name, known.join(", "))
            })?),
        };
        let mut values: Vec<_> = entry.settings.iter().map(|s| (s, s.default.to_string())).collect();
        for (key, value) in choices {
            let Some(slot) = values.iter_mut().find(|(s, _)| s.key == key) else {
                let known: Vec<_> = entry.settings.iter().map(|s| s.key).collect();
                return Err(format!("{} has no setting {key}, expected one of: {}", entry.name, known.join(", ")));
            };
            slot.0.check(value).map_err(|why| format!("{}: {why}", entry.name))?;
            slot.1 = value.clone();
        }
        Ok(Self { variant: variant.map(|v| v.name), values, progress: Progress::default() })
    }

    /// Returns the defaults of `entry`.
    pub fn defaults(entry: &Entry) -> Self {
        let values = entry.settings.iter().map(|s| (s, s.default.to_string())).collect();
        Self { variant: None, values, progress: Progress::default() }
    }

    /// Returns a line for each setting without effect under the others.
    pub fn idle(&self, entry: &Entry) -> Vec<String> {
        let is_set = |key: &str| self.values.iter().any(|(s, value)| s.key == key && value != s.default);
        let is_idle = |need: &&Need| is_set(need.key) && !need.words.contains(&self.word(need.other));
        let line = |&Need { key, other, words }: &Need| {
            let (value, word) = (self.word(key), self.word(other));
            format!("{key}={value} does nothing with {other}={word}, expected {other}={}", words.join("|"))
        };
        entry.needs.iter().filter(is_idle).map(line).collect()
    }
}
