//! A timeline in the Trace Event Format, which Perfetto and Chrome's tracing page open.
//!
//! After "Trace Event Format" (Google, 2016): the JSON object form, with metadata (`M`), complete (`X`) and counter
//! (`C`) events; times in microseconds. Slices of a track lie side by side or one within the other.

use serde_json::{Map, Value, json};

use super::estimate::rounded;

/// The one process of a trace.
const PROCESS: u32 = 1;

/// A stretch of time on a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Events of the track.
    pub name: String,
    /// Category: step, pass, pipeline or draw.
    pub category: &'static str,
    /// Start, microseconds.
    pub start_us: f64,
    /// End, microseconds.
    pub end_us: f64,
    /// Details shown when it is selected.
    pub args: Map<String, Value>,
}

/// Slices of one thread of work.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Its name.
    pub name: String,
    /// Its slices; one that encloses others stands before them.
    pub slices: Vec<Slice>,
}

/// A number over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Counter {
    /// Its name.
    pub name: &'static str,
    /// Microseconds, and the value from then on.
    pub samples: Vec<(f64, u64)>,
}

/// The whole trace as one JSON document; `facts` are said of it as a whole.
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
    // Both ends are rounded before they are subtracted: neighbours stay neighbours.
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
