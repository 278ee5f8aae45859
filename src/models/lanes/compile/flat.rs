//! A function as a list of operations on scalars, each operation once.

use std::collections::HashMap;

/// Position of an operation in a list.
pub type Id = usize;

/// Operations on one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unary {
    Negate,
    Not,
    Abs,
    Sqrt,
    Floor,
    Exponential,
    Logarithm,
    Sin,
    Cos,
}

/// Operations on two values. Truth values are numbers: 1 and 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Min,
    Max,
    Less,
    LessEqual,
    Equal,
    NotEqual,
    And,
    Or,
    Power,
}

/// One operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Op {
    /// An argument of the function, counted through all of its scalars.
    Input(usize),
    /// A literal, as the bits of its f32.
    Constant(u32),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    Select {
        condition: Id,
        accept: Id,
        reject: Id,
    },
}

impl Op {
    pub fn operands(&self) -> impl Iterator<Item = Id> {
        let operands = match *self {
            Op::Input(_) | Op::Constant(_) => [None; 3],
            Op::Unary(_, a) => [Some(a), None, None],
            Op::Binary(_, a, b) => [Some(a), Some(b), None],
            Op::Select { condition, accept, reject } => [Some(condition), Some(accept), Some(reject)],
        };
        operands.into_iter().flatten()
    }
}

/// Operations in a valid order; equal ones occur once.
#[derive(Debug, Clone, Default)]
pub struct Ops {
    ops: Vec<Op>,
    known: HashMap<Op, Id>,
}

impl Ops {
    pub fn get(&self, id: Id) -> Op {
        self.ops[id]
    }

    pub fn len(&self) -> usize {
        self.ops.len()
    }

    pub fn constant(&mut self, value: f32) -> Id {
        self.push(Op::Constant(value.to_bits()))
    }

    pub fn truth(&mut self, value: bool) -> Id {
        self.constant(f32::from(u8::from(value)))
    }

    /// The value of a literal.
    pub fn literal(&self, id: Id) -> Option<f32> {
        match self.ops[id] {
            Op::Constant(bits) => Some(f32::from_bits(bits)),
            _ => None,
        }
    }

    /// Adds an operation, or finds it. Only exact operations are computed here.
    pub fn push(&mut self, op: Op) -> Id {
        let op = match op {
            // The operands of a sum or product may be exchanged without changing a bit.
            Op::Binary(b @ (Binary::Add | Binary::Multiply), left, right) if left > right => Op::Binary(b, right, left),
            op => op,
        };
        match op {
            Op::Unary(Unary::Negate, a) => {
                if let Some(value) = self.literal(a) {
                    return self.constant(-value);
                }
            }
            Op::Unary(Unary::Not, a) => {
                if let Some(value) = self.literal(a) {
                    return self.truth(value == 0.0);
                }
            }
            Op::Select { condition, accept, reject } => {
                if accept == reject {
                    return accept;
                }
                if let Some(value) = self.literal(condition) {
                    return if value == 0.0 { reject } else { accept };
                }
            }
            _ => {}
        }
        let next = self.ops.len();
        let id = *self.known.entry(op).or_insert(next);
        if id == next {
            self.ops.push(op);
        }
        id
    }
}

/// A function of scalars.
#[derive(Debug, Clone)]
pub struct Flat {
    pub ops: Ops,
    /// Path of each scalar argument, such as `p.v_0`; an argument may be the same operation as another.
    pub inputs: Vec<(String, Id)>,
    /// Path and operation of each scalar of the result; the path of a scalar result is empty.
    pub outputs: Vec<(String, Id)>,
}

impl Flat {
    /// The operation of an argument.
    pub fn input(&self, path: &str) -> Option<Id> {
        self.inputs.iter().find(|(name, _)| name == path).map(|(_, id)| *id)
    }

    /// The operations with one result for all lanes, if these arguments have one value for all.
    pub fn shared(&self, arguments: &[&str]) -> Vec<bool> {
        let mut shared = vec![false; self.ops.len()];
        for (name, id) in &self.inputs {
            shared[*id] = arguments.contains(&name.as_str());
        }
        for id in 0..self.ops.len() {
            if !matches!(self.ops.get(id), Op::Input(_)) {
                shared[id] = self.ops.get(id).operands().all(|operand| shared[operand]);
            }
        }
        shared
    }

    /// The operation of a part of the result.
    pub fn output(&self, path: &str) -> Option<Id> {
        self.outputs.iter().find(|(name, _)| name == path).map(|(_, id)| *id)
    }
}
