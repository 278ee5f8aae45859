//! Ctrl-C: the first one asks to stop and keep what was found, the second one ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// Watches for Ctrl-C from now on.
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
}

/// True once Ctrl-C was pressed.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}
