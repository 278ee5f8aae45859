//! Drives of one driver behind different leaders are not reported as those of two, and most mixtures of two drivers are
//! detected.

use crate::common::made_up;
use leadlag::internal::bench::{DiagnosisTask, planted};
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::Drive;
use leadlag::internal::diagnose::drive::drivers::different_drivers;
use leadlag::internal::trajectory::{Note, different_names};

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

/// Measured cars with adaptive cruise control follow so alike that their errors do not tell them apart; names in the data do.
#[test]
fn data_that_name_two_followers_are_not_of_one_driver() {
    let mut drives = drives("idm", 7300);
    let mut found = |names: [&str; 2], modes: [Option<&str>; 2]| {
        for (drive, (name, mode)) in drives.iter_mut().zip(names.into_iter().zip(modes)) {
            let trajectory = &mut drive.trajectory;
            name.clone_into(&mut trajectory.name);
            trajectory.notes.retain(|note| !matches!(note, Note::DriverMode { .. }));
            let mode = mode.map(|mode| Note::DriverMode { car: 2, t_s: 0.0, mode: mode.to_owned() });
            trajectory.notes.extend(mode);
        }
        different_names(&drives[..2].iter().map(|drive| &drive.trajectory).collect::<Vec<_>>())
    };
    let unknown = [None, None];
    for alike in [["Audi(A6)"; 2], ["car 2", "car 3"], ["vehicle 7", "8"], ["follower", "Audi(A6)"], ["", "Audi(A6)"]] {
        assert_eq!(found(alike, unknown), None, "{alike:?}");
    }
    for modes in [[Some("ACC"), None], [Some("ACC"), Some("ACC")]] {
        assert_eq!(found(["Audi(A6)"; 2], modes), None, "{modes:?}");
    }
    let (count, told) = found(["Tesla(Model3)", "Audi(A6)"], unknown).expect("two names");
    assert!(count == 2 && told.starts_with("the data name 2 followers, such as Audi(A6) in "), "{told}");
    let (count, told) = found(["Audi(A6)"; 2], [Some("Human"), Some("ACC")]).expect("two drivers");
    assert!(count == 2 && told.starts_with("the data name 2 drivers, such as ACC in "), "{told}");
}
