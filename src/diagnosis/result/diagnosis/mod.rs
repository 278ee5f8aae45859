//! The result of a diagnosis as a file: the JSON of `--json` and of `diagnosis.json`.

mod advice;
pub mod recommended;

use self::recommended::{ClosedLoopEntry, LawEntry, Power, Recommended};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::diagnose::data::{Finding, Soundness};
use crate::diagnose::describe::error_breakdown::Budget;
use crate::diagnose::describe::free::BrokenOffEntry;
use crate::diagnose::describe::gain::Gain;
use crate::diagnose::describe::missing::Profiles;
use crate::diagnose::drive::drivers::{DIFFERENT, Different};
use crate::diagnose::search::skipped::Untried;
use crate::diagnose::{Adopted, Effort, Estimate, Fitted, NotTestable, Tried, Verdict};
use crate::evaluator::CaseError;
use crate::judge::Check;
use crate::result::{ContentError, calibrated};
use crate::simulate::CalibratedVariant;
use crate::trajectory::Trajectory;
use crate::wgsl::extension_named;
use serde::{Deserialize, Serialize};

/// Version of the file; raise it with every change that breaks a reader.
pub const SCHEMA_VERSION: u32 = 4;

/// A parameter with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterEntry {
    /// Its name.
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
    /// Its parameters.
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
    /// Its name.
    pub name: String,
    /// The reason.
    #[serde(default)]
    pub reason: String,
    /// The missing data, if that is the reason.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<String>,
    /// The remedy.
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

/// A fault of the data.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FindingEntry {
    /// Kind of fault.
    pub name: String,
    /// `leader`, `follower` or `both`; `leader or follower` if the data do not show which.
    pub car: String,
    /// `speed` or `gap`.
    pub signal: String,
    /// Its size.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// The file.
    pub file: String,
    /// Id of the trajectory, if the file has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<String>,
    /// Stretches of the file's time \[s\]; empty: the whole file.
    #[serde(rename = "when_s")]
    pub when: Vec<[f64; 2]>,
    /// Line of the file at which it begins; `None` if it affects the whole file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<u64>,
    /// Whether it biases calibrated parameters.
    #[serde(default)]
    pub matters: bool,
    /// Its effect on parameters, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effect: Option<String>,
    /// Options that correct or avoid it, with their values: `correct`, `to 69.9`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remedies: Vec<String>,
    /// In words.
    pub sentence: String,
    /// The correction, if one was requested.
    pub correction: Option<String>,
}

impl FindingEntry {
    /// The sentence with the effect of the fault on parameters.
    #[must_use]
    pub fn told(&self) -> String {
        let effect = self.effect.as_ref().map_or_else(String::new, |effect| format!("; {effect}"));
        format!("{}{effect}", self.sentence)
    }

    /// A finding of drives with different drivers.
    #[must_use]
    pub fn different(found: Different) -> FindingEntry {
        FindingEntry {
            name: DIFFERENT.to_owned(),
            car: "follower".to_owned(),
            signal: "gap".to_owned(),
            value: found.ratio,
            unit: "times".to_owned(),
            file: found.file,
            matters: true,
            sentence: found.sentence,
            ..FindingEntry::default()
        }
    }

    /// True for a finding of this drive, or of its whole file.
    #[must_use]
    pub fn is_of(&self, drive: &DataEntry) -> bool {
        self.file == drive.path && (self.trajectory.is_none() || self.trajectory == drive.trajectory)
    }

    /// The findings of the data check for a trajectory.
    #[must_use]
    pub fn of(trajectory: &Trajectory) -> Vec<FindingEntry> {
        trajectory.findings().map(|finding| FindingEntry::new(trajectory, finding)).collect()
    }

    /// A finding of a trajectory, with its correction.
    #[must_use]
    pub fn new(trajectory: &Trajectory, finding: &Finding) -> FindingEntry {
        FindingEntry {
            name: finding.kind.into_str().to_owned(),
            car: finding.car.into_str().to_owned(),
            signal: finding.signal.to_owned(),
            value: finding.value,
            unit: finding.unit.to_owned(),
            interval: finding.interval,
            file: trajectory.source.path.clone(),
            trajectory: trajectory.id.clone(),
            when: finding.when.clone(),
            line: finding.line,
            matters: finding.matters,
            effect: finding.matters.then(|| finding.kind.effect().to_owned()),
            remedies: finding.remedies.iter().map(|remedy| remedy.to_string()[2..].to_owned()).collect(),
            sentence: finding.sentence.clone(),
            correction: finding.correction.clone(),
        }
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
    /// Its name.
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

/// One data file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataEntry {
    /// Path as given.
    pub path: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// The follower's number in it; 0 if it stands for all of them, as in a fleet.
    pub follower: usize,
    /// The follower's name.
    pub name: String,
    /// Id of the trajectory, if the file names its trajectories.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<String>,
    /// `train` or `holdout`.
    pub role: String,
    /// Window that is used \[s\], in the file's own time.
    pub window_s: [f64; 2],
    /// Samples.
    pub samples: usize,
    /// Gap rate minus speed difference over a second, rms \[m/s\].
    pub gap_rate_rms_mps: Option<f64>,
    /// Faults that these data cannot show.
    pub unseen: Vec<String>,
    /// The message if gap and speeds are in units that contradict each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// Displacement along the road \[m\], to where its grade matches that of the first file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moved_m: Option<f64>,
}

impl DataEntry {
    /// The number of its follower; `None` if it stands for all followers of the file.
    #[must_use]
    pub fn follower(&self) -> Option<usize> {
        Some(self.follower).filter(|follower| *follower > 0)
    }

    /// A trajectory, before the check of its data.
    #[must_use]
    pub fn of(trajectory: &Trajectory, role: &str) -> DataEntry {
        DataEntry {
            path: trajectory.source.path.clone(),
            sha256: trajectory.source.sha256.clone(),
            follower: trajectory.follower,
            name: trajectory.name.clone(),
            trajectory: trajectory.id.clone(),
            role: role.to_owned(),
            window_s: [trajectory.t[0], trajectory.t[trajectory.len() - 1]],
            samples: trajectory.len(),
            gap_rate_rms_mps: None,
            unseen: Vec::new(),
            units: None,
            moved_m: None,
        }
    }

    /// The message about the displacement.
    #[must_use]
    pub fn moved(&self) -> Option<String> {
        let told = |by| {
            format!(
                "moved along the road by {by:+.0} m, to where its grade matches that of the first file; at its own positions it does not"
            )
        };
        self.moved_m.map(told)
    }

    /// Adds the results of the data check.
    pub fn take(&mut self, soundness: &Soundness) {
        self.gap_rate_rms_mps = soundness.rate_rms_mps;
        self.unseen.clone_from(&soundness.unseen);
    }
}

/// A drive: a file, or a piece of one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveEntry {
    /// File, follower, piece.
    pub label: String,
    /// `train` or `holdout`.
    pub role: String,
}

/// Errors of a model on a drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorsEntry {
    /// Root mean square error of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub rms: [f64; 3],
    /// NRMSE(s,v,a).
    pub nrmse_sva: f64,
}

/// The base model and the recommended one on data that they were not fitted to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldBackEntry {
    /// The file, each part of which was left out of a fit; or the held-back drive, as in `drives`.
    pub label: String,
    /// Root mean square error of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\]; none if the simulation ends early.
    pub rms: Option<[f64; 3]>,
    /// NRMSE(s,v,a) of the same run.
    pub nrmse_sva: Option<f64>,
    /// The errors of the recommended model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recommended: Option<ErrorsEntry>,
}

/// The drivers of a fleet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetEntry {
    /// Number of drivers.
    pub drivers: usize,
    /// Number of drives.
    pub drives: usize,
    /// Their time together \[min\].
    pub minutes: f64,
    /// Pairs that cannot be used: file, trajectory and follower, and the reason.
    pub unusable: Vec<[String; 2]>,
    /// The drivers with the named causes; `None` without a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<ShareEntry>,
}

/// The drivers of a fleet that have the named causes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShareEntry {
    /// Their share of all drivers.
    pub share: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// The parameters of the causes, of these drivers.
    pub parameters: Vec<ParameterEntry>,
}

/// A model as fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelEntry {
    /// Name of the variant.
    pub variant: String,
    /// Its extensions.
    pub extensions: Vec<String>,
    /// Its parameters.
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

/// The whole result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// The verdict.
    pub verdict: Verdict,
    /// The reason.
    pub reason: String,
    /// Adopted causes in order; for `ambiguous` the best one first.
    pub causes: Vec<CauseEntry>,
    /// Causes that explain the data as well.
    pub confounded_with: Vec<CauseEntry>,
    /// Causes that cannot be tested.
    pub not_testable: Vec<NotTestable>,
    /// Faults of the data.
    pub data_findings: Vec<FindingEntry>,
    /// Gain of the named causes on the hold-out; `null` without a name, if a model is recommended (`recommended` has its gain), or if it
    /// could not be measured.
    pub gain: Option<Gain>,
    /// The model to calibrate; `null` if none is recommended.
    #[serde(default)]
    pub recommended: Option<Recommended>,
    /// The gain that these drives could have shown, if no cause is named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<Power>,
    /// Other laws on the same drives.
    #[serde(default)]
    pub base_laws: Vec<LawEntry>,
    /// Notes on the base: bounds, collisions, better laws.
    #[serde(default)]
    pub base_notes: Vec<String>,
    /// Unexplained structure.
    pub left_over: Vec<LeftOverEntry>,
    /// Simulated candidates.
    pub simulations: u64,
    /// False if the simulation limit of the effort ended the search, so that more causes may be missing.
    #[serde(default = "searched_to_the_end")]
    pub complete: bool,
    /// Why the gain could not be measured, if causes were adopted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain_error: Option<String>,
    /// The base model and the recommended one on data that they were not fitted to, with any verdict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub base_held_back: Vec<HeldBackEntry>,
    /// Causes that could not be tried.
    #[serde(default)]
    pub not_tried: Vec<NotTriedEntry>,
    /// The program and its version.
    #[serde(default)]
    pub program: String,
    /// The evaluator: always `lanes`, in `f64`, without a device.
    #[serde(default)]
    pub evaluator: String,
    /// See `evaluator`.
    #[serde(default)]
    pub precision: String,
    /// See `evaluator`.
    #[serde(default)]
    pub adapter: Option<String>,
    /// The convention.
    #[serde(default)]
    pub convention: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `quick`, `normal` or `thorough`.
    pub effort: String,
    /// The data.
    pub data: Vec<DataEntry>,
    /// The drives in the order of the numbered files: training, then held back.
    pub drives: Vec<DriveEntry>,
    /// The drivers of a fleet; `None` for one car.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetEntry>,
    /// The held-back data, in words.
    pub held_back: String,
    /// The base model, fitted to all drives over their whole length.
    pub base: Option<ModelEntry>,
    /// The recommended model, fitted likewise; otherwise the one with the causes that the likelihood names, as it fits them.
    pub extended: Option<ModelEntry>,
    /// Error of the base model's free simulation on the training drives that it completes.
    pub budget: Option<Budget>,
    /// Training drives that the base model's free simulation does not complete; they are not in `budget`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub broken_off: Vec<BrokenOffEntry>,
    /// The base model's missing acceleration, sorted.
    pub missing: Option<Profiles>,
    /// The same for the extended model.
    pub missing_left: Option<Profiles>,
    /// All causes that were tried.
    pub ladder: Vec<RungEntry>,
    /// Every model that was judged in the race.
    #[serde(default)]
    pub closed_loop: ClosedLoopEntry,
    /// Every number that decides what the likelihood names, by name.
    #[serde(default)]
    pub policy: serde_json::Value,
}

/// Older results lack the entry.
fn searched_to_the_end() -> bool {
    true
}

impl Outcome {
    /// A result without an answer.
    #[must_use]
    pub fn new(effort: Effort, seed: u64) -> Outcome {
        Outcome {
            schema_version: SCHEMA_VERSION,
            verdict: Verdict::Nothing,
            reason: String::new(),
            causes: Vec::new(),
            confounded_with: Vec::new(),
            not_testable: Vec::new(),
            data_findings: Vec::new(),
            gain: None,
            gain_error: None,
            base_held_back: Vec::new(),
            recommended: None,
            power: None,
            base_laws: Vec::new(),
            base_notes: Vec::new(),
            left_over: Vec::new(),
            simulations: 0,
            complete: true,
            not_tried: Vec::new(),
            program: concat!("leadlag ", env!("CARGO_PKG_VERSION")).to_owned(),
            evaluator: "lanes".to_owned(),
            precision: "f64".to_owned(),
            adapter: None,
            convention: Convention::PAPER.to_string(),
            seed,
            effort: effort.into_str().to_owned(),
            data: Vec::new(),
            drives: Vec::new(),
            fleet: None,
            held_back: String::new(),
            base: None,
            extended: None,
            budget: None,
            broken_off: Vec::new(),
            missing: None,
            missing_left: None,
            ladder: Vec::new(),
            closed_loop: ClosedLoopEntry::default(),
            policy: serde_json::Value::Null,
        }
    }

    /// The JSON text; the same result gives the same bytes.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and text can be written") + "\n"
    }

    /// The recommended model, ready to be simulated; `None` if nothing is recommended.
    ///
    /// # Errors
    /// [`ContentError`] where its law or a cause is not built in.
    pub fn recommended_model(&self) -> Result<Option<CalibratedVariant>, ContentError> {
        let (Some(recommended), Some(base)) = (&self.recommended, &self.base) else { return Ok(None) };
        let mut variant: Variant = base.variant.parse()?;
        for cause in &recommended.causes {
            let built_in = extension_named(&cause.name).ok_or_else(|| ContentError::Extension(cause.name.clone()))?;
            variant = variant.with(built_in)?;
        }
        calibrated(variant, &recommended.parameters, &recommended.bounds, &self.convention).map(Some)
    }

    /// Causes that could be in the place of an adopted one. If a file does not name the adopted one, it is the first.
    pub fn rivals<'a>(&'a self, of: &'a CauseEntry) -> impl Iterator<Item = &'a CauseEntry> {
        let first = self.causes.first().map(|cause| cause.name.as_str());
        let own = move |rival: &&CauseEntry| rival.instead_of.as_deref().or(first) == Some(of.name.as_str());
        self.confounded_with.iter().filter(own)
    }

    /// True if the data contradict themselves so much that no verdict is reliable.
    #[must_use]
    pub fn has_bad_data(&self) -> bool {
        has_bad_data(&self.data, &self.data_findings)
    }
}

/// True if data contradict themselves, or have several drivers, so that no verdict is reliable.
#[must_use]
pub fn has_bad_data(data: &[DataEntry], findings: &[FindingEntry]) -> bool {
    data.iter().any(|entry| entry.units.is_some())
        || findings.iter().any(|f| {
            let unrelated = f.name == "inconsistent" && f.unit == "m/s";
            unrelated || [DIFFERENT, "exchanged", "unit"].contains(&f.name.as_str())
        })
}
