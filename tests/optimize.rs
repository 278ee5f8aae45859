//! The optimiser: bounds, elitism, independence of everything but the seed, and feasibility by rule.

use leadlag::optimize::{Ga, GaSettings, Merit, Optimizer, SearchBox, stream};
use proptest::prelude::*;
use rand::RngExt;
use std::cmp::Ordering;

fn space(dimensions: usize) -> SearchBox {
    SearchBox { lower: vec![-5.0; dimensions], upper: vec![10.0; dimensions] }
}

/// Rastrigin's function: its minimum is 0 at the origin, among many local minima.
fn rastrigin(x: &[f64]) -> f64 {
    let term = |x: &f64| x * x - 10.0 * (std::f64::consts::TAU * x).cos() + 10.0;
    x.iter().map(term).sum()
}

fn minimise(seed: u64, replicate: u64, generations: usize) -> (Vec<f64>, Vec<f64>) {
    let mut ga = Ga::new(space(3), GaSettings::default(), seed, replicate);
    let mut curve = Vec::new();
    for _ in 0..generations {
        let merits: Vec<Merit> = ga.ask().iter().map(|x| Merit::Feasible(rastrigin(x))).collect();
        ga.tell(&merits);
        let Some(Merit::Feasible(best)) = ga.best().map(|m| m.merit) else { panic!("everything is feasible") };
        curve.push(best);
    }
    (ga.best().unwrap().point.clone(), curve)
}

#[test]
fn finds_the_minimum_of_a_multimodal_function() {
    let (point, curve) = minimise(1, 0, 400);
    assert!(curve.is_sorted_by(|a, b| a >= b), "the elite survives: the best never gets worse");
    assert!(curve[399] < 0.1, "{point:?} has {}", curve[399]);
}

#[test]
fn the_seed_and_the_replicate_decide_everything() {
    assert_eq!(minimise(7, 3, 30), minimise(7, 3, 30));
    assert_ne!(minimise(7, 3, 30).0, minimise(7, 4, 30).0);
    assert_ne!(minimise(7, 3, 30).0, minimise(8, 3, 30).0);
}

#[test]
fn streams_are_independent_of_each_other() {
    let draw = |seed, replicate, generation, candidate| stream(seed, replicate, generation, candidate).random::<u64>();
    let draws = [draw(1, 0, 0, 0), draw(0, 1, 0, 0), draw(0, 0, 1, 0), draw(0, 0, 0, 1), draw(0, 0, 0, 0)];
    for (i, one) in draws.iter().enumerate() {
        assert!(!draws[i + 1..].contains(one), "two streams begin alike");
    }
}

#[test]
fn the_sizes_are_those_of_the_package() {
    let mut ga = Ga::new(space(2), GaSettings::default(), 1, 0);
    let first = ga.ask();
    assert_eq!(first.len(), 100, "population_size");
    ga.tell(&vec![Merit::Feasible(1.0); 100]);
    assert_eq!(ga.ask().len(), 70, "30 parents are carried over unscored");
}

#[test]
fn infeasible_parents_are_not_drawn_while_there_are_feasible_ones() {
    // One feasible member: every child comes from it, so every coordinate is its own or mutated.
    let settings = GaSettings { mutation_probability: 0.0, ..GaSettings::default() };
    let mut ga = Ga::new(space(2), settings, 1, 0);
    let first = ga.ask();
    let merits: Vec<Merit> =
        (0..100).map(|i| if i == 17 { Merit::Feasible(3.0) } else { Merit::Infeasible { survived: i } }).collect();
    ga.tell(&merits);
    assert_eq!(ga.best().unwrap().point, first[17]);
    assert!(ga.ask().iter().all(|child| *child == first[17]));
}

#[test]
fn among_infeasible_members_the_longest_survivor_is_the_elite() {
    let mut ga = Ga::new(space(2), GaSettings::default(), 1, 0);
    let first = ga.ask();
    ga.tell(&(0..100).map(|i| Merit::Infeasible { survived: (i * 37) % 100 }).collect::<Vec<_>>());
    let longest = (0..100).max_by_key(|i| (i * 37) % 100).unwrap();
    assert_eq!(ga.best().unwrap().point, first[longest]);
}

#[test]
fn feasible_comes_before_infeasible_and_late_before_early() {
    let (good, bad) = (Merit::Feasible(1.0), Merit::Feasible(2.0));
    let (late, early) = (Merit::Infeasible { survived: 90 }, Merit::Infeasible { survived: 3 });
    for pair in [good, bad, late, early].windows(2) {
        assert_eq!(pair[0].order(&pair[1]), Ordering::Less);
        assert!(pair[0].beats(&pair[1]) && !pair[1].beats(&pair[0]));
    }
}

proptest! {
    #[test]
    fn candidates_stay_in_the_box(seed in any::<u64>(), lower in -1e3..1e3f64, width in 1e-6..1e3f64) {
        let space = SearchBox { lower: vec![lower; 4], upper: vec![lower + width; 4] };
        let mut ga = Ga::new(space, GaSettings::default(), seed, 0);
        for _ in 0..5 {
            let asked = ga.ask();
            for x in asked.iter().flatten() {
                prop_assert!((lower..=lower + width).contains(x), "{x} outside [{lower}, {}]", lower + width);
            }
            let merits: Vec<Merit> = asked.iter().map(|x| Merit::Feasible(x[0])).collect();
            ga.tell(&merits);
        }
    }
}
