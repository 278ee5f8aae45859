//! Medians, quartiles, rank correlation.

/// Quantile of values by linear interpolation between the two nearest (R's type 7); `None` of none.
#[must_use]
pub fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let position = q * (sorted.len().checked_sub(1)? as f64);
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Median; `None` of none.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Mean; `None` of none.
#[must_use]
pub fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// What a box plot shows.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxStatistics {
    /// First quartile, median, third quartile.
    pub quartiles: [f64; 3],
    /// The outermost values within 1.5 interquartile ranges of the box.
    pub whiskers: [f64; 2],
    /// Mean.
    pub mean: f64,
    /// Values beyond the whiskers.
    pub outliers: Vec<f64>,
}

/// Box, whiskers and outliers; `None` without values.
#[must_use]
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
#[must_use]
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
