//! Means, medians, quantiles, rank correlation, in one place. Only numbers.

/// Quantile of values by linear interpolation between the two nearest (R's type 7); `None` without values.
pub fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let position = q * (sorted.len().checked_sub(1)? as f64);
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Median; `None` of none.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Mean; `None` of none.
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The value below which this share of the values lies; `None` without values.
pub fn order_statistic(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let place = ((values.len() as f64 * share) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// The median as one of the values; of an even number, the upper of the two in the middle; `None` without values.
pub fn upper_median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    order_statistic(values, 0.5)
}

/// Standard error of the sum of samples that depend on their neighbours, and the equivalent number of independent ones. Autocovariances
/// count up to the first two neighbouring lags whose sum is not positive (C. J. Geyer, Statistical Science 7, 1992).
pub fn sum_of_dependent(samples: &[f64]) -> (f64, f64) {
    let n = samples.len();
    let Some(mean) = mean(samples) else { return (0.0, 0.0) };
    let left: Vec<f64> = samples.iter().map(|x| x - mean).collect();
    let at = |lag: usize| left[lag.min(n)..].iter().zip(&left).map(|(one, other)| one * other).sum::<f64>();
    let variance = at(0);
    if variance <= 0.0 {
        return (0.0, n as f64);
    }
    let lags = (0..n).step_by(2).map(|lag| at(lag) + at(lag + 1)).take_while(|sum| *sum > 0.0);
    // Lag 0 counts once in the sum, every other lag twice.
    let ratio = ((2.0 * lags.sum::<f64>() - variance) / variance).max(1.0);
    ((variance * ratio).sqrt(), n as f64 / ratio)
}

/// Root mean square of the finite values; `None` without any.
pub fn rms(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut squares, mut n) = (0.0, 0_usize);
    for value in values.into_iter().filter(|value| value.is_finite()) {
        squares += value * value;
        n += 1;
    }
    (n > 0).then(|| (squares / n as f64).sqrt())
}

/// Standard deviation of normal values by the median of their absolute values, which a few outliers do not change; `None` without a
/// finite value. Half of a normal distribution lies within 0.6745 standard deviations; 1.4826 is the inverse.
pub fn robust_scale(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let sizes = values.into_iter().map(f64::abs).filter(|value| value.is_finite());
    upper_median(sizes).map(|median| 1.4826 * median)
}

/// Values of a box plot.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxStatistics {
    /// First quartile, median, third quartile.
    pub quartiles: [f64; 3],
    /// The outermost values within 1.5 interquartile ranges of the box.
    pub whiskers: [f64; 2],
    pub mean: f64,
    /// Values beyond the whiskers.
    pub outliers: Vec<f64>,
}

/// Box, whiskers and outliers; `None` without values.
pub fn box_statistics(values: &[f64]) -> Option<BoxStatistics> {
    let quartiles = [quantile(values, 0.25)?, median(values)?, quantile(values, 0.75)?];
    let reach = 1.5 * (quartiles[2] - quartiles[0]);
    let inside = |x: &f64| *x >= quartiles[0] - reach && *x <= quartiles[2] + reach;
    let within = values.iter().copied().filter(inside);
    let whiskers = [within.clone().fold(f64::INFINITY, f64::min), within.fold(f64::NEG_INFINITY, f64::max)];
    let outliers = values.iter().copied().filter(|x| !inside(x)).collect();
    Some(BoxStatistics { quartiles, whiskers, mean: mean(values)?, outliers })
}

/// Spearman's rank correlation of pairs, ties with their mean rank; `None` with fewer than three pairs, or if all are equal.
pub fn spearman(pairs: &[(f64, f64)]) -> Option<f64> {
    if pairs.len() < 3 {
        return None;
    }
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let (a, b) = (ranks(&a), ranks(&b));
    let (mean_a, mean_b) = (mean(&a)?, mean(&b)?);
    let sum = |x: &[f64], m: f64, y: &[f64], n: f64| x.iter().zip(y).map(|(x, y)| (x - m) * (y - n)).sum::<f64>();
    let rho = sum(&a, mean_a, &b, mean_b) / (sum(&a, mean_a, &a, mean_a) * sum(&b, mean_b, &b, mean_b)).sqrt();
    rho.is_finite().then_some(rho)
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |x: f64| {
        let below = values.iter().filter(|y| **y < x).count() as f64;
        let equal = values.iter().filter(|y| **y == x).count() as f64;
        below + (equal + 1.0) / 2.0
    };
    values.iter().map(|x| rank(*x)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_values() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|q| quantile(&values, q).unwrap()), [1.0, 1.75, 2.5, 4.0]);
        assert_eq!(median(&[]), None);
    }

    /// The sum of an autoregressive series with coefficient 0.9 varies by (1 + 0.9) / (1 - 0.9) = 19 times as much as
    /// that of independent samples.
    #[test]
    fn dependent_samples_count_for_fewer() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut last = 0.0;
        let series: Vec<f64> = (0..50_000)
            .map(|_| {
                last = 0.9 * last + uniform();
                last
            })
            .collect();
        let (error, pieces) = sum_of_dependent(&series);
        assert!((50_000.0 / pieces / 19.0 - 1.0).abs() < 0.2, "{pieces}");
        // Independent ones of variance 1/12, which each stay for 1 / (1 - 0.9) samples in effect.
        let expected = (50_000.0_f64 / 12.0).sqrt() * 10.0;
        assert!((error / expected - 1.0).abs() < 0.1, "{error} {expected}");
        let (_, pieces) = sum_of_dependent(&(0..1000).map(|_| uniform()).collect::<Vec<_>>());
        assert!((800.0..=1000.0).contains(&pieces), "{pieces}");
        assert_eq!([sum_of_dependent(&[]), sum_of_dependent(&[2.0, 2.0])], [(0.0, 0.0), (0.0, 2.0)]);
    }

    #[test]
    fn order_statistics_are_values() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|share| order_statistic(values, share).unwrap()), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!([upper_median(values), upper_median([])], [Some(3.0), None]);
        assert_eq!(rms([3.0, f64::NAN, 4.0]), Some(12.5f64.sqrt()));
        assert_eq!(robust_scale([-1.0, 2.0, f64::NAN, 100.0]), Some(2.9652));
    }

    #[test]
    fn a_box_has_whiskers_up_to_its_reach_and_outliers_beyond() {
        let found = box_statistics(&[1.0, 2.0, 3.0, 4.0, 5.0, 100.0]).unwrap();
        assert_eq!((found.whiskers, found.outliers), ([1.0, 5.0], vec![100.0]));
    }

    #[test]
    fn ranks_correlate_whatever_the_scale() {
        assert_eq!(spearman(&[(1.0, 1.0), (2.0, 8.0), (3.0, 27.0)]), Some(1.0));
        assert_eq!(spearman(&[(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)]), Some(-1.0));
        assert_eq!(spearman(&[(1.0, 3.0), (2.0, 3.0), (3.0, 3.0)]), None);
        // Ties: ranks 1.5, 1.5, 3 against 1, 2, 3.
        let tied = spearman(&[(1.0, 1.0), (1.0, 2.0), (2.0, 3.0)]).unwrap();
        assert!((tied - 0.75f64.sqrt()).abs() < 1e-12, "{tied}");
    }
}
