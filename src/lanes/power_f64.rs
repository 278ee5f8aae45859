//! The power function in f64, over blocks of values: the plan of shaders/power.wgsl with longer polynomials.
//!
//! The standard library's takes its arguments one by one, and thirty times as long. Staged as in `power`, for the same reason.
#![allow(clippy::needless_range_loop, reason = "loops over rows of lanes, in the form that is vectorised")]

use super::binary::double::{EXP, LOG, high, parts, scale};
use super::binary::{Aligned, horner};
use std::hint::black_box;

/// Writes x[i] to the power of y[i] into `out`; 0 where x is not a normal number above 0.
#[inline(always)]
pub fn power_block<const L: usize>(x: &[f64; L], y: &[f64; L], out: &mut [f64; L]) {
    let mut e = Aligned([0.0; L]);
    let mut t = Aligned([0.0; L]);
    for i in 0..L {
        [e.0[i], t.0[i]] = parts(x[i]);
    }
    black_box(&mut t);
    let mut t2 = Aligned([0.0; L]);
    let mut l = Aligned([0.0; L]);
    for i in 0..L {
        t2.0[i] = t.0[i] * t.0[i];
        l.0[i] = horner!(LOG[10], t2.0[i], LOG, (5..10).rev());
    }
    black_box(&mut l);
    let mut f = Aligned([0.0; L]);
    let mut whole = Aligned([0.0; L]);
    for i in 0..L {
        let l = horner!(l.0[i], t2.0[i], LOG, (0..5).rev());
        // y (e + log2(m)) = whole + f, in which y_high e is exact.
        let y_high = high(y[i]);
        let y_low = y[i] - y_high;
        let exact = y_high * e.0[i];
        whole.0[i] = exact.floor();
        f.0[i] = ((exact - whole.0[i]) + y_low * e.0[i]) + y[i] * (l * t.0[i]);
    }
    black_box(&mut f);
    let mut r = Aligned([0.0; L]);
    for i in 0..L {
        // Then f is between -1/2 and 1/2.
        let rest_whole = (f.0[i] + 0.5).floor();
        f.0[i] -= rest_whole;
        whole.0[i] += rest_whole;
        r.0[i] = horner!(EXP[13], f.0[i], EXP, (8..13).rev());
    }
    black_box(&mut r);
    for i in 0..L {
        let result = horner!(r.0[i], f.0[i], EXP, (0..8).rev()) * scale(whole.0[i]);
        out[i] = if x[i] >= f64::MIN_POSITIVE { result } else { 0.0 };
    }
}

/// x to the power of y.
#[must_use]
pub fn power(x: f64, y: f64) -> f64 {
    let mut out = [0.0];
    power_block(&[x], &[y], &mut out);
    out[0]
}
