//! leadlag calibrates and validates car-following and adaptive-cruise-control (ACC) models against measured platoon
//! trajectories.
//!
//! It computes the ninety model variants of He, Montanino, Mattas, Punzo and Ciuffo (2022): five base models, each with
//! and without perception delay, with three kinds of vehicle dynamics and three kinds of acceleration constraint. A
//! *candidate* (one parameter vector) is simulated behind the measured preceding vehicle and scored by how far its
//! spacing, speed and acceleration are from the measured ones; a calibration searches the candidate with the best score.
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
//! A synthetic platoon instead of a file, so that the example runs anywhere:
//!
//! ```
//! use leadlag::calibrate::{Calibration, Overrides, SearchSpace, Stop, best, calibrate};
//! use leadlag::catalog::Variant;
//! use leadlag::convention::Convention;
//! use leadlag::evaluator::Case;
//! use leadlag::plant;
//! use leadlag::reference::Reference;
//! use leadlag::score::GoodnessOfFit;
//! use leadlag::trajectory::{Preparation, import, prepare};
//! use std::ops::ControlFlow;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let platoon = plant::run(&plant::Scenario { duration_s: 120.0, ..Default::default() })?;
//! let mut file = Vec::new();
//! plant::write_pair(&platoon, 1, &mut file)?;
//!
//! let recording = import::read_bytes(&file, "pair.csv", None)?; // or import::read(Path::new("pair.csv"), None)
//! let trajectory = &prepare(&recording, 1, &Preparation::default())?[0];
//!
//! let variant: Variant = "idm+linear".parse()?; // or Variant::from_id(4)
//! let space = SearchSpace::new(&variant, None, Convention::PAPER, &Overrides::new())?;
//! let case = Case::new(trajectory, variant, None, Convention::PAPER, space.tau_p_upper())?;
//! let mut evaluator = Reference::new(vec![case], GoodnessOfFit::NRMSE_SVA);
//!
//! let settings = Calibration { seed: 1, stop: Stop { max_evaluations: 2_000, ..Stop::default() }, ..Default::default() };
//! let replicates = calibrate(&mut evaluator, &space, &settings, &mut |_| ControlFlow::Continue(()))?;
//! let found = best(&replicates).expect("one replicate");
//! for (symbol, value) in space.symbols.iter().zip(&found.candidate) {
//!     println!("{symbol:?} = {value} {}", symbol.unit());
//! }
//! assert!(found.score < 0.3, "NRMSE(s,v,a) = {}", found.score);
//! # Ok(())
//! # }
//! ```

mod api;
#[cfg(feature = "cli")]
pub mod bench;
pub mod bounded;
pub mod calibrate;
pub mod catalog;
#[cfg(feature = "cli")]
pub mod cli;
pub mod closed_loop;
pub mod convention;
pub mod diagnose;
pub mod evaluate;
pub mod evaluator;
pub mod extension;
pub mod fleet;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod identify;
pub mod judge;
pub mod lanes;
pub mod near;
pub mod optimize;
pub mod plant;
pub mod recommend;
pub mod reference;
#[cfg(feature = "report")]
pub mod report;
pub mod rescore;
pub mod result;
pub mod score;
pub mod select;
pub mod shown;
pub mod simulate;
pub mod study;
pub mod symbols;
pub mod trajectory;
pub mod validate;
pub mod vehicle;
pub mod wgsl;

pub use api::{
    Calibration, Diagnosis, Drive, Error, Evaluator, Findings, Fit, Fleet, Pairs, Reading, Recording, Simulation, read,
};
pub use study::table::Table;

/// The examples of the book, compiled and run as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../docs/LIBRARY.md")]
struct Book;
