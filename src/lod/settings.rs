//! Settings of techniques, as a technique declares them and as it reads them, without errors.

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
    pub(super) variant: Option<&'static str>,
    pub(super) values: Vec<(&'static Setting, String)>,
    /// Progress of the technique's preparation, if it reports any.
    pub progress: Progress,
}

impl Settings {
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
    /// Checks a value, given as text.
    pub(super) fn check(&self, value: &str) -> Result<(), String> {
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
