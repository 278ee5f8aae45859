//! Calibration by derivatives: slopes are those of the score, and `auto` finds the optimum with few simulations.

use crate::common;
use crate::common::followers;
use leadlag::internal::calibrate::{
    Calibration, Overrides, Replicate, SearchSpace, Stop, StopReason, Task, calibrate, calibrate_each,
};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{
    Case, Differences, Failure, FailureKind, Job, Population, Pull, Residuals, Score, Soft,
};
use leadlag::internal::lanes::{Bins, Lanes, LanesPrecision};
use leadlag::internal::trajectory::{Preparation, Trajectory, import, prepare};
use leadlag::internal::vehicle::Vehicle;
use std::ops::ControlFlow;

/// Follower 1 (Tesla) of P3.
fn tesla(test: &str) -> Option<Trajectory> {
    let shared = common::shared(test)?;
    let recording = import::read(&shared.join("data/astazero_c2art/ASta_040719_platoon7.csv"), None).expect("P3");
    Some(prepare(&recording, 1, &Preparation::default()).expect("follower 1").remove(0))
}

fn case_of(trajectory: &Trajectory, variant: &str, convention: Convention) -> (Case, SearchSpace) {
    let variant: Variant = variant.parse().expect("a variant");
    let vehicle = Vehicle::called("tesla_model_3");
    let space = SearchSpace::new(&variant, vehicle.as_ref(), convention, &Overrides::new()).expect("bounds");
    let case = Case::new(trajectory, variant, vehicle.as_ref(), convention, space.tau_p_upper()).expect("a case");
    (case, space)
}

fn found(trajectory: &Trajectory, variant: &str, gof: &str, stop: Stop) -> Replicate {
    let (case, space) = case_of(trajectory, variant, Convention::AUTHORS);
    let mut lanes = Lanes::new(vec![case], gof.parse().expect("a measure"), LanesPrecision::Plain).expect("lanes");
    let settings = Calibration { stop, ..Calibration::default() };
    calibrate(&mut lanes, &space, &settings, &mut |_| ControlFlow::Continue(())).expect("feasible").remove(0)
}

fn cost(lanes: &Lanes, space: &SearchSpace, candidates: &[Vec<f64>], pull: Pull) -> Vec<f64> {
    let mut population = Population::new(&space.symbols);
    candidates.iter().for_each(|candidate| population.push(candidate));
    let scores = lanes.pulled(&Job { case: 0, population: &population }, pull).expect("scores");
    let price = pull.soft.map_or(0.0, |soft| soft.price);
    let cost = |(score, short): (Score, f64)| match score {
        Score::Value(value) => value + price * short,
        other => panic!("{other:?}"),
    };
    scores.into_iter().map(cost).collect()
}

/// Searches see every third sample of a drive at 10 Hz, and no fewer than requested.
#[test]
fn longer_steps_take_some_samples() {
    let Some(trajectory) = tesla("longer_steps_take_some_samples") else { return };
    let (case, _) = case_of(&trajectory, "idm+delay", Convention::PAPER);
    let coarse = case.in_steps(0.3, 100);
    assert!((coarse.dt - 3.0 * case.dt).abs() < 1e-12);
    assert_eq!(coarse.s.len(), case.s.len().div_ceil(3));
    assert_eq!((coarse.s[50], coarse.x_l[50], coarse.v_f[50]), (case.s[150], case.x_l[150], case.v_f[150]));
    assert_eq!(coarse.a_f[50], (case.v_f[150] - case.v_f[147]) / coarse.dt);
    let half = case.s.len() / 2;
    assert_eq!(case.in_steps(0.3, half).s.len(), case.s.len().div_ceil(2));
    assert_eq!(coarse.in_steps(0.3, 1).s, coarse.s);
}

/// Sums over bins are those of the samples, and the mean acceleration is a difference of speeds.
#[test]
fn sums_over_bins_are_those_of_the_samples() {
    let Some(trajectory) = tesla("sums_over_bins_are_those_of_the_samples") else { return };
    let (case, space) = case_of(&trajectory, "idm", Convention::AUTHORS);
    let lanes = Lanes::new(vec![case], "nrmse-sva".parse().expect("a measure"), LanesPrecision::F64).expect("lanes");
    let candidate = [4.0, 33.0, 2.0, 1.2, 1.5, -1.5];
    let mut population = Population::new(&space.symbols);
    population.push(&candidate);
    population.push(&[4.0, 33.0, 2.0, 1.2001, 1.5, -1.5]);
    let job = Job { case: 0, population: &population };
    // Two bins, the second one shorter, with samples between them that count in none.
    let bin = |t: usize| match t {
        100..400 => Some(0),
        450..600 => Some(1),
        _ => None,
    };
    let of: Vec<Option<u32>> = (0..trajectory.len()).map(bin).collect();
    let mut errors: Vec<Vec<[f64; 2]>> = vec![Vec::new(); 2];
    let mut each = |stretch: &Residuals| errors.iter_mut().enumerate().for_each(|(i, e)| e.extend(stretch.of(i)));
    lanes.free_residuals(&job, None, &mut each).expect("runs");
    let free = Pull { share: 0.0, soft: None };
    let mean = 10;
    let bins = Bins { of: &of, count: 2, mean };
    let squares = lanes.squares(&job, free, bins).expect("runs");
    let differences = [Differences { first: 0, steps: vec![1e-4] }];
    let products = lanes.products(&job, free, &differences, bins).expect("runs").remove(0).expect("comes through");
    for k in 0..2 {
        let samples = || (0..of.len()).filter(move |t| of_bin(bin(*t), k));
        let sum = |of: &dyn Fn(usize) -> f64| samples().map(of).sum::<f64>();
        let lagged = |i: usize, t: usize| errors[i][t][1] - errors[i][t - mean][1];
        let expected =
            [sum(&|t| errors[0][t][0].powi(2)), sum(&|t| errors[0][t][1].powi(2)), sum(&|t| lagged(0, t).powi(2))];
        let slope = sum(&|t| lagged(0, t) * (lagged(1, t) - lagged(0, t)) / 1e-4);
        for (signal, expected) in expected.into_iter().enumerate() {
            let [found, product] = [squares[0].as_ref().expect("comes through")[k][signal], products.square(k, signal)];
            assert!((found / expected - 1.0).abs() < 1e-9, "bin {k} signal {signal}: {found} for {expected}");
            assert!((product / expected - 1.0).abs() < 1e-9, "bin {k} signal {signal}: {product} for {expected}");
        }
        let found = products.half_gradient(k, 2)[0];
        assert!((found - slope).abs() < 1e-6 * slope.abs() + 1e-9, "bin {k}: {found} for {slope}");
    }
}

fn of_bin(own: Option<u32>, k: usize) -> bool {
    own == Some(k as u32)
}

/// Against central differences of the cost itself: free, pulled, and beyond collisions, which have a penalty; for each family of measures.
#[test]
fn slopes_are_those_of_the_score() {
    let Some(trajectory) = tesla("slopes_are_those_of_the_score") else { return };
    // The second one is so close behind that it collides.
    let candidates = [("idm", vec![4.0, 33.0, 2.0, 1.2, 1.5, -1.5]), ("l-cth", vec![0.05, 0.1, 0.5, 34.0, 1.0, 0.3])];
    let soft = |price| Some(Soft { least: 2.0, price });
    let pulls = [Pull { share: 0.0, soft: soft(1e-3) }, Pull { share: 0.03, soft: soft(1e-3) }];
    for (name, candidate) in &candidates {
        for gof in ["nrmse-sva", "rmse-s", "rmspe-sv", "rmse-sn-vn", "nrmse-sva:1,1,0.5"] {
            let (case, space) = case_of(&trajectory, name, Convention::AUTHORS);
            let lanes = Lanes::new(vec![case], gof.parse().expect("a measure"), LanesPrecision::F64).expect("lanes");
            for pull in pulls {
                let n = candidate.len();
                let step = |i: usize, share: f64| {
                    let mut moved = candidate.clone();
                    moved[i] *= 1.0 + share;
                    moved
                };
                let mut population = Population::new(&space.symbols);
                population.push(candidate);
                (0..n).for_each(|i| population.push(&step(i, 1e-7)));
                let differences = Differences { first: 0, steps: candidate.iter().map(|x| 1e-7 * x).collect() };
                let job = Job { case: 0, population: &population };
                let slopes = lanes.slopes(&job, &[differences], pull).expect("slopes").remove(0);
                let own = cost(&lanes, &space, std::slice::from_ref(candidate), pull)[0];
                assert!((slopes.cost / own - 1.0).abs() < 1e-12, "{name} {gof}: {} for {own}", slopes.cost);
                for (i, x) in candidate.iter().enumerate() {
                    let around = cost(&lanes, &space, &[step(i, 1e-5), step(i, -1e-5)], pull);
                    let central = (around[0] - around[1]) / (2e-5 * x);
                    let scale = (own / x).abs();
                    let off = (slopes.gradient[i] - central).abs();
                    assert!(
                        off < 1e-3 * central.abs() + 1e-4 * scale,
                        "{name} {gof} {i}: {} {central}",
                        slopes.gradient[i]
                    );
                }
            }
        }
    }
}

/// The lowest known scores, by L-SHADE and CMA-ES in ten replicates of 60,000 to 220,000 simulations each (benches/spread.jsonl); on a
/// smooth surface, with a kink and a delay in whole samples, with many basins, with an optimum on a collision, and with a bound that rejects.
#[test]
fn auto_finds_the_lowest_known_scores_with_few_simulations() {
    let Some(trajectory) = tesla("auto_finds_the_lowest_known_scores_with_few_simulations") else { return };
    for (variant, known, most) in [
        ("idm", 0.378_857_60, 2_000),
        ("gipps+delay", 0.283_407_27, 3_500),
        ("l-cth", 0.329_329_0, 2_600),
        ("l-idm+constant", 0.369_424, 9_000),
    ] {
        let found = found(&trajectory, variant, "nrmse-sva", Stop::default());
        println!("{variant}: {} after {}, {}", found.score, found.evaluations, found.stop);
        assert_eq!(found.stop, StopReason::Converged, "{variant}");
        assert!(found.score <= known * 1.001, "{variant}: {} for {known}", found.score);
        assert!(found.evaluations <= most, "{variant}: {}", found.evaluations);
        assert!(found.convergence.windows(2).all(|w| w[0].0 <= w[1].0 && w[0].1 > w[1].1), "{variant}");
    }
}

/// Every small budget is respected and gives a result.
#[test]
fn budgets_are_kept() {
    let Some(trajectory) = tesla("budgets_are_kept") else { return };
    let mut before = f64::INFINITY;
    for max_evaluations in [100, 300, 1000, 3000] {
        let found = found(&trajectory, "gipps", "nrmse-sva", Stop { max_evaluations, ..Stop::default() });
        println!("{max_evaluations}: {} after {}", found.score, found.evaluations);
        assert!(found.evaluations <= max_evaluations, "{} of {max_evaluations}", found.evaluations);
        assert!(found.score.is_finite() && found.score <= before * 1.5, "{max_evaluations}: {}", found.score);
        before = found.score;
    }
    assert!(before < 0.2979 * 1.01, "{before}");
    let found = found(&trajectory, "gipps", "nrmse-sva", Stop { target: Some(0.31), ..Stop::default() });
    assert_eq!(found.stop, StopReason::Target);
    assert!(found.score <= 0.31 && found.evaluations < 5000, "{} after {}", found.score, found.evaluations);
}

/// Replicates that share blocks of lanes end as each one does alone, on any number of threads.
#[test]
fn replicates_that_share_blocks_end_as_each_alone() {
    let Some(trajectory) = tesla("replicates_that_share_blocks_end_as_each_alone") else { return };
    let (case, space) = case_of(&trajectory, "gipps+delay", Convention::AUTHORS);
    let stop = Stop { max_evaluations: 1_500, ..Stop::default() };
    let settings = Calibration { replicates: 4, stop, ..Calibration::default() };
    let on = |threads: usize, numbers: std::ops::Range<u64>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let gof = "nrmse-sva".parse().expect("a measure");
        let mut lanes = Lanes::new(vec![case.clone()], gof, LanesPrecision::Plain).expect("lanes");
        let tasks: Vec<Task> = numbers.map(|number| Task { space: &space, cases: 0..1, number }).collect();
        let run = || calibrate_each(&mut lanes, &tasks, &settings, &mut |_, _| ControlFlow::Continue(()));
        let found: Result<Vec<Replicate>, _> = pool.install(run).expect("runs").into_iter().collect();
        found.expect("feasible")
    };
    let together = on(1, 0..4);
    assert_eq!(together, on(3, 0..4));
    assert_eq!(together[2..3], on(1, 2..3));
}

/// A soft run of Gipps pays for a negative radicand, and for nothing else where it keeps its distance.
#[test]
fn a_negative_radicand_costs() {
    let Some(trajectory) = tesla("a_negative_radicand_costs") else { return };
    let (case, space) = case_of(&trajectory, "gipps", Convention::PAPER);
    let lanes = Lanes::new(vec![case], "nrmse-sva".parse().expect("a measure"), LanesPrecision::F64).expect("lanes");
    let mut population = Population::new(&space.symbols);
    // The second one leaves more room at standstill than the first sample has.
    population.push(&[0.6, 33.0, 2.0, 1.0, 1.5, -1.5, -1.5]);
    population.push(&[0.6, 33.0, 9.0, 1.0, 1.5, -1.5, -1.5]);
    let job = Job { case: 0, population: &population };
    let plain = lanes.pulled(&job, Pull::NONE).expect("scores");
    assert!(matches!(plain[0].0, Score::Value(_)), "{:?}", plain[0]);
    assert!(matches!(plain[1].0, Score::Failed(Failure { kind: FailureKind::Radicand, .. })), "{:?}", plain[1]);
    let soft = Some(Soft { least: 1e-3, price: 1.0 });
    let soft = lanes.pulled(&job, Pull { share: 0.0, soft }).expect("scores");
    assert_eq!(soft[0].1, 0.0);
    assert!(matches!(soft[1].0, Score::Value(_)) && soft[1].1 > 0.1, "{:?}", soft[1]);
}

/// P4-2: without a penalty for the radicand, all searches ended at 0.4948, because the lower basin is full of runs that fail.
#[test]
fn a_search_leaves_negative_radicands() {
    let Some(shared) = common::shared("a_search_leaves_negative_radicands") else { return };
    let follower = followers::all(&shared).remove(5);
    let variant: Variant = "gipps+nonlinear".parse().expect("a variant");
    let (case, space) = (follower.case(variant, Convention::PAPER), follower.space(variant, Convention::PAPER));
    let mut lanes =
        Lanes::new(vec![case], "nrmse-sva".parse().expect("a measure"), LanesPrecision::Plain).expect("lanes");
    let settings = Calibration::default();
    let found =
        calibrate(&mut lanes, &space, &settings, &mut |_| ControlFlow::Continue(())).expect("feasible").remove(0);
    println!("{} after {}, {}", found.score, found.evaluations, found.stop);
    assert!(found.score < 0.4787, "{}", found.score);
}
