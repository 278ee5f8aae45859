//! Instructions over rows of lanes, once per instruction set.
//!
//! The only module with `unsafe`: function pointers compiled for an instruction set, and rows accessed by number. `Instructions::new`
//! checks their conditions. Every set gives the same bits: Rust never fuses a multiplication with an addition on its own, and where f64
//! requires it (`mul_add`), the baseline computes the same, more slowly.
#![allow(unsafe_code, reason = "function pointers per instruction set; see the safety comments")]

use super::operation::{self, Compare, One, Two};
use super::operation::{each_compare, each_moved, each_select, each_two_sum, each1, each2, each3, each4};
use super::real::Real;
use super::time_loop::{Program, Run, Workspace, run};
use crate::lanes::compile::code::{Code, Inner, Outer, READ, Row, Step, WRITTEN, triples};
use crate::lanes::compile::flat::{Binary, Unary};

/// Instruction sets that block programs are compiled for. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InstructionSet {
    /// Available on every processor of the platform.
    Baseline,
    /// 256-bit vectors.
    Avx2,
    /// 512-bit vectors.
    Avx512,
}

impl InstructionSet {
    /// Those that this processor has, the best last.
    #[must_use]
    pub fn available() -> Vec<InstructionSet> {
        let mut sets = vec![InstructionSet::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                sets.push(InstructionSet::Avx2);
            }
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
            {
                sets.push(InstructionSet::Avx512);
            }
        }
        sets
    }

    /// The best that this processor has.
    #[must_use]
    pub fn best() -> InstructionSet {
        *InstructionSet::available().last().expect("the baseline is always there")
    }
}

/// Largest block that the baseline is compiled for: wide blocks would only cost compile time there.
const BASELINE_LANES: usize = 32;

/// One value per lane.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Lane<T, const L: usize>(pub [T; L]);

impl<T: Real, const L: usize> Lane<T, L> {
    pub const ZERO: Self = Lane([T::ZERO; L]);
}

/// The rows that an instruction writes, then those that it reads; unused ones repeat the first of their kind.
type At = [Row; WRITTEN + READ];

type Execute<T, const L: usize> = unsafe fn(*mut Lane<T, L>, &At);

/// Instructions that are ready to run.
#[derive(Debug, Clone)]
pub struct Instructions<T, const L: usize> {
    list: Vec<(Execute<T, L>, At)>,
    rows: usize,
}

impl<T: Real, const L: usize> Instructions<T, L> {
    /// Picks the function of each step.
    ///
    /// # Panics
    /// If this processor lacks that instruction set, or a step writes a row that it reads, a row twice, or a missing one.
    pub fn new(steps: &[Step], set: InstructionSet, rows: usize) -> Self {
        assert!(InstructionSet::available().contains(&set), "this processor has no {set:?}");
        let resolve = |step: &Step| {
            for (i, row) in step.to.iter().enumerate() {
                assert!(!step.from.contains(row) && !step.to[..i].contains(row), "no step reads what it writes");
            }
            assert!(step.from.iter().chain(&step.to).all(|row| usize::from(*row) < rows), "rows exist");
            let (to, from) = step.code.rows();
            assert!(step.to.len() == to && step.from.len() == from, "as many rows as the instruction has");
            let at = |rows: &[Row], i: usize| *rows.get(i).unwrap_or(&rows[0]);
            let place = |i: usize| if i < WRITTEN { at(&step.to, i) } else { at(&step.from, i - WRITTEN) };
            (pick::<T, L>(step.code, set), std::array::from_fn(place))
        };
        Instructions { list: steps.iter().map(resolve).collect(), rows }
    }
}

/// The rows that instructions work on.
#[derive(Debug)]
pub struct Registers<T, const L: usize> {
    rows: Vec<Lane<T, L>>,
}

impl<T: Real, const L: usize> Registers<T, L> {
    pub fn new(rows: usize) -> Self {
        Registers { rows: vec![Lane::ZERO; rows] }
    }

    #[inline(always)]
    pub fn row(&self, row: Row) -> &[T; L] {
        &self.rows[usize::from(row)].0
    }

    #[inline(always)]
    pub fn row_mut(&mut self, row: Row) -> &mut [T; L] {
        &mut self.rows[usize::from(row)].0
    }

    /// Several rows at once.
    ///
    /// # Panics
    /// If two are the same.
    #[inline(always)]
    pub fn rows_mut<const N: usize>(&mut self, rows: [Row; N]) -> [&mut [T; L]; N] {
        let rows = self.rows.get_disjoint_mut(rows.map(usize::from)).expect("rows that differ");
        rows.map(|row| &mut row.0)
    }

    /// Runs instructions one after the other.
    ///
    /// # Panics
    /// If they need more rows than there are.
    #[inline(always)]
    pub fn execute(&mut self, instructions: &Instructions<T, L>) {
        assert!(instructions.rows <= self.rows.len(), "the rows that the instructions were made for");
        let rows = self.rows.as_mut_ptr();
        for (execute, at) in &instructions.list {
            // SAFETY: `Instructions::new` checked that the processor has the instruction set, that all rows are below
            // `instructions.rows` (and so exist), and that the row written is none of those read.
            unsafe { execute(rows, at) };
        }
    }
}

/// Runs a block that has started up to a sample, in the code of an instruction set.
///
/// # Panics
/// If this processor lacks that instruction set.
pub fn run_block<T: Real, const L: usize>(
    set: InstructionSet,
    program: &Program<T, L>,
    workspace: &mut Workspace<T, L>,
    what: &mut Run<'_, T>,
    until: usize,
) {
    assert!(InstructionSet::available().contains(&set), "this processor has no {set:?}");
    match set {
        // SAFETY: checked above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => unsafe { avx512::block(program, workspace, what, until) },
        // SAFETY: checked above.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { avx2::block(program, workspace, what, until) },
        // SAFETY: every processor has the baseline.
        _ if const { L <= BASELINE_LANES } => unsafe { baseline::block(program, workspace, what, until) },
        _ => unreachable!("the baseline runs in small blocks"),
    }
}

/// Rows written (before the semicolon) and read, by their numbers, as references, from which the compiler knows that they do not
/// overlap.
macro_rules! rows {
    ($rows:ident, $at:ident, $($to:literal),*; $($source:literal),*) => {
        // SAFETY: the caller promises that the rows exist, and that written rows differ from all others.
        unsafe {
            (
                $(&mut (*$rows.add(usize::from($at[$to]))).0,)*
                $(&(*$rows.add(usize::from($at[WRITTEN + $source]))).0),*
            )
        }
    };
}

/// Picks the function of three operations in a row.
macro_rules! pick_triple {
    ($($first:ident $second:ident $last:ident),*) => {
        fn triple<T: Real, const L: usize>(first: Inner, second: Outer, last: Outer) -> Execute<T, L> {
            match (first, second, last) {
                $((Inner::$first, Outer::$second, Outer::$last) => {
                    three::<T, operation::$first, operation::$second, operation::$last, L>
                })*
                _ => unreachable!("schedule.rs makes no others"),
            }
        }
    };
}

/// The instructions and the time loop for one instruction set.
macro_rules! instruction_set {
    ($set:ident $(, $features:literal)?) => {
        mod $set {
            use super::*;

            $(#[target_feature(enable = $features)])?
            pub unsafe fn one<T: Real, O: One, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, x) = rows!(rows, at, 0; 0);
                each1::<T, O, L>(to, x);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn two<T: Real, O: Two, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, x, y) = rows!(rows, at, 0; 0, 1);
                each2::<T, O, L>(to, x, y);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn pair<T: Real, I: Two, O: Two, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, x, y, z) = rows!(rows, at, 0; 0, 1, 2);
                each3::<T, I, O, L>(to, x, y, z);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn three<T: Real, I: Two, M: Two, O: Two, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, x, y, w, z) = rows!(rows, at, 0; 0, 1, 2, 3);
                each4::<T, I, M, O, L>(to, x, y, w, z);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn select<T: Real, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, c, accept, reject) = rows!(rows, at, 0; 0, 1, 2);
                each_select(to, c, accept, reject);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn compare<T: Real, C: Compare, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, x, y, accept, reject) = rows!(rows, at, 0; 0, 1, 2, 3);
                each_compare::<T, C, L>(to, x, y, accept, reject);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn moved<T: Real, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (s_next, v_next, a_next, s, v, a, dx_l, dt, half_dt, per_dt) =
                    rows!(rows, at, 0, 1, 2; 0, 1, 2, 3, 4, 5, 6);
                each_moved(s_next, v_next, a_next, s, v, a, [dx_l[0], dt[0], half_dt[0], per_dt[0]]);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn two_sum<T: Real, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (high, low, a, b) = rows!(rows, at, 0, 1; 0, 1);
                each_two_sum(high, low, a, b);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn power<T: Real, const L: usize>(rows: *mut Lane<T, L>, at: &At) {
                let (to, x, y) = rows!(rows, at, 0; 0, 1);
                T::power(x, y, to);
            }

            $(#[target_feature(enable = $features)])?
            pub unsafe fn block<T: Real, const L: usize>(
                program: &Program<T, L>,
                workspace: &mut Workspace<T, L>,
                what: &mut Run<'_, T>,
                until: usize,
            ) {
                run(program, workspace, what, until);
            }

            fn outer<T: Real, I: Two, const L: usize>(outer: Outer) -> Execute<T, L> {
                match outer {
                    Outer::Add => pair::<T, I, operation::Add, L>,
                    Outer::Subtract => pair::<T, I, operation::Subtract, L>,
                    Outer::SubtractFrom => pair::<T, I, operation::SubtractFrom, L>,
                    Outer::Multiply => pair::<T, I, operation::Multiply, L>,
                    Outer::Divide => pair::<T, I, operation::Divide, L>,
                    Outer::DivideInto => pair::<T, I, operation::DivideInto, L>,
                    Outer::MaxLiteral => pair::<T, I, operation::MaxLiteral, L>,
                    Outer::MinLiteral => pair::<T, I, operation::MinLiteral, L>,
                    Outer::Min => pair::<T, I, operation::Min, L>,
                    Outer::MinOf => pair::<T, I, operation::MinOf, L>,
                }
            }

            triples!(pick_triple);

            pub fn pick<T: Real, const L: usize>(code: Code) -> Execute<T, L> {
                match code {
                    Code::Copy => one::<T, operation::Copy, L>,
                    Code::Unary(Unary::Negate) => one::<T, operation::Negate, L>,
                    Code::Unary(Unary::Not) => one::<T, operation::Not, L>,
                    Code::Unary(Unary::Abs) => one::<T, operation::Abs, L>,
                    Code::Unary(Unary::Sqrt) => one::<T, operation::Sqrt, L>,
                    Code::Unary(Unary::Floor) => one::<T, operation::Floor, L>,
                    Code::Unary(Unary::Exponential) => one::<T, operation::Exponential, L>,
                    Code::Unary(Unary::Logarithm) => one::<T, operation::Logarithm, L>,
                    Code::Unary(Unary::Sin) => one::<T, operation::Sin, L>,
                    Code::Unary(Unary::Cos) => one::<T, operation::Cos, L>,
                    Code::Binary(Binary::Add) => two::<T, operation::Add, L>,
                    Code::Binary(Binary::Subtract) => two::<T, operation::Subtract, L>,
                    Code::Binary(Binary::Multiply) => two::<T, operation::Multiply, L>,
                    Code::Binary(Binary::Divide) => two::<T, operation::Divide, L>,
                    Code::Binary(Binary::Min) => two::<T, operation::Min, L>,
                    Code::Binary(Binary::Max) => two::<T, operation::Max, L>,
                    Code::Binary(Binary::Less) => two::<T, operation::Less, L>,
                    Code::Binary(Binary::LessEqual) => two::<T, operation::LessEqual, L>,
                    Code::Binary(Binary::Equal) => two::<T, operation::Equal, L>,
                    Code::Binary(Binary::NotEqual) => two::<T, operation::NotEqual, L>,
                    Code::Binary(Binary::And) => two::<T, operation::And, L>,
                    Code::Binary(Binary::Or) => two::<T, operation::Or, L>,
                    Code::Binary(Binary::Power) => power::<T, L>,
                    Code::MaxLiteral => two::<T, operation::MaxLiteral, L>,
                    Code::MinLiteral => two::<T, operation::MinLiteral, L>,
                    Code::Select => select::<T, L>,
                    Code::Triple(first, second, last) => triple(first, second, last),
                    Code::ClampLiteral => pair::<T, operation::MaxLiteral, operation::MinLiteral, L>,
                    Code::Clamp => pair::<T, operation::Max, operation::Min, L>,
                    Code::Moved => moved::<T, L>,
                    Code::TwoSum => two_sum::<T, L>,
                    Code::SelectLess => compare::<T, operation::Less, L>,
                    Code::SelectLessEqual => compare::<T, operation::LessEqual, L>,
                    Code::Pair(Inner::Add, o) => outer::<T, operation::Add, L>(o),
                    Code::Pair(Inner::Subtract, o) => outer::<T, operation::Subtract, L>(o),
                    Code::Pair(Inner::Multiply, o) => outer::<T, operation::Multiply, L>(o),
                }
            }
        }
    };
}

instruction_set!(baseline);
#[cfg(target_arch = "x86_64")]
instruction_set!(avx2, "avx2,fma");
#[cfg(target_arch = "x86_64")]
instruction_set!(avx512, "avx512f,avx512vl,avx512bw,avx512dq");

/// Placeholder for an instruction that is never run.
unsafe fn nothing<T: Real, const L: usize>(_: *mut Lane<T, L>, _: &At) {
    unreachable!("the baseline runs in small blocks");
}

fn pick<T: Real, const L: usize>(code: Code, set: InstructionSet) -> Execute<T, L> {
    match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => avx512::pick(code),
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => avx2::pick(code),
        _ if const { L <= BASELINE_LANES } => baseline::pick(code),
        _ => nothing,
    }
}
