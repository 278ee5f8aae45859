//! Causes that could not be tried, and why.

use crate::evaluator::CaseError;
use crate::extension::{Extension, ExtensionConflict};
use crate::text::option::in_file;
use std::fmt;

/// Why a cause could not be tried. `Display` follows the name of the cause.
#[derive(Debug, Clone, PartialEq)]
pub enum Untried {
    /// It cannot be in the model.
    Conflict(ExtensionConflict),
    /// The data lack what it needs, or are too short.
    Data(CaseError),
    /// It acts once, and the models here are for many drives.
    Once,
    /// Parameters without a neutral value for which nothing gives a start value.
    NoStart {
        /// Their names; empty if the cause has no parameter at all.
        parameters: Vec<String>,
    },
    /// No start gives a complete run.
    NotFinite,
}

/// A cause that could not be tried, and why.
pub type Skipped = (&'static Extension, Untried);

impl Untried {
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Untried::Conflict(ExtensionConflict::Lacks { parameter, .. }) => {
                format!("diagnose a base model that has a parameter {parameter}")
            }
            Untried::Conflict(_) => "diagnose a base model without it".to_owned(),
            Untried::Data(CaseError::Missing { remedy, .. }) => in_file(|| remedy.to_string()),
            Untried::Data(_) => "give longer data".to_owned(),
            Untried::Once => "diagnose that drive alone".to_owned(),
            Untried::NoStart { parameters } if parameters.is_empty() => {
                "give it a size: a parameter with a neutral value".to_owned()
            }
            Untried::NoStart { .. } => {
                "give longer data, or a neutral value for each parameter that is neither a time of the file nor a frequency in Hz"
                    .to_owned()
            }
            Untried::NotFinite => {
                "keep the arguments of its divisions and roots in range, and check that the car keeps its distance"
                    .to_owned()
            }
        }
    }
}

impl fmt::Display for Untried {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Untried::Conflict(ExtensionConflict::Lacks { model, parameter, .. }) => {
                write!(f, "{model} has no {parameter}")
            }
            Untried::Conflict(conflict) => conflict.fmt(f),
            Untried::Data(CaseError::Missing { what, .. }) => write!(f, "needs {what}"),
            Untried::Data(error) => error.fmt(f),
            Untried::Once => f.write_str("tied to a time of one drive"),
            Untried::NoStart { parameters } if parameters.is_empty() => f.write_str("has no parameter to fit"),
            Untried::NoStart { parameters } => {
                write!(f, "the data give no start value for {}", parameters.join(", "))
            }
            Untried::NotFinite => f.write_str("gives no finite result at any size tried"),
        }
    }
}
