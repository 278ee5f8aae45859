use super::evidence::{Rows, table};
use super::*;
use crate::judge::Resamples;
use crate::wgsl::extension_named;

fn cause(name: &str) -> &'static Extension {
    extension_named(name).expect("in the library")
}

#[test]
fn pairs_are_causes_that_hide_each_other() {
    let causes = ["dead_zone", "actuation_lag", "leader_accel_ff", "set_speed_change", LEAD].map(cause);
    let names: Vec<Vec<String>> = sets(&causes).iter().map(|set| names(set)).collect();
    // No fold can judge an event, and the lead is not a property of a car.
    let expected: [&[&str]; 4] =
        [&["dead_zone"], &["actuation_lag"], &["leader_accel_ff"], &["actuation_lag", "leader_accel_ff"]];
    assert_eq!(names, expected);
}

/// Losses of 90 bins at each horizon: a part common to all models and a small separate one, minus `less`.
fn rows(less: f64, own: f64) -> Rows {
    let loss = |k: usize, h: usize| {
        let t = k as f64 + 100.0 * h as f64;
        1.0 + 0.3 * (0.37 * t).sin() + 0.02 * (own + 1.7 * t).sin() - less
    };
    std::array::from_fn(|h| (0..90).map(|k| loss(k, h)).collect())
}

#[test]
fn a_better_model_leaves_the_reference_and_worse_laws_behind() {
    let resamples = Resamples::new(&[90], 3.0, 999, 1);
    let (reference, models) = (rows(0.0, 0.0), [rows(0.1, 1.0), rows(0.0, 2.0), rows(0.1, 3.0)]);
    let found = table(&reference, &models, &[], &[rows(-0.2, 4.0)], &resamples, &Policy::DEFAULT);
    let p: Vec<f64> = found.rows.iter().map(|row| row.p).collect();
    assert!(p[0] < 0.01 && p[1] > 0.05 && p[2] < 0.01, "{p:?}");
    for set in &found.sets {
        assert!(set.models[0] && !set.models[1] && set.models[2] && !set.reference && !set.laws[0], "{set:?}");
    }
    // Over whole drives a gain is a share of the loss; at shorter horizons it is a share of the logarithm of squared errors.
    let gains = &found.rows[0].gains;
    assert!(
        (gains[2].share - 0.1).abs() < 0.01 && (gains[0].share - (1.0 - (-0.05_f64).exp())).abs() < 0.01,
        "{gains:?}"
    );
    let none = table(&reference, &[rows(0.0, 2.0)], &[], &[], &resamples, &Policy::DEFAULT);
    assert!(none.rows[0].p > 0.05 && none.sets.iter().all(|set| set.reference), "{none:?}");
    // A single model is found from about three standard errors on, each of which is at most 1 % of the error here.
    let [needed, gain] = none.found;
    assert!((2.5..6.0).contains(&needed) && gain > 0.0 && gain < 0.06, "{none:?}");
}

#[test]
fn a_model_that_is_worse_over_whole_drives_is_left_behind() {
    let resamples = Resamples::new(&[90], 3.0, 999, 1);
    let models = [rows(0.1, 1.0), rows(0.0, 2.0), rows(0.1, 3.0)];
    let best = best_over_whole_drives(&models.each_ref(), &resamples, &Policy::DEFAULT);
    assert_eq!(best, [true, false, true]);
}
