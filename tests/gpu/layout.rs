//! Tests that the structs of `draw/layout.rs` have the same offsets in the compiled SPIR-V.

use std::collections::{BTreeMap, BTreeSet};

use cuesta::internal::draw::layout;
use cuesta::internal::gpu::shaders;
use cuesta::internal::lod::clusters;

/// Returns the member offsets of every named struct of a module: struct name → member name → offset.
fn offsets(words: &[u32]) -> BTreeMap<String, BTreeMap<String, u32>> {
    let text = |words: &[u32]| {
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
        String::from_utf8(bytes).unwrap()
    };
    let (mut names, mut members, mut found) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
    let mut at = 5;
    while at < words.len() {
        let (count, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let operands = &words[at + 1..at + count];
        match op {
            5 => drop(names.insert(operands[0], text(&operands[1..]))),
            6 => drop(members.insert((operands[0], operands[1]), text(&operands[2..]))),
            // OpMemberDecorate … Offset
            72 if operands[2] == 35 => found.push((operands[0], operands[1], operands[3])),
            _ => {}
        }
        at += count;
    }
    let mut structs: BTreeMap<String, BTreeMap<String, u32>> = BTreeMap::new();
    for (id, member, offset) in found {
        if let (Some(name), Some(member)) = (names.get(&id), members.get(&(id, member))) {
            structs.entry(name.clone()).or_default().insert(member.clone(), offset);
        }
    }
    structs
}

#[test]
fn shared_structs_have_the_same_offsets_on_both_sides() {
    let mut seen = BTreeSet::new();
    for (shader, _) in shaders::SHADERS {
        let compiled = offsets(&shaders::words(shader));
        for (name, _, fields) in layout::structs().into_iter().chain(clusters::layout::structs()) {
            let Some(members) = compiled.get(name) else { continue };
            for (field, offset) in fields {
                let there = members.get(field).unwrap_or_else(|| panic!("{shader}: {name} lacks {field}"));
                assert_eq!(*there as usize, offset, "{shader}: {name}.{field}");
            }
            seen.insert(name);
        }
    }
    // The others reach shaders as vertex attributes only, whose offsets are the host's own.
    assert!(
        ["Frame", "Camera", "HeightMap", "Lighting", "Instance", "ExplicitVertex", "ClusterView", "ClusterTree"]
            .iter()
            .all(|name| seen.contains(name)),
        "{seen:?}"
    );
}
