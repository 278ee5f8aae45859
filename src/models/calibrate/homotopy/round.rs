//! One search: from its starts down into the basins that it finds.

use super::Search;
use super::descent::{APART, Course, Shared, Walker, Watch, descend_on, merged, turn};
use super::ending::{Basin, met, pulled};
use super::record::Record;
use crate::calibrate::CalibrateError;
use crate::evaluator::Pull;
use crate::optimize::stream;
use rand::{Rng, RngExt};

/// Number of random points at the start of a pulled search, and the share of all evaluations that they may use.
const SCREENED: usize = 96;
const SCREENING: f64 = 0.25;
/// Number of starts that descend, without a pull and under one, which brings them together; their root mean square distance over the
/// coordinates is at least [`APART`].
const STARTS: usize = 10;
const PULLED: usize = 6;
/// Iterations of a search without a pull: with evaluations for fewer, fewer starts descend.
const AFFORDED: usize = DIRECT[0].0 + DIRECT[1].0 + DIRECT[2].0;
/// Number of points that continue to the end.
const FINAL: usize = 3;
/// Gain of an iteration, as a share of the cost, below which a descent has converged.
const ROUGH: f64 = 1e-4;
/// Without a pull: iterations, and the number of points that continue after them.
const DIRECT: [(usize, usize); 3] = [(3, STARTS), (4, 5), (8, FINAL)];
/// Shares of the residuals that are taken back after each step, one level after the other.
const LEVELS: [f64; 5] = [0.1, 0.03, 0.01, 0.003, 0.001];
/// Iterations of a level, and of the runs without a pull that follow.
const TURNS: usize = 4;
const FREE_TURNS: usize = 10;
/// A pull from which on costs are nearly those of free runs.
const WEAK: f64 = 0.003;
/// At changes to a weaker pull, points whose cost exceeds this multiple of the best are dropped.
const BEHIND: [f64; 2] = [1.5, 1.25];

/// Removes points that have met a better one, and stops those that have entered one of these basins.
struct Merging<'r, 'a> {
    record: &'r mut Record<'a>,
    basins: &'r [Basin],
}

impl Watch for Merging<'_, '_> {
    fn spend(&mut self, simulations: usize) -> bool {
        self.record.spend(simulations)
    }

    fn turned(&self, walkers: &mut Vec<Walker>) {
        *walkers = merged(std::mem::take(walkers));
        walkers.iter_mut().filter(|walker| met(self.basins, walker).is_some()).for_each(Walker::stop);
    }
}

impl Search<'_> {
    /// The lowest exact score of one search; infinite if it is stopped or finds nothing. Searches with even numbers are pulled; the others
    /// start from the best point with one coordinate moved, or from random points if there is none.
    pub(super) async fn round(&mut self, round: usize) -> Result<f64, CalibrateError> {
        let settings = self.record.settings;
        let mut rng = stream(settings.seed, self.record.number, round as u64, 0);
        let n = self.smooth.dimensions();
        let screened = SCREENED.min((SCREENING * settings.stop.max_evaluations as f64) as usize);
        let is_pulled = round.is_multiple_of(2);
        let starts: Vec<Vec<f64>> = match &self.record.best {
            Some((best, _)) if !is_pulled => moved(best, &mut rng),
            _ => (0..screened).map(|_| (0..n).map(|_| rng.random()).collect()).collect(),
        };
        let walkers = if is_pulled { self.homotopy(&starts).await? } else { self.directly(&starts).await? };
        self.finish(merged(walkers), FINAL).await
    }

    /// Without a pull.
    async fn directly(&mut self, places: &[Vec<f64>]) -> Result<Vec<Walker>, CalibrateError> {
        let pull = pulled(0.0);
        let mut starts = self.best_starts(places, pull, STARTS).await?;
        let mut walkers = Vec::new();
        for (turns, kept) in DIRECT {
            let course = Course { pull, turns, tolerance: ROUGH };
            let mut watch = Merging { record: &mut self.record, basins: &self.basins };
            let next = merged(descend_on(&self.coarse, starts, &[], course, &mut watch).await?);
            if next.is_empty() {
                break;
            }
            walkers = next;
            walkers.truncate(kept);
            starts = walkers.iter().map(|walker| walker.place.clone()).collect();
        }
        Ok(walkers)
    }

    /// Under a pull that fades.
    async fn homotopy(&mut self, places: &[Vec<f64>]) -> Result<Vec<Walker>, CalibrateError> {
        let mut starts = self.best_starts(places, pulled(LEVELS[0]), PULLED).await?;
        for share in LEVELS {
            let course = Course { pull: pulled(share), turns: TURNS, tolerance: ROUGH };
            let mut watch = Merging { record: &mut self.record, basins: &[] };
            let walkers = merged(descend_on(&self.coarse, starts, &[], course, &mut watch).await?);
            let Some(best) = walkers.first().map(|walker| walker.cost) else { return Ok(walkers) };
            let weak = usize::from(share <= WEAK);
            let near = walkers.into_iter().filter(|walker| walker.cost <= best * BEHIND[weak]);
            starts = near.map(|walker| walker.place).collect();
        }
        let course = Course { pull: pulled(0.0), turns: FREE_TURNS, tolerance: ROUGH };
        let mut watch = Merging { record: &mut self.record, basins: &self.basins };
        Ok(descend_on(&self.coarse, starts, &[], course, &mut watch).await?)
    }

    /// The best distinct points, at most this many and as many as there are evaluations for ([`AFFORDED`]); none if there are too few to screen.
    async fn best_starts(
        &mut self,
        places: &[Vec<f64>],
        pull: Pull,
        most: usize,
    ) -> Result<Vec<Vec<f64>>, CalibrateError> {
        if !self.record.spend(places.len()) {
            return Ok(Vec::new());
        }
        let costs = self.coarse.costs(places, pull).await?;
        let left = self.record.settings.stop.max_evaluations.saturating_sub(self.record.evaluations) as usize;
        let affordable = (left / (AFFORDED * turn(self.smooth.dimensions()))).clamp(1, most);
        let starts = best_apart(places, &costs, affordable);
        if self.record.best.is_none() && self.record.stopped.is_none() {
            self.score_exactly(&starts).await?;
        }
        Ok(starts)
    }
}

/// Copies of a point with one coordinate moved: anywhere, to its lower half, and to its upper half.
fn moved(best: &[f64], rng: &mut impl Rng) -> Vec<Vec<f64>> {
    let mut places = Vec::new();
    for i in 0..best.len() {
        let x: f64 = rng.random();
        for x in [x, 0.5 * x, 0.5 + 0.5 * x] {
            let mut place = best.to_vec();
            place[i] = x;
            places.push(place);
        }
    }
    places
}

/// The best points at this distance from each other, at most this many.
fn best_apart(places: &[Vec<f64>], costs: &[f64], most: usize) -> Vec<Vec<f64>> {
    let mut order: Vec<usize> = (0..places.len()).filter(|&i| costs[i].is_finite()).collect();
    order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let mut picked: Vec<Vec<f64>> = Vec::new();
    for i in order {
        let distance = |other: &Vec<f64>| {
            let squares: f64 = places[i].iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum();
            (squares / places[i].len() as f64).sqrt()
        };
        if picked.len() < most && picked.iter().all(|other| distance(other) > APART) {
            picked.push(places[i].clone());
        }
    }
    picked
}

#[cfg(test)]
mod tests {
    use super::{moved, stream};

    #[test]
    fn one_coordinate_moves() {
        let best = [0.2, 0.8];
        let places = moved(&best, &mut stream(1, 0, 0, 0));
        let changed = |place: &Vec<f64>| (0..best.len()).filter(|&i| place[i] != best[i]).collect::<Vec<usize>>();
        assert_eq!(places.iter().map(changed).collect::<Vec<_>>(), [[0], [0], [0], [1], [1], [1]]);
        for (i, moved) in places.chunks(3).enumerate() {
            assert!(
                (0.0..1.0).contains(&moved[0][i]) && moved[1][i] < 0.5 && (0.5..1.0).contains(&moved[2][i]),
                "{moved:?}"
            );
        }
    }
}
