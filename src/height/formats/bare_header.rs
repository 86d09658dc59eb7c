//! Headers beside bare samples: their content, and their values with errors.

use std::collections::BTreeMap;

use super::georeference::Georeference;
use super::sample::{Order, SampleType};
use super::text;
use crate::height::error::Error;

/// The content of a header.
pub(super) struct Header {
    /// Name of the format, if other than that of the row.
    pub variant: Option<&'static str>,
    pub size: [u64; 2],
    pub sample: SampleType,
    pub order: Order,
    /// Bytes before the first row.
    pub start: u64,
    /// Bytes from one row to the next, if not those of its samples.
    pub stride: Option<u64>,
    /// The text that declares the value for "no data".
    pub nodata: Option<String>,
    /// Position, system and scale.
    pub georeference: Georeference,
}

/// The values of a header, with errors that name the key.
pub(super) struct Values<'a> {
    /// The data file.
    pub name: &'a str,
    pub values: BTreeMap<String, String>,
}

impl Values<'_> {
    pub fn text(&self, key: &str) -> Option<&str> {
        self.values.get(key).map(String::as_str)
    }

    pub fn error(&self, key: &str, what: impl ToString) -> Error {
        Error::new(self.name, format!("header {key}"), what)
    }

    pub fn number<T: std::str::FromStr>(&self, key: &str) -> Result<Option<T>, Error> {
        let wrong = |text| self.error(key, format!("expected a number in range, found {text:?}"));
        let parse = |text: &str| text.parse().ok().or_else(|| text::number(text)?.to_string().parse().ok());
        self.text(key).map(|text| parse(text).ok_or_else(|| wrong(text))).transpose()
    }

    pub fn required<T: std::str::FromStr>(&self, key: &str) -> Result<T, Error> {
        self.number(key)?.ok_or_else(|| self.error(key, "expected a number, found none"))
    }
}
