//! Technique configurations of the stress suite: each technique, variant and setting word.

use crate::lod::{self, Entry, Need, Settings, TECHNIQUES, Values};

/// A technique with a variant and settings.
#[derive(Clone)]
pub struct TechniqueConfig {
    /// Name as on the command line: `technique:variant`, then settings that differ from their defaults.
    pub name: String,
    /// The technique's table entry.
    pub entry: &'static Entry,
    /// Variant; `None` for the default.
    pub variant: Option<&'static str>,
    /// Settings that differ from their defaults: key and value.
    pub choices: Vec<(String, String)>,
    /// All settings.
    pub settings: Settings,
}

impl TechniqueConfig {
    fn new(entry: &'static Entry, variant: Option<&'static str>, choices: &[(&str, &str)]) -> Self {
        let choices: Vec<_> = choices.iter().map(|&(key, value)| (key.to_string(), value.to_string())).collect();
        let settings = Settings::new(entry, variant, &choices).expect("the table's own values");
        let variant_name = variant.map(|name| format!(":{name}")).unwrap_or_default();
        let set: String = choices.iter().map(|(key, value)| format!(" {key}={value}")).collect();
        Self { name: format!("{}{variant_name}{set}", entry.name), entry, variant, choices, settings }
    }

    /// Returns the command-line arguments that select this configuration.
    pub fn arguments(&self) -> String {
        let variant = self.variant.map(|name| format!(":{name}")).unwrap_or_default();
        let set: String = self.choices.iter().map(|(key, value)| format!(" --set {key}={value}")).collect();
        format!("--technique {}{variant}{set}", self.entry.name)
    }
}

/// Returns the default configuration of each technique named (`name` or `name:variant`), or of all techniques and
/// variants if none is. Fails for an unknown name.
pub fn with_defaults(techniques: &[String]) -> Result<Vec<TechniqueConfig>, String> {
    if techniques.is_empty() {
        return Ok(TECHNIQUES.iter().flat_map(variants).collect());
    }
    techniques.iter().map(|name| parse(name)).collect()
}

/// Returns the default configuration of a technique and of each of its variants.
fn variants(entry: &'static Entry) -> impl Iterator<Item = TechniqueConfig> {
    let others = entry.variants.iter().map(|variant| Some(variant.name));
    std::iter::once(None).chain(others).map(move |variant| TechniqueConfig::new(entry, variant, &[]))
}

/// Parses `technique` or `technique:variant`.
fn parse(name: &str) -> Result<TechniqueConfig, String> {
    let (technique, variant) = name.split_once(':').map_or((name, None), |(name, variant)| (name, Some(variant)));
    let known = || TECHNIQUES.iter().flat_map(variants).map(|config| config.name).collect::<Vec<_>>().join(", ");
    let entry = lod::find(technique).ok_or_else(|| format!("--technique {name}: expected one of {}", known()))?;
    let Some(variant) = variant else { return Ok(TechniqueConfig::new(entry, None, &[])) };
    let found = entry.variants.iter().find(|known| known.name == variant);
    let found = found.ok_or_else(|| format!("--technique {name}: expected one of {}", known()))?;
    Ok(TechniqueConfig::new(entry, Some(found.name), &[]))
}

/// Returns the default configurations, each followed by one configuration per non-default word of every setting.
/// Other settings that the word requires are set too. Fails for an unknown name.
pub fn with_each_word(techniques: &[String]) -> Result<Vec<TechniqueConfig>, String> {
    let defaults = with_defaults(techniques)?;
    let with_words = |config: TechniqueConfig| {
        let words = config.entry.settings.iter().flat_map(|setting| {
            let words = if let Values::Words(words) = setting.values { words } else { &[] };
            words.iter().filter(|word| **word != setting.default).map(|word| (setting.key, *word))
        });
        // Variants differ only in submission: their defaults suffice.
        let words: Vec<_> = if config.variant.is_none() { words.collect() } else { Vec::new() };
        let (entry, variant) = (config.entry, config.variant);
        let defaults = Settings::defaults(entry);
        let with = move |word: (&'static str, &'static str)| {
            let is_idle = |need: &&Need| need.key == word.0 && !need.words.contains(&defaults.word(need.other));
            let needed = entry.needs.iter().filter(is_idle).map(|need| (need.other, need.words[0]));
            TechniqueConfig::new(entry, variant, &std::iter::once(word).chain(needed).collect::<Vec<_>>())
        };
        std::iter::once(config).chain(words.into_iter().map(with))
    };
    Ok(defaults.into_iter().flat_map(with_words).collect())
}
