//! Ctrl-C, and SIGTERM on Unix: the first asks to stop and keeps partial results, the second ends at once.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Watches for Ctrl-C and SIGTERM from now on.
pub fn watch() {
    watch_saying("results so far are kept");
}

/// The same, with a message on the partial results.
pub fn watch_saying(then: &'static str) {
    // Fails only if a handler exists already; Ctrl-C then just ends the program.
    let _ = ctrlc::set_handler(move || ask(130, &format!("\nstopping: {then} (Ctrl-C again ends at once)")));
    #[cfg(unix)]
    watch_termination(then);
}

/// Asks to stop, or ends the program with a status at the second time.
fn ask(status: i32, message: &str) {
    if ASKED.swap(true, Ordering::SeqCst) {
        std::process::exit(status);
    }
    eprintln!("{message}");
}

/// Schedulers send this when the time of a job is over. SIGHUP keeps its default: under `nohup` it must not stop a run.
#[cfg(unix)]
fn watch_termination(then: &'static str) {
    use signal_hook::consts::SIGTERM;
    // If a signal cannot be watched, it ends the program as usual.
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGTERM]) else { return };
    let message = format!("stopping: {then} (SIGTERM again ends at once)");
    let each = move || signals.forever().for_each(|signal| ask(128 + signal, &message));
    let _ = std::thread::Builder::new().spawn(each);
}

/// Breaks after a request to stop.
pub fn go_on() -> ControlFlow<()> {
    if asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// True after a request to stop.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}
