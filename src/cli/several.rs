//! Names of terrains on the command line: one terrain, or several files and folders that form one field.

use std::path::Path;

use anyhow::{Result, bail};

use super::endless;

/// Returns the name if there is only one.
///
/// # Errors
/// If several names include `demo` or `endless`, which cannot be combined.
pub fn only(terrain: &[String]) -> Result<Option<&str>> {
    if let [only] = terrain {
        return Ok(Some(only));
    }
    match terrain.iter().find(|name| is_demo(name) || endless::is_named(name)) {
        Some(name) => bail!("{name}: cannot be combined with other terrains: expected files and folders"),
        None => Ok(None),
    }
}

/// Returns the path that names a field's cache files: that of its file, or that of the first file with the number of
/// the others appended.
pub fn cache_path(terrain: &[String]) -> String {
    match terrain {
        [only] => only.clone(),
        [first, rest @ ..] => format!("{first}+{}", rest.len()),
        [] => String::new(),
    }
}

/// Returns true for the embedded terrain, unless a file has its name.
pub(super) fn is_demo(terrain: &str) -> bool {
    terrain == "demo" && !Path::new(terrain).exists()
}
