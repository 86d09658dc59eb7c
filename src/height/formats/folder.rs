//! A folder of height files as one field.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::companions::{LeftOut, is_companion};
use super::format::Formats;
use super::gather;
use super::mosaic::Parts;
use super::options::Options;
use crate::height::error::Error;

/// Reads the height files of a folder in the order of their names; always returns true.
pub(super) fn gather(folder: &Path, options: &Options, formats: Formats, parts: &mut Parts) -> Result<bool, Error> {
    let (begin, mut left_out) = (parts.len(), LeftOut::default());
    for file in files(folder)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match gather::format_of(&file, options, formats)? {
            Some(format) if format.holds_heights() => gather::gather_file(&file, options, formats, parts)?,
            format => left_out.add(&name, format),
        }
    }
    let name = folder.display().to_string();
    if parts.len() == begin {
        let what = format!("expected tiles named zoom/x/y.png or height files, found none{}", left_out.list());
        return Err(Error::new(name, "directory", what));
    }
    parts.leave_out_companions(begin);
    parts.warnings.extend(left_out.warning(&name));
    Ok(true)
}

/// The regular files that may hold heights, sorted by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let error = |e| Error::new(folder.display().to_string(), "directory", e);
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>).map_err(error)?;
    let paths = entries.into_iter().map(|entry| entry.path());
    let is_candidate =
        |path: &PathBuf| path.is_file() && !path.file_name().is_some_and(|n| is_companion(&n.to_string_lossy()));
    let mut files: Vec<_> = paths.filter(is_candidate).collect();
    files.sort();
    Ok(files)
}
