//! Checks that settings listed as idle beside others have no effect.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use cuesta::internal::draw::expand;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::height::synth;
use cuesta::internal::lod::{Need, TECHNIQUES, Values};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};

use super::technique;

/// Returns values other than the default.
fn values(values: Values, default: &str) -> Vec<String> {
    let all = match values {
        Values::Words(words) => words.iter().map(|word| word.to_string()).collect(),
        Values::Number(low, high) => vec![low.to_string(), high.min(3.0 * low + 30.0).to_string()],
    };
    all.into_iter().filter(|value| value != default).collect()
}

/// Returns a hash of a technique's triangles for each frame of a flight.
fn flown(name: &str, settings: &[String]) -> Vec<u64> {
    let mut field = synth::synth(synth::Kind::Fractal, [257, 257], 7);
    field.spacing = [10.0, 10.0];
    let field = Arc::new(field);
    let settings: Vec<_> = settings.iter().map(String::as_str).collect();
    let mut technique = technique(&field, name, &settings);
    let frame = |k: u32| {
        let view = View {
            eye: field.world(20 + 2 * k, 30) + glam::DVec3::Y * 80.0,
            world_from_eye: View::turned(40.0 - f64::from(k), -15.0, 0.0),
            lens: Lens::Perspective { fov_x: 1.2 },
            size: [320, 180],
            near: 1.0,
            tolerance: Tolerance { px: 12.0, metric: Metric::Certified },
            time_s: 0.1 * f64::from(k),
        };
        let mut list = cuesta::internal::draw::DrawList::default();
        technique.select(&view, &mut list);
        let (placing, resident) = (Frame::placing(&field, &view), technique.resident());
        let mut hasher = DefaultHasher::new();
        let mut add = |drawn: &expand::Drawn| {
            let corners = drawn.corners.map(|corner| (corner.x, corner.z, corner.y.to_bits()));
            (drawn.instance, corners).hash(&mut hasher);
        };
        expand::visit_triangles(&field, &placing, resident, &list, &mut add);
        expand::skirts(&field, &placing, resident, &list).iter().for_each(add);
        hasher.finish()
    };
    (0..20).map(frame).collect()
}

#[test]
fn idle_settings_have_no_effect() {
    let mut tried = 0;
    for entry in TECHNIQUES {
        let setting = |key: &str| entry.settings.iter().find(|s| s.key == key).expect("one of the entry's settings");
        for Need { key, other, words } in entry.needs {
            let (own, other) = (setting(key), setting(other));
            let Values::Words(all) = other.values else { panic!("{}: words", other.key) };
            assert!(words.iter().all(|word| all.contains(word)), "{key}: {words:?}");
            for word in all.iter().filter(|word| !words.contains(*word)) {
                let beside = format!("{}={word}", other.key);
                let without = flown(entry.name, std::slice::from_ref(&beside));
                for value in values(own.values, own.default) {
                    let with = flown(entry.name, &[beside.clone(), format!("{key}={value}")]);
                    assert!(with == without, "{} {key}={value} {beside}", entry.name);
                    tried += 1;
                }
            }
            // Beside the right word the setting has an effect, except `parts`, which sends the same triangles in parts.
            let beside = format!("{}={}", other.key, words[0]);
            let differs = |value: &String| {
                flown(entry.name, &[beside.clone(), format!("{key}={value}")])
                    != flown(entry.name, std::slice::from_ref(&beside))
            };
            assert!(*key == "parts" || values(own.values, own.default).iter().any(differs), "{} {key}", entry.name);
        }
    }
    assert!(tried > 8, "{tried} settings");
}
