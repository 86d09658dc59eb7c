//! A file as readers see it: its bytes, and the small files beside it.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek},
    path::Path,
};

use super::options::Options;
use super::text;
use crate::height::error::Error;

/// Opens a file and passes it to `read`.
pub(super) fn with_input<T>(path: &Path, read: impl FnOnce(&mut Input) -> Result<T, Error>) -> Result<T, Error> {
    let name = path.display().to_string();
    let siblings = |extension: &str| sibling(path, extension);
    let (file, len) = open(path)?;
    read(&mut Input { name: &name, reader: &mut BufReader::new(file), len, siblings: &siblings })
}

/// Opens a regular file, and returns its length in bytes.
pub(super) fn open(path: &Path) -> Result<(File, u64), Error> {
    let error = |e: io::Error| Error::new(path.display().to_string(), "file", format!("expected a readable file, {e}"));
    // Opening a pipe would wait for its writer.
    if !std::fs::metadata(path).map_err(error)?.is_file() {
        return Err(error(io::Error::other("found neither a file nor a directory")));
    }
    let file = File::open(path).map_err(error)?;
    let len = file.metadata().map_err(error)?.len();
    Ok((file, len))
}

/// Most bytes of a small file, as a tile or a description.
const SMALL_BYTES: u64 = 1 << 26;

/// Reads a small file.
pub(super) fn small_file(path: &Path, name: &str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    open(path)?.0.take(SMALL_BYTES).read_to_end(&mut bytes).map_err(|e| Error::new(name, "file", e))?;
    Ok(bytes)
}

/// The most bytes read from a file beside the data: headers and projections are short texts.
pub(super) const SIBLING_BYTES: u64 = 1 << 24;

/// Reads the file beside `path` with another extension: `a.hdr` or `a.bil.hdr`.
pub(super) fn sibling(path: &Path, extension: &str) -> Option<Vec<u8>> {
    let mut appended = path.as_os_str().to_owned();
    appended.push(format!(".{extension}"));
    let upper = extension.to_uppercase();
    // `a.bil.hdr` belongs to this file alone, `a.hdr` perhaps to several.
    [appended.into(), path.with_extension(extension), path.with_extension(upper)]
        .into_iter()
        .filter(|other| other != path && other.is_file())
        .find_map(|other| {
            let mut bytes = Vec::new();
            File::open(other).ok()?.take(SIBLING_BYTES).read_to_end(&mut bytes).ok()?;
            Some(bytes)
        })
}

/// Source of a reader's bytes. Files are not mapped into memory, so that one that shrinks while it is read is an error
/// and no crash.
pub(super) trait ReadSeek: BufRead + Seek {}
impl<T: BufRead + Seek> ReadSeek for T {}

/// One file: bytes, and the small files beside it.
pub(super) struct Input<'a> {
    /// The name in messages.
    pub name: &'a str,
    /// The bytes, from the beginning.
    pub reader: &'a mut dyn ReadSeek,
    /// Number of bytes.
    pub len: u64,
    /// The file beside this one that has the given extension.
    pub siblings: &'a dyn Fn(&str) -> Option<Vec<u8>>,
}

impl Input<'_> {
    /// An error at a place of this file.
    pub fn error(&self, place: impl Into<String>, what: impl ToString) -> Error {
        Error::new(self.name, place, what)
    }

    /// The text of the file beside this one that has the given extension.
    pub fn sibling_text(&self, extension: &str) -> Option<String> {
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(text::without_mark(&bytes)).into_owned();
        (self.siblings)(extension).map(text)
    }

    /// Returns the number of samples of a size, if the options allow it.
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
}

/// Returns the number of samples of a size, if the options allow it.
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

/// Fails if the options request another band than the first, for formats that have one.
pub(super) fn one_band(name: &str, options: &Options) -> Result<(), Error> {
    match options.band {
        None | Some(1) => Ok(()),
        Some(band) => {
            Err(Error::new(name, "--band", format!("expected 1, the only band of this format, found {band}")))
        }
    }
}
