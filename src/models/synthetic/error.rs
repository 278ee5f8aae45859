//! Faults of a scenario.

use super::effect::EffectKind;

/// A scenario that cannot be driven.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SyntheticError {
    #[error("{what}: expected {expected}, found {found}")]
    OutOfRange { what: String, expected: String, found: f64 },
    #[error(
        "car {car} collides with the car ahead after {t:.1} s (gap {gap:.3} m); give it shorter delays or a longer headway"
    )]
    Collision { car: usize, t: f64, gap: f64 },
    #[error("car {car} cannot look past the car ahead, because there is no other; choose a follower further back")]
    NobodyAhead { car: usize },
    #[error(
        "{effect} of car {car} begins at {begins_s} s, and the drive ends at {duration_s} s; start it earlier, as in {effect}:{parameter}={}, or drive longer",
        (0.4 * duration_s).round()
    )]
    TooLate { effect: EffectKind, car: usize, parameter: &'static str, begins_s: f64, duration_s: f64 },
    #[error(
        "{effect} changes the speed of car {car} by {largest:.3} m/s at most on this drive, less than the requested {wanted} m/s; try another drive, car or effect"
    )]
    Weak { effect: EffectKind, car: usize, wanted: f64, largest: f64 },
}
