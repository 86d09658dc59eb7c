//! Several files and folders named as one terrain.

use std::path::Path;

use anyhow::{Result, bail};

use super::endless;

/// The one name, if it is one; several are files and folders.
pub fn only(terrain: &[String]) -> Result<Option<&str>> {
    if let [only] = terrain {
        return Ok(Some(only));
    }
    match terrain.iter().find(|name| is_demo(name) || endless::is_named(name)) {
        Some(name) => bail!("{name}: expected files and folders where several terrains are one field"),
        None => Ok(None),
    }
}

/// The path beside which a cache of the field lies: that of its file, or of the first one with the count of the rest.
pub fn cache_path(terrain: &[String]) -> String {
    match terrain {
        [only] => only.clone(),
        [first, rest @ ..] => format!("{first}+{}", rest.len()),
        [] => String::new(),
    }
}

/// Whether it is the embedded terrain, which has an overlay of its own.
pub(super) fn is_demo(terrain: &str) -> bool {
    terrain == "demo" && !Path::new(terrain).exists()
}
