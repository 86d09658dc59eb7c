//! The internal mask of a TIFF: an image of its own whose zeros are samples without data.

use std::io::{Read, Seek};

use tiff::{decoder::Decoder, tags::Tag};

use super::bands::read_mask;
use super::layout::{Layout, Tags, order};
use crate::height::error::Error;
use crate::height::formats::options::Options;
use crate::height::holes::Holes;

/// Bits of `NewSubfileType`.
const IS_REDUCED: u64 = 1;
const IS_MASK: u64 = 4;
/// Most directories that are searched: a picture, its mask, and overviews of both.
const DIRECTORIES: usize = 256;

/// Makes holes where the mask of the first image is 0, if there is one.
pub(super) fn apply<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    name: &str,
    len: u64,
    holes: &mut Holes,
    options: &Options,
) -> Result<(), Error> {
    let (w, h) = decoder.dimensions().map_err(|e| Error::new(name, "ImageWidth, ImageLength", e))?;
    let order = order(decoder);
    let mut next = decoder.ifd_pointer();
    for number in 0..DIRECTORIES {
        let Some(pointer) = next else { break };
        let error = |e: tiff::TiffError| Error::new(name, format!("directory {number}"), e);
        let directory = decoder.read_directory(pointer).map_err(error)?;
        next = directory.next();
        let mut tags = Tags { name, ifd: decoder.read_directory_tags(&directory) };
        let kind = tags.number(Tag::NewSubfileType, 0)?;
        if number == 0 || kind & IS_MASK == 0 || kind & IS_REDUCED != 0 {
            continue;
        }
        let layout = Layout::read(&mut tags, order, len, options)?;
        if layout.size != [w, h] {
            let what = format!("expected a mask of {w}x{h}, found {}x{}", layout.size[0], layout.size[1]);
            return Err(Error::new(name, format!("directory {number}"), what));
        }
        return read_mask(decoder.inner(), &layout, &format!("{name} (mask)"), holes);
    }
    Ok(())
}
