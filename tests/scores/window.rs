//! Short runs from the reference's own state: what f32 does wrong in a few steps, whatever the run makes of it later.

use leadlag::evaluator::Case;
use leadlag::lanes::Lanes;
use leadlag::reference::{Reference, Trace};
use leadlag::symbols::Parameters;

/// Samples between restarts.
const LENGTH: usize = 50;

/// Spacing, speed and acceleration.
pub const SIGNALS: [(&str, &str); 3] = [("s", "m"), ("v", "m/s"), ("a", "m/s2")];

/// The largest differences of a run, over all windows.
#[derive(Default)]
pub struct Largest {
    /// Spacing \[m\], speed \[m/s\], acceleration \[m/s²\].
    pub difference: [f64; 3],
    /// Where: the sample, the reference's value, the value found.
    place: [(usize, f64, f64); 3],
    /// A window that ended before the reference did: its first sample, and the samples it came to.
    short: Option<(usize, usize)>,
}

impl Largest {
    /// What exceeds the tolerances, if anything.
    pub fn problem(&self, tolerances: &[f64; 3]) -> Option<String> {
        if let Some((from, came_to)) = self.short {
            return Some(format!(
                "the window from sample {from} ends after {came_to} samples, the reference's does not"
            ));
        }
        let worst = (0..3).find(|k| self.difference[*k] > tolerances[*k])?;
        let ((name, unit), (step, reference, found)) = (SIGNALS[worst], self.place[worst]);
        Some(format!("step {step}: {name} = {found} {unit}, reference {reference} {unit}"))
    }
}

/// Restarts `lanes` every 50 samples from the states of the reference.
pub fn largest(case: &Case, parameters: &Parameters, lanes: &Lanes) -> Largest {
    let mut trace = Trace::default();
    let outcome = Reference::outcome(case, parameters, &mut trace);
    // At the sample of a failure, the states are those of a crash or nothing at all.
    let end = outcome.result.err().map_or(trace.s.len(), |failure| failure.step);
    let signals = [&trace.s, &trace.v, &trace.a];
    let mut largest = Largest::default();
    let first = case.first_sample(parameters.tau_p);
    for from in (first..end).step_by(LENGTH) {
        let to = (from + LENGTH).min(end);
        let history = signals.map(|signal| &signal[..from]);
        let states = lanes.trace(0, parameters, history, from, to).expect("a delay within bounds");
        // One step less is the same crash one step earlier.
        if states.len() + 1 < to - from {
            largest.short = largest.short.or(Some((from, states.len())));
        }
        for (t, state) in (from..to).zip(&states) {
            for k in 0..3 {
                let difference = (state[k] - signals[k][t]).abs();
                if difference > largest.difference[k] {
                    largest.difference[k] = difference;
                    largest.place[k] = (t, signals[k][t], state[k]);
                }
            }
        }
    }
    largest
}
