//! Calibration by derivatives: slopes are those of the score, and `auto` finds what it should with few simulations.

use crate::common;
use leadlag::internal::calibrate::{Calibration, Overrides, Replicate, SearchSpace, Stop, StopReason, calibrate};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Job, Population, Pull, Score, Soft};
use leadlag::internal::lanes::{Differences, Lanes, LanesPrecision};
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

/// Against central differences of the cost itself: free, pulled, and behind collisions, where shortfalls cost; for each family of measures.
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
        ("idm", 0.378_857_60, 5_000),
        ("gipps+delay", 0.283_407_27, 10_000),
        ("l-cth", 0.329_329_0, 5_000),
        ("l-idm+constant", 0.369_424, 25_000),
    ] {
        let found = found(&trajectory, variant, "nrmse-sva", Stop::default());
        println!("{variant}: {} after {}, {}", found.score, found.evaluations, found.stop);
        assert_eq!(found.stop, StopReason::Converged, "{variant}");
        assert!(found.score <= known * 1.001, "{variant}: {} for {known}", found.score);
        assert!(found.evaluations <= most, "{variant}: {}", found.evaluations);
        assert!(found.convergence.windows(2).all(|w| w[0].0 <= w[1].0 && w[0].1 > w[1].1), "{variant}");
    }
}

/// However small a budget, it is kept, and something is found within it.
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
