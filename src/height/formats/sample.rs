//! The number types of stored samples.

use half::f16;

use crate::height::samples::Samples;

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
}

impl Order {
    /// The machine's order.
    pub const NATIVE: Order = if cfg!(target_endian = "big") { Order::Big } else { Order::Little };

    fn native<const N: usize>(self, mut bytes: [u8; N]) -> [u8; N] {
        if self != Order::NATIVE {
            bytes.reverse();
        }
        bytes
    }
}

/// Type of a stored sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 8 bits.
    I8,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 64 bits; heights are the nearest f32.
    U64,
    /// Signed, 64 bits; heights are the nearest f32.
    I64,
    /// Floating point, 16 bits.
    F16,
    /// Floating point, 32 bits.
    F32,
    /// Floating point, 64 bits; heights are the nearest f32.
    F64,
}

impl SampleType {
    /// Returns the bytes of a sample.
    pub fn bytes(self) -> usize {
        match self {
            SampleType::U8 | SampleType::I8 => 1,
            SampleType::U16 | SampleType::I16 | SampleType::F16 => 2,
            SampleType::U32 | SampleType::I32 | SampleType::F32 => 4,
            SampleType::U64 | SampleType::I64 | SampleType::F64 => 8,
        }
    }

    /// Returns the name of the type, as in Rust.
    pub fn name(self) -> &'static str {
        match self {
            SampleType::U8 => "u8",
            SampleType::I8 => "i8",
            SampleType::U16 => "u16",
            SampleType::I16 => "i16",
            SampleType::U32 => "u32",
            SampleType::I32 => "i32",
            SampleType::U64 => "u64",
            SampleType::I64 => "i64",
            SampleType::F16 => "f16",
            SampleType::F32 => "f32",
            SampleType::F64 => "f64",
        }
    }

    /// Returns `len` samples that can hold this type: codes for up to 16 bits, f32 for more.
    pub(super) fn blank(self, len: usize) -> Samples {
        let coded = |zero| Samples::Coded { codes: vec![0; len], zero, scale: 1.0 };
        match self {
            SampleType::U8 | SampleType::U16 => coded(0.0),
            SampleType::I8 => coded(128.0),
            SampleType::I16 => coded(32768.0),
            _ => Samples::F32(vec![0.0; len]),
        }
    }

    /// Stores the numbers in `bytes` as samples `at..` of what `blank` made.
    pub(super) fn store(self, order: Order, bytes: &[u8], samples: &mut Samples, at: usize) {
        match samples {
            Samples::Coded { codes, .. } => self.store_codes(order, bytes, &mut codes[at..]),
            Samples::F32(heights) => self.store_heights(order, bytes, &mut heights[at..]),
        }
    }

    fn store_codes(self, order: Order, bytes: &[u8], codes: &mut [u16]) {
        let sign = match self {
            SampleType::I8 => 0x80,
            SampleType::I16 => 0x8000,
            _ => 0,
        };
        if self.bytes() == 1 {
            codes.iter_mut().zip(bytes).for_each(|(code, &b)| *code = u16::from(b) ^ sign);
        } else {
            let words = bytes.as_chunks().0.iter();
            codes.iter_mut().zip(words).for_each(|(code, &b)| *code = u16::from_ne_bytes(order.native(b)) ^ sign);
        }
    }

    fn store_heights(self, order: Order, bytes: &[u8], heights: &mut [f32]) {
        fn each<const N: usize>(bytes: &[u8], heights: &mut [f32], number: impl Fn([u8; N]) -> f32) {
            heights.iter_mut().zip(bytes.as_chunks().0).for_each(|(height, &b)| *height = number(b));
        }
        match self {
            SampleType::U32 => each(bytes, heights, |b| u32::from_ne_bytes(order.native(b)) as f32),
            SampleType::I32 => each(bytes, heights, |b| i32::from_ne_bytes(order.native(b)) as f32),
            SampleType::U64 => each(bytes, heights, |b| u64::from_ne_bytes(order.native(b)) as f32),
            SampleType::I64 => each(bytes, heights, |b| i64::from_ne_bytes(order.native(b)) as f32),
            SampleType::F16 => each(bytes, heights, |b| f16::from_ne_bytes(order.native(b)).to_f32()),
            SampleType::F64 => each(bytes, heights, |b| f64::from_ne_bytes(order.native(b)) as f32),
            _ => each(bytes, heights, |b| f32::from_ne_bytes(order.native(b))),
        }
    }
}
