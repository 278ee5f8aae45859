//! How the data of a drive were treated before a calibration.

use super::{Note, Trajectory};
use serde::{Deserialize, Serialize};

/// Treatment of data: results with different treatments are not comparable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Treatment {
    /// Smoothed as the paper's authors did.
    pub smoothed: bool,
    /// Time step \[s\].
    pub step_s: f64,
    /// The reference of the spacing.
    pub spacing_from: String,
}

impl Treatment {
    pub fn of(trajectory: &Trajectory) -> Treatment {
        let anchor = trajectory.notes.iter().find_map(|note| match note {
            Note::Reconciled { anchor, .. } => Some(anchor.clone()),
            _ => None,
        });
        Treatment {
            smoothed: trajectory.notes.iter().any(|note| matches!(note, Note::Smoothed { .. })),
            step_s: trajectory.dt,
            spacing_from: anchor.unwrap_or_default(),
        }
    }

    /// A warning that a calibration was made on data of this treatment, and that the present ones have another.
    pub fn differs(&self, now: &Treatment) -> Option<String> {
        (self != now).then(|| format!("calibrated on data prepared differently: {self}; now: {now}"))
    }
}

impl std::fmt::Display for Treatment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let smoothed = if self.smoothed { "smoothed" } else { "not smoothed" };
        write!(f, "{smoothed}, step {} s, spacing from {}", self.step_s, self.spacing_from)
    }
}
