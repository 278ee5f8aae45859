//! Scores as sums of squares: for your own least-squares solver.

use super::error::{Error, refuse};
use super::population::Evaluator;
use crate::calibrate::DIFFERENCE;
use crate::evaluator::{Differences, Evaluator as _, Job, Population, Pull, Score};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::Accumulation;

/// Candidates that are simulated together: they fill blocks of lanes, and their results stay below 100 MB.
const PART: usize = 128;

/// The same for a GPU: with their neighbours they occupy a large one.
const PART_ON_A_DEVICE: usize = 8192;

/// Differences of a run in f32, as shares of the ranges: with three times as much, derivatives are three times as wrong because residuals
/// are nonlinear; with less, rounding hides the effect of parameters that matter little.
const DIFFERENCE_IN_F32: f64 = 1e-3;

/// The least difference of a value in f32, as a share of it: four units in the last place, so that it is not rounded to 0.
const LEAST_IN_F32: f64 = 4.0 * f32::EPSILON as f64;

/// The normal equations of one candidate, for the residuals r of [`Evaluator::residuals`] and their derivatives J with respect to the p
/// parameters: a Gauss-Newton step d solves JᵀJ d = -Jᵀr.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    /// JᵀJ, p x p numbers, row by row; per unit of both parameters.
    pub jtj: Vec<f64>,
    /// Jᵀr, p numbers, half the gradient of the score; per unit of the parameter.
    pub jtr: Vec<f64>,
    /// rᵀr, the score.
    pub rtr: f64,
}

impl Evaluator {
    /// Residuals whose sum of squares is the score, one vector per candidate, from free runs in f64. The vector has the drives one after the
    /// other, of each the residuals of spacing, then of speed, then of acceleration, one per sample: simulated minus measured, with the weights
    /// of the measure. They are 0 before the first simulated sample and for a signal that the measure leaves out. All residuals of a candidate
    /// whose score is infinite are infinite.
    ///
    /// A measure is a sum of norms, and the squares of residuals e add up to its norm w |e| if e is multiplied by √(w / |e|). So the factor
    /// depends on the candidate, and a solver that takes derivatives of these residuals minimises the measure itself.
    ///
    /// # Errors
    /// As [`Evaluator::scores`], and for Theil's coefficients, which are not norms of residuals.
    pub fn residuals(&self, candidates: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let mut found = Vec::new();
        for part in self.whole(candidates)?.chunks(PART) {
            found.extend(self.residuals_of(part)?);
        }
        Ok(found)
    }

    /// The normal equations of the same residuals, one per candidate, from finite differences: p + 2 simulations on each drive. An evaluator
    /// on a GPU computes them there, in f32 with compensated sums and larger differences; the others compute them in f64. Where the
    /// score of a candidate is infinite, or the run of a neighbour fails, `rtr` is infinite and the other numbers are NaN. With a
    /// convention that rounds delays to whole samples the derivatives with respect to a delay are meaningless: fix it.
    ///
    /// # Errors
    /// As [`Evaluator::residuals`].
    pub fn normal_equations(&mut self, candidates: &[f64]) -> Result<Vec<NormalEquations>, Error> {
        self.check_norms()?;
        let candidates = self.whole(candidates)?;
        let (mut rest, mut found) = (candidates.as_slice(), Vec::new());
        let mut on_device = self.inner.adapter().is_some();
        while !rest.is_empty() {
            let (now, later) = rest.split_at(rest.len().min(if on_device { PART_ON_A_DEVICE } else { PART }));
            if let Some(equations) = self.normal_equations_of(now, on_device)? {
                found.extend(equations);
                rest = later;
            } else {
                // The device has failed, and the CPU continues.
                on_device = false;
            }
        }
        Ok(found)
    }

    fn residuals_of(&self, candidates: &[Vec<f64>]) -> anyhow::Result<Vec<Vec<f64>>> {
        let lanes = self.exact()?;
        let cases = lanes.cases();
        let feasible = self.feasible(lanes, candidates)?;
        let population = self.population(feasible.iter().map(|i| &candidates[*i]));
        let samples: usize = cases.iter().map(|case| 3 * case.s.len()).sum();
        let mut all = vec![Vec::with_capacity(samples); candidates.len()];
        // The score is the mean over the drives.
        let share = (1.0 / cases.len() as f64).sqrt();
        for case in 0..cases.len() {
            let own = lanes.norm_residuals(&Job { case, population: &population })?;
            for (i, own) in feasible.iter().zip(own) {
                all[*i].extend(own.into_iter().map(|residual| share * residual));
            }
        }
        all.iter_mut().for_each(|residuals| residuals.resize(samples, f64::INFINITY));
        Ok(all)
    }

    /// `None` if they were to be computed on a device that has failed.
    fn normal_equations_of(
        &mut self,
        candidates: &[Vec<f64>],
        on_device: bool,
    ) -> anyhow::Result<Option<Vec<NormalEquations>>> {
        let feasible =
            if on_device { self.feasible_on_device(candidates)? } else { self.feasible(self.exact()?, candidates)? };
        let (space, p) = (&self.prepared.space, self.free.len());
        let (mut rows, mut differences) = (Vec::new(), Vec::new());
        for i in &feasible {
            let moved = |free: &usize| {
                let [lower, upper] = space.bounds[*free];
                let from = candidates[*i][*free];
                let step = match on_device {
                    true => (DIFFERENCE_IN_F32 * (upper - lower)).max(LEAST_IN_F32 * from.abs()),
                    false => DIFFERENCE * (upper - lower),
                };
                let to = if from + step > upper { from - step } else { from + step };
                // A device rounds both.
                let step = if on_device { f64::from(to as f32) - f64::from(from as f32) } else { to - from };
                (to, step)
            };
            let (values, steps): (Vec<f64>, Vec<f64>) = self.free.iter().map(moved).unzip();
            differences.push(Differences { first: rows.len(), steps });
            rows.push(candidates[*i].clone());
            for (free, value) in self.free.iter().zip(values) {
                let mut neighbour = candidates[*i].clone();
                neighbour[*free] = value;
                rows.push(neighbour);
            }
        }
        let population = self.population(rows.iter());
        let none = NormalEquations { jtj: vec![f64::NAN; p * p], jtr: vec![f64::NAN; p], rtr: f64::INFINITY };
        let zero = NormalEquations { jtj: vec![0.0; p * p], jtr: vec![0.0; p], rtr: 0.0 };
        let mut sums = vec![zero; feasible.len()];
        let cases = self.drives();
        let share = 1.0 / cases as f64;
        for case in 0..cases {
            let job = Job { case, population: &population };
            let slopes = if on_device {
                let Some(slopes) = self.inner.slopes(&job, &differences)? else { return Ok(None) };
                slopes
            } else {
                self.exact()?.slopes(&job, &differences, Pull::NONE)?
            };
            for (sum, slopes) in sums.iter_mut().zip(&slopes) {
                sum.rtr += share * slopes.cost;
                for a in 0..p {
                    sum.jtr[a] += share * 0.5 * slopes.gradient[a];
                    // Of r = e √(w / |e|) the derivatives are √(w / |e|) (E - e eᵀE / (2 |e|²)), E those of e. The majorant has w EᵀE / |e|, the
                    // curvature also -w Eᵀe eᵀE / |e|³.
                    for b in 0..p {
                        let product = 0.25 * slopes.majorant[(a, b)] + 0.75 * slopes.curvature[(a, b)];
                        sum.jtj[a * p + b] += share * product;
                    }
                }
            }
        }
        let mut all = vec![none; candidates.len()];
        for (i, sum) in feasible.into_iter().zip(sums).filter(|(_, sum)| sum.rtr.is_finite()) {
            all[i] = sum;
        }
        Ok(Some(all))
    }

    /// The places of the candidates with a finite score on every drive, by the evaluator.
    fn feasible_on_device(&mut self, candidates: &[Vec<f64>]) -> anyhow::Result<Vec<usize>> {
        let free = |candidate: &Vec<f64>| self.free.iter().map(|i| candidate[*i]).collect::<Vec<f64>>();
        let values: Vec<f64> = candidates.iter().flat_map(free).collect();
        let scores = self.scores(&values)?;
        Ok((0..candidates.len()).filter(|i| scores[*i].is_finite()).collect())
    }

    /// The same in f64.
    fn feasible(&self, lanes: &Lanes, candidates: &[Vec<f64>]) -> anyhow::Result<Vec<usize>> {
        let mut feasible: Vec<usize> = (0..candidates.len()).filter(|i| self.is_possible(&candidates[*i])).collect();
        for case in 0..lanes.cases().len() {
            let population = self.population(feasible.iter().map(|i| &candidates[*i]));
            let scores = lanes.pulled(&Job { case, population: &population }, Pull::NONE)?;
            let has_score = |score: &Score| matches!(score, Score::Value(value) if value.is_finite());
            let kept = feasible.into_iter().zip(scores).filter(|(_, (score, _))| has_score(score));
            feasible = kept.map(|(i, _)| i).collect();
        }
        Ok(feasible)
    }

    fn population<'p>(&self, candidates: impl Iterator<Item = &'p Vec<f64>>) -> Population {
        let mut population = Population::new(&self.prepared.space.symbols);
        candidates.for_each(|candidate| population.push(candidate));
        population
    }

    /// Refuses a measure that is not a sum of norms.
    fn check_norms(&self) -> anyhow::Result<()> {
        let gof = self.prepared.reference.gof();
        if gof.accumulation() == Accumulation::Theil {
            refuse!(
                "gof {gof} has no residuals whose squares add up to it; expected a measure other than u; with {gof} use scores"
            );
        }
        Ok(())
    }

    /// The evaluator in f64.
    fn exact(&self) -> anyhow::Result<&Lanes> {
        self.check_norms()?;
        let (cases, gof) = (self.prepared.reference.cases(), self.prepared.reference.gof());
        if let Some(lanes) = self.exact.get() {
            return Ok(lanes);
        }
        let lanes = Lanes::new(cases.to_vec(), *gof, LanesPrecision::F64)?;
        Ok(self.exact.get_or_init(|| lanes))
    }
}
