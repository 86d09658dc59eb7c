//! Technique configurations of the stress suite: each technique, variant and setting word.

use crate::lod::{Entry, Need, Settings, TechniqueSpec, Techniques, Values};

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
/// variants if none is.
///
/// # Errors
/// If a name is unknown. The error lists all names.
pub fn with_defaults(techniques: &Techniques, names: &[String]) -> Result<Vec<TechniqueConfig>, String> {
    if names.is_empty() {
        return Ok(techniques.entries().iter().flat_map(|entry| variants(entry)).collect());
    }
    names.iter().map(|name| parse(techniques, name)).collect()
}

/// Returns the default configuration of a technique and of each of its variants.
fn variants(entry: &'static Entry) -> impl Iterator<Item = TechniqueConfig> {
    let others = entry.variants.iter().map(|variant| Some(variant.name));
    std::iter::once(None).chain(others).map(move |variant| TechniqueConfig::new(entry, variant, &[]))
}

/// Parses `technique` or `technique:variant`.
fn parse(techniques: &Techniques, name: &str) -> Result<TechniqueConfig, String> {
    let found = name.parse().ok().and_then(|spec: TechniqueSpec| {
        let is_named = |config: &TechniqueConfig| config.variant == spec.variant.as_deref();
        variants(techniques.find(&spec.name)?).find(is_named)
    });
    found.ok_or_else(|| {
        let known: Vec<_> = techniques.specs().iter().map(TechniqueSpec::to_string).collect();
        format!("--technique {name}: expected one of {}", known.join(", "))
    })
}

/// Returns the default configurations, each followed by one configuration per non-default word of every setting.
/// Other settings that the word requires are set too.
///
/// # Errors
/// If a name is unknown.
pub fn with_each_word(techniques: &Techniques, names: &[String]) -> Result<Vec<TechniqueConfig>, String> {
    let defaults = with_defaults(techniques, names)?;
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
