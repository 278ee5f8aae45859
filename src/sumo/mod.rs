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

use std::io;
use std::path::PathBuf;

/// An export to SUMO that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SumoError {
    /// The base model has no counterpart.
    #[error(
        "SUMO has no car-following model like {base}: {why}; calibrate idm (SUMO: IDM) or l-cth (SUMO: ACC) on the same data \
         and export that"
    )]
    NoCounterpart {
        /// The base model.
        base: &'static str,
        /// The difference.
        why: &'static str,
    },
    /// The requested model is not that of the base model.
    #[error("--to {asked}: {base} can be exported as {possible}")]
    WrongModel {
        /// The requested model.
        asked: &'static str,
        /// The base model.
        base: &'static str,
        /// Values that it may have.
        possible: &'static str,
    },
    /// The table of the simulation cannot be read.
    #[error("{path}: cannot read the simulated drive")]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause of the error.
        source: csv::Error,
    },
    /// The table of the simulation is invalid.
    #[error("{path}: expected the simulation.csv of `leadlag calibrate`, {problem}")]
    Drive {
        /// The file.
        path: PathBuf,
        /// The fault.
        problem: String,
    },
    /// SUMO is not there.
    #[error(
        "no SUMO found: {tried}; install it (`pip install eclipse-sumo`), or give its place with --sumo or SUMO_HOME"
    )]
    NoSumo {
        /// Places that were searched.
        tried: String,
    },
    /// SUMO could not be started or ended early.
    #[error("{program}: SUMO ended early: {said}")]
    Ended {
        /// The program.
        program: PathBuf,
        /// Its last output.
        said: String,
    },
    /// A file for SUMO could not be written, or the connection broke.
    #[error("{what}")]
    Io {
        /// The attempted operation.
        what: String,
        /// The cause of the error.
        source: io::Error,
    },
    /// SUMO refused a command.
    #[error("SUMO refused to {what}: {said}")]
    Refused {
        /// The command.
        what: &'static str,
        /// Its reason.
        said: String,
    },
}
