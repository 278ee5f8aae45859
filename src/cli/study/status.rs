//! `leadlag study status`.

use super::super::output;
use leadlag::study::folder::Folder;
use leadlag::study::inventory::{self, Inventory};
use leadlag::study::{SCHEMA_VERSION, claimed, past_runs};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Print JSON, the ids of missing tasks included
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = Folder::open(&args.folder)?;
    let (tasks, study) = (folder.tasks()?, folder.study_file()?);
    let inventory = inventory::look(&folder, &tasks, &[])?;
    let (claimed, runs) = (claimed(&folder), past_runs(&folder));
    if args.json {
        let missing: Vec<&str> = inventory.missing.iter().map(|&i| tasks[i].id.as_str()).collect();
        return output::print_json(&serde_json::json!({
            "schema_version": SCHEMA_VERSION,
            "name": study.name,
            "tasks": tasks.len(),
            "done": inventory.done(),
            "infeasible": inventory.failed(),
            "under_way": claimed,
            "missing": missing,
            "damaged": inventory.damaged,
            "double": inventory.double,
            "conflicting": inventory.conflicting,
            "foreign": inventory.foreign,
            "unfinished": inventory.unfinished,
            "wall_s": runs.wall_s,
            "cpu_s": runs.cpu_s,
            "evaluations": runs.evaluations,
            "candidate_steps": runs.candidate_steps,
        }));
    }
    let mut text = String::new();
    writeln!(text, "{}: {} of {} tasks are done", study.name, inventory.done(), tasks.len())?;
    if inventory.failed() > 0 {
        writeln!(text, "{} of them found no feasible candidate", inventory.failed())?;
    }
    if claimed > 0 {
        writeln!(text, "{claimed} {} under way", if claimed == 1 { "is" } else { "are" })?;
    }
    text += &complaints(&inventory);
    if runs.tasks > 0 {
        let rate = runs.tasks as f64 / runs.wall_s;
        let (tasks, by) = (output::counted(runs.tasks, "task"), output::counted(runs.runs as u64, "run"));
        writeln!(
            text,
            "{tasks} computed by {by} in {:.0} s of wall time, {:.0} s of CPU time:",
            runs.wall_s, runs.cpu_s
        )?;
        let steps = runs.candidate_steps as f64 / runs.wall_s / 1e6;
        writeln!(text, "  {rate:.2} tasks/s, {steps:.1} million candidate-steps/s")?;
    }
    let verb = if inventory.missing.is_empty() { "merge" } else { "run" };
    writeln!(text, "go on with: leadlag study {verb} {}", args.folder.display())?;
    output::print(&text)
}

/// Says what is wrong with the parts.
pub fn complain(inventory: &Inventory) {
    complaints(inventory).lines().for_each(|line| eprintln!("{line}"));
}

/// What is wrong with the parts, one line each; empty if nothing is.
fn complaints(inventory: &Inventory) -> String {
    let mut text = String::new();
    for (files, what) in [
        (&inventory.damaged, "is no whole part of this version: its task counts as missing"),
        (&inventory.double, "repeats another part: no harm"),
        (&inventory.conflicting, "contradicts another part of the same task: delete the wrong one"),
        (&inventory.foreign, "is no part of this plan: it is left out"),
    ] {
        // Ten tell what is the matter.
        for path in files.iter().take(10) {
            text += &format!("{}: {what}\n", path.display());
        }
        if files.len() > 10 {
            text += &format!("... and {} more like this\n", files.len() - 10);
        }
    }
    text
}
