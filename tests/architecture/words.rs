//! Tests of the vocabulary: no private words in code or text, and doc comments that state what an item is or does.

use std::fs;
use std::path::{Path, PathBuf};

/// Words with an established replacement; banned in identifiers, comments and documents.
const WORDS: &[&str] = &[
    "neck",
    "manner",
    "manners",
    "spared",
    "gaze",
    "laboratory",
    "helm",
    "battery",
    "oracle",
    "twin",
    "twins",
    "excuse",
    "hung",
    "whoever",
    "whomever",
    "laws",
    "breaker",
    "shoot",
    "widening",
    "widened",
    "sight",
    "ticket",
    "tickets",
];

/// Vague phrases; banned in comments and documents.
const PHRASES: &[&str] = &[
    "so many",
    "is told",
    "are told",
    "is there where",
    "as it is",
    "laid over in parts",
    "looked at by",
    "knows of",
    "who draws",
    "who measures",
    "those who",
];

/// First words of a doc comment that hide its subject.
const OPENINGS: &[&str] = &[
    "What", "Who", "Whoever", "Whose", "Whatever", "Whether", "Which", "How", "Where", "When", "Why", "That", "So",
    "It",
];

/// Files and folders to search. The environment variable `WORDS_IN` overrides them, separated by commas.
const SEARCHED: &[&str] =
    &["src", "tests", "benches", "examples", "shaders", "docs", "build.rs", "README.md", "ARCHITECTURE.md"];

/// This list, and documents about former names.
const EXEMPT: &[&str] = &["tests/architecture/words.rs", "src/renamed.rs", "docs/results-schema.md"];

/// Returns the banned words, phrases and openings of a file, with their lines.
fn violations(file: &str, text: &str) -> Vec<String> {
    let is_document = file.ends_with(".md");
    let mut found = Vec::new();
    let mut before = "";
    for (number, line) in (1..).zip(text.lines()) {
        let comment = if is_document { Some(line) } else { line.split_once("//").map(|(_, comment)| comment) };
        let mut report = |what: &str| found.push(format!("{file}:{number}: {what}"));
        parts(line).into_iter().filter(|part| WORDS.contains(&part.as_str())).for_each(|part| report(&part));
        let Some(comment) = comment else {
            before = line;
            continue;
        };
        let lower = comment.to_lowercase();
        PHRASES.iter().filter(|phrase| lower.contains(*phrase)).for_each(|phrase| report(phrase));
        let doc = |line: &str| ["///", "//!"].into_iter().find(|mark| line.trim_start().starts_with(mark));
        let begins = !is_document && doc(line).is_some_and(|mark| doc(before) != Some(mark));
        let first = comment.trim_start_matches(['/', '!', ' ']).split([' ', ',', ':']).next().unwrap_or_default();
        if begins && OPENINGS.contains(&first) {
            report(&format!("begins with {first}"));
        }
        before = line;
    }
    found
}

/// Returns the words of a line in lower case; identifiers are split.
fn parts(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in line.chars() {
        if !c.is_ascii_alphabetic() || c.is_ascii_uppercase() && was_lower {
            words.push(String::new());
        }
        if c.is_ascii_alphabetic() {
            words.last_mut().expect("at least one").push(c.to_ascii_lowercase());
        }
        was_lower = c.is_ascii_lowercase();
    }
    words
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = fs::read_dir(path).expect("a readable folder");
        entries.for_each(|entry| collect(&entry.expect("an entry").path(), files));
    } else if path.extension().is_some_and(|e| ["rs", "glsl", "vert", "frag", "comp", "md"].iter().any(|k| e == *k)) {
        files.push(path.to_path_buf());
    }
}

#[test]
fn no_private_words() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let chosen = std::env::var("WORDS_IN").unwrap_or_else(|_| SEARCHED.join(","));
    let mut files = Vec::new();
    chosen.split(',').for_each(|path| collect(&root.join(path), &mut files));
    assert!(!files.is_empty(), "{chosen}: no file");
    let check = |path: &PathBuf| {
        let file = path.strip_prefix(root).expect("a file of the project").to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(path).expect("a readable file");
        if EXEMPT.contains(&file.as_str()) { Vec::new() } else { violations(&file, &text) }
    };
    let found: Vec<String> = files.iter().flat_map(check).collect();
    assert!(found.is_empty(), "{} private words and openings:\n{}", found.len(), found.join("\n"));
}

#[test]
fn private_words_are_found() {
    let lines =
        ["/// What is drawn.", "let fooManner = 1;", "// they are told so", "struct Oracle;", "fn no_sight() {}"];
    for line in lines {
        assert_eq!(violations("src/a.rs", line).len(), 1, "{line}");
    }
    for line in ["/// A list.\n/// What is drawn.", "let screenshot = 1;", "/// Returns what is drawn."] {
        assert_eq!(violations("src/a.rs", line), Vec::<String>::new());
    }
}
