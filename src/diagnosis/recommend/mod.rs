//! Which extension follows drives better that a model was not calibrated on, and by how much.
//!
//! Every model is fitted in closed loop and judged on what was left out of its fits. One test for all decides
//! ([`Policy`]), and only what comes through whole drives is recommended. The likelihood of a diagnosis asks another question: which
//! cause is in the data.

mod answer;
mod not_followed;
mod parts;
mod policy;
mod race;
mod rule;

pub use answer::combine;
pub use not_followed::{NotFollowed, not_followed, without};
pub use parts::Parts;
pub use policy::{Policy, races};

use crate::calibrate::Overrides;
use crate::catalog::{BASES, Base, Variant};
use crate::closed_loop::{ClosedLoop, Horizon, Losses, Point};
use crate::diagnose::likelihood::model::LEAD;
use crate::diagnose::{DiagnoseError, Drive, Progress};
use crate::extension::{Extension, Extensions};
use crate::judge::{Check, Resamples, confidence_set, mean, step_down, superior_predictive_ability};
use crate::result::diagnosis::recommended::{ClosedLoopEntry, LawEntry, Trial};
use crate::wgsl::extension_named;
use race::{Course, Entry, Runner};
use rayon::prelude::*;
use rule::{Judged, as_share, checks, differences, least, root_share, whole_drives};
use std::ops::ControlFlow;

/// What is asked.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Measured drives, whole.
    pub drives: &'a [Drive],
    /// The law that is examined.
    pub base: Variant,
    /// Extensions in the race.
    pub causes: &'a [&'static Extension],
    /// Bounds of parameters by name, instead of those of a diagnosis.
    pub bounds: &'a Overrides,
    /// Decides all random numbers.
    pub seed: u64,
    /// Races at most: the first finds a cause or a pair, each further one a cause more.
    pub rounds: usize,
}

/// A model that passes, with everything that is known of it.
#[derive(Debug)]
pub struct Winner {
    /// Its causes, in the order in which they were found.
    pub causes: Vec<&'static Extension>,
    model: ClosedLoop,
    /// Fits at both horizons, in the order of [`Horizon`].
    entries: [Entry; 2],
    /// Where it passes: whole drives, or else windows.
    horizon: Horizon,
    /// Causes of each model that cannot be told from the best one.
    set: Vec<Vec<String>>,
}

/// The answer.
#[derive(Debug)]
pub struct Answer {
    /// What to calibrate with; `None` where the base follows unseen drives as well.
    pub recommended: Option<Winner>,
    /// Causes that pass at one horizon and are not recommended.
    pub helps: Vec<Vec<&'static Extension>>,
    /// The base at both horizons, in the order of [`Horizon`]; `None` where nothing could be fitted.
    base: Option<(ClosedLoop, [Entry; 2])>,
    /// The base with the nuisance lead, likewise.
    ahead: Option<[Entry; 2]>,
    /// Other laws on the same drives.
    pub laws: Vec<LawEntry>,
    /// What was tried.
    pub tried: ClosedLoopEntry,
    /// Simulated candidates, over one drive or part each.
    pub simulations: u64,
    course: Course,
    resamples: [Resamples; 2],
}

/// Everything that is tried with a base: each cause whose size does not depend on a time of one drive, and pairs that hide each other.
fn sets(causes: &[&'static Extension]) -> Vec<Vec<&'static Extension>> {
    let lasting: Vec<&'static Extension> = causes
        .iter()
        .copied()
        .filter(|cause| cause.parameters.iter().all(|symbol| symbol.neutral().is_some()))
        .collect();
    let hides = |cause: &'static Extension| cause.cause.as_ref().and_then(|traits| traits.hides.as_deref());
    let hiding = |hidden: &'static Extension| {
        let others = lasting.iter().filter(move |other| hides(other) == Some(hidden.family()));
        others.map(move |other| vec![hidden, *other])
    };
    let pairs = lasting.iter().flat_map(|hidden| hiding(hidden));
    lasting.iter().map(|cause| vec![*cause]).chain(pairs).collect()
}

fn names(causes: &[&'static Extension]) -> Vec<String> {
    causes.iter().map(|cause| cause.name.clone()).collect()
}

/// Runs the race.
///
/// # Errors
/// As [`ClosedLoop::new`]; [`DiagnoseError::Stopped`] when `progress` breaks.
pub fn recommend(
    request: &Request<'_>,
    policy: &Policy,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Answer, DiagnoseError> {
    let mut show = |done: f64, stage: &str| match progress(Progress { done, stage: stage.to_owned() }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(DiagnoseError::Stopped),
    };
    let course = Course::new(request.drives, request.bounds, request.seed);
    let base = course.closed_loop(request.base)?;
    let bins = Horizon::ALL.map(|horizon| base.layouts(horizon).iter().map(|layout| layout.count).collect::<Vec<_>>());
    let resamples = [&bins[1], &bins[0]].map(|bins| {
        let block = policy.block_s / crate::closed_loop::BIN_S;
        Resamples::new(bins, block, policy.resamples, request.seed)
    });
    let count = |k: usize| bins[k].iter().sum::<usize>();
    let tried = ClosedLoopEntry {
        bins: [count(0), count(1)],
        parts: [course.parts.drives.len(), course.parts.count],
        policy: serde_json::to_value(policy).unwrap_or_default(),
        ..ClosedLoopEntry::default()
    };
    let mut answer = Answer {
        recommended: None,
        helps: Vec::new(),
        base: None,
        ahead: None,
        laws: Vec::new(),
        tried,
        simulations: 0,
        course,
        resamples,
    };
    if count(0).min(count(1)) < policy.least_bins || answer.course.parts.count < 2 {
        answer.tried.not_testable = Some(format!(
            "the drives have {} bins of 10 s in {} folds, at least {} in 2 are needed: give more or longer drives",
            count(0).min(count(1)),
            answer.course.parts.count,
            policy.least_bins
        ));
        return Ok(answer);
    }
    show(0.0, "closed loop: fitting the base")?;
    let Some(entries) = law(&answer.course, &base)? else {
        answer.tried.not_testable = Some(format!("{}: no parameters were found with which it drives", request.base));
        return Ok(answer);
    };
    answer.simulations += base.simulations();
    answer.ahead = ahead(&mut answer, (&base, &entries))?;
    answer.base = Some((base, entries));
    show(0.1, "closed loop: other laws")?;
    let others = laws(&mut answer, request)?;
    let mut share = 0.2;
    for _ in 0..request.rounds {
        show(share, "closed loop: every cause on unseen drives")?;
        let found = round(&mut answer, request, policy, &others, &mut |part, stage| show(share + 0.4 * part, stage))?;
        share += 0.4;
        if !found {
            break;
        }
    }
    Ok(answer)
}

/// A law at both horizons; whole drives begin where windows led.
fn law(course: &Course, model: &ClosedLoop) -> Result<Option<[Entry; 2]>, DiagnoseError> {
    let (mut known, mut found) = (Vec::new(), Vec::new());
    for horizon in Horizon::ALL {
        let Some(point) = course.law(model, horizon, &known)? else { return Ok(None) };
        known.push(point.values.clone());
        let Some(entry) = course.entry(model, horizon, point)? else { return Ok(None) };
        found.push(entry);
    }
    let [window, drive] = found.try_into().expect("both horizons");
    Ok(Some([drive, window]))
}

/// The base with the lead that stands for the finer steps of a real car. An extension must not be recommended for what it makes up of them.
fn ahead(
    answer: &mut Answer,
    (model, entries): (&ClosedLoop, &[Entry; 2]),
) -> Result<Option<[Entry; 2]>, DiagnoseError> {
    let Some(lead) = extension_named(LEAD) else { return Ok(None) };
    let Some(Runner { added, model: led }) = answer.course.runners(model.model.variant, &[vec![lead]]).pop() else {
        return Ok(None);
    };
    let at = |horizon: Horizon| -> Result<Option<Entry>, DiagnoseError> {
        let from = (&model.model, entries[horizon as usize].whole.values.as_slice());
        let found = answer.course.with_cause(&led, horizon, from, &added, &[])?;
        Ok(found.map(|point| answer.course.entry(&led, horizon, point)).transpose()?.flatten())
    };
    let found = at(Horizon::Drive)?.zip(at(Horizon::Window)?);
    answer.simulations += led.simulations();
    Ok(found.map(|(drive, window)| [drive, window]))
}

/// The other laws with the same delay, dynamics and constraint, at both horizons.
fn laws(answer: &mut Answer, request: &Request<'_>) -> Result<Vec<[Entry; 2]>, DiagnoseError> {
    let course = &answer.course;
    let others: Vec<&Base> = BASES.iter().filter(|base| **base != request.base.base).collect();
    let fitted = |base: &&Base| {
        let variant = Variant { base: **base, extensions: Extensions::NONE, ..request.base };
        let Ok(model) = course.closed_loop(variant) else { return Ok(None) };
        // A law that cannot be had costs nothing but itself.
        let entries = law(course, &model).ok().flatten();
        Ok(entries.map(|entries| (variant, entries, model.simulations())))
    };
    let found: Vec<_> = others.par_iter().map(fitted).collect::<Result<_, DiagnoseError>>()?;
    let (_, own) = answer.base.as_ref().expect("the base is fitted first");
    let root = |entry: &Entry| mean(&entry.held.roots());
    let mut all = Vec::new();
    for (variant, entries, simulations) in found.into_iter().flatten() {
        answer.laws.push(LawEntry { name: variant.name(), gain: 1.0 - root(&entries[0]) / root(&own[0]) });
        answer.simulations += simulations;
        all.push(entries);
    }
    answer.laws.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(all)
}

/// A model that was fitted, at both horizons in the order of [`Horizon`].
enum Entered {
    /// Fitted fold by fold, and judged.
    Judged([Entry; 2]),
    /// Not worth that: its losses in training.
    Trained([Losses; 2]),
}

/// What is tried, at both horizons in the order of [`Horizon`]: fits and judgements.
struct Tried {
    runner: Runner,
    entries: [Entry; 2],
    judged: [Judged; 2],
}

/// One race: all causes against the model so far. True if one of them is recommended.
fn round(
    answer: &mut Answer,
    request: &Request<'_>,
    policy: &Policy,
    laws: &[[Entry; 2]],
    show: &mut dyn FnMut(f64, &str) -> Result<(), DiagnoseError>,
) -> Result<bool, DiagnoseError> {
    let (so_far, own): (Vec<&'static Extension>, (&ClosedLoop, &[Entry; 2])) = match (&answer.recommended, &answer.base)
    {
        (Some(winner), _) => (winner.causes.clone(), (&winner.model, &winner.entries)),
        (None, Some((model, entries))) => (Vec::new(), (model, entries)),
        (None, None) => return Ok(false),
    };
    let new = |set: &Vec<&'static Extension>| {
        set.iter().all(|cause| !so_far.contains(cause)) && (so_far.is_empty() || set.len() == 1)
    };
    let sets: Vec<_> = sets(request.causes).into_iter().filter(new).collect();
    let runners = answer.course.runners(own.0.model.variant, &sets);
    // What everything is compared with: the base, or the base with a lead, whichever follows unseen drives better.
    let reference = [0, 1].map(|k| match answer.ahead.as_ref().filter(|_| so_far.is_empty()) {
        Some(ahead) if ahead[k].held.log() < own.1[k].held.log() => &ahead[k],
        _ => &own.1[k],
    });
    let worth = -2.0 * (1.0 - policy.worth_trying).ln();
    let mut found: Vec<Vec<Option<Point>>> = Vec::new();
    for (k, horizon) in Horizon::ALL.into_iter().enumerate() {
        let known = found.first().map_or(&[][..], Vec::as_slice);
        found.push(answer.course.race((own.0, &own.1[horizon as usize].whole), horizon, &runners, known)?);
        show(0.4 * (k + 1) as f64, "closed loop: every cause on unseen drives")?;
    }
    let (drive, window) = (found.pop().expect("both"), found.pop().expect("both"));
    // What gains next to nothing where it was fitted, at either horizon, gains less elsewhere.
    let is_worth = |point: &Option<Point>, own: &Entry| point.as_ref().is_some_and(|p| own.whole.loss - p.loss > worth);
    let fitted = runners.into_par_iter().zip(drive.into_par_iter().zip(window)).map(|(runner, (drive, window))| {
        let tried = is_worth(&drive, reference[0]) || is_worth(&window, reference[1]);
        let (Some(drive), Some(window)) = (drive, window) else { return Ok((runner.model.simulations(), None)) };
        let entered = if tried {
            let drive = answer.course.entry(&runner.model, Horizon::Drive, drive)?;
            let window = answer.course.entry(&runner.model, Horizon::Window, window)?;
            drive.zip(window).map(|(drive, window)| Entered::Judged([drive, window]))
        } else {
            let on = |horizon, point: Point| answer.course.trained(&runner.model, horizon, &point);
            Some(Entered::Trained([on(Horizon::Drive, drive)?, on(Horizon::Window, window)?]))
        };
        Ok((runner.model.simulations(), entered.map(|entered| (runner, entered))))
    });
    let (simulations, fitted): (Vec<u64>, Vec<_>) =
        fitted.collect::<Result<Vec<_>, DiagnoseError>>()?.into_iter().unzip();
    let (mut ran, mut left) = (Vec::new(), Vec::new());
    for (runner, entered) in fitted.into_iter().flatten() {
        match entered {
            Entered::Judged(entries) => ran.push((runner, entries)),
            Entered::Trained(losses) => left.push(losses),
        }
    }
    let [(on_drives, over_drives), (on_windows, over_windows)] = [Horizon::Drive, Horizon::Window].map(|horizon| {
        let k = horizon as usize;
        let entries: Vec<&Entry> = ran.iter().map(|(_, entries)| &entries[k]).collect();
        let laws = laws.iter().map(|entries| &entries[k].held).collect();
        let left = left.iter().map(|losses| &losses[k]).collect();
        let field = Field { so_far: reference[k], left, laws };
        judged(policy, &field, &ran, &entries, &answer.resamples[k])
    });
    answer.simulations += simulations.iter().sum::<u64>();
    if so_far.is_empty() && !ran.is_empty() {
        answer.tried.superior = Some([over_windows, over_drives]);
    }
    let tried: Vec<Tried> = ran
        .into_iter()
        .zip(on_drives.into_iter().zip(on_windows))
        .map(|((runner, entries), (drive, window))| Tried { runner, entries, judged: [drive, window] })
        .collect();
    let whole: Vec<Vec<Check>> = tried
        .iter()
        .map(|t| whole_drives(policy, &t.runner.model.model, &t.entries, &t.runner.added, &t.judged))
        .collect();
    for (t, whole) in tried.iter().zip(&whole) {
        answer.tried.trials.extend(trials(&so_far, t, whole));
    }
    let mut passing: Vec<usize> = (0..tried.len()).filter(|&k| tried[k].judged.iter().any(Judged::passes)).collect();
    passing.sort_by(|&a, &b| score(&tried[b]).total_cmp(&score(&tried[a])));
    let best = passing.iter().copied().find(|&k| whole[k].iter().all(|check| check.met));
    if so_far.is_empty() && best.is_none() {
        answer.helps = passing.iter().map(|&k| tried[k].runner.added.clone()).collect();
    }
    let Some(best) = best else { return Ok(false) };
    let horizon = if tried[best].judged[0].passes() { Horizon::Drive } else { Horizon::Window };
    let like = |t: &&Tried| t.judged[horizon as usize].in_set;
    let set = tried.iter().filter(like).map(|t| names(&[&so_far[..], &t.runner.added].concat())).collect();
    let Tried { runner, entries, .. } = tried.into_iter().nth(best).expect("one of them");
    let causes = [so_far, runner.added].concat();
    answer.recommended = Some(Winner { causes, model: runner.model, entries, horizon, set });
    Ok(true)
}

/// What a model is chosen by: the gain that holds for both losses at both horizons.
fn score(tried: &Tried) -> f64 {
    least(&tried.judged[0], &tried.judged[1])
}

/// Whom the models of a race run against.
struct Field<'a> {
    /// The model so far, or the base with the lead.
    so_far: &'a Entry,
    /// The losses in training of the models that were not worth a judgement.
    left: Vec<&'a Losses>,
    /// The losses of the other laws.
    laws: Vec<&'a Losses>,
}

/// The judgements of one horizon, and the probability of the best of them by chance.
fn judged(
    policy: &Policy,
    field: &Field<'_>,
    ran: &[(Runner, [Entry; 2])],
    entries: &[&Entry],
    resamples: &Resamples,
) -> (Vec<Judged>, f64) {
    let own = field.so_far;
    let gains: Vec<[Vec<f64>; 2]> = entries.iter().map(|entry| differences(&own.held, &entry.held)).collect();
    let logs: Vec<Vec<f64>> = gains.iter().map(|[log, _]| log.clone()).collect();
    // What was not worth a judgement was tried, too: it counts in the distribution of the largest gain by chance.
    let left: Vec<Vec<f64>> = field.left.iter().map(|losses| differences(&own.trained, losses)[0].clone()).collect();
    let adjusted = step_down(&logs, &left, resamples);
    let losses: Vec<Vec<f64>> = entries
        .iter()
        .map(|e| &e.held)
        .chain([&own.held])
        .chain(field.laws.iter().copied())
        .map(Losses::logs)
        .collect();
    let set = confidence_set(&losses, resamples);
    let one = |k: usize| {
        let [log, roots] = &gains[k];
        let root = root_share(roots, &own.held);
        let (runner, _) = &ran[k];
        Judged {
            gain: as_share(adjusted[k].gain),
            interval: resamples.interval(log, policy.interval).map(as_share),
            root,
            in_set: set[k] > 1.0 - policy.set,
            checks: checks(policy, &runner.model.model, entries[k], &runner.added, &adjusted[k], log, root),
        }
    };
    let all: Vec<Vec<f64>> = logs.iter().chain(&left).cloned().collect();
    ((0..entries.len()).map(one).collect(), superior_predictive_ability(&all, resamples).consistent)
}

/// The rows of a model in the list of what was tried.
fn trials(so_far: &[&'static Extension], tried: &Tried, whole: &[Check]) -> [Trial; 2] {
    [Horizon::Drive, Horizon::Window].map(|horizon| {
        let judged = &tried.judged[horizon as usize];
        let mut checks = judged.checks.clone();
        if horizon == Horizon::Drive {
            checks.extend(whole.iter().cloned());
        }
        Trial {
            causes: names(&[so_far, &tried.runner.added].concat()),
            horizon_s: horizon.seconds(),
            gain: judged.gain,
            interval: judged.interval,
            checks,
            passes: judged.passes(),
        }
    })
}
