//! Settings of techniques: declared by each technique, validated once, then read without errors.

use super::Entry;
use crate::height::progress::Progress;

/// Allowed values of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Values {
    /// One of these words.
    Words(&'static [&'static str]),
    /// A number in this range, ends included.
    Number(f64, f64),
}

/// A setting, given as `--set key=value`.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Its key.
    pub key: &'static str,
    /// Allowed values.
    pub values: Values,
    /// Default value.
    pub default: &'static str,
    /// Description, one line.
    pub about: &'static str,
}

/// A setting that has an effect only if another setting has one of these words.
#[derive(Clone, Copy, Debug)]
pub struct Need {
    /// Its key.
    pub key: &'static str,
    /// Key of the other setting.
    pub other: &'static str,
    /// Words of the other setting.
    pub words: &'static [&'static str],
}

/// A variant, and values for all settings of one technique.
#[derive(Clone, Debug)]
pub struct Settings {
    variant: Option<&'static str>,
    values: Vec<(&'static Setting, String)>,
    /// Progress of the technique's preparation, if it reports any.
    pub progress: Progress,
}

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
            slot.0.check(value)?;
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

    /// Returns the variant, if it is not the default one.
    pub fn variant(&self) -> Option<&'static str> {
        self.variant
    }

    /// Returns the value of a setting as a word.
    ///
    /// # Panics
    /// If the technique did not declare the key.
    pub fn word(&self, key: &str) -> &str {
        &self.values.iter().find(|(s, _)| s.key == key).expect("a declared setting").1
    }

    /// Returns the value of a setting as a number.
    ///
    /// # Panics
    /// If the technique did not declare the key as a number.
    pub fn number(&self, key: &str) -> f64 {
        self.word(key).parse().expect("a number validated by `Settings::new`")
    }
}

impl Setting {
    fn check(&self, value: &str) -> Result<(), String> {
        match self.values {
            Values::Words(words) if words.contains(&value) => Ok(()),
            Values::Number(low, high) if value.parse().is_ok_and(|v: f64| (low..=high).contains(&v)) => Ok(()),
            _ => Err(format!("{}={value}: expected {}", self.key, self.values)),
        }
    }
}

impl std::fmt::Display for Values {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Values::Words(words) => write!(f, "{}", words.join("|")),
            Values::Number(low, high) => write!(f, "{low} to {high}"),
        }
    }
}
