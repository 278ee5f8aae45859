//! Errors, divided into wrong usage and failures.

use crate::calibrate::BoundsError;
use crate::study::{DriveError, StudyError};
use crate::synthetic::SyntheticError;
use crate::trajectory::PrepareError;
use crate::vehicle::VehicleError;
use std::fmt;

/// An error of leadlag: place, expected value, found value, remedy.
pub struct Error(anyhow::Error);

impl Error {
    /// True if the request is invalid, whatever the data.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        is_usage(&self.0)
    }
}

impl From<anyhow::Error> for Error {
    fn from(error: anyhow::Error) -> Error {
        Error(error)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)?;
        // Does not repeat a cause that is already quoted.
        let said = self.0.to_string();
        self.0
            .chain()
            .skip(1)
            .map(ToString::to_string)
            .filter(|cause| !said.contains(cause.as_str()))
            .try_for_each(|cause| write!(f, "; because: {cause}"))
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {}

/// The request is invalid, whatever the data.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Usage(pub(crate) String);

/// Returns from a function with an invalid request in these words.
macro_rules! refuse {
    ($($text:tt)*) => { return Err($crate::api::error::Usage(format!($($text)*)).into()) };
}
pub(crate) use refuse;

impl From<Usage> for Error {
    fn from(usage: Usage) -> Error {
        anyhow::Error::from(usage).into()
    }
}

/// True for an invalid request.
pub(crate) fn is_usage(error: &anyhow::Error) -> bool {
    let bounds = |e: &BoundsError| !matches!(e, BoundsError::Read { .. });
    error.is::<Usage>()
        || error.downcast_ref().is_some_and(bounds)
        || error.downcast_ref().is_some_and(|e| matches!(e, VehicleError::Unknown { .. }))
        || error.downcast_ref().is_some_and(|e| {
            use PrepareError::{Backwards, NoFollower, NoTrajectory, Option};
            matches!(e, Option { .. } | Backwards { .. } | NoFollower { .. } | NoTrajectory { .. })
        })
        || error.downcast_ref().is_some_and(|e| {
            use SyntheticError::{NobodyAhead, OutOfRange, TooLate};
            matches!(e, OutOfRange { .. } | NobodyAhead { .. } | TooLate { .. })
        })
        || error.downcast_ref().is_some_and(is_usage_of_study)
}

/// True if the plan or the request is invalid, as elsewhere.
fn is_usage_of_study(error: &StudyError) -> bool {
    use StudyError::{Bounds, Drive, ForeignPlan, Missing, NoTask, Plan, PlanForFolder};
    match error {
        Plan(plan) => !matches!(plan, crate::study::PlanError::Read { .. }),
        Drive(DriveError::Prepare { source, .. }) => is_usage(&PrepareError::clone(source).into()),
        // Settings that these data need but the plan lacks.
        Drive(DriveError::Several { .. } | DriveError::Map { .. }) | Missing { .. } => true,
        Drive(DriveError::Vehicle(vehicle)) => matches!(vehicle, VehicleError::Unknown { .. }),
        Bounds { .. } | ForeignPlan(_) | NoTask { .. } | PlanForFolder(_) => true,
        _ => false,
    }
}

/// An invalid request.
pub(crate) fn usage(error: impl std::error::Error) -> Error {
    Usage(error.to_string()).into()
}
