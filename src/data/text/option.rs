//! Options in messages. A text names an option by its id, such as `{MAX_GAP}`, and the front end of the process words it.

use serde::{Serialize, Serializer};
use std::cell::Cell;
use std::fmt;
use std::sync::{PoisonError, RwLock};

/// An option of a command, of a calibration or of reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Opt(&'static str);

macro_rules! options {
    ($($id:ident)*) => { $(pub const $id: Opt = Opt(stringify!($id));)* };
}

options! {
    BASE BOUNDS COLUMNS CONVENTION CORRECT DATA EVALUATOR EXTEND FIX FOLDS FOLLOWER FROM GOF GPU GRADE HISTORY HOLDOUT JOINT JOURNAL
    LEAD_LENGTH LEAD_START MAX_EVALUATIONS MAX_GAP MODEL OPTIMIZER OUT OWN PRECISION RECONCILE REPLICATES RESAMPLE SEED SEGMENT SMOOTH SUMO
    TO TRAJECTORY VEHICLE
}

/// How a front end words an option.
pub type Wording = fn(Opt) -> String;

static WORDING: RwLock<Wording> = RwLock::new(flag);

impl Opt {
    /// Its id, such as `max_gap`.
    pub fn id(self) -> String {
        self.0.to_lowercase()
    }
}

impl Serialize for Opt {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.id())
    }
}

impl fmt::Display for Opt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wording = match IN_FILE.get() {
            true => flag,
            false => *WORDING.read().unwrap_or_else(PoisonError::into_inner),
        };
        f.write_str(&wording(*self))
    }
}

/// The wording of the command line, and of a process that sets none: `--max-gap`.
pub fn flag(option: Opt) -> String {
    format!("--{}", option.id().replace('_', "-"))
}

thread_local! {
    static IN_FILE: Cell<bool> = const { Cell::new(false) };
}

/// Words options as flags in the texts that `make` formats on this thread: files must not depend on the front end.
pub fn in_file<T>(make: impl FnOnce() -> T) -> T {
    let before = IN_FILE.replace(true);
    let made = make();
    IN_FILE.set(before);
    made
}

/// Words the options in all later messages of this process.
pub fn word_options(wording: Wording) {
    *WORDING.write().unwrap_or_else(PoisonError::into_inner) = wording;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_option_is_a_flag_in_messages_and_its_id_elsewhere() {
        assert_eq!(format!("raise {MAX_GAP}"), "raise --max-gap");
        assert_eq!(MAX_GAP.id(), "max_gap");
        word_options(Opt::id);
        let in_both = [format!("raise {MAX_GAP}"), in_file(|| format!("raise {MAX_GAP}"))];
        word_options(flag);
        assert_eq!(in_both, ["raise max_gap", "raise --max-gap"]);
    }
}
