//! Leaves out of a kernel what its constants rule out, before drivers see it.
//!
//! A kernel is compiled with the scene's needs as constants (`HAS_…`, [`crate::pack::features`]), and glslang keeps what they rule out:
//! `if (HAS_GRIDS && …)` becomes a branch over a value that is never true. Drivers find that out late, after they have put every
//! function in the place of its calls, and take most of their time for what they then leave out.
//!
//! Here truth values are followed through logical operations, joins of control flow and branches (sparse conditional constant propagation:
//! Wegman and Zadeck 1991, "Constant propagation with conditional branches"); what cannot be reached goes, and with it functions that
//! nothing calls. Numbers and memory are not followed: what a kernel computes stays the same to the last bit.

use rspirv::binary::Assemble;
use rspirv::dr::{Block, Function, Instruction, Module, Operand, load_words};
use rspirv::spirv::{Op, Word};
use std::collections::{HashMap, HashSet};

/// The same kernel without what cannot be reached.
///
/// # Errors
/// What is wrong with the code, if it is no SPIR-V.
pub fn prune(code: &[u32]) -> Result<Vec<u32>, String> {
    let mut module = load_words(code).map_err(|error| error.to_string())?;
    let constants: HashMap<Word, bool> = (module.types_global_values.iter())
        .filter_map(|instruction| match instruction.class.opcode {
            Op::ConstantTrue => Some((instruction.result_id?, true)),
            Op::ConstantFalse => Some((instruction.result_id?, false)),
            _ => None,
        })
        .collect();
    for function in &mut module.functions {
        if let Some(flow) = Flow::of(function, &constants) {
            flow.rewrite(function);
        }
    }
    drop_uncalled(&mut module);
    drop_remarks(&mut module);
    Ok(module.assemble())
}

/// What is known of a truth value: nothing has reached it yet, one value has, or it can be both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Truth {
    Unreached,
    Always(bool),
    Either,
}

impl Truth {
    fn join(self, other: Truth) -> Truth {
        match (self, other) {
            (Truth::Unreached, truth) | (truth, Truth::Unreached) => truth,
            (one, two) if one == two => one,
            _ => Truth::Either,
        }
    }
}

/// Which ways through a function can be taken.
struct Flow {
    truths: HashMap<Word, Truth>,
    /// Labels of blocks.
    reached: HashSet<Word>,
    /// From block to block.
    edges: HashSet<(Word, Word)>,
    /// Labels of the blocks at which loops begin.
    heads: HashSet<Word>,
}

impl Flow {
    /// Nothing, for a function that joins values at the head of a loop or at its continue target: it stays as it is. glslang keeps such
    /// values in memory.
    fn of(function: &Function, constants: &HashMap<Word, bool>) -> Option<Flow> {
        let joins: HashSet<Word> = (function.blocks.iter())
            .filter(|block| block.instructions.iter().any(|instruction| instruction.class.opcode == Op::Phi))
            .filter_map(Block::label_id)
            .collect();
        let mut heads = HashSet::new();
        let mut truths: HashMap<Word, Truth> =
            constants.iter().map(|(id, value)| (*id, Truth::Always(*value))).collect();
        for block in &function.blocks {
            let label = block.label_id()?;
            for instruction in &block.instructions {
                match instruction.class.opcode {
                    Op::LoopMerge if joins.contains(&label) || joins.contains(&id(instruction, 1)?) => return None,
                    Op::LoopMerge => {
                        heads.insert(label);
                    }
                    Op::Phi | Op::LogicalAnd | Op::LogicalOr | Op::LogicalNot => {
                        truths.insert(instruction.result_id?, Truth::Unreached);
                    }
                    _ => {}
                }
            }
        }
        let mut flow = Flow { truths, reached: HashSet::new(), edges: HashSet::new(), heads };
        flow.reached.insert(function.blocks.first()?.label_id()?);
        // Ways are only ever added, and values only ever become less certain, so this ends.
        while function.blocks.iter().fold(false, |changed, block| flow.pass(block).unwrap_or(false) | changed) {}
        Some(flow)
    }

    fn truth(&self, id: Word) -> Truth {
        self.truths.get(&id).copied().unwrap_or(Truth::Either)
    }

    /// Follows a block; whether anything is new.
    fn pass(&mut self, block: &Block) -> Option<bool> {
        let label = block.label_id()?;
        if !self.reached.contains(&label) {
            return Some(false);
        }
        let mut changed = false;
        for instruction in &block.instructions {
            let operand = |index| id(instruction, index).map(|id| self.truth(id));
            let truth = match instruction.class.opcode {
                Op::Phi => incoming(instruction)
                    .filter(|(_, from)| self.edges.contains(&(*from, label)))
                    .fold(Truth::Unreached, |truth, (value, _)| truth.join(self.truth(value))),
                Op::LogicalNot => match operand(0)? {
                    Truth::Always(value) => Truth::Always(!value),
                    other => other,
                },
                Op::LogicalAnd => either_decides(operand(0)?, operand(1)?, false),
                Op::LogicalOr => either_decides(operand(0)?, operand(1)?, true),
                _ => continue,
            };
            changed |= self.truths.insert(instruction.result_id?, truth) != Some(truth);
        }
        for target in self.targets(block) {
            changed |= self.edges.insert((label, target)) | self.reached.insert(target);
        }
        Some(changed)
    }

    /// Where a block that is reached can go to, as far as is known.
    fn targets(&self, block: &Block) -> Vec<Word> {
        let Some(last) = block.instructions.last() else { return Vec::new() };
        if last.class.opcode != Op::BranchConditional {
            let labels = last.operands.iter().filter_map(Operand::id_ref_any);
            return match last.class.opcode {
                Op::Branch => labels.collect(),
                // The first is the selector.
                Op::Switch => labels.skip(1).collect(),
                _ => Vec::new(),
            };
        }
        let [Some(condition), Some(yes), Some(no)] = [0, 1, 2].map(|index| id(last, index)) else { return Vec::new() };
        match self.truth(condition) {
            Truth::Unreached => Vec::new(),
            // A loop keeps its way back, even if it is never taken: that makes it a loop.
            Truth::Always(true) if !self.heads.contains(&no) => vec![yes],
            Truth::Always(false) if !self.heads.contains(&yes) => vec![no],
            _ => vec![yes, no],
        }
    }

    /// Leaves out blocks that are not reached, and branches to them. Of those that structure asks for, the ends of constructs stay as
    /// places that are never reached, and the continue targets of loops as ways back to their heads.
    fn rewrite(&self, function: &mut Function) {
        let is_reached = |block: &Block| block.label_id().is_some_and(|label| self.reached.contains(&label));
        // The ends of constructs, and continue targets with their heads.
        let (mut ends, mut continues) = (HashSet::new(), HashMap::new());
        for block in function.blocks.iter_mut().filter(|block| is_reached(block)) {
            self.rewrite_branch(block);
            for instruction in &block.instructions {
                let label = |index| id(instruction, index);
                match instruction.class.opcode {
                    Op::SelectionMerge => ends.extend(label(0)),
                    Op::LoopMerge => {
                        ends.extend(label(0));
                        continues.extend(label(1).zip(block.label_id()));
                    }
                    _ => {}
                }
            }
        }
        function.blocks.retain_mut(|block| {
            let Some(label) = block.label_id() else { return true };
            if self.reached.contains(&label) {
                return true;
            }
            let (opcode, operands) = match continues.get(&label) {
                Some(head) => (Op::Branch, vec![Operand::IdRef(*head)]),
                None => (Op::Unreachable, Vec::new()),
            };
            block.instructions = vec![Instruction::new(opcode, None, None, operands)];
            opcode == Op::Branch || ends.contains(&label)
        });
    }

    fn rewrite_branch(&self, block: &mut Block) {
        let Some(label) = block.label_id() else { return };
        for instruction in block.instructions.iter_mut().filter(|instruction| instruction.class.opcode == Op::Phi) {
            let taken = incoming(instruction).filter(|(_, from)| self.edges.contains(&(*from, label)));
            instruction.operands = taken.flat_map(|(value, from)| [value, from]).map(Operand::IdRef).collect();
        }
        let decided = (block.instructions.last())
            .filter(|last| last.class.opcode == Op::BranchConditional)
            .and_then(|last| id(last, 0))
            .is_some_and(|condition| matches!(self.truth(condition), Truth::Always(_)));
        if let (true, &[target]) = (decided, self.targets(block).as_slice()) {
            block.instructions.pop();
            block.instructions.retain(|instruction| instruction.class.opcode != Op::SelectionMerge);
            block.instructions.push(Instruction::new(Op::Branch, None, None, vec![Operand::IdRef(target)]));
        }
    }
}

/// A conjunction if `decisive` is false, a disjunction if it is true.
fn either_decides(one: Truth, two: Truth, decisive: bool) -> Truth {
    match (one, two) {
        (Truth::Always(value), _) | (_, Truth::Always(value)) if value == decisive => Truth::Always(decisive),
        (Truth::Unreached, _) | (_, Truth::Unreached) => Truth::Unreached,
        (Truth::Always(_), other) | (other, Truth::Always(_)) => other,
        _ => Truth::Either,
    }
}

/// The id that is an operand of an instruction.
fn id(instruction: &Instruction, operand: usize) -> Option<Word> {
    instruction.operands.get(operand)?.id_ref_any()
}

/// The values of a phi, each with the block that it comes from.
fn incoming(phi: &Instruction) -> impl Iterator<Item = (Word, Word)> {
    phi.operands.chunks_exact(2).filter_map(|pair| Some((pair[0].id_ref_any()?, pair[1].id_ref_any()?)))
}

/// Leaves out functions that no entry point reaches.
fn drop_uncalled(module: &mut Module) {
    let called: HashMap<Word, Vec<Word>> = (module.functions.iter())
        .filter_map(|function| {
            let calls = function.all_inst_iter().filter(|instruction| instruction.class.opcode == Op::FunctionCall);
            Some((function.def_id()?, calls.filter_map(|call| id(call, 0)).collect()))
        })
        .collect();
    let mut open: Vec<Word> = module.entry_points.iter().filter_map(|entry| id(entry, 1)).collect();
    let mut needed = HashSet::new();
    while let Some(function) = open.pop() {
        if needed.insert(function) {
            open.extend(called.get(&function).into_iter().flatten());
        }
    }
    module.functions.retain(|function| function.def_id().is_some_and(|id| needed.contains(&id)));
}

/// Leaves out names and decorations of what is no longer there.
fn drop_remarks(module: &mut Module) {
    let there: HashSet<Word> = module.all_inst_iter().filter_map(|instruction| instruction.result_id).collect();
    let is_there = |remark: &Instruction| id(remark, 0).is_some_and(|target| there.contains(&target));
    module.debug_names.retain(is_there);
    module.annotations.retain(is_there);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shader::{ShaderSourceText, translate};

    /// A kernel with a body, before and after.
    fn kernel(body: &str) -> [Module; 2] {
        let head = "#version 460\nlayout(local_size_x = 1) in;\nlayout(std430, binding = 0) buffer Values { uint values[]; };\n";
        let text = format!(
            "{head}const bool YES = true, NO = false;\nuint f() {{ return values[7]; }}\nuint g() {{ return values[8]; }}\n\
             void main() {{ bool some = values[1] > 2u;\n{body}\n}}\n"
        );
        let code = translate(&ShaderSourceText { name: "test".into(), text }).unwrap();
        [code.clone(), prune(&code).unwrap()].map(|code| load_words(code).unwrap())
    }

    fn count(module: &Module, opcode: Op) -> usize {
        module.all_inst_iter().filter(|instruction| instruction.class.opcode == opcode).count()
    }

    /// Asserts that all blocks that are named are there, that each loop has one way back, and that phis have a value for each block that
    /// comes before.
    fn check_structure(module: &Module) {
        for function in &module.functions {
            let labels: Vec<Word> = function.blocks.iter().filter_map(Block::label_id).collect();
            let place = |label: Word| labels.iter().position(|other| *other == label).expect("a block that is there");
            let mut before = vec![HashSet::new(); labels.len()];
            for (from, block) in function.blocks.iter().enumerate() {
                let last = block.instructions.last().unwrap();
                let skipped = match last.class.opcode {
                    Op::Branch => 0,
                    Op::BranchConditional | Op::Switch => 1,
                    _ => continue,
                };
                for target in last.operands.iter().filter_map(Operand::id_ref_any).skip(skipped) {
                    before[place(target)].insert(from);
                }
            }
            for (index, instruction) in (function.blocks.iter().enumerate())
                .flat_map(|(index, block)| block.instructions.iter().map(move |instruction| (index, instruction)))
            {
                match instruction.class.opcode {
                    Op::SelectionMerge => assert!(place(id(instruction, 0).unwrap()) > index),
                    Op::LoopMerge => {
                        assert!(
                            place(id(instruction, 0).unwrap()) > index && place(id(instruction, 1).unwrap()) > index
                        );
                        assert_eq!(before[index].iter().filter(|from| **from >= index).count(), 1, "ways back");
                    }
                    Op::Phi => {
                        let from: HashSet<usize> = incoming(instruction).map(|(_, from)| place(from)).collect();
                        assert_eq!(from, before[index]);
                    }
                    _ => {}
                }
            }
        }
    }

    /// Branches and functions that are left of a body.
    fn left(body: &str) -> (usize, usize) {
        let [before, after] = kernel(body);
        check_structure(&before);
        check_structure(&after);
        (count(&after, Op::BranchConditional), after.functions.len())
    }

    #[test]
    fn what_constants_rule_out_goes() {
        assert_eq!(left("if (NO) { values[0] = f(); }"), (0, 1));
        assert_eq!(left("if (NO && some) { values[0] = f(); }"), (0, 1));
        assert_eq!(left("if (some && NO) { values[0] = f(); } else { values[0] = g(); }"), (0, 2));
        assert_eq!(left("if (!(YES || some)) { values[0] = f(); } else { values[0] = g(); }"), (0, 2));
        assert_eq!(left("if (!YES || (NO && some)) { values[0] = f(); return; } values[0] = g();"), (0, 2));
        assert_eq!(left("values[0] = YES ? g() : f();"), (0, 2));
        assert_eq!(left("for (uint i = 0u; NO && i < values[2]; i++) { values[i] = f(); }"), (0, 1));
        assert_eq!(left("do { values[0] = g(); } while (NO && some);"), (1, 2));
        assert_eq!(
            left("while (some || YES) { if (some && NO) { values[0] = f(); } else if (values[2] > 1u) { break; } }"),
            (1, 1)
        );
        assert_eq!(left("while (true) { values[0] = g(); if (YES) { break; } values[1] = f(); }"), (0, 2));
    }

    #[test]
    fn what_they_leave_open_stays() {
        assert_eq!(left("if (some) { values[0] = f(); } else { values[0] = g(); }"), (1, 3));
        assert_eq!(left("if (YES && some) { values[0] = f(); }"), (1, 2));
        assert_eq!(left("if (some) { values[0] = f(); return; } else { values[0] = g(); return; }"), (1, 3));
        assert_eq!(left("if (NO || some) { values[0] = f(); } else { values[0] = g(); }"), (1, 3));
        assert_eq!(left("bool all = true; if (some) { all = false; } if (all) { values[0] = f(); }"), (2, 2));
        assert_eq!(
            left("for (uint i = 0u; i < values[2]; i++) { if (i > 3u && some) { continue; } values[i] = f(); }"),
            (2, 2)
        );
        assert_eq!(left("switch (values[3]) { case 1u: values[0] = f(); break; case 2u: values[0] = g(); }"), (0, 3));
    }

    #[test]
    fn nothing_is_said_of_what_is_gone() {
        let [before, after] = kernel(
            "precise float a = float(values[0]); if (NO) { precise float b = a * 2.0; values[0] = uint(b) + f(); }",
        );
        assert!(count(&before, Op::FMul) == 1 && count(&after, Op::FMul) == 0);
        assert!(count(&after, Op::Decorate) < count(&before, Op::Decorate) && count(&after, Op::Decorate) > 0);
        let names = |module: &Module| module.debug_names.len();
        assert!(names(&after) < names(&before) && names(&after) > 0);
    }

    #[test]
    fn what_is_no_code_is_an_error() {
        prune(&[1, 2, 3]).unwrap_err();
    }
}
