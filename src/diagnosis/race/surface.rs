//! The objective of a fit: the loss of a model over some drives, at one horizon.

use super::Horizon;
use super::loss::{Counts, Losses, SHORTFALL, Scale, Sizes, of_squares, slopes};
use crate::calibrate::descent;
use crate::diagnose::DiagnoseError;
use crate::diagnose::likelihood::model::Model;
use crate::evaluator::{Differences, Products, Pull, Slopes, Soft};
use crate::lanes::Bins;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Continuation of runs beyond a collision, and the penalty for it.
const SOFT: Soft = Soft { least: 0.1, price: 1.0 };
/// Finite-difference step, as a share of an axis; a limit that is reached now and then needs a step that changes at least one sample.
const STEP: f64 = 1e-4;

/// The loss of a model over the parts that count.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// The model, over all parts.
    pub model: &'a Model,
    /// Bins of every part.
    pub sizes: &'a [Sizes],
    /// Scales of every part.
    pub scales: &'a [Scale],
    /// Which parts count.
    pub counts: &'a [bool],
    /// The horizon of the loss.
    pub horizon: Horizon,
    /// Time constant of the correction \[s\]; `None`: none.
    pub correction_s: Option<f64>,
}

impl Surface<'_> {
    /// The parameter values at a point.
    #[must_use]
    pub fn values(&self, place: &[f64]) -> Vec<f64> {
        self.model.axes.iter().zip(place).map(|(axis, u)| axis.value(*u)).collect()
    }

    /// The point of parameter values.
    #[must_use]
    pub fn place(&self, values: &[f64]) -> Vec<f64> {
        self.model.axes.iter().zip(values).map(|(axis, value)| axis.coordinate(*value)).collect()
    }

    /// Coordinates that are fixed.
    #[must_use]
    pub fn fixed(&self) -> Vec<usize> {
        (0..self.model.axes.len()).filter(|&k| self.model.axes[k].is_fixed()).collect()
    }

    /// Number of bins of the parts that count.
    #[must_use]
    pub fn bins(&self) -> usize {
        self.parts().into_iter().map(|part| self.sizes[part].count()).sum()
    }

    fn parts(&self) -> Vec<usize> {
        (0..self.counts.len()).filter(|&part| self.counts[part]).collect()
    }

    fn pull(&self, part: usize) -> Pull {
        let share = self.correction_s.map_or(0.0, |seconds| (self.model.dt(part) / seconds).min(1.0));
        Pull { share, soft: Some(SOFT) }
    }

    /// Number of times the parts that count come closer to the car ahead than one of these shares of the smallest measured spacing, or
    /// fail.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub fn too_close(&self, values: &[f64], shares: &[f64]) -> Result<usize, DiagnoseError> {
        let candidate = [values.to_vec()];
        let mut count = 0;
        for (part, share) in self.parts().into_iter().flat_map(|part| shares.iter().map(move |share| (part, share))) {
            let least = share * self.scales[part].least;
            let pull = Pull { soft: Some(Soft { least, price: 0.0 }), ..self.pull(part) };
            let runs = self.model.squares(part, &candidate, pull, self.sizes[part].bins(self.horizon))?;
            let is_far = |run: &Vec<[f64; 4]>| run.iter().all(|sums| sums[SHORTFALL] <= 0.0);
            count += usize::from(!runs[0].as_ref().is_some_and(is_far));
        }
        Ok(count)
    }

    /// Losses of candidates on the parts that count; infinite for a run that fails.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub fn losses(&self, candidates: &[Vec<f64>]) -> Result<Vec<Losses>, DiagnoseError> {
        let parts = self.parts();
        let on = |&part: &usize| {
            let sizes = &self.sizes[part];
            self.model.squares(part, candidates, self.pull(part), sizes.bins(self.horizon))
        };
        let by_part: Vec<_> = parts.par_iter().map(on).collect::<Result<_, _>>()?;
        let one = |i: usize| {
            let mut losses = Losses { parts: vec![None; self.counts.len()] };
            for (part, runs) in parts.iter().zip(&by_part) {
                losses.parts[*part] = Some(of_squares(runs[i].as_deref(), &self.sizes[*part]));
            }
            losses
        };
        Ok((0..candidates.len()).map(one).collect())
    }
}

impl descent::Surface for Surface<'_> {
    type Error = DiagnoseError;

    fn dimensions(&self) -> usize {
        self.model.axes.len()
    }

    fn is_logarithm(&self) -> bool {
        !self.horizon.is_whole()
    }

    fn costs(&self, places: &[Vec<f64>], _: Pull) -> Result<Vec<f64>, DiagnoseError> {
        let values: Vec<Vec<f64>> = places.iter().map(|place| self.values(place)).collect();
        let losses = self.losses(&values)?;
        Ok(losses.iter().map(|losses| losses.cost(self.horizon, self.scales, SOFT.price)).collect())
    }

    fn slopes(&self, places: &[&Vec<f64>], held: &[usize], _: Pull) -> Result<Vec<Slopes>, DiagnoseError> {
        let n = self.model.axes.len();
        let moved: Vec<usize> = (0..n).filter(|k| !held.contains(k)).collect();
        let (mut candidates, mut differences) = (Vec::new(), Vec::new());
        for place in places {
            let step = |&k: &usize| {
                let size = STEP.max(self.model.axes[k].step);
                if place[k] + size > 1.0 { -size } else { size }
            };
            let steps: Vec<f64> = moved.iter().map(step).collect();
            let first = candidates.len();
            candidates.push(self.values(place));
            for (&k, step) in moved.iter().zip(&steps) {
                let mut place = (*place).clone();
                place[k] += step;
                candidates.push(self.values(&place));
            }
            differences.push(Differences { first, steps });
        }
        let parts = self.parts();
        let bins = self.bins() as f64;
        let on = |&part: &usize| {
            let sizes = &self.sizes[part];
            let products =
                self.model.products(part, &candidates, self.pull(part), &differences, sizes.bins(self.horizon))?;
            let (scale, all) = (&self.scales[part], Counts { bins, parts: parts.len() as f64 });
            let slopes = |products: &Option<Products<'_>>| match products {
                Some(products) => slopes(self.horizon, products, moved.len(), (sizes, scale), all, SOFT.price),
                None => failed(moved.len()),
            };
            Ok(products.iter().map(slopes).collect())
        };
        let by_part: Vec<Vec<Slopes>> = parts.par_iter().map(on).collect::<Result<_, DiagnoseError>>()?;
        let whole = |i: usize| {
            let mut sum = Slopes {
                cost: 0.0,
                gradient: DVector::zeros(n),
                curvature: DMatrix::zeros(n, n),
                majorant: DMatrix::zeros(n, n),
            };
            for slopes in by_part.iter().map(|slopes| &slopes[i]) {
                sum.cost += slopes.cost;
                for (a, &k) in moved.iter().enumerate() {
                    sum.gradient[k] += slopes.gradient[a];
                    for (b, &l) in moved.iter().enumerate() {
                        sum.curvature[(k, l)] += slopes.curvature[(a, b)];
                        sum.majorant[(k, l)] += slopes.majorant[(a, b)];
                    }
                }
            }
            sum
        };
        Ok((0..places.len()).map(whole).collect())
    }
}

fn failed(n: usize) -> Slopes {
    let (vector, matrix) = (DVector::zeros(n), DMatrix::zeros(n, n));
    Slopes { cost: f64::INFINITY, gradient: vector, curvature: matrix.clone(), majorant: matrix }
}

impl Sizes {
    /// The bins in the form of the lanes.
    #[must_use]
    pub fn bins(&self, horizon: Horizon) -> Bins<'_> {
        // Over a second the noise of a speed averages out; NRMSE(s,v,a) uses the acceleration of each sample.
        let mean = if horizon.is_whole() { 0 } else { self.second };
        Bins { of: &self.of, count: self.count(), mean }
    }
}
