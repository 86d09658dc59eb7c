//! Words of a text file, read one after the other.

use std::io;

use super::input::Input;
use crate::height::Error;

/// Most bytes of a word; no number or key is longer.
const WORD_BYTES: usize = 256;

/// Returns a text without its UTF-8 byte order mark.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Parses a number; words for "no data" become NaN. A comma may stand for the decimal point, and C runtimes write
/// `1.#QNAN`, `-1.#IND` and `-nan(ind)`.
pub(super) fn number(word: &str) -> Option<f64> {
    if let Ok(number) = word.parse() {
        return Some(number);
    }
    let lower = word.to_ascii_lowercase();
    let unsigned = lower.trim_start_matches(['-', '+']);
    if NONE.contains(&unsigned) || unsigned.starts_with("nan(") || unsigned.starts_with("1.#") {
        return Some(f64::NAN);
    }
    let is_decimal = lower.matches(',').count() == 1 && !lower.contains('.');
    is_decimal.then(|| lower.replace(',', ".").parse().ok())?
}

/// Words that mean "no data", lower case.
const NONE: [&str; 5] = ["null", "none", "na", "n/a", "nodata"];

/// A reader of words between white space that counts lines.
pub(super) struct Words {
    /// Line of the last word, from 1.
    pub line: u64,
    word: String,
    /// True once the first bytes have been read.
    begun: bool,
}

impl Words {
    /// Starts before the first word.
    pub fn new() -> Self {
        Self { line: 1, word: String::new(), begun: false }
    }

    /// Returns the last word.
    pub fn word(&self) -> &str {
        &self.word
    }

    /// Goes to the next word; at the end of the file it is empty, and the result false.
    pub fn next(&mut self, input: &mut Input) -> Result<bool, Error> {
        self.word.clear();
        loop {
            let buffer = match input.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(input.error(format!("line {}", self.line), e)),
            };
            if buffer.is_empty() {
                return Ok(!self.word.is_empty());
            }
            if !std::mem::replace(&mut self.begun, true) {
                let mark = buffer.len() - without_mark(buffer).len();
                input.reader.consume(mark);
                continue;
            }
            let mut used = 0;
            for &byte in buffer {
                if byte.is_ascii_whitespace() && !self.word.is_empty() {
                    break;
                }
                used += 1;
                self.line += u64::from(byte == b'\n');
                if !byte.is_ascii_whitespace() {
                    self.word.push(char::from(byte));
                }
            }
            let ended = used < buffer.len();
            input.reader.consume(used);
            if ended {
                return Ok(true);
            }
            if self.word.len() > WORD_BYTES {
                return Err(input.error(format!("line {}", self.line), "expected numbers, found a very long word"));
            }
        }
    }
}
