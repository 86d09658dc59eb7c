//! Storage of an image in a TIFF: the type of its samples, its bands, and the chunks that hold them.

use std::io::{Read, Seek};

use tiff::{
    TiffResult,
    decoder::ifd::Value,
    decoder::{Decoder, IfdDecoder},
    tags::{ByteOrder, SampleFormat, Tag},
};

use super::codec::Codec;
use super::sample::Packing;
use crate::height::error::Error;
use crate::height::formats::input;
use crate::height::formats::options::Options;
use crate::height::formats::sample::Order;

/// The largest tile or strip, bytes, of files that claim few samples.
const CHUNK_BYTES: u64 = 1 << 20;

/// A strip or tile of one plane.
pub(super) struct Chunk {
    /// Number within the file, for messages.
    pub index: usize,
    /// Band of its first sample: 0 unless each band has chunks of its own.
    pub plane: usize,
    /// Column and row of its first pixel.
    pub at: [usize; 2],
    /// Pixels across and down, without padding.
    pub size: [usize; 2],
    /// First byte and number of bytes in the file; a sparse file leaves out chunks of 0 bytes.
    pub bytes: [u64; 2],
}

/// The layout of one image.
pub(super) struct Layout {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// The packing of a row of samples.
    pub packing: Packing,
    /// Samples a pixel.
    pub bands: usize,
    /// The band that is the pixels' opacity.
    pub alpha: Option<usize>,
    /// True if each band has chunks of its own.
    pub is_planar: bool,
    /// True if pixels are indices into a table of colours.
    pub is_palette: bool,
    pub codec: Codec,
    /// True if the bits of each byte are stored from the lowest to the highest.
    pub is_bit_reversed: bool,
    /// Columns and rows of a full chunk.
    pub chunk_size: [usize; 2],
    pub chunks: Vec<Chunk>,
    /// The word for a chunk: strip or tile.
    pub chunk_name: &'static str,
}

impl Layout {
    /// Reads the layout of the first image.
    pub fn first<R: Read + Seek>(
        decoder: &mut Decoder<R>,
        name: &str,
        len: u64,
        options: &Options,
    ) -> Result<Self, Error> {
        let order = order(decoder);
        Self::read(&mut Tags { name, ifd: decoder.image_ifd() }, order, len, options)
    }

    /// Reads the layout that a directory describes.
    pub fn read(tags: &mut Tags, order: Order, len: u64, options: &Options) -> Result<Self, Error> {
        let size = [tags.number(Tag::ImageWidth, 0)?, tags.number(Tag::ImageLength, 0)?];
        input::samples(tags.name, size, options)?;
        let bands = tags.number(Tag::SamplesPerPixel, 1)? as usize;
        let is_planar = tags.number(Tag::PlanarConfiguration, 1)? == 2;
        let photometric = tags.number(Tag::PhotometricInterpretation, 1)?;
        let mut layout = Self {
            size: size.map(|n| n as u32),
            packing: packing(tags, order, if is_planar { 1 } else { bands })?,
            bands,
            alpha: alpha(tags, bands)?,
            is_planar,
            is_palette: photometric == 3,
            codec: Codec::of(tags.number(Tag::Compression, 1)?).map_err(|what| tags.error("Compression", what))?,
            is_bit_reversed: tags.number(Tag::FillOrder, 1)? == 2,
            chunk_size: [0; 2],
            chunks: Vec::new(),
            chunk_name: "strip",
        };
        layout.find_chunks(tags, len, options)?;
        Ok(layout)
    }

    /// Places the chunks, and refuses those that lie beyond the end of the file or cannot hold their pixels.
    fn find_chunks(&mut self, tags: &mut Tags, len: u64, options: &Options) -> Result<(), Error> {
        let [w, h] = self.size.map(|n| n as usize);
        let (offsets, counts) = if tags.ifd.find_entry(Tag::TileOffsets).is_some() {
            self.chunk_name = "tile";
            self.chunk_size = [tags.number(Tag::TileWidth, 0)? as usize, tags.number(Tag::TileLength, 0)? as usize];
            (tags.numbers(Tag::TileOffsets)?, tags.numbers(Tag::TileByteCounts)?)
        } else {
            self.chunk_size = [w, tags.number(Tag::RowsPerStrip, u64::MAX)?.min(h as u64) as usize];
            (tags.numbers(Tag::StripOffsets)?, tags.numbers(Tag::StripByteCounts)?)
        };
        let [cw, ch] = self.chunk_size;
        let max = options.max_samples.saturating_mul(8).max(CHUNK_BYTES);
        let chunk_bytes = (cw as u64).checked_mul(self.packing.pixel_bits() as u64).map(|bits| bits.div_ceil(8));
        let chunk_bytes = chunk_bytes.and_then(|row| row.checked_mul(ch as u64));
        if cw == 0 || ch == 0 || chunk_bytes.is_none_or(|bytes| bytes > max) {
            let what = format!("expected at most {max} bytes a {}, found {cw}x{ch} pixels", self.chunk_name);
            return Err(tags.error("TileWidth, TileLength, RowsPerStrip", what));
        }
        let [across, down] = [w.div_ceil(cw), h.div_ceil(ch)];
        let planes = if self.is_planar { self.bands } else { 1 };
        let expected = across * down * planes;
        if offsets.len() != expected || counts.len() != expected {
            let what = format!("expected {expected}, found {} and {}", offsets.len(), counts.len());
            return Err(tags.error(&format!("{} offsets and byte counts", self.chunk_name), what));
        }
        for (index, bytes) in offsets.into_iter().zip(counts).map(<[u64; 2]>::from).enumerate() {
            let (plane, place) = (index / (across * down), index % (across * down));
            let at = [place % across * cw, place / across * ch];
            let size = [cw.min(w - at[0]), ch.min(h - at[1])];
            let chunk = Chunk { index, plane, at, size, bytes };
            self.check(&chunk, len).map_err(|what| tags.error(&self.name(&chunk), what))?;
            self.chunks.push(chunk);
        }
        Ok(())
    }

    fn check(&self, chunk: &Chunk, len: u64) -> Result<(), String> {
        let [at, count] = chunk.bytes;
        if count == 0 {
            return Ok(());
        }
        if at.checked_add(count).is_none_or(|end| end > len) {
            return Err(format!("expected {count} bytes at byte {at}, found the file's end at {len}"));
        }
        if count.saturating_mul(self.codec.expansion()) < self.min_bytes(chunk) as u64 {
            let [w, h] = chunk.size;
            return Err(format!("expected enough data for {w}x{h} samples, found {count} bytes"));
        }
        Ok(())
    }

    /// Bytes of a row of a chunk, padding included.
    pub fn row_bytes(&self) -> usize {
        (self.chunk_size[0] * self.packing.pixel_bits()).div_ceil(8)
    }

    /// Bytes that a chunk must hold: a tile has all its rows, a strip those of the image.
    pub fn min_bytes(&self, chunk: &Chunk) -> usize {
        let rows = if self.chunk_name == "tile" { self.chunk_size[1] } else { chunk.size[1] };
        self.row_bytes() * rows
    }

    /// Bytes that a chunk may hold: some writers pad the last strip.
    pub fn max_bytes(&self, chunk: &Chunk) -> usize {
        let [min, full] = [self.min_bytes(chunk), self.row_bytes() * self.chunk_size[1]];
        // No more than its bytes can become.
        let possible = usize::try_from(chunk.bytes[1].saturating_mul(self.codec.expansion())).unwrap_or(usize::MAX);
        full.min(possible).max(min)
    }

    /// A chunk's name in messages.
    pub fn name(&self, chunk: &Chunk) -> String {
        format!("{} {}", self.chunk_name, chunk.index)
    }
}

/// The order of bytes in a file.
pub(super) fn order<R: Read + Seek>(decoder: &Decoder<R>) -> Order {
    match decoder.byte_order() {
        ByteOrder::LittleEndian => Order::Little,
        ByteOrder::BigEndian => Order::Big,
    }
}

/// The tags of a directory, with errors that name the file and the tag.
pub(super) struct Tags<'a> {
    pub name: &'a str,
    pub ifd: IfdDecoder<'a>,
}

impl Tags<'_> {
    pub fn error(&self, place: &str, what: impl ToString) -> Error {
        Error::new(self.name, place, what)
    }

    /// The numbers of a tag; none if it is absent.
    pub fn numbers(&mut self, tag: Tag) -> Result<Vec<u64>, Error> {
        let numbers: TiffResult<_> =
            self.ifd.find_tag(tag).and_then(|value| value.map(Value::into_u64_vec).transpose());
        numbers.map(Option::unwrap_or_default).map_err(|e| Error::new(self.name, format!("{tag:?}"), e))
    }

    /// The first number of a tag.
    pub fn number(&mut self, tag: Tag, default: u64) -> Result<u64, Error> {
        Ok(self.numbers(tag)?.first().copied().unwrap_or(default))
    }
}

/// The packing of rows, from the tags about samples and prediction.
fn packing(tags: &mut Tags, order: Order, stride: usize) -> Result<Packing, Error> {
    let bits = tags.numbers(Tag::BitsPerSample)?;
    let formats = tags.numbers(Tag::SampleFormat)?;
    if [&bits, &formats].iter().any(|numbers| numbers.windows(2).any(|two| two[0] != two[1])) {
        let what = format!("expected bands of one type, found {bits:?} bits of formats {formats:?}");
        return Err(tags.error("BitsPerSample, SampleFormat", what));
    }
    let (bits, format) = (bits.first().copied().unwrap_or(1), formats.first().copied().unwrap_or(1));
    let predictor = tags.number(Tag::Predictor, 1)?;
    let packing = Packing::new(format, bits, order, stride, predictor);
    packing.map_err(|(place, what)| match SampleFormat::from_u16(format as u16) {
        Some(format) => tags.error(place, format!("{what}, found {bits} bits of {format:?}")),
        None => tags.error(place, format!("{what}, found {bits} bits of format {format}")),
    })
}

/// The band that `ExtraSamples` names as opacity.
fn alpha(tags: &mut Tags, bands: usize) -> Result<Option<usize>, Error> {
    let extra = tags.numbers(Tag::ExtraSamples)?;
    let Some(first) = bands.checked_sub(extra.len()) else {
        return Err(tags.error("ExtraSamples", format!("expected at most {bands}, found {}", extra.len())));
    };
    Ok(extra.iter().position(|kind| [1, 2].contains(kind)).map(|k| first + k))
}
