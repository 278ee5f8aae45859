//! The power function in f64, over blocks of values: the plan of shaders/power.wgsl with longer polynomials.
//!
//! The standard library's takes its arguments one by one, and thirty times as long. Staged as in `power`, for the same reason.
#![allow(clippy::needless_range_loop, reason = "loops over rows of lanes, in the form that is vectorised")]

use std::f64::consts::{LN_2, LOG2_E};
use std::hint::black_box;

/// log2(m) = t sum of LOG\[k\] t^2k with t = (m - 1) / (m + 1): the series of the inverse hyperbolic tangent.
pub(super) const LOG: [f64; 11] = {
    let mut c = [0.0; 11];
    let mut k = 0;
    while k < 11 {
        c[k] = 2.0 * LOG2_E / (2 * k + 1) as f64;
        k += 1;
    }
    c
};

/// 2^f = sum of EXP\[k\] f^k: Taylor's series.
pub(super) const EXP: [f64; 14] = {
    let mut c = [1.0; 14];
    let mut k = 1;
    while k < 14 {
        c[k] = c[k - 1] * LN_2 / k as f64;
        k += 1;
    }
    c
};

pub(super) const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
pub(super) const MANTISSA: u64 = 0x000f_ffff_ffff_ffff;
/// From here on neighbouring values differ by 1, so that a small whole number may be written into the last bits.
pub(super) const ONE_APART: f64 = 4_503_599_627_370_496.0;

#[repr(C, align(64))]
struct Aligned<const L: usize>([f64; L]);

/// (r x + c) for the coefficients $from down to $to.
macro_rules! horner {
    ($r:expr, $x:expr, $c:ident, $from:literal, $to:literal) => {{
        let mut r = $r;
        for k in ($to..=$from).rev() {
            r = r * $x + $c[k];
        }
        r
    }};
}

/// Writes x[i] to the power of y[i] into `out`; 0 where x is not a normal number above 0.
#[inline(always)]
pub fn power_block<const L: usize>(x: &[f64; L], y: &[f64; L], out: &mut [f64; L]) {
    let mut e = Aligned([0.0; L]);
    let mut t = Aligned([0.0; L]);
    for i in 0..L {
        // x = m 2^e with m in sqrt(1/2)..sqrt(2).
        let above = x[i].to_bits().wrapping_sub(SQRT_HALF);
        let exponent = ((above >> 52) + 2048) & 4095;
        e.0[i] = f64::from_bits(exponent | ONE_APART.to_bits()) - (ONE_APART + 2048.0);
        let m = f64::from_bits((above & MANTISSA) + SQRT_HALF);
        t.0[i] = (m - 1.0) / (m + 1.0);
    }
    black_box(&mut t);
    let mut t2 = Aligned([0.0; L]);
    let mut l = Aligned([0.0; L]);
    for i in 0..L {
        t2.0[i] = t.0[i] * t.0[i];
        l.0[i] = horner!(LOG[10], t2.0[i], LOG, 9, 5);
    }
    black_box(&mut l);
    let mut f = Aligned([0.0; L]);
    let mut whole = Aligned([0.0; L]);
    for i in 0..L {
        let l = horner!(l.0[i], t2.0[i], LOG, 4, 0);
        // y (e + log2(m)) = whole + f: with 26 bits in y_high, y_high e is exact.
        let y_high = f64::from_bits(y[i].to_bits() & 0xffff_ffff_f800_0000);
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
        r.0[i] = horner!(EXP[13], f.0[i], EXP, 12, 8);
    }
    black_box(&mut r);
    for i in 0..L {
        let r = horner!(r.0[i], f.0[i], EXP, 7, 2);
        let above = if whole.0[i] > -1023.0 { whole.0[i] } else { -1023.0 };
        let within = if above < 1024.0 { above } else { 1024.0 };
        let scale = f64::from_bits((within + (ONE_APART + 1023.0)).to_bits() << 52);
        let result = ((r * f.0[i] + EXP[1]) * f.0[i] + 1.0) * scale;
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
