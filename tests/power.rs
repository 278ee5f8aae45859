//! The power function that replaces `pow`: close to the true value, and exact where it has to be.

use leadlag::lanes::{power, power_f64};

/// Relative error of `power` against f64.
fn error(x: f32, y: f32) -> Option<f64> {
    let exact = f64::from(x).powf(f64::from(y));
    (exact > 1e-30).then(|| (f64::from(power(x, y)) / exact - 1.0).abs())
}

#[test]
fn within_six_parts_in_ten_million() {
    let (nx, ny) = (2_500, 1_600);
    let mut worst = (0.0, 0.0, 0.0);
    for i in 0..=nx {
        // Evenly in the logarithm, so that every binade is covered alike.
        let x = (1e-3_f64 * 1400_f64.powf(f64::from(i) / f64::from(nx))) as f32;
        for k in 0..=ny {
            let y = (0.1 + 9.9 * f64::from(k) / f64::from(ny)) as f32;
            if let Some(e) = error(x, y).filter(|e| *e > worst.0) {
                worst = (e, x, y);
            }
        }
    }
    let (e, x, y) = worst;
    assert!(e < 6e-7, "power({x}, {y}) is off by {e:e}");
}

#[test]
fn near_one_and_at_the_ends() {
    // Where the logarithm changes sign, and where the mantissa is split.
    for base in [1.0_f32, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::SQRT_2, 0.5, 2.0] {
        for step in -2_000_i32..=2_000 {
            let x = f32::from_bits(base.to_bits().wrapping_add_signed(step));
            for y in [0.1, 0.5, 1.0, 3.999_999_8, 4.0, 9.999_999, 10.0] {
                let e = error(x, y).expect("nothing small here");
                assert!(e < 6e-7, "power({x}, {y}) is off by {e:e}");
            }
        }
    }
}

#[test]
fn exact_values() {
    for y in [0.1, 1.0, 4.0, 10.0] {
        assert_eq!(power(1.0, y), 1.0);
        for x in [0.0, -0.0, -1e-30, -1.0, f32::MIN_POSITIVE / 2.0] {
            assert_eq!(power(x, y), 0.0, "{x} to the power of {y}");
        }
    }
    assert_eq!(power(0.5, 10.0), 1.0 / 1024.0);
    assert_eq!(power(1e-30, 10.0), 0.0, "too small for f32");
    assert_eq!(power(1e30, 10.0), f32::INFINITY, "too large for f32");
}

/// Relative error of the f64 twin against the standard library, which is within 1e-16 of the true value.
fn error_f64(x: f64, y: f64) -> f64 {
    (power_f64(x, y) / x.powf(y) - 1.0).abs()
}

#[test]
fn in_f64_within_two_parts_in_a_thousand_million_million() {
    let mut worst = (0.0, 0.0, 0.0);
    for i in 0..=2_000 {
        let x = 1e-3 * 1400_f64.powf(f64::from(i) / 2_000.0);
        for k in 0..=800 {
            let y = 0.1 + 9.9 * f64::from(k) / 800.0;
            if error_f64(x, y) > worst.0 {
                worst = (error_f64(x, y), x, y);
            }
        }
    }
    for base in [1.0_f64, std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::SQRT_2, 0.5, 2.0] {
        for step in -2_000_i64..=2_000 {
            let x = f64::from_bits(base.to_bits().wrapping_add_signed(step));
            for y in [0.1, 0.5, 1.0, 3.999_999_999_999, 4.0, 10.0] {
                if error_f64(x, y) > worst.0 {
                    worst = (error_f64(x, y), x, y);
                }
            }
        }
    }
    let (e, x, y) = worst;
    assert!(e < 2e-15, "power_f64({x}, {y}) is off by {e:e}");
}

#[test]
fn in_f64_exact_values() {
    for y in [0.1, 1.0, 4.0, 10.0] {
        assert_eq!(power_f64(1.0, y), 1.0);
        for x in [0.0, -0.0, -1e-30, -1.0, f64::MIN_POSITIVE / 2.0, f64::NAN] {
            assert_eq!(power_f64(x, y), 0.0, "{x} to the power of {y}");
        }
    }
    assert_eq!(power_f64(0.5, 10.0), 1.0 / 1024.0);
    assert_eq!(power_f64(1e-40, 10.0), 0.0, "too small for f64");
    assert_eq!(power_f64(1e40, 10.0), f64::INFINITY, "too large for f64");
    assert!(power_f64(0.5, f64::NAN).is_nan());
}
