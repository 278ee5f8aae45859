//! Whether the hold-out objects to a cause.

use super::fate::Objection;
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::fit::Point;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::streams;
use crate::diagnose::question::{DiagnoseError, Question};
use crate::diagnose::search::fitted_model::{Context, FittedModel, Transferred};
use crate::diagnose::search::screen::ScreenedCause;
use crate::evaluator::{Failure, FailureKind};
use crate::extension::Extension;
use crate::optimize::stream;
use crate::symbols::SearchKind;
use rand::RngExt;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// Share of bootstraps in which a cause has to gain on the hold-out.
pub const TRANSFERS: f64 = 0.9;
/// A hold-out on which a cause changes less than this \[nats\] cannot object to it: were it real, it would gain there by chance only.
const SHOWN: f64 = 8.0;
/// Bootstraps of the hold-out.
const DRAWS: u64 = 200;
/// Less of a drive than this is not compared \[s\].
const SHORTEST_S: f64 = 30.0;

/// The gates of a round: of all that gain on training, what the hold-out says of them beside the same model.
#[derive(Debug)]
pub struct Gates<'a> {
    setting: &'a Context<'a>,
    current: &'a FittedModel,
    /// The model without any of them on the hold-out, with a base and a noise of its own.
    alone: Option<Transferred>,
    /// What is known, by position.
    known: BTreeMap<usize, Option<Objection>>,
}

impl<'a> Gates<'a> {
    /// None is asked yet.
    pub fn new(setting: &'a Context<'a>, current: &'a FittedModel) -> Gates<'a> {
        Gates { setting, current, alone: None, known: BTreeMap::new() }
    }

    /// True if it has objected to something.
    pub fn objected(&self) -> bool {
        self.known.values().any(Option::is_some)
    }

    /// The objection to the cause at `position`, if any. `next`, which will be asked after it, is simulated beside it, and its answer
    /// kept.
    ///
    /// # Errors
    /// As [`transfers`].
    pub fn objection(
        &mut self,
        tried: &[ScreenedCause],
        position: usize,
        next: Option<usize>,
    ) -> Result<Option<Objection>, DiagnoseError> {
        if let Some(known) = self.known.get(&position) {
            return Ok(known.clone());
        }
        let Gates { setting, current, .. } = *self;
        let asked: Vec<usize> = std::iter::once(position).chain(next).collect();
        let needed = asked.iter().any(|&i| need_recur(tried[i].0)) && !setting.question.holdout.is_empty();
        if needed && self.alone.is_none() {
            self.alone = Some(current.transfer(setting, None)?);
        }
        let alone = self.alone.as_ref();
        let gated = |&i: &usize| Ok((i, gate(setting, &tried[i].1, tried[i].0, current, alone)?));
        let found: Result<Vec<(usize, Option<Objection>)>, DiagnoseError> = asked.par_iter().map(gated).collect();
        self.known.extend(found?);
        Ok(self.known[&position].clone())
    }
}

/// Share of block bootstraps of the hold-out in which a candidate beats another; 1 without a hold-out. With it, what the cause
/// changes there \[nats\]. Draws in which it changes next to nothing, for it acts in a few blocks only that are not among them, have
/// no vote. `alone` is how `current` does on the whole hold-out without knowing of the candidate, where that is known already.
///
/// # Errors
/// As [`FittedModel::transfer`].
pub fn transfers(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &Extension,
    current: &FittedModel,
    alone: Option<&Transferred>,
) -> Result<(f64, f64), DiagnoseError> {
    if setting.question.holdout.is_empty() {
        return Ok((1.0, 0.0));
    }
    let model = setting.held_out(candidate.variant, &candidate.model.events)?;
    let Some(drives) = as_far_as_it_goes(model, &candidate.fit.point, setting.question.holdout)? else {
        return compared(setting, candidate, cause, current, alone);
    };
    let question = Question { holdout: &drives, ..*setting.question };
    let shorter = Context { least: setting.least, ..Context::new(&question, setting.lead) };
    let found = compared(&shorter, candidate, cause, current, None);
    setting.simulations.fetch_add(shorter.simulations.load(Ordering::Relaxed), Ordering::Relaxed);
    found
}

/// See [`transfers`].
fn compared(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &Extension,
    current: &FittedModel,
    alone: Option<&Transferred>,
) -> Result<(f64, f64), DiagnoseError> {
    let mine = match alone {
        Some(alone) => candidate.transfer(setting, Some(alone))?,
        None => candidate.transfer(setting, Some(&current.transfer(setting, None)?))?,
    };
    let theirs = current.transfer(setting, Some(&mine))?;
    let scores = mine.scores(setting)?.into_iter().flatten().zip(theirs.scores(setting)?.into_iter().flatten());
    let gains: Vec<f64> = scores.map(|(a, b)| a - b).collect();
    let changes = mine.changed_by(setting, cause)?;
    let changed: f64 = changes.iter().sum();
    let vote = |draw: u64| {
        let mut rng = stream(setting.question.seed, streams::HOLDOUT, 0, draw);
        let drawn: Vec<usize> = (0..gains.len()).map(|_| rng.random_range(0..gains.len())).collect();
        let sum = |of: &[f64]| drawn.iter().map(|k| of[*k]).sum::<f64>();
        (sum(&changes) >= SHOWN.min(changed)).then(|| sum(&gains) > 0.0)
    };
    let votes: Vec<bool> = (0..DRAWS).filter_map(vote).collect();
    let better = votes.iter().filter(|better| **better).count();
    Ok((if votes.is_empty() { 1.0 } else { better as f64 / votes.len() as f64 }, changed))
}

/// The objection of the hold-out, if any; events need not recur there, nor must it reach what a cause changes. `alone` as in
/// [`transfers`].
///
/// # Errors
/// As [`transfers`].
pub fn gate(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &Extension,
    current: &FittedModel,
    alone: Option<&Transferred>,
) -> Result<Option<Objection>, DiagnoseError> {
    if !need_recur(cause) {
        return Ok(None);
    }
    let (share, changed) = transfers(setting, candidate, cause, current, alone)?;
    Ok((share < TRANSFERS && changed >= SHOWN).then_some(Objection::NoTransfer { share }))
}

/// False for an event.
fn need_recur(cause: &Extension) -> bool {
    !matches!(cause.search(), SearchKind::Event | SearchKind::Stretch)
}

/// The hold-out up to where a law has no answer any more; `None` if it has one everywhere, or nowhere for long. Where Gipps' radicand is
/// negative no speed is safe, and a run ends; a car that goes on there, as one whose braking is limited does, is no argument against
/// what has been seen of it.
fn as_far_as_it_goes(model: Model, point: &Point, drives: &[Drive]) -> Result<Option<Vec<Drive>>, DiagnoseError> {
    let mut ends: Vec<usize> = drives.iter().map(Drive::samples).collect();
    for noise in [point.noise, point.noise.strong()] {
        for (end, run) in ends.iter_mut().zip(model.innovations(&point.values, &noise)?) {
            if let Some(Failure { kind: FailureKind::Radicand, step }) = run.failed {
                *end = step.min(*end);
            }
        }
    }
    let pairs = || drives.iter().zip(&ends);
    if pairs().all(|(drive, end)| *end == drive.samples()) {
        return Ok(None);
    }
    let long = pairs().filter(|(drive, end)| **end as f64 * drive.dt() >= SHORTEST_S);
    let drives: Vec<Drive> = long.map(|(drive, end)| drive.first(*end)).collect();
    Ok((!drives.is_empty()).then_some(drives))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::likelihood::observer::Noise;
    use crate::diagnose::made_up;
    use crate::symbols::Symbol;

    #[test]
    fn the_hold_out_says_the_same_of_two_at_a_time() {
        let (train, holdout) = ([made_up::drive("made_up.csv", 0.0)], [made_up::drive("held.csv", 0.0)]);
        let bounds = Overrides::new();
        let question = made_up::question(&train, &holdout, &bounds);
        let setting = Context::new(&question, None);
        let current = made_up::candidate(&train, &[]);
        let tried = ["aero_drag", "set_speed_change", "range_bias"]
            .map(|name| (made_up::cause(name), made_up::candidate(&train, &[name])));
        let one = |i: usize| gate(&setting, &tried[i].1, tried[i].0, &current, None).expect("it runs");
        let alone = [0, 1, 2].map(one);
        let each = setting.simulated();
        assert!(alone[0].is_some() && alone[1].is_none(), "{alone:?}");
        let mut gates = Gates::new(&setting, &current);
        assert!(!gates.objected());
        assert_eq!(gates.objection(&tried, 0, Some(2)).expect("it runs"), alone[0]);
        assert!(gates.objected());
        let simulated = setting.simulated();
        assert_eq!(gates.objection(&tried, 2, None).expect("it is known"), alone[2]);
        // Of an event the hold-out says nothing.
        assert_eq!(gates.objection(&tried, 1, None).expect("it is not asked"), None);
        assert_eq!(setting.simulated(), simulated);
        assert!(simulated - each < each, "what the model alone does is simulated once");
    }

    /// A car that always keeps 3 m + 1.5 s v is where Gipps' law knows no safe speed if that wants 15 m at standstill, but at high speed
    /// it is not.
    #[test]
    fn a_hold_out_ends_where_the_law_has_no_answer() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let model = || Model::new("gipps".parse().expect("a base"), &drives, &Overrides::new(), &[]).expect("a model");
        let noise = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 1e-3 };
        let point = |d_0: f64| {
            let value = |symbol: &Symbol| match symbol {
                Symbol::d_0 => d_0,
                Symbol::theta => 0.3,
                Symbol::t_h => 1.0,
                Symbol::v_0 => 40.0,
                Symbol::a_max => 2.0,
                Symbol::a_min => -5.0,
                Symbol::a_hat_min => -15.0,
                other => panic!("{}", other.name()),
            };
            Point { values: model().symbols.iter().map(value).collect(), noise }
        };
        let cut = as_far_as_it_goes(model(), &point(15.0), &drives).expect("runs").expect("it ends somewhere");
        let samples = cut[0].samples();
        assert!((300..1100).contains(&samples), "{samples}");
        assert_eq!(cut[0].trajectory.v_f, drives[0].trajectory.v_f[..samples]);
        assert!(as_far_as_it_goes(model(), &point(2.0), &drives).expect("runs").is_none());
    }
}
