//! Shared by the tests of the GPU evaluator: cases without any file, random candidates, and a guard for missing adapters.

use super::made_up::{self, Way};
use leadlag::internal::calibrate::{Overrides, SearchSpace};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Evaluator, Job, Population, Score};
use leadlag::internal::gpu::{Adapter, AdapterChoice, Gpu, Limits};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::trajectory::{Grade, Trajectory, integrate};
use leadlag::internal::vehicle::{Mfc, Vehicle};
use leadlag::internal::wgsl::Precision;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// True if the test must be skipped because a GPU is forbidden. Fails if an adapter is missing for another reason.
pub fn skipped(test_name: &str) -> bool {
    if std::env::var_os("LEADLAG_NO_GPU").is_some() {
        println!("SKIPPED {test_name}: LEADLAG_NO_GPU is set");
        return true;
    }
    match Adapter::choose(&AdapterChoice::Best) {
        Ok(adapter) => println!("{test_name} on {}", adapter.name()),
        Err(e) => panic!("{e}\n(or set LEADLAG_NO_GPU=1 to skip these tests)"),
    }
    false
}

/// A leader that accelerates, brakes, stops and cruises, and a follower that does roughly the same a little later.
pub fn trajectory(samples: usize, phase: f64) -> Trajectory {
    let dt = 0.1;
    let t: Vec<f64> = (0..samples).map(|i| i as f64 * dt).collect();
    let speed = |t: f64| (14.0 + 9.0 * (t / 9.0 + phase).sin() + 6.0 * (t / 23.0).cos()).max(0.0);
    let v_l: Vec<f64> = t.iter().map(|t| speed(*t)).collect();
    let v_f: Vec<f64> = t.iter().map(|t| speed(t - 1.5)).collect();
    let (x_l, x_f) = (integrate(40.0, &v_l, dt), integrate(0.0, &v_f, dt));
    let label = format!("made up, {samples} samples, phase {phase}");
    Trajectory {
        grade: Some(grade()),
        ..made_up::trajectory(label, dt, Way { x: x_l, v: v_l }, Way { x: x_f, v: v_f })
    }
}

/// A hilly closed track, nodes at unequal distances.
pub fn grade() -> Grade {
    let x: Vec<f64> = (0..60).map(|k| f64::from(k) * 20.0 + 5.0 * f64::from(k % 3)).collect();
    let sin = x.iter().map(|x| 0.03 * (x / 190.0).sin()).collect();
    Grade { x, sin, period: Some(1200.0), source: None }
}

/// A built-in vehicle with a made-up MFC curve.
pub fn vehicle() -> Vehicle {
    let v: Vec<f64> = (0..50).map(f64::from).collect();
    let mfc = Mfc {
        a_ap: v.iter().map(|v| 4.5 - 0.08 * v).collect(),
        a_dp: v.iter().map(|v| -7.5 + 0.02 * v).collect(),
        v,
        source: None,
    };
    Vehicle { mfc: Some(mfc), ..Vehicle::built_in().remove(0) }
}

pub fn space(variant: Variant, convention: Convention) -> SearchSpace {
    SearchSpace::new(&variant, Some(&vehicle()), convention, &Overrides::new()).expect("bounds are known")
}

/// A case of `samples` samples.
pub fn case(variant: Variant, convention: Convention, samples: usize, phase: f64) -> Case {
    let mut trajectory = trajectory(samples, phase);
    if !variant.extensions.is_empty() {
        // A car ahead of the preceding one, for the extensions that read its signals.
        trajectory.v_l2 = Some(trajectory.v_l.iter().rev().copied().collect());
        trajectory.s_l2 = Some(trajectory.s.iter().map(|s| s + 5.0).collect());
        trajectory.t.iter_mut().for_each(|t| *t += 7.0);
    }
    Case::new(&trajectory, variant, Some(&vehicle()), convention, 0.8).expect("a complete case")
}

/// Candidates from the whole search space.
pub fn population(variant: Variant, convention: Convention, count: usize, seed: u64) -> Population {
    let space = space(variant, convention);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut population = Population::new(&space.symbols);
    for _ in 0..count {
        let draw = |[lower, upper]: &[f64; 2]| lower + (upper - lower) * rng.random::<f64>();
        let candidate: Vec<f64> = space.bounds.iter().map(draw).collect();
        population.push(&candidate);
    }
    population
}

pub fn gpu(cases: Vec<Case>, precision: Precision, limits: Limits) -> Gpu {
    Gpu::with_limits(cases, GoodnessOfFit::NRMSE_SVA, precision, &AdapterChoice::Best, limits)
        .unwrap_or_else(|e| panic!("{e}"))
}

pub fn job(case: usize, population: &Population) -> Job<'_> {
    Job { case, population }
}

pub fn variant(name: &str) -> Variant {
    name.parse().expect("a variant")
}

pub fn scores(evaluator: &mut dyn Evaluator, population: &Population) -> Vec<Score> {
    let mut scores = vec![Score::Rejected; population.len()];
    evaluator.evaluate(population, &mut scores).unwrap_or_else(|e| panic!("{e}"));
    scores
}
