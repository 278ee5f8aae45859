//! The result of a diagnosis as a file: the JSON of `--json` and of `diagnosis.json`.

mod advice;
mod data;
mod model;
pub mod recommended;

pub use self::data::{DataEntry, DriveEntry, ErrorsEntry, FindingEntry, HeldBackEntry, has_bad_data};
pub use self::model::{CauseEntry, LeftOverEntry, ModelEntry, NoiseEntry, NotTriedEntry, ParameterEntry, RungEntry};
use self::recommended::{ClosedLoopEntry, ClosedLoopGain, LawEntry, Power, Recommended};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::diagnose::describe::error_breakdown::Budget;
use crate::diagnose::describe::free::BrokenOffEntry;
use crate::diagnose::describe::missing::Profiles;
use crate::diagnose::{Effort, NotTestable, Verdict};
use crate::result::{ContentError, calibrated};
use crate::simulate::CalibratedVariant;
use crate::wgsl::extension_named;
use serde::{Deserialize, Serialize};

/// Version of the file; raise it with every change that breaks a reader.
pub const SCHEMA_VERSION: u32 = 5;

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

/// The whole result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    pub verdict: Verdict,
    pub reason: String,
    /// Adopted causes in order; for `ambiguous` the best one first.
    pub causes: Vec<CauseEntry>,
    /// Causes that explain the data as well.
    pub confounded_with: Vec<CauseEntry>,
    /// Causes that cannot be tested.
    pub not_testable: Vec<NotTestable>,
    /// Faults of the data.
    pub data_findings: Vec<FindingEntry>,
    /// Gain of the named causes on parts left out of the fits; `null` without a name, if a model is recommended (`recommended` has its
    /// gain), or if the race did not judge them, as with a cause of one drive.
    pub gain: Option<ClosedLoopGain>,
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
    #[serde(default)]
    pub convention: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `quick`, `normal` or `thorough`.
    pub effort: String,
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
    /// The recommended model, otherwise the one with the named causes, fitted likewise; a model that the race does not judge as the
    /// likelihood fits it.
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
