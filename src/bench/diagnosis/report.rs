//! What the finished cases say.

use super::DiagnosisJournal;
use super::judge::{DiagnosisOutcome, Judgement, judge};
use super::plan::DiagnosisTask;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Counts of one row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Cases that could be made.
    pub cases: usize,
    /// See [`Judgement`].
    pub right: usize,
    /// The truth in the set, the right ones included.
    pub in_set: usize,
    /// Silent ones.
    pub silent: usize,
    /// Those of the silent ones that would have been named, had the search found the truth: the others lack evidence.
    pub not_found: usize,
    /// Wrong names and false alarms.
    pub wrong: usize,
}

/// Everything that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiagnosisReport {
    /// Version of this layout.
    pub schema_version: u32,
    /// Counts by kind, base and size.
    pub tallies: BTreeMap<String, Tally>,
    /// Named first, by planted cause: how often.
    pub names: BTreeMap<String, BTreeMap<String, usize>>,
    /// Medians over the cases: CPU time \[s\], simulated candidates.
    pub cost: [f64; 2],
    /// All cases that are done.
    pub outcomes: Vec<DiagnosisOutcome>,
}

impl DiagnosisReport {
    /// Of the cases that the journal has.
    #[must_use]
    pub fn new(tasks: &[DiagnosisTask], journal: &DiagnosisJournal) -> DiagnosisReport {
        let outcomes: Vec<DiagnosisOutcome> = tasks.iter().filter_map(|task| journal.get(task)).cloned().collect();
        let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
        let mut names: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for outcome in &outcomes {
            let task = &outcome.task;
            let size = if task.kind == "one" { format!(" {:.2} m/s", task.rms_mps) } else { String::new() };
            let judged = judge(outcome);
            for base in [task.base.as_str(), "all bases"] {
                let tally = tallies.entry(format!("{}{size}, {base}", task.kind)).or_default();
                tally.cases += usize::from(judged != Judgement::Failed);
                tally.right += usize::from(judged == Judgement::Right);
                tally.in_set += usize::from(matches!(judged, Judgement::Right | Judgement::InSet));
                tally.silent += usize::from(judged == Judgement::Silent);
                let passes = outcome.known.as_ref().is_some_and(|known| known.objection.is_empty());
                tally.not_found += usize::from(judged == Judgement::Silent && passes);
                tally.wrong += usize::from(judged == Judgement::Wrong);
            }
            let truth = if task.causes.is_empty() { task.kind.clone() } else { task.causes.join(" + ") };
            let said = match outcome.adopted.join(" + ") {
                said if said.is_empty() => outcome.verdict.clone(),
                said => said,
            };
            *names.entry(truth).or_default().entry(said).or_default() += 1;
        }
        let median = |of: &dyn Fn(&DiagnosisOutcome) -> f64| {
            let mut all: Vec<f64> = outcomes.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(0.0)
        };
        let cost = [median(&|o| o.cpu_s), median(&|o| o.simulations as f64)];
        DiagnosisReport { schema_version: 1, tallies, names, cost, outcomes }
    }

    /// As text.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = format!(
            "{:32} {:>6} {:>6} {:>7} {:>7} {:>10} {:>6}\n",
            "", "cases", "right", "in set", "silent", "not found", "wrong"
        );
        for (row, tally) in &self.tallies {
            let Tally { cases, right, in_set, silent, not_found, wrong } = tally;
            let _ = writeln!(text, "{row:32} {cases:6} {right:6} {in_set:7} {silent:7} {not_found:10} {wrong:6}");
        }
        text += "not found: silent, although the truth, fitted from its own values, would have been named\n";
        text += "\nplanted, and what was said\n";
        for (truth, said) in &self.names {
            let said: Vec<String> = said.iter().map(|(name, times)| format!("{name} {times}")).collect();
            let _ = writeln!(text, "{truth:36} {}", said.join(", "));
        }
        let failed = self.outcomes.iter().filter(|o| o.verdict == "failed").count();
        let _ = writeln!(
            text,
            "\n{} cases, {failed} of them could not be made; median {:.0} s of CPU and {:.0} simulated candidates each",
            self.outcomes.len(),
            self.cost[0],
            self.cost[1]
        );
        text
    }
}
