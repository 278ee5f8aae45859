//! The public interface: read a drive, calibrate a model, simulate the result on another
//! drive, score a population, diagnose. The command line and the Python package are built on it.

pub(crate) mod bounds;
pub(crate) mod calibration;
pub(crate) mod diagnosis;
mod drive;
pub(crate) mod error;
pub(crate) mod extension;
mod fit;
pub(crate) mod fleet;
pub(crate) mod folds;
mod least_squares;
pub(crate) mod loading;
pub(crate) mod model;
pub(crate) mod once;
mod own;
mod population;
pub(crate) mod reading;
pub(crate) mod study;
#[cfg(feature = "cli")]
pub(crate) mod values;
pub(crate) mod warnings;

#[doc(inline)]
pub use crate::calibrate::Progress as SearchProgress;
#[doc(inline)]
pub use crate::diagnose::Progress;
pub use calibration::{Calibration, program};
pub use diagnosis::{Diagnosis, Findings};
pub use drive::{Drive, Recording, read, synthetic};
pub use error::Error;
pub use fit::{Fit, Simulation};
pub use fleet::{Fleet, Pairs};
pub use least_squares::NormalEquations;
pub use model::{Law, Variant};
pub use population::Evaluator;
pub use reading::Reading;
pub use study::Study;
