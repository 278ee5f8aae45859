//! `leadlag study status`.

use super::super::change::settle;
use super::super::demo::quoted;
use super::super::output;
use crate::study::folder::Folder;
use crate::study::inventory::{self, Inventory};
use crate::study::{SCHEMA_VERSION, Task, claimed, past_runs};
use crate::text::shown::counted;
use std::fmt::Write;
use std::path::PathBuf;

/// A study and where its parts are.
#[derive(Debug, clap::Args)]
pub struct Place {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// A further folder of parts, computed elsewhere; may be given several times
    #[arg(long, value_name = "DIR")]
    pub parts: Vec<PathBuf>,
}

impl Place {
    pub fn look(&self) -> anyhow::Result<(Folder, Vec<Task>, Inventory)> {
        let folder = Folder::open(&self.folder)?;
        let tasks = folder.tasks()?;
        let inventory = inventory::look(&folder, &tasks, &self.parts)?;
        Ok((folder, tasks, inventory))
    }
}

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    of: Place,
    /// Print JSON, the ids of missing tasks included
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let (folder, tasks, inventory) = args.of.look()?;
    settle(&folder.merged())?;
    let study = folder.study_file()?;
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
            "conflicting": inventory.conflicting.iter().map(|(path, other)| [path, other]).collect::<Vec<_>>(),
            "foreign": inventory.foreign,
            "unfinished": inventory.unfinished,
            "wall_s": runs.wall_s,
            "cpu_s": runs.cpu_s,
            "evaluations": runs.evaluations,
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
        let (tasks, by) = (counted(runs.tasks, "task"), counted(runs.runs, "run"));
        // Simultaneous runs count separately.
        let each = if runs.runs > 1 { " of all runs together" } else { "" };
        writeln!(
            text,
            "{tasks} computed by {by} in {:.0} s of wall time{each},\n{:.0} s of CPU time:",
            runs.wall_s, runs.cpu_s
        )?;
        let simulations = runs.evaluations as f64 / runs.wall_s;
        let per = if runs.runs > 1 { " per run" } else { "" };
        writeln!(text, "  {rate:.2} tasks/s, {simulations:.0} simulations/s{per}")?;
    }
    let folder = quoted(&args.of.folder.display().to_string());
    match (inventory.conflicting.is_empty(), inventory.missing.is_empty()) {
        (false, _) => text += "delete the wrong file of each pair, or both; `run` computes them again\n",
        (true, false) => writeln!(text, "continue with: leadlag study run {folder}")?,
        (true, true) => {
            let further =
                args.of.parts.iter().map(|parts| format!(" --parts {}", quoted(&parts.display().to_string())));
            writeln!(text, "continue with: leadlag study merge {folder}{}", further.collect::<String>())?;
        }
    }
    output::print(&text)
}

/// Lists faults of the parts. If two parts contradict each other, neither is used.
pub fn complain(inventory: &Inventory) -> anyhow::Result<()> {
    complaints(inventory).lines().for_each(|line| eprintln!("{line}"));
    let pairs = counted(inventory.conflicting.len(), "pair");
    anyhow::ensure!(
        inventory.conflicting.is_empty(),
        "parts contradict each other ({pairs}), and leadlag uses neither; delete the wrong one of each pair; `leadlag study run` \
         computes a task without a part again"
    );
    Ok(())
}

/// Faults of the parts, one line each; empty without any.
fn complaints(inventory: &Inventory) -> String {
    let mut text = String::new();
    // Ten show the kind of fault.
    let mut tell = |lines: Vec<String>| {
        lines.iter().take(10).for_each(|line| text += &format!("{line}\n"));
        if lines.len() > 10 {
            text += &format!("... and {} more like this\n", lines.len() - 10);
        }
    };
    let say = |files: &[PathBuf], what: &str| files.iter().map(|path| format!("{}: {what}", path.display())).collect();
    tell(say(&inventory.damaged, "is not a complete part of this version: its task counts as missing"));
    tell(say(&inventory.double, "repeats another part: no harm"));
    let pairs = inventory.conflicting.iter().map(|(path, other)| (path.display(), other.display()));
    tell(pairs.map(|(path, other)| format!("{path}: contradicts {other}, a part of the same task")).collect());
    tell(say(&inventory.foreign, "is not a part of this plan: it is left out"));
    text
}
