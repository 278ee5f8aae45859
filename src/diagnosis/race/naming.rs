//! Names: the families of causes that all models have in common that follow the drives as well as the best.

use super::evidence::{Rows, Table};
use super::fit::Entry;
use super::policy::Policy;
use super::{OF_A_NAME, loss, names};
use crate::extension::Extension;
use crate::result::diagnosis::recommended::Power;
use std::cmp::Ordering;
use std::collections::BTreeSet;

/// A cause that explains the drives as well as a named one.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// The named cause.
    pub of: &'static Extension,
    /// The cause in its place.
    pub cause: &'static Extension,
    /// Position of a model with it among the entries.
    pub(crate) entry: usize,
}

/// The names: the families that all models indistinguishable from the best have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// Causes of the best model, of these families, whose intervals exclude no effect.
    pub causes: Vec<&'static Extension>,
    /// Alternatives in other models.
    pub rivals: Vec<Alternative>,
    /// The gain of the best model in standard errors, and the probability of at least this gain by chance.
    pub evidence: [f64; 2],
    /// The position of the best model among the entries.
    pub(crate) entry: usize,
}

/// The gain that this number of bins could have shown.
pub fn power(entered: &[Entry], table: &Table, bins: usize, policy: &Policy) -> Option<Power> {
    let [needed, gain] = table.found;
    let best = (0..entered.len()).max_by(|&a, &b| table.rows[a].t.total_cmp(&table.rows[b].t))?;
    let (t, minutes) = (table.rows[best].t, bins as f64 * loss::BIN_S / 60.0);
    // Standard errors fall with the square root of the time.
    let more = minutes * ((needed / t).powi(2) - 1.0);
    // A large gain fails for another reason than too little driving.
    (gain <= policy.most_power && t < needed).then(|| Power {
        gain,
        causes: names(&entered[best].causes),
        minutes: (t >= 1.0).then_some(more.max(0.0)),
    })
}

/// The causes of every model that cannot be distinguished from the best.
pub fn set(entered: &[Entry], table: &Table, laws: &[(String, Rows)]) -> Vec<Vec<String>> {
    let Some(set) = table.sets.first() else { return Vec::new() };
    let own = entered.iter().zip(&set.models).filter(|(_, in_set)| **in_set).map(|(entry, _)| names(&entry.causes));
    let reference = set.reference.then(Vec::new);
    let others = laws.iter().zip(&set.laws).filter(|(_, in_set)| **in_set).map(|((name, _), _)| vec![name.clone()]);
    own.chain(reference).chain(others).collect()
}

/// What is sought: causes that may be recommended, or a name beside a recommended model. A cause on a bound only stretches the law, so it has
/// no name, but may follow unseen drives better.
#[derive(Debug, Clone, Copy)]
pub enum Sought<'a> {
    /// Causes that may be recommended.
    Support,
    /// Names, beside a model with these causes.
    Name(&'a [&'static Extension]),
}

/// The families common to all models with causes that cannot be distinguished from the best at a horizon, provided that the reference can
/// be distinguished; of these, as many as a model has that beats the reference by more than chance.
pub fn named(
    entered: &[Entry],
    table: &Table,
    policy: &Policy,
    sought: Sought<'_>,
    (first, seed): (usize, u64),
) -> Option<Named> {
    // A cause counts where its interval excludes no effect.
    let counts = |k: usize, cause: &'static Extension, horizons: &[usize]| {
        horizons.iter().any(|&horizon| entered[k].excludes_neutral(cause, horizon))
    };
    let has = |k: usize, family: &str, horizons: &[usize]| {
        entered[k].causes.iter().any(|cause| cause.family() == family && counts(k, cause, horizons))
    };
    let (mut families, mut members): (Vec<&str>, Vec<usize>) = (Vec::new(), Vec::new());
    for set in table.sets.iter().filter(|set| !set.reference) {
        let own: Vec<usize> = (0..entered.len()).filter(|&k| set.models[k]).collect();
        let Some(&any) = own.first() else { continue };
        let of_any = entered[any].causes.iter().map(|cause| cause.family());
        families.extend(of_any.filter(|family| own.iter().all(|k| has(*k, family, set.horizons))));
        members.extend(own);
    }
    families.sort_unstable();
    families.dedup();
    members.sort_unstable();
    members.dedup();
    let gains = |k: usize| {
        let row = &table.rows[k];
        // Some drivers have the cause beyond doubt, and the limit applies to them.
        let drivers = entered[k].mixture().zip(entered[k].share_interval(seed));
        let (share, least) = drivers.map_or((1.0, 1.0), |(mixture, [least, _])| (mixture.share, least));
        row.p <= policy.chance_of_a_name && least > 0.0 && row.gains[OF_A_NAME].share >= policy.least_gain * share
    };
    let recommended = if let Sought::Name(recommended) = sought { recommended } else { &[] };
    let may_be_on_bound = matches!(sought, Sought::Support);
    let has_size = |k: usize, cause| {
        counts(k, cause, &[OF_A_NAME]) && (may_be_on_bound || !entered[k].is_on_bound(cause, OF_A_NAME))
    };
    let is_named = |k: usize, cause: &'static Extension| has_size(k, cause) && families.contains(&cause.family());
    let causes_of =
        |k: usize| entered[k].causes.iter().copied().filter(|cause| is_named(k, cause)).collect::<Vec<&Extension>>();
    let count = |k: usize| causes_of(k).iter().map(|cause| cause.family()).collect::<BTreeSet<&str>>().len();
    let evidence = |k: usize| -table.rows[k].t;
    let is_recommended = |k: usize| recommended.iter().all(|cause| entered[k].causes.contains(cause));
    // Evidence and sizes are those of one of the best models, and of one without other causes, if there is one.
    let merits =
        |k: usize| (count(k), members.contains(&k), causes_of(k).len() == entered[k].causes.len(), is_recommended(k));
    let order = |a: usize, b: usize| {
        merits(b).cmp(&merits(a)).then(simplest(entered, a, b)).then(evidence(a).total_cmp(&evidence(b)))
    };
    let best = (0..entered.len()).filter(|&k| count(k) > 0 && gains(k)).min_by(|&a, &b| order(a, b))?;
    let row = &table.rows[best];
    let causes = causes_of(best);
    let mut rivals: Vec<Alternative> = Vec::new();
    for &of in &causes {
        let all = members.iter().flat_map(|&k| entered[k].causes.iter().map(move |cause| (k, *cause)));
        for (k, cause) in all.filter(|(k, cause)| cause.family() == of.family() && *cause != of && has_size(*k, cause))
        {
            if !rivals.iter().any(|rival| (rival.of, rival.cause) == (of, cause)) {
                rivals.push(Alternative { of, cause, entry: first + k });
            }
        }
    }
    Some(Named { causes, rivals, evidence: [row.t, row.p], entry: first + best })
}

/// The order in which models with more causes than `base` are recommended: the fewest parameters first, then those of named causes, whose
/// reactions gain, too, then the largest gain.
pub fn preferred(
    entered: &[Entry],
    base: &Entry,
    named: &[&'static Extension],
    gain: &dyn Fn(usize) -> f64,
    a: usize,
    b: usize,
) -> Ordering {
    let is_named = |k: usize| entered[k].added(base).iter().all(|cause| named.contains(cause));
    simplest(entered, a, b).then(is_named(b).cmp(&is_named(a))).then(gain(b).total_cmp(&gain(a)))
}

/// The fewest parameters first.
fn simplest(entered: &[Entry], a: usize, b: usize) -> Ordering {
    let count = |k: usize| entered[k].causes.iter().map(|cause| cause.parameters.len()).sum::<usize>();
    count(a).cmp(&count(b))
}
