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
        Grade { x: vec![0.0], sin: vec![0.0], period: None, source: None }
    }

    /// Sine of the grade at position `x` \[m\], linear between the nodes.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        let u = self.period.map_or(x, |period| x.rem_euclid(period));
        let k = self.x.partition_point(|node| *node <= u);
        if k == 0 {
            return self.sin[0];
        }
        if k == self.x.len() {
            return self.sin[k - 1];
        }
        let fraction = (u - self.x[k - 1]) / (self.x[k] - self.x[k - 1]);
        self.sin[k - 1] + (self.sin[k] - self.sin[k - 1]) * fraction
    }
}
