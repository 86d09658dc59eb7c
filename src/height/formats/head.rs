//! The beginning of a file, by which its format is detected.

use super::text;

/// Bytes read from the beginning of a file to detect its format.
pub(super) const HEAD_BYTES: u64 = 4096;

/// The beginning of a file, and all other facts that detect its format.
pub(super) struct Head<'a> {
    /// The first bytes, at most [`HEAD_BYTES`].
    pub bytes: &'a [u8],
    /// Bytes of the whole file.
    pub len: u64,
    /// True if a `.hdr` lies beside the file.
    pub has_header: bool,
    /// True if the caller states the layout of bare samples.
    pub is_raw: bool,
    /// The bytes as text in lower case after a byte order mark; empty if they hold a zero byte.
    text: String,
    /// True if the text begins with an XML declaration.
    pub is_xml: bool,
    /// Bytes of the text before its first word, an XML declaration included.
    start: usize,
}

impl<'a> Head<'a> {
    /// Reads the beginning of a file of `len` bytes.
    pub fn new(bytes: &'a [u8], len: u64, has_header: bool) -> Self {
        let text = match bytes.contains(&0) {
            true => String::new(),
            false => String::from_utf8_lossy(text::without_mark(bytes)).to_ascii_lowercase(),
        };
        let trimmed = text.trim_start();
        let is_xml = trimmed.starts_with("<?xml");
        let rest = if is_xml { trimmed.split_once("?>").map_or("", |(_, rest)| rest).trim_start() } else { trimmed };
        let start = text.len() - rest.len();
        Self { bytes, len, has_header, is_raw: false, text, is_xml, start }
    }

    /// Returns the bytes after a byte order mark.
    pub fn unmarked(&self) -> &[u8] {
        text::without_mark(self.bytes)
    }

    /// Returns true if the text begins with a word, given in lower case.
    pub fn begins(&self, word: &str) -> bool {
        self.text[self.start..].starts_with(word)
    }

    /// Returns true if the text contains a word, given in lower case.
    pub fn says(&self, word: &str) -> bool {
        self.text[self.start..].contains(word)
    }

    /// Returns true if every line after a title and comments has three numbers.
    pub fn is_xyz(&self) -> bool {
        let whole = self.text.rsplit_once('\n').map_or(self.text.as_str(), |(whole, _)| whole);
        let lines = whole.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(['#', '/']));
        let is_point = |line: &str| {
            let words = || line.split([' ', '\t', ',', ';']).filter(|word| !word.is_empty());
            words().count() >= 3 && words().take(3).all(|word| word.parse::<f64>().is_ok())
        };
        let mut lines = lines.skip_while(|line| line.starts_with(char::is_alphabetic)).take(8).peekable();
        lines.peek().is_some() && lines.all(is_point)
    }
}
