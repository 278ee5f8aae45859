//! Stretches that no model follows are found, with any cause, and none is found if the car follows.

use crate::common::{self, made_up};
use leadlag::internal::bench::{DiagnosisTask, planted};
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::Drive;
use leadlag::internal::race::{NotFollowed, Policy, not_followed, without};
use leadlag::internal::trajectory::{Preparation, import, prepare};
use leadlag::internal::wgsl::library;

fn drives(kind: &str, base: &str, causes: &[&str], seed: u64) -> Vec<Drive> {
    let task = DiagnosisTask { duration_s: 420.0, ..made_up::task(kind, base, causes, 0.05, seed) };
    planted(&task).expect("drivable").train
}

fn found(drives: &[Drive], base: &str) -> Vec<NotFollowed> {
    let causes: Vec<_> = library().iter().copied().filter(|extension| extension.cause.is_some()).collect();
    let bounds = Overrides::new();
    let request = made_up::request(drives, base, &causes, &[], &bounds);
    not_followed(&request, &Policy::DEFAULT).expect("it runs")
}

/// While the car is fast, the driver falls back by some twenty metres and catches up again, within forty seconds. Returns the start.
fn a_driver_interferes(drive: &mut Drive) -> f64 {
    let data = &mut drive.trajectory;
    let length = (40.0 / data.dt).round() as usize;
    let slowest = |from: &usize| data.v_f[*from..from + length].iter().copied().fold(f64::INFINITY, f64::min);
    let from = (600..data.len() - length).max_by(|a, b| slowest(a).total_cmp(&slowest(b))).expect("a long drive");
    assert!(slowest(&from) > 3.0, "it always stands");
    let mut behind = 0.0;
    for t in from..data.len() {
        if t < from + length {
            let slower = 2.0 * (std::f64::consts::TAU * (t - from) as f64 / length as f64).sin();
            behind += slower * data.dt;
            data.v_f[t] -= slower;
        }
        data.s[t] += behind;
        data.x_f[t] -= behind;
    }
    data.t[from]
}

#[test]
fn a_driver_is_found_and_the_car_is_not() {
    for (base, seed) in [("l-cth", 4301), ("idm", 4302)] {
        let mut drives = drives("none", base, &[], seed);
        assert_eq!(found(&drives, base), [], "{base}: no driver interfered");
        let begin = a_driver_interferes(&mut drives[1]);
        let stretches = found(&drives, base);
        let [stretch] = stretches.as_slice() else { panic!("{base}, from {begin} s: {stretches:?}") };
        let [from, to] = stretch.when;
        assert_eq!(stretch.recording, drives[1].recording());
        assert!(from < begin + 30.0 && to > begin + 10.0 && to - from < 110.0, "{base}, from {begin} s: {stretch:?}");
        // In the middle of a drive it stays; near its ends it is cut off.
        let length = drives[1].samples() as f64 * drives[1].dt();
        let near_an_end = from - drives[1].trajectory.t[0] < 60.0 || drives[1].trajectory.t[0] + length - to < 61.0;
        assert_eq!(stretch.is_left_out, near_an_end, "{base}: {stretch:?}");
        let left_after =
            |is_left_out| without(&drives, &[NotFollowed { is_left_out, ..stretch.clone() }], &Policy::DEFAULT);
        let (whole, left) = (left_after(false), left_after(true));
        assert!(whole.iter().zip(&drives).all(|(a, b)| a.samples() == b.samples()));
        assert_eq!(left[0].samples(), drives[0].samples());
        let inside = |drive: &Drive| drive.trajectory.t.iter().any(|t| (stretch.when[0]..=stretch.when[1]).contains(t));
        assert!(left.len() > 1 && !left[1..].iter().any(inside), "{} drives", left.len());
    }
}

/// A permanent property of the car needs an explanation, not a cut.
#[test]
fn what_the_car_does_is_no_interference() {
    for (base, cause, seed) in [("gipps", "headway_mode_change", 4304), ("idm", "actuation_lag", 4305)] {
        assert_eq!(found(&drives("one", base, &[cause], seed), base), [], "{cause} on {base}");
    }
    assert_eq!(found(&drives("coloured", "idm", &[], 4306), "idm"), []);
}

/// In two of three platoons the Tesla's driver brings it up to speed.
#[test]
fn the_tesla_is_brought_up_to_speed() {
    let Some(shared) = common::shared("the_tesla_is_brought_up_to_speed") else { return };
    let drive = |platoon: u32| {
        let file = shared.join(format!("data/astazero_rebuilt/ASta_040719_platoon{platoon}.csv"));
        let recording = import::read(&file, None).expect("a platoon");
        let trajectory = prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0);
        Drive::of(&trajectory, None).expect("no jump").0
    };
    let drives: Vec<Drive> = [7, 8, 9].into_iter().flat_map(drive).collect();
    let stretches = found(&drives, "l-cth");
    let platoons: Vec<bool> =
        ["platoon7", "platoon8", "platoon9"].map(|name| stretches.iter().any(|s| s.file.contains(name))).to_vec();
    assert_eq!(platoons, [true, true, false], "{stretches:?}");
    for stretch in &stretches {
        assert!(stretch.when[1] < 61.0, "the first minute: {stretch:?}");
    }
}
