//! Which of several models beat a benchmark: the step-down test of Romano and Wolf (2005, Econometrica 73, 1237-1282), with p-values
//! adjusted for the number of models as in Romano and Wolf (2016, Stat. Probab. Lett. 113, 38-40).

use super::{Resamples, mean};
use crate::statistics::order_statistic;

/// A model against the benchmark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adjusted {
    /// Mean gain over the benchmark.
    pub gain: f64,
    /// The same in standard errors.
    pub t: f64,
    /// Probability, adjusted for all models, of at least this gain if none is better than the benchmark.
    pub p: f64,
}

/// Tests gains over a benchmark: one row per model, one number per bin (loss of the benchmark minus loss of the model). Rows of
/// `passed_over` were tried but are not tested: they only contribute to the distribution of the largest gain by chance.
///
/// # Panics
/// Unless rows have as many bins as the resamples.
#[must_use]
pub fn step_down(gains: &[Vec<f64>], passed_over: &[Vec<f64>], resamples: &Resamples) -> Vec<Adjusted> {
    let studentised: Vec<(f64, Vec<f64>)> = gains.iter().map(|row| resamples.studentised(row)).collect();
    let mut order: Vec<usize> = (0..gains.len()).collect();
    order.sort_by(|&a, &b| studentised[b].0.total_cmp(&studentised[a].0));
    let mut adjusted: Vec<Adjusted> =
        gains.iter().zip(&studentised).map(|(row, (t, _))| Adjusted { gain: mean(row), t: *t, p: 1.0 }).collect();
    // From the weakest model on, the running maximum over the remaining models.
    let mut largest = vec![f64::NEG_INFINITY; resamples.len()];
    for row in passed_over {
        largest.iter_mut().zip(resamples.studentised(row).1).for_each(|(m, draw)| *m = m.max(draw));
    }
    for &k in order.iter().rev() {
        let (t, draws) = &studentised[k];
        largest.iter_mut().zip(draws).for_each(|(m, draw)| *m = m.max(*draw));
        let reached = largest.iter().filter(|m| **m >= *t).count();
        adjusted[k].p = (reached + 1) as f64 / (resamples.len() + 1) as f64;
    }
    let mut least = 0.0_f64;
    for &k in &order {
        least = least.max(adjusted[k].p);
        adjusted[k].p = least;
    }
    adjusted
}

/// The gain in standard errors that the best of these models exceeds with this probability if none is better than the benchmark.
#[must_use]
pub fn critical(gains: &[Vec<f64>], passed_over: &[Vec<f64>], resamples: &Resamples, chance: f64) -> f64 {
    let mut largest = vec![f64::NEG_INFINITY; resamples.len()];
    for row in gains.iter().chain(passed_over) {
        largest.iter_mut().zip(resamples.studentised(row).1).for_each(|(m, draw)| *m = m.max(draw));
    }
    order_statistic(largest, 1.0 - chance).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// An autoregression with this coefficient and unit variance.
    pub fn noise(count: usize, rho: f64, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
        };
        let mut last = normal();
        (0..count)
            .map(|_| {
                last = rho * last + (1.0 - rho * rho).sqrt() * normal();
                last
            })
            .collect()
    }

    /// Romano and Wolf: a single hypothesis has the p-value of a plain bootstrap test, and adding worse models does not lower p-values.
    #[test]
    fn p_values_are_those_of_the_definition() {
        let resamples = Resamples::new(&[50], 1.0, 999, 5);
        let row = |shift: f64, seed| noise(50, 0.0, seed).iter().map(|x| x + shift).collect::<Vec<f64>>();
        let rows = [row(0.45, 1), row(0.3, 2), row(0.0, 3)];
        let alone = step_down(&rows[..1], &[], &resamples)[0];
        let (t, draws) = resamples.studentised(&rows[0]);
        let plain = (draws.iter().filter(|d| **d >= t).count() + 1) as f64 / 1000.0;
        assert_eq!((alone.p, alone.t), (plain, t));
        let all = step_down(&rows, &[], &resamples);
        assert!(all[0].p >= alone.p && all[2].p >= all[1].p.min(all[0].p));
        // By hand: the maximum over all models for the best, and over the remaining ones for the next.
        let of = |k: usize| resamples.studentised(&rows[k]);
        let by_hand = |models: &[usize], t: f64| {
            let parts: Vec<Vec<f64>> = models.iter().map(|&k| of(k).1).collect();
            let reached = (0..999).filter(|&b| parts.iter().any(|p| p[b] >= t)).count();
            (reached + 1) as f64 / 1000.0
        };
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| of(*b).0.total_cmp(&of(*a).0));
        let first = by_hand(&order, of(order[0]).0);
        let second = by_hand(&order[1..], of(order[1]).0).max(first);
        assert_eq!((all[order[0]].p, all[order[1]].p), (first, second));
        // An untested row contributes to the maximum in the same way as a tested, worse one.
        let with = step_down(&rows[..1], &rows[2..], &resamples)[0];
        assert_eq!(with.p, by_hand(&[0, 2], t));
    }

    /// A best model at the critical gain has the requested probability, and one below it a larger one.
    #[test]
    fn the_critical_gain_is_the_one_of_that_probability() {
        let resamples = Resamples::new(&[50], 1.0, 999, 5);
        let rows: Vec<Vec<f64>> = (1..4).map(|seed| noise(50, 0.0, seed)).collect();
        let at = critical(&rows[..2], &rows[2..], &resamples, 0.05);
        // The same noise with a mean of `t` standard errors.
        let moved = |t: f64| {
            let (now, _) = resamples.studentised(&rows[0]);
            let by = (t - now) * mean(&rows[0]) / now;
            let row: Vec<f64> = rows[0].iter().map(|x| x + by).collect();
            step_down(&[row, rows[1].clone()], &rows[2..], &resamples)[0].p
        };
        assert!((moved(at) - 0.05).abs() < 0.003 && moved(at - 0.3) > 0.06, "{} {}", moved(at), moved(at - 0.3));
    }

    /// Sets without an effect: any of ten models passes at 5 % in about 5 % of them, with bins that depend on each other.
    #[test]
    fn without_an_effect_the_error_rate_is_the_nominal_one() {
        let mut false_alarms = 0;
        for set in 0..1000 {
            let resamples = Resamples::new(&[60, 60, 60], 6.0, 299, set);
            let rows: Vec<Vec<f64>> = (0..10).map(|k| noise(180, 0.3, 1000 * set + k)).collect();
            false_alarms += usize::from(step_down(&rows, &[], &resamples).iter().any(|row| row.p < 0.05));
        }
        // 50 expected; the range allows four standard deviations of a binomial number, and the error of a bootstrap with 30 blocks.
        assert!((22..=95).contains(&false_alarms), "{false_alarms} of 1000");
    }

    #[test]
    fn a_gain_is_found_beside_others_that_have_none() {
        let resamples = Resamples::new(&[90, 90], 6.0, 999, 7);
        let mut rows: Vec<Vec<f64>> = (0..10).map(|k| noise(180, 0.3, k)).collect();
        rows[4].iter_mut().for_each(|x| *x += 0.6);
        let found = step_down(&rows, &[], &resamples);
        assert!(found[4].p < 0.01 && found.iter().filter(|row| row.p < 0.05).count() == 1, "{found:?}");
    }
}
