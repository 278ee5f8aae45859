//! Compensated motion against whole numbers: two words carry a sum that one word would round.
//!
//! Speeds near 2^30 m/s have a last bit of 2^-22 in f64, so that steps of 2^-30 are lost unless they are carried. The numbers are chosen so
//! that all products are exact, and whole numbers of 2^-60 give the sum.

use leadlag::internal::lanes::Function;
use leadlag::internal::optimize::stream;
use rand::RngExt;

/// Fractional bits of the whole numbers.
const BITS: i32 = 60;

/// Error that the low word of the speed may have \[2^-60\]: it is a sum of small numbers, rounded itself. Not smaller: a low word of
/// up to 2^-20 has a last bit of 2^-73; a mutant loses 2^-30.
const LOST_SPEED: i128 = 1 << 12;

/// Allowed error of the spacing: half of the last bit of the distance driven in the step (2^27 m), which is one word by design; in a real
/// drive that is 2^-23 m in f32, and not carried.
const LOST_SPACING: i128 = (1 << 34) + LOST_SPEED;

fn whole(x: f64) -> i128 {
    let scaled = x * f64::from(BITS).exp2();
    assert!(scaled.fract() == 0.0 && scaled.abs() < 1e38, "{x} is a whole number of 2^-60");
    scaled as i128
}

/// Compares steps of `moved` with exact sums.
pub fn moves(moved: &Function) -> Result<(), String> {
    for number in 0..1000 {
        let random = &mut stream(11, 0, 0, number);
        let mut grains = |bits: i32, step: i32| {
            let range = 1_i64 << (bits - step);
            random.random_range(-range..=range) as f64 * f64::from(step).exp2()
        };
        let dt = 0.125;
        let high = if number % 4 == 0 { 0.0 } else { f64::from(30).exp2() };
        let (s, v) = (f64::from(40).exp2() + grains(38, -12), high + grains(8, -22).abs());
        let (s_low, v_low) = (grains(-14, -24), if high == 0.0 { 0.0 } else { grains(-23, -34) });
        let (a, dx_l) = (grains(10, -19), grains(20, -24));
        let found = moved.call_f64(&[s, v, 1.0, s_low, v_low, a, dx_l, dt]);
        let [s_next, v_next, a_next, s_next_low, v_next_low] = found[..] else { panic!("Motion has five words") };
        let both = |high: f64, low: f64| {
            whole(high) + whole((low * 1.152_921_504_606_847e18).round() / 1.152_921_504_606_847e18)
        };

        let v_now = whole(v) + whole(v_low);
        let free = v_now + whole(a) / 8;
        let stops = free < 0;
        let v_expected = if stops { 0 } else { free };
        let s_expected = whole(s) + whole(s_low) + whole(dx_l) - (v_now + v_expected) / 16;
        let a_expected = if stops { -v / dt } else { a };
        for (name, found, expected, lost) in [
            ("speed", both(v_next, v_next_low), v_expected, LOST_SPEED),
            ("spacing", both(s_next, s_next_low), s_expected, LOST_SPACING),
        ] {
            if (found - expected).abs() > lost {
                return Err(format!("exact step {number}: {name} is off by {} of 2^-60", found - expected));
            }
        }
        if (a_next - a_expected).abs() > 1e-12 * a_expected.abs() {
            return Err(format!("exact step {number}: acceleration {a_next}, expected {a_expected}"));
        }
    }
    Ok(())
}
