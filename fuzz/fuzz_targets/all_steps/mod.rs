//! Everything that is done to a file: reading, inspection, preparation in its variants.

use leadlag::trajectory::{Preparation, Reconcile, Recording, import, inspect, prepare};

/// No step may panic, and whatever is prepared must be finite, equally long and free of crashes.
#[allow(dead_code, reason = "the target of column maps reads in another way")]
pub fn run(bytes: &[u8], layout: Option<&str>) {
    let layout = layout.map(|name| name.parse().expect("a layout"));
    let recording = match import::read_bytes(bytes, "fuzz.csv", layout) {
        Ok(recording) => recording,
        Err(error) => return drop(error.to_string()),
    };
    check(&recording);
}

/// The same for what was read already.
pub fn check(recording: &Recording) {
    let _ = inspect(recording).to_string();
    let plain = Preparation::default();
    let speeds = Preparation { reconcile: Reconcile::Speeds, smooth: true, ..Preparation::default() };
    let resampled = Preparation {
        resample: Some(0.05),
        from: Some(0.5),
        max_gap_s: 0.3,
        lead_start_m: Some(10.0),
        lead_length: Some(4.0),
        ..Preparation::default()
    };
    for follower in 0..4 {
        for preparation in [&plain, &speeds, &resampled] {
            let Ok(trajectories) = prepare(recording, follower, preparation) else {
                continue;
            };
            for trajectory in trajectories {
                let n = trajectory.len();
                assert!(n >= 2);
                for signal in [&trajectory.x_l, &trajectory.v_l, &trajectory.x_f, &trajectory.v_f, &trajectory.s] {
                    assert!(signal.len() == n && signal.iter().all(|value| value.is_finite()));
                }
                assert!(trajectory.s.iter().all(|&s| s > 0.0));
                assert!(trajectory.v_f.iter().chain(&trajectory.v_l).all(|&v| v >= 0.0));
                for signal in [&trajectory.v_l2, &trajectory.s_l2].into_iter().flatten() {
                    assert!(signal.len() == n && signal.iter().all(|value| value.is_finite()));
                }
                let _ = trajectory.grade.map(|grade| grade.at(trajectory.x_f[n / 2]));
                for note in &trajectory.notes {
                    let _ = note.to_string();
                }
            }
        }
    }
}
