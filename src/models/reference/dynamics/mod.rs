//! Vehicle dynamics: from the commanded to the actual acceleration. One file per row of the catalog.

use super::types::{Ego, Road};
use crate::catalog::{Dynamics, dynamics_parts};
use crate::symbols::Parameters;

/// `(p, a_cmd, ego, road)` to a_f \[m/s²\].
pub(super) type VehicleResponse = fn(&Parameters, f64, &Ego, &Road) -> f64;

macro_rules! declare {
    ($folder:ident, $doc:literal; $($part:ident, $file:ident, $paper:literal, [$($symbol:ident),*];)*) => {
        $(mod $file;)*

        pub(super) fn pick(part: Dynamics) -> VehicleResponse {
            match part { $(Dynamics::$part => $file::vehicle_response),* }
        }
    };
}
dynamics_parts!(declare);
