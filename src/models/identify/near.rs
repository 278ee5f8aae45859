//! Correlation of near-optimal candidates.

use crate::calibrate::Replicate;

/// Pearson's correlation of the parameters among candidates that are nearly as good as the best: row by row over `free`, the positions
/// of the searched parameters. `rise`: largest excess of their scores, in units of the score. The candidates are those that the searches
/// met on their way. `None` if they are fewer than ten per parameter; the number of candidates comes with it.
#[must_use]
pub fn correlation(replicates: &[Replicate], free: &[usize], best: f64, rise: f64) -> Option<(Vec<Vec<f64>>, usize)> {
    let near: Vec<&[f64]> = replicates
        .iter()
        .flat_map(|r| &r.near)
        .filter(|(score, _)| *score <= best + rise)
        .map(|(_, candidate)| candidate.as_slice())
        .collect();
    let n = near.len() as f64;
    if free.is_empty() || near.len() < 10 * free.len() {
        return None;
    }
    let means: Vec<f64> = free.iter().map(|&i| near.iter().map(|c| c[i]).sum::<f64>() / n).collect();
    let covariance =
        |a: usize, b: usize| near.iter().map(|c| (c[free[a]] - means[a]) * (c[free[b]] - means[b])).sum::<f64>() / n;
    let deviations: Vec<f64> = (0..free.len()).map(|k| covariance(k, k).sqrt()).collect();
    let entry = |a: usize, b: usize| {
        let scale = deviations[a] * deviations[b];
        // A parameter that is the same in all, on a bound for instance, has no correlation.
        if a == b {
            1.0
        } else if scale > 0.0 {
            (covariance(a, b) / scale).clamp(-1.0, 1.0)
        } else {
            0.0
        }
    };
    let rows = (0..free.len()).map(|a| (0..free.len()).map(|b| entry(a, b)).collect()).collect();
    Some((rows, near.len()))
}
