//! Short runs from the reference's own state: errors of f32 in a few steps, independent of the rest of the run.

use crate::common::tolerance::{FIRST_STEP, UNSTABLE, WINDOW};
use leadlag::internal::evaluator::Case;
use leadlag::internal::evaluator::Outcome;
use leadlag::internal::lanes::Lanes;
use leadlag::internal::reference::Trace;
use leadlag::internal::symbols::{Parameters, Symbol};

/// Samples between restarts.
const LENGTH: usize = 50;

/// Spacing, speed and acceleration.
pub const SIGNALS: [(&str, &str); 3] = [("s", "m"), ("v", "m/s"), ("a", "m/s2")];

/// The largest differences of a run, over the windows that were judged.
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
    /// Values that exceed the tolerances, if any.
    pub fn problem(&self) -> Option<&String> {
        self.problem.as_ref()
    }

    fn note(&mut self, what: &str, k: usize, t: usize, reference: f64, found: f64) {
        let (name, unit) = SIGNALS[k];
        let text = || format!("{what}, step {t}: {name} = {found} {unit}, reference {reference} {unit}");
        self.problem.get_or_insert_with(text);
    }

    /// Both together.
    pub fn and(mut self, other: Largest) -> Largest {
        for k in 0..3 {
            self.first_step[k] = self.first_step[k].max(other.first_step[k]);
            self.difference[k] = self.difference[k].max(other.difference[k]);
        }
        self.windows += other.windows;
        self.unstable += other.unstable;
        self.problem = self.problem.or(other.problem);
        self
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

/// Moves spacing, speed and acceleration by nothing or by one last bit.
type Move = [fn(f32) -> f32; 3];

/// Starts that f32 hardly distinguishes, per signal; each excites another mode of an unstable controller.
const STARTS: [Move; 3] =
    [[|s| s, |v| v, |a| a], [f32::next_up, f32::next_up, f32::next_up], [f32::next_down, f32::next_up, |a| a]];

/// The states of one candidate at the samples from `from` to `to` - 1, from a given past.
fn states(lanes: &Lanes, parameters: &Parameters, past: [&[f64]; 3], from: usize, to: usize) -> Vec<[f64; 3]> {
    lanes.trace(0, parameters, past.map(|signal| &signal[..from]), from, to).expect("a delay within bounds")
}

/// A run of the reference, from whose states f32 is restarted.
pub struct Run<'a> {
    pub parameters: Parameters,
    pub trace: &'a Trace,
    pub in_f32: &'a Lanes,
    pub in_f64: &'a Lanes,
    /// The first simulated sample, and one past the last one whose state is defined.
    first: usize,
    end: usize,
}

impl<'a> Run<'a> {
    pub fn new(
        case: &Case,
        parameters: Parameters,
        (outcome, trace): (&Outcome, &'a Trace),
        [in_f32, in_f64]: [&'a Lanes; 2],
    ) -> Run<'a> {
        // At the sample of a failure, the states are those of a crash or nothing at all.
        let end = outcome.result.as_ref().err().map_or(trace.s.len(), |failure| failure.step);
        Run { first: case.first_sample(parameters.tau_p), parameters, trace, in_f32, in_f64, end }
    }

    /// Every window of the run.
    pub fn every_window(&self) -> Largest {
        (self.first..self.end).step_by(LENGTH).map(|from| self.window(from)).fold(Largest::default(), Largest::and)
    }

    /// One window, at a place from 0 (first) to 1 (last); none for a run that fails at once.
    pub fn one_window(&self, place: f64) -> Largest {
        let last = self.end.saturating_sub(LENGTH).max(self.first);
        let from = self.first + ((last - self.first) as f64 * place) as usize;
        if from < self.end { self.window(from) } else { Largest::default() }
    }

    /// Distance of f64 in lanes, which rounds in another order, from the reference's spacing in the whole run \[m\]: almost 0
    /// unless the run is chaotic.
    pub fn departure(&self) -> f64 {
        let past = [&self.trace.s, &self.trace.v, &self.trace.a].map(Vec::as_slice);
        let found = states(self.in_f64, &self.parameters, past, self.first, self.end);
        let differences = found.iter().zip(&self.trace.s[self.first..]).map(|(state, s)| (state[0] - s).abs());
        differences.fold(0.0, f64::max)
    }

    /// Restarts f32 from the state of the reference. The first step is judged always; the whole window unless it is unstable: f64,
    /// started from the same states rounded to f32 or moved by one last bit of it, departs from the reference, too.
    fn window(&self, from: usize) -> Largest {
        let mut largest = Largest { windows: 1, ..Largest::default() };
        let to = (from + LENGTH).min(self.end);
        let signals = [&self.trace.s, &self.trace.v, &self.trace.a].map(Vec::as_slice);
        let found = states(self.in_f32, &self.parameters, signals, from, to);
        for k in 0..3 {
            let (reference, state) = (signals[k][from], found.first().map_or(f64::NAN, |state| state[k]));
            let difference = (state - reference).abs();
            largest.first_step[k] = difference;
            if difference.is_nan() || difference > allowed(&FIRST_STEP, k, reference) {
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
            largest.difference = differences;
            return largest;
        };
        let parameters = rounded(&self.parameters);
        let far = |(t, state): (usize, &[f64; 3])| {
            (0..3).any(|k| (state[k] - signals[k][t]).abs() * UNSTABLE >= allowed(&WINDOW, k, signals[k][t]))
        };
        let leaves = |moves: &Move| {
            let start = [0, 1, 2].map(|k| {
                signals[k][..from].iter().map(|value| f64::from(moves[k](*value as f32))).collect::<Vec<f64>>()
            });
            let found = states(self.in_f64, &parameters, start.each_ref().map(Vec::as_slice), from, to);
            found.len() < to - from || (from..to).zip(&found).any(far)
        };
        if STARTS.iter().any(leaves) {
            largest.unstable = 1;
        } else {
            largest.note("window", k, t, reference, state);
        }
        largest
    }
}
