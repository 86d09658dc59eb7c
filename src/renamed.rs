//! Fields of JSON documents that were renamed: this release writes them under both names and reads either.

use serde_json::Value;

/// Present name and former name.
const RENAMED: &[(&str, &str)] = &[
    ("tolerance_scale", "widening"),
    ("pending", "waiting"),
    ("pending_frames", "waiting_frames"),
    ("shading_only_ms", "floor_ms"),
    ("shading_only_frames_ms", "floors_ms"),
    ("over_shading_only", "over_floor"),
    ("budget", "held"),
    ("stats", "figures"),
    ("omitted", "spared"),
];

/// Adds the former name beside each present one, at any depth.
pub fn add_former_names(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(add_former_names),
        Value::Object(fields) => {
            fields.values_mut().for_each(add_former_names);
            for (present, former) in RENAMED {
                if let Some(value) = fields.get(*present).cloned() {
                    fields.entry(*former).or_insert(value);
                }
            }
        }
        _ => {}
    }
}

/// Removes former names, at any depth; a value that has no other name gets the present one.
pub fn drop_former_names(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(drop_former_names),
        Value::Object(fields) => {
            for (present, former) in RENAMED {
                if let Some(value) = fields.shift_remove(*former) {
                    fields.entry(*present).or_insert(value);
                }
            }
            fields.values_mut().for_each(drop_former_names);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn both_names_are_written_and_either_is_read() {
        let present = json!({"rows": [{"tolerance_scale": 2.0, "pending": {"frames": 3}}], "other": 1});
        let mut written = present.clone();
        add_former_names(&mut written);
        assert_eq!(written["rows"][0]["widening"], 2.0);
        assert_eq!(written["rows"][0]["waiting"]["frames"], 3);
        drop_former_names(&mut written);
        assert_eq!(written, present);
        let mut former = json!({"rows": [{"widening": 2.0, "waiting": {"frames": 3}}], "other": 1});
        drop_former_names(&mut former);
        assert_eq!(former, present);
    }
}
