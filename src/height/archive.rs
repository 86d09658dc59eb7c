//! Height files inside zip and gzip files.

use std::io::{Cursor, Read};

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;

use super::{
    Error,
    load::{self, HEAD_BYTES, Kind, Options, Source},
    raster::Raster,
};

/// The most bytes a member may unpack to; larger files are to be unpacked first.
const UNPACKED_BYTES: u64 = 1 << 31;
/// The most members looked at.
const MEMBERS: usize = 4096;
/// Ends of the names of small files that describe a member.
const SIDECARS: [&str; 10] = [".hdr", ".prj", ".aux.xml", ".wld", ".tfw", ".tifw", ".tiffw", ".pgw", ".pngw", ".blw"];
/// The most bytes of a header or projection beside a member.
const SIBLING_BYTES: u64 = 1 << 16;

/// Reads the file inside a gzip file.
pub(super) fn read_gzip(source: &mut Source, options: &Options) -> Result<Raster, Error> {
    let mut bytes = Vec::new();
    let limit = limit(options);
    let read = MultiGzDecoder::new(&mut source.reader).take(limit + 1).read_to_end(&mut bytes);
    read.map_err(|e| source.error("gzip data", e))?;
    read_member(source.name, &bytes, limit, source.siblings, options)
}

/// Reads the largest height file inside a zip file.
pub(super) fn read_zip(source: &mut Source, options: &Options) -> Result<Raster, Error> {
    let name = source.name;
    let error = |place: &str, e: &dyn std::fmt::Display| Error::new(name, format!("zip {place}"), e);
    let mut archive = ZipArchive::new(&mut source.reader).map_err(|e| error("directory", &e))?;
    let mut members = Vec::new();
    for index in 0..archive.len().min(MEMBERS) {
        let member = archive.by_index(index).map_err(|e| error(&format!("member {index}"), &e))?;
        if member.is_file() {
            members.push((member.size(), index, String::from_utf8_lossy(member.name_raw()).into_owned()));
        }
    }
    members.sort_by_key(|&(size, index, _)| (std::cmp::Reverse(size), index));

    let mut unpack = |index: usize, limit: u64| -> Result<Vec<u8>, Error> {
        let member = archive.by_index(index).map_err(|e| error(&format!("member {index}"), &e))?;
        let mut bytes = Vec::new();
        member.take(limit).read_to_end(&mut bytes).map_err(|e| error(&format!("member {index}"), &e))?;
        Ok(bytes)
    };
    let mut texts = Vec::new();
    for (_, index, member) in members.iter().filter(|(.., member)| is_text(member)) {
        texts.push((member.clone(), unpack(*index, SIBLING_BYTES)?));
    }
    for (size, index, member) in members.iter().filter(|(.., member)| !is_text(member)) {
        let sibling = |extension: &str| {
            let stem = member.rsplit_once('.').map_or(member.as_str(), |(stem, _)| stem);
            let fits = |other: &str| [stem, member].iter().any(|stem| is_stem(other, stem, extension));
            texts.iter().find(|(other, _)| other != member && fits(other)).map(|(_, text)| text.clone())
        };
        let head = unpack(*index, HEAD_BYTES)?;
        match Kind::of(&head, *size, sibling("hdr").is_some()) {
            Kind::Unknown | Kind::Picture(_) | Kind::Header | Kind::Zip | Kind::Gzip => continue,
            _ => {
                let limit = limit(options);
                return read_member(&format!("{name}/{member}"), &unpack(*index, limit + 1)?, limit, &sibling, options);
            }
        }
    }
    Err(error("directory", &format!("expected a height file, found none among {} members", members.len())))
}

fn is_text(member: &str) -> bool {
    let lower = member.to_lowercase();
    SIDECARS.iter().any(|extension| lower.ends_with(extension))
}

fn is_stem(other: &str, stem: &str, extension: &str) -> bool {
    let rest = other.strip_prefix(stem).and_then(|rest| rest.strip_prefix('.'));
    rest.is_some_and(|rest| rest.eq_ignore_ascii_case(extension))
}

/// No format needs more than 16 bytes a sample, but for texts of unusual length.
fn limit(options: &Options) -> u64 {
    options.max_samples.saturating_mul(16).clamp(1 << 16, UNPACKED_BYTES)
}

fn read_member(
    name: &str,
    bytes: &[u8],
    limit: u64,
    siblings: &dyn Fn(&str) -> Option<Vec<u8>>,
    options: &Options,
) -> Result<Raster, Error> {
    let len = bytes.len() as u64;
    if len > limit {
        return Err(Error::new(name, "unpacked length", format!("expected at most {limit} bytes, found more")));
    }
    let kind = Kind::of(&bytes[..bytes.len().min(HEAD_BYTES as usize)], len, siblings("hdr").is_some());
    if matches!(kind, Kind::Zip | Kind::Gzip) {
        return Err(Error::new(name, "content", "expected a height file, found an archive within an archive"));
    }
    load::read(&mut Source { name, reader: &mut Cursor::new(bytes), len, siblings }, kind, options)
}
