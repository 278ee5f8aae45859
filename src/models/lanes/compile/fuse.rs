//! Fuses operations into one instruction: two or three in a row, if no other operation needs the results between.

use super::code::{Code, Inner, Outer, TRIPLES};
use super::flat::{Binary, Id, Op, Ops};

/// A way to compute an operation, with others whose results no other operation needs.
#[derive(Debug, Clone)]
pub struct Way {
    pub code: Code,
    pub sources: Vec<Id>,
    pub absorbed: Vec<Id>,
}

/// The way to each operation with the fewest instructions. The results of `lone` operations are needed once.
pub fn shortest_ways(ops: &Ops, lone: &impl Fn(Id) -> bool) -> Vec<Option<Way>> {
    let mut instructions = vec![0; ops.len()];
    let mut shortest = Vec::new();
    for id in 0..ops.len() {
        let length = |way: &Way| 1 + way.sources.iter().filter(|s| lone(**s)).map(|s| instructions[*s]).sum::<usize>();
        let way = ways(ops, id, lone).into_iter().min_by_key(length);
        instructions[id] = way.as_ref().map_or(0, length);
        shortest.push(way);
    }
    shortest
}

/// All ways to compute an operation, those that absorb most first; none for an existing one.
fn ways(ops: &Ops, id: Id, lone: &impl Fn(Id) -> bool) -> Vec<Way> {
    let way =
        |code, sources: &[Id], absorbed: &[Id]| Way { code, sources: sources.to_vec(), absorbed: absorbed.to_vec() };
    match ops.get(id) {
        Op::Input(_) | Op::Constant(_) => Vec::new(),
        Op::Unary(unary, a) => vec![way(Code::Unary(unary), &[a], &[])],
        Op::Binary(kind, left, right) => of_two(ops, (kind, left, right), lone),
        Op::Select { condition, accept, reject } => {
            let absorbing = |code, x, y| way(code, &[x, y, accept, reject], &[condition]);
            vec![match ops.get(condition) {
                Op::Binary(Binary::Less, x, y) if lone(condition) => absorbing(Code::SelectLess, x, y),
                Op::Binary(Binary::LessEqual, x, y) if lone(condition) => absorbing(Code::SelectLessEqual, x, y),
                _ => way(Code::Select, &[condition, accept, reject], &[]),
            }]
        }
    }
}

/// The ways to compute an operation on two values: as the last of three, as the second of two, alone.
fn of_two(ops: &Ops, (kind, left, right): (Binary, Id, Id), lone: &impl Fn(Id) -> bool) -> Vec<Way> {
    let is_literal = |id: Id| ops.literal(id).is_some();
    let (mut found, mut pairs) = (Vec::new(), Vec::new());
    for (middle, z, is_left) in [(left, right, true), (right, left, false)] {
        if let (Some((second, a, b)), Some(last)) = (inner(ops, middle, lone), outer(kind, is_left, is_literal(z))) {
            for (begin, w, is_left) in [(a, b, true), (b, a, false)] {
                let Some((first, x, y)) = inner(ops, begin, lone) else { continue };
                let triple = (first, second.after(is_left), last);
                if TRIPLES.contains(&triple) {
                    let code = Code::Triple(triple.0, triple.1, triple.2);
                    found.push(Way { code, sources: vec![x, y, w, z], absorbed: vec![begin, middle] });
                }
            }
            pairs.push(Way { code: Code::Pair(second, last), sources: vec![a, b, z], absorbed: vec![middle] });
        }
        if let (Binary::Min, true, Op::Binary(Binary::Max, a, b)) = (kind, lone(middle), ops.get(middle)) {
            let (x, y) = if is_literal(b) || !is_literal(a) { (a, b) } else { (b, a) };
            let code = match (is_literal(y), is_literal(z)) {
                (true, true) => Code::ClampLiteral,
                (false, false) if is_left => Code::Clamp,
                _ => continue,
            };
            pairs.push(Way { code, sources: vec![x, y, z], absorbed: vec![middle] });
        }
    }
    let (code, x, y) = match kind {
        Binary::Max if is_literal(right) => (Code::MaxLiteral, left, right),
        Binary::Max if is_literal(left) => (Code::MaxLiteral, right, left),
        Binary::Min if is_literal(right) => (Code::MinLiteral, left, right),
        Binary::Min if is_literal(left) => (Code::MinLiteral, right, left),
        _ => (Code::Binary(kind), left, right),
    };
    found.append(&mut pairs);
    found.push(Way { code, sources: vec![x, y], absorbed: Vec::new() });
    found
}

/// An operation that another one may absorb, with its operands.
fn inner(ops: &Ops, id: Id, lone: &impl Fn(Id) -> bool) -> Option<(Inner, Id, Id)> {
    match ops.get(id) {
        Op::Binary(Binary::Add, a, b) if lone(id) => Some((Inner::Add, a, b)),
        Op::Binary(Binary::Subtract, a, b) if lone(id) => Some((Inner::Subtract, a, b)),
        Op::Binary(Binary::Multiply, a, b) if lone(id) => Some((Inner::Multiply, a, b)),
        _ => None,
    }
}

/// An operation that absorbs its first or its second operand; the other one may be a literal.
fn outer(kind: Binary, first: bool, other_is_literal: bool) -> Option<Outer> {
    match kind {
        Binary::Add => Some(Outer::Add),
        Binary::Subtract => Some(if first { Outer::Subtract } else { Outer::SubtractFrom }),
        Binary::Multiply => Some(Outer::Multiply),
        Binary::Divide => Some(if first { Outer::Divide } else { Outer::DivideInto }),
        Binary::Max if other_is_literal => Some(Outer::MaxLiteral),
        Binary::Min if other_is_literal => Some(Outer::MinLiteral),
        Binary::Min => Some(if first { Outer::Min } else { Outer::MinOf }),
        _ => None,
    }
}
