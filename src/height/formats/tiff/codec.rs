//! The compressions of TIFF: each chunk is unpacked to its end, so that every checksum it has is compared.

use flate2::{Decompress, FlushDecompress, Status};
use weezl::{BitOrder, LzwStatus, decode::Configuration};

/// A compression that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Codec {
    None,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
}

/// Names of the other compressions in use.
const OTHERS: [(u64, &str); 19] = [
    (2, "CCITT RLE"),
    (3, "CCITT group 3"),
    (4, "CCITT group 4"),
    (6, "JPEG (old)"),
    (7, "JPEG"),
    (34661, "JBIG"),
    (34676, "SGI LogLuv"),
    (34677, "SGI LogLuv"),
    (34712, "JPEG 2000"),
    (34887, "LERC"),
    (34892, "JPEG (lossy DNG)"),
    (34925, "LZMA"),
    (34926, "ZSTD (early code)"),
    (34927, "WebP (early code)"),
    (34933, "PNG"),
    (34934, "JPEG XR"),
    (50001, "WebP"),
    (50002, "JPEG XL"),
    (52546, "JPEG XL"),
];

/// Bytes after the end of a chunk's data that align the next chunk.
const PADDING: usize = 3;

impl Codec {
    /// The codec of a compression code, or what was expected.
    pub fn of(code: u64) -> Result<Self, String> {
        match code {
            1 => Ok(Codec::None),
            5 => Ok(Codec::Lzw),
            8 | 32946 => Ok(Codec::Deflate),
            32773 => Ok(Codec::PackBits),
            50000 => Ok(Codec::Zstd),
            _ => {
                let found = OTHERS.iter().find(|(other, _)| *other == code).map_or("an unknown one", |(_, name)| name);
                Err(format!("expected none, LZW, Deflate, ZSTD or PackBits, found {found} (code {code})"))
            }
        }
    }

    /// Returns the most bytes that a byte can expand to: 128 of 2 in PackBits, 258 of 2 bits in Deflate, a string of all codes of
    /// 12 bits in LZW, a block of 128 KiB of 4 bytes in ZSTD.
    pub fn expansion(self) -> u64 {
        match self {
            Codec::None => 1,
            Codec::PackBits => 64,
            Codec::Deflate => 1032,
            Codec::Lzw => 4096,
            Codec::Zstd => 1 << 15,
        }
    }

    /// The data of a chunk, `min` to `max` bytes. Fewer, more, and bytes after their end are errors.
    ///
    /// Deflate has an Adler-32, which is compared; ZSTD may have an XXH64, which is too. The others have no checksum.
    pub fn unpack(self, packed: Vec<u8>, min: usize, max: usize) -> Result<Vec<u8>, String> {
        let (bytes, rest) = match self {
            Codec::None => {
                let used = packed.len().min(max);
                let (rest, mut bytes) = (packed[used..].to_vec(), packed);
                bytes.truncate(used);
                (bytes, rest)
            }
            Codec::Lzw => (lzw(&packed, max)?, Vec::new()),
            Codec::Deflate => inflate(&packed, max)?,
            Codec::PackBits => pack_bits(&packed, max)?,
            Codec::Zstd => (unzstd(&packed, max)?, Vec::new()),
        };
        if bytes.len() < min {
            return Err(format!("expected {min} bytes, found the end of the data after {}", bytes.len()));
        }
        if rest.len() > PADDING || rest.iter().any(|&byte| byte != 0) {
            return Err(format!("expected the end of the data, found {} more bytes", rest.len()));
        }
        Ok(bytes)
    }
}

/// Unpacks a zlib stream; returns what follows it too.
fn inflate(packed: &[u8], max: usize) -> Result<(Vec<u8>, Vec<u8>), String> {
    let mut stream = Decompress::new(true);
    // A byte more than expected shows data that go on.
    let mut bytes = Vec::with_capacity(max + 1);
    let status = stream.decompress_vec(packed, &mut bytes, FlushDecompress::Finish).map_err(|e| e.to_string())?;
    match status {
        Status::StreamEnd => Ok((bytes, packed[stream.total_in() as usize..].to_vec())),
        _ if bytes.len() > max => Err(format!("expected at most {max} bytes, found more")),
        _ => Err(format!("expected the end of a zlib stream, found the end of the data after {} bytes", bytes.len())),
    }
}

/// Unpacks the frames of ZSTD, which must end where the data do.
fn unzstd(packed: &[u8], max: usize) -> Result<Vec<u8>, String> {
    zstd::bulk::decompress(packed, max).map_err(|e| format!("expected whole ZSTD frames of at most {max} bytes: {e}"))
}

/// Unpacks LZW. Writers may leave out the end code, or write it a bit too short where the code width changes: data that
/// fill the chunk are complete without it.
fn lzw(packed: &[u8], max: usize) -> Result<Vec<u8>, String> {
    // The last codes and the end code: at most 12 bits each, and the rest of a byte.
    const END_BYTES: usize = 4;
    let mut decoder = Configuration::with_tiff_size_switch(BitOrder::Msb, 8).with_yield_on_full_buffer(true).build();
    let (mut bytes, mut used, mut filled) = (vec![0; max], 0, 0);
    while filled < max {
        let step = decoder.decode_bytes(&packed[used..], &mut bytes[filled..]);
        (used, filled) = (used + step.consumed_in, filled + step.consumed_out);
        match step.status {
            Ok(LzwStatus::Ok) => {}
            Ok(LzwStatus::Done | LzwStatus::NoProgress) => break,
            Err(e) => return Err(e.to_string()),
        }
    }
    if packed.len() - used > END_BYTES {
        return Err(format!("expected the end of the data, found {} more bytes", packed.len() - used));
    }
    bytes.truncate(filled);
    Ok(bytes)
}

/// Unpacks runs and literals; returns what follows them too.
fn pack_bits(packed: &[u8], max: usize) -> Result<(Vec<u8>, Vec<u8>), String> {
    let (mut bytes, mut rest) = (Vec::with_capacity(max), packed);
    while bytes.len() < max
        && let Some((&head, tail)) = rest.split_first()
    {
        let (run, literal) = (head & 0x80 != 0, usize::from(head) + 1);
        rest = match (head, tail) {
            // No operation.
            (0x80, _) => tail,
            (_, &[byte, ref tail @ ..]) if run => {
                bytes.resize(bytes.len() + 257 - usize::from(head), byte);
                tail
            }
            _ if !run && tail.len() >= literal => {
                bytes.extend(&tail[..literal]);
                &tail[literal..]
            }
            _ => return Err("expected a run or literal bytes, found the end of the data".to_owned()),
        };
    }
    if bytes.len() > max {
        return Err(format!("expected at most {max} bytes, found {}", bytes.len()));
    }
    Ok((bytes, rest.to_vec()))
}
