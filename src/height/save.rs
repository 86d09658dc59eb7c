//! Writing a field: GeoTIFF, PNG, ESRI ASCII grid and raw 16 bit, by the file's extension.

use std::io::{self, Write};
use std::path::Path;

use tiff::encoder::colortype::{ColorType, Gray32Float, GrayI16};
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, TiffKind, TiffValue};
use tiff::tags::{Predictor, Tag};

use super::error::Error;
use super::field::Field;
pub use super::replace::{Out, discard_unfinished, replace};
use super::samples::Samples;

/// Writes all samples of `field`, tiling included, in the format of the extension. On failure an existing file stays.
///
/// | extension | holds |
/// |---|---|
/// | `tif`, `tiff` | GeoTIFF, Deflate, i16 where that is exact and else f32; metres, spacing, origin, holes |
/// | `asc` | ESRI ASCII grid, as f32; metres, spacing, origin, holes |
/// | `png` | 16-bit grey of [`Codes`], whose scale the text chunk `Description` says; holes are filled |
/// | `r16`, `raw` | 16-bit [`Codes`], little-endian, row by row from the north-west; holes are filled |
///
/// World z points south, so the northing of a sample is −z.
pub fn save(field: &Field, path: &Path) -> Result<(), Error> {
    let fault = |what: String| Error::new(path.display().to_string(), "output", what);
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let write: fn(&Field, &mut Out) -> io::Result<()> = match extension.as_str() {
        "tif" | "tiff" => write_tiff,
        "asc" => write_asc,
        "png" => write_png,
        "r16" | "raw" => write_raw,
        _ => return Err(fault(format!("expected .tif, .asc, .png, .r16 or .raw, found {extension:?}"))),
    };
    replace(path, |out| write(field, out)).map_err(|error| fault(error.to_string()))
}

/// Heights as 16-bit codes: height = (code − zero) · scale.
///
/// Whole metres of 0 to 65535 are their own codes. A field in codes keeps them. Other heights are stretched over all
/// codes, lowest to highest.
pub struct Codes {
    /// One a sample, row by row.
    pub codes: Vec<u16>,
    /// The code of height 0.
    pub zero: f64,
    /// Metres per code.
    pub scale: f64,
}

impl Codes {
    /// The codes of all samples, tiling included.
    pub fn new(field: &Field) -> Self {
        let whole = |h: f32| (0.0..=65535.0).contains(&h) && h.fract() == 0.0;
        let (zero, scale) = match field.samples() {
            _ if heights(field).all(whole) => (0.0, 1.0),
            Samples::Coded { zero, scale, .. } => (f64::from(*zero), f64::from(*scale)),
            Samples::F32(_) => {
                let (low, high) = range(field);
                let scale = if high > low { (high - low) / 65535.0 } else { 1.0 };
                (-low / scale, scale)
            }
        };
        let code = |h: f32| (f64::from(h) / scale + zero).round() as u16;
        Self { codes: heights(field).map(code).collect(), zero, scale }
    }
}

fn heights(field: &Field) -> impl Iterator<Item = f32> + '_ {
    let [w, h] = field.size();
    (0..h).flat_map(move |j| (0..w).map(move |i| field.height(i, j)))
}

fn range(field: &Field) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    heights(field).map(f64::from).fold(start, |(low, high), h| (low.min(h), high.max(h)))
}

/// Returns the value for holes: −9999 by custom, or lower if the terrain reaches that deep.
fn hole_mark(field: &Field) -> f32 {
    if range(field).0 > -9999.0 { -9999.0 } else { f32::MIN }
}

/// The heights of row `j`, with the mark in its holes.
fn row(field: &Field, j: u32, mark: f32) -> impl Iterator<Item = f32> + '_ {
    (0..field.size()[0]).map(move |i| if field.is_hole(i, j) { mark } else { field.height(i, j) })
}

fn write_raw(field: &Field, out: &mut Out) -> io::Result<()> {
    Codes::new(field).codes.iter().try_for_each(|code| out.write_all(&code.to_le_bytes()))
}

fn write_png(field: &Field, out: &mut Out) -> io::Result<()> {
    let [w, h] = field.size();
    let Codes { codes, zero, scale } = Codes::new(field);
    let mut encoder = png::Encoder::new(out, w, h);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::High);
    encoder.add_text_chunk("Description".into(), format!("height in metres = (code - {zero}) * {}", scale as f32))?;
    let bytes: Vec<u8> = codes.iter().flat_map(|code| code.to_be_bytes()).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    Ok(writer.finish()?)
}

fn write_asc(field: &Field, out: &mut Out) -> io::Result<()> {
    let [w, h] = field.size();
    let [dx, dz] = field.spacing;
    let south = -(field.origin[1] + f64::from(h - 1) * dz);
    writeln!(out, "ncols {w}\nnrows {h}\nxllcenter {}\nyllcenter {south}", field.origin[0])?;
    // The format knows square cells only; GDAL reads and writes the others so.
    if dx == dz {
        writeln!(out, "cellsize {dx}")?
    } else {
        writeln!(out, "dx {dx}\ndy {dz}")?
    }
    let mark = hole_mark(field);
    writeln!(out, "NODATA_value {mark}")?;
    for j in 0..h {
        for (i, height) in row(field, j, mark).enumerate() {
            write!(out, "{}{height}", if i == 0 { "" } else { " " })?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write_tiff(field: &Field, out: &mut Out) -> io::Result<()> {
    let [w, h] = field.size().map(u64::from);
    let big = w * h * 4 > 3 << 30;
    let deflate = Compression::Deflate(DeflateLevel::Balanced);
    let done = match big {
        true => TiffEncoder::new_big(out).and_then(|tiff| write_image(field, tiff.with_compression(deflate))),
        false => TiffEncoder::new(out).and_then(|tiff| write_image(field, tiff.with_compression(deflate))),
    };
    done.map_err(io::Error::other)
}

fn write_image<K: TiffKind>(field: &Field, tiff: TiffEncoder<&mut Out, K>) -> tiff::TiffResult<()> {
    let mark = hole_mark(field);
    let short = |h: f32| h.fract() == 0.0 && (-32768.0..=32767.0).contains(&h);
    let holes_fit = field.holes().count() == 0 || short(mark);
    if holes_fit && heights(field).all(short) {
        let tiff = tiff.with_predictor(Predictor::Horizontal);
        write_rows::<GrayI16, K>(field, mark, tiff, |h| h as i16)
    } else {
        write_rows::<Gray32Float, K>(field, mark, tiff, |h| h)
    }
}

fn write_rows<C: ColorType, K: TiffKind>(
    field: &Field,
    mark: f32,
    mut tiff: TiffEncoder<&mut Out, K>,
    value: impl Fn(f32) -> C::Inner,
) -> tiff::TiffResult<()>
where
    [C::Inner]: TiffValue,
{
    let [w, h] = field.size();
    let [dx, dz] = field.spacing;
    let mut image = tiff.new_image::<C>(w, h)?;
    let directory = image.encoder();
    directory.write_tag(Tag::ModelPixelScaleTag, &[dx, dz, 0.0][..])?;
    directory.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, field.origin[0], -field.origin[1], 0.0][..])?;
    // Version 1.1.0, 4 keys: model projected, raster of points, projection of the user's own, metres.
    let keys = [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 2, 3072, 0, 1, 32767, 3076, 0, 1, 9001u16];
    directory.write_tag(Tag::GeoKeyDirectoryTag, &keys[..])?;
    if field.holes().count() > 0 {
        directory.write_tag(Tag::GdalNodata, mark.to_string().as_str())?;
    }
    // Whole: tiff 0.11.3 leaves strips written one by one uncompressed, and names them compressed.
    let values: Vec<_> = (0..h).flat_map(|j| row(field, j, mark)).map(value).collect();
    image.write_data(&values)
}
