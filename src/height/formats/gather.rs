//! Gathers the rasters of files of any format.

use std::path::Path;

use super::format::{Format, Formats, Read};
use super::input::{Input, one_band, with_input};
use super::mosaic::Parts;
use super::options::Options;
use super::raster_file::{decode, no_data, read};
use crate::height::error::Error;

/// Reads the rasters of a file.
pub(super) fn gather_file(path: &Path, options: &Options, formats: Formats, parts: &mut Parts) -> Result<(), Error> {
    with_input(path, |input| {
        let format = formats.of_input(input, options)?;
        let Some(Format { name, read: Some(Read::Beside { data, read }), .. }) = format else {
            return gather(input, format, options, formats, parts);
        };
        let data = data(path).ok_or_else(|| no_data(input))?;
        with_input(&data, |input| {
            parts.add(input.name, options, |options| {
                one_band(input.name, options)?;
                decode(input, name, *read, options)
            })
        })
    })
}

/// Detects the format of a file; `None` if it is no known one.
pub(super) fn format_of(path: &Path, options: &Options, formats: Formats) -> Result<Option<&'static Format>, Error> {
    with_input(path, |input| formats.of_input(input, options))
}

/// Reads the rasters of a file: one, or those of an archive.
pub(super) fn gather(
    input: &mut Input,
    format: Option<&'static Format>,
    options: &Options,
    formats: Formats,
    parts: &mut Parts,
) -> Result<(), Error> {
    match format.and_then(|format| format.read.as_ref()) {
        Some(Read::Archive(gather)) => gather(input, options, formats, parts),
        _ => parts.add(input.name, options, |options| read(input, format, options)),
    }
}
