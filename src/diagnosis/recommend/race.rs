//! The race: base, base with a cause, other laws; each fitted on all drives and, fold by fold, on those that are not left out.

use super::parts::Parts;
use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::closed_loop::{ClosedLoop, Horizon, Losses, Plan, Point, fit};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::search::strategy::sizes;
use crate::diagnose::search::textbook::{fastest, with_textbook_values};
use crate::diagnose::{DiagnoseError, Drive};
use crate::extension::Extension;
use crate::optimize::stream;
use rand::RngExt;
use rayon::prelude::*;

/// Random candidates of a base, and those of them that are searched from.
const RANDOM: usize = 192;
/// See [`RANDOM`].
const SEARCHED: usize = 8;
/// Search of a base, of a cause, and of a fold that begins where all drives led.
const OF_BASE: Plan = Plan { rough: 4, keep: 3, fine: 16 };
/// See [`OF_BASE`].
const OF_CAUSE: Plan = Plan { rough: 2, keep: 3, fine: 10 };
/// See [`OF_BASE`].
const OF_FOLD: Plan = Plan { rough: 0, keep: 1, fine: 6 };

/// No law is asked to wish for less \[m/s\]; some divide by it.
const LEAST_V_0: f64 = 5.0;

/// A model at one horizon.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Fitted to all drives.
    pub whole: Point,
    /// Losses there, in training.
    pub trained: Losses,
    /// Parameters of every fold that was left out.
    pub folds: Vec<Vec<f64>>,
    /// Losses on what was left out.
    pub held: Losses,
}

/// What the race is run on.
#[derive(Debug)]
pub struct Course {
    /// Drives and folds.
    pub parts: Parts,
    /// Bounds.
    pub bounds: Overrides,
    /// Seed of the random candidates.
    pub seed: u64,
    fastest: f64,
    whole: Vec<bool>,
    trained: Vec<Vec<bool>>,
}

impl Course {
    /// Of some drives; bounds replace those of the diagnosis.
    #[must_use]
    pub fn new(drives: &[Drive], bounds: &Overrides, seed: u64) -> Course {
        Course::of_parts(Parts::of(drives), bounds, seed)
    }

    /// The same of drives that are in parts already.
    #[must_use]
    pub fn of_parts(parts: Parts, bounds: &Overrides, seed: u64) -> Course {
        let fastest = fastest(&parts.drives);
        let mut bounds = bounds.clone();
        // A set speed below what was driven is a cause, not a parameter.
        bounds.entry("v_0".to_owned()).or_insert([fastest.max(LEAST_V_0), 60.0_f64.max(2.0 * fastest)]);
        let (whole, trained) = (vec![true; parts.drives.len()], parts.trained());
        Course { parts, bounds, seed, fastest, whole, trained }
    }

    /// A variant over the drives; bounds of parameters that it lacks do not matter.
    ///
    /// # Errors
    /// As [`ClosedLoop::new`].
    pub fn closed_loop(&self, variant: Variant) -> Result<ClosedLoop, DiagnoseError> {
        ClosedLoop::new(variant, &self.parts.drives, &self.bounds)
    }

    fn all(&self) -> Vec<Vec<bool>> {
        vec![self.whole.clone()]
    }

    /// A law from random and textbook starts.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn law(
        &self,
        model: &ClosedLoop,
        horizon: Horizon,
        known: &[Vec<f64>],
    ) -> Result<Option<Point>, DiagnoseError> {
        let axes = &model.model.axes;
        let random = |i: usize| {
            let mut rng = stream(self.seed, 0, 0, i as u64);
            axes.iter().map(|axis| axis.value(0.02 + 0.96 * rng.random::<f64>())).collect::<Vec<f64>>()
        };
        let mut starts: Vec<Vec<f64>> = (0..RANDOM).map(random).collect();
        let textbook: Vec<Vec<f64>> = starts
            .iter()
            .take(RANDOM / 2)
            .map(|values| with_textbook_values(&model.model, values, self.fastest))
            .collect();
        starts.extend(textbook);
        let losses = model.losses(&starts, horizon, &|_, _| true)?;
        let mut order: Vec<usize> = (0..starts.len()).filter(|&i| losses[i].cost().is_finite()).collect();
        order.sort_by(|&a, &b| losses[a].cost().total_cmp(&losses[b].cost()));
        let best = order.iter().take(SEARCHED).map(|&i| (0, starts[i].clone()));
        let starts: Vec<(usize, Vec<f64>)> = known.iter().map(|values| (0, values.clone())).chain(best).collect();
        Ok(fit(model, axes, horizon, &self.all(), &starts, OF_BASE)?.remove(0))
    }

    /// A model with one cause more than one that is fitted, from there at several sizes.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn with_cause(
        &self,
        model: &ClosedLoop,
        horizon: Horizon,
        from: (&Model, &[f64]),
        added: &[&'static Extension],
        known: &[Vec<f64>],
    ) -> Result<Option<Point>, DiagnoseError> {
        let values = model.model.adopt(from.0, from.1);
        // Of every size of the first cause the best of those of the others: small sizes look best before the base has made room.
        let sized = |start: &Vec<f64>, size: &Vec<(usize, f64)>| {
            let mut start = start.clone();
            size.iter().for_each(|&(k, value)| start[k] = value);
            start
        };
        let mut starts = vec![values];
        for cause in added {
            let more = sizes(&model.model, cause);
            let several: Vec<(usize, Vec<f64>)> = starts
                .iter()
                .enumerate()
                .flat_map(|(k, start)| {
                    std::iter::once((k, start.clone())).chain(more.iter().map(move |size| (k, sized(start, size))))
                })
                .collect();
            starts = if added.len() == 1 {
                several.into_iter().map(|(_, start)| start).collect()
            } else if starts.len() == 1 {
                several.into_iter().skip(1).map(|(_, start)| start).collect()
            } else {
                self.best_of_each(model, horizon, several)?
            };
        }
        let starts: Vec<(usize, Vec<f64>)> =
            starts.into_iter().chain(known.iter().cloned()).map(|start| (0, start)).collect();
        Ok(fit(model, &model.model.axes, horizon, &self.all(), &starts, OF_CAUSE)?.remove(0))
    }

    /// The best of each kind of start.
    fn best_of_each(
        &self,
        model: &ClosedLoop,
        horizon: Horizon,
        several: Vec<(usize, Vec<f64>)>,
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let (kinds, starts): (Vec<usize>, Vec<Vec<f64>>) = several.into_iter().unzip();
        let costs: Vec<f64> = model.losses(&starts, horizon, &|_, _| true)?.iter().map(Losses::cost).collect();
        let best = |kind: usize| {
            let mine = (0..starts.len()).filter(|&i| kinds[i] == kind);
            mine.min_by(|&a, &b| costs[a].total_cmp(&costs[b])).map(|i| starts[i].clone())
        };
        Ok((0..=kinds.last().copied().unwrap_or(0)).filter_map(best).collect())
    }

    /// The entry of a model that is fitted to all drives: folds begin there. `None` where a fold cannot be fitted.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn entry(&self, model: &ClosedLoop, horizon: Horizon, whole: Point) -> Result<Option<Entry>, DiagnoseError> {
        let starts: Vec<(usize, Vec<f64>)> = (0..self.trained.len()).map(|fold| (fold, whole.values.clone())).collect();
        let found = fit(model, &model.model.axes, horizon, &self.trained, &starts, OF_FOLD)?;
        // Without a fit of its own a fold would be judged by one that has seen it.
        let Some(folds) = found.into_iter().map(|point| Some(point?.values)).collect::<Option<Vec<Vec<f64>>>>() else {
            return Ok(None);
        };
        let by_fold = model.losses(&folds, horizon, &|fold, part| self.parts.folds[part] == fold)?;
        let part = |part: usize| by_fold[self.parts.folds[part]].drives[part].clone();
        let held = Losses { drives: (0..self.parts.drives.len()).map(part).collect() };
        let trained = self.trained(model, horizon, &whole)?;
        Ok(Some(Entry { whole, trained, folds, held }))
    }

    /// The losses of a fit to all drives.
    ///
    /// # Errors
    /// As [`ClosedLoop::losses`].
    pub fn trained(&self, model: &ClosedLoop, horizon: Horizon, whole: &Point) -> Result<Losses, DiagnoseError> {
        Ok(model.losses(std::slice::from_ref(&whole.values), horizon, &|_, _| true)?.remove(0))
    }

    /// The runners of a race: a variant with each of some sets of causes; those that cannot be simulated here are left out.
    #[must_use]
    pub fn runners(&self, variant: Variant, sets: &[Vec<&'static Extension>]) -> Vec<Runner> {
        let runner = |added: &Vec<&'static Extension>| {
            let variant = added.iter().try_fold(variant, |variant, cause| variant.with(cause)).ok()?;
            Some(Runner { added: added.clone(), model: self.closed_loop(variant).ok()? })
        };
        sets.par_iter().filter_map(runner).collect()
    }

    /// All runners fitted to all drives from where a base is, at one horizon, and from where they were at the other one.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn race(
        &self,
        base: (&ClosedLoop, &Point),
        horizon: Horizon,
        runners: &[Runner],
        known: &[Option<Point>],
    ) -> Result<Vec<Option<Point>>, DiagnoseError> {
        let one = |k: usize, more: Vec<Vec<f64>>| {
            let runner = &runners[k];
            let before = known.get(k).and_then(|point| Some(point.as_ref()?.values.clone()));
            let known: Vec<Vec<f64>> = before.into_iter().chain(more).collect();
            let from = (&base.0.model, base.1.values.as_slice());
            self.with_cause(&runner.model, horizon, from, &runner.added, &known)
        };
        let is_pair = |k: &usize| runners[*k].added.len() > 1;
        let (pairs, singles): (Vec<usize>, Vec<usize>) = (0..runners.len()).partition(is_pair);
        let first: Vec<(usize, Option<Point>)> =
            singles.into_par_iter().map(|k| Ok((k, one(k, Vec::new())?))).collect::<Result<_, DiagnoseError>>()?;
        // A pair goes on from where each of its causes led by itself, too.
        let of_pair = |k: usize| {
            let pair = &runners[k];
            let parts = first.iter().filter(|(i, _)| pair.added.contains(&runners[*i].added[0]));
            let led = parts.filter_map(|(i, point)| Some((&runners[*i], point.as_ref()?)));
            let starts = led.flat_map(|(part, point)| pair.starts_from(part, &point.values)).collect();
            Ok((k, one(k, starts)?))
        };
        let second: Vec<(usize, Option<Point>)> =
            pairs.into_par_iter().map(of_pair).collect::<Result<_, DiagnoseError>>()?;
        let mut all: Vec<(usize, Option<Point>)> = first.into_iter().chain(second).collect();
        all.sort_by_key(|(k, _)| *k);
        Ok(all.into_iter().map(|(_, point)| point).collect())
    }
}

/// A model in a race.
#[derive(Debug)]
pub struct Runner {
    /// The causes that it has more than the base.
    pub added: Vec<&'static Extension>,
    /// The model over the drives.
    pub model: ClosedLoop,
}

impl Runner {
    /// Starts at the parameters of a model that has some of the causes, with the others at every size.
    fn starts_from(&self, part: &Runner, values: &[f64]) -> Vec<Vec<f64>> {
        let model = &self.model.model;
        let start = model.adopt(&part.model.model, values);
        let others = self.added.iter().filter(|cause| !part.added.contains(cause));
        others
            .flat_map(|cause| sizes(model, cause))
            .map(|size| {
                let mut start = start.clone();
                size.iter().for_each(|&(k, value)| start[k] = value);
                start
            })
            .collect()
    }
}
