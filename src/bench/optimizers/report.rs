//! The finished tasks against the targets.

use super::{HARD, OptimizerOutcome, OptimizerTask, REPLICATES, SEED_TARGETS, SEEDS, SURFACES, WALL_TARGET_S};
use crate::batch::Journal;
use crate::calibrate::coefficient_of_variation;
use crate::statistics::median;
use serde::Serialize;
use std::fmt::Write;

/// A target and the value reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The target, in words.
    pub goal: String,
    /// The value wanted.
    pub wanted: f64,
    /// True if lower is better.
    pub at_most: bool,
    /// The value; none before any run.
    pub found: Option<f64>,
    /// Number of tasks for the value: finished, and planned for the whole target; a quick run plans only some of them.
    pub tasks: [usize; 2],
    /// Whether it is met; none unless all tasks of the target are done.
    pub met: Option<bool>,
}

/// Everything that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptimizerReport {
    /// Version of this layout.
    pub schema_version: u32,
    pub optimizer: String,
    /// The targets.
    pub findings: Vec<Finding>,
    /// All tasks that are done.
    pub outcomes: Vec<OptimizerOutcome>,
}

impl OptimizerReport {
    /// Results of the tasks in the journal.
    pub fn new(optimizer: &str, tasks: &[OptimizerTask], journal: &Journal<OptimizerOutcome>) -> OptimizerReport {
        let outcomes: Vec<OptimizerOutcome> = tasks.iter().filter_map(|t| journal.get(t)).cloned().collect();
        let mut findings = Vec::new();
        for target in SEED_TARGETS {
            for seeds in SEEDS {
                let of =
                    |t: &OptimizerTask| t.aim == "seeds" && t.model_id == target.model_id && seeds.contains(&t.seed);
                let done: Vec<&OptimizerOutcome> = outcomes.iter().filter(|o| of(&o.task)).collect();
                let within = |o: &&&OptimizerOutcome| o.reached(target.score, target.evaluations);
                let reached = done.iter().filter(within).count();
                // A quick run has the first seeds only: not enough to decide whether the target is met.
                let Some(last) = tasks.iter().filter(|t| of(t)).map(|t| t.seed).max() else { continue };
                let (first, whole, evaluations) = (seeds.start(), seeds.clone().count(), target.evaluations);
                let goal = format!(
                    "P3 follower 1, variant {}: seeds {first} to {last} that reach {} within {evaluations}",
                    target.model_id, target.score
                );
                let found = (!done.is_empty()).then_some(reached as f64);
                findings.push(finding(goal, target.of_ten as f64, false, found, [done.len(), whole]));
            }
        }
        for task in tasks.iter().filter(|t| t.aim == "wall") {
            let (id, convention, done) = (task.model_id, &task.convention, journal.get(task));
            let goal = format!("P3 follower 1, variant {id}, {convention}: start to result.json, wall time (s)");
            let tasks = [usize::from(done.is_some()), 1];
            findings.push(finding(goal, WALL_TARGET_S, true, done.map(|outcome| outcome.wall_s), tasks));
        }
        // Fewer surfaces than the target covers do not decide whether it is met.
        let mut spread = |aim: &str, whole: usize, what: &str, goals: &[(&str, f64)]| {
            let Some(OptimizerTask { convention, .. }) = tasks.iter().find(|t| t.aim == aim) else { return };
            let planned = tasks.iter().filter(|t| t.aim == aim).count();
            let values: Vec<f64> =
                outcomes.iter().filter(|o| o.task.aim == aim).map(OptimizerOutcome::variation).collect();
            let share = if planned < whole { format!("{planned} of {whole}") } else { format!("all {whole}") };
            for &(goal, wanted) in goals {
                let found =
                    if goal == "median" { median(&values) } else { values.iter().copied().max_by(f64::total_cmp) };
                let goal =
                    format!("CV of {REPLICATES} replicates (%), convention {convention}, {share} {what}: {goal}");
                findings.push(finding(goal, wanted, true, found, [values.len(), whole]));
            }
        };
        spread("spread", SURFACES, "surfaces", &[("median", 0.1), ("worst", 1.0)]);
        spread("hard", HARD.len(), "surfaces known as hard", &[("worst", 1.0)]);
        OptimizerReport { schema_version: 1, optimizer: optimizer.to_owned(), findings, outcomes }
    }

    /// For a terminal of 80 columns.
    pub fn table(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "How well `{}` finds, NRMSE(s,v,a), scores of the f64 reference; authors'", self.optimizer)?;
        writeln!(text, "convention, `paper` for the hard ones and the wall time. Settings were chosen on")?;
        writeln!(text, "seeds 1 to 10.\n")?;
        let seeds: Vec<&OptimizerOutcome> = self.outcomes.iter().filter(|o| o.task.aim == "seeds").collect();
        if !seeds.is_empty() {
            writeln!(
                text,
                "{:<13}{:>9}{:>13}{:>13}{:>13}{:>12}",
                "variant", "seed", "score", "evaluations", "ended", "wall s"
            )?;
        }
        for outcome in seeds {
            let score = outcome.scores[0].map_or("none".to_owned(), |x| format!("{x:.6}"));
            let (id, seed, wall) = (outcome.task.model_id, outcome.task.seed, outcome.wall_s);
            let ended = if outcome.stops[0] == "converged" { "converged" } else { "spent" };
            writeln!(text, "{id:<13}{seed:>9}{score:>13}{:>13}{ended:>13}{wall:>12.2}", outcome.evaluations[0])?;
        }
        let titles = [
            ("hard", "Known hard surfaces, convention paper: the widest spreads"),
            ("spread", "Convention authors: the widest spreads"),
        ];
        for (aim, title) in titles {
            self.write_spread(text, aim, title)?;
        }
        writeln!(text)?;
        for finding in &self.findings {
            let sign = if finding.at_most { "<=" } else { ">=" };
            let found = finding
                .found
                .map_or("-".to_owned(), |x| format!("{x:.4}").trim_end_matches('0').trim_end_matches('.').to_owned());
            let met = match finding.met {
                Some(true) => "met",
                Some(false) => "MISSED",
                None => "undecided",
            };
            let [done, planned] = finding.tasks;
            writeln!(
                text,
                "{}\n    wanted {sign} {}, found {found}: {met} ({done} of {planned} tasks)",
                finding.goal, finding.wanted
            )?;
        }
        Ok(())
    }

    fn write_spread(&self, text: &mut String, aim: &str, title: &str) -> std::fmt::Result {
        let mut spread: Vec<&OptimizerOutcome> = self.outcomes.iter().filter(|o| o.task.aim == aim).collect();
        spread.sort_by(|a, b| b.variation().total_cmp(&a.variation()));
        if spread.is_empty() {
            return Ok(());
        }
        writeln!(text, "\n{title} of {}", spread.len())?;
        writeln!(
            text,
            "{:<13}{:>9}{:>13}{:>13}{:>13}{:>12}",
            "variant", "follower", "lowest", "highest", "CV %", "mean evals"
        )?;
        for outcome in spread.iter().take(12) {
            let (id, task) = (outcome.task.model_id, &outcome.task);
            let follower = format!("P{}-{}", task.platoon, task.follower);
            let scores: Vec<f64> = outcome.scores.iter().flatten().copied().collect();
            let low = scores.iter().copied().fold(f64::INFINITY, f64::min);
            let high = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let evaluations = outcome.evaluations.iter().sum::<u64>() / outcome.evaluations.len().max(1) as u64;
            let variation = outcome.variation();
            writeln!(text, "{id:<13}{follower:>9}{low:>13.6}{high:>13.6}{variation:>13.4}{evaluations:>12}")?;
        }
        Ok(())
    }
}

fn finding(goal: String, wanted: f64, at_most: bool, found: Option<f64>, tasks: [usize; 2]) -> Finding {
    let enough = tasks[0] == tasks[1] && tasks[1] > 0;
    let met = found.filter(|_| enough).map(|found| if at_most { found <= wanted } else { found >= wanted });
    Finding { goal, wanted, at_most, found, tasks, met }
}

impl OptimizerOutcome {
    /// True if every replicate has a score as low as this, within this many evaluations.
    pub fn reached(&self, score: f64, evaluations: u64) -> bool {
        let low = self.scores.iter().all(|found| found.is_some_and(|found| found <= score));
        low && self.evaluations.iter().all(|spent| *spent <= evaluations)
    }

    /// Coefficient of variation of the scores \[%\]; infinite if a replicate has no score.
    pub fn variation(&self) -> f64 {
        let scores: Option<Vec<f64>> = self.scores.iter().copied().collect();
        scores.and_then(coefficient_of_variation).map_or(f64::INFINITY, |variation| 100.0 * variation)
    }
}
