//! The checks before a recommendation, with values and limits.

use super::evidence::Evidence;
use super::fit::{Entry, Fit, Judged};
use super::policy::Policy;
use super::{HORIZONS, Horizon};
use crate::extension::Extension;
use crate::judge::Check;

/// The checks of a model with more causes than `base`; `named` has the families of the named causes.
#[must_use]
pub fn checks(
    policy: &Policy,
    base: &Entry,
    entry: &Entry,
    evidence: &Evidence,
    named: &[&'static Extension],
) -> Vec<Check> {
    let added = entry.added(base);
    let whole = &evidence.gains[HORIZONS - 1];
    let is_named = |cause: &&&'static Extension| named.iter().any(|named| named.family() == cause.family());
    let share_named = added.iter().filter(is_named).count() as f64 / added.len().max(1) as f64;
    let excess = |name: &str, errors: f64, of: fn(&Judged) -> usize| {
        let [own, base] = [count(entry, of), count(base, of)];
        Check::at_most(name, own - base, errors * (own + base).max(1.0).sqrt())
    };
    vec![
        Check::at_least("share of its causes of named families", share_named, policy.named),
        Check::at_most("probability by chance", evidence.p, policy.chance),
        Check::at_least("gain over whole drives, in standard errors", whole.t, policy.whole_drives),
        Check::at_most(
            "largest size over smallest, over folds and horizons",
            spread(policy, entry, added),
            policy.spread,
        ),
        Check::at_most(
            "collisions on left-out drives",
            count(entry, |judged| judged.held.collisions()),
            policy.collisions,
        ),
        excess("collisions behind a car that stops gently, in excess of the base", policy.gentle_excess, |judged| {
            judged.gentle_stops
        }),
        excess("collisions behind a car that stops, in excess of the base", policy.excess, |judged| judged.stops),
        excess("close approaches in excess of the base", policy.excess, |judged| judged.too_close),
    ]
}

/// A count of a model over whole drives.
fn count(entry: &Entry, of: impl Fn(&Judged) -> usize) -> f64 {
    let judged = entry.whole_drives().and_then(|fit| fit.judged.as_ref());
    judged.map_or(f64::INFINITY, |judged| of(judged) as f64)
}

/// The largest ratio of the sizes of the added causes over the longer horizons and the folds of whole drives; infinite if a sign changes or
/// all sizes of a cause are zero.
fn spread(policy: &Policy, entry: &Entry, added: &[&'static Extension]) -> f64 {
    let model = &entry.model;
    let fits = || entry.fits.iter().zip(Horizon::ALL).filter(|(_, horizon)| *horizon != Horizon::Step);
    let ratio = |k: usize| {
        let axis = &model.axes[k];
        let neutral = entry.neutral(k);
        let of = |(fit, horizon): (&Option<Fit>, Horizon)| {
            let folds =
                fit.iter().filter(move |_| horizon.is_whole()).flat_map(|fit| &fit.judged).flat_map(|j| &j.folds);
            fit.iter().map(|fit| &fit.whole).chain(folds).map(|values| values[k]).collect::<Vec<f64>>()
        };
        let all: Vec<f64> = fits().flat_map(of).collect();
        let is_none = |value: &f64| (axis.coordinate(*value) - axis.coordinate(neutral)).abs() < policy.none;
        if all.iter().all(is_none) {
            return None;
        }
        // The size of a limit is its value; all others count from the neutral value.
        let size = |value: &f64| if axis.log { *value } else { value - neutral };
        let range = all.iter().map(size).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let (least, most) = range;
        Some(if least * most > 0.0 { (most / least).max(least / most) } else { f64::INFINITY })
    };
    let largest = |ratios: &mut dyn Iterator<Item = f64>| ratios.max_by(f64::total_cmp).unwrap_or(f64::INFINITY);
    let of_cause = |cause: &&'static Extension| largest(&mut model.positions(cause).into_iter().filter_map(ratio));
    largest(&mut added.iter().map(of_cause))
}
