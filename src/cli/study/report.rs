//! `leadlag study report`.

use super::super::change::Change;
use super::super::output;
use super::status::{Place, complain};
use crate::report::study;
use crate::study::outcome::Outcomes;
use anyhow::bail;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    of: Place,
    /// Write the report even if tasks are missing
    #[arg(long)]
    partial: bool,
    /// Folder for tables and figures [default: report, in the study's folder]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let (folder, tasks, inventory) = args.of.look()?;
    complain(&inventory)?;
    let file = folder.study_file()?;
    let (missing, shown) = (inventory.missing.len(), args.of.folder.display());
    if missing > 0 && !args.partial {
        let tasks = tasks.len();
        bail!(
            "{missing} of {tasks} tasks are missing; `leadlag study run {shown}` computes them, --partial reports without them"
        );
    }
    if inventory.done() == 0 {
        bail!("no task is done yet; `leadlag study run {shown}` computes them");
    }
    let all = Outcomes::of_study(&file, &tasks, &inventory);
    let out = args.out.clone().unwrap_or_else(|| folder.report());
    let mut change = Change::begin(&out)?;
    folder.sweep();
    let mut text = String::new();
    for (name, content) in study::files(&file, &all, missing) {
        change.write(name, content.as_bytes())?;
        text += &format!("{}\n", out.join(name).display());
    }
    change.finish(Vec::new())?;
    output::print(&text)
}
