//! Judges a model on drivers who are left out of its fits.
//!
//! Drivers differ, and a pooled law makes these differences look like a cause. So each driver first gets an own base law, near the common
//! one, under every model alike. A cause may be that of some drivers only: a model with causes is scored as a mixture of drivers with
//! them, at one size, and drivers without.

use super::fit::{Field, Judged};
use super::loss::{Losses, SIGNALS};
use super::mixture::{DriverFit, Mixture, Ratios, SIZES};
use super::own::own_law;
use super::policy::Policy;
use super::surface::Surface;
use super::{Entry, Horizon, OF_A_NAME};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::{DiagnoseError, Watching};
use rayon::prelude::*;

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
        (added, reference): (&[(usize, f64)], Option<&Judged>),
        watching: &Watching<'_>,
    ) -> Result<(), DiagnoseError> {
        for (fold, common) in judged.folds.iter().enumerate() {
            let left_out: Vec<bool> = self.parts.folds.iter().map(|own| *own == fold).collect();
            let surface = self.surface(model, &left_out, horizon);
            let at = |size: f64| {
                let mut place = surface.place(common);
                for &(k, neutral) in added {
                    place[k] = (neutral + size * (place[k] - neutral)).clamp(0.0, 1.0);
                }
                self.with_own_law(&surface, &place, watching)
            };
            let Some(reference) = reference else {
                for own in at(1.0)? {
                    judged.held.take_from(own.losses);
                    judged.drivers.push(DriverFit { unit: own.unit, fold, cost: own.cost, ratios: None });
                }
                continue;
            };
            let sizes: Vec<Vec<OwnFit>> = SIZES.into_iter().map(at).collect::<Result<_, DiagnoseError>>()?;
            for (driver, own) in sizes[0].iter().enumerate() {
                let Some(of) = reference.drivers.iter().find(|of| of.unit == own.unit) else { continue };
                let ratio = |k: usize| {
                    let ratio = (of.cost - sizes[k][driver].cost) * self.observations(own.unit);
                    // A driver whom the reference cannot follow at all says nothing of the causes.
                    if ratio < f64::INFINITY { ratio } else { 0.0 }
                };
                let ratios = Some(std::array::from_fn(ratio));
                judged.drivers.push(DriverFit { unit: own.unit, fold, cost: of.cost, ratios });
            }
        }
        if let Some(reference) = reference {
            judged.held.parts.clone_from(&reference.held.parts);
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
            let gain = folds[driver.fold].log_likelihood(ratios) / self.observations(driver.unit);
            driver.cost -= gain;
            let parts = judged.held.parts.iter_mut().zip(&self.parts.units);
            for part in parts.filter(|(_, unit)| **unit == driver.unit).filter_map(|(part, _)| part.as_mut()) {
                part.mse.iter_mut().flatten().for_each(|mse| *mse *= (-gain).exp());
            }
        }
    }

    /// Half the number of observations of a driver: each error of a bin counts as one, because errors last for some seconds.
    fn observations(&self, unit: usize) -> f64 {
        let parts = self.parts.units.iter().zip(&self.sizes).filter(|(own, _)| **own == unit);
        let bins: usize = parts.map(|(_, sizes)| sizes.count()).sum();
        0.5 * (SIGNALS * bins.max(1)) as f64
    }

    /// Every driver who counts, with an own base law near the common place.
    fn with_own_law(
        &self,
        surface: &Surface<'_>,
        common: &[f64],
        watching: &Watching<'_>,
    ) -> Result<Vec<OwnFit>, DiagnoseError> {
        let mut held = surface.fixed();
        let is_of_base = |k: &usize| surface.model.variant.is_of_base(surface.model.symbols[*k]);
        held.extend((0..surface.model.symbols.len()).filter(|k| !is_of_base(k)));
        let mut drivers = self.parts.units.clone();
        drivers.sort_unstable();
        drivers.dedup();
        let counts = |driver: usize| -> Vec<bool> {
            self.parts.units.iter().zip(surface.counts).map(|(unit, counts)| *counts && *unit == driver).collect()
        };
        let one = |(unit, counts): &(usize, Vec<bool>)| {
            let surface = Surface { counts, ..*surface };
            let found = own_law(surface, common, &held, watching)?;
            let (place, cost) = found.as_ref().map_or((common, f64::INFINITY), |found| (&found.place, found.cost));
            let losses = surface.losses(&[surface.values(place)])?.remove(0);
            Ok(OwnFit { unit: *unit, cost, losses })
        };
        let masks = drivers.into_iter().map(|driver| (driver, counts(driver)));
        let masks: Vec<(usize, Vec<bool>)> = masks.filter(|(_, mask)| mask.contains(&true)).collect();
        masks.par_iter().map(one).collect()
    }
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
