//! Spacing policies: the spacing that a controller aims at. One file per row of the catalog.

use super::types::Perceived;
use crate::catalog::{Spacing, spacing_parts};
use crate::symbols::Parameters;

/// `(p, x)` to s_des \[m\].
pub(super) type DesiredSpacing = fn(&Parameters, &Perceived) -> f64;

macro_rules! declare {
    ($folder:ident, $doc:literal; $($part:ident, $file:ident, $paper:literal, [$($symbol:ident),*];)*) => {
        $(mod $file;)*

        pub(super) fn pick(part: Spacing) -> DesiredSpacing {
            match part { $(Spacing::$part => $file::desired_spacing),* }
        }
    };
}
spacing_parts!(declare);
