//! Objective of a search by derivatives, in coordinates from 0 to 1.

use super::descent::{Shared, USUALLY};
use super::together::{How, Queue};
use super::{Detail, Ground};
use crate::calibrate::SearchSpace;
use crate::evaluator::{Case, Differences, EvaluateError, Evaluator, Pull, Score, Slopes, shares};
use crate::lanes::Lanes;
use crate::optimize::SearchBox;
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use std::ops::Range;

/// Finite difference in a coordinate, a share of its range: far above the rounding of f64, far below the scale of curvature.
pub const DIFFERENCE: f64 = 1e-6;
/// The same across kinks, which clips leave in a score: small minima lie between them.
pub const ACROSS: f64 = 1e-3;

/// The score of a variant over some cases.
pub struct Objective<'a> {
    lanes: &'a Lanes,
    queue: &'a Queue,
    detail: Detail,
    difference: f64,
    cases: Range<usize>,
    space: &'a SearchSpace,
    free: Vec<usize>,
    bounds: SearchBox,
}

impl<'a> Objective<'a> {
    pub fn new(
        ground: &'a Ground,
        queue: &'a Queue,
        (detail, difference): (Detail, f64),
        cases: Range<usize>,
        space: &'a SearchSpace,
    ) -> Objective<'a> {
        let (lanes, free, bounds) = (ground.lanes(detail), space.free(), space.search_box(true));
        Objective { lanes, queue, detail, difference, cases, space, free, bounds }
    }

    /// The cases of the score.
    pub fn cases(&self) -> &'a [Case] {
        &self.lanes.cases()[self.cases.clone()]
    }

    /// The measure to minimise.
    pub fn gof(&self) -> &'a GoodnessOfFit {
        self.lanes.gof()
    }

    /// A place as named parameters.
    pub fn parameters(&self, place: &[f64]) -> Parameters {
        self.space.parameters(&self.candidate(place))
    }

    /// A place as a candidate.
    pub fn candidate(&self, place: &[f64]) -> Vec<f64> {
        let point: Vec<f64> = place.iter().enumerate().map(|(i, u)| self.bounds.along(i, *u)).collect();
        self.space.complete(&self.free, &point, true)
    }

    /// The coordinate of a parameter, and its value as a coordinate.
    pub fn coordinate(&self, parameter: usize, value: f64) -> Option<(usize, f64)> {
        let at = self.free.iter().position(|free| *free == parameter)?;
        let (lower, upper) = (self.bounds.lower[at], self.bounds.upper[at]);
        // Parameters that span decades are searched by their logarithms.
        Some((at, (value - lower) / (upper - lower)))
    }

    fn how(&self, pull: Pull) -> How {
        How { detail: self.detail, cases: self.cases.clone(), pull }
    }

    /// Scores of points, and the mean of their squared shortfalls over the cases \[m²\].
    pub async fn scores(&self, places: &[Vec<f64>], pull: Pull) -> Vec<(Score, f64)> {
        self.penalised(places, pull, 0.0).await
    }

    /// The same; this price of each squared shortfall is part of the score of its case.
    async fn penalised(&self, places: &[Vec<f64>], pull: Pull, price: f64) -> Vec<(Score, f64)> {
        let candidates = places.iter().map(|place| self.candidate(place)).collect();
        let by_case = self.queue.scores(&self.how(pull), &self.space.symbols, candidates).await;
        let shares = shares(self.cases(), self.gof());
        let of_case = |(score, shortfall): (Score, f64)| match score {
            Score::Value(value) => Score::Value(value + price * shortfall),
            _ => score,
        };
        let mean = |i: usize| {
            let shortfall = by_case.iter().map(|scores| scores[i].1).sum::<f64>() / by_case.len() as f64;
            (Score::joint(by_case.iter().zip(&shares).map(|(scores, share)| (of_case(scores[i]), *share))), shortfall)
        };
        (0..places.len()).map(mean).collect()
    }
}

impl Shared for Objective<'_> {
    type Error = EvaluateError;

    const FIRST: &'static [usize] = &USUALLY;

    fn dimensions(&self) -> usize {
        self.free.len()
    }

    /// Scores and the cost of shortfalls.
    async fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, EvaluateError> {
        let price = pull.soft.map_or(0.0, |soft| soft.price);
        // The mean adds up all shortfalls at once; squares are pooled with the shortfall of each case, as their slopes are.
        let [of_case, price] = if self.gof().is_pooled() { [price, 0.0] } else { [0.0, price] };
        let cost = |(score, shortfall): (Score, f64)| match score {
            Score::Value(value) if value.is_finite() => value + price * shortfall,
            _ => f64::INFINITY,
        };
        Ok(self.penalised(places, pull, of_case).await.into_iter().map(cost).collect())
    }

    async fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, EvaluateError> {
        let n = self.dimensions();
        let moved: Vec<usize> = (0..n).filter(|i| !held.contains(i)).collect();
        let (mut all, mut differences) = (Vec::new(), Vec::new());
        for place in places {
            let step = |i: &usize| if place[*i] + self.difference > 1.0 { -self.difference } else { self.difference };
            differences.push(Differences { first: all.len(), steps: moved.iter().map(step).collect() });
            all.push(self.candidate(place));
            for i in &moved {
                let mut place = (*place).clone();
                place[*i] += step(i);
                all.push(self.candidate(&place));
            }
        }
        let by_case = self.queue.slopes(&self.how(pull), &self.space.symbols, all, differences).await;
        let shares = shares(self.cases(), self.gof());
        let whole = |k: usize| {
            let of_cases: Vec<&Slopes> = by_case.iter().map(|slopes| &slopes[k]).collect();
            Slopes::together(&of_cases, &shares, &moved, n)
        };
        Ok((0..places.len()).map(whole).collect())
    }
}
