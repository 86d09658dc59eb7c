//! GeoTIFF and plain TIFF: the first picture of the file, read strip by strip or tile by tile.

mod bands;
mod codec;
mod directory;
pub(super) mod geokeys;
mod layout;
mod mask;
mod sample;

use ::tiff::{decoder::Decoder, tags::Tag};

use self::bands::Bands;
use self::layout::Layout;
use super::decoded::Decoded;
use super::encoding::Encoding;
use super::georeference::Georeference;
use super::input::{self, Input};
use super::metadata;
use super::options::Options;
use crate::height::error::Error;

/// Returns true if a file begins as a TIFF or BigTIFF of either byte order.
pub(super) fn is_tiff(head: &[u8]) -> bool {
    matches!(head, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..])
}

/// Reads the heights.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    directory::check(input, options)?;
    let (name, len) = (input.name, input.len);
    let mut decoder = Decoder::new(&mut input.reader).map_err(|e| Error::new(name, "directory", e))?;
    let layout = Layout::first(&mut decoder, name, len, options)?;
    let ([w, h], bands) = (layout.size, Bands::choose(&layout, name, options)?);
    let count = input::samples(name, [w, h].map(u64::from), options)?;
    let (samples, mut holes) = bands.read(decoder.inner(), &layout, name, count)?;
    mask::apply(&mut decoder, name, len, &mut holes, options)?;

    let mut warnings = Vec::new();
    let (affine, crs) = geokeys::read(&mut decoder, &mut warnings);
    let sample_type = bands.encoding.map_or(layout.packing.name(), |encoding| encoding.name().to_owned());
    let mut raster = Decoded::new(&sample_type, [w, h], samples);
    raster.variant = affine.is_none().then_some("TIFF");
    raster.holes = holes;
    raster.step = bands.encoding.map_or(1.0, Encoding::step);
    raster.warnings = warnings;
    raster.warnings.extend(bands.warning);
    if decoder.find_tag(Tag::GdalNodata).ok().flatten().is_some() {
        let text = decoder.get_tag_ascii_string(Tag::GdalNodata).unwrap_or_default();
        raster.declare_nodata("GDAL_NODATA", &text, options);
    }
    let metadata = decoder.get_tag_ascii_string(Tag::Unknown(GDAL_METADATA)).ok();
    let band = metadata.map(|text| metadata::from_tag(&text, options.band.unwrap_or(1))).unwrap_or_default();
    raster.georeference = Georeference { affine, crs, band };
    Ok(raster)
}

const GDAL_METADATA: u16 = 42112;
