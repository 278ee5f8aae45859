//! The results of the race in `diagnosis.json`.

use super::ParameterEntry;
use crate::judge::Check;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// A cause of the recommended model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecommendedCause {
    /// Its name in the library.
    pub name: String,
    /// Its effect, in a sentence.
    pub meaning: String,
    /// Its parameters; the intervals are those of a jackknife over the folds.
    pub parameters: Vec<ParameterEntry>,
}

/// The reduction of the error on unseen drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClosedLoopGain {
    /// The measure: `nrmse_sva_10s`, the mean over bins of 10 s of the errors of spacing, speed and acceleration, each relative to the root
    /// mean square of the drive.
    pub measure: String,
    /// Error of the base.
    pub base: f64,
    /// Error of the extended model.
    pub extended: f64,
    /// 95 % interval of base minus extended.
    pub interval: [f64; 2],
}

/// Errors on one drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PerDrive {
    /// The file.
    pub path: String,
    /// NRMSE(s,v,a) of the base on the drive, or on its parts, when left out.
    pub base: f64,
    /// The same for the extended model.
    pub extended: f64,
}

/// Drives, or parts of them, in which a model comes closer than 0.1 m to the car ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Collisions {
    /// Number for the base.
    pub base: usize,
    /// Number for the extended model.
    pub extended: usize,
}

/// Why an extension is recommended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// All of its causes, or relatives of them, are named.
    Confirmed,
    /// It follows unseen drives better, and no cause of its families is named.
    Helps,
}

/// The model to calibrate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recommended {
    /// The causes, in the order in which they were found.
    pub causes: Vec<RecommendedCause>,
    /// The reason.
    pub why: Why,
    /// All parameters of the model, fitted to all drives over their whole length. `extended` of the result has their intervals.
    pub parameters: IndexMap<String, f64>,
    /// True if it comes closer than 0.1 m to the car ahead in no part that its fits left out, and in none behind a car that stops.
    pub safe: bool,
    /// The counts, in words.
    pub safe_reason: String,
    /// The bounds of each parameter in the fit.
    #[serde(default)]
    pub bounds: IndexMap<String, [f64; 2]>,
    /// Over whole drives.
    pub gain: ClosedLoopGain,
    /// Errors drive by drive, over whole drives.
    pub per_drive: Vec<PerDrive>,
    /// Models that cannot be distinguished from the best (90 %): the causes of each.
    pub confidence_set: Vec<Vec<String>>,
    /// Numbers over whole drives that the fits left out.
    pub collisions: Collisions,
}

/// Another law on the same drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawEntry {
    pub name: String,
    /// Share by which its error on unseen drives is smaller than that of the base; negative if larger.
    pub gain: f64,
}

/// The gain that the drives could have shown, if no cause is named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Power {
    /// Gain at 15 s, as a share of the error, that these drives show with a probability of 80 %.
    pub gain: f64,
    /// Causes of the model that comes closest to a name.
    pub causes: Vec<String>,
    /// Further minutes of such driving after which the race would find it with this probability, if its gain is real; `None` if the gain is
    /// less than a standard error.
    pub minutes: Option<f64>,
}

/// The gain of a model at one horizon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HorizonGain {
    /// Time constant of the correction towards the measurement \[s\]; `null`: whole drives.
    pub horizon_s: Option<f64>,
    /// Share by which the error on unseen drives falls.
    pub gain: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// The gain in standard errors.
    pub standard_errors: f64,
}

/// A model of the race.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    pub causes: Vec<String>,
    /// Share by which the error on unseen drives falls, over whole drives.
    pub gain: f64,
    /// Its gain at each horizon, the shortest first.
    pub horizons: Vec<HorizonGain>,
    /// The gain of all horizons together in standard errors.
    pub standard_errors: f64,
    /// Probability of at least this gain by chance, adjusted for all models.
    pub probability: f64,
    /// True if it cannot be distinguished from the best at the shorter horizons.
    pub in_set: bool,
    /// All checks of it.
    pub checks: Vec<Check>,
    /// Whether it passes all checks.
    pub passes: bool,
    /// The drivers of a fleet who have its causes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drivers: Option<TrialDrivers>,
}

/// Drivers with the causes of a model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrialDrivers {
    /// Their share of all drivers.
    pub share: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// Size of the causes, as a multiple of that of the common law.
    pub size: f64,
}

/// All results of the race.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ClosedLoopEntry {
    /// Number of bins of 10 s.
    pub bins: usize,
    /// Numbers of drives, or parts of them, and of folds.
    pub parts: [usize; 2],
    /// The gain of the base over the same law without a car ahead, in the speed; `None` if it was not judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reaction: Option<HorizonGain>,
    /// The numbers that decide.
    pub policy: serde_json::Value,
    /// Every model that was judged; models that gain almost nothing on their training data are not.
    pub trials: Vec<Trial>,
    /// Why no extension could be tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_testable: Option<String>,
}
