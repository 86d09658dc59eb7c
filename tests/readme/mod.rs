//! README lists the same techniques and subcommands as the tables.

use cuesta::internal::lod::TECHNIQUES;

const README: &str = include_str!("../../README.md");

/// Returns the rows of README's table of techniques: name, and the other cells.
fn rows() -> Vec<(String, String)> {
    let table = README.split("## Techniques").nth(1).and_then(|rest| rest.split("\n\n").nth(1)).expect("a table");
    let row = |line: &str| {
        let (name, rest) = line.trim_start_matches("| ").split_once('|').expect("cells");
        (name.trim().trim_matches('`').to_string(), rest.to_string())
    };
    table.lines().skip(2).map(row).collect()
}

#[test]
fn every_technique_variant_and_setting_is_named_and_no_other() {
    let rows = rows();
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
        assert!(README.contains(&format!("cuesta {}", command.get_name())), "{}", command.get_name());
    }
}
