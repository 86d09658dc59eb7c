//! GeoTIFF and plain TIFF: the first picture of the file, read strip by strip or tile by tile.

use tiff::{decoder::Decoder, tags::Tag};

use super::{
    Error, geokeys,
    load::{Options, Source},
    raster::Raster,
    terrain_rgb::Encoding,
    tiff_bands::Bands,
    tiff_directory,
    tiff_layout::Layout,
    tiff_mask,
};

/// Reads the heights.
pub(super) fn read(source: &mut Source, options: &Options) -> Result<Raster, Error> {
    tiff_directory::check(source, options)?;
    let (name, len) = (source.name, source.len);
    let mut decoder = Decoder::new(&mut source.reader).map_err(|e| Error::new(name, "directory", e))?;
    let layout = Layout::first(&mut decoder, name, len, options)?;
    let ([w, h], bands) = (layout.size, Bands::choose(&layout, name, options)?);
    let count = super::load::samples(name, [w, h].map(u64::from), options)?;
    let (samples, mut holes) = bands.read(decoder.inner(), &layout, name, count)?;
    tiff_mask::apply(&mut decoder, name, len, &mut holes, options)?;

    let georeference = geokeys::read(&mut decoder, [w, h]);
    let format = if georeference.place.is_some() { "GeoTIFF" } else { "TIFF" };
    let sample_type = bands.encoding.map_or(layout.packing.name(), |encoding| encoding.name().to_owned());
    let mut raster = Raster::new(format, &sample_type, [w, h], samples);
    raster.holes = holes;
    raster.step = bands.encoding.map_or(1.0, Encoding::step);
    raster.unit = georeference.height_unit;
    raster.place = georeference.place;
    raster.flip = georeference.flip;
    raster.warnings = georeference.warnings;
    raster.warnings.extend(bands.warning);
    if decoder.find_tag(Tag::GdalNodata).ok().flatten().is_some() {
        let text = decoder.get_tag_ascii_string(Tag::GdalNodata).unwrap_or_default();
        raster.declare_nodata("GDAL_NODATA", &text, options);
    }
    let metadata = decoder.get_tag_ascii_string(Tag::Unknown(GDAL_METADATA)).unwrap_or_default();
    if ["role=\"scale\"", "role=\"offset\""].iter().any(|role| metadata.contains(role)) {
        raster.warnings.push("GDAL_METADATA has a scale or offset, which is not applied: --height-scale".to_owned());
    }
    Ok(raster)
}

const GDAL_METADATA: u16 = 42112;
