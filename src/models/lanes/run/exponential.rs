//! `exponential` and `logarithm` of shaders/exponential.wgsl, operation for operation, and their form in f64, structured as `power`.

use super::binary::{double, horner, horner_fused, single};
use std::f64::consts::{LN_2, LOG2_E};

/// e to the power of x.
#[must_use]
#[inline(always)]
pub fn exponential(x: f32) -> f32 {
    use single::{EXP, high, scale};
    let above = if x < -100.0 { -100.0 } else { x };
    let y = if x > 100.0 { 100.0 } else { above };
    let y_high = high(y);
    let y_low = y - y_high;
    let exact = y_high * 1.442_382_8;
    let exact_whole = exact.floor();
    let rest = ((exact - exact_whole) + y_low * 1.442_382_8) + y * 0.000_312_228_4;
    let rest_whole = rest.floor();
    let result = horner!(EXP[0], rest - rest_whole, EXP, 1..7) * scale(exact_whole + rest_whole);
    if x.is_nan() { x } else { result }
}

/// Natural logarithm; that of the smallest normal number for smaller arguments.
#[must_use]
#[inline(always)]
pub fn logarithm(x: f32) -> f32 {
    use single::{LOG, parts};
    let [e, z] = parts(if x < f32::MIN_POSITIVE { f32::MIN_POSITIVE } else { x });
    let result = (e + horner!(LOG[0], z, LOG, 1..9) * z) * std::f32::consts::LN_2;
    if (x.to_bits() & 0x7f80_0000) == 0x7f80_0000 { x } else { result }
}

const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// The same in f64, without the splits: a product with a constant is off by one part in 2^53, which x magnifies at most 700 times.
#[must_use]
#[inline(always)]
pub fn exponential_f64(x: f64) -> f64 {
    use double::{EXP, scale};
    let above = if x < -800.0 { -800.0 } else { x };
    let y = if x > 800.0 { 800.0 } else { above };
    let whole = (y * LOG2_E + 0.5).floor();
    // ln(2) in two pieces, the first of 32 bits, so that its product with a whole number below 2^11 is exact.
    let part = ((y - whole * LN_2_HIGH) - whole * LN_2_LOW) * LOG2_E;
    let result = horner_fused!(EXP[11], part, EXP, (0..11).rev()) * scale(whole);
    if x.is_nan() { x } else { result }
}

/// Natural logarithm in f64; that of the smallest normal number for smaller arguments.
#[must_use]
#[inline(always)]
pub fn logarithm_f64(x: f64) -> f64 {
    use double::{LOG, parts};
    let [e, t] = parts(if x < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { x });
    let result = (e + horner_fused!(LOG[7], t * t, LOG, (0..7).rev()) * t) * LN_2;
    if x.is_finite() { result } else { x }
}
