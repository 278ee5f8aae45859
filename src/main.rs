//! The command line: arguments, library call, report. The only place that exits.

mod cli;

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_device_selection();
    match cli::run(cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if cli::output::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) if error.is::<cli::Exit>() => {
            ExitCode::from(error.downcast_ref().map_or(1, |cli::Exit(code)| *code))
        }
        Err(error) => {
            // Nobody listening changes nothing about the status.
            let say = |line: String| drop(writeln!(std::io::stderr(), "{}", leadlag::shown::lines(&line)));
            say(format!("error: {error}"));
            // A cause that is already quoted is not said twice.
            let said = error.to_string();
            let causes = error.chain().skip(1).map(ToString::to_string);
            causes.filter(|c| !said.contains(c.as_str())).for_each(|c| say(format!("  because: {c}")));
            ExitCode::from(if cli::is_usage(&error) { 2 } else { 1 })
        }
    }
}

/// Mesa's layer for choosing among devices looks for a Wayland display and, where there is no desktop session, prints an error for each try.
/// leadlag chooses by itself, so the layer is left out there.
fn quiet_device_selection() {
    let set = |name: &str| std::env::var_os(name).is_some();
    if cfg!(target_os = "linux") && !set("XDG_RUNTIME_DIR") && !set("MESA_VK_DEVICE_SELECT") {
        #[allow(unsafe_code, reason = "the environment may only be written while there is one thread")]
        // SAFETY: the first call of `main`; no other thread has been started.
        unsafe {
            std::env::set_var("NODEVICE_SELECT", "1");
        }
    }
}
