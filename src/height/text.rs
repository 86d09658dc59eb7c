//! Words of a text file, read as they come.

use std::io;

use super::{Error, load::Source};

/// Words longer than this are no numbers or keys.
const WORD_BYTES: usize = 256;

/// Words between white space, with the line they stand in.
pub(super) struct Words {
    /// Line of the last word, from 1.
    pub line: u64,
    word: String,
}

impl Words {
    /// At the beginning.
    pub fn new() -> Self {
        Self { line: 1, word: String::new() }
    }

    /// The last word.
    pub fn word(&self) -> &str {
        &self.word
    }

    /// Goes to the next word; at the end of the file it is empty, and the result false.
    pub fn next(&mut self, source: &mut Source) -> Result<bool, Error> {
        self.word.clear();
        loop {
            let buffer = match source.reader.fill_buf() {
                Ok(buffer) => buffer,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(source.error(format!("line {}", self.line), e)),
            };
            if buffer.is_empty() {
                return Ok(!self.word.is_empty());
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
            source.reader.consume(used);
            if ended {
                return Ok(true);
            }
            if self.word.len() > WORD_BYTES {
                return Err(source.error(format!("line {}", self.line), "expected numbers, found a very long word"));
            }
        }
    }
}
