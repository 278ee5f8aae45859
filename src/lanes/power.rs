//! `power` of shaders/power.wgsl, operation for operation, over blocks of values.
//!
//! Staged: a few operations run over the whole block before the next few. Otherwise the compiler keeps one value in
//! registers through all of them, and a processor, which sees only some hundred operations ahead, waits for the result of each
//! before the next. Four stages are short enough for that and spill least. `black_box` between them keeps the compiler from
//! undoing this; it changes no result.
#![allow(clippy::needless_range_loop, reason = "loops over rows of lanes, in the form that is vectorised")]

use std::hint::black_box;

/// Rows of a block at the width of a vector register.
#[repr(C, align(64))]
struct Aligned<const L: usize>([f32; L]);

/// (r x + c) for each c in turn.
macro_rules! horner {
    ($r:expr, $x:expr, [$($c:literal),*]) => {{
        let mut r = $r;
        $(r = r * $x + $c;)*
        r
    }};
}

/// Writes x[i] to the power of y[i] into `out`.
#[inline(always)]
pub fn power_block<const L: usize>(x: &[f32; L], y: &[f32; L], out: &mut [f32; L]) {
    let mut z = Aligned([0.0; L]);
    let mut e = Aligned([0.0; L]);
    let mut l = Aligned([0.0; L]);
    for i in 0..L {
        let above = x[i].to_bits().wrapping_sub(0x3f35_04f3);
        e.0[i] = (above.cast_signed() >> 23) as f32;
        z.0[i] = f32::from_bits((above & 0x007f_ffff) + 0x3f35_04f3) - 1.0;
        l.0[i] = horner!(0.125_496_1, z.0[i], [-0.209_954_02, 0.217_157_96, -0.238_570_53, 0.287_694_8, -0.360_719_05]);
    }
    black_box(&mut l);
    let mut part = Aligned([0.0; L]);
    let mut whole = Aligned([0.0; L]);
    for i in 0..L {
        let l = horner!(l.0[i], z.0[i], [0.480_920_43, -0.721_347_15, 1.442_694_9]);
        let y_high = f32::from_bits(y[i].to_bits() & 0xffff_f000);
        let y_low = y[i] - y_high;
        let exact = y_high * e.0[i];
        whole.0[i] = exact.floor();
        // The whole of it yet; its own whole part goes in the next stage.
        part.0[i] = ((exact - whole.0[i]) + y_low * e.0[i]) + y[i] * (l * z.0[i]);
    }
    black_box(&mut part);
    let mut r = Aligned([0.0; L]);
    for i in 0..L {
        let rest_whole = part.0[i].floor();
        part.0[i] -= rest_whole;
        whole.0[i] += rest_whole;
        r.0[i] = horner!(0.000_215_659_72, part.0[i], [0.001_248_229, 0.009_673_775, 0.055_486_184]);
    }
    black_box(&mut r);
    for i in 0..L {
        let r = horner!(r.0[i], part.0[i], [0.240_229_09, 0.693_147_06]);
        // Comparisons, not f32::max: its care for NaN costs, and there is none unless an argument is NaN.
        let above = if whole.0[i] > -127.0 { whole.0[i] } else { -127.0 };
        let within = if above < 128.0 { above } else { 128.0 };
        let scale = f32::from_bits((within + 8_388_735.0).to_bits() << 23);
        let result = (r * part.0[i] + 1.0) * scale;
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
