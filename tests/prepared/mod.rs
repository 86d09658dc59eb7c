//! Techniques of the table, prepared by name.

use std::sync::Arc;

use cuesta::internal::height::Field;
use cuesta::internal::lod::{Settings, Technique, TechniqueSpec, Techniques};

/// Prepares a technique, or a variant given as `technique:variant`, with settings given as `key=value`.
pub fn technique(field: &Arc<Field>, spec: &str, settings: &[&str]) -> Box<dyn Technique> {
    let spec: TechniqueSpec = spec.parse().expect("technique or technique:variant");
    let entry = Techniques::built_in().entry(&spec).expect("a row of the table");
    let pair = |s: &&str| s.split_once('=').map(|(key, value)| (key.to_string(), value.to_string()));
    let settings: Option<Vec<_>> = settings.iter().map(pair).collect();
    let settings = Settings::new(entry, spec.variant.as_deref(), &settings.expect("key=value"));
    (entry.build)(Arc::clone(field), &settings.expect("the table's own values"))
}
