//! Reads a height file of any supported format, recognised by its content.

use std::{io::Cursor, path::Path};

use serde::Serialize;

use super::{
    Encoding, FORMATS, Format, RawLayout, Read, Reader,
    decoded::Decoded,
    hgt,
    input::{Input, one_band, with_input},
    located::Footprint,
    mosaic::Parts,
    raw, sidecar,
};
use crate::height::{Error, Field};

/// Treatment of samples without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoleFill {
    /// They stay holes.
    #[default]
    No,
    /// They get the heights interpolated from around them and count as data.
    Interpolate,
}

/// Options for reading a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Distance of neighbouring samples (x, z), metres, instead of what the file says.
    pub spacing: Option<[f64; 2]>,
    /// Multiplies every height.
    pub height_scale: Option<f64>,
    /// Added to every height after that, metres.
    pub height_offset: f64,
    /// The value that means "no data", instead of what the file says.
    pub nodata: Option<f64>,
    /// The file is bare samples of this layout.
    pub raw: Option<RawLayout>,
    /// The part to keep: x, z, width, height in samples.
    pub crop: Option<[u32; 4]>,
    /// Repetitions of the field along (x, z).
    pub tiles: Option<[u32; 2]>,
    /// Treatment of samples without data.
    pub hole_fill: HoleFill,
    /// Encoding of heights in the colours of a picture.
    pub encoding: Option<Encoding>,
    /// The band of a file of several, from 1; by default the first, or the colours of a picture.
    pub band: Option<u32>,
    /// Zoom level of a tile directory; by default the highest complete one.
    pub zoom: Option<u32>,
    /// Files that claim more samples are refused.
    pub max_samples: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            spacing: None,
            height_scale: None,
            height_offset: 0.0,
            nodata: None,
            raw: None,
            crop: None,
            tiles: None,
            hole_fill: HoleFill::No,
            encoding: None,
            band: None,
            zoom: None,
            max_samples: 1 << 30,
        }
    }
}

/// A field read from a file, and information about the file.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The heights.
    pub field: Field,
    /// Name of the file format.
    pub format: &'static str,
    /// Name of the type of a stored sample, as in `i16`.
    pub sample_type: String,
    /// True if 16 bits a sample hold every height without loss.
    pub exact_in_16_bit: bool,
    /// Part of the file that was read, and its position.
    pub footprint: Footprint,
    /// Warnings for the user, one sentence each.
    pub warnings: Vec<String>,
    /// The files that the heights come from, in the order in which a later one overlies an earlier one.
    pub sources: Vec<SourceFile>,
}

/// A file that heights come from, and its position in the field before the crop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SourceFile {
    /// The file's name; of a member of an archive after the archive's name.
    pub file: String,
    /// Name of the file format.
    pub format: &'static str,
    /// Column and row of its north-west sample.
    pub at: [u32; 2],
    /// Samples along (x, z).
    pub size: [u32; 2],
}

impl SourceFile {
    /// The file of a raster whose north-west sample lies at a column and row.
    pub(super) fn of(file: &str, raster: &Decoded, at: [u32; 2]) -> Self {
        Self { file: file.to_owned(), format: raster.format, at, size: raster.size }
    }
}

/// Reads a file, a directory of tiles, or a folder of height files.
pub fn load(path: &Path, options: &Options) -> Result<Loaded, Error> {
    load_all(&[path], options)
}

/// Reads files and folders as one field: a mosaic of one grid. A later file overlies an earlier one, and samples in no
/// file are holes.
pub fn load_all(paths: &[&Path], options: &Options) -> Result<Loaded, Error> {
    let mut parts = Parts::default();
    for path in paths {
        match path.is_dir() {
            true => gather_folder(path, options, &mut parts)?,
            false => gather_file(path, options, &mut parts)?,
        }
    }
    let first = paths.first().map_or_else(String::new, |path| path.display().to_string());
    let name = if paths.len() > 1 { format!("{first} and {} more", paths.len() - 1) } else { first };
    finish(parts, &name, options)
}

/// Reads a file held in memory; `name` is for messages, and for the position of SRTM tiles.
pub fn load_bytes(name: &str, bytes: &[u8], options: &Options) -> Result<Loaded, Error> {
    load_bytes_with(name, bytes, &|_| None, options)
}

/// Reads a file held in memory, of which `siblings` yields the file beside it with a given extension: `hdr`
/// (header), `prj` (projection), `aux.xml` (band metadata) and those of world files.
pub fn load_bytes_with(
    name: &str,
    bytes: &[u8],
    siblings: &dyn Fn(&str) -> Option<Vec<u8>>,
    options: &Options,
) -> Result<Loaded, Error> {
    let len = bytes.len() as u64;
    let mut input = Input { name, reader: &mut Cursor::new(bytes), len, siblings };
    let format = input.format(options)?;
    let mut parts = Parts::default();
    gather(&mut input, format, options, &mut parts)?;
    finish(parts, name, options)
}

fn finish(parts: Parts, name: &str, options: &Options) -> Result<Loaded, Error> {
    let is_mosaic = parts.len() > 1;
    let (raster, sources) = parts.join(name, options)?;
    // In a mosaic each file's nodata became holes before, and its value may be a height in another file.
    let nodata = options.nodata.filter(|_| !is_mosaic);
    let loaded = raster.finish(name, &Options { nodata, ..options.clone() })?;
    Ok(Loaded { sources, ..loaded })
}

fn gather_folder(path: &Path, options: &Options, parts: &mut Parts) -> Result<(), Error> {
    for format in FORMATS.iter().filter(|format| format.may_be(path)) {
        match format.read {
            Some(Read::Dataset(gather)) if gather(path, options, parts)? => break,
            Some(_) => (),
            None => return Err(Error::new(path.display().to_string(), "content", format.refusal())),
        }
    }
    Ok(())
}

/// Reads the rasters of a file.
pub(super) fn gather_file(path: &Path, options: &Options, parts: &mut Parts) -> Result<(), Error> {
    with_input(path, |input| {
        let format = input.format(options)?;
        let Some(Format { name, read: Some(Read::Beside { data, read }), .. }) = format else {
            return gather(input, format, options, parts);
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
pub(super) fn format_of(path: &Path, options: &Options) -> Result<Option<&'static Format>, Error> {
    with_input(path, |input| input.format(options))
}

/// Reads the rasters of a file: one, or those of an archive.
fn gather(
    input: &mut Input,
    format: Option<&'static Format>,
    options: &Options,
    parts: &mut Parts,
) -> Result<(), Error> {
    match format.and_then(|format| format.read.as_ref()) {
        Some(Read::Archive(gather)) => gather(input, options, parts),
        _ => parts.add(input.name, options, |options| read(input, format, options)),
    }
}

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

fn no_data(input: &Input) -> Error {
    input.error("data", "expected a data file beside the header, found none")
}

/// Reads a raster of the format called `name`, and the files beside it.
fn decode(input: &mut Input, name: &'static str, read: Reader, options: &Options) -> Result<Decoded, Error> {
    let mut decoded = read(input, options)?;
    decoded.format = decoded.variant.unwrap_or(name);
    sidecar::settle(input, options, &mut decoded);
    Ok(decoded)
}

#[cfg(test)]
mod tests {
    use std::io::{self, BufReader, Seek};

    use super::*;
    use crate::height::{Holes, Samples, save};

    /// A file whose content changes at the first seek.
    struct Changing {
        now: Cursor<Vec<u8>>,
        then: Option<Vec<u8>>,
    }

    impl io::Read for Changing {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.now.read(into)
        }
    }

    impl Seek for Changing {
        fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
            if let Some(then) = self.then.take() {
                *self.now.get_mut() = then;
            }
            self.now.seek(to)
        }
    }

    /// Reads a file that becomes `then` once its format is detected.
    fn changed(name: &str, first: &[u8], then: Vec<u8>, raw: Option<RawLayout>) -> Result<Loaded, Error> {
        let len = first.len() as u64;
        let mut reader = BufReader::with_capacity(16, Changing { now: Cursor::new(first.to_vec()), then: Some(then) });
        let mut input = Input { name, reader: &mut reader, len, siblings: &|_| None };
        let options = Options { raw, max_samples: 1 << 16, ..Options::default() };
        let format = input.format(&options)?;
        read(&mut input, format, &options)?.finish(name, &options)
    }

    #[test]
    fn a_file_that_changes_while_it_is_read_is_refused_or_read_as_one_of_the_two() {
        let folder = tempfile::tempdir().unwrap();
        let heights = (0..63).map(|k| (k * k % 50) as f32).collect();
        let field = Field::new(Samples::F32(heights), [9, 7], [1.0; 2], Holes::none(63));
        for (extension, raw) in [("tif", None), ("asc", None), ("png", None), ("raw", Some("9x7:u16le"))] {
            let name = format!("land.{extension}");
            save::save(&field, &folder.path().join(&name)).unwrap();
            let whole = std::fs::read(folder.path().join(&name)).unwrap();
            let raw = raw.map(|layout| layout.parse().unwrap());
            let same = changed(&name, &whole, whole.clone(), raw).expect("nothing has changed");
            let mut refused = 0;
            for left in 0..whole.len() {
                match changed(&name, &whole, whole[..left].to_vec(), raw) {
                    // A text's last number may have lost digits unnoticed.
                    Ok(_) if extension == "asc" && left + 3 > whole.len() => {}
                    Ok(loaded) => assert_eq!(loaded.field.samples(), same.field.samples(), "{name}: {left} bytes left"),
                    Err(error) => {
                        let error = error.to_string();
                        assert!(error.starts_with(&name) && !error.contains('\n'), "{left} bytes left: {error}");
                        refused += 1;
                    }
                }
            }
            assert!(refused + 60 > whole.len(), "{name}: {refused} of {} were refused", whole.len());
            // Longer by then.
            let grown = [&whole[..], &whole].concat();
            if let Ok(loaded) = changed(&name, &whole, grown, raw) {
                assert_eq!(loaded.field.samples(), same.field.samples(), "{name}");
            }
        }
    }
}
