//! Loops over the lanes of a few rows. Each row is a separate argument, so the compiler knows that no two overlap, and omits the check.
#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "NaN must be treated as in the kernel")]

use super::real::Real;
use super::simd::Lane;
use std::hint::select_unpredictable;

/// True if all accelerations are finite and all spacings above 0.
#[inline(always)]
pub fn all_fine<T: Real, const L: usize>(a_free: &[T; L], s: &[T; L]) -> bool {
    let mut fine = true;
    for i in 0..L {
        fine &= Real::is_finite(a_free[i]) & !(s[i] <= T::ZERO);
    }
    fine
}

/// True if all accelerations and spacings are finite.
#[inline(always)]
pub fn all_finite<T: Real, const L: usize>(a_free: &[T; L], s: &[T; L]) -> bool {
    let mut finite = true;
    for i in 0..L {
        finite &= Real::is_finite(a_free[i]) & Real::is_finite(s[i]);
    }
    finite
}

/// True if all accelerations and spacings are finite, and all spacings at least `least`.
#[inline(always)]
pub fn all_clear<T: Real, const L: usize>(a_free: &[T; L], s: &[T; L], least: T) -> bool {
    let mut clear = true;
    for i in 0..L {
        clear &= Real::is_finite(a_free[i]) & Real::is_finite(s[i]) & (s[i] >= least);
    }
    clear
}

/// True if no value lies below `least`.
#[inline(always)]
pub fn all_reach<T: Real, const L: usize>(y: &[T; L], least: T) -> bool {
    let mut reach = true;
    for i in 0..L {
        reach &= !(y[i] < least);
    }
    reach
}

/// True if no value is 0.
#[inline(always)]
pub fn all_true<T: Real, const L: usize>(x: &[T; L]) -> bool {
    let mut all = true;
    for i in 0..L {
        all &= x[i] != T::ZERO;
    }
    all
}

/// `went` = `alive` where the acceleration is finite and the spacing above 0; true if this differs from `alive` anywhere.
#[inline(always)]
pub fn went<T: Real, const L: usize>(a_free: &[T; L], s: &[T; L], alive: &[T; L], went: &mut [T; L]) -> bool {
    let mut differ = false;
    for i in 0..L {
        let fine = Real::is_finite(a_free[i]) & !(s[i] <= T::ZERO);
        went[i] = select_unpredictable(fine, alive[i], T::ZERO);
        differ |= went[i] != alive[i];
    }
    differ
}

/// The same, if the step is feasible, too.
#[inline(always)]
pub fn went_where<T: Real, const L: usize>(
    a_free: &[T; L],
    s: &[T; L],
    feasible: &[T; L],
    alive: &[T; L],
    went: &mut [T; L],
) -> bool {
    let mut differ = false;
    for i in 0..L {
        let fine = Real::is_finite(a_free[i]) & !(s[i] <= T::ZERO) & (feasible[i] != T::ZERO);
        went[i] = select_unpredictable(fine, alive[i], T::ZERO);
        differ |= went[i] != alive[i];
    }
    differ
}

/// Counts where a bound cut the acceleration.
#[inline(always)]
pub fn count<T: Real, const L: usize>(
    a: &[T; L],
    a_free: &[T; L],
    went: &[T; L],
    cut_acc: &mut [u32; L],
    cut_dec: &mut [u32; L],
) {
    for i in 0..L {
        let went = went[i] != T::ZERO;
        cut_acc[i] += u32::from(went & (a[i] < a_free[i]));
        cut_dec[i] += u32::from(went & (a[i] > a_free[i]));
    }
}

/// `went` = `alive` where acceleration and spacing are finite; true if this differs from `alive` anywhere.
#[inline(always)]
pub fn went_finite<T: Real, const L: usize>(a_free: &[T; L], s: &[T; L], alive: &[T; L], went: &mut [T; L]) -> bool {
    let mut differ = false;
    for i in 0..L {
        let fine = Real::is_finite(a_free[i]) & Real::is_finite(s[i]);
        went[i] = select_unpredictable(fine, alive[i], T::ZERO);
        differ |= went[i] != alive[i];
    }
    differ
}

/// Shortfall of values below `least`, in the lanes that continued.
#[inline(always)]
pub fn shortfalls<T: Real, const L: usize>(y: &[T; L], least: T, went: &[T; L], to: &mut [T; L]) {
    for i in 0..L {
        to[i] = select_unpredictable(went[i] != T::ZERO, (least - y[i]).larger(T::ZERO), T::ZERO);
    }
}

/// Adds the shortfall of values below `least`, in the lanes that continued.
#[inline(always)]
pub fn add_shortfalls<T: Real, const L: usize>(y: &[T; L], least: T, went: &[T; L], to: &mut [T; L]) {
    for i in 0..L {
        to[i] = to[i] + select_unpredictable(went[i] != T::ZERO, (least - y[i]).larger(T::ZERO), T::ZERO);
    }
}

/// Adds the cut part of an acceleration, in the lanes that continued.
#[inline(always)]
pub fn add_cuts<T: Real, const L: usize>(a: &[T; L], a_free: &[T; L], went: &[T; L], to: &mut [T; L]) {
    for i in 0..L {
        let cut = (a[i] - a_free[i]).larger(a_free[i] - a[i]);
        to[i] = to[i] + select_unpredictable(went[i] != T::ZERO, cut, T::ZERO);
    }
}

/// (y - `measured`) `factor` in the lanes that continue, 0 in the others.
#[inline(always)]
pub fn errors_where<T: Real, const L: usize>(y: &[T; L], measured: T, factor: T, went: &[T; L], to: &mut [T; L]) {
    for i in 0..L {
        to[i] = select_unpredictable(went[i] != T::ZERO, (y[i] - measured) * factor, T::ZERO);
    }
}

/// (y - `measured`) `factor`.
#[inline(always)]
pub fn errors<T: Real, const L: usize>(y: &[T; L], measured: T, factor: T, to: &mut [T; L]) {
    for i in 0..L {
        to[i] = (y[i] - measured) * factor;
    }
}

/// The residuals of spacing and speed, and their product with an observer's gains subtracted from spacing, speed and missing acceleration.
#[inline(always)]
pub fn observe<T: Real, const L: usize>(
    s: &mut [T; L],
    v: &mut [T; L],
    d: &mut [T; L],
    r_s: &mut [T; L],
    r_v: &mut [T; L],
    measured: [T; 2],
    gain: &[Lane<T, L>; 6],
) {
    for i in 0..L {
        let r = [s[i] - measured[0], v[i] - measured[1]];
        let correction = |k: usize| gain[k].0[i] * r[0] + gain[k + 1].0[i] * r[1];
        (r_s[i], r_v[i]) = (r[0], r[1]);
        s[i] = s[i] - correction(0);
        v[i] = (v[i] - correction(2)).larger(T::ZERO);
        d[i] = d[i] - correction(4);
    }
}

/// Adds the square of (y - `measured`) `factor`.
#[inline(always)]
pub fn add_square<T: Real, const L: usize>(y: &[T; L], measured: T, factor: T, sum: &mut [T; L]) {
    for i in 0..L {
        let term = (y[i] - measured) * factor;
        sum[i] = sum[i] + term * term;
    }
}

/// The same in the lanes that continue. In the others 0 is added: if the sum itself were selected, the compiler would store it under a
/// mask, which some processors do slowly.
#[inline(always)]
pub fn add_square_where<T: Real, const L: usize>(y: &[T; L], measured: T, factor: T, went: &[T; L], sum: &mut [T; L]) {
    for i in 0..L {
        let term = select_unpredictable(went[i] != T::ZERO, (y[i] - measured) * factor, T::ZERO);
        sum[i] = sum[i] + term * term;
    }
}

/// Adds the square of `term`, and its rounding error to `low`.
#[inline(always)]
pub fn add_square_compensated<T: Real, const L: usize>(
    term: &[T; L],
    went: &[T; L],
    high: &mut [T; L],
    low: &mut [T; L],
) {
    for i in 0..L {
        let went = went[i] != T::ZERO;
        let square = select_unpredictable(went, term[i] * term[i], T::ZERO);
        let sum = high[i] + square;
        let square_seen = sum - high[i];
        let sum_seen = sum - square_seen;
        let rest = (high[i] - sum_seen) + (square - square_seen);
        high[i] = sum;
        low[i] = low[i] + select_unpredictable(went, rest, T::ZERO);
    }
}

/// Between two rows.
#[inline(always)]
pub fn between<T: Real, const L: usize>(old: &[T; L], new: &[T; L], fraction: &[T; L], to: &mut [T; L]) {
    for i in 0..L {
        to[i] = old[i] + (new[i] - old[i]) * fraction[i];
    }
}

/// Between two values that all lanes share.
#[inline(always)]
pub fn leader<T: Real, const L: usize>(old: T, new: T, fraction: &[T; L], to: &mut [T; L]) {
    for i in 0..L {
        to[i] = old + (new - old) * fraction[i];
    }
}

/// Lanes that look up their past together: each of their delays is tried for each of them.
pub const CHUNK: usize = 16;

/// Spacing, speed and the speed ahead in the lanes of a chunk with this delay, between two samples: each `old`, `new`.
#[inline(always)]
pub fn between_where<T: Real>(
    samples: [[&[T; CHUNK]; 2]; 2],
    [old, new]: [T; 2],
    fraction: &[T; CHUNK],
    backs: &[T; CHUNK],
    back: T,
    to: &mut [[T; CHUNK]; 3],
) {
    let [s, v, v_l] = to;
    let [[s_old, s_new], [v_old, v_new]] = samples;
    for i in 0..CHUNK {
        let mine = backs[i] == back;
        let at = |old: T, new: T| old + (new - old) * fraction[i];
        s[i] = select_unpredictable(mine, at(s_old[i], s_new[i]), s[i]);
        v[i] = select_unpredictable(mine, at(v_old[i], v_new[i]), v[i]);
        v_l[i] = select_unpredictable(mine, at(old, new), v_l[i]);
    }
}

/// The lanes of a chunk.
#[inline(always)]
pub fn chunk<T, const L: usize>(row: &[T; L], chunk: usize) -> &[T; CHUNK] {
    &row.as_chunks::<CHUNK>().0[chunk]
}
