//! Several files and folders as one terrain.

use std::path::Path;

use anyhow::{Result, bail};

use super::endless;

/// Returns the name if there is only one. Of several, each must be a file or a folder.
pub fn only(terrain: &[String]) -> Result<Option<&str>> {
    if let [only] = terrain {
        return Ok(Some(only));
    }
    match terrain.iter().find(|name| is_demo(name) || endless::is_named(name)) {
        Some(name) => bail!("{name}: expected files and folders where several terrains are one field"),
        None => Ok(None),
    }
}

/// Returns the path of the field's cache: beside its file, or beside the first one with the number of the others.
pub fn cache_path(terrain: &[String]) -> String {
    match terrain {
        [only] => only.clone(),
        [first, rest @ ..] => format!("{first}+{}", rest.len()),
        [] => String::new(),
    }
}

/// Returns true for the embedded terrain, which has an overlay of its own.
pub(super) fn is_demo(terrain: &str) -> bool {
    terrain == "demo" && !Path::new(terrain).exists()
}
