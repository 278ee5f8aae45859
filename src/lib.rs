//! leadlag calibrates and validates car-following and adaptive-cruise-control (ACC) models against measured platoon
//! trajectories.
//!
//! It computes the ninety model variants of He, Montanino, Mattas, Punzo and Ciuffo (2022): five base models, each with and without
//! perception delay, with three kinds of vehicle dynamics and three kinds of acceleration constraint. leadlag simulates a *candidate* (one
//! parameter vector) behind the measured preceding vehicle and scores the differences of its spacing, speed and acceleration from the
//! measured ones; a calibration searches for the candidate with the best score.
//!
//! ```text
//!  file --import--> Recording --prepare--> Trajectory --Case::new--> Case     (variant, vehicle, convention)
//!                                                                      |
//!  optimize --candidates--> Evaluator --scores--> optimize             |      calibrate; Evaluator: reference, lanes or gpu
//!                                                                      |
//!  report <-- result.json, simulation.csv, plot.svg <-- identify <-----'
//!
//!  Trajectory --> diagnose: what a base model lacks, and what that is worth --> report
//! ```
//!
//! # Example
//!
//! ```no_run
//! let drive = leadlag::read("platoon.csv")?.follower(1)?;
//! let fit = leadlag::Calibration::of("idm+linear")?.seed(1).run(&drive)?;
//! println!("{fit}");
//! let other = leadlag::read("other.csv")?.follower(1)?;
//! println!("NRMSE(s,v,a) {}", fit.simulate(&other)?.scores["nrmse_sva"]);
//! # Ok::<(), leadlag::Error>(())
//! ```
//!
//! [`Calibration::evaluate_on`] makes an [`Evaluator`], which scores populations for your own optimiser, and has residuals and normal
//! equations for a least-squares solver; [`Fleet`] calibrates thousands of pairs; [`Diagnosis`] finds what a model lacks; [`Study`] runs a
//! plan in a folder. A model is a [`Variant`], whose base may be your own [`Law`]. All of them use [`Drive`], a measured follower;
//! [`Reading`] has the options for reading one.
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
    Calibration, Diagnosis, Drive, Error, Evaluator, Findings, Fit, Fleet, Law, NormalEquations, Pairs, Reading,
    Recording, Simulation, Study, Variant, program, read, synthetic,
};
pub use study::table::{Column, Table, Values};

/// Internal modules, public for the tests, benches and examples of this repository. They may change in any version.
#[doc(hidden)]
#[path = "."]
pub mod internal {
    #[cfg(feature = "cli")]
    pub mod bench;
    pub mod fleet;
    #[cfg(feature = "report")]
    pub mod report;
    pub mod study;
    #[cfg(feature = "report")]
    pub mod sumo;

    pub use leadlag_data::{statistics, text, trajectory, vehicle, whole};
    pub use leadlag_diagnosis::{describe, diagnose, drivers, judge, race, result};
    #[cfg(feature = "gpu")]
    pub use leadlag_models::gpu;
    pub use leadlag_models::{
        by_hand, calibrate, catalog, convention, evaluate, evaluator, extension, identify, lanes, optimize, plant,
        reference, rescore, score, select, simulate, symbols, wgsl,
    };
}

#[cfg(feature = "gpu")]
use internal::gpu;
#[cfg(feature = "cli")]
use internal::{bench, by_hand, evaluate};
use internal::{
    calibrate, catalog, convention, describe, diagnose, drivers, evaluator, extension, fleet, identify, lanes,
    optimize, plant, race, reference, rescore, result, score, select, simulate, statistics, study, symbols, text,
    trajectory, vehicle, wgsl, whole,
};
#[cfg(feature = "report")]
use internal::{report, sumo};

/// The examples of the book, compiled and run as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../docs/LIBRARY.md")]
struct Book;
