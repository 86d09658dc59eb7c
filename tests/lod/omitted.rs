//! Techniques omit data that a field does not need, and draw the same without it.

use std::sync::Arc;

use cuesta::internal::height::{Field, Holes, Samples, synth};
use cuesta::internal::lod::{self, Settings};

fn prepared(field: &Arc<Field>, name: &str, setting: (&str, &str)) -> Box<dyn lod::Technique> {
    let entry = lod::find(name).unwrap();
    let settings = Settings::new(entry, None, &[(setting.0.into(), setting.1.into())]).unwrap();
    entry.prepare(field, &settings).unwrap()
}

/// Returns a field folded along z, with folds eight cells apart. It is exact three levels up, and two levels up beside
/// blocks that are coarser still.
fn folded(size: u32) -> Arc<Field> {
    let fold = |n: u32| (n * n % 7) as f32;
    let height = |x: u32| fold(x / 8) + (fold(x / 8 + 1) - fold(x / 8)) * (x % 8) as f32 / 8.0;
    let samples = (0..size * size).map(|k| height(k % size)).collect();
    Arc::new(Field::new(Samples::F32(samples), [size, size], [10.0, 10.0], Holes::none((size * size) as usize)))
}

#[test]
fn unused_indices_are_omitted() {
    let rough = Arc::new(synth::synth(synth::Kind::Fractal, [129, 129], 3));
    let flat = Arc::new(synth::synth(synth::Kind::Flat, [129, 129], 3));
    let tile = Arc::new(synth::synth(synth::Kind::Flat, [33, 33], 3));
    let exact_at_2 = folded(129);
    for (name, setting) in [("geomipmap", ("block", "33")), ("smooth-tiles", ("tile", "33"))] {
        let of = |field| prepared(field, name, setting);
        let indices = |field| of(field).resident().indices.len();
        let named = |field| of(field).omitted().into_iter().map(|s| (s.what, s.reason)).collect::<Vec<_>>();
        assert_eq!(named(&rough), [], "{name}");
        let whole = indices(&rough);
        let [at_2, coarsest, alone] = [&exact_at_2, &flat, &tile].map(indices);
        assert!(
            whole > 2 * at_2 && at_2 > 2 * coarsest && coarsest >= alone && alone > 0,
            "{name}: {whole} {at_2} {coarsest} {alone}"
        );
        assert!(named(&exact_at_2)[0].1.contains("level 2"), "{name}: {:?}", named(&exact_at_2));
        assert_eq!(named(&tile).iter().filter(|(what, _)| *what == "indices of stitched borders").count(), 1, "{name}");
        let omitted: u64 = of(&tile).omitted().iter().map(|s| s.bytes).sum();
        assert_eq!(omitted, 4 * (whole - alone) as u64, "{name}: what was omitted and what is there are the whole");
    }
}
