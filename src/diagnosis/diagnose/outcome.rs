//! The answer of the likelihood.

use crate::catalog::Variant;
use crate::diagnose::judge::decision::Decision;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::policy::POLICY;
use crate::diagnose::search::skipped::Skipped;
use crate::evaluator::Innovations;
use crate::extension::Extension;
use crate::judge::Check;
use crate::symbols::Parameters;
use serde::{Deserialize, Serialize};

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The causes are named.
    Named,
    /// Other causes fit these data as well as one that was found.
    Ambiguous,
    /// No missing cause was found.
    Nothing,
    /// A calibration absorbs the cause that might be missing.
    NotTestable,
    /// An effect is missing, and no cause explains it.
    Unexplained,
    /// The base model does not fit, so no cause can be judged.
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
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Most likely value.
    pub value: f64,
    /// Standard error; infinite if the data do not determine it.
    pub error: f64,
    /// Two standard errors to either side, within the bounds.
    pub interval: [f64; 2],
    /// True if it lies on a bound; never for the nuisance lead, which is not a property of the car.
    pub at_bound: bool,
}

/// A cause of the extended model, or one that could replace it.
#[derive(Debug, Clone, PartialEq)]
pub struct Adopted {
    /// The cause.
    pub extension: &'static Extension,
    /// The adopted cause that it could replace; `None` for an adopted one.
    pub instead_of: Option<&'static Extension>,
    /// Its class of causes that data may not distinguish; without a class, its own name.
    pub family: String,
    pub parameters: Vec<Estimate>,
    /// Gain in log-likelihood \[nats\]: held out, at most that on all training data.
    pub evidence: f64,
    /// Threshold of the evidence \[nats\].
    pub threshold: f64,
    /// The recording in which it happens ([`Drive::recording`](crate::diagnose::Drive::recording)), for an event of one recording only.
    pub recording: Option<String>,
}

/// A cause that these data cannot show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NotTestable {
    /// Its name in the library.
    pub name: String,
    /// The parameters of the base model that absorb it.
    pub absorbed_by: Vec<String>,
}

/// Structure that the extended model leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOver {
    /// `road`, `speed`, `thrust`, `gap`, `closing`, `history`, `bursts`, `family` or `proxy`.
    pub kind: String,
    /// Its position in words: a place, a speed, a time.
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
    /// Held-out gain, sum of both folds \[nats\]; NaN if it was not cross-fitted.
    pub evidence: f64,
    /// The same in each fold.
    pub folds: [f64; 2],
    /// Threshold of the evidence \[nats\].
    pub threshold: f64,
    /// Checks up to the first that failed; empty if it was not cross-fitted.
    pub checks: Vec<Check>,
    /// Its fate, and the reason.
    pub fate: Decision,
}

/// A fitted model.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The model without the nuisance lead, for other calibrations and simulations.
    pub variant: Variant,
    pub parameters: Parameters,
    /// The same with their uncertainty, and the nuisance lead.
    pub estimates: Vec<Estimate>,
    /// The noise model.
    pub noise: Noise,
    /// Log-likelihood of the training data.
    pub log_likelihood: f64,
    /// Inflation of thresholds: ratio of the number of innovations to that of independent ones with the same information.
    pub inflation: f64,
    /// Observed runs over the training drives, then over the hold-out drives.
    pub innovations: Vec<Innovations>,
}

/// The result of the inference.
#[derive(Debug, Clone)]
pub struct Inference {
    /// The base model, calibrated.
    pub base: Fitted,
    /// The model with the adopted causes; without any, the base.
    pub extended: Fitted,
    pub verdict: Verdict,
    /// The reason, in words.
    pub reason: String,
    /// Adopted causes in the order of adoption.
    pub adopted: Vec<Adopted>,
    /// Causes that could replace an adopted one.
    pub confounded_with: Vec<Adopted>,
    /// Causes that these data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// Causes that could not be tried.
    pub untried: Vec<Skipped>,
    /// Structure that the extended model leaves.
    pub left_over: Vec<LeftOver>,
    /// All causes that were tried.
    pub ladder: Vec<Tried>,
    /// Simulated candidates, over one drive each.
    pub simulations: u64,
    /// False if the simulation limit of the effort ended the search, so that more causes may be missing.
    pub complete: bool,
}

impl Inference {
    /// The named causes; an adopted cause without a name is a proxy.
    #[must_use]
    pub fn named(&self) -> &[Adopted] {
        if matches!(self.verdict, Verdict::Named | Verdict::Ambiguous) { &self.adopted } else { &[] }
    }

    /// Time that the missing acceleration lasts \[s\], if it is sensor noise with and without the adopted causes.
    #[must_use]
    pub fn sensor_noise(&self) -> Option<f64> {
        let lasts = self.base.noise.tau_d.max(self.extended.noise.tau_d);
        Some(lasts).filter(|lasts| *lasts < POLICY.lasting)
    }
}
