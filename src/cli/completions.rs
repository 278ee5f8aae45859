//! `leadlag completions`: scripts for shells.

use super::output;
use clap_complete::Shell;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag completions bash > ~/.local/share/bash-completion/completions/leadlag
  leadlag completions zsh > ~/.zfunc/_leadlag
  leadlag completions fish > ~/.config/fish/completions/leadlag.fish")]
pub struct Args {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut super::command(), "leadlag", &mut script);
    output::print(&String::from_utf8(script)?)
}
