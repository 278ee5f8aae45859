//! `result.json`: the result of a calibration and its settings. The same seed gives the same bytes; times are in `timing.json`.

pub mod assemble;
pub mod diagnosis;
mod read;

pub use read::{ContentError, ResultFileError, read_bounded};

use self::diagnosis::FindingEntry;
use crate::catalog::Variant;
use crate::evaluator::{Share, Together};
use crate::extension::Extension;
use crate::identify::Knowledge;
use crate::simulate::CalibratedVariant;
use crate::symbols::{Parameters, Symbol};
use crate::trajectory::{Source, Treatment};
use crate::wgsl::{extension_named, read_extension};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Version of the layout of `result.json`.
pub const SCHEMA_VERSION: u32 = 1;

/// A result file; keys and units are described in `docs/RESULT.md`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultFile {
    /// Version of this layout.
    pub schema_version: u32,
    /// The program that wrote it, `leadlag 0.1.0`.
    pub program: String,
    /// Id of Table 1; 0 for a law.
    pub model_id: u32,
    /// Name of the variant.
    pub variant: String,
    /// The convention, as `--convention` takes it.
    pub convention: String,
    /// The law, if the base model is not from the paper.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<ExtensionEntry>,
    /// The extensions of the model.
    pub extensions: Vec<ExtensionEntry>,
    /// The evaluator of the candidates.
    pub evaluator: String,
    pub precision: String,
    /// The device, if there is one.
    pub adapter: Option<String>,
    /// The trajectories, one entry per follower and segment.
    pub data: Vec<DataEntry>,
    /// The vehicle, if the variant needs one.
    pub vehicle: Option<VehicleEntry>,
    /// The goodness of fit that was minimised.
    pub gof: String,
    /// The algorithm.
    pub optimizer: String,
    /// Members of a generation, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub population: Option<u64>,
    pub seed: u64,
    /// Time at the start of each drive \[s\] in which the car is the measured one, if that was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub history_s: Option<f64>,
    /// All measures of the best candidate, by the f64 reference; the mean over `data` if there are several.
    pub score: IndexMap<String, Option<f64>>,
    /// The calibrated parameters, by the paper's symbols.
    pub parameters: IndexMap<String, f64>,
    pub units: IndexMap<String, String>,
    /// Their bounds; equal bounds mean a fixed value.
    pub bounds: IndexMap<String, [f64; 2]>,
    /// The source of the bounds and the reason for it, in words; `None` in results before 0.2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds_from: Option<String>,
    /// Parameters that drivers have of their own; `parameters` then has the middle of their distribution.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own: Option<OwnEntry>,
    /// Parameters within 0.1 % of the range of a bound, see [`SearchSpace::at_bound`](crate::calibrate::SearchSpace::at_bound).
    pub at_bound: Vec<String>,
    /// The scores of each drive, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_drive: Option<Scores>,
    /// The scores on drives that were held back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_back: Option<Scores>,
    /// The message that the drives probably have different drivers; `None` if nothing suggests it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drivers: Option<String>,
    /// The result of the same calibration with corrected data, or with uncorrected data if these were corrected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared: Option<ComparedEntry>,
    /// Confidence intervals by parameter; a bound of the search may limit an end, see `identifiability`.
    pub intervals: IndexMap<String, [f64; 2]>,
    /// Identifiability of the parameters; `None` if not requested.
    #[serde(default)]
    pub identifiability: Option<IdentifiabilityEntry>,
    /// Simulated candidates of all replicates.
    pub evaluations: u64,
    /// The replicates, in order.
    pub replicates: Vec<ReplicateEntry>,
    /// Coefficient of variation of the scores over replicates; `None` with fewer than two.
    pub cv: Option<f64>,
}

/// Parameters that drivers have of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnEntry {
    /// Their distributions over the drivers, by name.
    pub parameters: IndexMap<String, OwnParameter>,
    /// The drivers.
    pub drivers: Vec<DriverEntry>,
}

/// The normal distribution of a parameter over drivers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnParameter {
    /// True if it is that of its logarithm.
    pub logarithm: bool,
    /// The value of the driver in the middle.
    pub middle: f64,
    /// Its 95 % interval.
    pub middle_interval: [f64; 2],
    /// Standard deviation over drivers: a share of the value if `logarithm`, else in the unit of the parameter; 0 if the drives show no difference.
    pub spread: f64,
    /// Its 95 % interval.
    pub spread_interval: [f64; 2],
}

/// A driver with own parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriverEntry {
    /// The id, or the drive of a driver without one.
    pub driver: String,
    /// Positions of the driver's drives in `data`, from 0.
    pub data: Vec<usize>,
    /// The own parameters.
    pub parameters: IndexMap<String, f64>,
}

/// A calibration on the same data, with or without their corrections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComparedEntry {
    /// Whether faults of its data are corrected.
    pub corrected: bool,
    pub parameters: IndexMap<String, f64>,
}

/// A law or an extension.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtensionEntry {
    pub name: String,
    /// The whole text of a user's own; `None` for a built-in one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

impl ExtensionEntry {
    /// The entry of an extension.
    #[must_use]
    pub fn of(extension: &Extension) -> ExtensionEntry {
        let is_own = extension_named(&extension.name).is_none();
        ExtensionEntry { name: extension.name.clone(), text: is_own.then(|| extension.text.clone()) }
    }

    /// The extension.
    ///
    /// # Errors
    /// [`ContentError`] if its text is not valid, or no built-in one has its name.
    pub fn read(&self) -> Result<&'static Extension, ContentError> {
        match &self.text {
            Some(text) => Ok(read_extension(&format!("{}.wgsl", self.name), text)?),
            None => extension_named(&self.name).ok_or_else(|| ContentError::Extension(self.name.clone())),
        }
    }
}

/// A trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataEntry {
    /// The file.
    pub path: String,
    /// Its checksum.
    pub sha256: String,
    /// Number of the follower.
    pub follower: usize,
    /// Name of the follower in the file.
    pub name: String,
    pub samples: usize,
    /// First and last time used \[s\], as in the file.
    pub window_s: [f64; 2],
    /// First scored sample.
    pub first_scored: usize,
    /// Changes to the data before the calibration, one line each.
    pub preparation: Vec<String>,
    /// Findings of the data check.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<FindingEntry>,
    /// The changes that another drive must share to be comparable.
    pub treatment: Treatment,
    /// The grade table, if the variant needs one: a file, or none for a level road.
    pub grade: Option<Source>,
}

/// How a calibrated model follows a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveScore {
    /// The file.
    pub path: String,
    /// Id of the trajectory, if the file has several.
    pub trajectory: Option<String>,
    /// Number of the follower.
    pub follower: usize,
    /// Name of the follower in the file.
    pub name: String,
    /// The minimised measure; `None` if the simulation fails, such as by a collision.
    pub score: Option<f64>,
    /// Weight of its square in the score of several drives, if that pools them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<f64>,
    /// Root mean square errors of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub rmse: Option<[f64; 3]>,
}

/// How a calibrated model follows several drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Mean of the minimised measure over the drives without a failure.
    pub mean: Option<f64>,
    /// The minimised measure over the same drives, if it pools them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pooled: Option<f64>,
    /// Mean over the same drives of the mean squared error of the spacing \[m²\].
    pub mse_s_m2: Option<f64>,
    /// Number of drives on which the simulation fails.
    pub failed: usize,
    /// Number of folds, if each drive was left out of one of several calibrations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub folds: Option<u64>,
    /// Drive by drive.
    pub drives: Vec<DriveScore>,
}

impl Scores {
    /// Scores of drives.
    #[must_use]
    pub fn new(drives: Vec<DriveScore>) -> Scores {
        let mean = |of: &dyn Fn(&DriveScore) -> Option<f64>| {
            let values: Vec<f64> = drives.iter().filter_map(of).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        let mse = |drive: &DriveScore| drive.rmse.map(|[s, ..]| s * s);
        let pool = |drive: &DriveScore| Some((drive.score?, Share { samples: 0, weight: Some(drive.weight?) }));
        let pooled = drives.iter().filter_map(pool).fold(None, |all: Option<Together>, (score, share)| {
            let mut all = all.unwrap_or_default();
            all.add(score, share);
            Some(all)
        });
        Scores {
            mean: mean(&|drive| drive.score),
            pooled: pooled.map(|all| all.value()),
            mse_s_m2: mean(&mse),
            failed: drives.iter().filter(|drive| drive.score.is_none()).count(),
            folds: None,
            drives,
        }
    }
}

/// The vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VehicleEntry {
    /// Its short name.
    pub slug: String,
    /// Unladen mass \[kg\].
    pub m_0: f64,
    /// Equivalent inertial mass factor.
    pub phi_f: f64,
    /// The value of `--vehicle` that gives it again: `NAME` or `FILE#NAME`.
    pub from: String,
    /// The vehicle table and the MFC curve, if they are files.
    pub files: Vec<Source>,
}

/// Identifiability of the parameters; see `identify`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentifiabilityEntry {
    /// Share of cases in which an interval should hold the true value.
    pub confidence: f64,
    /// By parameter.
    pub parameters: IndexMap<String, KnowledgeEntry>,
    /// Correlations between the errors of the parameters; `None` without intervals.
    pub correlation: Option<CorrelationEntry>,
    /// Lowest and highest value over the replicates' best candidates; empty with one replicate.
    pub replicate_range: IndexMap<String, [f64; 2]>,
    /// Simulated candidates; they are not among the `evaluations` of the replicates.
    pub evaluations: u64,
    /// Why there are no intervals.
    pub note: Option<String>,
}

/// Identifiability of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnowledgeEntry {
    /// For the lower and the upper end of the interval: true if the bound of the search limits it, not the data.
    pub open: [bool; 2],
    /// False if the drive does not determine the parameter; `intervals` then has no entry.
    #[serde(default = "yes")]
    pub determined: bool,
    /// Number of independent samples with the same information.
    pub effective_samples: f64,
    /// Rise of the score, all others at their best, at which the interval ends.
    pub rise: f64,
}

/// Older results lack the entry.
fn yes() -> bool {
    true
}

impl KnowledgeEntry {
    /// Converts an identifiability.
    #[must_use]
    pub fn of(knowledge: &Knowledge) -> KnowledgeEntry {
        let Knowledge { open, determined, effective_samples, rise, .. } = *knowledge;
        KnowledgeEntry { open, determined, effective_samples, rise }
    }
}

/// Correlations of parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrelationEntry {
    /// Names of rows and columns.
    pub parameters: Vec<String>,
    /// Correlations between the errors of the parameters.
    pub matrix: Vec<Vec<f64>>,
}

/// One replicate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReplicateEntry {
    /// Its number, from 0; it draws from stream (seed, number).
    pub replicate: u64,
    /// The goodness of fit of its best candidate, by the f64 reference; `None` if the candidate fails in f64.
    pub score: Option<f64>,
    /// Simulated candidates.
    pub evaluations: u64,
    /// Why it ended.
    pub stop: String,
    /// Its best candidate.
    pub parameters: IndexMap<String, f64>,
    /// (evaluations, best score so far) at every gain.
    pub convergence: Vec<(u64, f64)>,
}

impl ResultFile {
    /// The lowest score of its replicates in f64, which is that of the calibrated parameters.
    #[must_use]
    pub fn best_score(&self) -> Option<f64> {
        self.replicates.iter().filter_map(|replicate| replicate.score).min_by(f64::total_cmp)
    }

    /// The text of `result.json`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("names and finite numbers are valid JSON");
        text.push('\n');
        text
    }

    /// The variant with its extensions, in words.
    #[must_use]
    pub fn model(&self) -> String {
        let extensions = self.extensions.iter().map(|extension| format!("+{}", extension.name));
        std::iter::once(self.variant.clone()).chain(extensions).collect()
    }

    /// The same with the id of Table 1 in front.
    #[must_use]
    pub fn numbered_model(&self) -> String {
        match self.model_id {
            0 => self.model(),
            id => format!("{id} {}", self.model()),
        }
    }

    /// The meaning of a parameter; empty if unknown.
    #[must_use]
    pub fn meaning(&self, parameter: &str) -> &'static str {
        let own = || {
            let extensions = self.law.iter().chain(&self.extensions).filter_map(|extension| extension.read().ok());
            let mut symbols = extensions.flat_map(|extension| extension.parameters.iter().copied());
            symbols.find(|symbol| symbol.name() == parameter)
        };
        Symbol::from_name(parameter).or_else(own).map_or("", Symbol::meaning)
    }

    /// The variant with its parameters, ready to be simulated again.
    ///
    /// # Errors [`ContentError`] if the content contradicts itself.
    pub fn calibrated_variant(&self) -> Result<CalibratedVariant, ContentError> {
        let mut variant = match &self.law {
            Some(law) => Variant::named(&self.variant, &[law.read()?])?,
            None => self.variant.parse()?,
        };
        for extension in &self.extensions {
            variant = variant.with(extension.read()?)?;
        }
        let calibrated = calibrated(variant, &self.parameters, &self.bounds, &self.convention)?;
        Ok(CalibratedVariant { history_s: self.history_s, ..calibrated })
    }

    /// The parameters on one of its drives: with those that the driver has of his own.
    ///
    /// # Errors [`ContentError`] if the content contradicts itself.
    pub fn parameters_on(&self, drive: usize) -> Result<Parameters, ContentError> {
        let CalibratedVariant { variant, mut parameters, .. } = self.calibrated_variant()?;
        let driver = self.own.iter().flat_map(|own| &own.drivers).find(|driver| driver.data.contains(&drive));
        for symbol in variant.parameters() {
            if let Some(value) = driver.and_then(|driver| driver.parameters.get(symbol.name())) {
                parameters.set(symbol, *value);
            }
        }
        Ok(parameters)
    }
}

/// A variant with its parameters, bounds and convention as a file has them.
fn calibrated(
    variant: Variant,
    values: &IndexMap<String, f64>,
    bounds: &IndexMap<String, [f64; 2]>,
    convention: &str,
) -> Result<CalibratedVariant, ContentError> {
    let mut parameters = Parameters::NONE;
    for symbol in variant.parameters() {
        let name = symbol.name();
        parameters.set(symbol, *values.get(name).ok_or(ContentError::Parameter(name))?);
    }
    let tau_p_upper = bounds.get(Symbol::tau_p.name()).map_or(0.0, |b| b[1]);
    let delay = variant.extensions.delay().and_then(|symbol| bounds.get(symbol.name()));
    let (convention, extension_delay_upper) = (convention.parse()?, delay.map(|b| b[1]));
    Ok(CalibratedVariant { variant, convention, parameters, tau_p_upper, extension_delay_upper, history_s: None })
}
