//! Counts the instructions of a shader that are left once its specialization constants are known.
//!
//! Constants are folded, branches that they decide are followed one way only, and unused results are not counted (sparse
//! conditional constant propagation, Wegman & Zadeck 1991). A driver does at least that.

use std::collections::{BTreeMap, BTreeSet};

use rspirv::dr::{self, Function, Instruction, Operand};
use rspirv::spirv::{Decoration, Op, Word};

type Values = BTreeMap<Word, u32>;

/// Returns the number of instructions that can run in the entry point and its callees, without labels and merges.
/// `constants` are the specialization constants in the order of their ids; further ones have their defaults.
///
/// # Panics
/// If the words are not SPIR-V.
pub fn instructions(words: &[u32], constants: &[u32]) -> usize {
    let module = dr::load_words(words).expect("SPIR-V of our own compiler");
    let globals = globals(&module, constants);
    let mut called: Vec<Word> = module.entry_points.iter().filter_map(|entry| ids(entry).next()).collect();
    let mut seen = BTreeSet::new();
    let mut count = 0;
    while let Some(id) = called.pop() {
        let function = module.functions.iter().find(|f| f.def.as_ref().and_then(|def| def.result_id) == Some(id));
        if let (true, Some(function)) = (seen.insert(id), function) {
            let live = live(function, &globals);
            count += live.len();
            called.extend(live.iter().filter(|i| i.class.opcode == Op::FunctionCall).filter_map(|i| ids(i).next()));
        }
    }
    count
}

fn ids(instruction: &Instruction) -> impl Iterator<Item = Word> {
    instruction.operands.iter().filter_map(|operand| match operand {
        Operand::IdRef(id) => Some(*id),
        _ => None,
    })
}

fn literals(instruction: &Instruction) -> impl Iterator<Item = u32> {
    instruction.operands.iter().filter_map(|operand| match operand {
        Operand::LiteralBit32(value) => Some(*value),
        _ => None,
    })
}

/// Values of the constants of at most 32 bits; `true` is 1.
fn globals(module: &dr::Module, constants: &[u32]) -> Values {
    let is_id = |i: &&Instruction| i.operands.get(1) == Some(&Operand::Decoration(Decoration::SpecId));
    let decorated = module.annotations.iter().filter(is_id);
    let given: Values =
        decorated.filter_map(|i| Some((ids(i).next()?, *constants.get(literals(i).next()? as usize)?))).collect();
    let mut values = Values::new();
    for instruction in &module.types_global_values {
        let Some(id) = instruction.result_id else { continue };
        let own = match instruction.class.opcode {
            Op::ConstantTrue | Op::SpecConstantTrue => Some(1),
            Op::ConstantFalse | Op::SpecConstantFalse => Some(0),
            Op::Constant | Op::SpecConstant => literals(instruction).next(),
            Op::SpecConstantOp => match instruction.operands.first() {
                Some(Operand::LiteralSpecConstantOpInteger(op)) => folded(*op, instruction, &values),
                _ => None,
            },
            _ => None,
        };
        if let Some(value) = given.get(&id).copied().or(own) {
            values.insert(id, value);
        }
    }
    values
}

/// Result of an operation, if its known operands decide it.
fn folded(op: Op, instruction: &Instruction, values: &Values) -> Option<u32> {
    let operands: Vec<Option<u32>> = ids(instruction).map(|id| values.get(&id).copied()).collect();
    let flag = |is: bool| Some(u32::from(is));
    match (op, operands.as_slice()) {
        (Op::LogicalAnd, [Some(0), _] | [_, Some(0)]) => Some(0),
        (Op::LogicalOr, [Some(1), _] | [_, Some(1)]) => Some(1),
        (Op::LogicalAnd, &[Some(a), Some(b)]) => Some(a & b),
        (Op::LogicalOr, &[Some(a), Some(b)]) => Some(a | b),
        (Op::LogicalNot, &[Some(a)]) => Some(1 - a),
        (Op::LogicalEqual | Op::IEqual, &[Some(a), Some(b)]) => flag(a == b),
        (Op::LogicalNotEqual | Op::INotEqual, &[Some(a), Some(b)]) => flag(a != b),
        (Op::UGreaterThan, &[Some(a), Some(b)]) => flag(a > b),
        (Op::UGreaterThanEqual, &[Some(a), Some(b)]) => flag(a >= b),
        (Op::ULessThan, &[Some(a), Some(b)]) => flag(a < b),
        (Op::ULessThanEqual, &[Some(a), Some(b)]) => flag(a <= b),
        (Op::Select, &[Some(condition), a, b]) => {
            if condition == 1 {
                a
            } else {
                b
            }
        }
        _ => None,
    }
}

/// The instructions of a function that can run and have an effect.
fn live<'a>(function: &'a Function, globals: &Values) -> Vec<&'a Instruction> {
    let (reached, values) = reached(function, globals);
    let running: Vec<_> = reached.into_iter().flat_map(|block| &function.blocks[block].instructions).collect();
    let known = |i: &Instruction| i.result_id.is_some_and(|id| values.contains_key(&id));
    let defined: BTreeMap<Word, &Instruction> = running.iter().filter_map(|i| Some((i.result_id?, *i))).collect();
    let local = |i: &Instruction| local_variable(i, &defined);
    let mut needed: Vec<&Instruction> = running.iter().copied().filter(|i| acts(i) && local(i).is_none()).collect();
    let mut found = BTreeSet::new();
    while let Some(instruction) = needed.pop() {
        if known(instruction) || !found.insert(std::ptr::from_ref(instruction)) {
            continue;
        }
        needed.extend(ids(instruction).filter_map(|id| defined.get(&id).copied()));
        if instruction.class.opcode == Op::Variable {
            // The variable is read: stores to it have an effect.
            needed.extend(running.iter().copied().filter(|i| local(i) == instruction.result_id));
        }
    }
    running.into_iter().filter(|i| found.contains(&std::ptr::from_ref(*i))).collect()
}

/// The local variable to which an instruction stores, if any.
fn local_variable(store: &Instruction, defined: &BTreeMap<Word, &Instruction>) -> Option<Word> {
    if store.class.opcode != Op::Store {
        return None;
    }
    let mut target = *defined.get(&ids(store).next()?)?;
    while target.class.opcode == Op::AccessChain {
        target = defined.get(&ids(target).next()?)?;
    }
    target.result_id.filter(|_| target.class.opcode == Op::Variable)
}

/// Returns true if an instruction has an effect beside its result.
fn acts(instruction: &Instruction) -> bool {
    let op = instruction.class.opcode;
    match op {
        Op::SelectionMerge | Op::LoopMerge | Op::Branch => false,
        Op::FunctionCall | Op::ImageWrite => true,
        _ => instruction.result_id.is_none() || format!("{op:?}").starts_with("Atomic"),
    }
}

/// The reachable blocks, and the known values of the function.
fn reached(function: &Function, globals: &Values) -> (BTreeSet<usize>, Values) {
    let place: BTreeMap<Word, usize> = function
        .blocks
        .iter()
        .enumerate()
        .filter_map(|(k, block)| Some((block.label.as_ref()?.result_id?, k)))
        .collect();
    let label = |block: usize| function.blocks[block].label.as_ref().and_then(|label| label.result_id);
    let (mut blocks, mut edges) = (BTreeSet::from([0]), BTreeSet::new());
    loop {
        let mut values = globals.clone();
        let mut found = edges.clone();
        for &block in &blocks {
            let Some(own) = label(block) else { continue };
            for instruction in &function.blocks[block].instructions {
                let value = match instruction.class.opcode {
                    Op::Phi => joined(instruction, own, &edges, &values),
                    op => folded(op, instruction, &values),
                };
                if let (Some(id), Some(value)) = (instruction.result_id, value) {
                    values.insert(id, value);
                }
                found.extend(targets(instruction, &values).into_iter().map(|to| (own, to)));
            }
        }
        if found == edges {
            return (blocks, values);
        }
        blocks.extend(found.iter().filter_map(|(_, to)| place.get(to)));
        edges = found;
    }
}

/// Possible targets of a branch.
fn targets(branch: &Instruction, values: &Values) -> Vec<Word> {
    let operands: Vec<Word> = ids(branch).collect();
    match branch.class.opcode {
        Op::Branch => operands,
        Op::BranchConditional => match values.get(&operands[0]) {
            Some(&condition) => vec![operands[if condition == 1 { 1 } else { 2 }]],
            None => operands[1..3].to_vec(),
        },
        Op::Switch => match values.get(&operands[0]) {
            Some(selector) => {
                let case = literals(branch).position(|literal| literal == *selector);
                vec![operands[case.map_or(1, |case| case + 2)]]
            }
            None => operands[1..].to_vec(),
        },
        _ => Vec::new(),
    }
}

/// Value of a phi, if all edges found so far bring the same one.
fn joined(phi: &Instruction, block: Word, edges: &BTreeSet<(Word, Word)>, values: &Values) -> Option<u32> {
    let operands: Vec<Word> = ids(phi).collect();
    let mut coming = operands.chunks_exact(2).filter(|pair| edges.contains(&(pair[1], block)));
    let first = values.get(&coming.next()?[0]).copied()?;
    coming.all(|pair| values.get(&pair[0]) == Some(&first)).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders;
    use crate::plan::{Colour, SceneConstants};

    /// A constant that is off removes instructions of the fragment shader.
    #[test]
    fn what_constants_decide_is_not_counted() {
        let words = shaders::words("terrain.frag");
        let off = SceneConstants::default();
        let count = |constants: SceneConstants| instructions(&words, &constants.words());
        let lean = count(off);
        let [holes, fog] = [SceneConstants { holes: true, ..off }, SceneConstants { fog: true, ..off }].map(count);
        let overlay = count(SceneConstants { colour: Colour::Overlay, ..off });
        println!("terrain.frag: {lean} instructions; holes {holes}, fog {fog}, overlay {overlay}");
        assert!(lean > 50 && holes > lean && fog > lean);
        assert_ne!(overlay, lean);
        // All instructions of the module, live or not.
        let module = dr::load_words(&words).unwrap();
        let all: usize = module.functions.iter().flat_map(|f| &f.blocks).map(|block| block.instructions.len()).sum();
        assert!(instructions(&words, &[1; 13]) < all && fog < all);
    }
}
