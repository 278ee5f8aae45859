//! leadlag calibrates and validates car-following and adaptive-cruise-control (ACC) models against measured platoon
//! trajectories.
//!
//! It has the ninety model variants of He, Montanino, Mattas, Punzo and Ciuffo (2022): five base models, each with and without perception
//! delay, with three kinds of vehicle dynamics and three kinds of acceleration constraint. leadlag simulates a *candidate* (one parameter
//! vector) behind the measured preceding vehicle and scores the differences of its spacing, speed and acceleration from the measured ones.
//!
//! # A tour
//!
//! A [`Drive`] is one measured follower behind its leader: [`read`] reads a file, [`Reading`] sets layout, window and vehicle, and
//! [`synthetic()`] generates a drive to try things without data.
//!
//! ```
//! let drive = leadlag::synthetic(1, 60.0)?.follower(1)?;
//! assert_eq!((drive.len(), drive.time_step()), (601, 0.1));
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! A [`Variant`] is a model: a base, which may be your own [`Law`], then delay, dynamics and constraint, then extensions.
//!
//! ```
//! let model = leadlag::Variant::named("idm+delay+linear")?.extend("leader_accel_ff")?;
//! assert_eq!(model.parameters().last(), Some(&"ka"));
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! A [`Calibration`] searches for the candidate with the best score; its [`Fit`] has the parameters with 95 % intervals, and simulates
//! them on other drives.
//!
//! ```
//! # let drive = leadlag::synthetic(1, 60.0)?.follower(1)?;
//! # let other = leadlag::synthetic(2, 60.0)?.follower(1)?;
//! let fit = leadlag::Calibration::of("idm")?.max_evaluations(2_000).run(&drive)?;
//! println!("{fit}NRMSE(s,v,a) of another drive: {}", fit.simulate(&other)?.scores["nrmse_sva"]);
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! `run_on` reports the progress ([`SearchProgress`] of a calibration, [`Progress`] of a diagnosis) and stops on request; a calibration
//! then returns the best candidate so far.
//!
//! ```
//! # let drive = leadlag::synthetic(1, 60.0)?.follower(1)?;
//! use std::ops::ControlFlow::{Break, Continue};
//!
//! let mut watch = |now: leadlag::SearchProgress| if now.evaluations < 500 { Continue(()) } else { Break(()) };
//! let fit = leadlag::Calibration::of("idm")?.run_on(&[&drive], &mut watch)?;
//! # assert!(fit.score().is_finite() && fit.intervals().is_empty());
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! An [`Evaluator`] scores the candidates of your own optimiser, on the CPU or a GPU, and has residuals and [`NormalEquations`] for a
//! least-squares solver.
//!
//! ```
//! # let drive = leadlag::synthetic(1, 60.0)?.follower(1)?;
//! let mut evaluator = leadlag::Calibration::of("idm")?.evaluate_on(&[&drive])?;
//! let candidates = [evaluator.lower(), evaluator.upper()].concat();
//! assert_eq!(evaluator.scores(&candidates)?.len(), 2);
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! A [`Fleet`] calibrates models to many [`Pairs`] separately, and returns a [`Table`] with a row per pair and model.
//!
//! ```
//! # let drives = [leadlag::synthetic(1, 60.0)?.follower(1)?, leadlag::synthetic(2, 60.0)?.follower(1)?];
//! let pairs = leadlag::Pairs::of_drives(&[&drives[0], &drives[1]]);
//! let table = leadlag::Fleet::of(&["idm", "gipps"])?.each(|one| one.max_evaluations(500)).run(&pairs)?;
//! assert_eq!(table.rows(), 4);
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! A [`Diagnosis`] finds the effects that a model lacks: for one car on all its drives, or for the drivers of a fleet.
//!
//! ```no_run
//! use leadlag::{Diagnosis, Pairs, Reading};
//!
//! let drive = leadlag::read("platoon.csv")?.follower(1)?;
//! let findings = Diagnosis::of("l-cth")?.effort("quick")?.run(&[&drive], &[])?;
//! println!("{}; calibrate with {:?}", findings.reason(), findings.recommended());
//!
//! let fleet = Pairs::read(&Reading::default(), &["pairs.csv"])?;
//! println!("{}", Diagnosis::of("idm")?.run_all(&fleet)?.reason());
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! A [`Study`] calibrates many models to many drives by a plan; several processes may share its folder, and an interrupted run continues.
//!
//! ```no_run
//! let study = leadlag::Study::create("plan.toml", "study")?;
//! study.run(&|| false, &mut |done, all| eprintln!("{done} of {all} tasks"))?;
//! let [calibrations, validations] = study.merged()?;
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! # Features
//!
//! | feature | what it adds |
//! |---|---|
//! | `gpu` | the evaluator `gpu`, by wgpu |
//! | `parquet` | reading and writing Parquet tables |
//! | `report` | texts, pictures and pages |
//! | `cli` | the command line, [`cli::run`]; `report` and `parquet` with it |
//!
//! All are on by default. Without them, the evaluators on the CPU remain, in f32 and f64.

#![warn(missing_docs)]

mod api;
#[cfg(feature = "cli")]
pub mod cli;

pub use api::{
    Calibration, Diagnosis, Drive, Error, Evaluator, Findings, Fit, Fleet, Law, NormalEquations, Pairs, Progress,
    Reading, Recording, SearchProgress, Simulation, Study, Variant, program, read, synthetic,
};
pub use study::table::{Column, Table, Values};

/// Internal modules, public for the tests, benches and examples of this repository. They may change in any version.
#[doc(hidden)]
#[path = "."]
pub mod internal {
    pub mod batch;
    #[cfg(feature = "cli")]
    pub mod bench;
    pub mod fleet;
    #[cfg(feature = "report")]
    pub mod report;
    pub mod study;
    #[cfg(feature = "report")]
    pub mod sumo;

    pub use leadlag_data::{statistics, text, trajectory, vehicle, whole};
    pub use leadlag_diagnosis::{describe, diagnose, drivers, judge, pooling, race, result};
    #[cfg(feature = "gpu")]
    pub use leadlag_models::gpu;
    pub use leadlag_models::{
        by_hand, calibrate, catalog, convention, evaluate, evaluator, extension, forward_evaluator, identify, lanes,
        optimize, reference, rescore, score, select, simulate, symbols, synthetic, wgsl,
    };
}

#[cfg(feature = "gpu")]
use internal::gpu;
use internal::{
    batch, calibrate, catalog, convention, describe, diagnose, drivers, evaluator, extension, fleet, identify, lanes,
    optimize, pooling, race, reference, rescore, result, score, select, simulate, statistics, study, symbols,
    synthetic, text, trajectory, vehicle, wgsl, whole,
};
#[cfg(feature = "cli")]
use internal::{bench, by_hand, evaluate};
#[cfg(feature = "report")]
use internal::{report, sumo};

/// The examples of the book, compiled and run as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../docs/LIBRARY.md")]
struct Book;
