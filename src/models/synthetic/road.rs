//! The road: a closed track whose grade is a sum of a few waves.

use serde::{Deserialize, Serialize};

use super::noise::Stream;

/// The road of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Road {
    /// No grade anywhere.
    Level,
    /// A closed track, its waves drawn from the seed.
    Hilly {
        /// Length of one lap \[m\].
        #[serde(rename = "period_m")]
        period: f64,
        /// Largest sine of the grade, up or down.
        max_sin: f64,
    },
}

/// Sine of the road grade over one lap, linear between the points to about 1e-5.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GradeProfile {
    /// Position along the road \[m\], from 0 to the length of the lap.
    #[serde(rename = "position_m")]
    pub x: Vec<f64>,
    /// Sine of the grade at these positions.
    #[serde(rename = "sin_grade")]
    pub sin: Vec<f64>,
}

/// Waves per lap: hills of 475 m and longer, as on the AstaZero rural road.
const WAVES: usize = 12;
/// Points of the table: 5 m apart on a lap of 5.7 km.
const POINTS: usize = 1141;

/// Grade under the cars: smooth, periodic, with mean 0, so that a lap ends at the height of its start.
#[derive(Debug)]
pub(super) struct Hills {
    period: f64,
    /// Amplitudes of sine and cosine of wave 1, 2, ...
    waves: Vec<(f64, f64)>,
}

impl Hills {
    pub(super) fn new(road: &Road, stream: &mut Stream) -> Hills {
        let (period, max_sin) = match *road {
            Road::Level => (1.0, 0.0),
            Road::Hilly { period, max_sin } => (period, max_sin),
        };
        let waves = (1..=WAVES)
            .map(|wave| {
                // Long hills are steeper than short ones, as the height of terrain is.
                let amplitude = stream.between(0.3, 1.0) / (wave as f64).sqrt();
                let (sine, cosine) = stream.between(0.0, std::f64::consts::TAU).sin_cos();
                (amplitude * cosine, amplitude * sine)
            })
            .collect();
        let mut hills = Hills { period, waves };
        let steepest = hills.profile().sin.iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        for (sine, cosine) in &mut hills.waves {
            *sine *= max_sin / steepest;
            *cosine *= max_sin / steepest;
        }
        hills
    }

    /// Sine of the grade at a position along the road.
    pub(super) fn sin_grade(&self, x: f64) -> f64 {
        let (sin_1, cos_1) = (std::f64::consts::TAU * (x / self.period).rem_euclid(1.0)).sin_cos();
        // Computes every wave from the previous one by the sum of two angles, because sines would take most of the time
        // of a drive.
        let (mut sin, mut cos) = (0.0, 1.0);
        let mut sum = 0.0;
        for (sine, cosine) in &self.waves {
            (sin, cos) = (sin * cos_1 + cos * sin_1, cos * cos_1 - sin * sin_1);
            sum += sine * sin + cosine * cos;
        }
        sum
    }

    pub(super) fn profile(&self) -> GradeProfile {
        let x: Vec<f64> = (0..POINTS).map(|i| self.period * i as f64 / (POINTS - 1) as f64).collect();
        let sin = x.iter().map(|&x| self.sin_grade(x)).collect();
        GradeProfile { x, sin }
    }
}
