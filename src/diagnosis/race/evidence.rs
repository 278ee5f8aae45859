//! What the tests say of the models of a race. All tests share the bins and the resamples of the bins.

use super::policy::Policy;
use super::{Entry, Fit, HORIZONS, Horizon, OF_A_NAME};
use crate::judge::{Resamples, confidence_set, critical, mean, step_down};

/// Standard errors above a limit at which a gain exceeds it with a probability of 80 %.
const IN_FOUR_OF_FIVE: f64 = 0.84;

/// Losses of a model bin by bin, at each horizon.
pub type Rows = [Vec<f64>; HORIZONS];

/// A model against the reference, at one horizon.
#[derive(Debug, Clone, Copy)]
pub struct Gain {
    /// Share by which the error on unseen drives falls.
    pub share: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// The gain in standard errors.
    pub t: f64,
}

/// A model against the reference.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// At each horizon.
    pub gains: [Gain; HORIZONS],
    /// The gain of all horizons together in standard errors.
    pub t: f64,
    /// Probability, adjusted for all models of the race, of so large a gain where none is better than the reference.
    pub p: f64,
    /// True if it cannot be told from the best at the shorter horizons.
    pub in_set: bool,
}

/// The models that cannot be told from the best.
#[derive(Debug)]
pub struct ConfidenceSet {
    /// Of every model that was judged, whether it is one of them.
    pub models: Vec<bool>,
    /// The same of the reference.
    pub reference: bool,
    /// The same of every other law.
    pub laws: Vec<bool>,
}

/// What is known of a race.
#[derive(Debug)]
pub struct Table {
    /// Of every model that was judged, in their order.
    pub rows: Vec<Evidence>,
    /// At both shorter horizons together, at the shortest, and at the next.
    pub sets: Vec<ConfidenceSet>,
    /// Standard errors that are found with a probability of 80 %, and the gain at the horizon of a name that has as many.
    pub found: [f64; 2],
}

/// A gain of a loss as a share of the error.
fn as_share(horizon: Horizon, gain: f64, loss: f64) -> f64 {
    if horizon.is_whole() { gain / loss.max(f64::MIN_POSITIVE) } else { 1.0 - (-0.5 * gain).exp() }
}

/// Losses on what was left out; none of a model that is not judged.
#[must_use]
pub fn held(entry: &Entry) -> Option<Rows> {
    rows(entry, |fit| fit.judged.as_ref().map(|judged| &judged.held))
}

/// Losses in training.
#[must_use]
pub fn trained(entry: &Entry) -> Option<Rows> {
    rows(entry, |fit| Some(&fit.trained))
}

fn rows(entry: &Entry, of: impl Fn(&Fit) -> Option<&super::loss::Losses>) -> Option<Rows> {
    let all = entry.fits.iter().zip(Horizon::ALL).map(|(fit, horizon)| {
        let losses = of(fit.as_ref()?)?;
        Some(if horizon.is_whole() { losses.roots(&entry.scales) } else { losses.logs() })
    });
    let all: Vec<Vec<f64>> = all.collect::<Option<_>>()?;
    all.try_into().ok()
}

fn minus(reference: &Rows, own: &Rows) -> Rows {
    std::array::from_fn(|k| reference[k].iter().zip(&own[k]).map(|(a, b)| a - b).collect())
}

/// The gains of all horizons in one row: each in units of its standard error, so that each weighs by what it tells.
fn together(gains: &Rows, resamples: &Resamples) -> Vec<f64> {
    let mut sum = vec![0.0; gains[0].len()];
    for gain in gains {
        let error = resamples.deviation(gain);
        if error > 0.0 {
            sum.iter_mut().zip(gain).for_each(|(sum, gain)| *sum += gain / error);
        }
    }
    sum
}

/// Tests `models` against a reference; `passed_over` were tried, and only take part in the largest gain that chance makes: their gains in
/// training. `laws` are rivals for the confidence set.
#[must_use]
pub fn table(
    reference: &Rows,
    models: &[Rows],
    passed_over: &[Rows],
    laws: &[Rows],
    resamples: &Resamples,
    policy: &Policy,
) -> Table {
    let gains: Vec<Rows> = models.iter().map(|rows| minus(reference, rows)).collect();
    let all: Vec<Vec<f64>> = gains.iter().map(|gains| together(gains, resamples)).collect();
    let others: Vec<Vec<f64>> = passed_over.iter().map(|gains| together(gains, resamples)).collect();
    let adjusted = step_down(&all, &others, resamples);
    // The same scale for all models: else a loss would not be one.
    let scale = |k: usize| {
        let mut errors: Vec<f64> = gains.iter().map(|gains| resamples.deviation(&gains[k])).collect();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied().filter(|error| *error > 0.0).unwrap_or(1.0)
    };
    let scales: [f64; HORIZONS] = std::array::from_fn(scale);
    let set = |horizons: &[usize]| {
        let loss = |rows: &Rows| -> Vec<f64> {
            (0..rows[0].len()).map(|bin| horizons.iter().map(|&k| rows[k][bin] / scales[k]).sum()).collect()
        };
        let losses: Vec<Vec<f64>> = models.iter().chain([reference]).chain(laws).map(loss).collect();
        let set: Vec<bool> = confidence_set(&losses, resamples).iter().map(|p| *p > 1.0 - policy.set).collect();
        let (own, others) = set.split_at(models.len());
        ConfidenceSet { models: own.to_vec(), reference: others[0], laws: others[1..].to_vec() }
    };
    // Whole drives tell models apart least.
    let sets: Vec<ConfidenceSet> = [&[0, 1][..], &[0], &[1]].into_iter().map(set).collect();
    let one = |k: usize| {
        let gain = |h: usize| {
            let (row, horizon) = (&gains[k][h], Horizon::ALL[h]);
            let loss = mean(&reference[h]);
            let error = resamples.deviation(row);
            Gain {
                share: as_share(horizon, mean(row), loss),
                interval: resamples.interval(row, policy.interval).map(|gain| as_share(horizon, gain, loss)),
                t: if error > 0.0 { mean(row) / error } else { 0.0 },
            }
        };
        Evidence { gains: std::array::from_fn(gain), t: adjusted[k].t, p: adjusted[k].p, in_set: sets[0].models[k] }
    };
    let needed = critical(&all, &others, resamples, policy.chance_of_a_name) + IN_FOUR_OF_FIVE;
    let gain = as_share(Horizon::ALL[OF_A_NAME], needed * scales[OF_A_NAME], mean(&reference[OF_A_NAME]));
    Table { rows: (0..models.len()).map(one).collect(), sets, found: [needed, gain] }
}

/// The gains in training of a model that is not judged, over the reference in training.
#[must_use]
pub fn passed_over(reference: &Rows, entry: &Entry) -> Option<Rows> {
    Some(minus(reference, &trained(entry)?))
}
