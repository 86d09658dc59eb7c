//! Any bytes, read as a height file: `cargo +nightly fuzz run load fuzz/corpus/load fuzz/seeds`.
//!
//! The first byte chooses the wishes; a `0xff 'H'` later on ends the data and begins a header beside it.
//! `cargo test --release -- --ignored write_seeds` writes the seeds.
#![no_main]

use cuesta::internal::height::{Options, load_bytes_with};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let Some((&wish, bytes)) = input.split_first() else { return };
    let (bytes, hdr) = match bytes.windows(2).position(|pair| pair == [0xff, b'H']) {
        Some(at) => (&bytes[..at], Some(&bytes[at + 2..])),
        None => (bytes, None),
    };
    let options = Options {
        raw: (wish & 1 != 0).then(|| "5x4:u16be".parse().expect("a layout")),
        encoding: (wish & 2 != 0).then(|| "mapbox".parse().expect("an encoding")),
        crop: (wish & 4 != 0).then_some([1, 1, 3, 2]),
        nodata: (wish & 8 != 0).then_some(23.0),
        max_samples: 1 << 16,
        ..Options::default()
    };
    let siblings = |extension: &str| hdr.filter(|_| extension == "hdr").map(<[u8]>::to_vec);
    if let Ok(loaded) = load_bytes_with("fuzz", bytes, &siblings, &options) {
        let [w, h] = loaded.field.size();
        assert!((0..h).all(|j| (0..w).all(|i| loaded.field.height(i, j).is_finite())));
    }
});
