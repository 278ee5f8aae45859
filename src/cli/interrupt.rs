//! Ctrl-C, and SIGTERM where there is one: the first asks to stop and keep what was found, the second ends at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

static ASKED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Watches for Ctrl-C and SIGTERM from now on.
pub fn watch() {
    watch_saying("what was found so far is kept");
}

/// The same, with what becomes of what was found so far.
pub fn watch_saying(then: &'static str) {
    let handler = move || {
        if ASKED.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
        eprintln!("\nstopping: {then} (Ctrl-C again ends at once)");
    };
    // Fails only where a handler exists already; Ctrl-C then just ends the program.
    let _ = ctrlc::set_handler(handler);
    #[cfg(unix)]
    watch_termination();
}

/// What schedulers send when the time of a job is over. SIGHUP stays as it was: under `nohup` it must not stop a run.
#[cfg(unix)]
fn watch_termination() {
    use signal_hook::consts::SIGTERM;
    use signal_hook::flag;
    // In this order: what is asked for the first time is not yet asked for again.
    let again = flag::register_conditional_shutdown(SIGTERM, 128 + SIGTERM, Arc::clone(&ASKED));
    // Where a signal cannot be watched, it ends the program as ever.
    let _ = again.and_then(|_| flag::register(SIGTERM, Arc::clone(&ASKED)));
}

/// True once somebody has asked to stop.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}
