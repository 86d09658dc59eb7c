//! The techniques, settings and subcommands in README and guide match the tables of the program.

use cuesta::internal::lod::TECHNIQUES;

const README: &str = include_str!("../../README.md");
const GUIDE: &str = include_str!("../../docs/guide.md");

/// Returns the rows of a document's table with this header: name, and the other cells.
fn rows(document: &str, header: &str) -> Vec<(String, String)> {
    let lines = document.lines().skip_while(|line| !line.starts_with(header)).skip(2);
    let row = |line: &str| {
        let (name, rest) = line.trim_start_matches("| ").split_once('|').expect("cells");
        (name.trim().trim_matches('`').to_string(), rest.to_string())
    };
    lines.take_while(|line| line.starts_with('|')).map(row).collect()
}

#[test]
fn readme_lists_every_technique() {
    let names: Vec<_> = rows(README, "| technique | published by").into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, TECHNIQUES.iter().map(|entry| entry.name).collect::<Vec<_>>());
}

#[test]
fn every_technique_variant_and_setting_is_named_and_no_other() {
    let rows = rows(GUIDE, "| technique | variants");
    assert_eq!(rows.len(), TECHNIQUES.len());
    for (entry, (name, rest)) in TECHNIQUES.iter().zip(rows) {
        assert_eq!(entry.name, name);
        let said: Vec<_> = rest.split('`').skip(1).step_by(2).collect();
        let variants = entry.variants.iter().map(|v| v.name);
        let is: Vec<_> = variants.chain(entry.settings.iter().map(|s| s.key)).collect();
        assert_eq!(said, is, "{name}");
    }
}

#[test]
fn every_subcommand_is_shown() {
    for command in cuesta::internal::cli::command().get_subcommands() {
        assert!(GUIDE.contains(&format!("cuesta {}", command.get_name())), "{}", command.get_name());
    }
}
