//! Acceleration constraints. One file per row of the catalog.

use super::types::Road;
use crate::catalog::{Constraint, constraint_parts};

/// `(a, road)` to the constrained acceleration \[m/s²\].
pub(super) type ConstrainedAcceleration = fn(f64, &Road) -> f64;

macro_rules! declare {
    ($folder:ident, $doc:literal; $($part:ident, $file:ident, $paper:literal, [$($symbol:ident),*];)*) => {
        $(mod $file;)*

        pub(super) fn pick(part: Constraint) -> ConstrainedAcceleration {
            match part { $(Constraint::$part => $file::constrained_acceleration),* }
        }
    };
}
constraint_parts!(declare);
