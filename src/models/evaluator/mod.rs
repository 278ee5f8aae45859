//! Interface of the evaluators: candidates in, outcomes and scores out.

mod adapter;
mod case;
mod course;
mod fallback;
mod observer;
pub(crate) mod products;
mod raw;
mod splitting;
mod steps;
mod table;

pub use adapter::AdapterChoice;
pub use case::{Case, CaseError, InvalidParameter, Supply};
pub use course::smoothed_acceleration;
pub use course::{Course, CourseError, LEADER_SMOOTHING, Pace, WorldSignals};
pub use fallback::Fallback;
pub use observer::{Innovations, Observed, Observer, Pull, Residuals, Slopes, Soft, Windows};
pub use products::{Differences, Products, SIGNALS};
pub use raw::{Raw, status};
pub use splitting::Splitting;
pub use table::{Cell, Line, Table};

use crate::catalog::Variant;
use crate::convention::BoundRule;
use crate::score::{GoodnessOfFit, Measures};
use crate::symbols::{Parameters, Symbol};
use crate::text::option::{BOUNDS, EVALUATOR, PRECISION};

/// Candidates of one variant: parameter vectors, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Population {
    symbols: Vec<Symbol>,
    values: Vec<f64>,
}

impl Population {
    /// An empty population of candidates with these parameters.
    pub fn new(symbols: &[Symbol]) -> Population {
        Population { symbols: symbols.to_vec(), values: Vec::new() }
    }

    /// Adds a candidate. Panics if the number of values differs from that of the symbols.
    pub fn push(&mut self, candidate: &[f64]) {
        assert_eq!(candidate.len(), self.symbols.len(), "one value per symbol");
        self.values.extend_from_slice(candidate);
    }

    /// Removes all candidates, keeps the memory.
    pub fn clear(&mut self) {
        self.values.clear();
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.values.len().checked_div(self.symbols.len()).unwrap_or(0)
    }

    /// True without candidates.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The symbols, one per value of a candidate.
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// The values of a candidate, one per symbol.
    pub fn values(&self, candidate: usize) -> &[f64] {
        let width = self.symbols.len();
        &self.values[candidate * width..(candidate + 1) * width]
    }

    /// The index of a parameter among the values of a candidate; of several the last, as in [`Population::parameters`].
    #[cfg(feature = "gpu")]
    pub(crate) fn column_of(&self, symbol: Symbol) -> Option<usize> {
        self.symbols.iter().rposition(|own| *own == symbol)
    }

    /// The values at one place, of all candidates.
    #[cfg(feature = "gpu")]
    pub(crate) fn column(&self, place: usize) -> impl Iterator<Item = f64> {
        self.values[place.min(self.values.len())..].iter().step_by(self.symbols.len()).copied()
    }

    /// The named parameters of a candidate.
    pub fn parameters(&self, candidate: usize) -> Parameters {
        let width = self.symbols.len();
        let mut parameters = Parameters::NONE;
        for (&symbol, &value) in self.symbols.iter().zip(&self.values[candidate * width..]) {
            parameters.set(symbol, value);
        }
        parameters
    }
}

/// The cases of a joint score.
pub fn shares(cases: &[Case], gof: &GoodnessOfFit) -> Vec<Share> {
    cases.iter().map(|case| case.share(gof)).collect()
}

/// Why a run ended early, as written in result files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum FailureKind {
    /// The spacing is no longer above 0.
    #[strum(serialize = "spacing")]
    Crash,
    /// Gipps' radicand (Eq. 5) is negative: no speed is safe.
    Radicand,
    /// A state is NaN or infinite.
    NotFinite,
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
    /// The reason.
    pub kind: FailureKind,
    /// The sample at which it happened.
    pub step: usize,
}

/// Result of one simulated candidate.
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
    /// The score of a candidate from its outcomes, one per case; see [`Score::joint`].
    pub fn of(outcomes: impl IntoIterator<Item = (Outcome, Share)>, gof: &GoodnessOfFit, rule: BoundRule) -> Score {
        Score::joint(outcomes.into_iter().map(|(outcome, share)| (outcome.score(gof, rule), share)))
    }

    /// The score of a candidate from its scores on several cases: their mean, or the root of the weighted mean of their squares.
    ///
    /// A run that ended early outranks a touched bound. Its step includes those of earlier cases, so that of two failed candidates the one
    /// that came further is better.
    pub fn joint(scores: impl IntoIterator<Item = (Score, Share)>) -> Score {
        let (mut passed, mut rejected, mut all) = (0, false, Together::default());
        for (score, share) in scores {
            match score {
                Score::Failed(failure) => return Score::Failed(Failure { step: passed + failure.step, ..failure }),
                Score::Rejected => rejected = true,
                Score::Value(value) => all.add(value, share),
            }
            passed += share.samples;
        }
        if rejected { Score::Rejected } else { Score::Value(all.value()) }
    }
}

/// A case in the score of several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    pub samples: usize,
    /// Weight of its squared value if drives are pooled; `None` if their values are averaged.
    pub weight: Option<f64>,
}

/// The values of several cases as one.
#[derive(Debug, Clone, Copy, Default)]
pub struct Together {
    sum: f64,
    weights: f64,
    pooled: bool,
}

impl Together {
    /// Adds the value of a case.
    pub fn add(&mut self, value: f64, share: Share) {
        self.pooled = share.weight.is_some();
        self.sum += share.weight.map_or(value, |weight| weight * value * value);
        self.weights += share.weight.unwrap_or(1.0);
    }

    /// The mean, or the root of the weighted mean of squares.
    pub fn value(&self) -> f64 {
        let mean = self.sum / self.weights;
        if self.pooled { mean.sqrt() } else { mean }
    }

    /// The sum of the weights.
    pub fn weights(&self) -> f64 {
        self.weights
    }
}

impl Outcome {
    /// The score on this one case.
    pub fn score(&self, gof: &GoodnessOfFit, rule: BoundRule) -> Score {
        match &self.result {
            Err(failure) => Score::Failed(*failure),
            Ok(_) if self.is_rejected(rule) => Score::Rejected,
            Ok(measures) => Score::Value(gof.of(measures)),
        }
    }

    /// True if it touched an acceleration bound and the convention rejects such candidates.
    pub fn is_rejected(&self, rule: BoundRule) -> bool {
        rule == BoundRule::Reject && self.n_cut_acc + self.n_cut_dec > 0
    }
}

/// An evaluation that failed as a whole (a candidate that fails is a [`Score`]).
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    #[error("expected room for {candidates} scores, found {scores}")]
    Room { candidates: usize, scores: usize },
    #[error(
        "{name}: expected at most {upper} s, found {found}; the upper bound of {name} limits the memory of a simulation: raise it in a {BOUNDS} file"
    )]
    Delay {
        name: String,
        /// The upper bound \[s\].
        upper: f64,
        found: f64,
    },
    #[error(transparent)]
    Course(#[from] CourseError),
    #[error("{}", no_adapter(wanted.as_deref(), present))]
    Adapter { wanted: Option<String>, present: Vec<String> },
    #[error("no GPU: leadlag was built without the feature `gpu`; use {EVALUATOR} lanes")]
    NoGpuBuilt,
    #[error(
        "no GPU: drivers need an address space of {} MiB, found a limit of {} MiB; raise it (`ulimit -v unlimited`), or use \
         {EVALUATOR} lanes",
        needed >> 20,
        limit >> 20
    )]
    AddressSpace {
        /// Available memory \[bytes\].
        limit: u64,
        /// Required memory \[bytes\].
        needed: u64,
    },
    #[error(
        "the reference has no second transcription of extension {extension}, so it cannot simulate variant {variant}; use \
         {EVALUATOR} lanes, with {PRECISION} f64 for as many digits"
    )]
    Untranscribed { extension: String, variant: String },
    #[error(transparent)]
    Model(Box<dyn std::error::Error + Send + Sync>),
    #[error("{doing} on {adapter}: {message}")]
    Device { doing: &'static str, adapter: String, message: String },
    #[error(
        "{adapter} does not have enough memory: {message}; close other programs that use it, or use {EVALUATOR} lanes"
    )]
    Memory { adapter: String, message: String },
}

fn no_adapter(wanted: Option<&str>, present: &[String]) -> String {
    match (wanted, present) {
        (_, []) => {
            format!(
                "no GPU adapter found; install the driver of the GPU, or a software one (Debian, Ubuntu: apt-get install \
                 mesa-vulkan-drivers libvulkan1), or use {EVALUATOR} lanes, which needs none"
            )
        }
        (None, _) => format!("none of these adapters can be used:\n  {}", present.join("\n  ")),
        (Some(wanted), _) => format!(
            "no GPU adapter `{wanted}`; expected an index, a PCI address or a name of one of these:\n  {}",
            present.join("\n  ")
        ),
    }
}

/// Candidates to simulate on one case.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// Index into [`Evaluator::cases`].
    pub case: usize,
    /// The candidates.
    pub population: &'a Population,
}

impl Job<'_> {
    /// Candidates in several jobs.
    pub fn candidates(jobs: &[Job]) -> usize {
        jobs.iter().map(|job| job.population.len()).sum()
    }
}

/// One of the two sets of buffers: while the candidates of one are simulated, the other can be filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BufferSet {
    /// The first.
    A = 0,
    /// The second.
    B = 1,
}

/// Wall time besides computing since the evaluator was made \[s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timings {
    /// Moving candidates to the device and scores back \[s\].
    pub transfer_s: f64,
    /// The first dispatch, in which a driver compiles \[s\].
    pub first_dispatch_s: f64,
}

impl std::ops::Add for Timings {
    type Output = Timings;

    fn add(self, other: Timings) -> Timings {
        Timings {
            transfer_s: self.transfer_s + other.transfer_s,
            first_dispatch_s: self.first_dispatch_s + other.first_dispatch_s,
        }
    }
}

/// Implements methods of [`Evaluator`] by those of an evaluator in a field: `forward_evaluator!(inner: cases, gof, submit);`.
#[doc(hidden)]
#[macro_export]
macro_rules! forward_evaluator {
    ($inner:ident: $($method:ident),+) => { $($crate::forward_evaluator!(@ $method $inner);)+ };
    (@ cases $inner:ident) => { fn cases(&self) -> &[$crate::evaluator::Case] { self.$inner.cases() } };
    (@ gof $inner:ident) => { fn gof(&self) -> &$crate::score::GoodnessOfFit { self.$inner.gof() } };
    (@ name $inner:ident) => { fn name(&self) -> &'static str { self.$inner.name() } };
    (@ precision $inner:ident) => { fn precision(&self) -> &'static str { self.$inner.precision() } };
    (@ adapter $inner:ident) => { fn adapter(&self) -> Option<String> { self.$inner.adapter() } };
    (@ overlaps $inner:ident) => { fn overlaps(&self) -> bool { self.$inner.overlaps() } };
    (@ submit $inner:ident) => {
        fn submit(
            &mut self,
            set: $crate::evaluator::BufferSet,
            jobs: &[$crate::evaluator::Job<'_>],
        ) -> Result<(), $crate::evaluator::EvaluateError> {
            self.$inner.submit(set, jobs)
        }
    };
    (@ outcomes $inner:ident) => {
        fn outcomes(
            &mut self,
            jobs: &[$crate::evaluator::Job<'_>],
        ) -> Result<Vec<$crate::evaluator::Outcome>, $crate::evaluator::EvaluateError> {
            self.$inner.outcomes(jobs)
        }
    };
}

/// Simulates populations of one variant over its cases.
pub trait Evaluator: Send {
    /// The cases; all of one variant.
    fn cases(&self) -> &[Case];
    /// The measure to minimise.
    fn gof(&self) -> &GoodnessOfFit;
    /// `reference`, `lanes` or `gpu`.
    fn name(&self) -> &'static str;
    /// `f64`, `plain` or `compensated`.
    fn precision(&self) -> &'static str;
    /// The device, if any.
    fn adapter(&self) -> Option<String> {
        None
    }
    /// Seconds spent besides computing; zeros if there are none.
    fn timings(&self) -> Timings {
        Timings::default()
    }
    /// True if host and evaluator work at the same time, so that two buffer sets are useful.
    fn overlaps(&self) -> bool {
        false
    }
    /// Starts simulating jobs; [`Evaluator::collect`] waits for them. Fails when the evaluator cannot run.
    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError>;
    /// One score per candidate of the jobs last submitted with this set, in order. Does not allocate after the first call with a given number of
    /// candidates. Fails unless there is one score per candidate, or when the
    /// evaluator cannot run.
    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError>;
    /// Scores of free runs with their derivatives, by finite differences, in the order of `differences`; a score is infinite where a run of
    /// the group fails. `None` if the evaluator has no device to compute them on. Fails when the evaluator cannot run.
    ///
    /// # Panics
    /// If differences name missing candidates.
    fn slopes(&mut self, _: &Job<'_>, _: &[Differences]) -> Result<Option<Vec<Slopes>>, EvaluateError> {
        Ok(None)
    }
    /// Results of the candidates, in the order of the jobs. Fails when the evaluator cannot run.
    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError>;

    fn variant(&self) -> &Variant {
        &self.cases()[0].variant
    }
    /// One score per candidate, in order, over all cases; failed if one case failed.
    fn evaluate(&mut self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError> {
        let candidates = population.len();
        if scores.len() != candidates {
            return Err(EvaluateError::Room { candidates, scores: scores.len() });
        }
        let jobs: Vec<Job> = (0..self.cases().len()).map(|case| Job { case, population }).collect();
        self.submit(BufferSet::A, &jobs)?;
        if jobs.len() == 1 {
            return self.collect(BufferSet::A, scores);
        }
        let mut all = vec![Score::Rejected; Job::candidates(&jobs)];
        self.collect(BufferSet::A, &mut all)?;
        let shares = shares(self.cases(), self.gof());
        for (i, score) in scores.iter_mut().enumerate() {
            *score = Score::joint(shares.iter().enumerate().map(|(k, share)| (all[k * candidates + i], *share)));
        }
        Ok(())
    }
}
