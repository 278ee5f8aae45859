//! The Levenberg-Marquardt method from several points at once.

use super::step::lowest;
use crate::evaluator::{Pull, Slopes};
use nalgebra::{DMatrix, DVector};
use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// Dampings tried in an iteration, as factors of the present one; the first again with the majorant.
const DAMPINGS: [f64; 6] = [1e-7, 1e-4, 1e-2, 1e-1, 1.0, 30.0];
/// Number of these that are also tried with the majorant: where a score approaches 0, its curvature vanishes along the way.
const MAJORANTS: usize = 1;
/// Points tried in an iteration.
const TRIES: usize = DAMPINGS.len() + MAJORANTS;
/// All of them.
const ALL: [usize; TRIES] = [0, 1, 2, 3, 4, 5, 6];
/// Those tried first where a simulation costs more than a request: the others follow if these gain less than a share of the promise.
pub(super) const USUALLY: [usize; 2] = [1, 2];
/// Share of the promise that the first points have to gain: with less, a better damping is likely.
const FULFILLED: f64 = 0.25;
/// The best factor: an iteration in which another one was better moves the damping towards it.
const USUAL: f64 = 1e-2;
/// Factor on the damping after an iteration without gain.
const HARDER: f64 = 1e3;
/// Damping beyond which a descent is stuck.
const STUCK: f64 = 1e8;
/// Range of the damping after a gain.
const RANGE: [f64; 2] = [1e-4, 1e6];
/// Number of successive iterations with less gain than the tolerance that end a descent.
const IDLE: usize = 2;
/// Share of the tolerance: if derivatives promise less, the iteration is not needed.
const PROMISED: f64 = 0.1;
/// The least curvature of a coordinate, as a share of the largest.
const LEAST: f64 = 1e-6;

/// Distance beyond which points are apart.
pub const APART: f64 = 0.15;
/// Two points have met if their costs differ by less than the first share (of a logarithm: by less than that) and their coordinates by less
/// than [`APART`], or their costs by less than the second.
const MET: [f64; 2] = [3e-3, 1e-6];

/// How a descent runs.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// The minimised objective.
    pub pull: Pull,
    /// Turns at most.
    pub turns: usize,
    /// Gain of an iteration below which a descent has converged: a share of the cost, or the difference of a logarithm.
    pub tolerance: f64,
}

/// A point of a descent.
#[derive(Debug, Clone)]
pub struct Walker {
    /// Its coordinates.
    pub place: Vec<f64>,
    /// The cost there.
    pub cost: f64,
    /// Gain that the least damped step of the last iteration promised beyond the real one: large on a kink and at the edge of the feasible
    /// region, where derivatives do not help.
    pub promise: f64,
    damping: f64,
    idle: usize,
    stands: bool,
    is_logarithm: bool,
}

impl Walker {
    fn new(place: Vec<f64>, is_logarithm: bool) -> Walker {
        let infinite = f64::INFINITY;
        Walker { place, cost: infinite, promise: infinite, damping: 1.0, idle: 0, stands: false, is_logarithm }
    }

    /// The unit of a gain and of a tolerance.
    fn unit(&self) -> f64 {
        if self.is_logarithm { 1.0 } else { self.cost }
    }

    /// Ends its descent.
    pub fn stop(&mut self) {
        self.stands = true;
    }

    /// True if it has met another point that is no worse.
    pub fn has_met(&self, other: &Walker) -> bool {
        let behind = self.cost - other.cost;
        let farthest = self.place.iter().zip(&other.place).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        behind <= MET[0] * other.unit() && farthest < APART || behind <= MET[1] * other.unit()
    }

    /// The points to try, and the gain that the first of them promises.
    fn tries(&self, slopes: &Slopes, held: &[usize]) -> (Vec<Vec<f64>>, f64) {
        let n = self.place.len();
        let lower: Vec<f64> = (0..n).map(|j| if held.contains(&j) { 0.0 } else { -self.place[j] }).collect();
        let upper: Vec<f64> = (0..n).map(|j| if held.contains(&j) { 0.0 } else { 1.0 - self.place[j] }).collect();
        let tries = DAMPINGS.iter().map(|factor| (factor, &slopes.curvature));
        let majorants = DAMPINGS.iter().take(MAJORANTS).map(|factor| (factor, &slopes.majorant));
        let step = |(factor, curvature): (&f64, &DMatrix<f64>)| {
            let mut damped = curvature.clone();
            let largest = damped.diagonal().max();
            for j in 0..n {
                let own = damped[(j, j)].max(LEAST * largest + f64::MIN_POSITIVE.sqrt());
                damped[(j, j)] += factor * self.damping * own;
                damped[(j, j)] = damped[(j, j)].max(LEAST * LEAST * own);
            }
            lowest(&slopes.gradient, &damped, &lower, &upper)
        };
        let steps: Vec<DVector<f64>> = tries.chain(majorants).map(step).collect();
        let first = &steps[0];
        let promise = -slopes.gradient.dot(first) - 0.5 * first.dot(&(&slopes.curvature * first));
        let place = |step: &DVector<f64>| {
            self.place.iter().zip(step.iter()).map(|(x, step)| (x + step).clamp(0.0, 1.0)).collect()
        };
        (steps.iter().map(place).collect(), promise)
    }

    /// True if one of the tried points gains about as much as derivatives promise.
    fn is_fulfilled(&self, costs: &[f64]) -> bool {
        let gain = self.cost - costs.iter().copied().fold(f64::INFINITY, f64::min);
        gain > 0.0 && gain >= FULFILLED * self.promise
    }

    /// Moves to the best of the tried points.
    fn take(&mut self, tried: &[Vec<f64>], costs: &[f64], tolerance: f64) {
        let best = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).expect("steps");
        let gain = self.cost - costs[best];
        self.promise -= gain.max(0.0);
        if gain > 0.0 {
            let factor = DAMPINGS[best % DAMPINGS.len()];
            self.damping = (self.damping * (factor / USUAL).sqrt()).clamp(RANGE[0], RANGE[1]);
            (self.place, self.cost) = (tried[best].clone(), costs[best]);
        } else {
            self.damping *= HARDER;
        }
        self.idle = if gain > tolerance * self.unit() { 0 } else { self.idle + 1 };
        self.stands = self.idle >= IDLE || self.damping > STUCK;
    }
}

/// Those with a finite cost, the best first, without those that have met a better one.
#[must_use]
pub fn merged(mut walkers: Vec<Walker>) -> Vec<Walker> {
    walkers.retain(|walker| walker.cost.is_finite());
    walkers.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut kept: Vec<Walker> = Vec::new();
    for walker in walkers {
        if !kept.iter().any(|other| walker.has_met(other)) {
            kept.push(walker);
        }
    }
    kept
}

/// A point in an iteration: the points to try, and their costs, infinite until they are known.
struct Trying<'a> {
    walker: &'a mut Walker,
    tried: Vec<Vec<f64>>,
    costs: Vec<f64>,
}

/// Number of simulations of an iteration at one point with this many coordinates.
pub fn turn(moved: usize) -> usize {
    moved + 1 + TRIES
}

/// Limits of a descent, and its observer.
pub trait Watch {
    /// Requests this many simulations; false ends the descent.
    fn spend(&mut self, simulations: usize) -> bool;

    /// Receives the points after each iteration; those that it removes end.
    fn turned(&self, _walkers: &mut Vec<Walker>) {}
}

/// Cost that a descent minimises, over points whose coordinates lie between 0 and 1.
pub trait Surface {
    /// Why there is no cost.
    type Error;

    /// Number of coordinates.
    fn dimensions(&self) -> usize;

    /// True if costs are logarithms: a tolerance is then a difference and not a share.
    fn is_logarithm(&self) -> bool {
        false
    }

    /// Costs of points; infinite if a run fails.
    ///
    /// # Errors
    /// Where the surface cannot be evaluated.
    fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, Self::Error>;

    /// The same with derivatives; those of coordinates that are `held` are 0.
    ///
    /// # Errors
    /// Where the surface cannot be evaluated.
    fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, Self::Error>;
}

/// A surface whose answers may have to wait for other searches.
pub(super) trait Shared {
    type Error;

    /// The points of an iteration that are tried first.
    const FIRST: &'static [usize];

    fn dimensions(&self) -> usize;

    fn is_logarithm(&self) -> bool {
        false
    }

    async fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, Self::Error>;

    async fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, Self::Error>;
}

impl<S: Surface> Shared for S {
    type Error = S::Error;

    const FIRST: &'static [usize] = &ALL;

    fn dimensions(&self) -> usize {
        self.dimensions()
    }

    fn is_logarithm(&self) -> bool {
        self.is_logarithm()
    }

    async fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, S::Error> {
        self.costs(places, pull)
    }

    async fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, S::Error> {
        self.slopes(places, held, pull)
    }
}

/// Descends from all points, without `held` coordinates; those whose first run fails have an infinite cost.
///
/// # Errors
/// Where the surface cannot be evaluated.
pub fn descend<S: Surface>(
    objective: &S,
    starts: Vec<Vec<f64>>,
    held: &[usize],
    course: Course,
    watch: &mut dyn Watch,
) -> Result<Vec<Walker>, S::Error> {
    match pin!(descend_on(objective, starts, held, course, watch)).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(walkers) => walkers,
        Poll::Pending => unreachable!("this surface answers at once"),
    }
}

/// The same on a shared surface.
pub(super) async fn descend_on<S: Shared>(
    objective: &S,
    starts: Vec<Vec<f64>>,
    held: &[usize],
    course: Course,
    watch: &mut dyn Watch,
) -> Result<Vec<Walker>, S::Error> {
    let new = |place| Walker::new(place, objective.is_logarithm());
    let mut walkers: Vec<Walker> = starts.into_iter().map(new).collect();
    let moved = objective.dimensions() - held.len();
    for _ in 0..course.turns {
        let going: Vec<&mut Walker> = walkers.iter_mut().filter(|walker| !walker.stands).collect();
        if going.is_empty() || !watch.spend(going.len() * (moved + 1)) {
            break;
        }
        let places: Vec<&Vec<f64>> = going.iter().map(|walker| &walker.place).collect();
        let slopes = objective.slopes(&places, held, course.pull).await?;
        let mut trying: Vec<Trying> = Vec::new();
        for (walker, slopes) in going.into_iter().zip(&slopes) {
            if !slopes.cost.is_finite() {
                walker.stands = true;
                continue;
            }
            let (tried, promise) = walker.tries(slopes, held);
            (walker.cost, walker.promise) = (slopes.cost, promise);
            walker.stands = promise <= PROMISED * course.tolerance * walker.unit();
            if !walker.stands {
                trying.push(Trying { walker, costs: vec![f64::INFINITY; tried.len()], tried });
            }
        }
        if trying.is_empty() {
            continue;
        }
        let others: Vec<usize> = ALL.into_iter().filter(|k| !S::FIRST.contains(k)).collect();
        let mut goes_on = true;
        for which in [S::FIRST, &others] {
            let mut open: Vec<&mut Trying> =
                trying.iter_mut().filter(|trying| !trying.walker.is_fulfilled(&trying.costs)).collect();
            let places: Vec<Vec<f64>> =
                open.iter().flat_map(|trying| which.iter().map(|k| trying.tried[*k].clone())).collect();
            goes_on = places.is_empty() || watch.spend(places.len());
            if places.is_empty() || !goes_on {
                break;
            }
            let costs = objective.costs(&places, course.pull).await?;
            for (trying, costs) in open.iter_mut().zip(costs.chunks(which.len())) {
                which.iter().zip(costs).for_each(|(k, cost)| trying.costs[*k] = *cost);
            }
        }
        for Trying { walker, tried, costs } in trying {
            walker.take(&tried, &costs, course.tolerance);
        }
        if !goes_on {
            break;
        }
        watch.turned(&mut walkers);
    }
    Ok(walkers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// ln(x² + floor²): the logarithm of a squared error.
    struct Logarithm;

    const FLOOR: f64 = 0.01;

    impl Surface for Logarithm {
        type Error = Infallible;

        fn dimensions(&self) -> usize {
            1
        }

        fn is_logarithm(&self) -> bool {
            true
        }

        fn costs(&self, places: &[Vec<f64>], _: Pull) -> Result<Vec<f64>, Infallible> {
            Ok(places.iter().map(|place| ((place[0] - 0.3).powi(2) + FLOOR * FLOOR).ln()).collect())
        }

        fn slopes(&self, places: &[&Vec<f64>], _: &[usize], pull: Pull) -> Result<Vec<Slopes>, Infallible> {
            let of = |place: &&Vec<f64>| {
                let (cost, x) = (Surface::costs(self, &[(*place).clone()], pull)?[0], place[0] - 0.3);
                let square = x * x + FLOOR * FLOOR;
                let curvature = DMatrix::from_element(1, 1, 2.0 / square);
                let gradient = DVector::from_element(1, 2.0 * x / square);
                Ok(Slopes { cost, gradient, majorant: curvature.clone(), curvature })
            };
            places.iter().map(of).collect()
        }
    }

    struct Count(usize);

    impl Watch for Count {
        fn spend(&mut self, simulations: usize) -> bool {
            self.0 += simulations;
            true
        }
    }

    /// A logarithm may be negative, so a tolerance cannot be a share of it.
    #[test]
    fn a_descent_of_a_logarithm_ends() {
        let course = Course { pull: Pull { share: 0.0, soft: None }, turns: 50, tolerance: 1e-3 };
        let mut count = Count(0);
        let Ok(found) = descend(&Logarithm, vec![vec![0.9], vec![0.1]], &[], course, &mut count);
        let ended = merged(found);
        assert!(ended.len() == 1 && (ended[0].place[0] - 0.3).abs() < 1e-4, "{ended:?}");
        assert!(count.0 < 2 * 5 * turn(1), "{}", count.0);
    }
}
