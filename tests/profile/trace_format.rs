//! A check of traces against the Trace Event Format: the fields that each kind of event must have, their types, and
//! slices of a track side by side or one within the other.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use serde_json::{Map, Value};

/// The object form of a trace.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Document {
    trace_events: Vec<Event>,
    display_time_unit: Unit,
    #[serde(rename = "otherData")]
    _other_data: Map<String, Value>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Unit {
    Ms,
    Ns,
}

/// The kinds of events in use, by their phase.
#[derive(Deserialize)]
#[serde(tag = "ph", deny_unknown_fields)]
enum Event {
    /// Metadata.
    M { name: String, pid: u32, tid: u32, args: Map<String, Value> },
    /// A complete slice.
    X { name: String, cat: String, pid: u32, tid: u32, ts: f64, dur: f64, args: Map<String, Value> },
    /// A counter.
    C {
        name: String,
        pid: u32,
        #[serde(rename = "tid")]
        _tid: u32,
        ts: f64,
        args: BTreeMap<String, f64>,
    },
}

/// A slice of a trace, nanoseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Name of its track.
    pub track: String,
    /// Its name.
    pub name: String,
    /// Its category.
    pub category: String,
    /// Start and end.
    pub ns: [i64; 2],
    /// Its arguments.
    pub args: Map<String, Value>,
}

/// Holds a trace against the format and returns its slices, or the first thing that is wrong.
pub fn check(trace: &Value) -> Result<Vec<Slice>, String> {
    let document = Document::deserialize(trace).map_err(|error| error.to_string())?;
    match document.display_time_unit {
        Unit::Ms | Unit::Ns => {}
    }
    let mut names = BTreeMap::new();
    let mut processes = BTreeSet::new();
    let mut tracks: BTreeMap<(u32, u32), Vec<Slice>> = BTreeMap::new();
    let mut counted: BTreeMap<String, i64> = BTreeMap::new();
    for event in document.trace_events {
        match event {
            Event::M { name, pid, tid, args } => match (name.as_str(), args.get("name")) {
                ("process_name", Some(Value::String(_))) => drop(processes.insert(pid)),
                ("thread_name", Some(Value::String(track))) => drop(names.insert((pid, tid), track.clone())),
                ("thread_sort_index", _) if args.get("sort_index").is_some_and(Value::is_u64) => {}
                _ => return Err(format!("metadata {name} is unknown or lacks its argument")),
            },
            Event::X { name, cat, pid, tid, ts, dur, args } => {
                let (start, length) = (ns(ts)?, ns(dur)?);
                if name.is_empty() || length < 0 {
                    return Err(format!("slice {name:?} of {length} ns"));
                }
                let track = names.get(&(pid, tid)).ok_or(format!("slice {name} on a track without a name"))?.clone();
                let slice = Slice { track, name, category: cat, ns: [start, start + length], args };
                tracks.entry((pid, tid)).or_default().push(slice);
            }
            Event::C { name, pid, ts, args, .. } => {
                let last = counted.entry(name.clone()).or_insert(i64::MIN);
                if args.is_empty() || !processes.contains(&pid) || ns(ts)? < *last {
                    return Err(format!("counter {name} has no value, no process, or goes back in time"));
                }
                *last = ns(ts)?;
            }
        }
    }
    if let Some((pid, _)) = tracks.keys().find(|(pid, _)| !processes.contains(pid)) {
        return Err(format!("process {pid} has no name"));
    }
    tracks.values().try_for_each(|slices| nested(slices))?;
    Ok(tracks.into_values().flatten().collect())
}

/// Whole nanoseconds of a time in microseconds.
fn ns(us: f64) -> Result<i64, String> {
    let ns = (us * 1e3).round();
    if ns.is_finite() && (ns - us * 1e3).abs() < 1e-3 { Ok(ns as i64) } else { Err(format!("{us} µs")) }
}

/// Slices of one track never overlap in part.
fn nested(slices: &[Slice]) -> Result<(), String> {
    let mut sorted: Vec<_> = slices.iter().collect();
    sorted.sort_by_key(|slice| (slice.ns[0], -slice.ns[1]));
    let mut open: Vec<&Slice> = Vec::new();
    for slice in sorted {
        open.retain(|other| other.ns[1] > slice.ns[0]);
        if let Some(other) = open.iter().find(|other| other.ns[1] < slice.ns[1]) {
            return Err(format!("{} and {} overlap in part", other.name, slice.name));
        }
        open.push(slice);
    }
    Ok(())
}
