//! JSON form of numbers that may be infinite: JSON has no such number, so the word "infinite" is written instead.
//!
//! For a field: `#[serde(with = "extended")]` and `#[schemars(with = "Extended")]`.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Infinite,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Number {
    Finite(f64),
    Infinite(Word),
}

/// Writes a finite number as itself and any other as the word.
pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    let number = if value.is_finite() { Number::Finite(*value) } else { Number::Infinite(Word::Infinite) };
    number.serialize(serializer)
}

/// Reads a number or the word; any other text is an error.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(match Number::deserialize(deserializer)? {
        Number::Finite(value) => value,
        Number::Infinite(Word::Infinite) => f64::INFINITY,
    })
}

/// The JSON Schema of such a number.
pub struct Extended;

impl JsonSchema for Extended {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Extended".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"anyOf": [{"type": "number"}, {"const": "infinite"}]})
    }
}

/// Restricts the numbers of a schema's own fields to 0 and above, those of lists included.
pub fn non_negative(schema: &mut Schema) {
    let fields = schema.get_mut("properties").and_then(|fields| fields.as_object_mut());
    for field in fields.into_iter().flat_map(|fields| fields.values_mut()) {
        let numbers = if field["items"].is_object() { &mut field["items"] } else { field };
        let types = numbers["type"].clone();
        let is_number = types == "number" || types.as_array().is_some_and(|types| types.iter().any(|t| t == "number"));
        if is_number && let Some(numbers) = numbers.as_object_mut() {
            numbers.entry("minimum").or_insert(0.into());
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::measure::summary::Summary;

    #[test]
    fn infinite_errors_come_back() {
        let summary = Summary { rms: 0.1, p999: f64::INFINITY, max: f64::INFINITY };
        let text = serde_json::to_string(&summary).unwrap();
        assert_eq!(text, r#"{"rms":0.1,"p999":"infinite","max":"infinite"}"#);
        assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), summary);
        assert!(serde_json::from_str::<Summary>(&text.replace("infinite", "nan")).is_err());
    }
}
