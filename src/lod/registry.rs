//! Techniques by name: the built-in ones, and a caller's own.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use super::entry::Entry;
use super::settings::Settings;
use super::table::TECHNIQUES;
use super::technique::Technique;
use crate::height::Field;

/// The techniques that a program offers: the built-in [`TECHNIQUES`], and a caller's own.
///
/// A plain value. The command line, the benchmark, the stress suite and the window each take one and look names up in it.
#[derive(Clone, Debug)]
pub struct Techniques {
    entries: Vec<&'static Entry>,
}

impl Techniques {
    /// Returns the built-in techniques, in the order of [`TECHNIQUES`].
    pub fn built_in() -> Self {
        Self { entries: TECHNIQUES.iter().collect() }
    }

    /// Adds a technique after the others.
    ///
    /// # Panics
    /// If its name is empty, contains a colon, or is taken.
    pub fn with(mut self, entry: &'static Entry) -> Self {
        let name = entry.name;
        assert!(!name.is_empty() && !name.contains(':'), "technique {name:?}: a name has letters and no colon");
        assert!(self.find(name).is_none(), "technique {name}: this name is taken");
        self.entries.push(entry);
        self
    }

    /// Returns every technique, the built-in ones first.
    pub fn entries(&self) -> &[&'static Entry] {
        &self.entries
    }

    /// Returns the technique with this name.
    pub fn find(&self, name: &str) -> Option<&'static Entry> {
        self.entries.iter().copied().find(|entry| entry.name == name)
    }

    /// Returns the technique that a spec names, without a look at its variant.
    ///
    /// # Errors
    /// If there is none of this name. The error lists all names.
    pub fn entry(&self, spec: &TechniqueSpec) -> Result<&'static Entry, String> {
        self.find(&spec.name).ok_or_else(|| {
            let known: Vec<_> = self.entries.iter().map(|entry| entry.name).collect();
            format!("{}: expected one of {}", spec.name, known.join(", "))
        })
    }

    /// Prepares a technique, named as `technique` or `technique:variant`, with its default settings for a field.
    ///
    /// # Errors
    /// If the name is unknown or the technique cannot draw the field.
    pub fn prepare(&self, spec: &str, field: &Arc<Field>) -> Result<Box<dyn Technique>, String> {
        let spec: TechniqueSpec = spec.parse()?;
        let entry = self.entry(&spec)?;
        entry.prepare(field, &Settings::new(entry, spec.variant.as_deref(), &[])?)
    }

    /// Returns every technique and every variant, spelled as on the command line.
    pub fn specs(&self) -> Vec<TechniqueSpec> {
        let of_entry = |entry: &&'static Entry| {
            let name = entry.name.to_string();
            let variants = entry.variants.iter().map(|variant| Some(variant.name.to_string()));
            std::iter::once(None).chain(variants).map(move |variant| TechniqueSpec { name: name.clone(), variant })
        };
        self.entries.iter().flat_map(of_entry).collect()
    }
}

impl Default for Techniques {
    fn default() -> Self {
        Self::built_in()
    }
}

/// A technique, and one of its variants if it is not the default one: `geomipmap`, `technique:variant`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TechniqueSpec {
    /// Name of the technique.
    pub name: String,
    /// Name of the variant; `None` for the default one.
    pub variant: Option<String>,
}

impl FromStr for TechniqueSpec {
    type Err = String;

    /// Splits the text at its first colon. Names are looked up later, in [`Techniques`].
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, variant) = text.split_once(':').map_or((text, None), |(name, variant)| (name, Some(variant)));
        if name.is_empty() || variant == Some("") {
            return Err(format!("{text:?}: expected technique or technique:variant"));
        }
        Ok(Self { name: name.to_string(), variant: variant.map(str::to_string) })
    }
}

impl fmt::Display for TechniqueSpec {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.name)?;
        self.variant.iter().try_for_each(|variant| write!(f, ":{variant}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spec_is_read_as_it_is_written() {
        for (text, variant) in [("own", None), ("own:one", Some("one")), ("own:one:two", Some("one:two"))] {
            let spec: TechniqueSpec = text.parse().unwrap();
            assert_eq!(
                (spec.name.as_str(), spec.variant.as_deref(), spec.to_string().as_str()),
                ("own", variant, text)
            );
        }
        for text in ["", ":one", "own:"] {
            let error = text.parse::<TechniqueSpec>().unwrap_err();
            assert_eq!(error, format!("{text:?}: expected technique or technique:variant"));
        }
    }

    #[test]
    fn an_own_technique_joins_the_built_in_ones() {
        static OWN: Entry = Entry { name: "own", ..crate::lod::brute_force::ENTRY };
        let techniques = Techniques::built_in().with(&OWN);
        assert_eq!(techniques.entries().len(), TECHNIQUES.len() + 1);
        for spec in techniques.specs() {
            assert_eq!(techniques.entry(&spec).unwrap().name, spec.name);
        }
        let error = Techniques::built_in().entry(&"own".parse().unwrap()).unwrap_err();
        assert!(error.starts_with("own: expected one of brute-force, "), "{error}");
        assert_eq!(techniques.entries().last().unwrap().name, "own");
        static NAMELESS: Entry = Entry { name: "", ..crate::lod::brute_force::ENTRY };
        static VARIANT: Entry = Entry { name: "own:one", ..crate::lod::brute_force::ENTRY };
        for refused in [&OWN, &NAMELESS, &VARIANT] {
            let added = std::panic::catch_unwind(|| techniques.clone().with(refused));
            assert!(added.is_err(), "{:?} is refused", refused.name);
        }
    }
}
