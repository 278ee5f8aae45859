//! What the race says, as it stands in `diagnosis.json`.

use super::ParameterEntry;
use crate::judge::Check;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// A cause of the recommended model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecommendedCause {
    /// Its name in the library.
    pub name: String,
    /// What it does, in a sentence.
    pub meaning: String,
    /// Its parameters; the interval is that of a jackknife over the folds.
    pub parameters: Vec<ParameterEntry>,
}

/// By how much the error on unseen drives falls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClosedLoopGain {
    /// What is compared: `nrmse_sva_10s`, the mean over bins of 10 s of the errors of spacing, speed and acceleration, each relative to
    /// the root mean square of the drive.
    pub measure: String,
    /// Of the base.
    pub base: f64,
    /// Of the extended model.
    pub extended: f64,
    /// 95 % interval of base minus extended.
    pub interval: [f64; 2],
}

/// One drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PerDrive {
    /// The file.
    pub path: String,
    /// NRMSE(s,v,a) of the base where the drive, or a part of it, was left out.
    pub base: f64,
    /// The same of the extended model.
    pub extended: f64,
}

/// Drives, or parts of them, in which a model comes closer than 0.1 m to the car ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Collisions {
    /// Of the base.
    pub base: usize,
    /// Of the extended model.
    pub extended: usize,
}

/// Why an extension is recommended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// All of it, or of its families, is named, too.
    Confirmed,
    /// It follows unseen drives better; nothing like it is named.
    Helps,
}

/// What to calibrate with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recommended {
    /// The causes, in the order in which they were found.
    pub causes: Vec<RecommendedCause>,
    /// Why.
    pub why: Why,
    /// All parameters of the model, fitted to all drives over their whole length. `extended` of the result has their intervals.
    pub parameters: IndexMap<String, f64>,
    /// True if it comes closer than 0.1 m to the car ahead in no part of the drives that its fits left out.
    pub safe: bool,
    /// The counts.
    pub safe_reason: String,
    /// The bounds that each was fitted within.
    #[serde(default)]
    pub bounds: IndexMap<String, [f64; 2]>,
    /// Over whole drives.
    pub gain: ClosedLoopGain,
    /// Drive by drive, over whole drives.
    pub per_drive: Vec<PerDrive>,
    /// Models that cannot be told from the best (90 %): the causes of each.
    pub confidence_set: Vec<Vec<String>>,
    /// Over whole drives that were left out.
    pub collisions: Collisions,
}

/// Another law on the same drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawEntry {
    /// Its name.
    pub name: String,
    /// Share by which its error on unseen drives is smaller than that of the base; negative: larger.
    pub gain: f64,
}

/// The gain that drives could have shown, where nothing is named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Power {
    /// Gain at 15 s, as a share of the error, that is found with a probability of 80 %.
    pub gain: f64,
    /// Causes of the model that comes closest to a name.
    pub causes: Vec<String>,
    /// Minutes of such driving, beside those given, after which it would be found as often, if its gain is what it seems; none where its gain
    /// is less than a standard error.
    pub minutes: Option<f64>,
}

/// What a model gains at one horizon.
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
    /// Its causes.
    pub causes: Vec<String>,
    /// Share by which the error on unseen drives falls, over whole drives.
    pub gain: f64,
    /// What it gains at each horizon, the shortest first.
    pub horizons: Vec<HorizonGain>,
    /// The gain of all horizons together in standard errors.
    pub standard_errors: f64,
    /// Probability of so large a gain by chance, adjusted for all models.
    pub probability: f64,
    /// True if it cannot be told from the best at the shorter horizons.
    pub in_set: bool,
    /// Everything that was asked of it.
    pub checks: Vec<Check>,
    /// Whether it passes them all.
    pub passes: bool,
}

/// All that the race says.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ClosedLoopEntry {
    /// Bins of 10 s.
    pub bins: usize,
    /// Drives, or parts of them, and folds.
    pub parts: [usize; 2],
    /// The numbers that decide.
    pub policy: serde_json::Value,
    /// Every model that was judged; those that gain next to nothing where they were fitted are not.
    pub trials: Vec<Trial>,
    /// Why nothing could be tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_testable: Option<String>,
}
