//! Import circles: no file may use itself through other files of its top-level module.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::{collect, paths};

/// The modules that each module uses, of those below the same top-level module.
type Graph = BTreeMap<String, BTreeSet<String>>;

/// The graph of source files, given as (path below `src`, text). Their inline tests are left out.
fn graph(files: &[(String, String)]) -> Graph {
    let modules: Vec<Vec<String>> = files.iter().map(|(file, _)| paths::module_of(file)).collect();
    let mut graph = Graph::new();
    for ((_, text), module) in files.iter().zip(&modules).filter(|(_, module)| !module.is_empty()) {
        let code = paths::without_comments(text);
        let code = code.split("#[cfg(test)]").next().unwrap_or_default();
        let is_child = |other: &&Vec<String>| other.split_last().is_some_and(|(_, above)| above == module);
        let children: Vec<&str> =
            modules.iter().filter(is_child).filter_map(|m| m.last()).map(String::as_str).collect();
        let targets = paths::used(code, module).into_iter().chain(paths::used_children(code, module, &children));
        let file_of =
            |(_, path): (usize, Vec<String>)| modules.iter().filter(|m| path.starts_with(m)).max_by_key(|m| m.len());
        let is_near = |other: &&Vec<String>| *other != module && other.first() == module.first();
        let used = targets.filter_map(file_of).filter(is_near).map(|other| other.join("::"));
        graph.insert(module.join("::"), used.collect());
    }
    graph
}

/// All modules that one uses, directly or through others.
fn reached<'a>(graph: &'a Graph, from: &str) -> BTreeSet<&'a str> {
    let (mut reached, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(module) = open.pop() {
        for used in graph.get(module).into_iter().flatten() {
            if reached.insert(used.as_str()) {
                open.push(used);
            }
        }
    }
    reached
}

/// The circles: sets of modules each of which reaches all of the set.
fn circles(graph: &Graph) -> BTreeSet<Vec<&str>> {
    let ahead: BTreeMap<&str, _> = graph.keys().map(|module| (module.as_str(), reached(graph, module))).collect();
    let circle = |(module, reached): (&&str, &BTreeSet<&'_ str>)| {
        reached.contains(module).then(|| {
            ahead.keys().copied().filter(|other| reached.contains(other) && ahead[other].contains(module)).collect()
        })
    };
    ahead.iter().filter_map(circle).collect()
}

#[test]
fn no_file_uses_itself_through_others() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    collect(&src, &mut found);
    let read = |path: &std::path::PathBuf| {
        let file = path.strip_prefix(&src).expect("a file of src").to_string_lossy().replace('\\', "/");
        (file, fs::read_to_string(path).expect("a readable source"))
    };
    // Tests that lie in files of their own.
    let files: Vec<_> = found.iter().map(read).filter(|(file, _)| !file.ends_with("tests.rs")).collect();
    let graph = graph(&files);
    let circles: Vec<String> = circles(&graph).iter().map(|circle| circle.join(", ")).collect();
    assert!(circles.is_empty(), "{} import circles:\n{}", circles.len(), circles.join("\n"));
}

#[test]
fn made_up_circles_are_found() {
    let files =
        |texts: &[(&str, &str)]| -> Vec<_> { texts.iter().map(|(f, t)| (f.to_string(), t.to_string())).collect() };
    /// Files with their texts, and the circles in them.
    type Case = (&'static [(&'static str, &'static str)], &'static [&'static str]);
    let cases: [Case; 5] = [
        (&[("a/mod.rs", "mod b;\nuse b::B;"), ("a/b.rs", "use super::A;")], &["a a::b"]),
        (
            &[
                ("a/b.rs", "use super::c::C;"),
                ("a/c.rs", "use crate::a::d::D;"),
                ("a/d.rs", "use super::b::{self, B};"),
            ],
            &["a::b a::c a::d"],
        ),
        (&[("a/mod.rs", "pub mod b;"), ("a/b.rs", "use super::A;")], &[]),
        (&[("a/b.rs", "use super::c::C;"), ("a/c.rs", "#[cfg(test)]\nmod tests {\n    use crate::a::b::B;\n}")], &[]),
        (&[("a.rs", "use crate::b::B;"), ("b.rs", "use crate::a::A;")], &[]),
    ];
    for (texts, expected) in cases {
        let graph = graph(&files(texts));
        let found: Vec<String> = circles(&graph).iter().map(|circle| circle.join(" ")).collect();
        assert_eq!(found, expected, "{texts:?}");
    }
}
