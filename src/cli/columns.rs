//! `leadlag columns`: a built-in column map as text, to start your own from.

use super::output;
use crate::api::error::refuse;
use crate::text::spelling::did_you_mean;
use crate::trajectory::import::ColumnMap;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Name of a map, such as ngsim (`leadlag list columns`)
    #[arg(value_name = "NAME")]
    name: String,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let shipped = ColumnMap::shipped();
    let Some((_, text)) = shipped.iter().find(|(name, _)| name.eq_ignore_ascii_case(&args.name)) else {
        let names: Vec<&str> = shipped.iter().map(|(name, _)| *name).collect();
        let near = did_you_mean(&args.name, names.iter().copied());
        refuse!("no column map {}; built in are {}{near}", args.name, names.join(", "));
    };
    output::print(text)
}
