//! `exponential` and `logarithm` of shaders/exponential.wgsl, operation for operation, and their form in f64: the plan of `power`.

use super::power_f64::{EXP, LOG, MANTISSA, ONE_APART, SQRT_HALF};
use std::f64::consts::{LN_2, LOG2_E};

/// Exponent and log2 of the mantissa of x = m 2^e, m in sqrt(1/2)..sqrt(2).
#[inline(always)]
fn parts(x: f32) -> (f32, f32) {
    let above = x.to_bits().wrapping_sub(0x3f35_04f3);
    let e = (above.cast_signed() >> 23) as f32;
    let z = f32::from_bits((above & 0x007f_ffff) + 0x3f35_04f3) - 1.0;
    let mut l = 0.125_496_1 * z - 0.209_954_02;
    for c in [0.217_157_96, -0.238_570_53, 0.287_694_8, -0.360_719_05, 0.480_920_43, -0.721_347_15, 1.442_694_9] {
        l = l * z + c;
    }
    (e, l * z)
}

/// 2^(whole + part) for a part in 0..1.
#[inline(always)]
fn power_of_two(whole: f32, part: f32) -> f32 {
    let mut r = 0.000_215_659_72 * part + 0.001_248_229;
    for c in [0.009_673_775, 0.055_486_184, 0.240_229_09, 0.693_147_06, 1.0] {
        r = r * part + c;
    }
    let above = if whole > -127.0 { whole } else { -127.0 };
    let within = if above < 128.0 { above } else { 128.0 };
    r * f32::from_bits((within + 8_388_735.0).to_bits() << 23)
}

/// e to the power of x.
#[must_use]
#[inline(always)]
pub fn exponential(x: f32) -> f32 {
    let above = if x < -100.0 { -100.0 } else { x };
    let y = if x > 100.0 { 100.0 } else { above };
    let y_high = f32::from_bits(y.to_bits() & 0xffff_f000);
    let y_low = y - y_high;
    let exact = y_high * 1.442_382_8;
    let exact_whole = exact.floor();
    let rest = ((exact - exact_whole) + y_low * 1.442_382_8) + y * 0.000_312_228_4;
    let rest_whole = rest.floor();
    let result = power_of_two(exact_whole + rest_whole, rest - rest_whole);
    if x.is_nan() { x } else { result }
}

/// Natural logarithm; that of the smallest normal number for what is below it.
#[must_use]
#[inline(always)]
pub fn logarithm(x: f32) -> f32 {
    let y = if x < f32::MIN_POSITIVE { f32::MIN_POSITIVE } else { x };
    let (e, l) = parts(y);
    let result = (e + l) * std::f32::consts::LN_2;
    if (x.to_bits() & 0x7f80_0000) == 0x7f80_0000 { x } else { result }
}

/// The same in f64, without the splits: a product by a constant is off by one part in 2^53, which x magnifies at most 700 times.
#[must_use]
#[inline(always)]
pub fn exponential_f64(x: f64) -> f64 {
    let above = if x < -800.0 { -800.0 } else { x };
    let y = if x > 800.0 { 800.0 } else { above };
    let whole = (y * LOG2_E + 0.5).floor();
    // ln(2) in two pieces, the first of 32 bits, so that its product with a whole number below 2^11 is exact.
    let part = ((y - whole * LN_2_HIGH) - whole * LN_2_LOW) * LOG2_E;
    let mut r = EXP[13];
    for k in (0..13).rev() {
        r = r * part + EXP[k];
    }
    let above = if whole > -1023.0 { whole } else { -1023.0 };
    let within = if above < 1024.0 { above } else { 1024.0 };
    let result = r * f64::from_bits((within + (ONE_APART + 1023.0)).to_bits() << 52);
    if x.is_nan() { x } else { result }
}

const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Natural logarithm in f64; that of the smallest normal number for what is below it.
#[must_use]
#[inline(always)]
pub fn logarithm_f64(x: f64) -> f64 {
    let y = if x < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { x };
    let above = y.to_bits().wrapping_sub(SQRT_HALF);
    let exponent = ((above >> 52) + 2048) & 4095;
    let e = f64::from_bits(exponent | ONE_APART.to_bits()) - (ONE_APART + 2048.0);
    let m = f64::from_bits((above & MANTISSA) + SQRT_HALF);
    let t = (m - 1.0) / (m + 1.0);
    let mut l = LOG[10];
    for k in (0..10).rev() {
        l = l * (t * t) + LOG[k];
    }
    let result = (e + l * t) * LN_2;
    if x.is_finite() { result } else { x }
}
