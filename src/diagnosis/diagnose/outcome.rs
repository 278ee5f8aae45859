//! What a diagnosis answers.

use crate::catalog::Variant;
use crate::diagnose::judge::fate::Fate;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::search::skipped::Skipped;
use crate::evaluator::Innovations;
use crate::extension::Extension;
use crate::judge::Check;
use crate::symbols::Parameters;
use serde::{Deserialize, Serialize};

/// The answer in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The causes are named.
    Named,
    /// One of several, which these data cannot tell apart.
    Ambiguous,
    /// Nothing is found that the base model lacks.
    Nothing,
    /// What might be missing is absorbed by the calibration.
    NotTestable,
    /// Something is missing, and no cause explains it.
    Unexplained,
    /// The base model is not calibrated: no cause can be judged.
    BadBase,
}

impl Verdict {
    /// Exit code under `--exit-code`.
    #[must_use]
    pub fn exit_code(self) -> u8 {
        match self {
            Verdict::Named => 0,
            Verdict::Nothing => 3,
            Verdict::Ambiguous => 4,
            Verdict::Unexplained => 5,
            Verdict::NotTestable => 6,
            Verdict::BadBase => 7,
        }
    }
}

/// A parameter with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Most likely value.
    pub value: f64,
    /// Standard error; infinite where the data say nothing.
    pub error: f64,
    /// Two standard errors to either side, within the bounds.
    pub interval: [f64; 2],
    /// True if it lies on a bound; never of the nuisance lead, which is no property of the car, so that its bound says nothing.
    pub at_bound: bool,
}

/// A cause that is part of the extended model, or one that could be in its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Adopted {
    /// The cause.
    pub extension: &'static Extension,
    /// The adopted cause that it could be in the place of; none for an adopted one.
    pub instead_of: Option<&'static Extension>,
    /// Its class of causes that data may not tell apart; its own name where there is none.
    pub family: String,
    /// Its parameters.
    pub parameters: Vec<Estimate>,
    /// Gain of log-likelihood \[nats\]: held out, but at most that on all training data.
    pub evidence: f64,
    /// What the evidence had to exceed \[nats\].
    pub threshold: f64,
    /// The recording in which it happens ([`Drive::recording`](crate::diagnose::Drive::recording)), for an event of one recording only.
    pub recording: Option<String>,
}

/// A cause that these data cannot show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NotTestable {
    /// Its name in the library.
    pub name: String,
    /// The parameters of the base model that take its place.
    pub absorbed_by: Vec<String>,
}

/// Structure that the extended model leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOver {
    /// `road`, `speed`, `thrust`, `gap`, `closing`, `history`, `bursts`, `family` or `proxy`.
    pub kind: String,
    /// Where it sits, in words: a place, a speed, a time.
    pub place: String,
    /// Size \[m/s²\], or \[nats\] for `family` and `proxy`, or samples for `bursts`.
    pub size: f64,
    /// Evidence \[nats\].
    pub evidence: f64,
}

/// A cause that was tried in a round.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Round, from 1.
    pub round: usize,
    /// The cause.
    pub name: String,
    /// Gain on all training data \[nats\].
    pub gain: f64,
    /// Gain held out, sum of both folds \[nats\]; NaN if it was not among those cross-fitted.
    pub evidence: f64,
    /// The same in each fold.
    pub folds: [f64; 2],
    /// What it had to exceed \[nats\].
    pub threshold: f64,
    /// What was asked of it, up to the first check that is not met; empty if it was not cross-fitted.
    pub checks: Vec<Check>,
    /// What became of it, and why.
    pub fate: Fate,
}

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The model; without the nuisance lead, so that it can be calibrated and simulated by others.
    pub variant: Variant,
    /// Its parameters.
    pub parameters: Parameters,
    /// The same with their uncertainty, and the nuisance lead.
    pub estimates: Vec<Estimate>,
    /// What is random.
    pub noise: Noise,
    /// Log-likelihood of the training data.
    pub log_likelihood: f64,
    /// Inflation of thresholds: how much less the innovations tell than independent ones.
    pub inflation: f64,
    /// Observed runs over the training drives, then over the hold-out drives.
    pub innovations: Vec<Innovations>,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Inference {
    /// The base model, calibrated.
    pub base: Fitted,
    /// With the adopted causes; the base where there are none.
    pub extended: Fitted,
    /// The answer in one word.
    pub verdict: Verdict,
    /// And in plain words.
    pub reason: String,
    /// Causes in the order in which they were found.
    pub adopted: Vec<Adopted>,
    /// Causes that could be in the place of an adopted one.
    pub confounded_with: Vec<Adopted>,
    /// Causes that these data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// Causes that could not be tried.
    pub untried: Vec<Skipped>,
    /// What the extended model leaves.
    pub left_over: Vec<LeftOver>,
    /// Everything tried.
    pub ladder: Vec<Tried>,
    /// Simulated candidates, over one drive each.
    pub simulations: u64,
    /// False if the search ended because the effort had simulated enough, so that it was not asked whether more is missing.
    pub complete: bool,
}
