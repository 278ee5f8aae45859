//! The stationary bootstrap (Politis and Romano 1994, J. Am. Stat. Assoc. 89, 1303-1313).

use super::mean;
use crate::statistics::order_statistic;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A resample: how often each unit is drawn.
pub type Draw = Vec<u16>;

/// Resamples of bins. A unit is the part of the bins that is drawn together.
#[derive(Debug, Clone)]
pub struct Resamples {
    draws: Vec<Draw>,
    /// The unit of every bin.
    units: Vec<usize>,
    /// Number of bins of every unit.
    sizes: Vec<f64>,
    /// Factor on the standard error of the resamples.
    inflation: f64,
    /// For each resample, the ratio of a standard error to its estimate from so few blocks: studentised means have the tails of Student's
    /// distribution, which resamples of one estimate do not show.
    tails: Vec<f64>,
}

impl Resamples {
    /// Draws `count` resamples of segments with these numbers of bins; each bin is a unit. A block of geometric length, `mean_block` bins on
    /// average, starts anywhere, continues from the end of its segment at its start, and never enters another segment.
    ///
    /// # Panics
    /// If blocks are shorter than one bin.
    #[must_use]
    pub fn new(segments: &[usize], mean_block: f64, count: usize, seed: u64) -> Resamples {
        assert!(mean_block >= 1.0, "blocks of at least one bin");
        // The successor of every bin.
        let mut next = Vec::new();
        for &length in segments {
            let from = next.len();
            next.extend((0..length).map(|k| from + (k + 1) % length));
        }
        Resamples::of((0..next.len()).collect(), &next, mean_block, count, seed)
    }

    /// Draws `count` resamples of whole units; `units` has the unit of every bin, counted from 0. The bins of a unit, such as those of a
    /// driver, may depend on each other in any way.
    #[must_use]
    pub fn of_units(units: &[usize], count: usize, seed: u64) -> Resamples {
        let next: Vec<usize> = (0..units.iter().max().map_or(0, |last| last + 1)).collect();
        Resamples::of(units.to_vec(), &next, 1.0, count, seed)
    }

    fn of(units: Vec<usize>, next: &[usize], mean_block: f64, count: usize, seed: u64) -> Resamples {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let draws = (0..count).map(|_| draw(next, 1.0 / mean_block, &mut rng)).collect();
        // Autocovariances about the sample mean are too small by the variance of that mean. It enters as often as a block contains two
        // units, 2 mean_block - 1 times.
        let lost = (2.0 * mean_block - 1.0) / (next.len() as f64).max(1.0);
        let inflation = if lost < 1.0 { (1.0 - lost).sqrt().recip() } else { f64::INFINITY };
        let blocks = ((next.len() as f64 / mean_block).round() as usize).max(1);
        let mut square = || {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            -2.0 * (1.0 - u).ln() * (std::f64::consts::TAU * v).cos().powi(2)
        };
        let mut tail = || (blocks as f64 / (0..blocks).map(|_| square()).sum::<f64>()).sqrt();
        let tails = (0..count).map(|_| tail()).collect();
        let mut sizes = vec![0.0; next.len()];
        units.iter().for_each(|unit| sizes[*unit] += 1.0);
        Resamples { draws, units, sizes, inflation, tails }
    }

    /// Number of resamples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.draws.len()
    }

    /// True without resamples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.draws.is_empty()
    }

    /// The mean of values, one per bin, in every resample; linear in the draws where units differ in their number of bins.
    ///
    /// # Panics
    /// Unless there is one value per bin.
    #[must_use]
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.units.len(), "one value per bin");
        let centre = mean(values);
        let mut sums: Vec<f64> = self.sizes.iter().map(|size| -centre * size).collect();
        values.iter().zip(&self.units).for_each(|(value, unit)| sums[*unit] += value);
        let of = |draw: &Draw| draw.iter().zip(&sums).map(|(times, sum)| f64::from(*times) * sum).sum::<f64>();
        self.draws.iter().map(|draw| centre + of(draw) / values.len().max(1) as f64).collect()
    }

    /// The percentile interval of the mean at this probability.
    #[must_use]
    pub fn interval(&self, values: &[f64], probability: f64) -> [f64; 2] {
        let (centre, means) = (mean(values), self.means(values));
        let at = |share: f64| {
            let found = order_statistic(means.iter().copied(), share).unwrap_or(f64::NAN);
            centre + self.inflation * (found - centre)
        };
        let tail = 0.5 * (1.0 - probability);
        [at(tail), at(1.0 - tail)]
    }

    /// Standard error of the mean of values, one per bin.
    #[must_use]
    pub fn deviation(&self, values: &[f64]) -> f64 {
        let (centre, means) = (mean(values), self.means(values));
        let variance = means.iter().map(|m| (m - centre).powi(2)).sum::<f64>() / means.len().max(1) as f64;
        variance.sqrt() * self.inflation
    }

    /// Centred means of the resamples in units of their standard deviation, and the mean in the same unit. Without variation, a nonzero
    /// mean is infinite; NaN counts as the worst.
    pub(super) fn studentised(&self, values: &[f64]) -> (f64, Vec<f64>) {
        let centre = mean(values);
        if !centre.is_finite() {
            return (f64::NEG_INFINITY, vec![f64::NEG_INFINITY; self.len()]);
        }
        let mut means = self.means(values);
        means.iter_mut().for_each(|m| *m -= centre);
        let deviation = (means.iter().map(|m| m * m).sum::<f64>() / means.len().max(1) as f64).sqrt();
        if deviation <= f64::EPSILON * centre.abs() || deviation == 0.0 {
            let t = if centre == 0.0 { 0.0 } else { centre.signum() * f64::INFINITY };
            return (t, vec![0.0; means.len()]);
        }
        means.iter_mut().zip(&self.tails).for_each(|(m, tail)| *m *= tail / deviation);
        (centre / (deviation * self.inflation), means)
    }

    /// See `inflation` of [`Resamples`].
    pub(super) fn inflation(&self) -> f64 {
        self.inflation
    }

    /// See `tails` of [`Resamples`].
    pub(super) fn tails(&self) -> &[f64] {
        &self.tails
    }
}

fn draw(next: &[usize], ends: f64, rng: &mut ChaCha8Rng) -> Draw {
    let (mut times, mut at) = (vec![0; next.len()], 0);
    for k in 0..next.len() {
        let begins = k == 0 || rng.random::<f64>() < ends;
        at = if begins { ((rng.random::<f64>() * next.len() as f64) as usize).min(next.len() - 1) } else { next[at] };
        times[at] = u16::saturating_add(times[at], 1);
    }
    times
}

#[cfg(test)]
mod tests {
    use super::super::step_down::tests::noise;
    use super::*;

    #[test]
    fn blocks_keep_to_their_segment_and_their_length() {
        let resamples = Resamples::new(&[40, 0, 25], 6.0, 400, 1);
        for draw in &resamples.draws {
            assert_eq!(draw.iter().sum::<u16>(), 65);
        }
        // If no block ends, a resample is one segment, cyclically.
        for draw in &Resamples::new(&[40, 25], 1e9, 50, 1).draws {
            assert!(draw[..40].iter().all(|times| *times == 0) || draw[40..].iter().all(|times| *times == 0));
        }
        // Blocks keep neighbours together: the mean of a slow wave varies more than that of independent bins.
        let slow: Vec<f64> = (0..65).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let spread = |mean_block| {
            let means = Resamples::new(&[65], mean_block, 2000, 2).means(&slow);
            means.iter().map(|m| m * m).sum::<f64>() / 2000.0
        };
        assert!(spread(6.0) > 3.0 * spread(1.0));
    }

    /// An autoregression of coefficient 0.5: the variance of the mean is (1 + 0.5) / (1 - 0.5) times that of independent bins.
    #[test]
    fn the_variance_of_a_mean_is_that_of_an_autoregression() {
        let (count, mut ratios) = (400, Vec::new());
        for seed in 0..20 {
            let values = noise(count, 0.5, seed);
            let m = mean(&values);
            let variance = values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / count as f64;
            let resamples = Resamples::new(&[count], 10.0, 500, seed);
            let means = resamples.means(&values);
            let of_mean = means.iter().map(|x| (x - m).powi(2)).sum::<f64>() / 500.0;
            let of_mean = of_mean * resamples.inflation().powi(2);
            ratios.push(of_mean / variance * count as f64);
        }
        let ratio = mean(&ratios);
        assert!((2.3..3.3).contains(&ratio), "{ratio}");
    }

    #[test]
    fn an_interval_holds_the_mean() {
        let values = noise(300, 0.0, 3);
        let [low, high] = Resamples::new(&[300], 1.0, 4000, 3).interval(&values, 0.95);
        let m = mean(&values);
        let deviation = (values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / 300.0).sqrt();
        let half = 1.96 * deviation / 300.0_f64.sqrt();
        assert!((low - (m - half)).abs() < 0.15 * half && (high - (m + half)).abs() < 0.15 * half);
    }
}
