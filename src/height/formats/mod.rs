//! Height files: one table of all formats, and a reader for each that is read.
//!
//! A format is a file of this folder with a function that reads it, and a row of [`FORMATS`].

mod archive;
mod asc;
mod bil;
mod decoded;
mod envi;
mod folder;
mod hgt;
mod input;
mod load;
mod located;
mod metadata;
mod mosaic;
mod nodata;
mod png;
mod raw;
mod rounding;
mod sample;
mod sidecar;
mod table;
mod terrain_rgb;
mod text;
mod tiff;
mod tile_grid;
mod tiles;
mod unplaced;
mod usgs_dem;
mod world_file;

pub use decoded::MAX_SIDE;
pub use load::{HoleFill, Loaded, Options, SourceFile, load, load_all, load_bytes, load_bytes_with};
pub use located::{Footprint, Located, place_of};
pub use nodata::number;
pub use raw::RawLayout;
pub use sample::{Order, SampleType};
pub use table::FORMATS;
pub use terrain_rgb::Encoding;

use std::path::{Path, PathBuf};

use self::{decoded::Decoded, input::Input, mosaic::Parts};
use super::Error;

/// A format of height files: a row of [`FORMATS`].
pub struct Format {
    /// Name, as `info` prints it; of an unread format with an article where one belongs, for errors.
    pub name: &'static str,
    detect: Detect,
    read: Option<Read>,
    /// The part of the format that is read, in Markdown; of an unread format the way to convert it.
    pub about: &'static str,
}

/// The test that detects a format.
enum Detect {
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
type Reader = fn(&mut Input, &Options) -> Result<Decoded, Error>;

/// The way to a format's rasters.
enum Read {
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
    /// A file that holds files.
    Archive(fn(&mut Input, &Options, &mut Parts) -> Result<(), Error>),
    /// A folder. The function returns false if the folder is none of this format.
    Dataset(fn(&Path, &Options, &mut Parts) -> Result<bool, Error>),
}

/// A row for a format that is read.
const fn read(name: &'static str, detect: Detect, read: Read, about: &'static str) -> Format {
    Format { name, detect, read: Some(read), about }
}

/// A row for a format that is recognised and not read.
const fn unread(name: &'static str, detect: Detect, about: &'static str) -> Format {
    Format { name, detect, read: None, about }
}

impl Format {
    /// Detects the format of a file; `None` if it is no known one.
    fn of(head: &Head) -> Option<&'static Self> {
        FORMATS.iter().find(|format| match format.detect {
            Detect::Magic(at, bytes) => head.bytes.get(at..).is_some_and(|rest| rest.starts_with(bytes)),
            Detect::Word(word) => head.begins(word),
            Detect::By(test) => test(head),
            Detect::Folder(_) => false,
        })
    }

    /// Returns true if a folder may be a dataset of this format.
    fn may_be(&self, folder: &Path) -> bool {
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
    fn is_archive(&self) -> bool {
        matches!(self.read, Some(Read::Archive(_)))
    }

    /// Returns true if a file of this format in a folder is read for its heights. Headers are read with their data.
    fn holds_heights(&self) -> bool {
        self.is_read() && !matches!(self.read, Some(Read::Beside { .. }))
    }

    /// Returns the error text of an unread format: the format found, and the way to convert it.
    fn refusal(&self) -> String {
        format!("expected a height format that is read, found {}: {}", self.name, self.about)
    }
}

/// The beginning of a file, and all other facts that detect its format.
struct Head<'a> {
    /// The first bytes, at most [`input::HEAD_BYTES`].
    bytes: &'a [u8],
    /// Bytes of the whole file.
    len: u64,
    /// True if a `.hdr` lies beside the file.
    has_header: bool,
    /// True if the caller states the layout of bare samples.
    is_raw: bool,
    /// The bytes as text in lower case after a byte order mark; empty if they hold a zero byte.
    text: String,
    /// True if the text begins with an XML declaration.
    is_xml: bool,
    /// Bytes of the text before its first word, an XML declaration included.
    start: usize,
}

impl<'a> Head<'a> {
    fn new(bytes: &'a [u8], len: u64, has_header: bool) -> Self {
        let text = match bytes.contains(&0) {
            true => String::new(),
            false => String::from_utf8_lossy(text::without_mark(bytes)).to_ascii_lowercase(),
        };
        let trimmed = text.trim_start();
        let is_xml = trimmed.starts_with("<?xml");
        let rest = if is_xml { trimmed.split_once("?>").map_or("", |(_, rest)| rest).trim_start() } else { trimmed };
        let start = text.len() - rest.len();
        Self { bytes, len, has_header, is_raw: false, text, is_xml, start }
    }

    /// Returns the bytes after a byte order mark.
    fn unmarked(&self) -> &[u8] {
        text::without_mark(self.bytes)
    }

    /// Returns true if the text begins with a word, given in lower case.
    fn begins(&self, word: &str) -> bool {
        self.text[self.start..].starts_with(word)
    }

    /// Returns true if the text contains a word, given in lower case.
    fn says(&self, word: &str) -> bool {
        self.text[self.start..].contains(word)
    }

    /// Returns true if every line after a title and comments has three numbers.
    fn is_xyz(&self) -> bool {
        let whole = self.text.rsplit_once('\n').map_or(self.text.as_str(), |(whole, _)| whole);
        let lines = whole.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', '/']));
        let is_point = |line: &str| {
            let words = || line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty());
            words().count() >= 3 && words().take(3).all(|word| word.parse::<f64>().is_ok())
        };
        let mut lines = lines.skip_while(|line| line.starts_with(char::is_alphabetic)).take(8).peekable();
        lines.peek().is_some() && lines.all(is_point)
    }
}
