//! Words of a text file, read one after the other.

use std::io;

use super::input::Input;
use super::text::without_mark;
use crate::height::error::Error;

/// Most bytes of a word; no number or key is longer.
const WORD_BYTES: usize = 256;

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
