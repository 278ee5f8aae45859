//! Own parameters of the drivers in a calibration of one law for many.

use super::bounds::unknown;
use super::calibration::{Calibration, Prepared};
use super::error::refuse;
use super::folds::drivers_of;
use super::loading::Loaded;
use crate::evaluator::Evaluator;
use crate::pooling::{LEAST_DRIVERS, partly_pooled};
use crate::result::assemble::OwnFit;
use crate::score::Accumulation;
use crate::text::option::OWN;

impl Calibration {
    /// Gives each driver own values of these parameters; all others are common. Own values are drawn towards the middle of their distribution
    /// over drivers, the more, the less the drives determine. The fit has the values in the middle, as for an unknown driver; its JSON has the
    /// distribution and the values of each driver.
    #[must_use]
    pub fn own(mut self, parameters: &[&str]) -> Calibration {
        self.own = parameters.iter().map(|&name| name.to_owned()).collect();
        self
    }

    /// Drives of each driver.
    ///
    /// # Errors
    /// If there are too few drivers for own parameters.
    pub(crate) fn own_drivers(&self, loaded: &[Loaded]) -> anyhow::Result<Vec<Vec<usize>>> {
        let drivers = drivers_of(loaded);
        let count = drivers.iter().max().map_or(0, |last| last + 1);
        if !self.own.is_empty() && count < LEAST_DRIVERS {
            let names = self.own.join(",");
            refuse!("{OWN} {names}: a distribution needs at least {LEAST_DRIVERS} drivers, found {count}");
        }
        let of = |driver: usize| (0..drivers.len()).filter(|drive| drivers[*drive] == driver).collect();
        Ok((0..count).map(of).collect())
    }

    /// Positions of the own parameters among those of the model.
    ///
    /// # Errors
    /// If one is unknown, fixed or given twice, or the measure has no derivatives.
    pub(crate) fn own_positions(&self, prepared: &Prepared) -> anyhow::Result<Vec<usize>> {
        let space = &prepared.space;
        let mut positions = Vec::new();
        for name in &self.own {
            let flag = format!("{OWN} {name}");
            let Some(at) = space.symbols.iter().position(|symbol| symbol.name() == name) else {
                return Err(unknown(&flag, name, &self.model, &space.symbols).into());
            };
            let wrong = match (space.bounds[at][0] == space.bounds[at][1], positions.contains(&at)) {
                (true, _) => "is fixed, so drivers cannot differ in it; free it, or leave it out",
                (_, true) => "is given twice",
                _ => {
                    positions.push(at);
                    continue;
                }
            };
            refuse!("{flag}: {name} {wrong}");
        }
        if !positions.is_empty() && self.gof.accumulation() == Accumulation::Theil {
            let gof = self.gof;
            refuse!("{OWN}: {gof} is no norm of residuals; minimise another measure, such as nrmse-sva");
        }
        Ok(positions)
    }

    /// Own parameters of the drivers, from a common candidate; `None` without any, or after a stop.
    pub(crate) fn own_fit(
        &self,
        prepared: &Prepared,
        loaded: &[Loaded],
        candidate: &[f64],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<OwnFit>> {
        let positions = self.own_positions(prepared)?;
        if positions.is_empty() {
            return Ok(None);
        }
        let drives = self.own_drivers(loaded)?;
        let cases = prepared.reference.cases();
        let found = partly_pooled(cases, self.gof, &prepared.space, (&positions, &drives), candidate, stop)?;
        Ok(found.map(|pooled| OwnFit { pooled, drives }))
    }
}
