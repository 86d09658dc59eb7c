//! Converts one probed frame to the tracks and counters of a trace.

use serde_json::{Map, Value, json};

use super::rows::DrawRow;
use super::trace::{Counter, Slice, Track};
use crate::scene::probed::{ProbedFrame, Span};

/// Returns the tracks of host and device. The device's passes contain pipelines, which contain draws. `rows` are those
/// of the frame's draws.
pub fn tracks(frame: &ProbedFrame, rows: &[DrawRow]) -> Vec<Track> {
    let host = frame.steps.iter().map(|(step, span)| slice(step, "step", *span, Map::new())).collect();
    let mut device = Vec::new();
    let mut drawn: Vec<_> = frame.draws.iter().map(|draw| draw.span).zip(rows).collect();
    for (pass, span) in &frame.passes {
        device.push(slice(pass, "pass", *span, Map::new()));
        let (own, others): (Vec<_>, Vec<_>) = drawn.into_iter().partition(|(_, row)| row.pass == *pass);
        device.extend(pipelines(&own));
        drawn = others;
    }
    vec![Track { name: "CPU".to_string(), slices: host }, Track { name: "GPU".to_string(), slices: device }]
}

/// Returns running totals over the frame, with one sample at the end of each draw: triangles, vertex shader invocations
/// and fragment shader invocations. Those that the device does not count are left out.
pub fn counters(frame: &ProbedFrame, rows: &[DrawRow]) -> Vec<Counter> {
    let running = |name, of: fn(&DrawRow) -> Option<u64>| {
        let mut sum = 0;
        let start = frame.draws.first().map(|draw| (draw.span.start_us, 0));
        let ends = frame.draws.iter().zip(rows).filter_map(|(draw, row)| {
            sum += of(row)?;
            Some((draw.span.end_us, sum))
        });
        Counter { name, samples: start.into_iter().chain(ends).collect() }
    };
    let counters = [
        running("triangles submitted", |row| Some(row.triangles)),
        running("vertices run", |row| row.vertices_run),
        running("fragments run", |row| row.fragments_run),
    ];
    // A counter with its start alone has no counts.
    counters.into_iter().filter(|counter| counter.samples.len() > 1).collect()
}

/// Returns the slices of consecutive draws: one per run of draws with the same pipeline, followed by its draws.
fn pipelines(draws: &[(Span, &DrawRow)]) -> Vec<Slice> {
    let mut slices = Vec::new();
    for run in draws.chunk_by(|a, b| a.1.pipeline == b.1.pipeline) {
        let span = Span { start_us: run[0].0.start_us, end_us: run[run.len() - 1].0.end_us };
        let args = [("draws".to_string(), json!(run.iter().map(|(_, row)| row.draws).sum::<usize>()))];
        slices.push(slice(&run[0].1.pipeline, "pipeline", span, args.into_iter().collect()));
        slices.extend(run.iter().map(|(span, row)| slice(&row.label, "draw", *span, args_of(row))));
    }
    slices
}

/// Returns the values of a draw's row other than label and times, to show when it is selected.
fn args_of(row: &DrawRow) -> Map<String, Value> {
    let Ok(Value::Object(fields)) = serde_json::to_value(row) else { return Map::new() };
    let shown = |name: &str, value: &Value| name != "label" && !name.starts_with("gpu_us") && !value.is_null();
    fields.into_iter().filter(|(name, value)| shown(name, value)).collect()
}

fn slice(name: &str, category: &'static str, span: Span, args: Map<String, Value>) -> Slice {
    Slice { name: name.to_string(), category, start_us: span.start_us, end_us: span.end_us, args }
}
