//! Plain messages for damaged and incomplete files, in place of those of the decoders.

/// Parts of decoders' messages, and the messages that replace them.
const REPLACED: [(&[&str], &str); 4] = [
    // `std::io`, `png`, `flate2` and `zip` on files that end too early.
    (
        &[
            "failed to fill whole buffer",
            "unexpected end of file",
            "incomplete deflate stream",
            "Could not find EOCD",
            "Unexpected end of zip",
        ],
        "expected more data, found the end of the file: it is incomplete",
    ),
    // `png`, `flate2` and `zip` on other bytes than were written.
    (
        &["CRC error", "WrongChecksum", "Invalid checksum", "matching checksum"],
        "expected undamaged data, found a wrong checksum",
    ),
    (&["orrupt deflate stream"], "expected undamaged data, found compressed data that cannot be unpacked"),
    (&["invalid Zip archive"], "expected an undamaged zip file, found one whose directory cannot be read"),
];

/// Returns a message with the phrases of decoders replaced by what they mean to the user of the file.
pub fn in_plain_words(message: String) -> String {
    let replaced = REPLACED.iter().find(|(parts, _)| parts.iter().any(|part| message.contains(part)));
    replaced.map_or(message, |(_, plain)| plain.to_string())
}
