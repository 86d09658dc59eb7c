//! GeoTIFF and plain TIFF: the first picture of the file, read strip by strip or tile by tile.

use tiff::{decoder::Decoder, tags::Tag};

use super::{
    Error,
    decoded::Decoded,
    geokeys,
    load::{Options, Source},
    metadata,
    sidecar::Georeference,
    terrain_rgb::Encoding,
    tiff_bands::Bands,
    tiff_directory,
    tiff_layout::Layout,
    tiff_mask,
};

/// Reads the heights.
pub(super) fn read(source: &mut Source, options: &Options) -> Result<Decoded, Error> {
    tiff_directory::check(source, options)?;
    let (name, len) = (source.name, source.len);
    let mut decoder = Decoder::new(&mut source.reader).map_err(|e| Error::new(name, "directory", e))?;
    let layout = Layout::first(&mut decoder, name, len, options)?;
    let ([w, h], bands) = (layout.size, Bands::choose(&layout, name, options)?);
    let count = super::load::samples(name, [w, h].map(u64::from), options)?;
    let (samples, mut holes) = bands.read(decoder.inner(), &layout, name, count)?;
    tiff_mask::apply(&mut decoder, name, len, &mut holes, options)?;

    let mut warnings = Vec::new();
    let (affine, crs) = geokeys::read(&mut decoder, &mut warnings);
    let format = if affine.is_some() { "GeoTIFF" } else { "TIFF" };
    let sample_type = bands.encoding.map_or(layout.packing.name(), |encoding| encoding.name().to_owned());
    let mut raster = Decoded::new(format, &sample_type, [w, h], samples);
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
