//! Short runs from the reference's own state: what f32 does wrong in a few steps, whatever the run makes of it later.

use crate::common::tolerance::{FIRST_STEP, UNSTABLE, WINDOW};
use leadlag::evaluator::Case;
use leadlag::lanes::Lanes;
use leadlag::reference::{Reference, Trace};
use leadlag::symbols::{Parameters, Symbol};

/// Samples between restarts.
const LENGTH: usize = 50;

/// Spacing, speed and acceleration.
pub const SIGNALS: [(&str, &str); 3] = [("s", "m"), ("v", "m/s"), ("a", "m/s2")];

/// The largest differences of a run, over all windows.
#[derive(Default)]
pub struct Largest {
    /// In the first step of a window: spacing \[m\], speed \[m/s\], acceleration \[m/s²\].
    pub first_step: [f64; 3],
    /// In all steps of the windows that are not unstable.
    pub difference: [f64; 3],
    /// Windows, and the unstable ones among them.
    pub windows: usize,
    pub unstable: usize,
    problem: Option<String>,
}

impl Largest {
    /// What exceeds the tolerances, if anything.
    pub fn problem(&self) -> Option<&String> {
        self.problem.as_ref()
    }

    fn note(&mut self, what: &str, k: usize, t: usize, reference: f64, found: f64) {
        let (name, unit) = SIGNALS[k];
        let text = || format!("{what}, step {t}: {name} = {found} {unit}, reference {reference} {unit}");
        self.problem.get_or_insert_with(text);
    }
}

/// A tolerance grows with the spacing, whose last bit does.
fn allowed(tolerances: &[f64; 3], k: usize, reference: f64) -> f64 {
    if k == 0 { tolerances[k] * (reference.abs() / 100.0).max(1.0) } else { tolerances[k] }
}

fn rounded(parameters: &Parameters) -> Parameters {
    let mut rounded = Parameters::NONE;
    for symbol in Symbol::ALL {
        let value = parameters.get(*symbol);
        // The delay is prepared in f64 for all evaluators.
        rounded.set(*symbol, if *symbol == Symbol::tau_p { value } else { f64::from(value as f32) });
    }
    rounded
}

/// Restarts `lanes` every 50 samples from the states of the reference. The first step is judged always; the whole window unless
/// it is unstable: f64, started from the same states rounded to f32 or moved by one last bit of it, leaves the reference too.
pub fn largest(case: &Case, parameters: &Parameters, lanes: &Lanes, exact: &Lanes) -> Largest {
    let mut trace = Trace::default();
    let outcome = Reference::outcome(case, parameters, &mut trace);
    // At the sample of a failure, the states are those of a crash or nothing at all.
    let end = outcome.result.err().map_or(trace.s.len(), |failure| failure.step);
    let signals = [&trace.s, &trace.v, &trace.a];
    // Starts that f32 hardly tells apart; each excites another mode of an unstable controller.
    type Move = fn(f32) -> f32;
    let starts: [[Move; 3]; 3] =
        [[|s| s, |v| v, |a| a], [f32::next_up, f32::next_up, f32::next_up], [f32::next_down, f32::next_up, |a| a]];
    let in_f32 = starts.map(|moves| {
        [0, 1, 2].map(|k| signals[k].iter().map(|value| f64::from(moves[k](*value as f32))).collect::<Vec<f64>>())
    });
    let parameters_in_f32 = rounded(parameters);
    let mut largest = Largest::default();
    let first = case.first_sample(parameters.tau_p);
    for from in (first..end).step_by(LENGTH) {
        let to = (from + LENGTH).min(end);
        let states = |lanes: &Lanes, parameters: &Parameters, past: [&[f64]; 3]| {
            let past = past.map(|signal| &signal[..from]);
            lanes.trace(0, parameters, past, from, to).expect("a delay within bounds")
        };
        let found = states(lanes, parameters, signals.map(|signal| signal.as_slice()));
        largest.windows += 1;
        for k in 0..3 {
            let (reference, state) = (signals[k][from], found[0][k]);
            let difference = (state - reference).abs();
            largest.first_step[k] = largest.first_step[k].max(difference);
            if difference > allowed(&FIRST_STEP, k, reference) {
                largest.note("first step of a window", k, from, reference, state);
            }
        }
        let mut differences = [0.0_f64; 3];
        let mut beyond = (found.len() + 1 < to - from).then_some((0, from + found.len(), f64::NAN, f64::NAN));
        for (t, state) in (from..to).zip(&found) {
            for k in 0..3 {
                let difference = (state[k] - signals[k][t]).abs();
                differences[k] = differences[k].max(difference);
                if difference > allowed(&WINDOW, k, signals[k][t]) {
                    beyond = beyond.or(Some((k, t, signals[k][t], state[k])));
                }
            }
        }
        let Some((k, t, reference, state)) = beyond else {
            for (largest, difference) in largest.difference.iter_mut().zip(differences) {
                *largest = largest.max(difference);
            }
            continue;
        };
        let far = |(t, state): (usize, &[f64; 3])| {
            (0..3).any(|k| (state[k] - signals[k][t]).abs() * UNSTABLE >= allowed(&WINDOW, k, signals[k][t]))
        };
        let leaves = |start: &[Vec<f64>; 3]| {
            let found = states(exact, &parameters_in_f32, [0, 1, 2].map(|k| start[k].as_slice()));
            found.len() < to - from || (from..to).zip(&found).any(far)
        };
        if in_f32.iter().any(leaves) {
            largest.unstable += 1;
        } else {
            largest.note("window", k, t, reference, state);
        }
    }
    largest
}
