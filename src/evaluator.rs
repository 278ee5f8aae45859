//! What the evaluators share: candidates in, outcomes and scores out.

mod case;

pub use case::{Case, CaseError, InvalidParameter};

use crate::catalog::Variant;
use crate::convention::BoundRule;
use crate::score::{GoodnessOfFit, Measures};
use crate::symbols::{Parameters, Symbol};

/// Candidates of one variant: parameter vectors, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    symbols: Vec<Symbol>,
    values: Vec<f64>,
}

impl Population {
    /// An empty population of candidates with these parameters.
    #[must_use]
    pub fn new(symbols: &[Symbol]) -> Population {
        Population { symbols: symbols.to_vec(), values: Vec::new() }
    }

    /// Adds a candidate.
    ///
    /// # Panics
    /// If it has not one value per symbol.
    pub fn push(&mut self, candidate: &[f64]) {
        assert_eq!(candidate.len(), self.symbols.len(), "one value per symbol");
        self.values.extend_from_slice(candidate);
    }

    /// Removes all candidates, keeps the memory.
    pub fn clear(&mut self) {
        self.values.clear();
    }

    /// Number of candidates.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len().checked_div(self.symbols.len()).unwrap_or(0)
    }

    /// True without candidates.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The named parameters of a candidate.
    #[must_use]
    pub fn parameters(&self, candidate: usize) -> Parameters {
        let width = self.symbols.len();
        let mut parameters = Parameters::NONE;
        for (&symbol, &value) in self.symbols.iter().zip(&self.values[candidate * width..]) {
            parameters.set(symbol, value);
        }
        parameters
    }
}

/// Why a run ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureKind {
    /// The spacing is not above 0 any more.
    Crash,
    /// Gipps' radicand (Eq. 5) is negative: no speed is safe.
    Radicand,
    /// A state is NaN or infinite.
    NotFinite,
}

impl FailureKind {
    /// As written in result files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            FailureKind::Crash => "spacing",
            FailureKind::Radicand => "radicand",
            FailureKind::NotFinite => "not_finite",
        }
    }
}

impl std::fmt::Display for FailureKind {
    /// In words, for people.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            FailureKind::Crash => "crash, the spacing is not above 0",
            FailureKind::Radicand => "no speed is safe, Gipps' radicand is negative",
            FailureKind::NotFinite => "a state is NaN or infinite",
        })
    }
}

/// A run that ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Failure {
    /// Why.
    pub kind: FailureKind,
    /// The sample at which it happened.
    pub step: usize,
}

/// Everything one simulated candidate tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The measures, or why there are none.
    pub result: Result<Measures, Failure>,
    /// Perception delay in samples; whole if the convention floors it.
    pub delay_steps: f64,
    /// Steps clipped at the upper acceleration bound.
    pub n_cut_acc: u32,
    /// Steps clipped at the lower acceleration bound.
    pub n_cut_dec: u32,
}

/// The score of a candidate in a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Score {
    /// Value of the goodness of fit; lower is better.
    Value(f64),
    /// The run ended early.
    Failed(Failure),
    /// It touched an acceleration bound under the convention `bounds=reject`.
    Rejected,
}

impl Score {
    /// The score of a candidate from its outcomes, one per case: the mean of `gof`.
    ///
    /// A run that ended early outranks a touched bound, and its step counts on from the cases passed before it, so that
    /// of two failed candidates the one that came further is the better.
    #[must_use]
    pub fn of(outcomes: impl IntoIterator<Item = (Outcome, usize)>, gof: &GoodnessOfFit, rule: BoundRule) -> Score {
        let (mut sum, mut count, mut passed, mut rejected) = (0.0, 0.0, 0, false);
        for (outcome, samples) in outcomes {
            match outcome.result {
                Err(failure) => return Score::Failed(Failure { step: passed + failure.step, ..failure }),
                Ok(measures) => sum += gof.of(&measures),
            }
            rejected |= outcome.is_rejected(rule);
            passed += samples;
            count += 1.0;
        }
        if rejected { Score::Rejected } else { Score::Value(sum / count) }
    }
}

impl Outcome {
    /// True if it touched an acceleration bound where that rejects a candidate.
    #[must_use]
    pub fn is_rejected(&self, rule: BoundRule) -> bool {
        rule == BoundRule::Reject && self.n_cut_acc + self.n_cut_dec > 0
    }
}

/// An evaluation that could not be done (never a candidate that fails: that is a [`Score`]).
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// As many scores as candidates are needed.
    #[error("expected room for {candidates} scores, found {scores}")]
    Room {
        /// Candidates in the population.
        candidates: usize,
        /// Scores asked for.
        scores: usize,
    },
}

/// Simulates populations of one variant over its cases.
pub trait Evaluator {
    /// The variant.
    fn variant(&self) -> &Variant;
    /// `reference`, `lanes` or `gpu`.
    fn name(&self) -> &'static str;
    /// `f64`, `plain` or `compensated`.
    fn precision(&self) -> &'static str;
    /// The device, where there is one.
    fn adapter(&self) -> Option<String> {
        None
    }
    /// One score per candidate, in order: the mean over the cases; failed if one case failed.
    ///
    /// # Errors
    /// [`EvaluateError::Room`] unless there is one score per candidate.
    fn evaluate(&mut self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError>;
    /// All outcomes of one candidate, one per case.
    ///
    /// # Errors
    /// When the evaluator cannot run.
    fn outcomes(&mut self, parameters: &Parameters) -> Result<Vec<Outcome>, EvaluateError>;
}
