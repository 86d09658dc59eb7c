//! Broken files: any bytes must give a field within the size limit or a one-line error that names the file, never a
//! panic.

use super::case::{Case, Kind};
use super::fields::hills;
use super::finding::Finding;
use super::panics;
use crate::height::save::save;
use crate::height::{Error, Loaded, Options, load_bytes};

const fn case(name: &'static str, examine: fn() -> Vec<Finding>) -> Case {
    Case { family: "file", name, kind: Kind::Standalone("loader", examine) }
}

/// The family `file`.
pub const CASES: &[Case] = &[
    case("cut off after every byte", || for_each_format(truncated)),
    case("every byte changed", || for_each_format(flipped_bytes)),
    case("another format's magic", || for_each_format(swapped_magic)),
    case("a giant declared size", giants),
    case("odd tiles of a GeoTIFF", || for_formats(&["tif"], odd_tiles)),
];

/// Limit of samples for these loads.
const MAX_SAMPLES: u64 = 1 << 16;

/// A small valid file.
struct Small {
    name: String,
    bytes: Vec<u8>,
    options: Options,
}

/// Numbers of loads and of each kind of failure.
#[derive(Default)]
struct LoadCounts {
    loads: u64,
    panics: u64,
    unnamed_errors: u64,
    too_many: u64,
    first: Option<String>,
}

impl LoadCounts {
    /// Loads bytes and counts failures; `what` describes the change for the first failure. Returns `None` after a
    /// panic.
    fn load(&mut self, small: &Small, bytes: &[u8], what: impl Fn() -> String) -> Option<Result<Loaded, Error>> {
        self.loads += 1;
        let loaded = panics::caught(|| load_bytes(&small.name, bytes, &small.options));
        let mut fault = |counter: fn(&mut Self) -> &mut u64| {
            *counter(self) += 1;
            self.first.get_or_insert_with(|| format!("{}: {}", small.name, what()));
        };
        let Ok(loaded) = loaded else {
            fault(|counts| &mut counts.panics);
            return None;
        };
        match &loaded {
            Err(error) => {
                let error = error.to_string();
                if error.contains('\n') || !error.starts_with(&small.name) {
                    fault(|counts| &mut counts.unnamed_errors);
                }
            }
            Ok(loaded) if loaded.field.samples().len() as u64 > MAX_SAMPLES => fault(|counts| &mut counts.too_many),
            Ok(_) => {}
        }
        Some(loaded)
    }

    fn findings(self) -> Vec<Finding> {
        let Self { loads, panics, unnamed_errors, too_many, first } = self;
        let none = |check, value: u64| {
            Finding::within(check, value as f64, 0.0).with_reason(first.clone().filter(|_| value > 0))
        };
        vec![
            none("panics", panics),
            none("errors that do not name the file in one line", unnamed_errors),
            none("fields larger than allowed", too_many),
            Finding::reported("loads", loads as f64),
        ]
    }
}

/// Writes a small file in each format that the program can write.
fn small_files(extensions: &[&str]) -> Vec<Small> {
    let field = hills([7, 5], [10.0; 2], 300.0);
    let folder = tempfile::tempdir().expect("a folder for small files");
    let small = |extension: &&str| {
        let path = folder.path().join(format!("small.{extension}"));
        save(&field, &path).expect("a small file is written");
        let raw = (*extension == "raw").then(|| "7x5:u16le".parse().expect("a layout"));
        let options = Options { raw, max_samples: MAX_SAMPLES, ..Options::default() };
        Small {
            name: format!("small.{extension}"),
            bytes: std::fs::read(path).expect("the file was just written"),
            options,
        }
    };
    extensions.iter().map(small).collect()
}

/// Runs a check on a small file of each format.
fn for_each_format(examine: fn(&Small, &mut LoadCounts)) -> Vec<Finding> {
    for_formats(&["tif", "asc", "png", "raw"], examine)
}

fn for_formats(extensions: &[&str], examine: fn(&Small, &mut LoadCounts)) -> Vec<Finding> {
    let mut counts = LoadCounts::default();
    small_files(extensions).iter().for_each(|small| examine(small, &mut counts));
    counts.findings()
}

/// Loads every prefix of a file.
fn truncated(small: &Small, counts: &mut LoadCounts) {
    for len in 0..small.bytes.len() {
        counts.load(small, &small.bytes[..len], || format!("its first {len} bytes"));
    }
}

/// Loads a file with every byte changed by each of three masks.
fn flipped_bytes(small: &Small, counts: &mut LoadCounts) {
    let mut bytes = small.bytes.clone();
    for at in 0..bytes.len() {
        for mask in [1, 0x80, 0xff] {
            bytes[at] ^= mask;
            counts.load(small, &bytes, || format!("byte {at} ^ {mask:#x}"));
            bytes[at] ^= mask;
        }
    }
}

/// Loads files that begin like one format and continue like another.
fn swapped_magic(small: &Small, counts: &mut LoadCounts) {
    for magic in [&b"II*\0"[..], b"MM\0*", b"\x89PNG\r\n\x1a\n", b"PK\x03\x04", b"\x1f\x8b", b"ncols ", b"\0\0\0\0"] {
        let bytes = [magic, &small.bytes[magic.len().min(small.bytes.len())..]].concat();
        counts.load(small, &bytes, || format!("with the magic {magic:?}"));
    }
}

/// Loads files that declare sizes beyond their contents. They must be refused by the limit, before any allocation.
fn giants() -> Vec<Finding> {
    let mut counts = LoadCounts::default();
    let mut accepted = 0;
    let mut claim = |name: &str, bytes: &[u8], raw: Option<&str>| {
        let raw = raw.map(|layout| layout.parse().expect("a layout"));
        let options = Options { raw, max_samples: MAX_SAMPLES, ..Options::default() };
        let small = Small { name: name.to_string(), bytes: bytes.to_vec(), options };
        accepted +=
            u32::from(counts.load(&small, bytes, || "a giant".to_string()).is_some_and(|loaded| loaded.is_ok()));
    };
    for side in ["65536", "4294967295", "99999999999999"] {
        claim("giant.asc", format!("ncols {side}\nnrows {side}\ncellsize 1\n1 2 3\n").as_bytes(), None);
    }
    claim("giant.raw", &[0; 64], Some("60000x60000:u16le"));
    let mut tif = small_files(&["tif"]).remove(0).bytes;
    if let Some(at) = tag_offset(&tif, WIDTH) {
        tif[at + 8..at + 12].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
        claim("giant.tif", &tif, None);
    }
    let mut findings = counts.findings();
    findings.insert(0, Finding::within("giants that were read", f64::from(accepted), 0.0));
    findings
}

/// TIFF tags: image width, image length and rows per strip.
const WIDTH: u16 = 256;
const LENGTH: u16 = 257;
const ROWS_PER_STRIP: u16 = 278;

/// Returns the offset of a tag's entry in the first directory of a little-endian TIFF.
fn tag_offset(bytes: &[u8], tag: u16) -> Option<usize> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let half = |at: usize| Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
    let directory = word(4)? as usize;
    let count = usize::from(half(directory)?);
    (0..count).map(|k| directory + 2 + 12 * k).find(|&at| half(at) == Some(tag))
}

/// Loads TIFFs whose sizes and strips contradict each other.
fn odd_tiles(small: &Small, counts: &mut LoadCounts) {
    for tag in [WIDTH, LENGTH, ROWS_PER_STRIP] {
        let Some(at) = tag_offset(&small.bytes, tag) else { continue };
        for value in [0u32, 1, 2, 3, 6, 8, 13, 255, 65535, u32::MAX] {
            let mut bytes = small.bytes.clone();
            bytes[at + 8..at + 12].copy_from_slice(&value.to_le_bytes());
            counts.load(small, &bytes, || format!("tag {tag} = {value}"));
        }
    }
}
