//! Formats of height files: how each is detected and read.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::decoded::Decoded;
use super::head::{HEAD_BYTES, Head};
use super::input::Input;
use super::mosaic::Parts;
use super::options::Options;
use crate::height::error::Error;

/// A format of height files: a row of [`FORMATS`](super::FORMATS).
pub struct Format {
    /// Name, as `info` prints it; of an unread format with an article where one belongs, for errors.
    pub name: &'static str,
    /// The test that detects it.
    pub(super) detect: Detect,
    /// The way to its rasters; `None` for a format that is not read.
    pub(super) read: Option<Read>,
    /// The part of the format that is read, in Markdown; of an unread format the way to convert it.
    pub about: &'static str,
}

/// The test that detects a format.
pub(super) enum Detect {
    /// These bytes at a position.
    Magic(usize, &'static [u8]),
    /// Text that begins with this, in lower case, after white space and an XML declaration.
    Word(&'static str),
    /// A test of a file's beginning.
    By(fn(&Head) -> bool),
    /// A folder that holds one of these files; any folder if the list is empty.
    Folder(&'static [&'static str]),
}

/// Reads a file of one raster.
pub(super) type Reader = fn(&mut Input, &Options) -> Result<Decoded, Error>;

/// The way to a format's rasters.
pub(super) enum Read {
    /// A file of one raster.
    One(Reader),
    /// A file of one raster with several bands, of which the reader chooses.
    Bands(Reader),
    /// A header, whose raster is a file beside it.
    Beside {
        /// Returns the path of the raster of a header.
        data: fn(&Path) -> Option<PathBuf>,
        /// Reads that raster.
        read: Reader,
    },
    /// A file that holds files of the given formats.
    Archive(fn(&mut Input, &Options, Formats, &mut Parts) -> Result<(), Error>),
    /// A folder of files of the given formats. The function returns false if the folder is none of this format.
    Dataset(fn(&Path, &Options, Formats, &mut Parts) -> Result<bool, Error>),
}

/// A row for a format that is read.
pub(super) const fn read(name: &'static str, detect: Detect, read: Read, about: &'static str) -> Format {
    Format { name, detect, read: Some(read), about }
}

/// A row for a format that is recognised and not read.
pub(super) const fn unread(name: &'static str, detect: Detect, about: &'static str) -> Format {
    Format { name, detect, read: None, about }
}

/// A table of formats, in the order in which they are detected.
#[derive(Clone, Copy)]
pub(super) struct Formats(pub &'static [Format]);

impl Formats {
    /// Detects the format of a file from its beginning; `None` if it is no known one.
    pub fn of(self, head: &Head) -> Option<&'static Format> {
        self.0.iter().find(|format| match format.detect {
            Detect::Magic(at, bytes) => head.bytes.get(at..).is_some_and(|rest| rest.starts_with(bytes)),
            Detect::Word(word) => head.begins(word),
            Detect::By(test) => test(head),
            Detect::Folder(_) => false,
        })
    }

    /// Detects the format from the file's content; `None` if it is no known one.
    pub fn of_input(self, input: &mut Input, options: &Options) -> Result<Option<&'static Format>, Error> {
        let mut bytes = Vec::new();
        let read = input.reader.take(HEAD_BYTES).read_to_end(&mut bytes);
        read.and_then(|_| input.reader.rewind()).map_err(|e| input.error("byte 0", e))?;
        let mut head = Head::new(&bytes, input.len, (input.siblings)("hdr").is_some());
        head.is_raw = options.raw.is_some();
        Ok(self.of(&head))
    }
}

impl Format {
    /// Returns true if a folder may be a dataset of this format.
    pub(super) fn may_be(&self, folder: &Path) -> bool {
        match self.detect {
            Detect::Folder(files) => files.is_empty() || files.iter().any(|file| folder.join(file).is_file()),
            _ => false,
        }
    }

    /// Returns true if heights of this format are read.
    pub fn is_read(&self) -> bool {
        self.read.is_some()
    }

    /// Returns true if a file of this format is an archive.
    pub(super) fn is_archive(&self) -> bool {
        matches!(self.read, Some(Read::Archive(_)))
    }

    /// Returns true if a file of this format in a folder is read for its heights. Headers are read with their data.
    pub(super) fn holds_heights(&self) -> bool {
        self.is_read() && !matches!(self.read, Some(Read::Beside { .. }))
    }

    /// Returns the error text of an unread format: the format found, and the way to convert it.
    pub(super) fn refusal(&self) -> String {
        format!("expected a height format that is read, found {}: {}", self.name, self.about)
    }
}
