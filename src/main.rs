//! The command line: arguments, library call, report. The only place that exits.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run(cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if cli::output::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            // A cause that is already quoted is not said twice.
            let said = error.to_string();
            let causes = error.chain().skip(1).map(ToString::to_string);
            causes.filter(|c| !said.contains(c.as_str())).for_each(|c| eprintln!("  because: {c}"));
            ExitCode::from(if cli::is_usage(&error) { 2 } else { 1 })
        }
    }
}
