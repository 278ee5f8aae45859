//! Synthetic input of several tests: a drive, and one with a hidden effect.

use leadlag::internal::bench::DiagnosisTask;
use leadlag::internal::trajectory::{Source, Trajectory};

/// Positions [m] and speeds [m/s] of one car.
pub struct Way {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
}

/// A drive with this time step [s] behind a car of 5 m, on a level road.
pub fn trajectory(label: impl Into<String>, dt: f64, leader: Way, follower: Way) -> Trajectory {
    Trajectory {
        label: label.into(),
        source: Source { path: String::new(), sha256: String::new() },
        follower: 1,
        name: String::new(),
        dt,
        id: None,
        dt_raw: dt,
        t: (0..leader.v.len()).map(|i| i as f64 * dt).collect(),
        s: leader.x.iter().zip(&follower.x).map(|(x_l, x_f)| x_l - x_f - 5.0).collect(),
        x_l: leader.x,
        v_l: leader.v,
        len_l: 5.0,
        x_f: follower.x,
        is_placed: false,
        v_f: follower.v,
        v_l2: None,
        s_l2: None,
        grade: None,
        notes: Vec::new(),
    }
}

/// A cause of medium size on a car of this law, in three drives of two minutes.
pub fn hidden(cause: &str, base: &str) -> DiagnosisTask {
    DiagnosisTask {
        kind: "one".to_owned(),
        base: base.to_owned(),
        causes: vec![cause.to_owned()],
        rms_mps: 0.10,
        gusts_mps2: 0.0,
        duration_s: 120.0,
        seed: 77,
        effort: "quick".to_owned(),
    }
}
