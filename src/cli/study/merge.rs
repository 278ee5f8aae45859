//! `leadlag study merge`.

use super::super::output;
use super::status::complain;
use anyhow::bail;
use leadlag::report::{csv, parquet};
use leadlag::study::folder::{Folder, write_whole};
use leadlag::study::{inventory, merge};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// A further folder of parts, computed elsewhere; may be given several times
    #[arg(long, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Write the tables although tasks are missing
    #[arg(long)]
    partial: bool,
    /// Folder for the tables [default: merged, in the study's folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// True if a folder holds tables with more than their heads.
fn has_rows(folder: &Path) -> bool {
    let rows = |name: &str| {
        let table = File::open(folder.join(name)).map(BufReader::new);
        table.is_ok_and(|table| table.lines().take(2).count() == 2)
    };
    rows("calibrations.csv") || rows("validations.csv")
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = Folder::open(&args.folder)?;
    let tasks = folder.tasks()?;
    let inventory = inventory::look(&folder, &tasks, &args.parts)?;
    complain(&inventory);
    if !inventory.conflicting.is_empty() {
        let (parts, shown) = (inventory.conflicting.len(), args.folder.display());
        bail!("{parts} parts contradict another one; nothing is merged; `leadlag study status {shown}` names them");
    }
    let missing = inventory.missing.len();
    if missing > 0 && !args.partial {
        for &i in inventory.missing.iter().take(10) {
            let task = &tasks[i];
            let (id, platoon, follower) = (&task.id, &task.platoon, task.follower);
            eprintln!(
                "missing: {id} ({platoon} follower {follower}, {}, {}, replicate {})",
                task.variant, task.gof, task.replicate
            );
        }
        let shown = args.folder.display();
        bail!(
            "{missing} of {} tasks are missing; `leadlag study run {shown}` computes them, --partial merges without",
            tasks.len()
        );
    }
    let out = args.out.clone().unwrap_or_else(|| folder.merged());
    if inventory.done() == 0 && has_rows(&out) {
        let (out, shown) = (out.display(), args.folder.display());
        bail!(
            "no task of this plan is done, and {out} holds tables with rows, which empty ones would replace; \
             `leadlag study run {shown}` computes the tasks, --out DIR writes elsewhere"
        );
    }
    let merged = merge::merge(&folder.study_file()?, &tasks, &inventory);
    output::make_folder(&out)?;
    folder.sweep();
    let mut text = String::new();
    for (name, table) in [("calibrations", &merged.calibrations), ("validations", &merged.validations)] {
        let version = leadlag::study::SCHEMA_VERSION.to_string();
        let metadata = [("leadlag_table", name), ("leadlag_schema_version", version.as_str())];
        for (ending, bytes) in [("csv", csv::write(table)), ("parquet", parquet::write(table, &metadata))] {
            let path = out.join(format!("{name}.{ending}"));
            write_whole(&path, &bytes)?;
            text += &format!("{}  {} rows\n", path.display(), table.rows());
        }
    }
    output::print(&text)?;
    let infeasible = inventory.failed();
    eprintln!("{} tasks merged, {missing} missing, {infeasible} without a feasible candidate", inventory.done());
    Ok(())
}
