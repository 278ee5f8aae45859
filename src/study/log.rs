//! Work and time of each process, in a separate file: no result depends on it.

use super::folder::{Folder, write_whole};
use super::{PROGRAM, SCHEMA_VERSION};
use crate::text::bounded::{self, TEXT_MAX};
use crate::whole::TEMPORARY;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// How often the file is rewritten.
const RENEW: Duration = Duration::from_secs(10);

/// Progress of a run; may be read from any thread.
#[derive(Debug, Default)]
pub struct Progress {
    /// Finished tasks of this run, including earlier ones and those of other runs.
    pub done: AtomicU64,
    /// Tasks that this run computed.
    pub computed: AtomicU64,
    /// Of these, calibrations without a result.
    pub failed: AtomicU64,
    /// Simulated candidates.
    pub evaluations: AtomicU64,
    /// Those of tasks that this run computes.
    pub finished: AtomicU64,
}

/// The file of this process.
pub(super) struct Log<'a> {
    path: PathBuf,
    progress: &'a Progress,
    started: Instant,
    started_unix_s: u64,
    cpu: cpu_time::ProcessTime,
    renewed: Instant,
    /// Evaluator of the candidates.
    pub evaluator: String,
}

impl<'a> Log<'a> {
    pub fn new(folder: &Folder, progress: &'a Progress) -> Log<'a> {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let path = folder.runs().join(format!("{}-{}.json", since.as_millis(), std::process::id()));
        let (started, cpu) = (Instant::now(), cpu_time::ProcessTime::now());
        let evaluator = String::new();
        Log { path, progress, started, started_unix_s: since.as_secs(), cpu, renewed: started, evaluator }
    }

    pub fn renew(&mut self) {
        if self.renewed.elapsed() > RENEW {
            self.renewed = Instant::now();
            self.write();
        }
    }

    pub fn write(&self) {
        let of = |counter: &AtomicU64| counter.load(Ordering::SeqCst);
        if of(&self.progress.evaluations) == 0 {
            return;
        }
        let content = serde_json::json!({
            "schema_version": SCHEMA_VERSION,
            "program": *PROGRAM,
            "started_unix_s": self.started_unix_s,
            "wall_s": self.started.elapsed().as_secs_f64(),
            "cpu_s": self.cpu.elapsed().as_secs_f64(),
            "threads": rayon::current_num_threads(),
            "evaluator": self.evaluator,
            "tasks": of(&self.progress.computed),
            "failed": of(&self.progress.failed),
            "evaluations": of(&self.progress.evaluations),
        });
        // A run whose time cannot be recorded still counts.
        let _ = write_whole(&self.path, format!("{content:#}\n").as_bytes());
    }
}

/// Work of all runs on a folder; for killed ones, the part that they had recorded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PastRuns {
    /// Number of runs.
    pub runs: usize,
    /// Tasks computed.
    pub tasks: u64,
    /// Wall time \[s\]; simultaneous runs count separately.
    pub wall_s: f64,
    /// CPU time \[s\].
    pub cpu_s: f64,
    /// Simulated candidates.
    pub evaluations: u64,
}

/// Adds up the logs of the runs on a folder.
pub fn past_runs(folder: &Folder) -> PastRuns {
    let mut past = PastRuns::default();
    for path in std::fs::read_dir(folder.runs()).into_iter().flatten().flatten().map(|entry| entry.path()) {
        // Unwritten work of a killed process counts beside the written part.
        if path.extension().is_some_and(|ending| ending == TEMPORARY) {
            continue;
        }
        let text = bounded::read_to_string(&path, TEXT_MAX).unwrap_or_default();
        let Ok(run) = serde_json::from_str::<serde_json::Value>(&text) else { continue };
        let whole = |key: &str| run[key].as_u64().unwrap_or(0);
        past.runs += 1;
        past.tasks += whole("tasks");
        past.wall_s += run["wall_s"].as_f64().unwrap_or(0.0);
        past.cpu_s += run["cpu_s"].as_f64().unwrap_or(0.0);
        past.evaluations += whole("evaluations");
    }
    past
}
