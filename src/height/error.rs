//! Errors about height files.

use super::damage::in_plain_words;

/// An error about a file or an option: the file, the field or position in it, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {what}")]
pub struct Error {
    /// The file's name as given.
    pub file: String,
    /// The header field, line, row or byte position at fault.
    pub place: String,
    /// The expected and the found content.
    pub what: String,
}

impl Error {
    /// Makes an error at a place of a file.
    pub fn new(file: impl Into<String>, place: impl Into<String>, what: impl ToString) -> Self {
        Self { file: file.into(), place: place.into(), what: in_plain_words(one_line(what.to_string())) }
    }
}

/// Returns the text with spaces in place of line breaks and other control characters: decoders quote bytes of broken
/// files.
fn one_line(text: String) -> String {
    if text.contains(char::is_control) { text.replace(char::is_control, " ") } else { text }
}
