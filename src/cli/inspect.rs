//! `leadlag inspect`: what a measured file contains.

use super::{Usage, output};
use leadlag::trajectory::import::{ColumnMap, read_mapped};
use leadlag::trajectory::{Layout, import, inspect};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measured files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Layout of the files [default: by the header]
    #[arg(long)]
    layout: Option<Layout>,
    /// Column map of tables of another layout: ngsim, highd, sumo-fcd (`leadlag list columns`), or a file of one's own
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout", value_parser = ColumnMap::find)]
    columns: Option<ColumnMap>,
    /// With --columns: only the pairs in which this vehicle follows
    #[arg(long, value_name = "ID", requires = "columns")]
    follower: Option<String>,
    /// Print JSON: an object for one file, an array for several
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut inspections = Vec::new();
    for file in &args.files {
        let Some(map) = &args.columns else {
            inspections.push(inspect(&import::read(file, args.layout)?));
            continue;
        };
        let mut recording = read_mapped(file, map)?;
        if let Some(id) = &args.follower
            && !recording.keep_follower(id)
        {
            let message = format!("--follower {id}: it follows nobody in {}", file.display());
            return Err(Usage(message).into());
        }
        inspections.push(inspect(&recording));
    }
    if args.json {
        return match inspections.as_slice() {
            [one] => output::print_json(one),
            all => output::print_json(&all),
        };
    }
    let texts: Vec<String> = inspections.iter().map(ToString::to_string).collect();
    output::print(&texts.join("\n"))
}
