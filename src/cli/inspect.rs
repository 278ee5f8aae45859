//! `leadlag inspect`: what a measured file contains.

use super::output;
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
    /// Print JSON: an object for one file, an array for several
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut inspections = Vec::new();
    for file in &args.files {
        inspections.push(inspect(&import::read(file, args.layout)?));
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
