//! What can be wrong with a scenario.

/// A scenario that cannot be driven.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// A quantity outside its range.
    #[error("{what}: expected {expected}, found {found}")]
    OutOfRange {
        /// Which quantity, with the car where it belongs to one.
        what: String,
        /// The range, with its unit.
        expected: String,
        /// The offending value.
        found: f64,
    },
    /// Two cars met: the parameters do not make a safe platoon.
    #[error(
        "car {car} runs into the car ahead after {t:.1} s (gap {gap:.3} m); give it shorter delays or a longer headway"
    )]
    Collision {
        /// Position in the platoon, 1 being the platoon leader.
        car: usize,
        /// Time of the collision \[s\].
        t: f64,
        /// Gap at that time \[m\].
        gap: f64,
    },
}
