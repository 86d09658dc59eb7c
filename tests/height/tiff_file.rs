//! A writer of TIFFs of every layout: the encoder of the `tiff` crate writes neither tiles nor big-endian files.

use std::io::Write;

/// The layout of a file.
#[derive(Clone, Debug)]
pub struct TiffFile {
    pub size: [usize; 2],
    pub big_endian: bool,
    pub big_tiff: bool,
    /// Pixels of a tile, or strips of 2 rows.
    pub tile: Option<[usize; 2]>,
    pub compression: u16,
    pub predictor: u16,
    pub bits: u16,
    pub format: u16,
    pub bands: usize,
    /// True if each band has chunks of its own.
    pub planar: bool,
    /// Bytes before the file's first: where it is appended to another.
    pub base: usize,
    /// Bytes after the data of each chunk.
    pub padding: Vec<u8>,
    /// True if ZSTD data are compressed, with a checksum.
    pub checksum: bool,
    /// Further tags: doubles, shorts or text.
    pub tags: Vec<(u16, Tag)>,
}

#[derive(Clone, Debug)]
pub enum Tag {
    Short(Vec<u16>),
    Long(Vec<u64>),
    Double(Vec<f64>),
    Text(String),
}

pub const NONE: u16 = 1;
pub const LZW: u16 = 5;
pub const DEFLATE: u16 = 8;
pub const PACK_BITS: u16 = 32773;
pub const ZSTD: u16 = 50000;

impl TiffFile {
    pub fn new(size: [usize; 2], bits: u16, format: u16) -> Self {
        Self {
            size,
            big_endian: false,
            big_tiff: false,
            tile: None,
            compression: NONE,
            predictor: 1,
            bits,
            format,
            bands: 1,
            planar: false,
            base: 0,
            padding: Vec::new(),
            checksum: false,
            tags: Vec::new(),
        }
    }

    pub fn tag(mut self, tag: u16, value: Tag) -> Self {
        self.tags.push((tag, value));
        self
    }

    /// Pixel scale and tie point: the corner of the north-west pixel.
    pub fn placed(self, step: [f64; 2], corner: [f64; 2]) -> Self {
        self.tag(33550, Tag::Double(vec![step[0], step[1], 0.0]))
            .tag(33922, Tag::Double(vec![0.0, 0.0, 0.0, corner[0], corner[1], 0.0]))
    }

    /// Geographic keys with values that are codes.
    pub fn keys(self, keys: &[[u16; 2]]) -> Self {
        let mut directory = vec![1, 1, 0, keys.len() as u16];
        keys.iter().for_each(|&[key, code]| directory.extend([key, 0, 1, code]));
        self.tag(34735, Tag::Short(directory))
    }

    /// The file with `value(i, j)` as samples; bands follow one another in `i`.
    pub fn bytes(&self, value: impl Fn(usize, usize) -> f64) -> Vec<u8> {
        let [w, h] = self.size;
        let [cw, ch] = self.tile.unwrap_or([w, 2]);
        let planes = if self.planar { self.bands } else { 1 };
        let stride = self.bands / planes;
        let mut chunks = Vec::new();
        for plane in 0..planes {
            for z in (0..h).step_by(ch) {
                for x in (0..w).step_by(cw) {
                    // A strip ends with the picture, a tile is padded.
                    let rows = if self.tile.is_some() { ch } else { ch.min(h - z) };
                    let mut chunk = Vec::new();
                    for j in z..z + rows {
                        let inside =
                            |i: usize| if i / stride < w && j < h { value(i * planes + plane, j) } else { 0.0 };
                        let row: Vec<f64> = (x * stride..(x + cw) * stride).map(inside).collect();
                        chunk.extend(self.predicted(&row, stride));
                    }
                    chunks.push([self.compressed(&chunk), self.padding.clone()].concat());
                }
            }
        }
        self.assemble(&chunks)
    }

    fn number(&self, value: u64, len: usize) -> Vec<u8> {
        let mut bytes = value.to_le_bytes()[..len].to_vec();
        if self.big_endian {
            bytes.reverse();
        }
        bytes
    }

    /// The bits of a sample.
    fn pattern(&self, value: f64) -> u64 {
        match (self.format, self.bits) {
            (1, _) => value as u64,
            (2, bits) => value as i64 as u64 & (u64::MAX >> (64 - bits)),
            (_, 16) => u64::from(half::f16::from_f64(value).to_bits()),
            (_, 32) => u64::from((value as f32).to_bits()),
            _ => value.to_bits(),
        }
    }

    fn predicted(&self, row: &[f64], bands: usize) -> Vec<u8> {
        let len = usize::from(self.bits) / 8;
        let patterns: Vec<u64> = row.iter().map(|&value| self.pattern(value)).collect();
        match self.predictor {
            1 if !matches!(self.bits, 8 | 16 | 32 | 64) => packed(&patterns, self.bits),
            1 => patterns.iter().flat_map(|&p| self.number(p, len)).collect(),
            2 => (0..patterns.len())
                .map(|i| patterns[i].wrapping_sub(if i < bands { 0 } else { patterns[i - bands] }))
                .flat_map(|p| self.number(p, len))
                .collect(),
            _ => {
                // All most significant bytes first, then differences of bytes.
                let planes = (0..len).rev().flat_map(|byte| patterns.iter().map(move |p| (p >> (8 * byte)) as u8));
                let planes: Vec<u8> = planes.collect();
                (0..planes.len())
                    .map(|k| planes[k].wrapping_sub(if k < bands { 0 } else { planes[k - bands] }))
                    .collect()
            }
        }
    }

    fn compressed(&self, bytes: &[u8]) -> Vec<u8> {
        match self.compression {
            LZW => lzw(bytes),
            DEFLATE => {
                let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                encoder.write_all(bytes).unwrap();
                encoder.finish().unwrap()
            }
            PACK_BITS => bytes
                .chunks(128)
                .flat_map(|run| std::iter::once(run.len() as u8 - 1).chain(run.iter().copied()))
                .collect(),
            ZSTD if self.checksum => {
                let mut compressor = zstd::bulk::Compressor::new(3).unwrap();
                compressor.include_checksum(true).unwrap();
                compressor.compress(bytes).unwrap()
            }
            ZSTD => {
                // One frame of known size, one raw block.
                let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
                frame.extend((bytes.len() as u32).to_le_bytes());
                frame.extend(&((bytes.len() as u32) << 3 | 1).to_le_bytes()[..3]);
                frame.extend(bytes);
                frame
            }
            _ => bytes.to_vec(),
        }
    }

    fn assemble(&self, chunks: &[Vec<u8>]) -> Vec<u8> {
        let [w, h] = self.size.map(|n| n as u64);
        let photometric = if self.bands == 1 { 1 } else { 2 };
        let mut tags = vec![
            (256, Tag::Long(vec![w])),
            (257, Tag::Long(vec![h])),
            (258, Tag::Short(vec![self.bits; self.bands])),
            (259, Tag::Short(vec![self.compression])),
            (262, Tag::Short(vec![photometric])),
            (277, Tag::Short(vec![self.bands as u16])),
            (317, Tag::Short(vec![self.predictor])),
            (284, Tag::Short(vec![if self.planar { 2 } else { 1 }])),
            (339, Tag::Short(vec![self.format; self.bands])),
        ];
        let header = if self.big_tiff { 16 } else { 8 };
        let mut offsets = Vec::new();
        let mut data = Vec::new();
        for chunk in chunks {
            offsets.push((self.base + header + data.len()) as u64);
            data.extend(chunk);
        }
        let counts = chunks.iter().map(|chunk| chunk.len() as u64).collect();
        match self.tile {
            Some([cw, ch]) => tags.extend([
                (322, Tag::Short(vec![cw as u16])),
                (323, Tag::Short(vec![ch as u16])),
                (324, Tag::Long(offsets)),
                (325, Tag::Long(counts)),
            ]),
            None => tags.extend([(273, Tag::Long(offsets)), (278, Tag::Short(vec![2])), (279, Tag::Long(counts))]),
        }
        tags.extend(self.tags.iter().cloned());
        tags.sort_by_key(|(tag, _)| *tag);
        self.write(&tags, &data, header)
    }

    fn write(&self, tags: &[(u16, Tag)], data: &[u8], header: usize) -> Vec<u8> {
        let word = if self.big_tiff { 8 } else { 4 };
        let mut bytes = if self.big_endian { b"MM".to_vec() } else { b"II".to_vec() };
        if self.big_tiff {
            bytes.extend([self.number(43, 2), self.number(8, 2), self.number(0, 2)].concat());
        } else {
            bytes.extend(self.number(42, 2));
        }
        let directory = self.base + header + data.len();
        bytes.extend(self.number(directory as u64, word));
        bytes.extend(data);
        let count_len = if self.big_tiff { 8 } else { 2 };
        let mut extra = directory + count_len + tags.len() * (4 + 2 * word) + word;
        bytes.extend(self.number(tags.len() as u64, count_len));
        let mut tail = Vec::new();
        for (tag, value) in tags {
            let (kind, count, mut payload) = self.payload(value);
            bytes.extend([self.number(u64::from(*tag), 2), self.number(kind, 2), self.number(count, word)].concat());
            if payload.len() > word {
                bytes.extend(self.number(extra as u64, word));
                extra += payload.len();
                tail.extend(payload);
            } else {
                payload.resize(word, 0);
                bytes.extend(payload);
            }
        }
        bytes.extend(self.number(0, word));
        bytes.extend(tail);
        bytes
    }

    fn payload(&self, value: &Tag) -> (u64, u64, Vec<u8>) {
        match value {
            Tag::Short(v) => (3, v.len() as u64, v.iter().flat_map(|&n| self.number(u64::from(n), 2)).collect()),
            Tag::Long(v) => (4, v.len() as u64, v.iter().flat_map(|&n| self.number(n, 4)).collect()),
            Tag::Double(v) => (12, v.len() as u64, v.iter().flat_map(|&n| self.number(n.to_bits(), 8)).collect()),
            Tag::Text(v) => (2, v.len() as u64 + 1, [v.as_bytes(), &[0]].concat()),
        }
    }
}

/// The same file with a further image: `first` and then this one, whose `base` is the first one's length. Both little-endian.
pub fn chained(first: &[u8], next: &[u8]) -> Vec<u8> {
    let mut bytes = [first, next].concat();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (mut end, pointer) = (number(4) as usize, number(first.len() + 4));
    // The last directory of the first file ends with the position of the next one.
    loop {
        let entries = usize::from(u16::from_le_bytes(bytes[end..end + 2].try_into().unwrap()));
        let at = end + 2 + 12 * entries;
        match number(at) {
            0 => {
                bytes[at..at + 4].copy_from_slice(&pointer.to_le_bytes());
                return bytes;
            }
            second_target => end = second_target as usize,
        }
    }
}

/// Numbers of some bits, the highest first, and the rest of the last byte.
fn packed(patterns: &[u64], bits: u16) -> Vec<u8> {
    let all: Vec<u8> = patterns.iter().flat_map(|p| (0..bits).rev().map(move |bit| (p >> bit & 1) as u8)).collect();
    all.chunks(8).map(|eight| (0..8).fold(0, |byte, k| byte << 1 | eight.get(k).copied().unwrap_or(0))).collect()
}

/// LZW that never grows its codes: a clear code before each 100 literals.
fn lzw(bytes: &[u8]) -> Vec<u8> {
    const CLEAR: u32 = 256;
    const END: u32 = 257;
    let groups = bytes.chunks(100).flat_map(|g| std::iter::once(CLEAR).chain(g.iter().map(|&b| u32::from(b))));
    let (mut out, mut bits, mut held) = (Vec::new(), 0, 0u32);
    for code in groups.chain([END]) {
        held = held << 9 | code;
        bits += 9;
        while bits >= 8 {
            bits -= 8;
            out.push((held >> bits) as u8);
            held &= (1 << bits) - 1;
        }
    }
    out.push((held << (8 - bits)) as u8);
    out
}
