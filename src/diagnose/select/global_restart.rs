//! A cause that gains, but does not carry over to the hold-out, searched anew: with a base from anywhere.

use super::adopt::Search;
use crate::diagnose::judge::decide::is_hopeful;
use crate::diagnose::judge::fate::Objection;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::is_stepped;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::likelihood::streams;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, FittedModel};
use crate::diagnose::search::profile_grid::is_lost;
use crate::diagnose::search::screen::ScreenedCause;
use crate::diagnose::search::search_budget::SearchBudget;
use crate::diagnose::search::start::{first_noise, population};
use crate::extension::Extension;
use crate::optimize::stream;
use rand::RngExt;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Of the causes that the hold-out objects to, so many are searched anew: the likeliest.
const SEARCHED: usize = 2;
/// Of the places that a search under a strong observer finds, so many are followed.
const FOLLOWED: usize = 6;
/// Gain over what was found before that is worth another decision \[nats\].
const FOUND: f64 = 10.0;

impl Search {
    /// What was found beside a base that makes up for a part of it does not carry over, for on other drives the base would have to be
    /// another one; and no derivative leads out of there. (An integral on L-CTH had 538 nats and gained in 65 % of the bootstraps of
    /// the hold-out; from elsewhere it has 682 and carries over.) So before such a cause is given up, it is searched for as the base
    /// was: from random parameters of the base and random sizes. Where the base alone is lost, all causes are: no search that begins at
    /// that base finds anything. (Of drag and a dead zone on Gipps, 2800 nats together, nothing showed; from elsewhere the dead zone has
    /// 800, and beside it the drag the rest.) True if more was found; `tried` and `held` have it then.
    ///
    /// # Errors
    /// As [`FittedModel::fitted`].
    pub(crate) fn anew(
        &mut self,
        setting: &Context<'_>,
        spending: &SearchBudget,
        tried: &mut [ScreenedCause],
        held: &mut [Option<CrossValidated>],
    ) -> Result<bool, DiagnoseError> {
        // Of the many that a lost base has tried, what does not beat the base itself after a rough search is not followed. (The dead zone
        // gained 530 nats by then, and of all others only one came near the base.)
        let (again, least) = if self.current.causes.is_empty() && is_lost(&self.current.fit.point.noise) {
            let sizes_only = (0..tried.len()).filter(|&i| has_sizes_only(tried[i].0)).collect();
            (sizes_only, self.current.fit.log_likelihood)
        } else {
            (self.doubted(tried), f64::NEG_INFINITY)
        };
        let searched = |&i: &usize| {
            let (cause, before) = &tried[i];
            let better = from_anywhere(setting, before, cause, spending, least)?;
            let better = better.filter(|better| better.fit.log_likelihood > before.fit.log_likelihood + FOUND);
            Ok(better.map(|better| (i, (*cause, better))))
        };
        let found: Result<Vec<_>, DiagnoseError> = again.par_iter().map(searched).collect();
        let mut found: Vec<(usize, ScreenedCause)> = found?.into_iter().flatten().collect();
        if found.is_empty() {
            return Ok(false);
        }
        found.sort_by(|(_, a), (_, b)| b.1.fit.log_likelihood.total_cmp(&a.1.fit.log_likelihood));
        let (places, mut found): (Vec<usize>, Vec<ScreenedCause>) = found.into_iter().unzip();
        // The base once more from where the likeliest of them took it: the gain must not be due to one that is better without a cause.
        self.improve(setting, &found, spending)?;
        if self.current.causes.is_empty() {
            self.bare = self.current.fit.log_likelihood;
        }
        let present = self.current.fit.log_likelihood;
        let judged = |(_, better): &mut ScreenedCause| {
            let hopeful = is_hopeful(better.fit.log_likelihood - present, self.need);
            hopeful.then(|| better.cross_fit(setting)).transpose()
        };
        let judged: Result<Vec<Option<CrossValidated>>, DiagnoseError> = found.par_iter_mut().map(judged).collect();
        for ((i, better), better_held) in places.into_iter().zip(found).zip(judged?) {
            tried[i] = better;
            held[i] = better_held;
        }
        Ok(true)
    }

    /// Positions of the likeliest causes that the hold-out objects to.
    pub(crate) fn doubted(&self, tried: &[ScreenedCause]) -> Vec<usize> {
        let objected = |(cause, evidence, _, objection): &(&'static Extension, f64, f64, Objection)| {
            let position = tried.iter().position(|(other, _)| other == cause);
            position.filter(|_| matches!(objection, Objection::NoTransfer { .. })).map(|i| (i, *evidence))
        };
        let mut doubted: Vec<(usize, f64)> = self.stopped.iter().filter_map(objected).collect();
        doubted.sort_by(|a, b| b.1.total_cmp(&a.1));
        doubted.into_iter().take(SEARCHED).map(|(i, _)| i).collect()
    }
}

/// True for a cause without times, and without a size on which innovations depend in jumps.
pub(crate) fn has_sizes_only(cause: &Extension) -> bool {
    cause.parameters.iter().all(|symbol| symbol.neutral().is_some() && !is_stepped(*symbol))
}

/// A candidate with a cause once more: from random parameters of its base, with the cause on the side where it was found, and the others
/// where they are. `None` if a rough search finds nothing above `least`.
fn from_anywhere(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &'static Extension,
    spending: &SearchBudget,
    least: f64,
) -> Result<Option<FittedModel>, DiagnoseError> {
    let FittedModel { variant, causes, model, fit } = candidate;
    let (seed, generation) = (setting.question.seed, causes.len() as u64);
    let noise = first_noise(setting.question.train);
    let own = model.positions(cause);
    let mut starts = population(model, &noise, seed, streams::ANEW, spending.population);
    for (i, start) in starts.iter_mut().enumerate() {
        let mut rng = stream(seed, streams::ANEW, generation, i as u64);
        for (k, axis) in model.axes.iter().enumerate() {
            let here = axis.coordinate(fit.point.values[k]);
            if let Some(neutral) = model.symbols[k].neutral().filter(|_| own.contains(&k)) {
                let neutral = axis.coordinate(neutral);
                let bound = if here < neutral { 0.0 } else { 1.0 };
                start.values[k] = axis.value(neutral + rng.random::<f64>().powi(2) * (bound - neutral));
            } else if !model.variant.is_of_base(model.symbols[k]) {
                start.values[k] = fit.point.values[k];
            }
        }
    }
    // Beside a base that is far off, times and sizes that were found before would be lost.
    let searched = setting.model(*variant, &model.events)?;
    let mut axes = searched.axes.clone();
    for k in causes.iter().filter(|other| **other != cause).flat_map(|other| model.positions(other)) {
        axes[k] = Axis::held(fit.point.values[k]);
    }
    let before = searched.simulations();
    let rough = Plan { keep: FOLLOWED, fine: 4, ..spending.base };
    let rough = crate::diagnose::likelihood::fit::fit(&searched, &axes, &setting.whole, &starts, rough)?;
    setting.simulations.fetch_add(searched.simulations() - before, Ordering::Relaxed);
    if rough.first().is_none_or(|best| best.log_likelihood <= least) {
        return Ok(None);
    }
    // A strong observer does not tell them apart.
    let followed = rough.into_iter().take(FOLLOWED).flat_map(|fit| {
        let free = fit.point.noise.freer();
        [fit.point.clone(), Point { noise: free, ..fit.point }]
    });
    let starts: Vec<Point> = followed.collect();
    let plan = Plan { select: starts.len(), kinds: 1, rough: 6, keep: 3, ..spending.base };
    FittedModel::fitted(setting, *variant, causes, setting.model(*variant, &model.events)?, &starts, plan)
}
