//! Results and rows against the documented JSON Schema, which is generated from their types and allows no other field.

use std::path::Path;

use boon::{Compiler, SchemaIndex, Schemas};
use cuesta::internal::bench::Case;
use cuesta::internal::bench::goal::Goal;
use cuesta::internal::bench::journal::ROWS;
use cuesta::internal::bench::results::{self, RESULTS, Results, TABLE};
use cuesta::internal::bench::rows::{ErrorRow, Errors, Row};
use cuesta::internal::measure::summary::Summary;
use cuesta::internal::renamed;
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::mock;

const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/results-schema.md");
/// Longest line of the document's schema, characters.
const LINE: usize = 120;

/// The JSON Schema of `results.json`, with that of a row under `$defs/Row`.
fn generated() -> Value {
    let mut generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    generator.subschema_for::<Row>();
    let mut schema = generator.into_root_schema_for::<Results>().to_value();
    close(&mut schema);
    renamed::add_former_names(&mut schema);
    schema
}

/// Forbids fields that an object's schema does not name and removes formats that JSON Schema does not define.
fn close(schema: &mut Value) {
    if let Value::Object(keywords) = schema {
        if keywords.contains_key("properties") {
            keywords.insert("additionalProperties".to_string(), json!(false));
        }
        if keywords.get("format").is_some_and(Value::is_string) {
            keywords.shift_remove("format");
        }
        keywords.values_mut().for_each(close);
    } else if let Value::Array(items) = schema {
        items.iter_mut().for_each(close);
    }
}

/// Writes a value on one line if it fits, and its parts on lines of their own if not.
fn layout(value: &Value, indent: usize, begin: &str) -> String {
    let (pad, line) = (" ".repeat(indent), value.to_string());
    let inner = |key: String, value: &Value| layout(value, indent + 2, &key);
    let (open, parts, close) = match value {
        _ if pad.len() + begin.len() + line.len() < LINE => return format!("{pad}{begin}{line}"),
        Value::Object(fields) => ('{', fields.iter().map(|(key, v)| inner(format!("\"{key}\": "), v)).collect(), '}'),
        Value::Array(items) => ('[', items.iter().map(|v| inner(String::new(), v)).collect(), ']'),
        _ => return format!("{pad}{begin}{line}"),
    };
    let parts: Vec<String> = parts;
    format!("{pad}{begin}{open}\n{}\n{pad}{close}", parts.join(",\n"))
}

#[test]
fn the_document_holds_the_generated_schema() {
    let text = std::fs::read_to_string(DOCUMENT).unwrap();
    let (before, rest) = text.split_once("```json\n").expect("a JSON Schema");
    let (_, after) = rest.split_once("```").expect("its end");
    let expected = format!("{before}```json\n{}\n```{after}", layout(&generated(), 0, ""));
    if std::env::var_os("UPDATE_SCHEMA").is_some() {
        std::fs::write(DOCUMENT, expected).unwrap();
    } else {
        assert!(text == expected, "{DOCUMENT} is out of date: UPDATE_SCHEMA=1 rewrites it");
    }
}

/// The generated schema, of results and of rows.
fn schemas() -> (Schemas, [SchemaIndex; 2]) {
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler.add_resource("results.json", generated()).expect("a schema");
    let places = ["results.json", "results.json#/$defs/Row"];
    let compiled = places.map(|at| compiler.compile(at, &mut schemas).expect("a valid schema"));
    (schemas, compiled)
}

fn benchmark(folder: &Path) -> Results {
    let fields = vec![mock::field(33), mock::field(65)];
    let mut cases = mock::cases(&fields, &["circle"]);
    let of = |goal| Case { goal: Some(goal), ..mock::case(&fields[0].0, "geomipmap", 1.0, "certified", "circle") };
    cases.extend([Goal::Triangles(1e3), Goal::FrameMs(9.0)].map(of));
    mock::run(folder, fields, cases, 2);
    Results::read(folder).unwrap()
}

fn text(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join(file)).unwrap()
}

#[test]
fn results_and_rows_are_as_documented() {
    let folder = tempfile::tempdir().unwrap();
    let results = benchmark(folder.path());
    let (schemas, [whole, row]) = schemas();
    let value: Value = serde_json::from_str(&text(folder.path(), RESULTS)).unwrap();
    schemas.validate(&value, whole).unwrap_or_else(|error| panic!("{error:#}"));
    let mut present = value;
    renamed::drop_former_names(&mut present);
    assert_eq!(serde_json::from_value::<Results>(present).unwrap(), results, "what is written is read");
    for line in text(folder.path(), ROWS).lines() {
        let value = serde_json::from_str(line).unwrap();
        schemas.validate(&value, row).unwrap_or_else(|error| panic!("{error:#}"));
    }
    let infinite = Errors { error_px: Summary { rms: 1.0, p999: 2.0, max: f64::INFINITY }, ..Errors::default() };
    let unbounded = Row::Error(ErrorRow { case: results.cases[0].case.clone(), errors: infinite });
    schemas.validate(&serde_json::to_value(unbounded).unwrap(), row).unwrap_or_else(|error| panic!("{error:#}"));
}

/// A schema that nothing fails proves nothing.
#[test]
fn what_is_not_as_documented_is_found() {
    let folder = tempfile::tempdir().unwrap();
    benchmark(folder.path());
    let (schemas, [whole, _]) = schemas();
    let value: Value = serde_json::from_str(&text(folder.path(), RESULTS)).unwrap();
    let changes: [fn(&mut Value); 12] = [
        |v| v["schema"] = 2.into(),
        |v| v["cases"][0]["case"]["metric"] = "other".into(),
        |v| v["cases"][0]["rounds"][0]["hitches"] = (-1).into(),
        |v| v["cases"][0]["rounds"][0]["frame_ms"]["p50"] = Value::Null,
        |v| v["cases"][0]["errors"]["unheard_of"] = 1.into(),
        |v| v["cases"][11]["case"]["goal"]["frame_ms"] = 1.into(),
        |v| v["cases"][11]["rounds"][0]["budget"]["settled"] = 1.5.into(),
        |v| v["header"]["machine"].as_object_mut().unwrap().clear(),
        |v| v["cases"][0]["rounds"][0]["tolerances_px"] = json!([0.0]),
        |v| v["cases"][0]["rounds"][0]["tolerance_scale"] = 0.5.into(),
        |v| v["cases"][0]["errors"]["error_px"]["max"] = "huge".into(),
        |v| v["cases"][0]["errors"]["within"]["samples"] = (-0.1).into(),
    ];
    for (k, change) in changes.iter().enumerate() {
        let mut changed = value.clone();
        change(&mut changed);
        assert!(schemas.validate(&changed, whole).is_err(), "change {k}");
    }
}

#[test]
fn the_table_has_a_line_a_case_with_what_the_results_say() {
    let folder = tempfile::tempdir().unwrap();
    let results = benchmark(folder.path());
    let mut reader = csv::Reader::from_path(folder.path().join(TABLE)).unwrap();
    let columns: Vec<String> = reader.headers().unwrap().iter().map(str::to_string).collect();
    let records: Vec<_> = reader.records().map(|record| record.unwrap()).collect();
    assert_eq!(records.len(), results.cases.len());
    for (record, result) in records.iter().zip(&results.cases) {
        let cell = |name: &str| &record[columns.iter().position(|c| c == name).unwrap_or_else(|| panic!("{name}"))];
        assert_eq!(cell("case.technique"), result.case.technique);
        assert_eq!(cell("case.terrain.size.1"), result.case.terrain.size[1].to_string());
        assert_eq!(cell("time.frame_ms.value").parse(), Ok(result.time.as_ref().unwrap().frame_ms.value));
        assert_eq!(cell("errors.error_px.max").parse(), Ok(result.errors.as_ref().unwrap().error_px.max));
        assert_eq!(cell("errors.image.psnr"), "infinite");
    }
}

#[test]
fn written_again_from_the_rows_the_results_are_the_same() {
    let folder = tempfile::tempdir().unwrap();
    benchmark(folder.path());
    let before = [RESULTS, TABLE].map(|file| text(folder.path(), file));
    results::write(folder.path()).unwrap();
    assert_eq!([RESULTS, TABLE].map(|file| text(folder.path(), file)), before);
}
