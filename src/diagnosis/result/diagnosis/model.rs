//! Models of a diagnosis in its file: causes, parameters and checks.

use crate::diagnose::search::skipped::Untried;
use crate::diagnose::{Adopted, Estimate, Fitted, Tried};
use crate::evaluator::CaseError;
use crate::judge::Check;
use serde::{Deserialize, Serialize};

/// A parameter with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterEntry {
    pub name: String,
    /// Estimate.
    pub value: f64,
    /// SI unit, `-` if dimensionless.
    pub unit: String,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// True if it lies on a bound of the search: the optimum is beyond the bound, or the data do not determine the parameter.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_bound: bool,
}

/// A cause that was adopted, or one that explains the data as well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CauseEntry {
    /// Its name in the library.
    pub name: String,
    /// Its effect, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meaning: Option<String>,
    /// Its term in the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equation: Option<String>,
    /// The adopted cause that it could replace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instead_of: Option<String>,
    /// Its equivalence class.
    pub family: String,
    pub parameters: Vec<ParameterEntry>,
    /// Held-out gain in log-likelihood \[nats\].
    pub evidence: f64,
    /// Threshold of the evidence.
    pub threshold: f64,
    /// Kind of `evidence` and `threshold`: `analytic`, both in nats; `bootstrap`, standard errors and a probability by chance.
    pub threshold_kind: String,
    /// File and follower, for an event that happens in one recording only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<String>,
}

/// A cause that could not be tried.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotTriedEntry {
    pub name: String,
    #[serde(default)]
    pub reason: String,
    /// The missing data, if that is the reason.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<String>,
    pub remedy: String,
}

impl NotTriedEntry {
    /// A cause and why it was not tried.
    #[must_use]
    pub fn new(name: &str, untried: &Untried) -> NotTriedEntry {
        let needs = match untried {
            Untried::Data(CaseError::Missing { what, .. }) => Some((*what).to_owned()),
            _ => None,
        };
        NotTriedEntry { name: name.to_owned(), reason: untried.to_string(), needs, remedy: untried.remedy() }
    }
}

/// Unexplained structure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeftOverEntry {
    /// The quantity that it depends on: `road`, `speed`, `bursts`, `missing_acceleration`, ...
    pub kind: String,
    /// Its position.
    pub r#where: String,
    /// Its size; the kind gives the unit.
    pub size: f64,
}

/// A cause that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RungEntry {
    pub name: String,
    /// Round, from 1.
    pub round: usize,
    /// Gain in log-likelihood on all training data \[nats\].
    pub gain: Option<f64>,
    /// Held-out gain \[nats\]; `None` if it was not cross-fitted.
    pub evidence: Option<f64>,
    /// Threshold of the evidence \[nats\].
    pub threshold: f64,
    /// Checks in order, up to the first that failed; empty if it was not cross-fitted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub checks: Vec<Check>,
    /// In words: `adopted`, or the objection.
    pub fate: String,
}

impl From<&Tried> for RungEntry {
    fn from(tried: &Tried) -> RungEntry {
        RungEntry {
            name: tried.name.clone(),
            round: tried.round,
            gain: tried.gain.is_finite().then_some(tried.gain),
            evidence: tried.evidence.is_finite().then_some(tried.evidence),
            threshold: tried.threshold,
            checks: tried.checks.clone(),
            fate: tried.fate.to_string(),
        }
    }
}

impl From<&Estimate> for ParameterEntry {
    fn from(estimate: &Estimate) -> ParameterEntry {
        let interval = estimate.error.is_finite().then_some(estimate.interval);
        let Estimate { name, unit, value, at_bound, .. } = estimate;
        ParameterEntry { name: name.clone(), value: *value, unit: unit.clone(), interval, at_bound: *at_bound }
    }
}

impl From<&Adopted> for CauseEntry {
    fn from(adopted: &Adopted) -> CauseEntry {
        CauseEntry {
            name: adopted.extension.name.clone(),
            meaning: Some(adopted.extension.in_short().to_owned()).filter(|meaning| !meaning.is_empty()),
            equation: adopted.extension.cause.as_ref().and_then(|cause| cause.equation.clone()),
            instead_of: adopted.instead_of.map(|cause| cause.name.clone()),
            family: adopted.family.clone(),
            parameters: adopted.parameters.iter().map(ParameterEntry::from).collect(),
            evidence: adopted.evidence,
            threshold: adopted.threshold,
            threshold_kind: "analytic".to_owned(),
            recording: adopted.recording.clone(),
        }
    }
}

impl From<&Fitted> for ModelEntry {
    fn from(fitted: &Fitted) -> ModelEntry {
        ModelEntry {
            variant: fitted.variant.name(),
            extensions: fitted.variant.causes().map(|e| e.name.clone()).collect(),
            parameters: fitted.estimates.iter().map(ParameterEntry::from).collect(),
            noise: Some(NoiseEntry {
                sigma_d_mps2: fitted.noise.sigma_d,
                tau_d_s: fitted.noise.tau_d,
                noise_gap_m: fitted.noise.r_s,
                noise_speed_mps: fitted.noise.r_v,
                log_likelihood: fitted.log_likelihood,
            }),
        }
    }
}

/// A model as fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelEntry {
    /// Name of the variant.
    pub variant: String,
    pub extensions: Vec<String>,
    pub parameters: Vec<ParameterEntry>,
    /// Its noise; `None` of a fleet, whose models have no likelihood.
    #[serde(flatten)]
    pub noise: Option<NoiseEntry>,
}

/// The noise of a model under its likelihood.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseEntry {
    /// Standard deviation of the missing acceleration \[m/s²\].
    pub sigma_d_mps2: f64,
    /// Time constant of the missing acceleration \[s\].
    pub tau_d_s: f64,
    /// Noise of the gap \[m\].
    pub noise_gap_m: f64,
    /// Noise of the speed \[m/s\].
    pub noise_speed_mps: f64,
    /// Log-likelihood on the training data \[nats\].
    pub log_likelihood: f64,
}

/// The nuisance parameter of every base model of a diagnosis.
const LEAD: &str = "lead_h";

impl ModelEntry {
    /// Its parameters without the lead, which compensates for a car that is controlled in finer steps than the simulation, and is not a
    /// property of the car.
    pub fn of_car(&self) -> impl Iterator<Item = &ParameterEntry> {
        self.parameters.iter().filter(|p| p.name != LEAD)
    }
}
