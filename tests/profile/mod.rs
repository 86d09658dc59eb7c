//! Profiles: traces that others' tools accept, and rows that say what the device did.

#[cfg(feature = "vulkan")]
mod device;
pub mod trace_format;

use cuesta::internal::profile::trace::{Counter, Slice, Track, document};
use serde_json::{Map, Value, json};

fn slice(name: &str, start_us: f64, end_us: f64) -> Slice {
    Slice { name: name.to_string(), category: "draw", start_us, end_us, args: Map::new() }
}

fn trace(slices: Vec<Slice>) -> Value {
    let tracks = [
        Track { name: "CPU".to_string(), slices: vec![slice("select", 0.0, 4.25)] },
        Track { name: "GPU".to_string(), slices },
    ];
    let counters = [Counter { name: "triangles", samples: vec![(5.0, 0), (7.5, 12)] }];
    document(&tracks, &counters, json!({ "clock": "calibrated" }))
}

#[test]
fn a_trace_is_what_the_format_says() {
    let found = trace_format::check(&trace(vec![
        slice("terrain", 5.0, 9.0),
        slice("first", 5.0, 7.00049),
        slice("second", 7.00049, 9.0),
    ]));
    let found = found.expect("a valid trace");
    let names: Vec<_> = found.iter().map(|s| (s.track.as_str(), s.name.as_str(), s.ns)).collect();
    let expected = [
        ("CPU", "select", [0, 4250]),
        ("GPU", "terrain", [5000, 9000]),
        ("GPU", "first", [5000, 7000]),
        ("GPU", "second", [7000, 9000]),
    ];
    assert_eq!(names, expected);
}

#[test]
fn slices_that_overlap_in_part_are_found() {
    let broken = trace(vec![slice("first", 5.0, 7.0), slice("second", 6.0, 8.0)]);
    assert_eq!(trace_format::check(&broken).unwrap_err(), "first and second overlap in part");
}

/// A check that cannot fail proves nothing: each rule on a trace that breaks it.
#[test]
fn traces_that_break_the_format_are_refused() {
    let good = || trace(vec![slice("terrain", 5.0, 9.0)]);
    let event = |phase: &str| {
        let events = good()["traceEvents"].as_array().unwrap().clone();
        events.iter().position(|e| e["ph"] == phase).unwrap()
    };
    let slice = event("X");
    let cases: [(usize, &str, Value, &str); 9] = [
        (slice, "ts", Value::Null, "invalid type: null"),
        (slice, "dur", json!(-1.0), "of -1000 ns"),
        (slice, "ph", json!("Z"), "unknown variant"),
        (slice, "ts", json!("5.0"), "invalid type: string"),
        (slice, "tid", json!(77), "without a name"),
        (slice, "name", json!(""), "slice \"\""),
        (slice, "colour", json!("red"), "unknown field"),
        (event("C"), "args", json!({ "triangles": "many" }), "invalid type: string"),
        (event("C"), "ts", json!(1e6), "goes back in time"),
    ];
    for (k, field, value, error) in cases {
        let mut broken = good();
        broken["traceEvents"][k][field] = value;
        let found = trace_format::check(&broken).expect_err(field);
        assert!(found.contains(error), "{field}: {found}");
    }
    let mut broken = good();
    broken["traceEvents"][slice].as_object_mut().unwrap().remove("dur");
    assert!(trace_format::check(&broken).unwrap_err().contains("missing field `dur`"));
    let mut broken = good();
    broken["displayTimeUnit"] = json!("hours");
    assert!(trace_format::check(&broken).unwrap_err().contains("unknown variant `hours`"));
}
