//! Rows of a TIFF's samples: prediction undone, and samples of any width turned into numbers of whole bytes.

use crate::height::formats::sample::{Order, SampleType};

/// The layout of samples within the bytes of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packing {
    /// The type that samples become: the next one of whole bytes.
    pub sample: SampleType,
    /// Name of the type in the file.
    pub kind: char,
    /// Bits a sample.
    pub bits: usize,
    /// Samples from one pixel to the next.
    pub stride: usize,
    order: Order,
    predictor: Predictor,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Predictor {
    None,
    /// Differences of neighbouring samples of a band.
    Horizontal,
    /// Bytes of equal significance together, as differences.
    FloatingPoint,
}

impl Packing {
    /// A packing, or the tags at fault and what was expected.
    pub fn new(
        format: u64,
        bits: u64,
        order: Order,
        stride: usize,
        predictor: u64,
    ) -> Result<Self, (&'static str, &'static str)> {
        let (kind, sample) = match (format, bits) {
            (1, 1..=8) => ('u', SampleType::U8),
            (2, 1..=8) => ('i', SampleType::I8),
            (1, 9..=16) => ('u', SampleType::U16),
            (2, 9..=16) => ('i', SampleType::I16),
            (1, 17..=32) => ('u', SampleType::U32),
            (2, 17..=32) => ('i', SampleType::I32),
            (1, 64) => ('u', SampleType::U64),
            (2, 64) => ('i', SampleType::I64),
            (3, 16) => ('f', SampleType::F16),
            (3, 24 | 32) => ('f', SampleType::F32),
            (3, 64) => ('f', SampleType::F64),
            _ => {
                let what = "expected integers of 1 to 32 or 64 bits or floats of 16, 24, 32 or 64";
                return Err(("BitsPerSample, SampleFormat", what));
            }
        };
        let predictor = match (predictor, format, bits) {
            (1, ..) => Predictor::None,
            (2, _, 8 | 16 | 32 | 64) => Predictor::Horizontal,
            (3, 3, _) => Predictor::FloatingPoint,
            (2, ..) => return Err(("Predictor", "expected samples of 8, 16, 32 or 64 bits for predictor 2")),
            (3, ..) => return Err(("Predictor", "expected floats for predictor 3")),
            _ => return Err(("Predictor", "expected predictor 1, 2 or 3")),
        };
        Ok(Self { sample, kind, bits: bits as usize, stride, order, predictor })
    }

    /// Name of the type in the file, as in `u12`.
    pub fn name(&self) -> String {
        format!("{}{}", self.kind, self.bits)
    }

    /// Bits from one pixel to the next.
    pub fn pixel_bits(&self) -> usize {
        self.bits * self.stride
    }

    /// Undoes prediction and brings samples of whole bytes into little-endian order.
    pub fn decode(&self, row: &mut [u8]) {
        let bytes = self.bits / 8;
        if self.predictor == Predictor::FloatingPoint {
            return gather(row, self.stride, bytes);
        }
        if self.order == Order::Big && self.bits.is_multiple_of(8) {
            row.chunks_exact_mut(bytes).for_each(<[u8]>::reverse);
        }
        if self.predictor == Predictor::Horizontal {
            match bytes {
                1 => accumulate::<1>(row, self.stride),
                2 => accumulate::<2>(row, self.stride),
                4 => accumulate::<4>(row, self.stride),
                _ => accumulate::<8>(row, self.stride),
            }
        }
    }

    /// Returns true where decoded rows need no extraction: one band of whole bytes.
    pub fn is_plain(&self) -> bool {
        self.stride == 1 && self.bits == 8 * self.sample.bytes()
    }

    /// Appends `count` samples of a band of a decoded row as little-endian numbers of [`Self::sample`].
    pub fn extract(&self, row: &[u8], band: usize, count: usize, samples: &mut Vec<u8>) {
        let (bits, bytes, pixel) = (self.bits, self.sample.bytes(), self.pixel_bits());
        for at in (0..count).map(|i| i * pixel + band * bits) {
            if bits == 8 * bytes {
                samples.extend(&row[at / 8..at / 8 + bytes]);
            } else {
                let number = match self.kind {
                    'f' => u64::from(triple(little(&row[at / 8..at / 8 + 3]) as u32).to_bits()),
                    // Integers of 24 bits too have their highest bits first where the file is little-endian: so GDAL writes.
                    _ => bits_at(row, at, bits),
                };
                let shift = 64 - bits;
                let is_signed = self.kind == 'i';
                let number = if is_signed { ((number << shift) as i64 >> shift) as u64 } else { number };
                samples.extend(&number.to_le_bytes()[..bytes]);
            }
        }
    }
}

/// Turns differences of neighbouring pixels into numbers of `N` bytes.
fn accumulate<const N: usize>(row: &mut [u8], stride: usize) {
    let numbers = row.as_chunks_mut::<N>().0;
    for k in stride..numbers.len() {
        let sum = little(&numbers[k]).wrapping_add(little(&numbers[k - stride]));
        numbers[k].copy_from_slice(&sum.to_le_bytes()[..N]);
    }
}

/// Turns differences of bytes, the most significant of all samples first, into samples.
fn gather(row: &mut [u8], stride: usize, bytes: usize) {
    for k in stride..row.len() {
        row[k] = row[k].wrapping_add(row[k - stride]);
    }
    let planes = row.to_vec();
    let count = row.len() / bytes;
    for (k, sample) in row.chunks_exact_mut(bytes).enumerate() {
        for (byte, to) in sample.iter_mut().enumerate() {
            *to = planes[(bytes - 1 - byte) * count + k];
        }
    }
}

#[inline]
fn little(bytes: &[u8]) -> u64 {
    let mut wide = [0; 8];
    wide[..bytes.len()].copy_from_slice(bytes);
    u64::from_le_bytes(wide)
}

/// A number of up to 32 bits, the highest first, at a bit of a row.
fn bits_at(row: &[u8], at: usize, bits: usize) -> u64 {
    let last = (at + bits).div_ceil(8);
    let number = row[at / 8..last].iter().fold(0u64, |number, &byte| number << 8 | u64::from(byte));
    number >> (8 * last - at - bits) & (u64::MAX >> (64 - bits))
}

/// A float of 24 bits as GDAL writes it: 7 bits of exponent biased by 63, 16 of fraction.
fn triple(bits: u32) -> f32 {
    let (sign, exponent, fraction) = (bits >> 23 & 1, bits >> 16 & 0x7f, bits & 0xffff);
    let magnitude = match exponent {
        // Below 2^-62 a float has no leading one.
        0 => (f64::from(fraction) / 65536.0 * 2f64.powi(-62)) as f32,
        0x7f => f32::from_bits(0xff << 23 | fraction << 7),
        _ => f32::from_bits((exponent + 127 - 63) << 23 | fraction << 7),
    };
    if sign == 0 { magnitude } else { -magnitude }
}
