//! Road grade as a function of the position along the road.

use super::Source;

/// Sine of the road grade over the position along the road; looked up at the *simulated* position of the ego vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Grade {
    /// Positions \[m\], strictly increasing.
    pub x: Vec<f64>,
    /// Sine of the grade at these positions.
    pub sin: Vec<f64>,
    /// Length of a closed track \[m\]: positions are taken modulo it. `None`: an open road, held constant beyond its ends.
    pub period: Option<f64>,
    /// The file it was read from, if any.
    pub source: Option<Source>,
}

impl Grade {
    /// A level road.
    #[must_use]
    pub fn level() -> Self {
        Grade {
            x: vec![0.0],
            sin: vec![0.0],
            period: None,
            source: None,
        }
    }
}
