//! The layout of bare samples, as on the command line.

use std::str::FromStr;

use super::sample::{Order, SampleType};

/// Size and sample type of a file of bare samples: `WxH:u16le`, `u16be`, `i16le`, `i16be`, `f32le`, `f32be`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Samples along (x, z).
    pub size: [u32; 2],
    /// Type of a sample.
    pub sample: SampleType,
    /// Order of its bytes.
    pub order: Order,
}

impl FromStr for RawLayout {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected WxH:u16le|u16be|i16le|i16be|f32le|f32be, found {text:?}");
        let (size, code) = text.split_once(':').ok_or_else(wrong)?;
        let (w, h) = size.split_once('x').ok_or_else(wrong)?;
        let side = |text: &str| text.parse::<u32>().map_err(|_| wrong());
        let (sample, order) = match code {
            "u16le" => (SampleType::U16, Order::Little),
            "u16be" => (SampleType::U16, Order::Big),
            "i16le" => (SampleType::I16, Order::Little),
            "i16be" => (SampleType::I16, Order::Big),
            "f32le" => (SampleType::F32, Order::Little),
            "f32be" => (SampleType::F32, Order::Big),
            _ => return Err(wrong()),
        };
        Ok(Self { size: [side(w)?, side(h)?], sample, order })
    }
}
