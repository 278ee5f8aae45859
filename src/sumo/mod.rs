//! A calibrated variant as a vehicle type of SUMO, the parts that the type lacks, and the difference from leadlag behind the same
//! leader. The mapping, model by model, is in `docs/SUMO.md`.

mod compare;
mod drive;
mod file;
mod run;
mod traci;
mod vtype;

pub use compare::{Comparison, Loss, compare};
pub use drive::{Drive, Motion};
pub use file::{Export, ExportedDrive};
pub use run::{Sumo, files, find};
pub use vtype::{Distribution, Model, VehicleType, export};

use crate::text::option::{SUMO, TO};
use std::io;
use std::path::PathBuf;

/// An export to SUMO that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SumoError {
    #[error(
        "SUMO has no car-following model like {base}: {why}; calibrate idm (SUMO: IDM) or l-cth (SUMO: ACC) on the same data \
         and export that"
    )]
    NoCounterpart { base: &'static str, why: &'static str },
    #[error("{TO} {asked}: {base} can be exported as {possible}")]
    WrongModel { asked: &'static str, base: &'static str, possible: &'static str },
    #[error("{path}: cannot read the simulated drive")]
    Read { path: PathBuf, source: csv::Error },
    #[error("{path}: expected the simulation.csv of `leadlag calibrate`, {problem}")]
    Drive { path: PathBuf, problem: String },
    #[error(
        "no SUMO found: {tried}; install it (`pip install eclipse-sumo`), or give its place with {SUMO} or SUMO_HOME"
    )]
    NoSumo { tried: String },
    #[error("{program}: SUMO ended early: {said}")]
    Ended { program: PathBuf, said: String },
    #[error("{what}")]
    Io { what: String, source: io::Error },
    #[error("SUMO refused to {what}: {said}")]
    Refused { what: &'static str, said: String },
}
