//! `leadlag inspect`: what a measured file contains.

use super::data::column_map;
use super::{Usage, output};
use leadlag::trajectory::import::{ColumnMap, read_mapped};
use leadlag::trajectory::{Inspection, Layout, import, inspect};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measured files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Layout of the files [default: by the header]
    #[arg(long)]
    layout: Option<Layout>,
    /// Column map of tables of another layout: ngsim, highd, sumo-fcd (`leadlag list columns`), or a file of one's own
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout")]
    columns: Option<String>,
    /// With --columns: only the pairs in which this vehicle follows
    #[arg(long, value_name = "ID", requires = "columns")]
    follower: Option<String>,
    /// Print JSON: an object for one file, an array for several
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let map = args.columns.as_deref().map(column_map).transpose()?;
    let (mut inspections, mut errors) = (Vec::new(), Vec::new());
    for file in &args.files {
        match one(file, args, map.as_ref()) {
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
        _ => Err(anyhow::anyhow!("{}", errors.iter().map(told).collect::<Vec<_>>().join("\n"))),
    }
}

fn one(file: &Path, args: &Args, map: Option<&ColumnMap>) -> anyhow::Result<Inspection> {
    let Some(map) = map else {
        return Ok(inspect(&import::read(file, args.layout)?));
    };
    let mut recording = read_mapped(file, map)?;
    if let Some(id) = &args.follower
        && !recording.keep_follower(id)
    {
        let message = format!("--follower {id}: it follows nobody in {}", file.display());
        return Err(Usage(message).into());
    }
    Ok(inspect(&recording))
}

/// One of several errors, with its causes.
fn told(error: &anyhow::Error) -> String {
    format!("{error:#}")
}
