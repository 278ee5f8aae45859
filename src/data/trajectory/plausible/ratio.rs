//! A gap that changes by another amount than the speeds say, by a factor that its own error excludes.

use super::Signals;
use crate::trajectory::factor::{self, Ratio};

/// Sensors and filters are scaled by this much without anybody's mistake.
const TOLERANCE: f64 = 1.06;

pub(super) fn said(signals: &Signals) -> Option<String> {
    let dv: Vec<f64> = signals.v_l.iter().zip(signals.v_f).map(|(v_l, v_f)| v_l - v_f).collect();
    let Ratio { value, interval: [low, high] } = factor::measured([(signals.t, dv.as_slice(), signals.gap)])?;
    if low <= TOLERANCE && high >= 1.0 / TOLERANCE {
        return None;
    }
    let hint = factor::explain(value).map_or_else(String::new, |hint| format!(" ({hint})"));
    Some(format!(
        "{}: changes {value:.3} times ({low:.2} to {high:.2}) as much as the speeds say{hint}: check units",
        signals.called
    ))
}
