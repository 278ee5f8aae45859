//! Calibration by derivatives: Gauss-Newton steps from many starts, under a pull towards the measurement that decreases.
//!
//! A goodness of fit is a sum of norms of residuals, so their derivatives give both its gradient and most of its curvature. Alone, such
//! steps end in the basin in which they start. If the simulated follower is pulled to the measured one after each step, all starts find the
//! same basin; as the pull decreases, they follow it. Such searches alternate with searches from the best point with one coordinate moved,
//! because basins often differ in one parameter. Runs continue beyond a collision with a penalty, because a score that ends there has no
//! slope out of it. When enough searches agree, the calibration ends.
//!
//! 1. Here: searches are repeated until enough agree.
//! 2. `record`: their effort and results, and the criterion to stop.
//! 3. `round`: one search, from its starts to the basins that it finds.
//! 4. `ending`: from a basin to its lowest exact score.
//!
//! `descent` and `step` are the Levenberg-Marquardt method, `objective` is their objective, and `together` simulates what several searches need.

pub mod descent;
mod ending;
mod objective;
mod record;
mod round;
mod step;
mod together;

use super::search::FLOOR;
use super::{CalibrateError, Calibration, OptimizerKind, Progress, Replicate, StopReason, Task};
use crate::convention::{Convention, Delay};
use crate::evaluator::{Case, EvaluateError};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::{Accumulation, GoodnessOfFit};
use ending::Basin;
pub use objective::DIFFERENCE;
use objective::{ACROSS, Objective};
use record::Record;
use std::future::Future;
use std::ops::ControlFlow;
use std::pin::Pin;
use together::{Queue, run};

/// Searches at most.
const SEARCHES: usize = 8;
/// Searches agree if their scores differ by no more than this share of the lower one, or of [`FLOOR`]: descents along the edge of the
/// feasible region leave nearly as much.
const AGREEMENT: f64 = 1e-3;
/// Number of searches that have to agree; one more for each other basin in which some ended.
const AGREEING: usize = 3;

/// The longest step of coarse runs \[s\]: three times that of most drives. Steps of 0.5 s miss optima. A law that is
/// unstable in such steps is still found, by the ends of searches.
const COARSE_S: f64 = 0.3;
/// Smallest number of samples of a coarse run.
const SAMPLES: usize = 100;

/// How searches simulate a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Detail {
    /// Some samples only, in longer steps: close enough for the search of basins.
    Coarse,
    /// All samples, with delays between them, so that the score is smooth in delays.
    Smooth,
    /// By the convention.
    Exact,
}

/// The evaluators of searches by derivatives, over the cases of a calibration.
pub(super) struct Ground {
    /// If it differs from the smooth one.
    coarse: Option<Lanes>,
    smooth: Lanes,
    /// If it differs from the smooth one.
    exact: Option<Lanes>,
}

impl Ground {
    /// `None` for another optimiser, and for Theil's coefficients, which are not norms of residuals.
    pub fn new(cases: &[Case], gof: &GoodnessOfFit, settings: &Calibration) -> Result<Option<Ground>, EvaluateError> {
        let Case { variant, convention, .. } = &cases[0];
        if settings.optimizer != OptimizerKind::Auto || gof.accumulation() == Accumulation::Theil {
            return Ok(None);
        }
        let lanes = |cases: Vec<Case>| Lanes::new(cases, *gof, LanesPrecision::F64);
        let floored = variant.perceives_late() && convention.delay == Delay::Floor;
        let between = |case: &Case| Case {
            convention: Convention { delay: Delay::Fractional, ..case.convention },
            ..case.clone()
        };
        let exact = floored.then(|| lanes(cases.to_vec())).transpose()?;
        let smooth: Vec<Case> = if floored { cases.iter().map(between).collect() } else { cases.to_vec() };
        let coarse: Vec<Case> = smooth.iter().map(|case| case.in_steps(COARSE_S, SAMPLES)).collect();
        let is_coarser = coarse.iter().zip(&smooth).any(|(coarse, smooth)| coarse.dt > smooth.dt);
        let coarse = is_coarser.then(|| lanes(coarse)).transpose()?;
        Ok(Some(Ground { coarse, smooth: lanes(smooth)?, exact }))
    }

    fn lanes(&self, detail: Detail) -> &Lanes {
        let other = match detail {
            Detail::Coarse => &self.coarse,
            Detail::Smooth => &None,
            Detail::Exact => &self.exact,
        };
        other.as_ref().unwrap_or(&self.smooth)
    }
}

/// How a search by derivatives ended.
pub(super) enum Ended {
    /// With a result.
    Found(Replicate),
    /// Searches disagree, or no candidate was feasible: another optimiser has to continue from the best so far.
    Open(Replicate),
}

/// One replicate under way.
struct Search<'a> {
    coarse: Objective<'a>,
    smooth: Objective<'a>,
    exact: Objective<'a>,
    /// The exact one, with differences across kinks.
    across: Objective<'a>,
    record: Record<'a>,
    /// Basins that searches finished.
    basins: Vec<Basin>,
}

/// Calibrates the variant of a ground on some of its cases, several searches side by side; `tell` also receives the place of the search.
pub(super) fn search(
    ground: &Ground,
    tasks: &[&Task<'_>],
    settings: &Calibration,
    tell: &(dyn Fn(usize, Progress) -> ControlFlow<()> + Sync),
) -> Result<Vec<Ended>, CalibrateError> {
    let queue = Queue::default();
    let tells: Vec<_> = (0..tasks.len()).map(|i| move |told: Progress| tell(i, told)).collect();
    let search = |(task, tell)| Box::pin(one(ground, &queue, task, settings, tell)) as Pin<Box<dyn Future<Output = _>>>;
    let searches = tasks.iter().copied().zip(tells.iter().map(|tell| tell as &(dyn Fn(_) -> _ + Sync))).map(search);
    run(ground, &queue, searches.collect())?.into_iter().collect()
}

/// One search.
async fn one(
    ground: &Ground,
    queue: &Queue,
    Task { space, cases, number }: &Task<'_>,
    settings: &Calibration,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Ended, CalibrateError> {
    let objective = |detail, difference| Objective::new(ground, queue, (detail, difference), cases.clone(), space);
    let mut search = Search {
        coarse: objective(Detail::Coarse, DIFFERENCE),
        smooth: objective(Detail::Smooth, DIFFERENCE),
        exact: objective(Detail::Exact, DIFFERENCE),
        across: objective(Detail::Exact, ACROSS),
        record: Record::new(settings, *number, progress),
        basins: Vec::new(),
    };
    let settled = search.is_settled().await?;
    let Search { exact, record: Record { evaluations, convergence, near, best, stopped, .. }, .. } = search;
    let open = best.is_none() || stopped.is_none() && !settled;
    let stop = stopped.unwrap_or(if settled { StopReason::Converged } else { StopReason::Evaluations });
    let (candidate, score) = match best {
        Some((place, score)) => (exact.candidate(&place), score),
        None => (Vec::new(), f64::INFINITY),
    };
    let replicate = Replicate { number: *number, candidate, score, evaluations, stop, convergence, near };
    Ok(if open { Ended::Open(replicate) } else { Ended::Found(replicate) })
}

impl Search<'_> {
    /// Searches until enough agree; true if they do.
    async fn is_settled(&mut self) -> Result<bool, CalibrateError> {
        let mut found = Vec::new();
        while found.len() < SEARCHES && !agree(&found) {
            found.push(self.round(found.len()).await?);
            if self.record.stopped.is_some() {
                return Ok(false);
            }
        }
        self.polish().await?;
        Ok(agree(&found))
    }

    fn keep(&mut self, place: Vec<f64>, score: f64) {
        let candidate = self.exact.candidate(&place);
        self.record.keep(place, candidate, score);
    }
}

/// True if enough searches reached the lowest of their scores. Each one without a result counts as a separate basin.
fn agree(found: &[f64]) -> bool {
    let mut scores = found.to_vec();
    scores.sort_by(f64::total_cmp);
    let mut basins: Vec<(f64, usize)> = Vec::new();
    for score in scores {
        match basins.last_mut() {
            Some((lowest, searches)) if score - *lowest <= AGREEMENT * lowest.abs().max(FLOOR) => *searches += 1,
            _ => basins.push((score, 1)),
        }
    }
    basins.first().is_some_and(|(lowest, searches)| lowest.is_finite() && *searches >= AGREEING + basins.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::agree;

    #[test]
    fn three_searches_agree_and_one_more_for_each_other_basin() {
        let inf = f64::INFINITY;
        for (found, expected) in [
            (&[][..], false),
            (&[0.5, 0.5], false),
            (&[0.5, 0.500_4, 0.5], true),
            (&[0.5, 0.500_6, 0.5], false),
            (&[0.6, 0.5, 0.5, 0.5], false),
            (&[0.6, 0.5, 0.5, 0.5, 0.5], true),
            (&[0.6, 0.600_1, 0.5, 0.5, 0.5, 0.5], true),
            (&[0.6, 0.7, 0.5, 0.5, 0.5, 0.5], false),
            (&[inf, inf, inf], false),
            (&[inf, inf, 0.5, 0.5, 0.5, 0.5], false),
            (&[inf, inf, 0.5, 0.5, 0.5, 0.5, 0.5], true),
            // Scores near 0 are compared with the floor.
            (&[1e-9, 1e-5, 1e-5], true),
            (&[1e-9, 1e-5, 1.1e-5], false),
        ] {
            assert_eq!(agree(found), expected, "{found:?}");
        }
    }
}
