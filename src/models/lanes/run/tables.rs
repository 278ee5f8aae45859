//! Look-ups of shaders/kernel.wgsl over a block of lanes.
//!
//! A candidate stays in one cell of a table for many steps. So each lane keeps the values of its cell, and reads again only after leaving
//! it: a processor's gather instructions take longer than the rest of a step.
#![allow(
    clippy::needless_range_loop,
    clippy::neg_cmp_op_on_partial_ord,
    reason = "loops over rows of lanes, in the form that is vectorised"
)]

use super::real::Real;
use super::simd::Lane;
use super::stream::{Cells, GradeTable, MfcTable};

/// Lanes that read again together.
const CHUNK: usize = 16;

/// Values of each lane from its cell: C values of the cell, S of the side of its node.
#[derive(Debug)]
struct Cursor<T, const L: usize, const C: usize, const S: usize> {
    cell: [u32; L],
    in_cell: [Lane<T, L>; C],
    side: [u32; L],
    on_side: [Lane<T, L>; S],
}

/// Look-ups of a block.
#[derive(Debug)]
pub struct Lookups<T, const L: usize> {
    grade: Cursor<T, L, 2, 1>,
    mfc: Cursor<T, L, 3, 4>,
    /// Position of each lane: first the searched one, then relative to its node.
    d: Lane<T, L>,
}

/// No cell.
const NOWHERE: u32 = u32::MAX;

/// Reads the entries of the lanes in each chunk in which a lane has moved to another cell.
#[inline(always)]
fn follow<T: Real, const N: usize, const L: usize>(
    table: &[[T; N]],
    index: &[u32; L],
    known: &mut [u32; L],
    rows: &mut [Lane<T, L>; N],
) {
    for from in (0..L).step_by(CHUNK) {
        let mut moved = 0;
        for i in from..(from + CHUNK).min(L) {
            moved |= index[i] ^ known[i];
        }
        if moved != 0 {
            read(table, index, from, rows);
        }
    }
    *known = *index;
}

/// Compiled without the caller's instruction set, which would bring the gather instructions back.
#[inline(never)]
fn read<T: Real, const N: usize, const L: usize>(
    table: &[[T; N]],
    index: &[u32; L],
    from: usize,
    rows: &mut [Lane<T, L>; N],
) {
    for i in from..(from + CHUNK).min(L) {
        let entry = &table[index[i] as usize];
        for k in 0..N {
            rows[k].0[i] = entry[k];
        }
    }
}

impl<T: Real, const L: usize, const C: usize, const S: usize> Cursor<T, L, C, S> {
    fn new() -> Self {
        Cursor { cell: [NOWHERE; L], in_cell: [Lane::ZERO; C], side: [NOWHERE; L], on_side: [Lane::ZERO; S] }
    }

    /// Moves to the cells of the positions in `d`, which then become relative to the cells' nodes.
    #[inline(always)]
    fn go(&mut self, table: &Cells<T, C, S>, d: &mut [T; L], is_above: impl Fn(T) -> bool) {
        let mut index = [0; L];
        let (last, limit) = (table.cells.len() as u32 - 1, T::of(1e6));
        for i in 0..L {
            let place = ((d[i] - table.origin) * table.per_width).larger(T::ZERO);
            index[i] = place.smaller(limit).whole().min(last);
        }
        follow(&table.cells, &index, &mut self.cell, &mut self.in_cell);
        for i in 0..L {
            d[i] = d[i] - self.in_cell[0].0[i];
            index[i] = (index[i] << 1) | u32::from(is_above(d[i]));
        }
        follow(&table.sides, &index, &mut self.side, &mut self.on_side);
    }
}

impl<T: Real, const L: usize> Lookups<T, L> {
    pub fn new() -> Self {
        Lookups { grade: Cursor::new(), mfc: Cursor::new(), d: Lane::ZERO }
    }

    /// Call it before a block reads other tables than the previous one.
    pub fn forget(&mut self) {
        (self.grade.cell, self.grade.side) = ([NOWHERE; L], [NOWHERE; L]);
        (self.mfc.cell, self.mfc.side) = ([NOWHERE; L], [NOWHERE; L]);
    }

    /// Moves under followers with spacing `s`, where one with spacing 0 would be at `x_road`.
    #[inline(always)]
    pub fn go_to_place(&mut self, table: &GradeTable<T>, x_road: T, s: &[T; L]) {
        let d = &mut self.d.0;
        if table.period > T::ZERO {
            for i in 0..L {
                let x = x_road - s[i];
                d[i] = x - table.period * (x * table.per_period).floor();
            }
        } else {
            for i in 0..L {
                d[i] = x_road - s[i];
            }
        }
        self.grade.go(&table.cells, d, |d| d > T::ZERO);
    }

    /// Sine of the grade there.
    #[inline(always)]
    pub fn sin_grade(&self, to: &mut [T; L]) {
        let ([_, at], [slope]) = (&self.grade.in_cell, &self.grade.on_side);
        for i in 0..L {
            to[i] = at.0[i] + slope.0[i] * self.d.0[i];
        }
    }

    /// Moves to the speeds `v`.
    #[inline(always)]
    pub fn go_to_speed(&mut self, table: &MfcTable<T>, v: &[T; L]) {
        self.d.0 = *v;
        self.mfc.go(table, &mut self.d.0, |d| !(d < T::ZERO));
    }

    /// a_dp (0) or a_ap (1) there.
    #[inline(always)]
    pub fn mfc_bound(&self, curve: usize, to: &mut [T; L]) {
        let at = &self.mfc.in_cell[1 + curve].0;
        let [c, m] = [&self.mfc.on_side[2 * curve].0, &self.mfc.on_side[2 * curve + 1].0];
        for i in 0..L {
            let line = c[i] + m[i] * self.d.0[i];
            to[i] = if self.d.0[i] == T::ZERO { at[i] } else { line };
        }
    }
}
