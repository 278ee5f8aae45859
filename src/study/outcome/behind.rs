//! Ratio of the errors of one model to those of another one.

use crate::identify::student;
use crate::statistics::mean;

/// Excess of the scores of a model over those of the model with the lowest, as a share: 0.04 is 4 %. Scores of drives differ by factors, so
/// the mean is over the logarithm of the ratio of two models.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Behind {
    /// The mean over the pairs.
    pub mean: f64,
    /// Its 95 % interval: from the noise within the drives, or from their differences, whichever is wider.
    pub interval: [f64; 2],
}

impl Behind {
    /// From logarithms of independent ratios; one alone has no known spread. `None` without any.
    pub fn of(ratios: &[f64]) -> Option<Behind> {
        let half = if ratios.iter().all(|ratio| *ratio == 0.0) {
            0.0
        } else if ratios.len() > 1 {
            between(ratios)
        } else {
            f64::INFINITY
        };
        mean(ratios).map(|mean| Behind::around(mean, half))
    }

    /// Of a mean logarithm and half of its interval.
    pub fn around(mean: f64, half: f64) -> Behind {
        // Every written number must be finite.
        let share = |logarithm: f64| logarithm.min(f64::MAX.ln()).exp_m1();
        Behind { mean: share(mean), interval: [mean - half, mean + half].map(share) }
    }

    /// The difference with its interval, or a statement that the data do not show one, in words.
    pub fn in_words(&self) -> String {
        let [low, high] = self.interval;
        if self.mean == 0.0 && low == high {
            "the lowest".to_owned()
        } else if self.is_open() {
            "undecided".to_owned()
        } else {
            format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
        }
    }

    /// True if the drives do not distinguish the two models.
    pub fn is_open(&self) -> bool {
        self.interval[0] <= 0.0
    }
}

/// Half of the 95 % interval of a mean, from the spread of the values.
pub fn between(values: &[f64]) -> f64 {
    let (count, mean) = (values.len() as f64, mean(values).unwrap_or(0.0));
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    student(count - 1.0) * (squares / (count - 1.0) / count).sqrt()
}
