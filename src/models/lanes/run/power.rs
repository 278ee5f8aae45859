//! `power` of shaders/power.wgsl, operation for operation, over blocks of values.
//!
//! In stages: a few operations run over the whole block before the next few. Otherwise the compiler would keep one value in registers
//! through all of them, and the processor, which looks only some hundred operations ahead, would wait for each result. Four stages are
//! short enough for that and spill least. `black_box` between them keeps the compiler from undoing this; it changes no result.
#![allow(clippy::needless_range_loop, reason = "loops over rows of lanes, in the form that is vectorised")]

use super::binary::single::{EXP, LOG, high, parts, scale};
use super::binary::{Aligned, horner};
use std::hint::black_box;

/// Writes x[i] to the power of y[i] into `out`.
#[inline(always)]
pub fn power_block<const L: usize>(x: &[f32; L], y: &[f32; L], out: &mut [f32; L]) {
    let mut z = Aligned([0.0; L]);
    let mut e = Aligned([0.0; L]);
    let mut l = Aligned([0.0; L]);
    for i in 0..L {
        [e.0[i], z.0[i]] = parts(x[i]);
        l.0[i] = horner!(LOG[0], z.0[i], LOG, 1..6);
    }
    black_box(&mut l);
    let mut part = Aligned([0.0; L]);
    let mut whole = Aligned([0.0; L]);
    for i in 0..L {
        let l = horner!(l.0[i], z.0[i], LOG, 6..9);
        let y_high = high(y[i]);
        let y_low = y[i] - y_high;
        let exact = y_high * e.0[i];
        whole.0[i] = exact.floor();
        // The complete value so far; its whole part goes into the next stage.
        part.0[i] = ((exact - whole.0[i]) + y_low * e.0[i]) + y[i] * (l * z.0[i]);
    }
    black_box(&mut part);
    let mut r = Aligned([0.0; L]);
    for i in 0..L {
        let rest_whole = part.0[i].floor();
        part.0[i] -= rest_whole;
        whole.0[i] += rest_whole;
        r.0[i] = horner!(EXP[0], part.0[i], EXP, 1..4);
    }
    black_box(&mut r);
    for i in 0..L {
        let result = horner!(r.0[i], part.0[i], EXP, 4..7) * scale(whole.0[i]);
        out[i] = if x[i] >= f32::MIN_POSITIVE { result } else { 0.0 };
    }
}

/// x to the power of y.
#[must_use]
pub fn power(x: f32, y: f32) -> f32 {
    let mut out = [0.0];
    power_block(&[x], &[y], &mut out);
    out[0]
}
