//! The power function in f64, over blocks of values: the plan of shaders/power.wgsl with longer polynomials and fused multiply-adds.
//!
//! That of the standard library takes its arguments one by one, and thirty times as long. In stages as `power`, for the same reason; two
//! stages are enough here.
#![allow(clippy::needless_range_loop, reason = "loops over rows of lanes, in the form that is vectorised")]

use super::binary::double::{EXP, LOG, parts, scale};
use super::binary::{Aligned, horner_fused};
use std::hint::black_box;

/// Writes x[i] to the power of y[i] into `out`; 0 if x is not a normal number above 0.
#[inline(always)]
pub fn power_block<const L: usize>(x: &[f64; L], y: &[f64; L], out: &mut [f64; L]) {
    let mut part = Aligned([0.0; L]);
    let mut whole = Aligned([0.0; L]);
    for i in 0..L {
        let [e, t] = parts(x[i]);
        let t2 = t * t;
        let l = horner_fused!(LOG[7], t2, LOG, (0..7).rev());
        // y (e + log2(m)) = whole + part, with the rounding error of the product y e.
        let product = y[i] * e;
        let product_whole = product.floor();
        let rest = y[i].mul_add(l * t, (product - product_whole) + y[i].mul_add(e, -product));
        // Then part is between -1/2 and 1/2.
        let rest_whole = (rest + 0.5).floor();
        part.0[i] = rest - rest_whole;
        whole.0[i] = product_whole + rest_whole;
    }
    black_box(&mut part);
    black_box(&mut whole);
    for i in 0..L {
        let result = horner_fused!(EXP[11], part.0[i], EXP, (0..11).rev()) * scale(whole.0[i]);
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
