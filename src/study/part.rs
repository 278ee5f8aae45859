//! Parts: the result of one task, in a file that shows whether it is complete.
//!
//! Two lines: the result in JSON, and the SHA-256 of the first line.

use super::{SCHEMA_VERSION, sha256};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// The result of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Version of the study's files.
    pub schema_version: u32,
    /// The task.
    pub id: String,
    /// The result.
    pub calibration: CalibrationRow,
    /// Results on other trajectories, in the order of the plan.
    pub validations: Vec<ValidationRow>,
}

/// Result of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationRow {
    /// The program that computed it.
    pub program: String,
    /// Name of the platoon.
    pub platoon: String,
    /// 1 = right behind the platoon leader.
    pub follower: usize,
    /// The follower's vehicle.
    pub vehicle: String,
    /// SHA-256 of the measured file.
    pub data_sha256: String,
    /// Number of samples.
    pub samples: usize,
    /// Time step \[s\].
    pub dt_s: f64,
    /// Id of Table 1.
    pub model_id: u32,
    /// Name of the variant.
    pub variant: String,
    /// The minimised measure.
    pub gof: String,
    pub convention: String,
    /// The algorithm.
    pub optimizer: String,
    pub seed: u64,
    /// The replicate, from 0.
    pub replicate: u64,
    /// Evaluator of the candidates.
    pub evaluator: String,
    pub precision: String,
    /// On which device; `None` on the CPU.
    pub adapter: Option<String>,
    /// True if a feasible candidate was found.
    pub success: bool,
    /// The reason for a failure, in words.
    pub reason: Option<String>,
    /// Simulated candidates, failed ones included.
    pub evaluations: u64,
    /// Why the search ended.
    pub stop: Option<String>,
    /// Value of `gof`, by the f64 reference.
    pub score: Option<f64>,
    /// The calibrated parameters, by the paper's symbols.
    pub parameters: IndexMap<String, f64>,
    /// Parameters within 0.1 % of their range of a bound.
    pub at_bound: Vec<String>,
    /// The run of the best candidate on the trajectory it was calibrated on.
    pub run: Option<RunRow>,
}

/// Result of a calibrated candidate on another trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidationRow {
    /// Name of the platoon.
    pub platoon: String,
    /// 1 = right behind the platoon leader.
    pub follower: usize,
    /// SHA-256 of the measured file.
    pub data_sha256: String,
    /// Number of samples.
    pub samples: usize,
    pub run: RunRow,
}

/// One simulated run, by the f64 reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRow {
    /// Why it ended early, if it did: `spacing`, `radicand`, `not_finite`.
    pub fail_reason: Option<String>,
    /// At which sample.
    pub fail_step: Option<usize>,
    /// Time of the end \[s\], as in the file.
    pub fail_time_s: Option<f64>,
    /// First scored sample.
    pub first_scored: usize,
    /// Steps clipped at the upper acceleration bound.
    pub n_cut_acc: u32,
    /// Steps clipped at the lower acceleration bound.
    pub n_cut_dec: u32,
    /// The measures in the order of [`crate::score::Measures::NAMES`]; empty after an early end, `None` for one that does not exist.
    pub measures: Vec<Option<f64>>,
}

impl Part {
    /// The bytes of the file.
    pub fn encode(&self) -> Vec<u8> {
        let json = serde_json::to_string(self).expect("names and finite numbers are valid JSON");
        let sum = sha256(json.as_bytes());
        format!("{json}\n{sum}\n").into_bytes()
    }

    /// Reads the bytes of a file; `None` if they are not a complete part of this version.
    pub fn decode(bytes: &[u8]) -> Option<Part> {
        let text = std::str::from_utf8(bytes).ok()?;
        let (json, rest) = text.split_once('\n')?;
        let sum = rest.strip_suffix('\n')?;
        if sha256(json.as_bytes()) != sum {
            return None;
        }
        let part: Part = serde_json::from_str(json).ok()?;
        (part.schema_version == SCHEMA_VERSION).then_some(part)
    }
}
