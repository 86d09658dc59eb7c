//! Writes a timeline in the Trace Event Format, for Perfetto or Chrome's `about:tracing`.
//!
//! The document has the JSON object form of "Trace Event Format" (Google, 2016) with metadata (`M`), complete (`X`) and
//! counter (`C`) events. Times are in microseconds. Slices of a track must be disjoint or nested.

use serde_json::{Map, Value, json};

use super::estimate::rounded;

/// Process number of all events.
const PROCESS: u32 = 1;

/// A time span on a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Name to show.
    pub name: String,
    /// Category: `step`, `pass`, `pipeline` or `draw`.
    pub category: &'static str,
    /// Start, microseconds.
    pub start_us: f64,
    /// End, microseconds.
    pub end_us: f64,
    /// Details to show when the slice is selected.
    pub args: Map<String, Value>,
}

/// The slices of the host or of the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Name to show.
    pub name: String,
    /// The slices. A slice precedes those nested in it.
    pub slices: Vec<Slice>,
}

/// A number that changes over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Counter {
    /// Name to show.
    pub name: &'static str,
    /// Times, microseconds, and the value from each time on.
    pub samples: Vec<(f64, u64)>,
}

/// Returns the trace as one JSON document. `facts` describe the trace as a whole.
pub fn document(tracks: &[Track], counters: &[Counter], facts: Value) -> Value {
    let mut events = vec![metadata("process_name", 0, json!({ "name": "cuesta" }))];
    for (thread, track) in (1..).zip(tracks) {
        events.push(metadata("thread_name", thread, json!({ "name": track.name })));
        events.push(metadata("thread_sort_index", thread, json!({ "sort_index": thread })));
        events.extend(track.slices.iter().map(|slice| complete(thread, slice)));
    }
    events.extend(counters.iter().flat_map(samples));
    json!({ "traceEvents": events, "displayTimeUnit": "ns", "otherData": facts })
}

fn metadata(name: &str, thread: u32, args: Value) -> Value {
    json!({ "ph": "M", "name": name, "pid": PROCESS, "tid": thread, "args": args })
}

fn complete(thread: u32, slice: &Slice) -> Value {
    // Rounding the ends, not the duration, keeps adjacent slices adjacent.
    let (start, end) = (rounded(slice.start_us), rounded(slice.end_us));
    json!({
        "ph": "X",
        "name": slice.name,
        "cat": slice.category,
        "pid": PROCESS,
        "tid": thread,
        "ts": start,
        "dur": rounded(end - start),
        "args": slice.args,
    })
}

fn samples(counter: &Counter) -> impl Iterator<Item = Value> + '_ {
    counter.samples.iter().map(|(us, value)| {
        let args = json!({ counter.name: value });
        json!({ "ph": "C", "name": counter.name, "pid": PROCESS, "tid": 0, "ts": rounded(*us), "args": args })
    })
}
