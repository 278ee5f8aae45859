//! `leadlag study merge`.

use super::super::output;
use super::status::complaints;
use anyhow::bail;
use leadlag::report::{csv, parquet};
use leadlag::study::folder::{Folder, write_whole};
use leadlag::study::{inventory, merge};
use std::path::PathBuf;

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

pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = Folder::open(&args.folder)?;
    let tasks = folder.tasks()?;
    let inventory = inventory::look(&folder, &tasks, &args.parts)?;
    eprint!("{}", complaints(&inventory));
    if !inventory.conflicting.is_empty() {
        bail!("{} parts contradict another one; nothing is merged", inventory.conflicting.len());
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
    let merged = merge::merge(&folder.study_file()?, &tasks, &inventory);
    let out = args.out.clone().unwrap_or_else(|| folder.merged());
    output::make_folder(&out)?;
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
