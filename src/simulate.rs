//! Running calibrated parameters again: on another trajectory, or behind a simulated car.

use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::Case;
use crate::reference::Trace;
use crate::symbols::Parameters;

/// A variant with calibrated parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedVariant {
    /// The variant.
    pub variant: Variant,
    /// The convention it was calibrated under.
    pub convention: Convention,
    /// Its parameters.
    pub parameters: Parameters,
    /// Upper bound of the perception delay \[s\], which fixes the scored window.
    pub tau_p_upper: f64,
}

/// Cars that do not share a time axis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{behind} has {samples} samples and {ahead}, the car ahead, {found}: cut both to one window with --from and --to"
)]
pub struct AxisError {
    behind: String,
    ahead: String,
    samples: usize,
    found: usize,
}

/// The case of a follower whose preceding vehicle is a simulated one.
///
/// Positions of two pairs are counted from different zeros; the measured start of the shared car tells the difference.
///
/// # Errors
/// [`AxisError`] if the two do not have the same number of samples.
pub fn follow(case: &Case, ahead: &Case, simulated: &Trace) -> Result<Case, AxisError> {
    if simulated.x.len() != case.x_l.len() {
        return Err(AxisError {
            behind: case.label.to_string(),
            ahead: ahead.label.to_string(),
            samples: case.x_l.len(),
            found: simulated.x.len(),
        });
    }
    let shift = case.x_l[0] - ahead.x_f[0];
    Ok(Case {
        x_l: simulated.x.iter().map(|x| x + shift).collect(),
        v_l: simulated.v.as_slice().into(),
        ..case.clone()
    })
}
