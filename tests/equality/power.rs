//! The functions that replace `pow`, `exp` and `log`: close to the true values, and exact where they have to be.

use leadlag::internal::lanes::{exponential, exponential_f64, logarithm, logarithm_f64, power, power_f64};

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

/// The largest error over this many points between two places, and its place.
fn worst(points: u32, [from, to]: [f64; 2], error: impl Fn(f64) -> f64) -> (f64, f64) {
    let at = |i| from + (to - from) * f64::from(i) / f64::from(points);
    (0..=points).map(|i| (error(at(i)), at(i))).fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
}

#[test]
fn exponentials_are_close() {
    let in_f32 = |x: f64| (f64::from(exponential(x as f32)) / f64::from(x as f32).exp() - 1.0).abs();
    let (e, x) = worst(2_000_000, [-87.0, 88.0], in_f32);
    assert!(e < 3e-7, "exponential({x}) is off by {e:e}");
    let (e, x) = worst(1_000_000, [-708.0, 709.0], |x| (exponential_f64(x) / x.exp() - 1.0).abs());
    assert!(e < 1e-15, "exponential_f64({x}) is off by {e:e}");
}

#[test]
fn logarithms_are_close() {
    let relative = |found: f64, exact: f64| if exact == 0.0 { found.abs() } else { (found / exact - 1.0).abs() };
    let in_f32 = |x: f64| relative(f64::from(logarithm(x as f32)), f64::from(x as f32).ln());
    let in_f64 = |x: f64| relative(logarithm_f64(x), x.ln());
    // Evenly in the logarithm, and densely where the logarithm changes its sign.
    let (e, x) = worst(2_000_000, [-87.3, 88.7], |y| in_f32(y.exp()));
    assert!(e < 4e-7, "logarithm(e^{x}) is off by {e:e}");
    let (e, x) = worst(2_000_000, [0.7, 1.5], in_f32);
    assert!(e < 4e-7, "logarithm({x}) is off by {e:e}");
    let (e, x) = worst(1_000_000, [-708.0, 709.0], |y| in_f64(y.exp()));
    assert!(e < 1e-15, "logarithm_f64(e^{x}) is off by {e:e}");
    let (e, x) = worst(1_000_000, [0.7, 1.5], in_f64);
    assert!(e < 1e-15, "logarithm_f64({x}) is off by {e:e}");
}

#[test]
fn exponentials_and_logarithms_at_the_ends() {
    assert_eq!([exponential(0.0), exponential(-200.0), exponential(200.0)], [1.0, 0.0, f32::INFINITY]);
    assert_eq!([exponential(f32::NEG_INFINITY), exponential(f32::INFINITY)], [0.0, f32::INFINITY]);
    assert_eq!([exponential_f64(0.0), exponential_f64(-1e4), exponential_f64(1e4)], [1.0, 0.0, f64::INFINITY]);
    assert!(exponential(f32::NAN).is_nan() && exponential_f64(f64::NAN).is_nan());
    assert!(logarithm(f32::NAN).is_nan() && logarithm_f64(f64::NAN).is_nan());
    assert_eq!([logarithm(1.0), logarithm(f32::INFINITY)], [0.0, f32::INFINITY]);
    assert_eq!([logarithm_f64(1.0), logarithm_f64(f64::INFINITY)], [0.0, f64::INFINITY]);
    for x in [0.0, -0.0, -1.0, f32::MIN_POSITIVE / 2.0] {
        assert_eq!(logarithm(x), logarithm(f32::MIN_POSITIVE), "logarithm({x})");
        assert!((logarithm(x) + 87.336_54).abs() < 1e-4);
    }
}
