//! Mutations of bytes and texts that break readers: bits, sizes, lengths, repeated and missing parts.

use fastrand::Rng;

/// Numbers at the limits of integer types.
const EDGES: [u64; 13] =
    [0, 1, 2, 0x7f, 0x80, 0xff, 0x7fff, 0x8000, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, u64::MAX];

/// Texts in place of numbers.
pub const WORDS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "infinity",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "",
    " ",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "9223372036854775808",
    "0x10",
    "1,2",
    "ü",
];

/// Returns one of several values.
pub fn one<'a, T>(random: &mut Rng, of: &'a [T]) -> &'a T {
    &of[random.usize(..of.len())]
}

/// Applies a few mutations at random places.
pub fn bytes(random: &mut Rng, bytes: &mut Vec<u8>, other: &[u8]) {
    for _ in 0..random.usize(1..5) {
        let at = random.usize(..=bytes.len());
        let length = random.usize(..=(bytes.len() - at).min(64));
        match random.u8(..8) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..at + length)),
            2 => bytes.splice(at..at, bytes[at..at + length].to_vec()).for_each(drop),
            3 => {
                let from = random.usize(..=other.len());
                let to = (from + random.usize(..64)).min(other.len());
                bytes.splice(at..at + length, other[from..to].iter().copied()).for_each(drop);
            }
            4 => number(random, bytes, at),
            5 => word(random, bytes, at),
            _ if at < bytes.len() => bytes[at] ^= 1 << random.u8(..8),
            _ => bytes.push(random.u8(..)),
        }
    }
}

/// Writes a limit of 1 to 8 bytes at a place, in either byte order.
fn number(random: &mut Rng, bytes: &mut [u8], at: usize) {
    let width = 1 << random.usize(..4);
    let value = one(random, &EDGES).wrapping_add(random.u64(..3)).to_le_bytes();
    let mut value = value[..width].to_vec();
    if random.bool() {
        value.reverse();
    }
    bytes.iter_mut().skip(at).zip(value).for_each(|(byte, new)| *byte = new);
}

/// Replaces the next decimal number by a word.
fn word(random: &mut Rng, bytes: &mut Vec<u8>, at: usize) {
    let is_number = |byte: &u8| byte.is_ascii_digit() || b"+-.".contains(byte);
    let Some(from) = bytes[at..].iter().position(is_number).map(|k| at + k) else { return };
    let length = bytes[from..].iter().take_while(|byte| is_number(byte)).count();
    bytes.splice(from..from + length, one(random, &WORDS).bytes()).for_each(drop);
}
