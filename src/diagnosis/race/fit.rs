//! Fits models at every horizon, to all parts of the drives and without each fold.

use super::loss::{Losses, Scale, Sizes};
use super::mixture::{DriverFit, Mixture};
use super::parts::{Parts, Unit};
use super::policy::Policy;
use super::surface::Surface;
use super::{HORIZONS, Horizon, OF_A_NAME};
use crate::calibrate::Overrides;
use crate::calibrate::descent::{self, Course, Surface as _, Walker, merged};
use crate::catalog::Variant;
use crate::diagnose::drive::ahead::{BRAKING, GENTLE_BRAKING};
use crate::diagnose::likelihood::model::{LEAD, Model, Space};
use crate::diagnose::search::strategy::sizes;
use crate::diagnose::search::textbook::{fastest, with_textbook_values};
use crate::diagnose::{DiagnoseError, Drive, Watching};
use crate::evaluator::Pull;
use crate::extension::Extension;
use crate::judge::mean;
use crate::optimize::stream;
use crate::symbols::Bounds;
use crate::wgsl::extension_named;
use rand::RngExt;
use rayon::prelude::*;

/// A search: iterations of all starts, number of starts that continue, and their largest number of iterations.
#[derive(Debug, Clone, Copy)]
struct Plan {
    rough: usize,
    keep: usize,
    fine: usize,
    /// Gain of an iteration below which a descent has converged, as a share of NRMSE(s,v,a) or of the squared errors.
    tolerance: f64,
}

/// Search of a law; of a law with causes; and from a fit to other parts, which moves less than a tolerance but gives intervals.
const OF_LAW: Plan = Plan { rough: 4, keep: 4, fine: 16, tolerance: TOLERANCE };
/// See [`OF_LAW`].
const OF_CAUSE: Plan = Plan { rough: 2, keep: 1, fine: 8, tolerance: TOLERANCE };
/// See [`OF_LAW`].
const FROM_A_FIT: Plan = Plan { rough: 0, keep: 1, fine: 4, tolerance: 1e-6 };
/// Half width of a 95 % interval in standard errors.
const TWO_SIDED: f64 = 1.96;
/// Random candidates of a law, half of them again with textbook values; and the number of candidates that are searched from.
const RANDOM: usize = 64;
/// See [`RANDOM`].
const SEARCHED: usize = 8;
/// Number of points that start the next horizon, and number of sizes of a cause to try beside them.
const LEADING: usize = 2;
/// See [`LEADING`].
const SIZED: usize = 2;
/// Time constant of the correction in the first iterations over whole drives \[s\]: some times that of the horizon before.
const ROUGH_S: f64 = 60.0;
/// A fifth of the least gain that is worth a test.
pub(super) const TOLERANCE: f64 = 1e-3;
/// Smallest desired speed of a law \[m/s\]; some laws divide by it.
const LEAST_V_0: f64 = 5.0;
/// The surface sets the correction from its horizon.
pub(super) const FREE: Pull = Pull { share: 0.0, soft: None };

/// A model fitted at one horizon.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Parameters fitted to all parts.
    pub whole: Vec<f64>,
    /// Their losses, in training.
    pub trained: Losses,
    /// Value of the objective at these parameters.
    cost: f64,
    place: Vec<f64>,
    /// `None` if the model is not judged.
    pub judged: Option<Judged>,
}

/// A model fitted without each fold.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Parameters without each fold.
    pub folds: Vec<Vec<f64>>,
    /// Losses on the parts left out.
    pub held: Losses,
    /// Number of times the model comes too close to the car ahead in parts left out, or fails.
    pub too_close: usize,
    /// Number of parts in which the model fitted to all of them collides when the car ahead stops; 0 at the shorter horizons.
    pub stops: usize,
    /// The same for a gentle stop.
    pub gentle_stops: usize,
    /// The middle of the drivers' laws without each fold; empty for recordings, for whole drives, and for a model with a reference.
    pub middles: Vec<Vec<f64>>,
    /// Drivers of a fleet who are left out; empty for recordings and for whole drives.
    pub drivers: Vec<DriverFit>,
    /// The drivers with and without the causes; `None` for recordings, for whole drives, and for a model without a reference.
    pub mixture: Option<Mixture>,
}

/// The model with which one with causes is compared.
pub(super) struct Reference<'a> {
    pub model: &'a Space,
    pub judged: &'a Judged,
    /// See [`Entry::added_places`].
    pub added: &'a [(usize, f64)],
}

/// A model in the race.
#[derive(Debug)]
pub struct Entry {
    /// Its causes, in the order in which they were found.
    pub causes: Vec<&'static Extension>,
    /// The model, without the drives: a copy of all drives in every model of a race would fill the memory.
    pub model: Space,
    /// Number of simulated candidates so far, over one part each.
    pub simulations: u64,
    /// Its fit at each horizon; `None` if no parameters complete the drives.
    pub fits: Vec<Option<Fit>>,
    /// The best parameters found at each horizon so far, for the start of the next one.
    leading: Vec<Vec<f64>>,
    /// Scales of the parts.
    pub scales: Vec<Scale>,
}

impl Entry {
    /// The fit over whole drives.
    #[must_use]
    pub fn whole_drives(&self) -> Option<&Fit> {
        self.fits.last()?.as_ref()
    }

    /// The drivers with and without its causes, at the horizon of names; `None` for recordings.
    #[must_use]
    pub fn mixture(&self) -> Option<Mixture> {
        self.fits[OF_A_NAME].as_ref()?.judged.as_ref()?.mixture
    }

    /// The causes that it has in addition to `base`.
    #[must_use]
    pub fn added(&self, base: &Entry) -> &[&'static Extension] {
        &self.causes[base.causes.len()..]
    }

    /// The value of a parameter at which it does nothing.
    #[must_use]
    pub fn neutral(&self, k: usize) -> f64 {
        let axis = &self.model.axes[k];
        self.model.symbols[k].neutral().unwrap_or(axis.lower).clamp(axis.lower, axis.upper)
    }

    /// True if the interval of one of its parameters at a horizon excludes the value at which the parameter does nothing.
    #[must_use]
    pub fn excludes_neutral(&self, cause: &'static Extension, horizon: usize) -> bool {
        let excludes = |k: usize| {
            let neutral = self.neutral(k);
            self.interval(k, horizon).is_some_and(|[low, high]| neutral < low || high < neutral)
        };
        self.model.positions(cause).into_iter().any(excludes)
    }

    /// True if a parameter of a cause lies on a bound at a horizon, and does something there.
    #[must_use]
    pub fn is_on_bound(&self, cause: &'static Extension, horizon: usize) -> bool {
        let Some(fit) = &self.fits[horizon] else { return false };
        let is_on_bound = |k: usize| {
            let (axis, value) = (&self.model.axes[k], fit.whole[k]);
            let size = (axis.coordinate(value) - axis.coordinate(self.neutral(k))).abs();
            axis.at_bound(value) && size > Policy::DEFAULT.none
        };
        self.model.positions(cause).into_iter().any(is_on_bound)
    }

    /// The 95 % interval of a parameter at a horizon, by a jackknife over the folds (Tukey 1958); `None` if the model is not judged.
    #[must_use]
    pub fn interval(&self, k: usize, horizon: usize) -> Option<[f64; 2]> {
        let fit = self.fits[horizon].as_ref()?;
        let (value, axis) = (fit.whole[k], &self.model.axes[k]);
        let half = TWO_SIDED * jackknife(&fit.judged.as_ref()?.folds, k);
        Some([(value - half).max(axis.lower), (value + half).min(axis.upper)])
    }

    /// True if it gains at least this share on its training data, at one horizon or more.
    #[must_use]
    pub fn is_worth(&self, base: &Entry, share: f64) -> bool {
        let gains = |((own, base), horizon): ((&Option<Fit>, &Option<Fit>), Horizon)| match (own, base) {
            (Some(own), Some(base)) if horizon.is_whole() => 1.0 - own.cost / base.cost > share,
            (Some(own), Some(base)) => base.cost - own.cost > -2.0 * (1.0 - share).ln(),
            _ => false,
        };
        self.fits.iter().zip(&base.fits).zip(Horizon::ALL).any(gains)
    }
}

/// Standard error of a parameter, from the fits that each left one fold out.
fn jackknife(folds: &[Vec<f64>], k: usize) -> f64 {
    let values: Vec<f64> = folds.iter().map(|fold| fold[k]).collect();
    let (centre, count) = (mean(&values), values.len() as f64);
    ((count - 1.0) / count * values.iter().map(|v| (v - centre).powi(2)).sum::<f64>()).sqrt()
}

/// Data of the race.
#[derive(Debug)]
pub struct Field {
    /// Drives in parts and folds.
    pub parts: Parts,
    /// Bins of every part.
    pub sizes: Vec<Sizes>,
    /// Scales of every part.
    pub scales: Vec<Scale>,
    bounds: Overrides,
    fastest: f64,
    seed: u64,
    all: Vec<bool>,
    pub(super) trained: Vec<Vec<bool>>,
}

impl Field {
    /// Prepares drives in parts; the bounds replace those of the diagnosis.
    #[must_use]
    pub fn new(parts: Parts, bounds: &Overrides, seed: u64) -> Field {
        let fastest = fastest(&parts.drives);
        let mut bounds = bounds.clone();
        // A desired speed below the driven speeds would be a cause, not a parameter.
        bounds.entry("v_0".to_owned()).or_insert([fastest.max(LEAST_V_0), 60.0_f64.max(2.0 * fastest)]);
        let sizes = parts.drives.iter().map(|drive| Sizes::new(drive.samples(), drive.dt())).collect();
        let scales = parts.drives.iter().map(Scale::of).collect();
        let (all, trained) = (vec![true; parts.drives.len()], parts.trained());
        Field { parts, sizes, scales, bounds, fastest, seed, all, trained }
    }

    /// A variant over the parts. The lower bound of a cause with `sign: positive` is its neutral value.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn model(&self, variant: Variant) -> Result<Model, DiagnoseError> {
        self.over(variant, &self.parts.drives)
    }

    fn over(&self, variant: Variant, drives: &[Drive]) -> Result<Model, DiagnoseError> {
        let mut bounds = self.bounds.clone();
        let positive = |cause: &&&'static Extension| cause.cause.as_ref().is_some_and(|traits| traits.positive);
        for symbol in variant.extensions.list().iter().filter(positive).flat_map(|cause| &cause.parameters) {
            if let (Some(neutral), Bounds::Fixed(_, upper)) = (symbol.neutral(), symbol.bounds()) {
                bounds.entry(symbol.name().to_owned()).or_insert([neutral, upper]);
            }
        }
        Model::new(variant, drives, &bounds, &[])
    }

    /// The loss of a model over the parts that count.
    #[must_use]
    pub fn surface<'a>(&'a self, model: &'a Model, counts: &'a [bool], horizon: Horizon) -> Surface<'a> {
        let correction_s = horizon.seconds();
        Surface { model, sizes: &self.sizes, scales: &self.scales, counts, horizon, correction_s }
    }

    /// A mask in which all parts count.
    #[must_use]
    pub fn all(&self) -> &[bool] {
        &self.all
    }

    fn search(
        surface: &Surface<'_>,
        starts: Vec<Vec<f64>>,
        plan: Plan,
        watching: &Watching<'_>,
    ) -> Result<Vec<Walker>, DiagnoseError> {
        let fixed = surface.fixed();
        let descend = |surface: &Surface<'_>, places, turns| {
            let course = Course { pull: FREE, turns, tolerance: plan.tolerance };
            let walkers = descent::descend(surface, places, &fixed, course, &mut &*watching)?;
            watching.go_on().map(|()| merged(walkers))
        };
        let mut places = starts;
        if plan.rough > 0 {
            // Errors add up over whole drives; with a weak correction, more starts lead to the same minimum.
            let corrected = Surface { correction_s: Some(surface.correction_s.unwrap_or(ROUGH_S)), ..*surface };
            let found = descend(&corrected, places, plan.rough)?;
            places = found.into_iter().take(plan.keep).map(|walker| walker.place).collect();
        }
        descend(surface, places, plan.fine)
    }

    fn fit(&self, surface: &Surface<'_>, walker: &Walker) -> Result<Fit, DiagnoseError> {
        let whole = surface.values(&walker.place);
        let trained = surface.losses(std::slice::from_ref(&whole))?.remove(0);
        Ok(Fit { whole, trained, cost: walker.cost, place: walker.place.clone(), judged: None })
    }

    /// Fits a law at the horizons with a correction, from random candidates and textbook values. It begins under the strongest one, where
    /// most starts lead to the same minimum. Every model has the nuisance lead: a car reacts in finer steps than a model, and a cause must
    /// not get the credit for that.
    ///
    /// # Errors
    /// As [`Model::new`]; [`DiagnoseError::Stopped`].
    pub fn law(&self, variant: Variant, watching: &Watching<'_>) -> Result<Entry, DiagnoseError> {
        let led = extension_named(LEAD).and_then(|lead| variant.with(lead).ok());
        let model = self.model(led.unwrap_or(variant))?;
        let (mut fits, mut leading): (Vec<Option<Fit>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for &horizon in Horizon::CORRECTED {
            let surface = self.surface(&model, &self.all, horizon);
            let starts = if leading.is_empty() { self.starts(&surface)? } else { leading.clone() };
            let walkers = Self::search(&surface, starts, OF_LAW, watching)?;
            leading.extend(walkers.iter().take(LEADING).map(|walker| walker.place.clone()));
            fits.push(walkers.first().map(|walker| self.fit(&surface, walker)).transpose()?);
        }
        Ok(self.entry(Vec::new(), model, fits, &leading))
    }

    /// The best of random candidates and of those with textbook values; none if all fail.
    fn starts(&self, surface: &Surface<'_>) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let random = |i: usize| {
            let mut rng = stream(self.seed, 0, 0, i as u64);
            surface.model.axes.iter().map(|_| 0.02 + 0.96 * rng.random::<f64>()).collect::<Vec<f64>>()
        };
        let mut all: Vec<Vec<f64>> = (0..RANDOM).map(random).collect();
        let textbook = |place: &Vec<f64>| {
            surface.place(&with_textbook_values(surface.model, &surface.values(place), self.fastest))
        };
        all.extend(all.iter().take(RANDOM / 2).map(textbook).collect::<Vec<_>>());
        lowest(surface, all, SEARCHED)
    }

    /// Parameters without each fold of a law that was not fitted before; `None` if a fit finds none.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`], [`DiagnoseError::Stopped`].
    pub(super) fn fitted_without_folds(
        &self,
        model: &Model,
        horizon: Horizon,
        watching: &Watching<'_>,
    ) -> Result<Option<Vec<Vec<f64>>>, DiagnoseError> {
        let surface = self.surface(model, &self.all, horizon);
        let walkers = Self::search(&surface, self.starts(&surface)?, OF_LAW, watching)?;
        walkers.first().map_or(Ok(None), |walker| self.without_folds(model, horizon, &walker.place, watching))
    }

    /// Fits a model with more causes than `base` at these first horizons; `None` if the drives or the law lack something that it needs. The
    /// fits start at the base and at models with some of the causes.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub fn with_causes(
        &self,
        base: &Entry,
        added: &[&'static Extension],
        parts: &[&Entry],
        horizons: &[Horizon],
        watching: &Watching<'_>,
    ) -> Result<Option<Entry>, DiagnoseError> {
        let Ok(variant) = added.iter().try_fold(base.model.variant, |variant, cause| variant.with(cause)) else {
            return Ok(None);
        };
        let Ok(model) = self.model(variant) else { return Ok(None) };
        let (mut fits, mut leading): (Vec<Option<Fit>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for (k, &horizon) in horizons.iter().enumerate() {
            let surface = self.surface(&model, &self.all, horizon);
            let (mut starts, mut sized) = (leading.clone(), Vec::new());
            for entry in parts.iter().chain([&base]) {
                let Some(fit) = &entry.fits[k] else { continue };
                let from = model.adopt(&entry.model, &fit.whole);
                starts.push(surface.place(&from));
                // A base compensates for a missing cause with other parameters; from textbook values, a cause need not reverse that.
                let textbook = (k == 0).then(|| with_textbook_values(&model, &from, self.fastest));
                for cause in added.iter().filter(|cause| !entry.causes.contains(cause)) {
                    for size in sizes(&model, cause) {
                        for mut values in std::iter::once(from.clone()).chain(textbook.clone()) {
                            size.iter().for_each(|&(k, value)| values[k] = value);
                            sized.push(surface.place(&values));
                        }
                    }
                }
            }
            starts.extend(lowest(&surface, sized, SIZED)?);
            let walkers = Self::search(&surface, starts, OF_CAUSE, watching)?;
            leading.extend(walkers.iter().take(LEADING).map(|walker| walker.place.clone()));
            fits.push(walkers.first().map(|walker| self.fit(&surface, walker)).transpose()?);
        }
        let causes = [&base.causes[..], added].concat();
        Ok(Some(self.entry(causes, model, fits, &leading)))
    }

    /// Fits a model at every horizon, from its fits so far; at a horizon without one, from its best points at the others and from the fit of
    /// its base there.
    ///
    /// # Errors
    /// As [`Model::new`]; [`DiagnoseError::Stopped`].
    pub fn again(&self, entry: &Entry, base: Option<&Entry>, watching: &Watching<'_>) -> Result<Entry, DiagnoseError> {
        let model = self.model(entry.model.variant)?;
        let fit = |(k, horizon): (usize, Horizon)| {
            let surface = self.surface(&model, &self.all, horizon);
            let of = |entry: &Entry, values: &[f64]| surface.place(&model.adopt(&entry.model, values));
            let (places, plan) = match entry.fits.get(k) {
                Some(Some(own)) => (vec![of(entry, &own.whole)], FROM_A_FIT),
                _ => {
                    let of_base = base.and_then(|base| Some(of(base, &base.fits[k].as_ref()?.whole)));
                    (entry.leading.iter().map(|own| of(entry, own)).chain(of_base).collect(), OF_LAW)
                }
            };
            let walkers = Self::search(&surface, places, plan, watching)?;
            walkers.first().map(|walker| self.fit(&surface, walker)).transpose()
        };
        let fits = Horizon::ALL.into_iter().enumerate().map(fit).collect::<Result<_, _>>()?;
        Ok(self.entry(entry.causes.clone(), model, fits, &[]))
    }

    fn entry(
        &self,
        causes: Vec<&'static Extension>,
        model: Model,
        fits: Vec<Option<Fit>>,
        leading: &[Vec<f64>],
    ) -> Entry {
        let values = |place: &Vec<f64>| model.axes.iter().zip(place).map(|(axis, u)| axis.value(*u)).collect();
        let (leading, simulations) = (leading.iter().map(values).collect(), model.simulations());
        Entry { causes, simulations, model: model.space, fits, leading, scales: self.scales.clone() }
    }

    /// True if each driver has an own base law: over whole drives, and for one car, all drives have the same.
    fn has_own_laws(&self, horizon: Horizon) -> bool {
        self.parts.unit == Unit::Driver && !horizon.is_whole()
    }

    /// Fits a model without each fold, from its fit to all parts, and judges it on that fold. `reference` is the base: the
    /// drivers of a fleet have all causes beyond it, or none.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn judge(
        &self,
        entry: &mut Entry,
        reference: Option<&Entry>,
        watching: &Watching<'_>,
    ) -> Result<(), DiagnoseError> {
        debug_assert_eq!(entry.fits.len(), HORIZONS, "a model is judged at every horizon");
        let model = self.model(entry.model.variant)?;
        let added = reference.map_or(Vec::new(), |reference| entry.added_places(reference));
        for (k, (fit, horizon)) in entry.fits.iter_mut().zip(Horizon::ALL).enumerate() {
            let Some(fit) = fit else { continue };
            fit.judged = self.judged(&model, horizon, &fit.place, watching)?;
            if let Some(judged) = fit.judged.as_mut().filter(|_| horizon.is_whole()) {
                judged.stops = self.collisions_at_stops(entry.model.variant, &fit.whole, BRAKING)?;
                judged.gentle_stops = self.collisions_at_stops(entry.model.variant, &fit.whole, GENTLE_BRAKING)?;
            }
            if let Some(judged) = fit.judged.as_mut().filter(|_| self.has_own_laws(horizon)) {
                let of = reference.and_then(|of| {
                    let judged = of.fits[k].as_ref()?.judged.as_ref()?;
                    Some(Reference { model: &of.model, judged, added: &added })
                });
                self.judge_drivers(&model, horizon, judged, of, watching)?;
            }
        }
        entry.simulations += model.simulations();
        Ok(())
    }

    /// Number of parts in which a model collides when the car ahead stops at this deceleration \[m/s²\].
    pub(super) fn collisions_at_stops(
        &self,
        variant: Variant,
        values: &[f64],
        braking: f64,
    ) -> Result<usize, DiagnoseError> {
        let drives: Vec<Drive> = self.parts.drives.iter().map(|drive| drive.until_it_stops(braking)).collect();
        let sizes: Vec<Sizes> = drives.iter().map(|drive| Sizes::new(drive.samples(), drive.dt())).collect();
        let model = self.over(variant, &drives)?;
        let surface = Surface { sizes: &sizes, ..self.surface(&model, &self.all, Horizon::Drive) };
        Ok(surface.losses(&[values.to_vec()])?[0].collisions())
    }

    /// `None` if a fold cannot be fitted: otherwise the judge of that fold would be a fit that has seen it.
    fn judged(
        &self,
        model: &Model,
        horizon: Horizon,
        from: &[f64],
        watching: &Watching<'_>,
    ) -> Result<Option<Judged>, DiagnoseError> {
        let Some(folds) = self.without_folds(model, horizon, from, watching)? else { return Ok(None) };
        let mut too_close = 0;
        for (values, left_out) in folds.iter().zip(self.left_out()).filter(|_| horizon.is_whole()) {
            let surface = self.surface(model, &left_out, horizon);
            too_close += surface.too_close(values, &Policy::DEFAULT.least_spacing)?;
        }
        let held = match self.has_own_laws(horizon) {
            true => Losses { parts: vec![None; self.all.len()] },
            false => self.losses_left_out(model, horizon, &folds)?,
        };
        Ok(Some(Judged {
            folds,
            held,
            too_close,
            stops: 0,
            gentle_stops: 0,
            middles: Vec::new(),
            drivers: Vec::new(),
            mixture: None,
        }))
    }

    /// Parameters without each fold, from those of all parts; `None` if a fit finds none.
    fn without_folds(
        &self,
        model: &Model,
        horizon: Horizon,
        from: &[f64],
        watching: &Watching<'_>,
    ) -> Result<Option<Vec<Vec<f64>>>, DiagnoseError> {
        let fold = |counts: &Vec<bool>| {
            let surface = self.surface(model, counts, horizon);
            let walkers = Self::search(&surface, vec![from.to_vec()], FROM_A_FIT, watching)?;
            Ok(walkers.first().map(|walker| surface.values(&walker.place)))
        };
        let folds: Vec<Option<Vec<f64>>> = self.trained.par_iter().map(fold).collect::<Result<_, DiagnoseError>>()?;
        Ok(folds.into_iter().collect())
    }

    /// For each fold, the parts that its fit leaves out.
    fn left_out(&self) -> impl Iterator<Item = Vec<bool>> {
        self.trained.iter().map(|trained| trained.iter().map(|is_trained| !is_trained).collect())
    }

    /// Losses of every part with the parameters that were fitted without its fold.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub(super) fn losses_left_out(
        &self,
        model: &Model,
        horizon: Horizon,
        folds: &[Vec<f64>],
    ) -> Result<Losses, DiagnoseError> {
        let mut held = Losses { parts: vec![None; self.all.len()] };
        for (values, left_out) in folds.iter().zip(self.left_out()) {
            held.take_from(self.surface(model, &left_out, horizon).losses(std::slice::from_ref(values))?.remove(0));
        }
        Ok(held)
    }
}

/// The points with the lowest costs, at most `most`.
fn lowest(surface: &Surface<'_>, places: Vec<Vec<f64>>, most: usize) -> Result<Vec<Vec<f64>>, DiagnoseError> {
    let costs = surface.costs(&places, FREE)?;
    let mut all: Vec<(f64, Vec<f64>)> = costs.into_iter().zip(places).filter(|(cost, _)| cost.is_finite()).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(all.into_iter().take(most).map(|(_, place)| place).collect())
}
