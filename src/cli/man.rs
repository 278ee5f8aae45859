//! `leadlag man`: manual pages, made from the same descriptions as `--help`.

use super::output;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag man | man -l -
  leadlag man --out ~/.local/share/man/man1")]
pub struct Args {
    /// Folder for one page per command: leadlag.1, leadlag-calibrate.1, ... [default: print leadlag.1]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let Some(folder) = &args.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(super::command()).render(&mut page)?;
        return output::print(&String::from_utf8(page)?);
    };
    output::make_folder(folder)?;
    clap_mangen::generate_to(super::command(), folder)?;
    eprintln!("{}: one page per verb, such as leadlag-calibrate.1", folder.display());
    Ok(())
}
