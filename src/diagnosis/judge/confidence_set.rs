//! The models that cannot be distinguished from the best: the model confidence set of Hansen, Lunde and Nason (2011, Econometrica 79,
//! 453-497), with their statistic `T_max`.

use super::{Resamples, mean};

/// The p-value of each model, from losses with one row per model and one number per bin; the models above alpha form the confidence set of
/// level 1 - alpha. A model whose mean loss is not finite has 0.
///
/// # Panics
/// Unless rows have as many bins as the resamples.
#[must_use]
pub fn confidence_set(losses: &[Vec<f64>], resamples: &Resamples) -> Vec<f64> {
    let means: Vec<f64> = losses.iter().map(|row| mean(row)).collect();
    let draws: Vec<Vec<f64>> = losses.iter().map(|row| resamples.means(row)).collect();
    let mut p = vec![0.0; losses.len()];
    let mut left: Vec<usize> = (0..losses.len()).filter(|&k| means[k].is_finite()).collect();
    let mut so_far = 0.0_f64;
    while left.len() > 1 {
        let count = left.len() as f64;
        let centre = left.iter().map(|&k| means[k]).sum::<f64>() / count;
        let centres: Vec<f64> =
            (0..resamples.len()).map(|b| left.iter().map(|&k| draws[k][b]).sum::<f64>() / count).collect();
        // Distance of each model from the mean of the remaining ones, and the centred distance in every resample.
        let of = |k: usize| {
            let d = means[k] - centre;
            let centred: Vec<f64> = draws[k].iter().zip(&centres).map(|(x, c)| x - c - d).collect();
            let deviation = (centred.iter().map(|x| x * x).sum::<f64>() / centred.len().max(1) as f64).sqrt();
            let scale = if deviation > 0.0 { 1.0 / deviation } else { 0.0 };
            (
                d * scale / resamples.inflation(),
                centred.iter().zip(resamples.tails()).map(|(x, tail)| x * scale * tail).collect::<Vec<f64>>(),
            )
        };
        let studentised: Vec<(f64, Vec<f64>)> = left.iter().map(|&k| of(k)).collect();
        let worst = (0..left.len())
            .max_by(|&a, &b| studentised[a].0.total_cmp(&studentised[b].0))
            .expect("more than one model is left");
        let t = studentised[worst].0;
        let reaches = |b: &usize| studentised.iter().any(|(_, draws)| draws[*b] >= t);
        let reached = (0..resamples.len()).filter(reaches).count();
        so_far = so_far.max(reached as f64 / resamples.len().max(1) as f64);
        p[left.remove(worst)] = so_far;
    }
    left.iter().for_each(|&k| p[k] = 1.0);
    p
}

#[cfg(test)]
mod tests {
    use super::super::step_down::tests::noise;
    use super::*;

    fn rows(shifts: &[f64], bins: usize, seed: u64) -> Vec<Vec<f64>> {
        let shared = noise(bins, 0.4, seed);
        let row = |(k, shift): (usize, &f64)| {
            let own = noise(bins, 0.2, seed * 100 + k as u64 + 1);
            own.iter().zip(&shared).map(|(x, y)| 0.5 * x + 2.0 * y + shift).collect()
        };
        shifts.iter().enumerate().map(row).collect()
    }

    /// As in the simulations of Hansen, Lunde and Nason (Section 5): a worse model leaves the set, and the best ones stay at the nominal
    /// rate.
    #[test]
    fn the_best_models_stay_and_worse_ones_leave() {
        let (mut kept, mut size) = (0, 0);
        for set in 0..300 {
            let resamples = Resamples::new(&[100, 100], 3.0, 299, set);
            let p = confidence_set(&rows(&[0.0, 0.0, 0.35, 0.5, 0.6], 200, set), &resamples);
            let inside: Vec<bool> = p.iter().map(|p| *p > 0.1).collect();
            kept += usize::from(inside[0] && inside[1]);
            size += inside[2..].iter().filter(|inside| **inside).count();
        }
        assert!(kept >= 255, "both best models in {kept} of 300 sets of level 90 %");
        assert!(size <= 30, "{size} of 900 worse models");
    }

    #[test]
    fn p_values_grow_with_the_order_of_elimination() {
        let resamples = Resamples::new(&[150], 3.0, 499, 9);
        let losses = rows(&[0.0, 0.1, 0.2, 0.8], 150, 4);
        let p = confidence_set(&losses, &resamples);
        assert!(p.contains(&1.0) && p[3] <= p[2] && p[3] < 0.1, "{p:?}");
        let mut broken = losses;
        broken[1][3] = f64::NAN;
        let p = confidence_set(&broken, &resamples);
        assert!(p[1] == 0.0 && p.contains(&1.0));
    }
}
