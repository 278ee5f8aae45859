//! Whether drives have one driver: half of a drive predicts its other half as well as the parameters common to all drives do.

use super::{CalibrateError, Calibration, SearchSpace, Stop, Task, calibrate_each};
use crate::evaluator::{Case, EvaluateError, Evaluator, Job, Population};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use std::ops::{ControlFlow, Range};

/// Shorter halves show too little of a driver \[s\].
const HALF_S: f64 = 30.0;
/// Largest number of drives compared with each other.
const MOST: usize = 10;
/// The error of the spacing under the common parameters is at least this multiple of that from the drive's other half, and larger by at least
/// [`LARGER_M`]: none of 96 made-up single drivers behind different leaders reaches both, 89 of 96 mixtures do, and no three drives of each of
/// four cars with adaptive cruise control on three laws.
const TIMES: f64 = 1.5;
/// See [`TIMES`] \[m\]: smaller differences come from the measurement.
const LARGER_M: f64 = 0.3;
/// Simulations per parameter of a half: the result should be close, not exact.
const PER_PARAMETER: u64 = 1_000;

/// Drives that probably have different drivers.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Root mean square error of the spacing in each half of the drive that differs most, predicted from its other half \[m\].
    pub own_m: f64,
    /// The same by parameters fitted to all drives together.
    pub other_m: f64,
    /// The parameter that differs most, and its value on each examined drive: index of the drive, and the mean of its halves.
    pub parameter: usize,
    /// See `parameter`.
    pub values: Vec<(usize, f64)>,
}

/// Compares drives, each separately in halves; `None` if they may well have one driver, or are too few or too short.
///
/// # Errors
/// When the evaluator fails.
pub fn apart(cases: &[Case], space: &SearchSpace, seed: u64) -> Result<Option<Apart>, EvaluateError> {
    apart_until(cases, space, seed, &|| false)
}

/// The same; `None` after a stop.
pub fn apart_until(
    cases: &[Case],
    space: &SearchSpace,
    seed: u64,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Apart>, EvaluateError> {
    let long = |case: &Case| case.s.len() as f64 * case.dt >= 2.0 * HALF_S;
    let drives: Vec<usize> = (0..cases.len()).filter(|&i| long(&cases[i])).take(MOST).collect();
    let free = space.free();
    if drives.len() < 2 || free.is_empty() {
        return Ok(None);
    }
    let halves: Vec<Case> = drives
        .iter()
        .flat_map(|&i| {
            let (case, whole) = (&cases[i], cases[i].s.len());
            [case.part(0..whole / 2), case.part(whole / 2..whole)]
        })
        .collect();
    let gof: GoodnessOfFit = "nrmse-sv".parse().expect("it is known");
    let mut lanes = Lanes::new(halves, gof, LanesPrecision::Plain)?;
    let few = Stop { max_evaluations: PER_PARAMETER * free.len() as u64, ..Stop::default() };
    let calibration = Calibration { seed, stop: few, ..Calibration::default() };
    let all = 2 * drives.len();
    // One calibration of each half, and one of all.
    let task = |cases: Range<usize>| Task { space, cases, number: 0 };
    let tasks: Vec<Task> = (0..all).map(|case| task(case..case + 1)).chain([task(0..all)]).collect();
    let mut go_on = |_, _| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let found = match calibrate_each(&mut lanes, &tasks, &calibration, &mut go_on) {
        Err(CalibrateError::Evaluate(error)) => return Err(error),
        _ if stop() => return Ok(None),
        found => found.unwrap_or_default(),
    };
    let found: Vec<Option<Vec<f64>>> = found.into_iter().map(|one| one.ok().map(|one| one.candidate)).collect();
    let mut population = Population::new(&space.symbols);
    found.iter().flatten().for_each(|candidate| population.push(candidate));
    let jobs: Vec<Job> = (0..all).map(|case| Job { case, population: &population }).collect();
    let outcomes = lanes.outcomes(&jobs)?;
    // Mean square error of each candidate on each half; none for one that ends early.
    let places: Vec<usize> = (0..found.len()).filter(|&k| found[k].is_some()).collect();
    let square = |case: usize, by: usize| {
        let column = places.iter().position(|&k| k == by)?;
        let measures = outcomes[case * places.len() + column].result.ok()?;
        Some(measures.0[0].rmse.powi(2))
    };
    // Errors of a half: by the other half of the drive, and by the parameters common to all.
    let errors = |half: usize| Some([square(half, half ^ 1)?, square(half, all)?].map(f64::sqrt));
    // Both halves of a drive have to agree: a simulation that diverges in one contains no information about the driver.
    let is_apart = |[own, other]: &[f64; 2]| *other >= TIMES * own && *other >= own + LARGER_M;
    let of_another = |place: usize| {
        let halves = [errors(2 * place)?, errors(2 * place + 1)?];
        let root = |k: usize| (0.5 * halves.iter().map(|errors| errors[k].powi(2)).sum::<f64>()).sqrt();
        halves.iter().all(is_apart).then(|| [root(0), root(1)])
    };
    let clearest = (0..drives.len()).filter_map(of_another).max_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])));
    let Some([own_m, other_m]) = clearest else { return Ok(None) };
    let value = |place: usize, i: usize| {
        let halves: Vec<f64> = found[2 * place..2 * place + 2].iter().flatten().map(|candidate| candidate[i]).collect();
        (!halves.is_empty()).then(|| halves.iter().sum::<f64>() / halves.len() as f64)
    };
    let values = |i: usize| -> Vec<(usize, f64)> {
        (0..drives.len()).filter_map(|place| Some((drives[place], value(place, i)?))).collect()
    };
    // Relative to the difference between the halves of one drive, because undetermined parameters differ, too.
    let told = |i: usize| {
        let all = values(i);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let [low, high] =
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
            high - low
        };
        let within = (0..drives.len())
            .map(|place| range(&mut found[2 * place..2 * place + 2].iter().flatten().map(|c| c[i])))
            .fold(1e-3 * (space.bounds[i][1] - space.bounds[i][0]), f64::max);
        range(&mut all.iter().map(|(_, x)| *x)) / within
    };
    let parameter = free.iter().copied().max_by(|a, b| told(*a).total_cmp(&told(*b))).expect("some are searched");
    Ok(Some(Apart { own_m, other_m, parameter, values: values(parameter) }))
}

impl Apart {
    /// In words; `labels` name the drives.
    #[must_use]
    pub fn told(&self, space: &SearchSpace, labels: &[&str]) -> String {
        let symbol = space.symbols[self.parameter];
        let low = self.values.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = self.values.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let at = |entry: Option<&(usize, f64)>| {
            entry.map_or(String::new(), |(drive, x)| {
                format!("{x:.2} {} in {}", symbol.unit(), labels.get(*drive).unwrap_or(&""))
            })
        };
        format!(
            "the drives hardly have one driver with one setting: half of a drive predicts the spacing of its other half within {:.1} m, parameters \
             common to all drives within {:.1} m (root mean square); {} is about {} and {}",
            self.own_m,
            self.other_m,
            symbol.name(),
            at(low),
            at(high)
        )
    }
}
