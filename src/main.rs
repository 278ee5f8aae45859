//! The program: the command line of the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_device_selection();
    ExitCode::from(leadlag::cli::run(std::env::args_os()))
}

/// Mesa's layer for choosing among devices looks for a Wayland display and, without a desktop session, prints an error for each try.
/// leadlag does not need the layer, so it disables it there.
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
