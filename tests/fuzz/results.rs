//! Fuzzes the readers of benchmark and stress rows: mutated rows must give results, reports and comparisons, or an error;
//! never a panic.

use std::path::Path;
use std::sync::LazyLock;

use cuesta::internal::bench::goal::Goal;
use cuesta::internal::bench::journal::{Journal, ROWS};
use cuesta::internal::bench::results::{self, Results};
use cuesta::internal::bench::{Case, compare};
use cuesta::internal::report;
use cuesta::internal::stress::rows::{FILE, Row, SCHEMA, Stress};
use fastrand::Rng;
use serde_json::Value;

use super::{fuzz, mutate};
use crate::bench::mock;

/// Returns the lines of small benchmarks.
static ROW_LINES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let fields = vec![mock::field(9)];
    let of = |px: f64| mock::case(&fields[0].0, "geomipmap", px, "certified", "spin");
    let mut cases = vec![mock::case(&fields[0].0, "brute-force", 0.5, "certified", "spin"), of(1.0), of(4.0)];
    cases.push(Case { goal: Some(Goal::Triangles(1e3)), ..of(1.0) });
    mock::run(folder.path(), fields, cases, 2);
    std::fs::read_to_string(folder.path().join(ROWS)).expect("rows").lines().map(str::to_string).collect()
});

/// Replacements of a value.
fn replacement(random: &mut Rng) -> Value {
    match random.u8(..8) {
        0 => Value::Null,
        1 => Value::from(*mutate::one(random, &[0.0, -1.0, 1e-320, 1e300, -1e300, f64::MAX, 0.1, 3.0])),
        2 => Value::from(*mutate::one(random, &[0, 1, 2, u64::from(u32::MAX), 1 << 53, u64::MAX - 1, u64::MAX])),
        3 => Value::from(*mutate::one(random, &[-1, i64::MIN])),
        4 => {
            Value::from(*mutate::one(random, &["", "infinite", "certified", "../../x", "<b>", "\u{1}\n", "ü", "spin"]))
        }
        5 => Value::Array(vec![]),
        6 => Value::Array((0..3).map(|_| replacement(random)).collect()),
        _ => Value::Object(Default::default()),
    }
}

/// Mutates one value somewhere below.
fn change(random: &mut Rng, value: &mut Value) {
    match value {
        Value::Object(fields) if !fields.is_empty() && random.u8(..8) > 0 => {
            let key = fields.keys().nth(random.usize(..fields.len())).expect("one of them").clone();
            match random.u8(..12) {
                0 => drop(fields.remove(&key)),
                _ => change(random, &mut fields[&key]),
            }
        }
        Value::Array(items) if !items.is_empty() && random.u8(..4) > 0 => {
            let at = random.usize(..items.len());
            match random.u8(..6) {
                0 => drop(items.remove(at)),
                1 => items.insert(at, items[at].clone()),
                _ => change(random, &mut items[at]),
            }
        }
        other => *other = replacement(random),
    }
}

fn changed(random: &mut Rng, line: &str) -> String {
    match serde_json::from_str::<Value>(line) {
        Ok(mut value) if random.u8(..6) > 0 => {
            (0..random.usize(1..4)).for_each(|_| change(random, &mut value));
            value.to_string()
        }
        _ => {
            let mut bytes = line.as_bytes().to_vec();
            mutate::bytes(random, &mut bytes, ROW_LINES[1].as_bytes());
            String::from_utf8_lossy(&bytes).into_owned()
        }
    }
}

/// Returns some of the lines, some of them mutated.
fn lines(random: &mut Rng) -> Vec<String> {
    let mut lines: Vec<String> = ROW_LINES.clone();
    for _ in 0..random.usize(..6) {
        let at = random.usize(..lines.len());
        match random.u8(..6) {
            0 if lines.len() > 1 => drop(lines.remove(at)),
            1 => lines.insert(at, lines[at].clone()),
            _ => lines[at] = changed(random, &lines[at]),
        }
    }
    lines
}

fn check(lines: &[String]) {
    let folder = tempfile::tempdir().expect("a folder");
    let [other, changed] = ["other", "changed"].map(|name| folder.path().join(name));
    write(&other, ROWS, &ROW_LINES.join("\n"));
    write(&changed, ROWS, &lines.join("\n"));
    let (Ok(before), Ok(after)) = (Results::read(&other), Results::read(&changed)) else { return };
    for (a, b) in [(&before, &after), (&after, &before), (&after, &after)] {
        serde_json::to_string(&compare::compare(a, b, 0.1)).expect("a comparison is written");
    }
    // Each reader decides if it accepts them.
    let _ = (results::write(&changed), report::write(&changed), Journal::open(&changed, after.header));
}

fn write(folder: &Path, file: &str, text: &str) {
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::write(folder.join(file), format!("{text}\n")).expect("a file");
}

#[test]
fn whatever_the_rows_a_report_or_one_line() {
    fuzz("results", lines, check);
}

fn suite() -> String {
    let row = |family: &str, value, limit| Row {
        family: family.to_string(),
        name: "a case".to_string(),
        technique: "clusters block=16".to_string(),
        check: "crack".to_string(),
        value,
        limit,
        pass: value <= limit,
        why: Some("a crack at (1, 2)".to_string()),
        repeat: "cuesta stress".to_string(),
        saved: vec!["a.png".to_string()],
    };
    let cases = vec![row("data", Some(0.0), Some(0.0)), row("view", Some(2.0), Some(1.0)), row("time", None, None)];
    let stress = Stress {
        schema: SCHEMA,
        program: "cuesta".to_string(),
        device: None,
        ended: None,
        cases,
        pictures: Vec::new(),
    };
    serde_json::to_string(&stress).expect("JSON")
}

#[test]
fn whatever_the_suite_a_page_or_one_line() {
    let whole = suite();
    let check = |lines: &[String]| {
        let folder = tempfile::tempdir().expect("a folder");
        write(folder.path(), FILE, &lines.concat());
        let _ = report::write_stress(folder.path());
    };
    fuzz("suite", |random| vec![changed(random, &whole)], check);
}

/// Found by fuzzing: sums of row values overflowed.
#[test]
fn numbers_at_the_edge_are_summed() {
    let huge = |line: &String| {
        let mut row: Value = serde_json::from_str(line).expect("JSON");
        if row["row"] == "time" {
            row["case"]["frames"] = Value::from(u64::MAX);
            row["hitches"] = Value::from(u64::MAX);
            row["device_bytes"] = serde_json::json!({ "heights": u64::MAX, "mesh": 1 });
        }
        for count in ["/economy/pixels_per_triangle/0/count", "/pop/histogram/0/count"] {
            row.pointer_mut(count).into_iter().for_each(|count| *count = Value::from(u64::MAX));
        }
        row.to_string()
    };
    check(&ROW_LINES.iter().map(huge).collect::<Vec<_>>());
}
