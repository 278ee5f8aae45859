//! Whether any of several models beats a benchmark: Hansen's test for superior predictive ability (2005, J. Bus. Econ. Stat. 23,
//! 365-380).

use super::{Resamples, mean};

/// The p-values of the test: models that are clearly worse than the benchmark count fully, as far as consistency allows, or not at all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Superior {
    /// The largest studentised gain, at least 0.
    pub statistic: f64,
    /// Upper bound of the p-value (White's reality check, studentised).
    pub upper: f64,
    /// The consistent p-value.
    pub consistent: f64,
    /// Lower bound.
    pub lower: f64,
}

/// Tests gains over a benchmark: one row per model, one number per bin.
///
/// # Panics
/// Unless rows have as many bins as the resamples.
#[must_use]
pub fn superior_predictive_ability(gains: &[Vec<f64>], resamples: &Resamples) -> Superior {
    let bins = gains.first().map_or(0, Vec::len) as f64;
    // Hansen's threshold -sqrt(2 log log n), in standard errors of the mean.
    let threshold = -(2.0 * bins.max(3.0).ln().ln()).sqrt();
    let rows: Vec<(f64, Vec<f64>)> =
        gains.iter().filter(|row| mean(row).is_finite()).map(|row| resamples.studentised(row)).collect();
    let statistic = rows.iter().map(|(t, _)| *t).fold(0.0, f64::max);
    let p = |centre: &dyn Fn(f64) -> f64| {
        let reaches = |b: usize| {
            let largest = rows.iter().map(|(t, draws)| draws[b] + t - centre(*t)).fold(0.0, f64::max);
            largest > statistic
        };
        (0..resamples.len()).filter(|b| reaches(*b)).count() as f64 / resamples.len().max(1) as f64
    };
    Superior {
        statistic,
        upper: p(&|t| t),
        consistent: p(&|t| if t >= threshold { t } else { 0.0 }),
        lower: p(&|t| t.max(0.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::step_down::tests::noise;
    use super::*;

    /// Hansen's point: adding hopeless models raises the upper p-value and leaves the consistent one where it is.
    #[test]
    fn hopeless_models_do_not_cost_power() {
        let resamples = Resamples::new(&[200], 1.0, 1999, 1);
        let good: Vec<f64> = noise(200, 0.0, 1).iter().map(|x| x + 0.2).collect();
        let bad = |seed| noise(200, 0.0, seed).iter().map(|x| 3.0 * x - 1.5).collect::<Vec<f64>>();
        let alone = superior_predictive_ability(std::slice::from_ref(&good), &resamples);
        let rows: Vec<Vec<f64>> = std::iter::once(good).chain((2..40).map(bad)).collect();
        let among = superior_predictive_ability(&rows, &resamples);
        assert!(
            alone.statistic == among.statistic && among.consistent < alone.consistent + 0.01,
            "{alone:?} {among:?}"
        );
        assert!(among.upper > 3.0 * among.consistent, "{among:?}");
        assert!(among.lower <= among.consistent && among.consistent <= among.upper);
    }

    #[test]
    fn the_benchmark_wins_where_all_are_as_good() {
        let mut rejected = 0;
        for set in 0..500 {
            let resamples = Resamples::new(&[120], 4.0, 199, set);
            let rows: Vec<Vec<f64>> = (0..8).map(|k| noise(120, 0.2, 100 * set + k)).collect();
            rejected += usize::from(superior_predictive_ability(&rows, &resamples).consistent < 0.05);
        }
        // 25 expected; four standard deviations of a binomial number, and what the bootstrap of 30 blocks adds.
        assert!((7..=52).contains(&rejected), "{rejected} of 500");
    }
}
