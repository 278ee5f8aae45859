//! A study as one HTML file.

use super::super::study::status::complain;
use crate::report::study;
use crate::study::folder::Folder;
use crate::study::outcome::Outcomes;
use crate::study::{inventory, past_runs};
use anyhow::bail;
use std::path::Path;

pub fn page(path: &Path) -> anyhow::Result<String> {
    let folder = Folder::open(path)?;
    let (tasks, file) = (folder.tasks()?, folder.study_file()?);
    let inventory = inventory::look(&folder, &tasks, &[])?;
    complain(&inventory)?;
    if inventory.done() == 0 {
        bail!("no task is done yet; `leadlag study run {}` computes them", path.display());
    }
    if !inventory.missing.is_empty() {
        let (missing, all) = (inventory.missing.len(), tasks.len());
        eprintln!("warning: {missing} of {all} tasks are missing; the report says so");
    }
    let all = Outcomes::of_study(&file, &tasks, &inventory);
    Ok(study::page(&file, &all, &inventory, &past_runs(&folder)))
}
