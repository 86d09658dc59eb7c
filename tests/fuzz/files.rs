//! Height files: small ones of every format, mutated.

use cuesta::internal::height::{Options, load_bytes_with};
use fastrand::Rng;

use super::{fuzz, mutate};
use crate::height::tiny;

/// Separator between the data and the header file.
const HEADER: &[u8] = b"\xffH";
/// Largest number of samples that may be read.
const MAX_SAMPLES: u64 = 1 << 16;

/// Generates two bytes of options, the file, and its header file.
fn seeds() -> Vec<Vec<u8>> {
    let seed = |file: tiny::Tiny| {
        let wishes = [u8::from(file.options.raw.is_some()), u8::from(file.options.encoding.is_some())];
        [&wishes[..], &file.bytes, HEADER, file.hdr.as_deref().unwrap_or_default()].concat()
    };
    tiny::all().into_iter().map(seed).collect()
}

fn options(wishes: [u8; 2]) -> Options {
    let has = |bit: u8| wishes[0] & 1 << bit != 0;
    Options {
        raw: has(0).then(|| "5x4:u16be".parse().expect("a layout")),
        encoding: (wishes[1] & 1 != 0).then(|| "mapbox".parse().expect("an encoding")),
        crop: has(2).then_some([1, 1, 3, 2]),
        nodata: has(3).then_some(23.0),
        spacing: has(4).then_some([1e-3, 1e5]),
        height_scale: has(5).then_some(1e30),
        tiles: has(6).then_some([3, 2]),
        max_samples: MAX_SAMPLES,
        ..Options::default()
    }
}

fn check(input: &[u8]) {
    let [first, second, bytes @ ..] = input else { return };
    let split = bytes.windows(HEADER.len()).rposition(|pair| pair == HEADER);
    let (bytes, hdr) = split.map_or((bytes, None), |at| (&bytes[..at], Some(&bytes[at + HEADER.len()..])));
    let hdr = hdr.filter(|hdr| !hdr.is_empty());
    let siblings = |extension: &str| hdr.filter(|_| extension == "hdr").map(<[u8]>::to_vec);
    match load_bytes_with("fuzzed", bytes, &siblings, &options([*first, *second])) {
        Ok(loaded) => {
            let [w, h] = loaded.field.size();
            assert!(loaded.field.samples().len() as u64 <= MAX_SAMPLES, "{w} x {h} samples");
            assert!((0..h).all(|j| (0..w).all(|i| loaded.field.height(i, j).is_finite())), "a height is no number");
        }
        Err(error) => {
            let error = error.to_string();
            assert!(error.starts_with("fuzzed") && !error.contains('\n'), "{error:?}");
        }
    }
}

#[test]
fn whatever_the_file_a_field_or_one_line() {
    let seeds = seeds();
    let generate = |random: &mut Rng| {
        let (mut input, other) = (mutate::one(random, &seeds).clone(), mutate::one(random, &seeds));
        input[0] ^= if random.u8(..4) == 0 { random.u8(..) & 0xfe } else { 0 };
        mutate::bytes(random, &mut input, other);
        input
    };
    fuzz("files", generate, check);
}
