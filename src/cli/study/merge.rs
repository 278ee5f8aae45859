//! `leadlag study merge`.

use super::super::change::{Change, settle};
use super::super::output;
use super::status::{Place, complain};
use crate::report::{csv, parquet};
use crate::study::{SCHEMA_VERSION, merge};
use crate::text::bounded::Lines;
use crate::text::shown::counted;
use anyhow::bail;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    of: Place,
    /// Write the tables even if tasks are missing
    #[arg(long)]
    partial: bool,
    /// Folder for the tables [default: merged, in the study's folder]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// True if a folder holds tables with more than their headers.
fn has_rows(folder: &Path) -> bool {
    let rows = |name: &str| {
        let table = File::open(folder.join(name)).map(|table| BufReader::new(Lines::new(table)));
        table.is_ok_and(|table| table.lines().take(2).count() == 2)
    };
    rows("calibrations.csv") || rows("validations.csv")
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let (text, summary) = tables(&args.of, args.partial, args.out.as_deref())?;
    output::print(&text)?;
    eprintln!("{summary}");
    Ok(())
}

/// Writes the tables; returns their names with the numbers of rows, and a summary.
pub fn tables(of: &Place, partial: bool, out: Option<&Path>) -> anyhow::Result<(String, String)> {
    let (folder, tasks, inventory) = of.look()?;
    complain(&inventory)?;
    let missing = inventory.missing.len();
    if missing > 0 && !partial {
        for &i in inventory.missing.iter().take(10) {
            let task = &tasks[i];
            let (id, platoon, follower) = (&task.id, &task.platoon, task.follower);
            eprintln!(
                "missing: {id} ({platoon} follower {follower}, {}, {}, replicate {})",
                task.variant, task.gof, task.replicate
            );
        }
        let shown = of.folder.display();
        bail!(
            "{missing} of {} tasks are missing; `leadlag study run {shown}` computes them, `leadlag study merge {shown} --partial` \
             merges without them",
            tasks.len()
        );
    }
    let out = out.map_or_else(|| folder.merged(), Path::to_owned);
    settle(&out)?;
    if inventory.done() == 0 && has_rows(&out) {
        let (out, shown) = (out.display(), of.folder.display());
        bail!(
            "no task of this plan is done, and {out} holds tables with rows, which empty ones would replace; \
             `leadlag study run {shown}` computes the tasks, `leadlag study merge {shown} --partial --out DIR` writes elsewhere"
        );
    }
    let study = folder.study_file()?;
    let merged = merge::merge(&study, &tasks, &inventory);
    let mut change = Change::begin(&out)?;
    folder.sweep();
    let mut text = String::new();
    let mut files = Vec::new();
    let [version, all, missing_tasks] =
        [SCHEMA_VERSION as usize, tasks.len(), missing].map(|number| number.to_string());
    for (name, table) in [("calibrations", &merged.calibrations), ("validations", &merged.validations)] {
        let metadata = [
            ("leadlag_table", name),
            ("leadlag_schema_version", &version),
            ("leadlag_tasks", &all),
            ("leadlag_missing_tasks", &missing_tasks),
            ("leadlag_tasks_sha256", &study.tasks_sha256),
        ];
        output::warn_of_formula(&out.join(format!("{name}.csv")), table);
        files.push((format!("{name}.csv"), table, csv::write(table)));
        files.push((format!("{name}.parquet"), table, parquet::write(table, &metadata)));
    }
    // The list of missing tasks exists whenever the tables do.
    files.insert(0, ("missing.csv".to_owned(), &merged.missing, csv::write(&merged.missing)));
    for (name, table, bytes) in files {
        change.write(&name, &bytes)?;
        text += &format!("{}  {}\n", out.join(name).display(), counted(table.rows(), "row"));
    }
    change.finish(Vec::new())?;
    let infeasible = inventory.failed();
    let done = inventory.done();
    Ok((text, format!("{done} tasks merged, {missing} missing, {infeasible} without a feasible candidate")))
}
