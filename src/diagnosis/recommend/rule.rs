//! When a model counts as better: every question with what was found and what is needed.

use super::policy::Policy;
use super::race::Entry;
use crate::closed_loop::Losses;
use crate::diagnose::likelihood::model::Model;
use crate::extension::Extension;
use crate::judge::{Adjusted, Check, mean};

/// What the tests say of a model against another one, at one horizon.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Gain of the logarithmic loss, as a share of the error, and its interval.
    pub gain: f64,
    /// See `gain`.
    pub interval: [f64; 2],
    /// Gain of the root loss, as a share of the error.
    pub root: f64,
    /// True if it cannot be told from the best.
    pub in_set: bool,
    /// Everything that was asked.
    pub checks: Vec<Check>,
}

impl Judged {
    /// True if every check is met.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.checks.iter().all(|check| check.met)
    }
}

/// A gain of the mean logarithm of squared errors as a share of the error.
#[must_use]
pub fn as_share(log: f64) -> f64 {
    1.0 - (-0.5 * log).exp()
}

/// What is asked of a model with `added` causes more than the one it is compared with.
#[must_use]
pub fn checks(
    policy: &Policy,
    model: &Model,
    entry: &Entry,
    added: &[&'static Extension],
    adjusted: &Adjusted,
    gains: &[f64],
    root: f64,
) -> Vec<Check> {
    let better = gains.iter().filter(|gain| **gain > 0.0).count() as f64 / gains.len().max(1) as f64;
    vec![
        // Two horizons are two races.
        Check::at_most("probability by chance", adjusted.p, 0.5 * policy.chance),
        Check::at_least("gain of the error", as_share(adjusted.gain), policy.least_gain),
        Check::at_least("gain of the root loss", root, 0.0),
        Check::at_least("share of the bins that are better", better, policy.better),
        Check::at_most(
            "largest size over smallest, over the folds",
            spread(policy, model, entry, added),
            policy.spread,
        ),
        Check::at_least("smallest size of what is never negative", smallest(model, &entry.whole.values, added), 0.0),
    ]
}

/// The smallest size of the added causes that cannot be negative; 0 without one. (A car that reacts in finer steps than the model looks as if it
/// saw the preceding vehicle before it is there.)
fn smallest(model: &Model, values: &[f64], added: &[&'static Extension]) -> f64 {
    let positive = added.iter().filter(|cause| cause.cause.as_ref().is_some_and(|traits| traits.positive));
    positive.flat_map(|cause| model.positions(cause)).map(|k| values[k]).fold(0.0, f64::min)
}

/// The largest ratio of the sizes of the added causes over the folds; infinite where a sign changes, or where nothing has a size.
fn spread(policy: &Policy, model: &Model, entry: &Entry, added: &[&'static Extension]) -> f64 {
    let ratio = |k: usize| {
        let axis = &model.axes[k];
        let neutral = model.symbols[k].neutral().unwrap_or(axis.lower).clamp(axis.lower, axis.upper);
        let all: Vec<f64> = std::iter::once(&entry.whole.values).chain(&entry.folds).map(|values| values[k]).collect();
        let is_none = |value: &f64| (axis.coordinate(*value) - axis.coordinate(neutral)).abs() < policy.none;
        if all.iter().all(is_none) {
            return None;
        }
        // A limit has a size of its own, everything else is counted from where it does nothing.
        let size = |value: &f64| if axis.log { *value } else { value - neutral };
        let (least, most) =
            all.iter().map(size).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        Some(if least * most > 0.0 { (most / least).max(least / most) } else { f64::INFINITY })
    };
    let ratios = added.iter().flat_map(|cause| model.positions(cause)).filter_map(ratio);
    ratios.max_by(f64::total_cmp).unwrap_or(f64::INFINITY)
}

/// What is asked beyond that before a model is recommended: it comes through all whole drives, is nowhere worse, and is the same thing at
/// both horizons, which are those of [`Horizon`](crate::closed_loop::Horizon).
#[must_use]
pub fn whole_drives(
    policy: &Policy,
    model: &Model,
    entries: &[Entry; 2],
    added: &[&'static Extension],
    judged: &[Judged; 2],
) -> Vec<Check> {
    let margin = entries[0].held.margin().min(entries[0].trained.margin());
    let sizes = entries.iter().map(|entry| smallest(model, &entry.whole.values, added));
    vec![
        Check::at_least("smallest spacing over that measured", margin, policy.margin),
        Check::at_least("least gain of both losses at both horizons", least(&judged[0], &judged[1]), policy.no_loss),
        Check::at_least("smallest size of what is never negative, at both horizons", sizes.fold(0.0, f64::min), 0.0),
    ]
}

/// The smallest of the gains of both losses at both horizons: what a model is chosen by.
#[must_use]
pub fn least(drive: &Judged, window: &Judged) -> f64 {
    drive.gain.min(drive.root).min(window.gain).min(window.root)
}

/// Differences of two models, bin by bin: of the logarithmic and of the root loss.
#[must_use]
pub fn differences(base: &Losses, other: &Losses) -> [Vec<f64>; 2] {
    let minus = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| a - b).collect();
    [minus(base.logs(), other.logs()), minus(base.roots(), other.roots())]
}

/// Gain of the root loss as a share.
#[must_use]
pub fn root_share(differences: &[f64], base: &Losses) -> f64 {
    mean(differences) / mean(&base.roots()).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::catalog::Variant;
    use crate::closed_loop::{DriveLoss, Point};
    use crate::diagnose::made_up;
    use crate::wgsl::extension_named;

    fn with(name: &str) -> (Model, &'static Extension) {
        let cause = extension_named(name).expect("in the library");
        let variant = "idm".parse::<Variant>().expect("a base").with(cause).expect("they go together");
        let drives = [made_up::drive("made_up.csv", 0.0)];
        (Model::new(variant, &drives, &Overrides::new(), &[]).expect("a model"), cause)
    }

    fn sized(model: &Model, cause: &Extension, value: f64) -> Vec<f64> {
        let mut values = vec![1.0; model.symbols.len()];
        values[model.positions(cause)[0]] = value;
        values
    }

    /// A clock cannot be ahead; a bias of the spacing may have either sign.
    #[test]
    fn only_what_cannot_be_negative_counts() {
        let least = |name: &str, value: f64| {
            let (model, cause) = with(name);
            smallest(&model, &sized(&model, cause, value), &[cause])
        };
        assert_eq!([least("time_offset", -0.05), least("time_offset", 0.05)], [-0.05, 0.0]);
        assert_eq!(least("range_bias", -0.5), 0.0);
    }

    /// What has the right sign in windows only is no property of the car.
    #[test]
    fn a_wrong_sign_at_either_horizon_bars() {
        let (model, cause) = with("time_offset");
        let through = DriveLoss { bins: Vec::new(), rms: [1.0; 3], failures: 0, margin: 1.0 };
        let losses = || Losses { drives: vec![Some(through.clone())] };
        let entry = |value: f64| Entry {
            whole: Point { values: sized(&model, cause, value), loss: 0.0 },
            trained: losses(),
            folds: Vec::new(),
            held: losses(),
        };
        let judged = || Judged { gain: 0.1, interval: [0.05, 0.15], root: 0.1, in_set: true, checks: Vec::new() };
        let is_recommended = |drive: f64, window: f64| {
            let entries = [entry(drive), entry(window)];
            let asked = whole_drives(&Policy::DEFAULT, &model, &entries, &[cause], &[judged(), judged()]);
            asked.iter().all(|check| check.met)
        };
        assert!(is_recommended(0.05, 0.05));
        assert!(!is_recommended(-0.05, 0.05) && !is_recommended(0.05, -0.05));
    }
}
