//! Height files inside zip, tar and gzip files.

use std::{
    borrow::Cow,
    io::{Cursor, Read},
};

use flate2::read::MultiGzDecoder;
use zip::ZipArchive;

use super::companions::{LeftOut, is_companion};
use super::format::{Format, Formats};
use super::head::{HEAD_BYTES, Head};
use super::input::{self, Input, SIBLING_BYTES};
use super::mosaic::Parts;
use super::options::Options;
use super::raster_file;
use crate::height::error::Error;

/// Most bytes of an unpacked member; larger files must be unpacked first.
const UNPACKED_BYTES: u64 = 1 << 31;
/// Most members of an archive.
const MEMBERS: usize = 1 << 16;

/// Returns true if a file begins as a tar file.
pub(super) fn is_tar(head: &[u8]) -> bool {
    head.get(257..262) == Some(b"ustar")
}

/// Reads the file inside a gzip file, or the height files of a tar file inside it.
pub(super) fn gather_gzip(
    input: &mut Input,
    options: &Options,
    formats: Formats,
    parts: &mut Parts,
) -> Result<(), Error> {
    let (name, limit) = (input.name, limit(options));
    let error = |e| Error::new(name, "gzip data", e);
    let mut unpacked = MultiGzDecoder::new(&mut input.reader);
    let mut bytes = Vec::new();
    unpacked.by_ref().take(HEAD_BYTES).read_to_end(&mut bytes).map_err(error)?;
    if is_tar(&bytes) {
        return gather_members(
            name,
            &mut tar_members(name, &mut Cursor::new(bytes).chain(unpacked), formats, limit)?,
            options,
            formats,
            parts,
        );
    }
    unpacked.take(limit + 1 - bytes.len() as u64).read_to_end(&mut bytes).map_err(error)?;
    gather_member(name, &bytes, limit, input.siblings, options, formats, parts)
}

/// Reads the height files inside a tar file.
pub(super) fn gather_tar(
    input: &mut Input,
    options: &Options,
    formats: Formats,
    parts: &mut Parts,
) -> Result<(), Error> {
    let mut members = tar_members(input.name, &mut input.reader, formats, limit(options))?;
    gather_members(input.name, &mut members, options, formats, parts)
}

/// Reads the height files inside a zip file.
pub(super) fn gather_zip(
    input: &mut Input,
    options: &Options,
    formats: Formats,
    parts: &mut Parts,
) -> Result<(), Error> {
    let mut members = Zip::open(input.name, &mut input.reader)?;
    gather_members(input.name, &mut members, options, formats, parts)
}

/// A file in an archive.
struct Member {
    name: String,
    /// Bytes once unpacked, as the archive says.
    len: u64,
    index: usize,
}

/// The files in an archive.
trait Members {
    fn list(&self) -> &[Member];
    /// Unpacks the first bytes of a file, at most `limit`.
    fn unpack(&mut self, index: usize, limit: u64) -> Result<Cow<'_, [u8]>, Error>;
}

struct Zip<'a> {
    name: &'a str,
    archive: ZipArchive<&'a mut dyn input::ReadSeek>,
    list: Vec<Member>,
}

impl<'a> Zip<'a> {
    fn open(name: &'a str, reader: &'a mut dyn input::ReadSeek) -> Result<Self, Error> {
        let mut archive = ZipArchive::new(reader).map_err(|e| Error::new(name, "zip directory", e))?;
        let mut list = Vec::new();
        if archive.len() > MEMBERS {
            return Err(too_many(name, archive.len()));
        }
        for index in 0..archive.len() {
            let member = archive.by_index(index).map_err(|e| Error::new(name, format!("zip member {index}"), e))?;
            if member.is_file() {
                let name = String::from_utf8_lossy(member.name_raw()).into_owned();
                list.push(Member { name, len: member.size(), index });
            }
        }
        list.sort_by(|a, b| (&a.name, a.index).cmp(&(&b.name, b.index)));
        Ok(Self { name, archive, list })
    }
}

impl Members for Zip<'_> {
    fn list(&self) -> &[Member] {
        &self.list
    }

    fn unpack(&mut self, index: usize, limit: u64) -> Result<Cow<'_, [u8]>, Error> {
        let error = |e: &dyn std::fmt::Display| Error::new(self.name, format!("zip member {index}"), e);
        let member = self.archive.by_index(index).map_err(|e| error(&e))?;
        let mut bytes = Vec::new();
        member.take(limit).read_to_end(&mut bytes).map_err(|e| error(&e))?;
        Ok(bytes.into())
    }
}

/// The files of a tar file, which is read once from its beginning.
struct Tar {
    list: Vec<Member>,
    bytes: Vec<Vec<u8>>,
}

/// Unpacks the files of a tar file that may be needed, together no more than `limit` bytes.
fn tar_members(name: &str, reader: &mut dyn Read, formats: Formats, limit: u64) -> Result<Tar, Error> {
    let error = |e| Error::new(name, "tar data", e);
    let (mut list, mut bytes, mut left) = (Vec::new(), Vec::new(), limit);
    let mut archive = tar::Archive::new(reader);
    for (count, entry) in archive.entries().map_err(error)?.enumerate() {
        if count == MEMBERS {
            return Err(too_many(name, count + 1));
        }
        let mut entry = entry.map_err(error)?;
        let member = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        if !entry.header().entry_type().is_file() {
            continue;
        }
        let (len, mut content) = (entry.size(), Vec::new());
        entry.by_ref().take(HEAD_BYTES).read_to_end(&mut content).map_err(error)?;
        if is_companion(&member) || formats.of(&Head::new(&content, len, false)).is_none_or(Format::is_read) {
            let more = if is_companion(&member) { SIBLING_BYTES.min(left) } else { left };
            entry.take(more + 1).read_to_end(&mut content).map_err(error)?;
        }
        left = left.checked_sub(content.len() as u64).ok_or_else(|| too_long(name, limit))?;
        list.push(Member { name: member, len, index: bytes.len() });
        bytes.push(content);
    }
    list.sort_by(|a, b| (&a.name, a.index).cmp(&(&b.name, b.index)));
    Ok(Tar { list, bytes })
}

impl Members for Tar {
    fn list(&self) -> &[Member] {
        &self.list
    }

    fn unpack(&mut self, index: usize, limit: u64) -> Result<Cow<'_, [u8]>, Error> {
        let bytes = &self.bytes[index];
        Ok(bytes[..bytes.len().min(limit as usize)].into())
    }
}

/// Reads the height files of an archive in the order of their names.
fn gather_members(
    name: &str,
    members: &mut dyn Members,
    options: &Options,
    formats: Formats,
    parts: &mut Parts,
) -> Result<(), Error> {
    let list: Vec<(String, u64, usize)> = members.list().iter().map(|m| (m.name.clone(), m.len, m.index)).collect();
    let mut texts = Vec::new();
    for (member, _, index) in list.iter().filter(|(member, ..)| is_companion(member)) {
        texts.push((member.clone(), members.unpack(*index, SIBLING_BYTES)?.into_owned()));
    }
    let (begin, mut left_out) = (parts.len(), LeftOut::default());
    for (member, len, index) in list.iter().filter(|(member, ..)| !is_companion(member)) {
        let sibling = |extension: &str| sibling(&texts, member, extension);
        let head = members.unpack(*index, HEAD_BYTES)?;
        let format = formats.of(&Head::new(&head, *len, sibling("hdr").is_some()));
        if format.is_none_or(|format| !format.holds_heights() || format.is_archive()) {
            left_out.add(member, format);
            continue;
        }
        let limit = limit(options);
        let bytes = members.unpack(*index, limit + 1)?;
        gather_member(&format!("{name}/{member}"), &bytes, limit, &sibling, options, formats, parts)?;
    }
    if parts.len() == begin {
        let what = format!("expected a height file, found none among {} members{}", list.len(), left_out.list());
        return Err(Error::new(name, "archive", what));
    }
    parts.leave_out_companions(begin);
    parts.warnings.extend(left_out.warning(name));
    Ok(())
}

/// Returns the text beside a member that has another extension: `a.hdr` or `a.bil.hdr`.
fn sibling(texts: &[(String, Vec<u8>)], member: &str, extension: &str) -> Option<Vec<u8>> {
    let stem = member.rsplit_once('.').map_or(member, |(stem, _)| stem);
    let is_beside = |other: &str, stem: &str| {
        let rest = other.strip_prefix(stem).and_then(|rest| rest.strip_prefix('.'));
        other != member && rest.is_some_and(|rest| rest.eq_ignore_ascii_case(extension))
    };
    let beside = |stem: &str| texts.iter().find(|(other, _)| is_beside(other, stem));
    // `a.bil.hdr` belongs to this file alone, `a.hdr` perhaps to several.
    beside(member).or_else(|| beside(stem)).map(|(_, text)| text.clone())
}

/// Returns the most bytes of an unpacked member: no format needs more than 16 per sample, except unusually long texts.
fn limit(options: &Options) -> u64 {
    options.max_samples.saturating_mul(16).clamp(1 << 16, UNPACKED_BYTES)
}

fn too_many(name: &str, count: usize) -> Error {
    Error::new(name, "archive", format!("expected at most {MEMBERS} members, found {count} or more: unpack it first"))
}

fn too_long(name: &str, limit: u64) -> Error {
    Error::new(name, "unpacked length", format!("expected at most {limit} bytes, found more: unpack it first"))
}

fn gather_member(
    name: &str,
    bytes: &[u8],
    limit: u64,
    siblings: &dyn Fn(&str) -> Option<Vec<u8>>,
    options: &Options,
    formats: Formats,
    parts: &mut Parts,
) -> Result<(), Error> {
    let len = bytes.len() as u64;
    if len > limit {
        return Err(too_long(name, limit));
    }
    let head = &bytes[..bytes.len().min(HEAD_BYTES as usize)];
    let format = formats.of(&Head::new(head, len, siblings("hdr").is_some()));
    let mut input = Input { name, reader: &mut Cursor::new(bytes), len, siblings };
    parts.add(name, options, |options| raster_file::read(&mut input, format, options))
}
