//! `leadlag inspect`: what a measured file contains.

use super::output;
use crate::api::error::refuse;
use crate::api::loading::{Input, column_map};
use crate::api::reading::{Reading, columns_help};
use crate::api::values::real;
use crate::trajectory::{Inspection, Layout, Preparation, PrepareError, inspect};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measured files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Layout of the files [default: by the header]
    #[arg(long)]
    layout: Option<Layout>,
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout", help = columns_help())]
    columns: Option<String>,
    /// With --columns: only the pairs in which this vehicle follows
    #[arg(long, value_name = "ID", requires = "columns")]
    follower: Option<String>,
    /// Only these trajectories of a file with several (ids separated by commas)
    #[arg(long, value_name = "ID")]
    trajectory: Option<String>,
    /// Length of the vehicle ahead in m, where a column map has none
    #[arg(long, value_name = "M", value_parser = real(Preparation::LEAD_LENGTH_M, "m"), allow_negative_numbers = true)]
    lead_length: Option<f64>,
    /// Print JSON: an object for one file, an array for several
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    // Once, and not for each file.
    args.columns.as_deref().map(column_map).transpose()?;
    let reading = Reading {
        layout: args.layout,
        columns: args.columns.clone(),
        trajectory: args.trajectory.clone(),
        lead_length_m: args.lead_length,
        ..Reading::default()
    };
    let (mut inspections, mut errors) = (Vec::new(), Vec::new());
    for file in &args.files {
        match one(file, args.follower.as_deref(), &reading) {
            Ok(inspection) => inspections.push(inspection),
            Err(error) => errors.push(error),
        }
    }
    // A bad file must not hide the good ones.
    if args.json {
        match inspections.as_slice() {
            [] => {}
            [one] if args.files.len() == 1 => output::print_json(one)?,
            all => output::print_json(&all)?,
        }
    } else if !inspections.is_empty() {
        let texts: Vec<String> = inspections.iter().map(ToString::to_string).collect();
        output::print(&texts.join("\n"))?;
    }
    match errors.len() {
        0 => Ok(()),
        1 => Err(errors.remove(0)),
        _ => Err(anyhow::anyhow!("{}", errors.iter().map(|error| format!("{error:#}")).collect::<Vec<_>>().join("\n"))),
    }
}

fn one(file: &Path, follower: Option<&str>, reading: &Reading) -> anyhow::Result<Inspection> {
    let mut recording = reading.open(Input::File(file))?;
    if let Some(given) = &reading.trajectory {
        let ids = reading.ids(&recording);
        let available: Vec<String> = recording.platoons.iter().filter_map(|platoon| platoon.id.clone()).collect();
        recording.platoons.retain(|platoon| platoon.id.as_ref().is_some_and(|id| ids.contains(id)));
        if recording.platoons.is_empty() {
            let (path, id) = (file.display().to_string(), given.clone());
            return Err(PrepareError::NoTrajectory { path, id, available }.into());
        }
    }
    if let Some(id) = follower
        && !recording.keep_follower(id)
    {
        refuse!("--follower {id}: it has no car ahead in {}", file.display());
    }
    Ok(inspect(&recording))
}
