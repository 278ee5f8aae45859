//! Instructions, and the rows that they use.

use super::flat::{Binary, Unary};

/// A row of the register file: one value per lane.
pub type Row = u16;

/// The first of operations done in one instruction; each is rounded separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inner {
    Add,
    Subtract,
    Multiply,
}

impl Inner {
    /// The same operation on the previous result, which is its left or right operand.
    pub fn after(self, is_left: bool) -> Outer {
        match self {
            Inner::Add => Outer::Add,
            Inner::Subtract if is_left => Outer::Subtract,
            Inner::Subtract => Outer::SubtractFrom,
            Inner::Multiply => Outer::Multiply,
        }
    }
}

/// A later one of operations done in one instruction, on the previous result, i, and another value z.
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
    /// min(z, i)
    MinOf,
}

/// Passes the three most frequent triples of operations in the ninety variants to a macro.
macro_rules! triples {
    ($macro:ident) => {
        $macro! {
            Add Multiply Add,
            Add Subtract Multiply,
            Subtract Subtract Multiply,
            Subtract Multiply Add,
            Subtract Multiply Subtract,
            Subtract Multiply SubtractFrom,
            Subtract Multiply Multiply,
            Multiply Add Multiply,
            Multiply Add Min,
            Subtract Multiply MinOf,
            Multiply Subtract Multiply,
            Multiply Subtract Min,
            Multiply Subtract MaxLiteral,
            Multiply SubtractFrom MaxLiteral
        }
    };
}
pub(crate) use triples;

macro_rules! list {
    ($($first:ident $second:ident $last:ident),*) => {
        &[$((Inner::$first, Outer::$second, Outer::$last)),*]
    };
}

/// Three operations that one instruction does.
pub const TRIPLES: &[(Inner, Outer, Outer)] = triples!(list);

/// Operation of an instruction on its source rows.
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
    /// inner(x, y), then outer with w, then outer with z; one of [`TRIPLES`].
    Triple(Inner, Outer, Outer),
    /// min(max(x, y), z) with literals y and z.
    ClampLiteral,
    /// min(max(x, y), z).
    Clamp,
    /// s, v, a; dx_l, dt, dt/2, 1/dt, which all lanes share: spacing, speed and acceleration one step later (Eq. 1).
    Moved,
    /// a, b: their sum and its rounding error.
    TwoSum,
}

impl Code {
    /// Numbers of written and read rows.
    pub fn rows(self) -> (usize, usize) {
        match self {
            Code::Copy | Code::Unary(_) => (1, 1),
            Code::Binary(_) | Code::MaxLiteral | Code::MinLiteral => (1, 2),
            Code::Select | Code::Pair(..) | Code::ClampLiteral | Code::Clamp => (1, 3),
            Code::SelectLess | Code::SelectLessEqual | Code::Triple(..) => (1, 4),
            Code::Moved => (WRITTEN, READ),
            Code::TwoSum => (2, 2),
        }
    }

    /// Number of read rows that differ by lane; it reads the first lane of the others.
    pub fn own(self) -> usize {
        if self == Code::Moved { 3 } else { self.rows().1 }
    }
}

/// Largest number of rows that an instruction writes.
pub const WRITTEN: usize = 3;
/// Largest number of rows that an instruction reads.
pub const READ: usize = 7;

/// One instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    pub code: Code,
    /// Written rows; all differ, also from the read ones.
    pub to: Vec<Row>,
    /// Rows read.
    pub from: Vec<Row>,
}
