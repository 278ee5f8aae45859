//! Faults of a scenario.

use super::effect::EffectKind;

/// A scenario that cannot be driven.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SyntheticError {
    /// A quantity outside its range.
    #[error("{what}: expected {expected}, found {found}")]
    OutOfRange {
        /// The quantity, with its car, if any.
        what: String,
        /// The range, with its unit.
        expected: String,
        /// The offending value.
        found: f64,
    },
    /// Two cars collide: the parameters do not make a safe platoon.
    #[error(
        "car {car} collides with the car ahead after {t:.1} s (gap {gap:.3} m); give it shorter delays or a longer headway"
    )]
    Collision {
        /// Position in the platoon, 1 being the platoon leader.
        car: usize,
        /// Time of the collision \[s\].
        t: f64,
        /// Gap at that time \[m\].
        gap: f64,
    },
    /// An effect needs two cars ahead.
    #[error("car {car} cannot look past the car ahead, because there is no other; choose a follower further back")]
    NobodyAhead {
        /// Position in the platoon, 1 being the platoon leader.
        car: usize,
    },
    /// An effect begins after the end of the drive.
    #[error(
        "{effect} of car {car} begins at {begins_s} s, and the drive ends at {duration_s} s; start it earlier, as in {effect}:{parameter}={}, or drive longer",
        (0.4 * duration_s).round()
    )]
    TooLate {
        /// The effect.
        effect: EffectKind,
        /// Position in the platoon.
        car: usize,
        /// The parameter that sets the time.
        parameter: &'static str,
        /// Its start \[s\].
        begins_s: f64,
        /// End of the drive \[s\].
        duration_s: f64,
    },
    /// An effect changes this drive too little.
    #[error(
        "{effect} changes the speed of car {car} by {largest:.3} m/s at most on this drive, less than the requested {wanted} m/s; try another drive, car or effect"
    )]
    Weak {
        /// The effect.
        effect: EffectKind,
        /// Position in the platoon.
        car: usize,
        /// Root mean square wanted \[m/s\].
        wanted: f64,
        /// The largest change that was reached \[m/s\].
        largest: f64,
    },
}
