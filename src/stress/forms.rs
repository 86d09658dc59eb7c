//! Forms of techniques that the suite tries.

use crate::lod::{Entry, Need, Settings, TechniqueSpec, Techniques, Values};

/// A technique with its settings.
#[derive(Clone)]
pub struct Form {
    /// As on the command line: `technique:variant`, and then settings that are no defaults.
    pub name: String,
    /// Its row.
    pub entry: &'static Entry,
    /// Its variant, if it is none of the default.
    pub variant: Option<&'static str>,
    /// Settings that are no defaults.
    pub choices: Vec<(String, String)>,
    /// All settings.
    pub settings: Settings,
}

impl Form {
    fn new(entry: &'static Entry, variant: Option<&'static str>, choices: &[(&str, &str)]) -> Self {
        let choices: Vec<_> = choices.iter().map(|&(key, value)| (key.to_string(), value.to_string())).collect();
        let settings = Settings::new(entry, variant, &choices).expect("the table's own values");
        let variant_name = variant.map(|name| format!(":{name}")).unwrap_or_default();
        let set: String = choices.iter().map(|(key, value)| format!(" {key}={value}")).collect();
        Self { name: format!("{}{variant_name}{set}", entry.name), entry, variant, choices, settings }
    }

    /// How it is asked for on the command line.
    pub fn arguments(&self) -> String {
        let variant = self.variant.map(|name| format!(":{name}")).unwrap_or_default();
        let set: String = self.choices.iter().map(|(key, value)| format!(" --set {key}={value}")).collect();
        format!("--technique {}{variant}{set}", self.entry.name)
    }
}

/// Returns each technique named, with its default settings; all techniques and variants if none is named.
///
/// # Errors
/// If a name is unknown. The error lists all names.
pub fn plain(techniques: &Techniques, names: &[String]) -> Result<Vec<Form>, String> {
    if names.is_empty() {
        return Ok(techniques.entries().iter().flat_map(|entry| variants(entry)).collect());
    }
    names.iter().map(|name| named(techniques, name)).collect()
}

fn variants(entry: &'static Entry) -> impl Iterator<Item = Form> {
    let others = entry.variants.iter().map(|variant| Some(variant.name));
    std::iter::once(None).chain(others).map(move |variant| Form::new(entry, variant, &[]))
}

fn named(techniques: &Techniques, name: &str) -> Result<Form, String> {
    let found = name.parse().ok().and_then(|spec: TechniqueSpec| {
        let is_named = |form: &Form| form.variant == spec.variant.as_deref();
        variants(techniques.find(&spec.name)?).find(is_named)
    });
    found.ok_or_else(|| {
        let known: Vec<_> = techniques.specs().iter().map(TechniqueSpec::to_string).collect();
        format!("--technique {name}: expected one of {}", known.join(", "))
    })
}

/// Returns the forms of [`plain`], and then each with every word of every setting. One setting changes at a time, with
/// the others that it needs to have an effect.
///
/// # Errors
/// If a name is unknown.
pub fn every_word(techniques: &Techniques, names: &[String]) -> Result<Vec<Form>, String> {
    let plain = plain(techniques, names)?;
    let with_words = |form: Form| {
        let words = form.entry.settings.iter().flat_map(|setting| {
            let words = if let Values::Words(words) = setting.values { words } else { &[] };
            words.iter().filter(|word| **word != setting.default).map(|word| (setting.key, *word))
        });
        // A variant differs from the default in how it is submitted: one word of it stands for all.
        let words: Vec<_> = if form.variant.is_none() { words.collect() } else { Vec::new() };
        let (entry, variant) = (form.entry, form.variant);
        let defaults = Settings::defaults(entry);
        let with = move |word: (&'static str, &'static str)| {
            let is_idle = |need: &&Need| need.key == word.0 && !need.words.contains(&defaults.word(need.other));
            let needed = entry.needs.iter().filter(is_idle).map(|need| (need.other, need.words[0]));
            Form::new(entry, variant, &std::iter::once(word).chain(needed).collect::<Vec<_>>())
        };
        std::iter::once(form).chain(words.into_iter().map(with))
    };
    Ok(plain.into_iter().flat_map(with_words).collect())
}
