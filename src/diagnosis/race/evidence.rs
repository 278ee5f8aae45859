//! Statistical tests of the models in a race. All tests share the bins and the resamples of the bins.

use super::policy::Policy;
use super::{Entry, Fit, HORIZONS, Horizon, OF_A_NAME};
use crate::judge::{Resamples, confidence_set, critical, mean, step_down};

/// Distance in standard errors from a limit at which a gain exceeds the limit with a probability of 80 %.
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

impl Gain {
    /// From the gains bin by bin and the mean loss of the reference.
    pub(super) fn of(horizon: Horizon, gains: &[f64], loss: f64, resamples: &Resamples, policy: &Policy) -> Gain {
        let error = resamples.deviation(gains);
        Gain {
            share: as_share(horizon, mean(gains), loss),
            interval: resamples.interval(gains, policy.interval).map(|gain| as_share(horizon, gain, loss)),
            t: if error > 0.0 { mean(gains) / error } else { 0.0 },
        }
    }
}

/// A model against the reference.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// At each horizon.
    pub gains: [Gain; HORIZONS],
    /// The gain of all horizons together in standard errors.
    pub t: f64,
    /// Probability, adjusted for all models of the race, of at least this gain if none is better than the reference.
    pub p: f64,
    /// True if it cannot be distinguished from the best at the shorter horizons.
    pub in_set: bool,
}

/// The models that cannot be distinguished from the best.
#[derive(Debug)]
pub struct ConfidenceSet {
    /// Positions of the horizons at which they were compared.
    pub horizons: &'static [usize],
    /// For every model that was judged, whether it is one of them.
    pub models: Vec<bool>,
    /// The same for the reference.
    pub reference: bool,
    /// The same for every other law.
    pub laws: Vec<bool>,
}

/// The results of all tests of a race.
#[derive(Debug)]
pub struct Table {
    /// The models that were judged, in their order.
    pub rows: Vec<Evidence>,
    /// Confidence sets at both shorter horizons together, at the shortest, and at the next.
    pub sets: Vec<ConfidenceSet>,
    /// Gain in standard errors that is found with a probability of 80 %, and the corresponding gain at the horizon of a name.
    pub found: [f64; 2],
}

/// Converts a gain in the loss to a share of the error.
fn as_share(horizon: Horizon, gain: f64, loss: f64) -> f64 {
    if horizon.is_whole() { gain / loss.max(f64::MIN_POSITIVE) } else { 1.0 - (-0.5 * gain).exp() }
}

/// Losses on the parts left out; `None` for a model that is not judged.
#[must_use]
pub fn held(entry: &Entry) -> Option<Rows> {
    rows(entry, |fit| fit.judged.as_ref().map(|judged| &judged.held))
}

/// Losses on the training data.
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

/// The gains of all horizons in one row, each divided by its standard error, so that its weight is its information.
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

/// Tests `models` against a reference. `passed_over` has the training gains of models that were tried but not tested: they only contribute
/// to the distribution of the largest gain by chance. `laws` are rivals for the confidence set.
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
    // One scale for all models; otherwise the sum would not be a loss.
    let scale = |k: usize| {
        let mut errors: Vec<f64> = gains.iter().map(|gains| resamples.deviation(&gains[k])).collect();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied().filter(|error| *error > 0.0).unwrap_or(1.0)
    };
    let scales: [f64; HORIZONS] = std::array::from_fn(scale);
    let set = |horizons: &'static [usize]| {
        let loss = |rows: &Rows| -> Vec<f64> {
            (0..rows[0].len()).map(|bin| horizons.iter().map(|&k| rows[k][bin] / scales[k]).sum()).collect()
        };
        let losses: Vec<Vec<f64>> = models.iter().chain([reference]).chain(laws).map(loss).collect();
        let set: Vec<bool> = confidence_set(&losses, resamples).iter().map(|p| *p > 1.0 - policy.set).collect();
        let (own, others) = set.split_at(models.len());
        ConfidenceSet { horizons, models: own.to_vec(), reference: others[0], laws: others[1..].to_vec() }
    };
    // Whole drives distinguish models least.
    const SETS: [&[usize]; 3] = [&[0, 1], &[0], &[1]];
    let sets: Vec<ConfidenceSet> = SETS.into_iter().map(set).collect();
    let one = |k: usize| {
        let gain = |h: usize| {
            let (row, horizon) = (&gains[k][h], Horizon::ALL[h]);
            Gain::of(horizon, row, mean(&reference[h]), resamples, policy)
        };
        Evidence { gains: std::array::from_fn(gain), t: adjusted[k].t, p: adjusted[k].p, in_set: sets[0].models[k] }
    };
    let needed = critical(&all, &others, resamples, policy.chance_of_a_name) + IN_FOUR_OF_FIVE;
    let gain = as_share(Horizon::ALL[OF_A_NAME], needed * scales[OF_A_NAME], mean(&reference[OF_A_NAME]));
    Table { rows: (0..models.len()).map(one).collect(), sets, found: [needed, gain] }
}

/// Which of these models cannot be distinguished from the best of them over whole drives.
#[must_use]
pub fn best_over_whole_drives(models: &[&Rows], resamples: &Resamples, policy: &Policy) -> Vec<bool> {
    let losses: Vec<Vec<f64>> = models.iter().map(|rows| rows[HORIZONS - 1].clone()).collect();
    confidence_set(&losses, resamples).iter().map(|p| *p > 1.0 - policy.set).collect()
}

/// The gains over the reference in training of a model that is not judged.
#[must_use]
pub fn passed_over(reference: &Rows, entry: &Entry) -> Option<Rows> {
    Some(minus(reference, &trained(entry)?))
}
