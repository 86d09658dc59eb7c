//! Files of one raster, and the files beside them.

use super::decoded::Decoded;
use super::format::{Format, Read, Reader};
use super::input::{Input, one_band};
use super::options::Options;
use super::{hgt, raw, sidecar};
use crate::height::error::Error;

/// Reads a file of one raster, and the files beside it.
pub(super) fn read(input: &mut Input, format: Option<&'static Format>, options: &Options) -> Result<Decoded, Error> {
    let Some(Format { name, read: Some(Read::Bands(read)), .. }) = format else {
        one_band(input.name, options)?;
        return read_only_band(input, format, options);
    };
    decode(input, name, *read, options)
}

fn read_only_band(input: &mut Input, format: Option<&'static Format>, options: &Options) -> Result<Decoded, Error> {
    let Some(format) = format else {
        let wrong_length = hgt::wrong_length(input.name, input.len);
        return Err(input.error("content", wrong_length.unwrap_or_else(|| raw::hint(input.len))));
    };
    match &format.read {
        Some(Read::One(read) | Read::Bands(read)) => decode(input, format.name, *read, options),
        Some(Read::Beside { .. }) => Err(no_data(input)),
        Some(Read::Archive(_)) => {
            Err(input.error("content", "expected a height file, found an archive within an archive"))
        }
        Some(Read::Dataset(_)) | None => Err(input.error("content", format.refusal())),
    }
}

/// The error of a header without data.
pub(super) fn no_data(input: &Input) -> Error {
    input.error("data", "expected a data file beside the header, found none")
}

/// Reads a raster of the format called `name`, and the files beside it.
pub(super) fn decode(input: &mut Input, name: &'static str, read: Reader, options: &Options) -> Result<Decoded, Error> {
    let mut decoded = read(input, options)?;
    decoded.format = decoded.variant.unwrap_or(name);
    sidecar::settle(input, options, &mut decoded);
    Ok(decoded)
}
