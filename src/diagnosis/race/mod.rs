//! The race: base, base with causes, and other laws, each fitted at several horizons and judged on the parts left out of its fits. One test
//! of all models decides names and the recommendation ([`Policy`]).
//!
//! With a correction towards the measurement within seconds, a model shows its reactions; free over whole drives, its value to the user.

mod answer;
mod evidence;
mod fit;
mod fleet;
pub mod loss;
mod mixture;
mod naming;
mod not_followed;
mod own;
mod parts;
mod policy;
mod reaction;
mod rule;
pub mod surface;

pub use answer::{Delivered, combine};
pub use evidence::{Evidence, Gain};
pub use fit::{Entry, Field, Fit, Judged};
pub use naming::{Alternative, Named};
pub use not_followed::{NotFollowed, without};
pub use parts::{Parts, Unit};
pub use policy::{Policy, rounds};

use crate::calibrate::Overrides;
use crate::catalog::{BASES, Base, Variant};
use crate::diagnose::likelihood::model::{LEAD, PHASE};
use crate::diagnose::{DiagnoseError, Drive, Progress, Watching};
use crate::extension::{Extension, Extensions};
use crate::judge::{Check, Resamples, mean};
use crate::result::diagnosis::recommended::{ClosedLoopEntry, HorizonGain, LawEntry, Power, Trial, TrialDrivers};
use evidence::{Rows, best_over_whole_drives, held, passed_over, table, trained};
use naming::{Sought, named, power, preferred, set};
use not_followed::stretches;
use rayon::prelude::*;
use rule::checks;
use std::ops::ControlFlow;

/// Number of horizons.
pub const HORIZONS: usize = 3;

/// Position of the horizon of names: with this correction a model predicts some seconds, so the gain comes from its reactions.
const OF_A_NAME: usize = 1;

/// Time over which a model predicts before the measurement corrects it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Horizon {
    /// Some seconds.
    Step,
    /// A quarter of a minute.
    Window,
    /// To the end of the drive.
    Drive,
}

impl Horizon {
    /// All horizons, the shortest first: the fits at one give the starts of the next.
    pub const ALL: [Horizon; HORIZONS] = [Horizon::Step, Horizon::Window, Horizon::Drive];
    /// The first of them: those with a correction.
    pub const CORRECTED: &'static [Horizon] = Horizon::ALL.split_at(HORIZONS - 1).0;

    /// Time constant of the correction \[s\]: about one reaction time, and several; `None` for whole drives.
    #[must_use]
    pub fn seconds(self) -> Option<f64> {
        match self {
            Horizon::Step => Some(2.0),
            Horizon::Window => Some(15.0),
            Horizon::Drive => None,
        }
    }

    /// True for whole drives, where NRMSE(s,v,a) is the loss. Elsewhere the loss is the mean logarithm of the squared errors of bins, so
    /// that the ratio of errors counts in each bin.
    #[must_use]
    pub fn is_whole(self) -> bool {
        self.seconds().is_none()
    }
}

/// The request for a race.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Whole measured drives.
    pub drives: &'a [Drive],
    /// What they are drives of.
    pub unit: Unit,
    /// The base law.
    pub base: Variant,
    /// Extensions in the race.
    pub causes: &'a [&'static Extension],
    /// Causes that the likelihood names: the race judges the model with them, and a recommended model has only members of their families.
    /// Without any, those of the race count.
    pub named: &'a [&'static Extension],
    /// Time that the acceleration lasts which the base misses \[s\], if the likelihood takes it for sensor noise. A model that filters the noise gains
    /// on unseen drives, too, so then the race names nothing.
    pub sensor_noise: Option<f64>,
    /// Bounds of parameters by name; they replace those of a diagnosis.
    pub bounds: &'a Overrides,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Largest number of rounds: the first finds a cause or a pair, each further one adds a cause.
    pub rounds: usize,
}

/// The answer of the race.
#[derive(Debug)]
pub struct Answer {
    /// The named causes, if any.
    pub named: Option<Named>,
    /// Causes that the likelihood names.
    likely: Vec<&'static Extension>,
    /// As in the request.
    sensor_noise: Option<f64>,
    /// Position of the recommended model among the entries; `None` if none is recommended.
    winner: Option<usize>,
    /// The base, and every model that was judged.
    entries: Vec<Entry>,
    /// Other laws on the same drives.
    pub laws: Vec<LawEntry>,
    /// Stretches that no model follows.
    pub not_followed: Vec<NotFollowed>,
    /// Causes of every model that cannot be distinguished from the best at the shorter horizons; for another law, its name.
    pub set: Vec<Vec<String>>,
    /// The gain that the drives could have shown, if the race names no cause.
    pub power: Option<Power>,
    /// All models that were tried.
    pub tried: ClosedLoopEntry,
    /// Simulated candidates, over one drive or part each.
    pub simulations: u64,
    /// False if the car hardly reacts to the car ahead, so that nothing can be named.
    pub reacts: bool,
    field: Field,
    resamples: Resamples,
}

impl Answer {
    /// The recommended causes; empty if none is recommended.
    #[must_use]
    pub fn recommended(&self) -> &[&'static Extension] {
        self.winner.map_or(&[], |k| &self.entries[k].causes)
    }

    /// Another law that predicts the drives better than the base with any cause: the confidence set consists of other laws. Of several, the
    /// one that gains most over whole drives.
    #[must_use]
    pub fn other_law(&self) -> Option<&LawEntry> {
        let law = |model: &Vec<String>| self.laws.iter().find(|law| *model == [law.name.as_str()]);
        let laws: Option<Vec<&LawEntry>> = self.set.iter().map(law).collect();
        laws?.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))
    }
}

/// True if a cause does not depend on a time of one drive.
fn lasts(cause: &Extension) -> bool {
    cause.parameters.iter().all(|symbol| symbol.neutral().is_some())
}

/// The sets of causes to try with a base: each cause that does not depend on a time of one drive, pairs that hide each other, and the named
/// causes.
fn sets(causes: &[&'static Extension], named: &[&'static Extension]) -> Vec<Vec<&'static Extension>> {
    let lasting: Vec<&'static Extension> =
        causes.iter().copied().filter(|cause| cause.name != LEAD && lasts(cause)).collect();
    let hides = |cause: &'static Extension| cause.cause.as_ref().and_then(|traits| traits.hides.as_deref());
    let hiding = |hidden: &'static Extension| {
        let others = lasting.iter().filter(move |other| hides(other) == Some(hidden.family()));
        others.map(move |other| vec![hidden, *other])
    };
    let pairs = lasting.iter().flat_map(|hidden| hiding(hidden));
    let mut sets: Vec<Vec<&'static Extension>> = lasting.iter().map(|cause| vec![*cause]).chain(pairs).collect();
    if named.iter().all(|cause| lasts(cause)) && !named.is_empty() && !sets.iter().any(|set| is_same(set, named)) {
        sets.push(named.to_vec());
    }
    sets
}

/// True for the same causes in any order.
fn is_same(a: &[&'static Extension], b: &[&'static Extension]) -> bool {
    a.len() == b.len() && a.iter().all(|cause| b.contains(cause))
}

fn names(causes: &[&'static Extension]) -> Vec<String> {
    causes.iter().map(|cause| cause.name.clone()).collect()
}

/// The models fitted before any cause is judged: the base, other laws, and the base with delays and lags. The best of them follows all
/// normal behaviour of the car. They are fitted at the horizons with a correction first, which show the stretches that none follows.
struct First {
    field: Field,
    base: Entry,
    laws: Vec<(String, Entry)>,
    late: Vec<Entry>,
}

impl First {
    /// Fits them to these drives.
    ///
    /// # Errors
    /// As [`Field::model`].
    fn fit(request: &Request<'_>, drives: &[Drive], watching: &Watching<'_>) -> Result<First, DiagnoseError> {
        let field = Field::new(Parts::of(drives, request.unit), request.bounds, request.seed);
        let base = field.law(request.base, watching)?;
        let others: Vec<&Base> = BASES.iter().filter(|law| **law != request.base.base).collect();
        let law = |law: &&Base| {
            let variant = Variant { base: **law, extensions: Extensions::NONE, ..request.base };
            // Leave out a law that cannot be fitted.
            Some((variant.name(), field.law(variant, watching).ok()?))
        };
        let laws = others.par_iter().filter_map(law).collect();
        watching.go_on()?;
        let is_late = |set: &Vec<&'static Extension>| matches!(&set[..], [cause] if cause.family() == PHASE);
        let late: Vec<Vec<&'static Extension>> = sets(request.causes, &[]).into_iter().filter(is_late).collect();
        let late = with_causes(&field, &base, &late, Vec::new(), Horizon::CORRECTED, watching)?;
        Ok(First { base, laws, late, field })
    }

    fn simulations(&self) -> u64 {
        let laws = self.laws.iter().map(|(_, entry)| entry);
        laws.chain(&self.late).chain([&self.base]).map(|entry| entry.simulations).sum()
    }

    /// Fits the same models at all horizons to these drives, from their present fits.
    ///
    /// # Errors
    /// As [`Field::model`].
    fn again(self, request: &Request<'_>, drives: &[Drive], watching: &Watching<'_>) -> Result<First, DiagnoseError> {
        let First { field, base, laws, late } = self;
        // A field holds all drives.
        drop(field);
        let field = Field::new(Parts::of(drives, request.unit), request.bounds, request.seed);
        let base = field.again(&base, None, watching)?;
        let law = |(name, entry): (String, Entry)| Some((name, field.again(&entry, None, watching).ok()?));
        let laws = laws.into_par_iter().filter_map(law).collect();
        let late = late.par_iter().map(|entry| field.again(entry, Some(&base), watching)).collect::<Result<_, _>>()?;
        Ok(First { base, laws, late, field })
    }

    /// Stretches of the drives that none of these models follows.
    fn not_followed(&self, drives: &[Drive], policy: &Policy) -> Vec<NotFollowed> {
        let laws = self.laws.iter().map(|(_, entry)| entry);
        stretches(drives, &self.field, laws.chain(&self.late).chain([&self.base]), policy)
    }
}

/// Stretches of the drives of a request that no model follows.
///
/// # Errors
/// As [`Field::model`].
pub fn not_followed(request: &Request<'_>, policy: &Policy) -> Result<Vec<NotFollowed>, DiagnoseError> {
    let mut silent = |_: Progress| ControlFlow::Continue(());
    Ok(First::fit(request, request.drives, &Watching::new(&mut silent))?.not_followed(request.drives, policy))
}

/// Runs the race.
///
/// # Errors
/// As [`Field::model`]; [`DiagnoseError::Stopped`] when `progress` breaks.
pub fn race(
    request: &Request<'_>,
    policy: &Policy,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Answer, DiagnoseError> {
    let watching = Watching::new(progress);
    if request.unit == Unit::Driver {
        let field = Field::new(Parts::of(request.drives, request.unit), request.bounds, request.seed);
        let answer = unjudged(request, policy, field, Vec::new(), 0);
        if answer.tried.not_testable.is_some() {
            return Ok(answer);
        }
    }
    watching.show(0.0, "fitting the base and other laws")?;
    let first = First::fit(request, request.drives, &watching)?;
    let not_followed = first.not_followed(request.drives, policy);
    let simulations = first.simulations();
    watching.show(0.15, "the same over whole drives, without stretches that no model follows")?;
    let First { field, mut base, laws, late } =
        first.again(request, &without(request.drives, &not_followed, policy), &watching)?;
    let mut answer = unjudged(request, policy, field, not_followed, simulations);
    if answer.tried.not_testable.is_some() {
        return Ok(answer);
    }
    watching.show(0.25, "the base on unseen drives")?;
    answer.field.judge(&mut base, None, &watching)?;
    answer.simulations += base.simulations;
    if held(&base).is_none() {
        answer.tried.not_testable =
            Some(format!("{}: no parameters were found that complete the drives", request.base));
        return Ok(answer);
    }
    // The bins of a short recording are too few to judge that; a wrong car ahead of one car makes the base unsuitable anyway.
    if request.unit == Unit::Driver {
        answer.judge_reaction(request, &base, policy, &watching)?;
    }
    answer.entries.push(base);
    if !answer.reacts {
        return Ok(answer);
    }
    watching.show(0.3, "other laws on unseen drives")?;
    let others = judged(&mut answer, laws, &watching)?;
    let mut late = Some(late);
    let mut share = 0.4;
    for _ in 0..request.rounds {
        watching.show(share, "every cause on unseen drives")?;
        let known = late.take().unwrap_or_default();
        let found = round(&mut answer, request, policy, &others, known, share, &watching)?;
        share += 0.3;
        if !found {
            break;
        }
    }
    Ok(answer)
}

/// An answer before any model is judged; it says so if these parts cannot tell models apart.
fn unjudged(
    request: &Request<'_>,
    policy: &Policy,
    field: Field,
    not_followed: Vec<NotFollowed>,
    simulations: u64,
) -> Answer {
    let bins: Vec<usize> = field.sizes.iter().map(loss::Sizes::count).collect();
    let units: Vec<usize> =
        field.parts.units.iter().zip(&bins).flat_map(|(unit, bins)| std::iter::repeat_n(*unit, *bins)).collect();
    let resamples = match request.unit {
        Unit::Recording => Resamples::new(&bins, policy.block_s / loss::BIN_S, policy.resamples, request.seed),
        Unit::Driver => Resamples::of_units(&units, policy.resamples, request.seed),
    };
    let count: usize = bins.iter().sum();
    let tried = ClosedLoopEntry {
        bins: count,
        parts: [field.parts.drives.len(), field.parts.count],
        policy: serde_json::to_value(policy).unwrap_or_default(),
        not_testable: too_few(&field.parts, count, request.unit, policy),
        ..ClosedLoopEntry::default()
    };
    Answer {
        named: None,
        likely: request.named.to_vec(),
        sensor_noise: request.sensor_noise,
        winner: None,
        entries: Vec::new(),
        laws: Vec::new(),
        not_followed,
        set: Vec::new(),
        power: None,
        tried,
        simulations,
        reacts: true,
        field,
        resamples,
    }
}

/// Why parts with this number of bins cannot tell models apart, if they cannot.
fn too_few(parts: &Parts, bins: usize, unit: Unit, policy: &Policy) -> Option<String> {
    let least = policy.least_bins;
    let drivers = parts.unit_count();
    match unit {
        Unit::Recording if bins < least || parts.count < 2 => Some(format!(
            "the drives have {bins} bins of 10 s in {} folds, at least {least} in 2 are needed: give more or longer drives",
            parts.count
        )),
        Unit::Driver if drivers < least => Some(format!(
            "a fleet needs at least {least} drivers, found {drivers}: give more, or diagnose each driver alone"
        )),
        _ => None,
    }
}

/// The other laws, judged.
fn judged(
    answer: &mut Answer,
    laws: Vec<(String, Entry)>,
    watching: &Watching<'_>,
) -> Result<Vec<(String, Rows)>, DiagnoseError> {
    let (field, base) = (&answer.field, &answer.entries[0]);
    let judged = |(name, mut entry): (String, Entry)| {
        field.judge(&mut entry, None, watching)?;
        Ok((name, entry.simulations, held(&entry)))
    };
    let all: Vec<(String, u64, Option<Rows>)> =
        laws.into_par_iter().map(judged).collect::<Result<_, DiagnoseError>>()?;
    let own = held(base).map_or(f64::NAN, |rows| mean(&rows[HORIZONS - 1]));
    answer.simulations += all.iter().map(|(_, simulations, _)| simulations).sum::<u64>();
    let all: Vec<(String, Rows)> = all.into_iter().filter_map(|(name, _, rows)| Some((name, rows?))).collect();
    let entry =
        |(name, rows): &(String, Rows)| LawEntry { name: name.clone(), gain: 1.0 - mean(&rows[HORIZONS - 1]) / own };
    answer.laws = all.iter().map(entry).collect();
    answer.laws.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(all)
}

/// Models with more causes than `own`, in the order of the sets; those in `known` are taken unchanged. Single causes come first, because
/// the fit of a pair also starts from those of its causes.
fn with_causes(
    field: &Field,
    own: &Entry,
    sets: &[Vec<&'static Extension>],
    known: Vec<Entry>,
    horizons: &[Horizon],
    watching: &Watching<'_>,
) -> Result<Vec<Entry>, DiagnoseError> {
    let mut all = known;
    for is_single in [true, false] {
        let is_new = |set: &&Vec<&'static Extension>| {
            (set.len() == 1) == is_single && !all.iter().any(|entry| entry.added(own) == &set[..])
        };
        let new: Vec<&Vec<&'static Extension>> = sets.iter().filter(is_new).collect();
        let one = |set: &&Vec<&'static Extension>| {
            let parts: Vec<&Entry> = all
                .iter()
                .filter(|entry| matches!(entry.added(own), [part] if set.len() > 1 && set.contains(part)))
                .collect();
            field.with_causes(own, set, &parts, horizons, watching)
        };
        let found: Vec<Option<Entry>> = new.par_iter().map(one).collect::<Result<_, DiagnoseError>>()?;
        all.extend(found.into_iter().flatten());
    }
    all.sort_by_key(|entry| sets.iter().position(|set| entry.added(own) == &set[..]));
    Ok(all)
}

/// One round: tests all causes against the present model; some are fitted already. True if one of them is recommended.
fn round(
    answer: &mut Answer,
    request: &Request<'_>,
    policy: &Policy,
    laws: &[(String, Rows)],
    known: Vec<Entry>,
    done: f64,
    watching: &Watching<'_>,
) -> Result<bool, DiagnoseError> {
    let (field, own) = (&answer.field, &answer.entries[answer.winner.unwrap_or(0)]);
    let reference = held(own).expect("what causes are added to is judged");
    let is_first = own.causes.is_empty();
    let new = |set: &Vec<&'static Extension>| {
        set.iter().all(|cause| !own.causes.contains(cause)) && (is_first || set.len() == 1)
    };
    let sets: Vec<Vec<&'static Extension>> = sets(request.causes, request.named).into_iter().filter(new).collect();
    let mut entered = with_causes(field, own, &sets, known, &Horizon::ALL, watching)?;
    watching.show(done + 0.2, "judging causes on unseen drives")?;
    let is_worth =
        |entry: &&mut Entry| entry.is_worth(own, policy.worth_trying) || is_same(&entry.causes, request.named);
    let worth = entered.par_iter_mut().filter(is_worth);
    worth.try_for_each(|entry| field.judge(entry, Some(&answer.entries[0]), watching))?;
    answer.simulations += entered.iter().map(|entry| entry.simulations).sum::<u64>();
    let in_training = trained(own);
    let left: Vec<Rows> = entered
        .iter()
        .filter(|entry| held(entry).is_none())
        .filter_map(|entry| passed_over(in_training.as_ref()?, entry))
        .collect();
    entered.retain(|entry| held(entry).is_some());
    let models: Vec<Rows> = entered.iter().filter_map(held).collect();
    let others: Vec<Rows> = laws.iter().map(|(_, rows)| rows.clone()).collect();
    let found = table(&reference, &models, &left, &others, &answer.resamples, policy);
    let first = answer.entries.len();
    let called = |sought: Sought<'_>| match request.sensor_noise {
        None => named(&entered, &found, policy, sought, (first, request.seed)),
        Some(_) => None,
    };
    let of_race = called(Sought::Support);
    let causes = match &of_race {
        Some(named) if request.named.is_empty() => &named.causes,
        _ => request.named,
    };
    let asked: Vec<Vec<Check>> =
        entered.iter().zip(&found.rows).map(|(entry, evidence)| checks(policy, own, entry, evidence, causes)).collect();
    for ((entry, evidence), checks) in entered.iter().zip(&found.rows).zip(&asked) {
        answer.tried.trials.push(trial(entry, evidence, checks, request.seed));
    }
    if is_first {
        answer.set = set(&entered, &found, laws);
        // More driving does not turn noise into a name.
        let can_name = of_race.is_none() && request.sensor_noise.is_none();
        answer.power = power(&entered, &found, answer.tried.bins, policy).filter(|_| can_name);
    }
    // The next round tests whether a further cause is worth its parameters.
    let passing: Vec<usize> = (0..entered.len()).filter(|&k| asked[k].iter().all(|check| check.met)).collect();
    let rows: Vec<&Rows> = passing.iter().map(|&k| &models[k]).collect();
    let is_best = best_over_whole_drives(&rows, &answer.resamples, policy);
    let gain = |k: usize| found.rows[k].gains[HORIZONS - 1].share;
    let best = passing.into_iter().zip(is_best).filter(|(_, is_best)| *is_best).map(|(k, _)| k);
    let best = best.min_by(|&a, &b| preferred(&entered, own, causes, &gain, a, b));
    let named = called(Sought::Name(best.map_or(&[], |k| entered[k].added(own))));
    match (&mut answer.named, named) {
        // The sizes of all causes are those of the larger model.
        (Some(so_far), Some(more)) => {
            let keeps_all = so_far.causes.iter().all(|cause| more.causes.contains(cause));
            if keeps_all && more.causes.len() > so_far.causes.len() {
                let is_new = |rival: &Alternative| !so_far.causes.contains(&rival.of);
                so_far.rivals.extend(more.rivals.into_iter().filter(is_new));
                (so_far.causes, so_far.entry) = (more.causes, more.entry);
            }
        }
        (so_far, named) => *so_far = so_far.take().or(named),
    }
    answer.entries.extend(entered);
    answer.winner = best.map(|k| first + k).or(answer.winner);
    Ok(best.is_some())
}

/// A model in the list of those tried.
fn trial(entry: &Entry, evidence: &Evidence, checks: &[Check], seed: u64) -> Trial {
    let gains = Horizon::ALL.iter().zip(&evidence.gains).map(|(horizon, gain)| HorizonGain {
        horizon_s: horizon.seconds(),
        gain: gain.share,
        interval: gain.interval,
        standard_errors: gain.t,
    });
    Trial {
        causes: names(&entry.causes),
        gain: evidence.gains[HORIZONS - 1].share,
        horizons: gains.collect(),
        standard_errors: evidence.t,
        probability: evidence.p,
        in_set: evidence.in_set,
        checks: checks.to_vec(),
        passes: checks.iter().all(|check| check.met),
        drivers: entry.mixture().zip(entry.share_interval(seed)).map(|(mixture, interval)| TrialDrivers {
            share: mixture.share,
            interval,
            size: mixture.size(),
        }),
    }
}

#[cfg(test)]
mod tests;
