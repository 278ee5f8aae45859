//! Bounds for a diagnosis: wide enough that the base model is not pressed against them.
//!
//! Those of Table 3 are for calibrations of cars that are known to be within them; a parameter on its bound makes the rest of the
//! model bend, and a bent model names ghosts.

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::symbols::Symbol;

/// Bounds of a base model's parameter; `None`: those of Table 3.
#[must_use]
pub fn bounds(symbol: Symbol) -> Option<[f64; 2]> {
    Some(match symbol {
        Symbol::delta => [0.1, 20.0],
        Symbol::k_s => [1e-3, 5.0],
        Symbol::k_v | Symbol::k_0 => [1e-3, 5.0],
        Symbol::v_0 => [5.0, 60.0],
        Symbol::d_0 => [0.1, 10.0],
        Symbol::t_h => [0.1, 5.0],
        Symbol::a_max => [0.1, 8.0],
        Symbol::a_min | Symbol::a_hat_min => [-10.0, -0.1],
        Symbol::tau_p => [0.0, 0.8],
        Symbol::tau_a => [0.02, 2.5],
        _ => return None,
    })
}

/// The wide bounds of a variant's parameters.
#[must_use]
pub fn overrides(variant: &Variant) -> Overrides {
    let of = |symbol: Symbol| Some((symbol.name().to_owned(), bounds(symbol)?));
    variant.parameters().into_iter().filter_map(of).collect()
}
