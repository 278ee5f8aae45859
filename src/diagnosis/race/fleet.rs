//! Judges a model on drivers who are left out of its fits.
//!
//! Drivers differ, and a pooled law makes these differences look like a cause. So each driver first gets an own base law, near the middle
//! of those of the other drivers, under every model alike. A cause may be that of some drivers only: a model with causes is scored as a
//! mixture of drivers with them, at one size, and drivers without.

use super::fit::{Field, Judged, Reference};
use super::loss::Losses;
use super::mixture::{DriverFit, Mixture, Ratios, SIZES};
use super::own::{OwnLaw, weight};
use super::policy::Policy;
use super::surface::Surface;
use super::{Entry, Horizon, OF_A_NAME};
use crate::calibrate::descent::Walker;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::{DiagnoseError, Watching};
use crate::pooling::SPREAD;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Number of times that the middle of the drivers' laws is found, each from the last.
const TURNS: usize = 4;
/// Number of drivers of a middle, about: of 50 who differ by a third, it is known to a twentieth.
const OF_THE_MIDDLE: usize = 50;
/// Standard deviation of a driver's parameters while the middle is found, as [`SPREAD`]: the start may be several of these away.
const WIDE: f64 = 4.0 * SPREAD;

/// A driver, and the parts of the driver that count.
struct Driver {
    unit: usize,
    counts: Vec<bool>,
}

/// A driver with an own base law.
struct OwnFit {
    unit: usize,
    cost: f64,
    losses: Losses,
}

impl Field {
    /// Judges the drivers left out. With a reference, the losses are those of a mixture of drivers with and without the added causes,
    /// whose share and size come from the drivers of the other folds.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`], [`DiagnoseError::Stopped`].
    pub(super) fn judge_drivers(
        &self,
        model: &Model,
        horizon: Horizon,
        judged: &mut Judged,
        reference: Option<Reference<'_>>,
        watching: &Watching<'_>,
    ) -> Result<(), DiagnoseError> {
        for (fold, common) in judged.folds.iter().enumerate() {
            let left_out: Vec<bool> = self.parts.folds.iter().map(|own| *own == fold).collect();
            let surface = self.surface(model, &left_out, horizon);
            let common = surface.place(common);
            let Some(of) = &reference else {
                let trained = Surface { counts: &self.trained[fold], ..surface };
                let middle = self.middle(&trained, common, watching)?;
                for own in self.with_own_law(&surface, &middle, watching)? {
                    judged.held.take_from(own.losses);
                    judged.drivers.push(DriverFit { unit: own.unit, fold, cost: own.cost, ratios: None });
                }
                judged.middles.push(surface.values(&middle));
                continue;
            };
            // Drivers with the causes are like the others in everything else.
            let middle = surface.place(&model.adopt(of.model, &of.judged.middles[fold]));
            let at = |size: f64| {
                let mut place = middle.clone();
                for &(k, neutral) in of.added {
                    place[k] = (neutral + size * (common[k] - neutral)).clamp(0.0, 1.0);
                }
                self.with_own_law(&surface, &place, watching)
            };
            let sizes: Vec<Vec<OwnFit>> = SIZES.into_iter().map(at).collect::<Result<_, DiagnoseError>>()?;
            for (driver, own) in sizes[0].iter().enumerate() {
                let Some(base) = of.judged.drivers.iter().find(|base| base.unit == own.unit) else { continue };
                let ratio = |k: usize| {
                    let ratio = (base.cost - sizes[k][driver].cost) * self.weight(own.unit);
                    // A driver whom the reference cannot follow at all says nothing of the causes.
                    if ratio < f64::INFINITY { ratio } else { 0.0 }
                };
                let ratios = Some(std::array::from_fn(ratio));
                judged.drivers.push(DriverFit { unit: own.unit, fold, cost: base.cost, ratios });
            }
        }
        if let Some(of) = reference {
            judged.held.parts.clone_from(&of.judged.held.parts);
            self.mix(judged);
        }
        Ok(())
    }

    /// Turns the losses of the reference into those of the mixture.
    fn mix(&self, judged: &mut Judged) {
        let of = |is_seen: &dyn Fn(usize) -> bool| {
            let seen = judged.drivers.iter().filter(|driver| is_seen(driver.fold));
            Mixture::of(&seen.filter_map(|driver| driver.ratios.as_ref()).collect::<Vec<_>>())
        };
        let folds: Vec<Mixture> = (0..judged.folds.len()).map(|fold| of(&|own| own != fold)).collect();
        judged.mixture = Some(of(&|_| true));
        for driver in &mut judged.drivers {
            let Some(ratios) = &driver.ratios else { continue };
            let gain = folds[driver.fold].log_likelihood(ratios) / self.weight(driver.unit);
            driver.cost -= gain;
            let parts = judged.held.parts.iter_mut().zip(&self.parts.units);
            let own = parts.filter(|(_, unit)| **unit == driver.unit).filter_map(|(part, _)| part.as_mut());
            own.for_each(|part| part.add(-gain));
        }
    }

    /// The weight of a driver's loss in a logarithm of the likelihood.
    fn weight(&self, unit: usize) -> f64 {
        let parts = self.parts.units.iter().zip(&self.sizes).filter(|(own, _)| **own == unit);
        weight(parts.map(|(_, sizes)| sizes.count()).sum())
    }

    /// The middle of the base laws of the drivers who count, near which the driver's own law lies. A law that is common to all drivers
    /// compensates for their differences, far from all of them; so it is only the start.
    pub(super) fn middle(
        &self,
        surface: &Surface<'_>,
        common: Vec<f64>,
        watching: &Watching<'_>,
    ) -> Result<Vec<f64>, DiagnoseError> {
        let drivers = self.drivers(surface);
        let every = 1 + drivers.len() / OF_THE_MIDDLE;
        let some: Vec<Driver> = drivers.into_iter().step_by(every).collect();
        let held = held(surface);
        let mut middle = common;
        for _ in 0..TURNS {
            let own = |driver: &Driver| OwnLaw::new(driver.of(surface), (&middle, WIDE), &held).found(watching);
            let own: Vec<Option<Walker>> = some.par_iter().map(own).collect::<Result<_, DiagnoseError>>()?;
            let places: Vec<Vec<f64>> = own.into_iter().flatten().map(|found| found.place).collect();
            if places.is_empty() {
                break;
            }
            let mean = |k: usize| places.iter().map(|place| place[k]).sum::<f64>() / places.len() as f64;
            middle = (0..middle.len()).map(mean).collect();
        }
        Ok(middle)
    }

    /// Every driver who counts, with an own base law near this place.
    fn with_own_law(
        &self,
        surface: &Surface<'_>,
        middle: &[f64],
        watching: &Watching<'_>,
    ) -> Result<Vec<OwnFit>, DiagnoseError> {
        let held = held(surface);
        let one = |driver: &Driver| {
            let surface = driver.of(surface);
            let (cost, losses) = match OwnLaw::new(surface, (middle, SPREAD), &held).judged(watching)? {
                Some(judged) => judged,
                None => (f64::INFINITY, surface.losses(&[surface.values(middle)])?.remove(0)),
            };
            Ok(OwnFit { unit: driver.unit, cost, losses })
        };
        self.drivers(surface).par_iter().map(one).collect()
    }

    /// The drivers with a part that counts.
    fn drivers(&self, surface: &Surface<'_>) -> Vec<Driver> {
        let counting = self.parts.units.iter().zip(surface.counts).filter(|(_, counts)| **counts);
        let units: BTreeSet<usize> = counting.map(|(unit, _)| *unit).collect();
        let counts = |driver: usize| -> Vec<bool> {
            self.parts.units.iter().zip(surface.counts).map(|(unit, counts)| *counts && *unit == driver).collect()
        };
        units.into_iter().map(|unit| Driver { unit, counts: counts(unit) }).collect()
    }
}

impl Driver {
    /// The loss of this driver.
    fn of<'a>(&'a self, surface: &Surface<'a>) -> Surface<'a> {
        Surface { counts: &self.counts, ..*surface }
    }
}

/// The parameters that drivers do not have of their own.
fn held(surface: &Surface<'_>) -> Vec<usize> {
    let of_base = |k: usize| surface.model.variant.is_of_base(surface.model.symbols[k]);
    let mut held = surface.fixed();
    held.extend((0..surface.model.symbols.len()).filter(|k| !of_base(*k)));
    held
}

impl Entry {
    /// The interval of the share of drivers with its causes, at the horizon of names; `None` for recordings.
    #[must_use]
    pub fn share_interval(&self, seed: u64) -> Option<[f64; 2]> {
        let drivers = &self.fits[OF_A_NAME].as_ref()?.judged.as_ref()?.drivers;
        let all: Vec<&Ratios> = drivers.iter().filter_map(|driver| driver.ratios.as_ref()).collect();
        (!all.is_empty()).then(|| Mixture::interval(&all, seed, Policy::FLEET.interval))
    }

    /// Positions of the parameters of the causes beyond those of a reference, each with the coordinate at which it does nothing.
    pub(super) fn added_places(&self, reference: &Entry) -> Vec<(usize, f64)> {
        let positions = self.added(reference).iter().flat_map(|cause| self.model.positions(cause));
        positions.map(|k| (k, self.model.axes[k].coordinate(self.neutral(k)))).collect()
    }
}
