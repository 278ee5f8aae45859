//! Synthetic input of several tests: a drive, and one with a hidden effect.

use leadlag::internal::bench::{DiagnosisTask, Planted, planted};
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::{Drive, Effort, Question};
use leadlag::internal::extension::Extension;
use leadlag::internal::race::{Request, Unit};
use leadlag::internal::trajectory::{Source, Trajectory};
use leadlag::internal::wgsl::extension_named;

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

/// Four minutes each of three drives of this law with these causes of medium size.
pub fn task(kind: &str, base: &str, causes: &[&str], gusts_mps2: f64, seed: u64) -> DiagnosisTask {
    DiagnosisTask {
        kind: kind.to_owned(),
        base: base.to_owned(),
        causes: causes.iter().map(|&cause| cause.to_owned()).collect(),
        rms_mps: 0.10,
        gusts_mps2,
        duration_s: 240.0,
        seed,
        effort: "quick".to_owned(),
    }
}

/// A cause of medium size on a car of this law, in three drives of two minutes.
pub fn hidden(cause: &str, base: &str) -> DiagnosisTask {
    DiagnosisTask { duration_s: 120.0, ..task("one", base, &[cause], 0.0, 77) }
}

/// Its drives.
pub fn drives(cause: &str, base: &str) -> Planted {
    planted(&hidden(cause, base)).expect("a scenario that can be driven")
}

/// A quick diagnosis of drives by this base.
pub fn question<'a>(
    [train, holdout]: [&'a [Drive]; 2],
    base: &str,
    causes: &'a [&'static Extension],
    bounds: &'a Overrides,
) -> Question<'a> {
    let base = base.parse().expect("a base");
    Question { train, holdout, base, effort: Effort::Quick, seed: 5, causes, bounds }
}

/// A race of all these causes on recordings.
pub fn request<'a>(
    drives: &'a [Drive],
    base: &str,
    causes: &'a [&'static Extension],
    named: &'a [&'static Extension],
    bounds: &'a Overrides,
) -> Request<'a> {
    let base = base.parse().expect("a base");
    Request { drives, unit: Unit::Recording, base, causes, named, sensor_noise: None, bounds, seed: 1, rounds: 1 }
}

/// Causes of the library.
pub fn causes(names: &[&str]) -> Vec<&'static Extension> {
    names.iter().map(|name| extension_named(name).expect("in the library")).collect()
}
