//! Frames begin in one place: no other file repeats the order of their steps.

use std::fs;
use std::path::Path;

use super::{collect, paths};

/// Calls that few files may make, and those files.
const CALLS: &[(&str, &[&str])] = &[
    ("frames.begin()", &["gpu/frame_renderer.rs"]),
    ("Frames::begin", &[]),
    ("Frames::new(", &["gpu/frame_renderer.rs", "gpu/frames.rs"]),
    ("queue_submit2(", &["gpu/frames.rs"]),
    // Capturing draws without attachments.
    ("cmd_begin_rendering(", &["gpu/target.rs", "gpu/passes/capture.rs"]),
];

/// The calls of a file that only others may make.
fn violations(file: &str, text: &str) -> Vec<String> {
    let code = paths::without_comments(text);
    let forbidden = CALLS.iter().filter(|(call, files)| code.contains(call) && !files.contains(&file));
    forbidden.map(|(call, _)| format!("src/{file}: {call}")).collect()
}

#[test]
fn one_file_begins_frames() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&src, &mut files);
    let (mut found, mut begins) = (Vec::new(), 0);
    for path in &files {
        let text = fs::read_to_string(path).expect("a readable source");
        let file = path.strip_prefix(&src).expect("a file of src").to_string_lossy().replace('\\', "/");
        found.extend(violations(&file, &text));
        begins += paths::without_comments(&text).matches("frames.begin()").count();
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
    assert_eq!(begins, 1, "calls that begin a frame");
}

#[test]
fn another_beginning_is_found() {
    let line = "let mut recording = self.frames.begin()?;";
    assert_eq!(violations("scene/parts.rs", line), ["src/scene/parts.rs: frames.begin()"]);
    assert_eq!(violations("gpu/frame_renderer.rs", line), [""; 0]);
    assert_eq!(violations("gpu/frames.rs", "// frames.begin()"), [""; 0]);
}
