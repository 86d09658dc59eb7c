//! Heights encoded in the colours of a picture: Terrarium and Mapbox Terrain-RGB.

use super::decoded::Decoded;
use super::encoding::Encoding;
use super::input::Input;
use super::options::Options;
use super::picture::decode;
use crate::height::error::Error;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Returns the requested encoding, or an error that names the option.
pub(super) fn asked(name: &str, options: &Options) -> Result<Encoding, Error> {
    let what = "found a colour picture, which could mean several things: give --encoding terrarium|mapbox";
    options.encoding.ok_or_else(|| Error::new(name, "content", what))
}

/// Returns true if a file begins as a WebP picture.
pub(super) fn is_webp(head: &[u8]) -> bool {
    matches!(head, [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..])
}

/// Reads a colour picture that encodes heights.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let encoding = asked(input.name, options)?;
    let picture = decode(input.name, &mut input.reader, options)?;
    let (w, h) = picture.dimensions();
    let count = input.samples([w, h].map(u64::from), options)?;
    let (mut heights, mut holes) = (vec![0.0; count], Holes::none(count));
    encoding.store(picture.as_raw(), 4, &mut heights, &mut holes, 0);
    let mut raster = Decoded::new(encoding.name(), [w, h], Samples::F32(heights));
    raster.holes = holes;
    raster.step = encoding.step();
    Ok(raster)
}
