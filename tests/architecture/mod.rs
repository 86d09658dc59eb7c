//! Tests of the architecture: allowed module dependencies, where Vulkan may be named, and the maximum file length.

mod circles;
mod frames;
mod paths;
mod words;

use std::fs;
use std::path::{Path, PathBuf};

/// Maximum lines of a source file.
const MAX_LINES: usize = 500;

/// Every top-level module with the modules it may use.
const DEPENDENCIES: &[(&str, &[&str])] = &[
    ("view", &[]),
    ("renamed", &[]),
    ("height", &[]),
    ("draw", &["view", "height"]),
    ("lod", &["view", "height", "draw", "texture"]),
    ("texture", &["view", "height", "draw"]),
    ("plan", &["view", "height", "draw", "texture"]),
    ("gpu", &["view", "height", "draw", "texture", "plan"]),
    ("measure", &["view", "height", "draw"]),
    ("scene", &["view", "height", "draw", "lod", "plan", "gpu", "measure"]),
    ("embed", &["view", "height", "draw", "lod", "plan", "gpu"]),
    ("cli", EVERYTHING),
    ("bench", BELOW_REPORT),
    ("profile", BELOW_REPORT),
    ("stress", BELOW_REPORT),
    ("viewer", BELOW_REPORT),
    // Reads result rows only, so that a report can be drawn on any machine.
    ("report", &["bench", "profile", "stress", "measure"]),
];

const BELOW_REPORT: &[&str] = &[
    "view", "height", "draw", "lod", "texture", "plan", "gpu", "measure", "scene", "bench", "profile", "stress",
    "viewer", "renamed",
];

/// The command line may use all modules.
const EVERYTHING: &[&str] = &[
    "view", "height", "draw", "lod", "texture", "plan", "gpu", "measure", "scene", "bench", "profile", "stress",
    "viewer", "report", "renamed",
];

/// Returns the violations in a file of `src`, each as `file:line: what`. `file` is relative to `src`.
fn violations(file: &str, text: &str) -> Vec<String> {
    let code = paths::without_comments(text);
    let module = paths::module_of(file);
    let mut found = Vec::new();
    let mut report = |line: usize, what: String| found.push(format!("src/{file}:{line}: {what}"));
    if !text.starts_with("//!") {
        report(1, "a file opens with //!".into());
    }
    let lines = text.lines().count();
    if lines > MAX_LINES {
        report(MAX_LINES + 1, format!("{lines} lines, more than {MAX_LINES}"));
    }
    for (line, target) in paths::used(&code, &module) {
        if let Some(what) = forbidden(&module, &target) {
            report(line, what);
        }
    }
    if module.first().is_none_or(|top| top != "gpu") {
        for word in ["unsafe", "ash"] {
            for line in paths::lines_with_word(&code, word) {
                report(line, format!("`{word}` outside gpu"));
            }
        }
    }
    // Tests may print.
    let code_without_tests =
        if file.ends_with("tests.rs") { "" } else { code.split("#[cfg(test)]").next().unwrap_or_default() };
    for (line, text) in code_without_tests.lines().enumerate() {
        if text.contains("print!(") || text.contains("println!(") {
            found.push(format!("src/{file}:{}: printing panics on a closed pipe: use cli::report", line + 1));
        }
    }
    found.dedup();
    found
}

/// Returns the reason that forbids a module to use a path of the crate, if any.
fn forbidden(module: &[String], target: &[String]) -> Option<String> {
    // The crate's root may name any module.
    let (from, to) = (module.first()?, target.first()?);
    if from == to {
        let techniques = (module.get(1)?, target.get(1)?);
        let is_technique =
            |name: &str| cuesta::internal::lod::TECHNIQUES.iter().any(|entry| entry.name.replace('-', "_") == name);
        let is_forbidden =
            from == "lod" && techniques.0 != techniques.1 && is_technique(techniques.0) && is_technique(techniques.1);
        return is_forbidden.then(|| format!("technique {} uses technique {}", techniques.0, techniques.1));
    }
    let known = |name: &str| DEPENDENCIES.iter().find(|(module, _)| *module == name);
    match known(from) {
        None => Some(format!("module {from} has no row in the table of dependencies")),
        Some((_, allowed)) if known(to).is_some() && !allowed.contains(&to.as_str()) => {
            Some(format!("{from} may not use {to}"))
        }
        _ => None,
    }
}

#[test]
fn all_files_respect_the_dependencies() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&src, &mut files);
    assert!(files.len() > 10, "the sources were found");
    let check = |path: &PathBuf| {
        let text = fs::read_to_string(path).expect("a readable source");
        let file = path.strip_prefix(&src).expect("a file of src").to_string_lossy().replace('\\', "/");
        violations(&file, &text)
    };
    let found: Vec<String> = files.iter().flat_map(check).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// Every rule finds an artificial violation.
#[test]
fn artificial_violations_are_found() {
    let cases = [
        ("view.rs", "use crate::height::Field;", "view may not use height"),
        ("draw/expand.rs", "use crate::{view::View, lod::{self, Entry}};", "draw may not use lod"),
        ("lod/mod.rs", "fn f() { crate::gpu::draw() }", "lod may not use gpu"),
        ("lod/geomipmap/mod.rs", "use super::brute_force;", "technique geomipmap uses technique brute_force"),
        (
            "lod/geomipmap/mesh.rs",
            "use super::super::brute_force::ENTRY;",
            "technique geomipmap uses technique brute_force",
        ),
        (
            "lod/brute_force.rs",
            "use crate::lod::{Entry, geomipmap::blocks};",
            "technique brute_force uses technique geomipmap",
        ),
        ("measure/mod.rs", "pub use crate::lod::Technique;", "measure may not use lod"),
        ("gpu/frame.rs", "use super::super::lod;", "gpu may not use lod"),
        ("report/mod.rs", "use crate::gpu;", "report may not use gpu"),
        ("viewer/mod.rs", "use crate::report;", "viewer may not use report"),
        ("cellar/mod.rs", "use crate::view::View;", "module cellar has no row in the table of dependencies"),
        ("lod/mod.rs", "unsafe { *p }", "`unsafe` outside gpu"),
        ("embed/mod.rs", "unsafe { *p }", "`unsafe` outside gpu"),
        ("measure/mod.rs", "use ash::vk;", "`ash` outside gpu"),
        ("view.rs", "fn f() { eprintln!(\"x\") }", "printing panics on a closed pipe: use cli::report"),
    ];
    for (file, line, what) in cases {
        let text = format!("//! Made up.\n\n{line}\n");
        assert_eq!(violations(file, &text), [format!("src/{file}:3: {what}")]);
    }
    assert_eq!(violations("view.rs", "use glam::DVec3;\n"), ["src/view.rs:1: a file opens with //!"]);
    let long = format!("//! Long.\n{}", "\n".repeat(MAX_LINES));
    assert_eq!(violations("view.rs", &long), [format!("src/view.rs:501: 501 lines, more than {MAX_LINES}")]);
}

#[test]
fn allowed_code_is_not_reported() {
    let cases = [
        ("gpu/memory.rs", "use ash::vk;\nuse crate::draw::DrawList;\nfn f() { unsafe { g() } }"),
        (
            "lod/geomipmap/mod.rs",
            "use super::{Entry, settings::Settings};\nuse self::mesh::side;\nuse crate::lod::geomipmap::levels;",
        ),
        ("lod/mod.rs", "pub mod geomipmap;\nconst T: &[Entry] = &[geomipmap::ENTRY];"),
        ("view.rs", "// crate::gpu is unsafe, as ash is.\n\nconst S: &str = \"hash, unsafely\";"),
        ("view.rs", "mod tests {\n    use super::*;\n}"),
        ("view.rs", "#[cfg(test)]\nmod tests {\n    fn f() { println!(\"x\") }\n}"),
        ("lib.rs", "pub mod view;\n\npub mod lod;"),
    ];
    for (file, text) in cases {
        assert_eq!(violations(file, &format!("//! Made up.\n{text}\n")), [""; 0], "{file}: {text}");
    }
}
