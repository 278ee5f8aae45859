//! The score of several drives, each at its own distance from a common point.

use crate::calibrate::{DIFFERENCE, SearchSpace, descent};
use crate::diagnose::likelihood::space::Axis;
use crate::evaluator::{Differences, EvaluateError, Evaluator, Job, Population, Pull, Score, Share, Slopes};
use crate::lanes::Lanes;
use rayon::prelude::*;

/// The score of these drives; a driver's own parameters are displaced from the common ones. A drive that fails makes it infinite.
#[derive(Debug, Clone)]
pub struct Displaced<'a> {
    pub lanes: &'a Lanes,
    pub space: &'a SearchSpace,
    pub axes: &'a [Axis],
    /// Each drive with the displacement of its coordinates.
    pub drives: Vec<(usize, &'a [f64])>,
}

impl Displaced<'_> {
    /// The parameters at a point, displaced.
    pub fn values(axes: &[Axis], place: &[f64], displaced: &[f64]) -> Vec<f64> {
        axes.iter().zip(place).zip(displaced).map(|((axis, u), by)| axis.value(u + by)).collect()
    }

    fn population(&self, places: &[Vec<f64>], displaced: &[f64]) -> Population {
        let mut population = Population::new(&self.space.symbols);
        places.iter().for_each(|place| population.push(&Self::values(self.axes, place, displaced)));
        population
    }

    fn shares(&self) -> Vec<Share> {
        let cases = self.lanes.cases();
        self.drives.iter().map(|(case, _)| cases[*case].share(self.lanes.gof())).collect()
    }
}

impl descent::Surface for Displaced<'_> {
    type Error = EvaluateError;

    fn dimensions(&self) -> usize {
        self.axes.len()
    }

    fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, EvaluateError> {
        let on = |&(case, displaced): &(usize, &[f64])| {
            self.lanes.pulled(&Job { case, population: &self.population(places, displaced) }, pull)
        };
        let by_drive: Vec<Vec<(Score, f64)>> = self.drives.par_iter().map(on).collect::<Result<_, _>>()?;
        let shares = self.shares();
        let cost = |i: usize| match Score::joint(by_drive.iter().zip(&shares).map(|(own, share)| (own[i].0, *share))) {
            Score::Value(value) if value.is_finite() => value,
            _ => f64::INFINITY,
        };
        Ok((0..places.len()).map(cost).collect())
    }

    fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, EvaluateError> {
        let n = self.axes.len();
        let moved: Vec<usize> = (0..n).filter(|k| !held.contains(k)).collect();
        let (mut all, mut differences) = (Vec::new(), Vec::new());
        for place in places {
            let step = |&k: &usize| if place[k] + DIFFERENCE > 1.0 { -DIFFERENCE } else { DIFFERENCE };
            let steps: Vec<f64> = moved.iter().map(step).collect();
            let first = all.len();
            all.push((*place).clone());
            for (&k, step) in moved.iter().zip(&steps) {
                let mut place = (*place).clone();
                place[k] += step;
                all.push(place);
            }
            differences.push(Differences { first, steps });
        }
        let on = |&(case, displaced): &(usize, &[f64])| {
            self.lanes.slopes(&Job { case, population: &self.population(&all, displaced) }, &differences, pull)
        };
        let by_drive: Vec<Vec<Slopes>> = self.drives.par_iter().map(on).collect::<Result<_, _>>()?;
        let shares = self.shares();
        let together = |i: usize| {
            let of_drives: Vec<&Slopes> = by_drive.iter().map(|slopes| &slopes[i]).collect();
            Slopes::together(&of_drives, &shares, &moved, n)
        };
        Ok((0..places.len()).map(together).collect())
    }
}

/// Half the square of a score, over a scale. The noise of a driver does not change with his parameters, so his likelihood is that of squares;
/// with the score at the present parameters as the scale, it has the slopes of the score there.
#[derive(Debug)]
pub struct Squared<S> {
    /// The score.
    pub surface: S,
    /// The scale.
    pub scale: f64,
}

impl<S: descent::Surface> descent::Surface for Squared<S> {
    type Error = S::Error;

    fn dimensions(&self) -> usize {
        self.surface.dimensions()
    }

    fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, S::Error> {
        let costs = self.surface.costs(places, pull)?;
        Ok(costs.into_iter().map(|cost| 0.5 * cost * cost / self.scale).collect())
    }

    fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, S::Error> {
        let squared = |slopes: Slopes| {
            let factor = slopes.cost / self.scale;
            Slopes {
                cost: 0.5 * slopes.cost * factor,
                curvature: slopes.curvature * factor
                    + &slopes.gradient * slopes.gradient.transpose() * (1.0 / self.scale),
                majorant: slopes.majorant * factor,
                gradient: slopes.gradient * factor,
            }
        };
        Ok(self.surface.slopes(places, held, pull)?.into_iter().map(squared).collect())
    }
}
