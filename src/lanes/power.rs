//! `power` of shaders/power.wgsl, operation for operation, over blocks of values.
//!
//! Staged: each operation runs over the whole block before the next one, so that a processor's vector units never wait
//! for the result of the operation before.

/// Writes x[i] to the power of y[i] into `out`.
#[inline(always)]
pub fn power_block<const L: usize>(x: &[f32; L], y: &[f32; L], out: &mut [f32; L]) {
    let mut z = [0.0; L];
    let mut e = [0.0; L];
    let mut l = [0.0; L];
    for i in 0..L {
        let above = x[i].to_bits().wrapping_sub(0x3f35_04f3);
        e[i] = (above.cast_signed() >> 23) as f32;
        z[i] = f32::from_bits((above & 0x007f_ffff) + 0x3f35_04f3) - 1.0;
    }
    for i in 0..L {
        l[i] = 0.125_496_1 * z[i] - 0.209_954_02;
    }
    for c in [0.217_157_96, -0.238_570_53, 0.287_694_8, -0.360_719_05, 0.480_920_43, -0.721_347_15, 1.442_694_9] {
        for i in 0..L {
            l[i] = l[i] * z[i] + c;
        }
    }
    let mut part = [0.0; L];
    let mut whole = [0.0; L];
    for i in 0..L {
        let y_high = f32::from_bits(y[i].to_bits() & 0xffff_f000);
        let y_low = y[i] - y_high;
        let exact = y_high * e[i];
        let exact_whole = exact.floor();
        let rest = ((exact - exact_whole) + y_low * e[i]) + y[i] * (l[i] * z[i]);
        let rest_whole = rest.floor();
        part[i] = rest - rest_whole;
        whole[i] = exact_whole + rest_whole;
    }
    let mut r = [0.0; L];
    for i in 0..L {
        r[i] = 0.000_215_659_72 * part[i] + 0.001_248_229;
    }
    for c in [0.009_673_775, 0.055_486_184, 0.240_229_09, 0.693_147_06, 1.0] {
        for i in 0..L {
            r[i] = r[i] * part[i] + c;
        }
    }
    for i in 0..L {
        // Comparisons, not f32::max: its care for NaN costs, and there is none unless an argument is NaN.
        let above = if whole[i] > -127.0 { whole[i] } else { -127.0 };
        let within = if above < 128.0 { above } else { 128.0 };
        let scale = f32::from_bits((within + 8_388_735.0).to_bits() << 23);
        out[i] = if x[i] >= f32::MIN_POSITIVE { r[i] * scale } else { 0.0 };
    }
}

/// x to the power of y.
#[must_use]
pub fn power(x: f32, y: f32) -> f32 {
    let mut out = [0.0];
    power_block(&[x], &[y], &mut out);
    out[0]
}
