//! Drives of one driver behind different leaders are not reported as those of two, and most mixtures of two drivers are
//! detected.

use crate::common::made_up;
use leadlag::internal::bench::{DiagnosisTask, planted};
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::Drive;
use leadlag::internal::diagnose::drive::drivers::different_drivers;

/// Three drives of a driver, each behind a leader that cruises, is restless, or stops and goes.
fn drives(base: &str, seed: u64) -> Vec<Drive> {
    let gusts = if seed.is_multiple_of(2) { 0.0 } else { 0.05 };
    let task = DiagnosisTask { rms_mps: 0.0, duration_s: 400.0, ..made_up::task("none", base, &[], gusts, seed) };
    let planted = planted(&task).expect("drivable");
    planted.train.into_iter().chain(planted.holdout).collect()
}

#[test]
fn one_driver_is_not_called_two_and_most_mixtures_are_noticed() {
    let of = |base: &str, drives: &[&Drive]| {
        let base = base.parse().expect("a base");
        different_drivers(drives, base, &Overrides::new(), 1).expect("it runs").is_some()
    };
    let mut noticed = 0;
    for (base, seed) in ["idm", "l-cth"].into_iter().flat_map(|base| (7300..7308).map(move |seed| (base, seed))) {
        let (one, other) = (drives(base, seed), drives(base, seed + 100));
        assert!(!of(base, &[&one[0], &one[1], &one[2]]), "{base} {seed}: one driver");
        noticed += usize::from(of(base, &[&one[0], &one[1], &other[0]]));
    }
    assert!(noticed >= 14, "{noticed} of 16");
}
