//! Reads a height file of any supported format, recognised by its content.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Cursor, Read, Seek},
    path::Path,
};

use serde::Serialize;

use super::{
    Error, Field, Footprint, archive, asc, bil, decoded::Decoded, folder, geotiff, hgt, known_formats::Known,
    mosaic::Parts, png, raw, sidecar, terrain_rgb, text, tiles, usgs_dem,
};
pub use super::{raw::RawLayout, terrain_rgb::Encoding};

/// What is done with samples without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoleFill {
    /// They stay holes.
    #[default]
    No,
    /// They get the heights interpolated from around them and count as data.
    Interpolate,
}

/// Wishes about how a file is read.
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
    /// How often the field repeats along (x, z).
    pub tiles: Option<[u32; 2]>,
    /// What is done with samples without data.
    pub hole_fill: HoleFill,
    /// How a colour picture encodes heights.
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

/// A field read from a file, and what is worth saying about it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The heights.
    pub field: Field,
    /// Name of the file format.
    pub format: &'static str,
    /// How the file stores a sample, as in `i16`.
    pub sample_type: String,
    /// Whether 16 bits a sample hold every height without loss.
    pub exact_in_16_bit: bool,
    /// Which part of the file it is, and where that lies.
    pub footprint: Footprint,
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
    /// The files that the heights come from, in the order in which a later one overlies an earlier one.
    pub sources: Vec<SourceFile>,
}

/// A file that heights come from, and where it lies in the field before crop.
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

/// Reads files and folders as one field: a mosaic of one grid, where a later file overlies an earlier one and what
/// lies in none is a hole.
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
    let mut source = Source { name, reader: &mut Cursor::new(bytes), len, siblings };
    let kind = source.kind(options)?;
    let mut parts = Parts::default();
    gather(&mut source, kind, options, &mut parts)?;
    finish(parts, name, options)
}

fn finish(parts: Parts, name: &str, options: &Options) -> Result<Loaded, Error> {
    let is_mosaic = parts.len() > 1;
    let (raster, sources) = parts.join(name, options)?;
    // Each file's own holes are made by then, and its values need not be those of the others.
    let nodata = options.nodata.filter(|_| !is_mosaic);
    let loaded = raster.finish(name, &Options { nodata, ..options.clone() })?;
    Ok(Loaded { sources, ..loaded })
}

fn gather_folder(path: &Path, options: &Options, parts: &mut Parts) -> Result<(), Error> {
    if let Some(known) = Known::of_folder(path) {
        return Err(Error::new(path.display().to_string(), "content", known.what()));
    }
    match tiles::scan(path)? {
        None => folder::gather(path, options, parts),
        Some(tiles) => parts.add(&path.display().to_string(), options, |options| tiles::read(path, tiles, options)),
    }
}

/// Reads the rasters of a file.
pub(super) fn gather_file(path: &Path, options: &Options, parts: &mut Parts) -> Result<(), Error> {
    with_source(path, |source| match source.kind(options)? {
        Kind::Header => {
            let data = bil::data_beside(path)
                .ok_or_else(|| source.error("data", "expected a data file beside the header, found none"))?;
            with_source(&data, |source| gather(source, Kind::Bil, options, parts))
        }
        kind => gather(source, kind, options, parts),
    })
}

/// The format of a file.
pub(super) fn kind_of(path: &Path, options: &Options) -> Result<Kind, Error> {
    with_source(path, |source| source.kind(options))
}

pub(super) fn with_source<T>(path: &Path, read: impl FnOnce(&mut Source) -> Result<T, Error>) -> Result<T, Error> {
    let name = path.display().to_string();
    let siblings = |extension: &str| sibling(path, extension);
    let (file, len) = open(path)?;
    read(&mut Source { name: &name, reader: &mut BufReader::new(file), len, siblings: &siblings })
}

pub(super) fn open(path: &Path) -> Result<(File, u64), Error> {
    let error = |e: io::Error| Error::new(path.display().to_string(), "file", format!("expected a readable file, {e}"));
    // A pipe would wait for its writer to be opened.
    if !std::fs::metadata(path).map_err(error)?.is_file() {
        return Err(error(io::Error::other("found neither a file nor a directory")));
    }
    let file = File::open(path).map_err(error)?;
    let len = file.metadata().map_err(error)?.len();
    Ok((file, len))
}

/// The most bytes read from a file beside the data: headers and projections are short texts.
pub(super) const SIBLING_BYTES: u64 = 1 << 24;

/// The file beside `path` with another extension: `a.hdr` or `a.bil.hdr`.
pub(super) fn sibling(path: &Path, extension: &str) -> Option<Vec<u8>> {
    let mut appended = path.as_os_str().to_owned();
    appended.push(format!(".{extension}"));
    let upper = extension.to_uppercase();
    // The name with its own extension is of this file alone.
    [appended.into(), path.with_extension(extension), path.with_extension(upper)]
        .into_iter()
        .filter(|other| other != path && other.is_file())
        .find_map(|other| {
            let mut bytes = Vec::new();
            File::open(other).ok()?.take(SIBLING_BYTES).read_to_end(&mut bytes).ok()?;
            Some(bytes)
        })
}

/// What loaders read from. Nothing is mapped into memory: a file that shrinks while it is read is a read that fails.
pub(super) trait Input: BufRead + Seek {}
impl<T: BufRead + Seek> Input for T {}

/// One file: bytes, and the small files beside it.
pub(super) struct Source<'a> {
    /// The name in messages.
    pub name: &'a str,
    /// The bytes, from the beginning.
    pub reader: &'a mut dyn Input,
    /// How many bytes there are.
    pub len: u64,
    /// The file beside this one that has the given extension.
    pub siblings: &'a dyn Fn(&str) -> Option<Vec<u8>>,
}

impl Source<'_> {
    /// An error at a place of this file.
    pub fn error(&self, place: impl Into<String>, what: impl ToString) -> Error {
        Error::new(self.name, place, what)
    }

    /// The text of the file beside this one that has the given extension.
    pub fn sibling_text(&self, extension: &str) -> Option<String> {
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(text::without_mark(&bytes)).into_owned();
        (self.siblings)(extension).map(text)
    }

    /// The number of samples of a size, if it is allowed.
    pub fn samples(&self, size: [u64; 2], options: &Options) -> Result<usize, Error> {
        samples(self.name, size, options)
    }

    /// Refuses a file that ends before `needed` bytes.
    pub fn need(&self, place: &str, needed: u64) -> Result<(), Error> {
        if self.len < needed {
            return Err(self.error(place, format!("expected at least {needed} bytes, found {}", self.len)));
        }
        Ok(())
    }

    fn kind(&mut self, options: &Options) -> Result<Kind, Error> {
        let mut head = Vec::new();
        let read = self.reader.take(HEAD_BYTES).read_to_end(&mut head);
        read.and_then(|_| self.reader.rewind()).map_err(|e| self.error("byte 0", e))?;
        match options.raw {
            Some(_) => Ok(Kind::Raw),
            None => Ok(Kind::of(&head, self.len, (self.siblings)("hdr").is_some())),
        }
    }
}

/// The number of samples of a size, if it is allowed.
pub(super) fn samples(name: &str, [w, h]: [u64; 2], options: &Options) -> Result<usize, Error> {
    if w < 2 || h < 2 {
        return Err(Error::new(name, "size", format!("expected at least 2x2 samples, found {w}x{h}")));
    }
    match w.checked_mul(h) {
        Some(n) if n <= options.max_samples && w.max(h) <= u64::from(u32::MAX) => Ok(n as usize),
        _ => {
            let limit = options.max_samples;
            Err(Error::new(name, "size", format!("expected at most {limit} samples (--max-samples), found {w}x{h}")))
        }
    }
}

/// Refuses another band than the first, for formats that have no other.
pub(super) fn one_band(name: &str, options: &Options) -> Result<(), Error> {
    match options.band {
        None | Some(1) => Ok(()),
        Some(band) => {
            Err(Error::new(name, "--band", format!("expected 1, the only band of this format, found {band}")))
        }
    }
}

/// Bytes looked at to tell the format.
pub(super) const HEAD_BYTES: u64 = 4096;

/// A file format as told from content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Tiff,
    Png,
    WebP,
    Zip,
    Gzip,
    Tar,
    Asc,
    UsgsDem,
    /// The header of a `Bil`.
    Header,
    Bil,
    Hgt,
    Raw,
    /// A format that is recognised but not read.
    Known(&'static Known),
    Unknown,
}

impl Kind {
    /// Tells the format from a file's first bytes, its length, and whether a header lies beside it.
    pub fn of(head: &[u8], len: u64, has_header: bool) -> Self {
        let text = text::without_mark(head);
        match head {
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Kind::Tiff,
            [0x89, b'P', b'N', b'G', ..] => Kind::Png,
            [b'P', b'K', 3, 4, ..] => Kind::Zip,
            [0x1f, 0x8b, 8, ..] => Kind::Gzip,
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Kind::WebP,
            _ if head.get(257..262) == Some(b"ustar") => Kind::Tar,
            _ if bil::is_header(text) => Kind::Header,
            _ if asc::is_header(text) => Kind::Asc,
            _ if usgs_dem::is_header(head) => Kind::UsgsDem,
            _ if has_header => Known::certain(head).map_or(Kind::Bil, Kind::Known),
            _ if hgt::size(len).is_some() => Kind::Hgt,
            _ => Known::of(head, len).map_or(Kind::Unknown, Kind::Known),
        }
    }

    /// Returns true if a file of this format in a folder is read for its heights.
    pub fn holds_heights(self) -> bool {
        !matches!(self, Kind::Header | Kind::Known(_) | Kind::Unknown)
    }
}

/// Reads the rasters of a source of a known format: one, or those of an archive.
pub(super) fn gather(source: &mut Source, kind: Kind, options: &Options, parts: &mut Parts) -> Result<(), Error> {
    match kind {
        Kind::Zip => archive::gather_zip(source, options, parts),
        Kind::Gzip => archive::gather_gzip(source, options, parts),
        Kind::Tar => archive::gather_tar(source, options, parts),
        kind => parts.add(source.name, options, |options| read(source, kind, options)),
    }
}

/// Reads a source of a format that is one raster, and the files beside it.
pub(super) fn read(source: &mut Source, kind: Kind, options: &Options) -> Result<Decoded, Error> {
    let mut raster = decode(source, kind, options)?;
    sidecar::settle(source, options, &mut raster);
    Ok(raster)
}

fn decode(source: &mut Source, kind: Kind, options: &Options) -> Result<Decoded, Error> {
    if kind != Kind::Tiff {
        one_band(source.name, options)?;
    }
    match kind {
        Kind::Tiff => geotiff::read(source, options),
        Kind::Png => png::read(source, options),
        Kind::WebP => terrain_rgb::read(source, "WebP", options),
        Kind::Zip | Kind::Gzip | Kind::Tar => {
            Err(source.error("content", "expected a height file, found an archive within an archive"))
        }
        Kind::Asc => asc::read(source, options),
        Kind::UsgsDem => usgs_dem::read(source, options),
        Kind::Header => Err(source.error("data", "expected a data file beside the header, found none")),
        Kind::Bil => bil::read(source, options),
        Kind::Hgt => hgt::read(source, options),
        Kind::Raw => raw::read(source, options),
        Kind::Known(known) => Err(source.error("content", known.what())),
        Kind::Unknown => Err(source.error("content", raw::hint(source.len))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples, save};

    /// A file that has changed by the time of its second look: what was there first, and what is there then.
    struct Changing {
        now: Cursor<Vec<u8>>,
        then: Option<Vec<u8>>,
    }

    impl Read for Changing {
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

    /// Reads a file that is `then` after its format was told.
    fn changed(name: &str, first: &[u8], then: Vec<u8>, raw: Option<RawLayout>) -> Result<Loaded, Error> {
        let len = first.len() as u64;
        let mut reader = BufReader::with_capacity(16, Changing { now: Cursor::new(first.to_vec()), then: Some(then) });
        let mut source = Source { name, reader: &mut reader, len, siblings: &|_| None };
        let options = Options { raw, max_samples: 1 << 16, ..Options::default() };
        let kind = source.kind(&options)?;
        read(&mut source, kind, &options)?.finish(name, &options)
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
                    // Of a text's last number no one can tell how many digits it had.
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
