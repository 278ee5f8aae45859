//! Scores of many candidates: for your own optimiser.

use super::calibration::{Calibration, Prepared};
use super::drive::Drive;
use super::error::{Error, Usage, refuse};
use crate::evaluator::{Evaluator as Inner, Population, Score};
use crate::lanes::Lanes;
use crate::reference::Trace;
use crate::rescore;
use rayon::prelude::*;
use std::cell::OnceCell;

/// Scores candidates of one model on one or several drives.
///
/// ```no_run
/// let drive = leadlag::read("platoon.csv")?.follower(1)?;
/// let mut evaluator = leadlag::Calibration::of("idm")?.evaluate_on(&[&drive])?;
/// let candidates = [evaluator.lower(), evaluator.upper()].concat();
/// println!("{:?}", evaluator.scores(&candidates)?);
/// # Ok::<(), leadlag::Error>(())
/// ```
pub struct Evaluator {
    pub(super) inner: Box<dyn Inner>,
    pub(super) prepared: Prepared,
    pub(super) free: Vec<usize>,
    /// The same cases in f64; made when derivatives are requested.
    pub(super) exact: OnceCell<Lanes>,
    /// The candidates of a call that can be simulated, and their scores.
    population: Population,
    scores: Vec<Score>,
}

impl Calibration {
    /// An evaluator of candidates with the model, bounds, measure and evaluator of this calibration.
    ///
    /// # Errors
    /// For an invalid bound, a drive that lacks data of the model, or an evaluator that cannot be made.
    ///
    /// # Panics
    /// Without a drive.
    pub fn evaluate_on(&self, drives: &[&Drive]) -> Result<Evaluator, Error> {
        let prepared = self.prepare(&self.loaded(drives)?)?;
        let inner = self.build(&prepared.reference)?;
        let free = prepared.space.free();
        let population = Population::new(&prepared.space.symbols);
        Ok(Evaluator { inner, prepared, free, exact: OnceCell::new(), population, scores: Vec::new() })
    }
}

impl Evaluator {
    /// The parameters of a candidate, in order: those that are not fixed.
    #[must_use]
    pub fn parameters(&self) -> Vec<&'static str> {
        self.free.iter().map(|&i| self.prepared.space.symbols[i].name()).collect()
    }

    /// Their units.
    #[must_use]
    pub fn units(&self) -> Vec<&'static str> {
        self.free.iter().map(|&i| self.prepared.space.symbols[i].unit()).collect()
    }

    /// Their lower bounds.
    #[must_use]
    pub fn lower(&self) -> Vec<f64> {
        self.free.iter().map(|&i| self.prepared.space.bounds[i][0]).collect()
    }

    /// Their upper bounds.
    #[must_use]
    pub fn upper(&self) -> Vec<f64> {
        self.free.iter().map(|&i| self.prepared.space.bounds[i][1]).collect()
    }

    /// One score per candidate: the minimised measure, as a mean over the drives. Infinite if a run ends early, the score is undefined, or
    /// a parameter has a value that the equations do not allow, such as a negative headway, so that an optimiser may leave the bounds.
    /// `candidates` holds them contiguously, each with a value per parameter in the order of [`Evaluator::parameters`].
    ///
    /// # Errors
    /// If the number of values is not a multiple of the number of parameters, or the evaluator fails.
    pub fn scores(&mut self, candidates: &[f64]) -> Result<Vec<f64>, Error> {
        let whole = self.whole(candidates)?;
        let possible: Vec<bool> = whole.iter().map(|candidate| self.is_possible(candidate)).collect();
        self.population.clear();
        whole.iter().zip(&possible).filter(|(_, possible)| **possible).for_each(|(one, _)| self.population.push(one));
        self.scores.clear();
        self.scores.resize(self.population.len(), Score::Rejected);
        if !self.scores.is_empty() {
            self.inner.evaluate(&self.population, &mut self.scores).map_err(anyhow::Error::from)?;
        }
        let value = |score: Option<&Score>| match score {
            Some(Score::Value(value)) if value.is_finite() => *value,
            _ => f64::INFINITY,
        };
        let mut scores = self.scores.iter();
        Ok(possible.iter().map(|possible| if *possible { value(scores.next()) } else { f64::INFINITY }).collect())
    }

    /// Simulated spacing \[m\], speed \[m/s\] and acceleration \[m/s²\] of each candidate on one drive, by the f64 reference, up to the end of
    /// the run. The first sample is the measured one.
    ///
    /// # Errors
    /// As [`Evaluator::scores`], and when the equations do not allow a value, with the number of the candidate, from 0.
    ///
    /// # Panics
    /// Without a drive of this number, from 0.
    pub fn simulate(&self, candidates: &[f64], drive: usize) -> Result<Vec<[Vec<f64>; 3]>, Error> {
        let (case, space) = (&self.prepared.reference.cases()[drive], &self.prepared.space);
        let one = |(k, candidate): (usize, &Vec<f64>)| -> anyhow::Result<[Vec<f64>; 3]> {
            let parameters = space.parameters(candidate);
            case.check(&parameters).map_err(|error| Usage(format!("candidate {k}: {error}")))?;
            let mut trace = Trace::default();
            rescore::outcome(case, &parameters, &mut trace)?;
            Ok([trace.s, trace.v, trace.a])
        };
        Ok(self.whole(candidates)?.par_iter().enumerate().map(one).collect::<anyhow::Result<_>>()?)
    }

    /// Number of drives.
    #[must_use]
    pub fn drives(&self) -> usize {
        self.prepared.reference.cases().len()
    }

    /// The evaluator, for the record: `lanes (plain)`, `gpu (plain) on NVIDIA ...`.
    #[must_use]
    pub fn device(&self) -> String {
        let on = self.inner.adapter().map_or(String::new(), |adapter| format!(" on {adapter}"));
        format!("{} ({}){on}", self.inner.name(), self.inner.precision())
    }

    /// True if the equations allow the values of a whole candidate.
    pub(super) fn is_possible(&self, candidate: &[f64]) -> bool {
        let parameters = self.prepared.space.parameters(candidate);
        self.prepared.reference.cases().iter().all(|case| case.check(&parameters).is_ok())
    }

    /// Candidates with the fixed parameters in their places.
    pub(super) fn whole(&self, candidates: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let width = self.free.len();
        if width == 0 || !candidates.len().is_multiple_of(width) {
            let names = self.parameters().join(", ");
            refuse!("candidates: expected {width} values each ({names}), found {} values altogether", candidates.len());
        }
        let space = &self.prepared.space;
        let whole = |candidate: &[f64]| {
            let mut all: Vec<f64> = space.bounds.iter().map(|bounds| bounds[0]).collect();
            self.free.iter().zip(candidate).for_each(|(&i, value)| all[i] = *value);
            all
        };
        Ok(candidates.chunks_exact(width).map(whole).collect())
    }
}
