//! Drives and models for tests with little or no fitting.

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::fit::{Fit, Point};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::outcome::Tried;
use crate::diagnose::question::{Effort, Question};
use crate::diagnose::search::fitted_model::{CrossValidated, FittedModel};
use crate::diagnose::select::adopt::State;
use crate::extension::Extension;
use crate::trajectory::{Preparation, import, prepare};
use crate::wgsl::extension_named;
use nalgebra::{DMatrix, DVector};
use std::fmt::Write;

/// Two minutes of a follower that always keeps 3 m + 1.5 s v, in a file of this name whose clock starts at `begin` \[s\].
pub fn drive(name: &str, begin: f64) -> Drive {
    let mut file = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for i in 0..1200 {
        let t = 0.1 * f64::from(i);
        let (v, rate) = (15.0 + 8.0 * (0.1 * t).sin(), 0.8 * (0.1 * t).cos());
        writeln!(file, "{:.1},{},{v},{}", begin + t, v + 1.5 * rate, 3.0 + 1.5 * v).expect("memory");
    }
    read(&file, name)
}

/// Half a minute of a linear driver with these settings (k_s, k_v, d_0, t_h), behind a car whose speed changes with this period \[s\], in
/// gusts of this size \[m/s²\].
pub fn linear_driver(name: &str, [k_s, k_v, d_0, t_h]: [f64; 4], period: f64, gusts: f64) -> Drive {
    let mut file = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    let (dt, mut v) = (0.1, 15.0);
    let mut s = d_0 + t_h * v;
    for i in 0..300 {
        let t = dt * f64::from(i);
        let lead = 15.0 + 5.0 * (std::f64::consts::TAU * t / period).sin();
        writeln!(file, "{t:.1},{lead},{v},{s}").expect("memory");
        let a = k_s * (s - d_0 - t_h * v) + k_v * (lead - v) + gusts * (2.1 * t + period).sin();
        s += (lead - v) * dt;
        v += a * dt;
    }
    read(&file, name)
}

fn read(file: &str, name: &str) -> Drive {
    let recording = import::read_bytes(file.as_bytes(), name, None).expect("a pair file");
    let trajectory = prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0);
    Drive::of(&trajectory, None).expect("no jump").0.remove(0)
}

/// A cause of the library.
pub fn cause(name: &str) -> &'static Extension {
    extension_named(name).expect("in the library")
}

/// L-CTH with these causes, without a fit.
pub fn candidate(drives: &[Drive], names: &[&str]) -> FittedModel {
    let causes: Vec<&'static Extension> = names.iter().map(|name| cause(name)).collect();
    let base: Variant = "l-cth".parse().expect("a base");
    let variant = causes.iter().try_fold(base, |variant, cause| variant.with(cause)).expect("they go together");
    let model = Model::new(variant, drives, &Overrides::new(), &[]).expect("a model");
    let values = model.axes.iter().map(|axis| axis.value(0.4)).collect();
    let fit = Fit {
        point: Point { values, noise: Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 1e-3 } },
        log_likelihood: 0.0,
        errors: Vec::new(),
        converged: true,
        coordinates: Vec::new(),
        information: DMatrix::zeros(0, 0),
        gradient: DVector::zeros(0),
    };
    FittedModel { variant, causes, model, fit }
}

/// A quick question about L-CTH, with no causes to try.
pub fn question<'a>(train: &'a [Drive], holdout: &'a [Drive], bounds: &'a Overrides) -> Question<'a> {
    let base = "l-cth".parse().expect("a base");
    Question { train, holdout, base, effort: Effort::Quick, seed: 1, causes: &[], bounds }
}

/// The state of a search with this model; each of its causes has 50 nats, where 20 are needed.
pub fn search(current: FittedModel, ladder: Vec<Tried>) -> State {
    State {
        evidence: current.causes.iter().map(|_| (50.0, 20.0)).collect(),
        current,
        held: CrossValidated { folds: [Vec::new(), Vec::new()] },
        bare: 0.0,
        rivals: Vec::new(),
        ladder,
        stopped: Vec::new(),
        not_testable: Vec::new(),
        untried: Vec::new(),
        need: 20.0,
        inflation: 1.5,
        cut_short: false,
    }
}
