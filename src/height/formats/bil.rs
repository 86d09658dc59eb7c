//! Bare samples with a header beside them: ESRI `.bil` and `.flt`, and ENVI.

use std::path::{Path, PathBuf};

use super::bare_header::{Header, Values};
use super::decoded::Decoded;
use super::georeference::Georeference;
use super::input::Input;
use super::options::Options;
use super::raw::Rows;
use super::sample::{Order, SampleType};
use super::{asc, envi, nodata};
use crate::height::error::Error;
use crate::height::georef::affine::Affine;
use crate::height::georef::place::Grid;

/// The part of the format that is read, for documents.
pub(super) const ABOUT: &str = "also ESRI FLT and ENVI: bare samples with a `.hdr` beside them";

/// Keys that a header of bare samples has and an ASCII grid lacks.
const OWN_KEYS: [&str; 5] = ["byteorder", "layout", "nbits", "pixeltype", "nbands"];

/// Returns true if a file begins as such a header.
pub(super) fn is_header(head: &[u8]) -> bool {
    let first_words =
        || head.split(|&b| b == b'\n').filter_map(|line| line.trim_ascii().split(u8::is_ascii_whitespace).next());
    let is_own = |word: &[u8]| OWN_KEYS.iter().any(|key| word.eq_ignore_ascii_case(key.as_bytes()));
    let mut words = first_words();
    envi::is_header(head)
        || words.next().is_some_and(|word| is_own(word) || asc::is_header(word)) && first_words().any(is_own)
}

/// Returns the data file beside a header.
pub(super) fn data_beside(header: &Path) -> Option<PathBuf> {
    let extensions = ["bil", "flt", "bip", "bsq", "img", "dat", "raw", "bin", "dem", ""];
    let extensions = extensions.iter().flat_map(|e| [e.to_string(), e.to_uppercase()]);
    extensions.map(|e| header.with_extension(e)).find(|path| path.is_file())
}

/// Reads the samples by the header beside them.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let text = input.sibling_text("hdr").ok_or_else(|| input.error("header", "expected a .hdr beside, found none"))?;
    let header = match envi::is_header(text.as_bytes()) {
        true => envi::parse(input.name, &text)?,
        false => parse(input.name, &text)?,
    };
    let count = input.samples(header.size, options)?;
    let size = header.size.map(|n| n as u32);
    let row_bytes = header.size[0] * header.sample.bytes() as u64;
    let stride = header.stride.unwrap_or(row_bytes);
    if stride < row_bytes {
        return Err(input.error("header TOTALROWBYTES", format!("expected at least {row_bytes}, found {stride}")));
    }
    let rows = Rows { sample: header.sample, order: header.order, start: header.start, stride };
    let mut raster = Decoded::new(header.sample.name(), size, rows.read(input, size, count)?);
    if let Some(text) = &header.nodata {
        raster.declare_nodata("header NODATA", text, options);
    }
    raster.variant = header.variant;
    raster.georeference = header.georeference;
    Ok(raster)
}

fn parse(name: &str, text: &str) -> Result<Header, Error> {
    let pairs = text.lines().filter_map(|line| line.trim().split_once(char::is_whitespace));
    let values = pairs.map(|(key, value)| (key.to_lowercase(), value.trim().to_owned())).collect();
    let values = Values { name, values };
    let bands = values.number("nbands")?.unwrap_or(1u32);
    if bands != 1 {
        return Err(values.error("NBANDS", format!("expected 1 band, found {bands}")));
    }
    let order = match values.text("byteorder").map(str::to_uppercase).as_deref() {
        None | Some("I" | "LSBFIRST" | "VMS_FFLOAT") => Order::Little,
        Some("M" | "MSBFIRST") => Order::Big,
        Some(other) => {
            return Err(values.error("BYTEORDER", format!("expected I, M, LSBFIRST or MSBFIRST, found {other}")));
        }
    };
    let nodata = values.text("nodata_value").or(values.text("nodata"));
    let sample = sample(&values, nodata.and_then(nodata::number))?;
    let size: [u64; 2] = [values.required("ncols")?, values.required("nrows")?];
    Ok(Header {
        variant: (sample == SampleType::F32).then_some("ESRI FLT"),
        size,
        sample,
        order,
        start: values.number("skipbytes")?.unwrap_or(0),
        stride: values.number("totalrowbytes")?,
        nodata: nodata.map(str::to_owned),
        georeference: Georeference { affine: grid(&values, size)?.map(Affine::north_up), ..Georeference::default() },
    })
}

/// Returns the sample type. A `.flt` header has no NBITS. A `.bil` header without PIXELTYPE means unsigned; headers of
/// GTOPO30 omit it although their samples are signed; a negative nodata value identifies them.
fn sample(values: &Values, nodata: Option<f64>) -> Result<SampleType, Error> {
    let kind = values.text("pixeltype").unwrap_or_default().to_uppercase();
    let bits = values.number::<u32>("nbits")?;
    let signed = kind.starts_with('S') || kind.is_empty() && nodata.is_some_and(|value| value < 0.0);
    match (bits, kind.starts_with('F')) {
        (None, _) | (Some(32), true) => Ok(SampleType::F32),
        (Some(64), _) => Ok(SampleType::F64),
        (Some(32), _) if kind.is_empty() => Ok(SampleType::F32),
        (Some(8), false) => Ok(if signed { SampleType::I8 } else { SampleType::U8 }),
        (Some(16), false) => Ok(if signed { SampleType::I16 } else { SampleType::U16 }),
        (Some(32), false) => Ok(if signed { SampleType::I32 } else { SampleType::U32 }),
        (Some(bits), _) => Err(values.error("NBITS", format!("expected 8, 16, 32 or 64, found {bits} {kind}"))),
    }
}

/// Returns the position of the samples: ULXMAP is the centre of a sample, XLLCORNER a corner.
fn grid(values: &Values, [_, rows]: [u64; 2]) -> Result<Option<Grid>, Error> {
    let number =
        |keys: [&str; 2]| -> Result<Option<f64>, Error> { Ok(values.number(keys[0])?.or(values.number(keys[1])?)) };
    let (Some(dx), Some(dy)) = (number(["xdim", "cellsize"])?, number(["ydim", "cellsize"])?) else { return Ok(None) };
    let below = dy * rows.saturating_sub(1) as f64;
    let west = match (number(["ulxmap", "xllcenter"])?, number(["xllcorner", "xllcorner"])?) {
        (Some(centre), _) => centre,
        (None, corner) => corner.unwrap_or(0.0) + dx / 2.0,
    };
    let north = match (number(["ulymap", "ulymap"])?, number(["yllcenter", "yllcenter"])?) {
        (Some(centre), _) => centre,
        (None, Some(centre)) => centre + below,
        (None, None) => number(["yllcorner", "yllcorner"])?.unwrap_or(0.0) + dy / 2.0 + below,
    };
    Ok(Some(([west, north], [dx, dy])))
}
