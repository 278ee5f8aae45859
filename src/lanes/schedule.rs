//! From a list of operations to instructions on rows: dead operations dropped, pairs fused, rows used again.

use super::flat::{Binary, Id, Op, Ops, Unary};
use std::collections::HashMap;

/// A row of the register file: one value per lane.
pub type Row = u16;

/// The first of two operations done in one instruction; each is rounded by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inner {
    Add,
    Subtract,
    Multiply,
}

/// The second of two operations done in one instruction, on the first one's result i and another value z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outer {
    Add,
    /// i - z
    Subtract,
    /// z - i
    SubtractFrom,
    Multiply,
    /// i / z
    Divide,
    /// z / i
    DivideInto,
    /// max(i, z), z a literal
    MaxLiteral,
    /// min(i, z), z a literal
    MinLiteral,
    /// min(i, z)
    Min,
}

/// What an instruction does with its source rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    Copy,
    Unary(Unary),
    Binary(Binary),
    /// max(x, y) with a literal y, which is not NaN.
    MaxLiteral,
    /// min(x, y) with a literal y.
    MinLiteral,
    /// Condition, accept, reject.
    Select,
    /// x, y, accept, reject: accept where x < y.
    SelectLess,
    /// x, y, accept, reject: accept where x <= y.
    SelectLessEqual,
    /// inner(x, y), then outer with z.
    Pair(Inner, Outer),
}

/// One instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    pub code: Code,
    /// Row written; never one that is read.
    pub to: Row,
    /// Rows read; those not needed repeat the first.
    pub from: [Row; 4],
}

/// Rows given out so far.
#[derive(Debug, Default)]
pub struct Rows {
    count: Row,
    free: Vec<Row>,
}

impl Rows {
    /// A row that is never used for anything else.
    pub fn pin(&mut self) -> Row {
        self.count += 1;
        self.count - 1
    }

    pub fn count(&self) -> usize {
        usize::from(self.count)
    }

    fn take(&mut self) -> Row {
        self.free.pop().unwrap_or_else(|| self.pin())
    }
}

/// Instructions for one list of wanted operations.
pub struct Schedule {
    pub steps: Vec<Step>,
    /// The row of each wanted operation.
    pub wanted: Vec<Row>,
}

/// Schedules what `wanted` needs. Operations in `bound` are in rows already; a wanted one may name the row it must go to.
pub fn schedule(ops: &Ops, bound: &HashMap<Id, Row>, wanted: &[(Id, Option<Row>)], rows: &mut Rows) -> Schedule {
    let mut uses = vec![0_usize; ops.len()];
    for (id, _) in wanted {
        uses[*id] += 1;
    }
    for id in (0..ops.len()).rev() {
        if uses[id] > 0 && !bound.contains_key(&id) {
            for operand in ops.get(id).operands() {
                uses[operand] += 1;
            }
        }
    }
    let lone = |id: Id| uses[id] == 1 && !bound.contains_key(&id) && wanted.iter().all(|(w, _)| *w != id);
    let mut absorbed = vec![false; ops.len()];
    let mut plan: Vec<(Id, Code, Vec<Id>)> = Vec::new();
    // From the end, so that an operation that was absorbed absorbs nothing itself.
    for id in (0..ops.len()).rev() {
        if uses[id] == 0 || bound.contains_key(&id) || absorbed[id] {
            continue;
        }
        let (code, sources, inner) = fused(ops, ops.get(id), &lone);
        if let Some(inner) = inner {
            absorbed[inner] = true;
        }
        plan.push((id, code, sources));
    }
    plan.reverse();

    let mut last_use: HashMap<Id, usize> = HashMap::new();
    for (position, (_, _, sources)) in plan.iter().enumerate() {
        for source in sources {
            last_use.insert(*source, position);
        }
    }
    for (id, _) in wanted {
        last_use.insert(*id, usize::MAX);
    }
    let mut place: HashMap<Id, Row> = HashMap::new();
    let mut steps = Vec::new();
    let mut taken = Vec::new();
    for (position, (id, code, sources)) in plan.into_iter().enumerate() {
        let read: Vec<Row> = sources.iter().map(|s| *bound.get(s).unwrap_or_else(|| &place[s])).collect();
        let target = wanted.iter().find_map(|(w, target)| target.filter(|_| *w == id));
        let to = target.unwrap_or_else(|| {
            let row = rows.take();
            taken.push(row);
            row
        });
        place.insert(id, to);
        let at = |i: usize| *read.get(i).unwrap_or(&read[0]);
        steps.push(Step { code, to, from: [at(0), at(1), at(2), at(3)] });
        let mut done: Vec<Id> = sources.into_iter().filter(|s| last_use[s] == position).collect();
        done.sort_unstable();
        done.dedup();
        rows.free.extend(done.iter().filter(|s| !bound.contains_key(s)).map(|s| place[s]).filter(|r| taken.contains(r)));
    }
    let mut results = Vec::new();
    for (id, target) in wanted {
        let row = *bound.get(id).unwrap_or_else(|| &place[id]);
        match target {
            Some(target) if *target != row => {
                steps.push(Step { code: Code::Copy, to: *target, from: [row; 4] });
                results.push(*target);
            }
            _ => results.push(row),
        }
    }
    // Results are read before another schedule runs, so that all of these rows are scratch again.
    rows.free.extend(taken);
    rows.free.sort_unstable();
    rows.free.dedup();
    Schedule { steps, wanted: results }
}

/// The instruction for an operation, its sources, and the operation that it absorbs.
fn fused(ops: &Ops, op: Op, lone: &impl Fn(Id) -> bool) -> (Code, Vec<Id>, Option<Id>) {
    let inner = |id: Id| match ops.get(id) {
        Op::Binary(Binary::Add, a, b) if lone(id) => Some((Inner::Add, a, b)),
        Op::Binary(Binary::Subtract, a, b) if lone(id) => Some((Inner::Subtract, a, b)),
        Op::Binary(Binary::Multiply, a, b) if lone(id) => Some((Inner::Multiply, a, b)),
        _ => None,
    };
    let is_literal = |id: Id| ops.literal(id).is_some();
    match op {
        Op::Binary(b, left, right) => {
            let outer = |first: bool| match b {
                Binary::Add => Some(Outer::Add),
                Binary::Subtract => Some(if first { Outer::Subtract } else { Outer::SubtractFrom }),
                Binary::Multiply => Some(Outer::Multiply),
                Binary::Divide => Some(if first { Outer::Divide } else { Outer::DivideInto }),
                Binary::Max if is_literal(if first { right } else { left }) => Some(Outer::MaxLiteral),
                Binary::Min if is_literal(if first { right } else { left }) => Some(Outer::MinLiteral),
                Binary::Min if first => Some(Outer::Min),
                _ => None,
            };
            for (id, z, first) in [(left, right, true), (right, left, false)] {
                if let (Some((i, x, y)), Some(o)) = (inner(id), outer(first)) {
                    return (Code::Pair(i, o), vec![x, y, z], Some(id));
                }
            }
            let (code, left, right) = match b {
                Binary::Max if is_literal(right) => (Code::MaxLiteral, left, right),
                Binary::Max if is_literal(left) => (Code::MaxLiteral, right, left),
                Binary::Min if is_literal(right) => (Code::MinLiteral, left, right),
                Binary::Min if is_literal(left) => (Code::MinLiteral, right, left),
                _ => (Code::Binary(b), left, right),
            };
            (code, vec![left, right], None)
        }
        Op::Unary(u, a) => (Code::Unary(u), vec![a], None),
        Op::Select { condition, accept, reject } => match ops.get(condition) {
            Op::Binary(Binary::Less, x, y) if lone(condition) => {
                (Code::SelectLess, vec![x, y, accept, reject], Some(condition))
            }
            Op::Binary(Binary::LessEqual, x, y) if lone(condition) => {
                (Code::SelectLessEqual, vec![x, y, accept, reject], Some(condition))
            }
            _ => (Code::Select, vec![condition, accept, reject], None),
        },
        Op::Input(_) | Op::Constant(_) => unreachable!("inputs and literals are bound to rows"),
    }
}
