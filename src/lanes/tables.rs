//! Look-ups of shaders/kernel.wgsl over a block of lanes.
#![allow(
    clippy::needless_range_loop,
    clippy::neg_cmp_op_on_partial_ord,
    reason = "loops over rows of lanes, in the form that is vectorised"
)]

use super::real::Real;
use super::simd::{Lane, gather};
use super::stream::{GradeTable, MfcTable};

/// Rows for intermediate values.
#[derive(Debug)]
pub struct Scratch<T, const L: usize> {
    index: [u32; L],
    node: Lane<T, L>,
    d: Lane<T, L>,
    c: Lane<T, L>,
    m: Lane<T, L>,
    /// Results.
    pub out: [Lane<T, L>; 2],
}

impl<T: Real, const L: usize> Scratch<T, L> {
    pub fn new() -> Self {
        let zero = Lane::ZERO;
        Scratch { index: [0; L], node: zero, d: zero, c: zero, m: zero, out: [zero; 2] }
    }

    /// Cell of each value in `d`.
    #[inline(always)]
    fn locate(&mut self, origin: T, per_width: T, cells: usize) {
        let (last, limit) = (cells as u32 - 1, T::of(1e6));
        for i in 0..L {
            let place = ((self.d.0[i] - origin) * per_width).larger(T::ZERO);
            self.index[i] = place.smaller(limit).to_u32().min(last);
        }
    }
}

/// Sine of the grade under followers with spacing `s`, where one with spacing 0 would be at `x_road`.
#[inline(always)]
pub fn sin_grade<T: Real, const L: usize>(scratch: &mut Scratch<T, L>, table: &GradeTable<T>, x_road: T, s: &[T; L]) {
    if table.period > T::ZERO {
        for i in 0..L {
            let x = x_road - s[i];
            scratch.d.0[i] = x - table.period * (x * table.per_period).floor();
        }
    } else {
        for i in 0..L {
            scratch.d.0[i] = x_road - s[i];
        }
    }
    scratch.locate(table.origin, table.per_width, table.node.len());
    gather(&table.node, &scratch.index, &mut scratch.node.0);
    gather(&table.at, &scratch.index, &mut scratch.c.0);
    for i in 0..L {
        let d = scratch.d.0[i] - scratch.node.0[i];
        scratch.d.0[i] = d;
        scratch.index[i] = 2 * scratch.index[i] + u32::from(d > T::ZERO);
    }
    gather(&table.slope, &scratch.index, &mut scratch.m.0);
    for i in 0..L {
        scratch.out[0].0[i] = scratch.c.0[i] + scratch.m.0[i] * scratch.d.0[i];
    }
}

/// (a_dp, a_ap) at the speeds `v`.
#[inline(always)]
pub fn mfc_bounds<T: Real, const L: usize>(scratch: &mut Scratch<T, L>, table: &MfcTable<T>, v: &[T; L]) {
    scratch.d.0 = *v;
    scratch.locate(table.origin, table.per_width, table.node.len());
    gather(&table.node, &scratch.index, &mut scratch.node.0);
    let mut at_node = 0_u32;
    for i in 0..L {
        let d = v[i] - scratch.node.0[i];
        scratch.d.0[i] = d;
        scratch.index[i] = 2 * scratch.index[i] + u32::from(!(d < T::ZERO));
        at_node |= u32::from(d == T::ZERO);
    }
    for curve in 0..2 {
        gather(&table.c[curve], &scratch.index, &mut scratch.c.0);
        gather(&table.m[curve], &scratch.index, &mut scratch.m.0);
        for i in 0..L {
            scratch.out[curve].0[i] = scratch.c.0[i] + scratch.m.0[i] * scratch.d.0[i];
        }
    }
    if at_node != 0 {
        for i in 0..L {
            scratch.index[i] /= 2;
        }
        for curve in 0..2 {
            gather(&table.at[curve], &scratch.index, &mut scratch.c.0);
            for i in 0..L {
                let line = scratch.out[curve].0[i];
                scratch.out[curve].0[i] = if scratch.d.0[i] == T::ZERO { scratch.c.0[i] } else { line };
            }
        }
    }
}
