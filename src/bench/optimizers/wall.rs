//! One calibration by the program itself: the time that a user waits, including reading, searching and writing.

use super::super::BenchError;
use super::{OptimizerOutcome, OptimizerTask, PROGRAM};
use crate::calibrate::StopReason;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Starts `leadlag calibrate` and measures the time until it ends.
pub(super) fn run(program: &Path, file: &Path, task: &OptimizerTask) -> Result<OptimizerOutcome, BenchError> {
    let failed = |said: String| BenchError::Program { program: program.display().to_string(), said };
    let folder = std::env::temp_dir().join(format!("leadlag-bench-{}", std::process::id()));
    let mut command = Command::new(program);
    command.arg("calibrate").arg(file).arg("--out").arg(&folder);
    for (flag, value) in [
        ("--follower", task.follower.to_string()),
        ("--model", task.model_id.to_string()),
        ("--convention", task.convention.clone()),
        ("--optimizer", task.optimizer.clone()),
        ("--seed", task.seed.to_string()),
        ("--replicates", task.replicates.to_string()),
        ("--max-evaluations", task.max_evaluations.to_string()),
        ("--evaluator", "lanes".to_owned()),
    ] {
        command.args([flag, &value]);
    }
    let started = Instant::now();
    let output = command.stdin(Stdio::null()).output().map_err(|error| failed(error.to_string()))?;
    let wall_s = started.elapsed().as_secs_f64();
    let result = std::fs::read(folder.join("result.json"));
    // A leftover temporary folder does no harm.
    let _ = std::fs::remove_dir_all(&folder);
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
    }
    let json = result.ok().and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
    let json = json.ok_or_else(|| failed("it wrote no result.json".to_owned()))?;
    let replicates = json["replicates"].as_array().cloned().unwrap_or_default();
    let stops: Vec<String> = replicates.iter().filter_map(|r| Some(r["stop"].as_str()?.to_owned())).collect();
    // Ctrl-C reaches both programs.
    if stops.is_empty() || stops.contains(&StopReason::Interrupted.to_string()) {
        return Err(failed("it was interrupted, so there is nothing to measure".to_owned()));
    }
    Ok(OptimizerOutcome {
        program: PROGRAM.clone(),
        task: task.clone(),
        scores: replicates.iter().map(|r| r["score"].as_f64()).collect(),
        evaluations: replicates.iter().filter_map(|r| r["evaluations"].as_u64()).collect(),
        stops,
        wall_s,
    })
}
