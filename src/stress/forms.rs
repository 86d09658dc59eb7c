//! Forms of techniques that the suite tries.

use crate::lod::{self, Entry, Need, Settings, TECHNIQUES, Values};

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

/// Each technique asked for as it is; all of the table with all variants if none is.
pub fn plain(techniques: &[String]) -> Result<Vec<Form>, String> {
    if techniques.is_empty() {
        return Ok(TECHNIQUES.iter().flat_map(variants).collect());
    }
    techniques.iter().map(|name| named(name)).collect()
}

fn variants(entry: &'static Entry) -> impl Iterator<Item = Form> {
    let others = entry.variants.iter().map(|variant| Some(variant.name));
    std::iter::once(None).chain(others).map(move |variant| Form::new(entry, variant, &[]))
}

fn named(name: &str) -> Result<Form, String> {
    let (technique, variant) = name.split_once(':').map_or((name, None), |(name, variant)| (name, Some(variant)));
    let known = || TECHNIQUES.iter().flat_map(variants).map(|form| form.name).collect::<Vec<_>>().join(", ");
    let entry = lod::find(technique).ok_or_else(|| format!("--technique {name}: expected one of {}", known()))?;
    let Some(variant) = variant else { return Ok(Form::new(entry, None, &[])) };
    let found = entry.variants.iter().find(|known| known.name == variant);
    let found = found.ok_or_else(|| format!("--technique {name}: expected one of {}", known()))?;
    Ok(Form::new(entry, Some(found.name), &[]))
}

/// The same, and then each with every word of every setting, one at a time, and with what it needs to do something.
pub fn every_word(techniques: &[String]) -> Result<Vec<Form>, String> {
    let plain = plain(techniques)?;
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
