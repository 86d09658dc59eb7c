//! GeoTIFF and plain TIFF: the first picture of the file, read strip by strip or tile by tile.

use tiff::{
    decoder::{ChunkType, Decoder, Limits},
    tags::{CompressionMethod, PhotometricInterpretation, SampleFormat, Tag},
};

use super::{
    Error, Holes, Samples, geokeys,
    load::{Options, Source},
    metadata,
    raster::Raster,
    sample::{Order, SampleType},
    sidecar::Georeference,
    terrain_rgb::{self, Encoding},
    tiff_directory,
};

/// Reads the heights.
pub(super) fn read(source: &mut Source, options: &Options) -> Result<Raster, Error> {
    tiff_directory::check(source, options)?;
    let (name, len) = (source.name, source.len);
    let error = |place: &str, e: tiff::TiffError| Error::new(name, place, e);
    let mut decoder = Decoder::new(&mut source.reader).map_err(|e| error("directory", e))?;
    let layout = Layout::read(&mut decoder, name, len, options)?;
    let [w, h] = layout.size;
    let count = super::load::samples(name, [w, h].map(u64::from), options)?;

    let mut limits = Limits::default();
    limits.decoding_buffer_size = limits.decoding_buffer_size.max(layout.chunk_bytes);
    limits.intermediate_buffer_size = usize::try_from(len).unwrap_or(usize::MAX);
    let mut decoder = decoder.with_limits(limits);
    let mut target = Target { layout: &layout, samples: layout.blank(count), holes: Holes::none(count) };
    let mut bytes = Vec::new();
    for chunk in &layout.chunks {
        if chunk.is_absent {
            target.leave_out(chunk);
            continue;
        }
        bytes.resize(chunk.size[0] * chunk.size[1] * layout.pixel_bytes(), 0);
        decoder.read_chunk_bytes(chunk.index, &mut bytes).map_err(|e| error(&layout.chunk_name(chunk.index), e))?;
        target.store(chunk, &mut bytes);
    }

    let Target { samples, holes, .. } = target;
    let mut warnings = Vec::new();
    let (affine, crs) = geokeys::read(&mut decoder, &mut warnings);
    let format = if affine.is_some() { "GeoTIFF" } else { "TIFF" };
    let sample_type = layout.encoding.map_or(layout.sample.name(), Encoding::name);
    let mut raster = Raster::new(format, sample_type, [w, h], samples);
    raster.holes = holes;
    raster.nodata = nodata(&mut decoder, name)?;
    raster.step = layout.encoding.map_or(1.0, Encoding::step);
    raster.warnings = warnings;
    let metadata = decoder.get_tag_ascii_string(Tag::Unknown(GDAL_METADATA)).ok();
    let band = metadata.map(|text| metadata::from_tag(&text, 1)).unwrap_or_default();
    raster.georeference = Georeference { affine, crs, band };
    Ok(raster)
}

const GDAL_METADATA: u16 = 42112;

/// The declared nodata value, a number as text.
fn nodata<R: std::io::Read + std::io::Seek>(decoder: &mut Decoder<R>, name: &str) -> Result<Option<f64>, Error> {
    let error = |what: String| Error::new(name, "GDAL_NODATA", what);
    if decoder.find_tag(Tag::GdalNodata).ok().flatten().is_none() {
        return Ok(None);
    }
    let text = decoder.get_tag_ascii_string(Tag::GdalNodata).map_err(|e| error(e.to_string()))?;
    let number = text.trim_matches(|c: char| c.is_whitespace() || c == '\0').parse();
    number.map(Some).map_err(|_| error(format!("expected a number, found {text:?}")))
}

/// A strip or tile within the picture.
struct Chunk {
    index: u32,
    /// Column and row of its first pixel.
    at: [usize; 2],
    /// Pixels across and down, without padding.
    size: [usize; 2],
    /// Whether the file leaves it out, as sparse files do.
    is_absent: bool,
}

/// How pixels are stored.
struct Layout {
    size: [u32; 2],
    sample: SampleType,
    /// Samples a pixel.
    channels: usize,
    encoding: Option<Encoding>,
    /// Whether the decoder returns the complement of what is stored.
    is_inverted: bool,
    kind: ChunkType,
    /// Decoded bytes of the largest chunk.
    chunk_bytes: usize,
    chunks: Vec<Chunk>,
}

impl Layout {
    fn read<R: std::io::Read + std::io::Seek>(
        decoder: &mut Decoder<R>,
        name: &str,
        len: u64,
        options: &Options,
    ) -> Result<Self, Error> {
        let error = |place: &str, what: String| Error::new(name, place, what);
        let tag = |decoder: &mut Decoder<R>, tag: Tag, default: u64| -> Result<u64, Error> {
            let numbers =
                decoder.find_tag_unsigned_vec::<u64>(tag).map_err(|e| error(&format!("{tag:?}"), e.to_string()))?;
            Ok(numbers.and_then(|numbers| numbers.first().copied()).unwrap_or(default))
        };
        let (w, h) = decoder.dimensions().map_err(|e| error("ImageWidth, ImageLength", e.to_string()))?;
        let bits = tag(decoder, Tag::BitsPerSample, 1)?;
        let format = SampleFormat::from_u16_exhaustive(tag(decoder, Tag::SampleFormat, 1)? as u16);
        let sample = sample(format, bits).ok_or_else(|| {
            error(
                "BitsPerSample, SampleFormat",
                format!("expected integers of 8, 16 or 32 bits or floats of 32 or 64, found {bits} bits of {format:?}"),
            )
        })?;
        let photometric = PhotometricInterpretation::from_u16(tag(decoder, Tag::PhotometricInterpretation, 1)? as u16);
        let channels = tag(decoder, Tag::SamplesPerPixel, 1)? as usize;
        let is_planar = tag(decoder, Tag::PlanarConfiguration, 1)? != 1;
        let is_inverted = photometric == Some(PhotometricInterpretation::WhiteIsZero);
        let encoding = match (channels, sample) {
            (1, SampleType::F32 | SampleType::F64) if is_inverted => {
                return Err(error("PhotometricInterpretation", "expected 1 (black is zero), found 0".to_owned()));
            }
            (1, _) => None,
            (3 | 4, SampleType::U8) if !is_planar => Some(terrain_rgb::asked(name, options)?),
            _ => {
                return Err(error(
                    "SamplesPerPixel",
                    format!("expected 1 band, found {channels} of {}", sample.name()),
                ));
            }
        };
        let compression = CompressionMethod::from_u16_exhaustive(tag(decoder, Tag::Compression, 1)? as u16);
        let expansion = expansion(compression).ok_or_else(|| {
            error("Compression", format!("expected none, LZW, Deflate, ZSTD or PackBits, found {compression:?}"))
        })?;
        let kind = decoder.get_chunk_type();
        let mut layout =
            Self { size: [w, h], sample, channels, encoding, is_inverted, kind, chunk_bytes: 0, chunks: Vec::new() };
        layout.find_chunks(decoder, name, len, expansion)?;
        Ok(layout)
    }

    /// Places the chunks, and refuses those that lie beyond the end of the file or cannot hold their pixels.
    fn find_chunks<R: std::io::Read + std::io::Seek>(
        &mut self,
        decoder: &mut Decoder<R>,
        name: &str,
        len: u64,
        expansion: u64,
    ) -> Result<(), Error> {
        let (offsets, counts) = match self.kind {
            ChunkType::Strip => (Tag::StripOffsets, Tag::StripByteCounts),
            ChunkType::Tile => (Tag::TileOffsets, Tag::TileByteCounts),
        };
        let mut numbers = |tag: Tag| {
            let numbers = decoder.find_tag_unsigned_vec::<u64>(tag);
            numbers.map(Option::unwrap_or_default).map_err(|e| Error::new(name, format!("{tag:?}"), e))
        };
        let (offsets, counts) = (numbers(offsets)?, numbers(counts)?);
        let chunk_size = decoder.chunk_dimensions();
        let across = self.size[0].div_ceil(chunk_size.0);
        for (index, (offset, count)) in (0..).zip(offsets.into_iter().zip(counts)) {
            let is_absent = count == 0;
            if !is_absent && offset.checked_add(count).is_none_or(|end| end > len) {
                let what = format!("expected {count} bytes at byte {offset}, found the file's end at {len}");
                return Err(Error::new(name, self.chunk_name(index), what));
            }
            let (w, h) = decoder.chunk_data_dimensions(index);
            let bytes = w as usize * h as usize * self.pixel_bytes();
            if !is_absent && count.saturating_mul(expansion) < bytes as u64 {
                let what = format!("expected enough data for {w}x{h} samples, found {count} bytes");
                return Err(Error::new(name, self.chunk_name(index), what));
            }
            self.chunk_bytes = self.chunk_bytes.max(bytes);
            let at = [index % across * chunk_size.0, index / across * chunk_size.1].map(|n| n as usize);
            self.chunks.push(Chunk { index, at, size: [w as usize, h as usize], is_absent });
        }
        Ok(())
    }

    fn chunk_name(&self, index: u32) -> String {
        match self.kind {
            ChunkType::Strip => format!("strip {index}"),
            ChunkType::Tile => format!("tile {index}"),
        }
    }

    fn pixel_bytes(&self) -> usize {
        self.sample.bytes() * self.channels
    }

    fn blank(&self, count: usize) -> Samples {
        if self.encoding.is_some() { Samples::F32(vec![0.0; count]) } else { self.sample.blank(count) }
    }
}

fn sample(format: SampleFormat, bits: u64) -> Option<SampleType> {
    match (format, bits) {
        (SampleFormat::Uint, 8) => Some(SampleType::U8),
        (SampleFormat::Int, 8) => Some(SampleType::I8),
        (SampleFormat::Uint, 16) => Some(SampleType::U16),
        (SampleFormat::Int, 16) => Some(SampleType::I16),
        (SampleFormat::Uint, 32) => Some(SampleType::U32),
        (SampleFormat::Int, 32) => Some(SampleType::I32),
        (SampleFormat::IEEEFP, 32) => Some(SampleType::F32),
        (SampleFormat::IEEEFP, 64) => Some(SampleType::F64),
        _ => None,
    }
}

/// The most bytes that a byte can become: 128 of 2 in PackBits, 258 of 2 bits in Deflate, a string of all
/// codes of 12 bits in LZW, a block of 128 KiB of 4 bytes in ZSTD.
fn expansion(compression: CompressionMethod) -> Option<u64> {
    match compression {
        CompressionMethod::None => Some(1),
        CompressionMethod::PackBits => Some(64),
        CompressionMethod::Deflate | CompressionMethod::OldDeflate => Some(1032),
        CompressionMethod::LZW => Some(4096),
        CompressionMethod::ZSTD => Some(1 << 15),
        _ => None,
    }
}

/// Where pixels go.
struct Target<'a> {
    layout: &'a Layout,
    samples: Samples,
    holes: Holes,
}

impl Target<'_> {
    /// The samples of each row of a chunk.
    fn rows(&self, chunk: &Chunk) -> impl Iterator<Item = usize> + use<> {
        let (width, [x, z]) = (self.layout.size[0] as usize, chunk.at);
        (z..z + chunk.size[1]).map(move |row| row * width + x)
    }

    fn leave_out(&mut self, chunk: &Chunk) {
        self.rows(chunk).flat_map(|at| at..at + chunk.size[0]).for_each(|k| self.holes.insert(k));
    }

    fn store(&mut self, chunk: &Chunk, bytes: &mut [u8]) {
        if self.layout.is_inverted {
            bytes.iter_mut().for_each(|byte| *byte = !*byte);
        }
        let row_bytes = chunk.size[0] * self.layout.pixel_bytes();
        for (at, row) in self.rows(chunk).zip(bytes.chunks_exact(row_bytes)) {
            match (self.layout.encoding, &mut self.samples) {
                (Some(encoding), Samples::F32(heights)) => {
                    encoding.store(row, self.layout.channels, heights, &mut self.holes, at);
                }
                (_, samples) => self.layout.sample.store(Order::NATIVE, row, samples, at),
            }
        }
    }
}
