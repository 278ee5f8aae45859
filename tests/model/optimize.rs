//! The optimisers: standard functions, bounds, dependence on the seed only, and rules for infeasible candidates.

use crate::functions::{self, ALL, Function};
use leadlag::internal::optimize::{
    Auto, AutoSettings, Cmaes, CmaesSettings, Descent, DescentSettings, Ended, Ga, GaSettings, Lshade, LshadeSettings,
    Member, Merit, Optimizer, Origin, SearchBox, Start, stream,
};
use proptest::prelude::*;
use rand::RngExt;
use std::cmp::Ordering;

fn space(dimensions: usize) -> SearchBox {
    SearchBox { lower: vec![-5.0; dimensions], upper: vec![10.0; dimensions] }
}

/// Every optimiser by name, for this many evaluations.
fn make(name: &str, space: SearchBox, evaluations: u64, seed: u64, replicate: u64) -> Box<dyn Optimizer> {
    let (n, origin) = (space.dimensions(), Origin::new(seed, replicate));
    match name {
        "ga" => Box::new(Ga::new(space, GaSettings::default(), seed, replicate)),
        "lshade" => Box::new(Lshade::new(space, LshadeSettings::new(n, evaluations), origin)),
        "cmaes" => Box::new(Cmaes::new(space, CmaesSettings { evaluations, tolerance: 1e-12, floor: 0.0 }, origin)),
        "auto" => Box::new(Auto::new(space, AutoSettings::new(n, evaluations), origin)),
        other => panic!("no optimiser {other}"),
    }
}

const NAMES: [&str; 4] = ["ga", "lshade", "cmaes", "auto"];

/// Lets an optimiser run until it ends or its evaluations are spent; returns the number of evaluations.
fn minimise(optimizer: &mut dyn Optimizer, evaluations: u64, merit: &dyn Fn(&[f64]) -> Merit) -> u64 {
    let mut used = 0;
    while optimizer.ended().is_none() {
        let asked = optimizer.ask();
        assert!(!asked.is_empty(), "an optimiser that continues asks for something");
        if used + asked.len() as u64 > evaluations {
            break;
        }
        used += asked.len() as u64;
        optimizer.tell(&asked.iter().map(|x| merit(x)).collect::<Vec<_>>());
    }
    used
}

fn value(member: &Member) -> f64 {
    match member.merit {
        Merit::Feasible(value) => value,
        Merit::Infeasible { .. } => f64::INFINITY,
    }
}

/// Value found above the minimum, and evaluations.
fn error_on(function: &Function, name: &str, n: usize, evaluations: u64, seed: u64) -> (f64, u64) {
    let mut optimizer = make(name, function.space(n), evaluations, seed, 0);
    // Optimisers that end without a request are not forced to continue.
    let most = if ["lshade", "auto"].contains(&name) { u64::MAX } else { evaluations };
    let used = minimise(optimizer.as_mut(), most, &|x| Merit::Feasible(function.value(x)));
    (value(optimizer.best().expect("told")) - function.minimum(n), used)
}

#[test]
fn the_functions_have_their_minimum_where_they_say() {
    for function in ALL {
        for n in [2, 5, 10] {
            let n = function.dimensions(n);
            let (at, minimum) = (function.minimiser(n), function.minimum(n));
            let here = function.value(&at);
            assert!((here - minimum).abs() < 1e-6 * minimum.abs().max(1.0), "{}: {here} for {minimum}", function.name);
            let space = function.space(n);
            let mut rng = stream(1, 0, 0, n as u64);
            for _ in 0..2000 {
                // Near and far.
                let share: f64 = rng.random::<f64>().powi(4);
                let point: Vec<f64> = (0..n)
                    .map(|i| {
                        let x = space.lower[i] + (space.upper[i] - space.lower[i]) * rng.random::<f64>();
                        at[i] + share * (x - at[i])
                    })
                    .collect();
                assert!(function.value(&point) >= here - 1e-6, "{} is lower at {point:?}", function.name);
            }
        }
    }
}

/// The minima of all functions in five dimensions, with every seed; of Griewank's, whose lowest minima hardly differ, one of the first two
/// with most of many seeds: about a quarter of the searches ends in a later one, and success with three seeds would be luck.
#[test]
fn auto_finds_the_minima() {
    for function in ALL {
        let n = function.dimensions(5);
        let griewank = function.name == functions::GRIEWANK.name;
        let (seeds, least) = if griewank { (60, 38) } else { (3, 3) };
        let mut found = 0;
        for seed in 1..=seeds {
            let (error, used) = error_on(function, "auto", n, 60_000, seed);
            assert!(used <= 60_000);
            found += u32::from(error < 1e-5 * function.scale);
        }
        assert!(found >= least, "{}: {found} of {seeds} seeds", function.name);
        if griewank {
            println!("{}: {found} of {seeds} seeds", function.name);
        }
    }
}

#[test]
fn lshade_and_cmaes_find_the_minima() {
    for function in ALL {
        let n = function.dimensions(5);
        for name in ["lshade", "cmaes"] {
            // Its deepest basins are in the corners, away from the direction of the slopes: CMA-ES is known to miss them (BBOB-2009, f20).
            if name == "cmaes" && function.name == functions::SCHWEFEL.name {
                continue;
            }
            // Restarts take 30,000 evaluations on average on Rastrigin's function, and all runs of pycma end within 100,000.
            let evaluations = if name == "cmaes" { 100_000 } else { 60_000 };
            let (error, used) = error_on(function, name, n, evaluations, 1);
            assert!(error < 1e-5 * function.scale, "{name} on {}: {error:e} after {used}", function.name);
        }
    }
}

/// The genetic algorithm has no local search: it comes close, but no closer. Otherwise the tests of the others would show nothing.
#[test]
fn the_genetic_algorithm_is_kept_as_it_was() {
    let (error, _) = error_on(&functions::RASTRIGIN, "ga", 3, 30_000, 1);
    assert!(error < 0.1, "{error}");
    let (error, _) = error_on(&functions::ELLIPSOID, "ga", 5, 60_000, 1);
    assert!(error > 1e-5, "{error}");
}

/// The original reports an error of 0 (below 1e-8) in all 51 runs on CEC 2014 F1 to F3 (elliptic, bent cigar, discus) and on F8
/// (Rastrigin), ten dimensions, 100,000 evaluations. The same shapes, shifted but not turned.
#[test]
fn lshade_converges_as_reported() {
    for function in [functions::ELLIPSOID, functions::BENT_CIGAR, functions::DISCUS, functions::RASTRIGIN] {
        for seed in [1, 2] {
            let (error, _) = error_on(&function, "lshade", 10, 100_000, seed);
            assert!(error < 1e-8, "{}, seed {seed}: {error:e}", function.name);
        }
    }
}

/// Evaluations of one descent to 1e-8 in ten dimensions, from 3 box units away. CMA-ES with default settings is known to need some
/// 2e3 on the sphere and 6e3 on the ellipsoid of condition 1e6 (N. Hansen and A. Ostermeier, Evolutionary Computation 9(2), 2001,
/// Section 7, and its successors); half as many again are allowed, and fewer than half would be too good to be true (it takes 1352 and
/// 3826).
#[test]
fn a_descent_converges_as_reported() {
    for (function, expected) in [(functions::SPHERE, 2000.0), (functions::ELLIPSOID, 6000.0)] {
        let mut total = 0;
        for seed in 1..=5 {
            let n = 10;
            let settings = DescentSettings {
                population: DescentSettings::population_for(n),
                evaluations: 100_000,
                tolerance: 0.0,
                floor: 0.0,
            };
            let middle = function.minimiser(n).iter().map(|x| x + 0.95).collect();
            let start = Start::Round { middle, step: 0.1 };
            let mut descent = Descent::new(function.space(n), start, settings, Origin::new(seed, 0));
            while descent.best().is_none_or(|best| value(best) - function.minimum(n) > 1e-8) {
                assert_eq!(descent.ended(), None, "{} ends before it is there", function.name);
                let merits: Vec<Merit> = descent.ask().iter().map(|x| Merit::Feasible(function.value(x))).collect();
                descent.tell(&merits);
                total += merits.len();
            }
        }
        let mean = total as f64 / 5.0;
        assert!(mean < 1.5 * expected && mean > 0.5 * expected, "{}: {mean} evaluations", function.name);
    }
}

/// Restarts in two regimes, as long as they take: the program of the authors of CMA-ES, pycma 4.5.0 with BIPOP, needs 30,140 evaluations
/// for 1e-8 on Rastrigin's function in five dimensions, all 25 runs within 100,000 (`benches/peers/optimizers.sh`). The mean of 25 such
/// runs is uncertain by a tenth.
#[test]
fn restarts_converge_as_those_of_the_authors() {
    let (function, n, runs) = (functions::RASTRIGIN, 5, 25);
    let mut total = 0;
    for seed in 1..=runs {
        let settings = CmaesSettings { evaluations: 100_000, tolerance: 1e-12, floor: 0.0 };
        let mut cmaes = Cmaes::new(function.space(n), settings, Origin::new(seed, 0));
        while cmaes.best().is_none_or(|best| value(best) - function.minimum(n) > 1e-8) {
            assert_eq!(cmaes.ended(), None, "seed {seed} is not there within 100,000 evaluations");
            let merits: Vec<Merit> = cmaes.ask().iter().map(|x| Merit::Feasible(function.value(x))).collect();
            cmaes.tell(&merits);
            total += merits.len();
        }
    }
    let mean = total as f64 / runs as f64;
    assert!((20_000.0..45_000.0).contains(&mean), "{mean} evaluations");
}

/// A descent learns the shape of the function: it does as well on a rotated ellipsoid.
#[test]
fn a_descent_does_not_care_how_the_axes_lie() {
    let turned = |x: &[f64]| {
        let n = x.len();
        // Reflection on the plane normal to (1, ..., 1): an orthogonal matrix without zeros.
        let mean = x.iter().sum::<f64>() / n as f64;
        let y: Vec<f64> = x.iter().map(|x| x - 2.0 * mean).collect();
        y.iter().enumerate().map(|(i, y)| 1e6f64.powf(i as f64 / (n as f64 - 1.0)) * y * y).sum::<f64>()
    };
    let settings = DescentSettings { population: 10, evaluations: 12_000, tolerance: 0.0, floor: 0.0 };
    let start = Start::Round { middle: vec![2.0; 8], step: 0.1 };
    let mut descent = Descent::new(space(8), start, settings, Origin::new(1, 0));
    minimise(&mut descent, 12_000, &|x| Merit::Feasible(turned(x)));
    assert!(value(descent.best().unwrap()) < 1e-9, "{:?}", descent.best());
}

#[test]
fn the_seed_and_the_replicate_decide_everything() {
    for name in NAMES {
        let run = |seed, replicate| {
            let mut optimizer = make(name, space(3), 4000, seed, replicate);
            let used = minimise(optimizer.as_mut(), 4000, &|x| Merit::Feasible(functions::RASTRIGIN.value(x)));
            (optimizer.best().unwrap().clone(), used)
        };
        assert_eq!(run(7, 3), run(7, 3), "{name}");
        assert_ne!(run(7, 3).0.point, run(7, 4).0.point, "{name}");
        assert_ne!(run(7, 3).0.point, run(8, 3).0.point, "{name}");
    }
}

#[test]
fn the_evaluations_given_are_not_exceeded() {
    for name in ["lshade", "auto"] {
        for evaluations in [100, 137, 500, 1999, 7777] {
            let mut optimizer = make(name, space(4), evaluations, 1, 0);
            let mut used = 0;
            while optimizer.ended().is_none() {
                let asked = optimizer.ask();
                used += asked.len() as u64;
                optimizer
                    .tell(&asked.iter().map(|x| Merit::Feasible(functions::ROSENBROCK.value(x))).collect::<Vec<_>>());
            }
            assert!(used <= evaluations, "{name} takes {used} of {evaluations}");
            assert!(2 * used >= evaluations, "{name} leaves most: {used} of {evaluations}");
        }
    }
}

/// A minimum in a corner, behind two slopes: found on the bound itself.
#[test]
fn a_minimum_on_a_bound_is_found_there() {
    let f = |x: &[f64]| 3.0 - x[0] + 0.5 * x[1] + (x[2] - 1.5).powi(2) + 0.3 * (x[2] - 1.5) * (x[0] - 10.0);
    for name in ["lshade", "cmaes", "auto"] {
        let mut optimizer = make(name, space(3), 20_000, 1, 0);
        minimise(optimizer.as_mut(), 20_000, &|x| Merit::Feasible(f(x)));
        let best = optimizer.best().unwrap();
        for (found, wanted) in best.point.iter().zip([10.0, -5.0, 1.5]) {
            assert!((found - wanted).abs() < 1e-3, "{name}: {best:?}");
        }
        if name == "auto" {
            assert_eq!(best.point[..2], [10.0, -5.0], "put on the bounds");
        }
    }
}

/// Most of the box is infeasible, and the minimum lies on the border of the feasible region.
#[test]
fn a_minimum_on_the_border_of_the_feasible_is_found() {
    let merit = |x: &[f64]| {
        let sum: f64 = x.iter().sum();
        // Feasible above a plane that cuts off a corner of the box; below it, a closer candidate survives longer.
        if sum < 16.0 { Merit::Infeasible { survived: (1000.0 + 10.0 * sum) as usize } } else { Merit::Feasible(sum) }
    };
    for name in ["lshade", "cmaes", "auto"] {
        let mut optimizer = make(name, space(2), 20_000, 1, 0);
        minimise(optimizer.as_mut(), 20_000, &merit);
        let best = value(optimizer.best().unwrap());
        assert!((16.0..16.001).contains(&best), "{name}: {best}");
    }
}

/// Nothing feasible at all: no panic, an end, and the longest survivor as the best.
#[test]
fn without_anything_feasible_the_longest_survivor_is_the_best() {
    let merit = |x: &[f64]| Merit::Infeasible { survived: (100.0 * (15.0 - (x[0] - 4.0).abs())) as usize };
    for name in NAMES {
        let mut optimizer = make(name, space(2), 5000, 1, 0);
        minimise(optimizer.as_mut(), 5000, &merit);
        let Merit::Infeasible { survived } = optimizer.best().unwrap().merit else { panic!("nothing is feasible") };
        assert!(survived > 1490, "{name}: {survived}");
    }
}

/// A plateau, as in an objective that uses the whole part of a delay, also one at 0: the search ends and does not run endlessly.
#[test]
fn a_flat_function_ends() {
    for height in [1.0, 0.0] {
        let mut lshade = Lshade::new(space(2), LshadeSettings::new(2, 100_000), Origin::new(1, 0));
        let used = minimise(&mut lshade, u64::MAX, &|_| Merit::Feasible(height));
        assert_eq!((used, lshade.ended()), (100_000, Some(Ended::Spent)), "a tolerance of 0 is none");
        let settings = LshadeSettings { tolerance: 1e-7, ..LshadeSettings::new(2, 100_000) };
        let mut lshade = Lshade::new(space(2), settings, Origin::new(1, 0));
        assert!(minimise(&mut lshade, u64::MAX, &|_| Merit::Feasible(height)) < 100, "nothing to gain at {height}");
        assert_eq!(lshade.ended(), Some(Ended::Converged));
        let mut auto = make("auto", space(2), 100_000, 1, 0);
        assert!(minimise(auto.as_mut(), u64::MAX, &|_| Merit::Feasible(height)) < 5000, "nothing to gain at {height}");
        assert_eq!(auto.ended(), Some(Ended::Converged));
    }
}

/// Rounds that approach 0 never agree within a share of it, but within a millionth of the floor.
#[test]
fn a_minimum_of_zero_is_agreed_on_with_a_floor() {
    let cone = |x: &[f64]| x.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>().sqrt();
    let run = |floor| {
        let mut auto = Auto::new(space(3), AutoSettings { floor, ..AutoSettings::new(3, 200_000) }, Origin::new(1, 0));
        let used = minimise(&mut auto, u64::MAX, &|x| Merit::Feasible(cone(x)));
        (auto.ended(), used, value(auto.best().unwrap()))
    };
    let (ended, used, found) = run(1e-3);
    assert_eq!(ended, Some(Ended::Converged));
    assert!(used < 60_000 && found < 1e-7, "{found} after {used}");
    assert_eq!(run(0.0).0, Some(Ended::Spent), "otherwise the floor does nothing");
    let settings = LshadeSettings { tolerance: 1e-7, floor: 1e-3, ..LshadeSettings::new(3, 100_000) };
    let mut lshade = Lshade::new(space(3), settings, Origin::new(1, 0));
    let used = minimise(&mut lshade, u64::MAX, &|x| Merit::Feasible(cone(x)));
    assert_eq!(lshade.ended(), Some(Ended::Converged), "after {used}");
}

#[test]
fn every_optimiser_searches_one_dimension() {
    let f = |x: &[f64]| 1.0 + (x[0] - 3.3).powi(2) * (1.5 + (4.0 * x[0]).sin());
    for name in NAMES {
        let mut optimizer = make(name, space(1), 6000, 1, 0);
        minimise(optimizer.as_mut(), 6000, &|x| Merit::Feasible(f(x)));
        let best = optimizer.best().unwrap();
        // The genetic algorithm has no local search.
        let within = if name == "ga" { 0.1 } else { 1e-3 };
        assert!((best.point[0] - 3.3).abs() < within, "{name}: {best:?}");
    }
}

/// On a plateau every descent ends with its first generation. The first restart is a large one of twice the population (Hansen 2009: so is
/// every other large one), and small ones are drawn from the default to half of the latest large one.
#[test]
fn the_populations_of_restarts_are_those_of_the_paper() {
    let default = DescentSettings::population_for(8);
    let mut cmaes = make("cmaes", space(8), 40_000, 1, 0);
    let (mut sizes, mut large, mut between) = (Vec::new(), default, 0);
    while cmaes.ended().is_none() {
        let size = cmaes.ask().len();
        cmaes.tell(&vec![Merit::Feasible(1.0); size]);
        if size == 2 * large {
            large = size;
        } else {
            assert!((default..=large.div_ceil(2).max(default)).contains(&size), "{size} beside large ones of {large}");
            between += usize::from(size > default && size < large / 2);
        }
        sizes.push(size);
    }
    assert_eq!(sizes[..4], [default, 2 * default, default, 4 * default]);
    assert!(large >= 128 * default, "up to {large}");
    assert!(between > 10, "the populations drawn are used");
}

/// Approximate merits are off by a millionth, as f32 is: auto reports exact merits.
#[test]
fn auto_polishes_on_exact_merits() {
    let exact = |x: &[f64]| 1.0 + x.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>();
    let rough = |x: &[f64]| {
        let noise = (x[0] * 1e7).sin();
        exact(x) * (1.0 - 1e-6 - 1e-6 * noise)
    };
    let mut auto = Auto::new(space(3), AutoSettings::new(3, 30_000), Origin::new(1, 0));
    let mut exactly = 0;
    while auto.ended().is_none() {
        let wants_exact = auto.wants_exact();
        let asked = auto.ask();
        exactly += if wants_exact { asked.len() } else { 0 };
        let merit = |x: &Vec<f64>| Merit::Feasible(if wants_exact { exact(x) } else { rough(x) });
        auto.tell(&asked.iter().map(merit).collect::<Vec<_>>());
    }
    let best = auto.best().unwrap();
    assert_eq!(best.merit, Merit::Feasible(exact(&best.point)), "an exact merit, although rough ones were lower");
    assert!(value(best) < 1.0 + 1e-7, "{best:?}");
    assert!(exactly > 0 && exactly < 8000, "{exactly}");
}

/// A run of the default optimiser on a function that is lower by 1 from some evaluation on, until a later round has reached the lower
/// value.
fn stopped_in_a_deeper_basin() -> Auto {
    let mut auto = Auto::new(space(3), AutoSettings::new(3, 60_000), Origin::new(1, 0));
    let bowl = |x: &[f64]| 2.0 + x.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>();
    let mut told_exactly = false;
    loop {
        let exactly = auto.wants_exact();
        let deeper = told_exactly && !exactly;
        told_exactly |= exactly;
        let merits: Vec<Merit> =
            auto.ask().iter().map(|x| Merit::Feasible(bowl(x) - f64::from(u8::from(deeper)))).collect();
        auto.tell(&merits);
        if deeper && merits.iter().any(|merit| merit.beats(&Merit::Feasible(1.9))) {
            return auto;
        }
        assert_eq!(auto.ended(), None, "no later round");
    }
}

/// A result of a later round without an exact score is not a result yet, but is kept.
#[test]
fn a_later_round_in_a_deeper_basin_is_a_rival_of_the_best() {
    let auto = stopped_in_a_deeper_basin();
    assert!(value(auto.best().unwrap()) >= 2.0, "told exactly");
    let rival = auto.rival().expect("a rough merit beats the best");
    assert!(value(rival) < 1.9, "{rival:?}");
}

/// On the edge of the feasible region, approximate merits may be feasible where exact ones are not.
#[test]
fn the_best_is_feasible_if_only_by_rough_merits() {
    let mut auto = Auto::new(space(2), AutoSettings::new(2, 20_000), Origin::new(1, 0));
    while auto.ended().is_none() {
        let exactly = auto.wants_exact();
        let merit = |x: &Vec<f64>| match exactly {
            true => Merit::Infeasible { survived: 99 },
            false => Merit::Feasible(1.0 + x[0].abs() + x[1].abs()),
        };
        let merits: Vec<Merit> = auto.ask().iter().map(merit).collect();
        auto.tell(&merits);
    }
    assert!(value(auto.best().unwrap()) < 1.001, "{:?}", auto.best());
    assert_eq!(auto.ended(), Some(Ended::Spent), "rounds agree by exact merits only");
}

/// Two basins, the smaller one deeper: rounds that end in the same one are enough, otherwise others follow; the reported
/// one is then the deeper one.
#[test]
fn auto_goes_on_while_rounds_disagree() {
    const FOUR_ROUNDS: u64 = 40_000;
    let f = |x: &[f64]| {
        let shallow = 1.05 + x.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>();
        let deep = 1.0 + 2.0 * x.iter().map(|x| (x + 2.0).powi(2)).sum::<f64>();
        shallow.min(deep)
    };
    let (mut agreed, mut disagreed) = (0, 0);
    for seed in 1..=24 {
        let mut auto = make("auto", space(3), 150_000, seed, 0);
        let used = minimise(auto.as_mut(), 150_000, &|x| Merit::Feasible(f(x)));
        if used < FOUR_ROUNDS {
            agreed += 1;
            assert_eq!(auto.ended(), Some(Ended::Converged), "seed {seed}");
        } else {
            disagreed += 1;
            assert!(4 * used > 5 * FOUR_ROUNDS, "seed {seed}: {used} evaluations");
            assert!(value(auto.best().unwrap()) < 1.0 + 1e-7, "seed {seed}");
        }
    }
    assert!(agreed >= 2 && disagreed >= 3, "{agreed} agreed, {disagreed} did not");
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
fn the_sizes_are_those_of_the_originals() {
    let mut ga = Ga::new(space(2), GaSettings::default(), 1, 0);
    let first = ga.ask();
    assert_eq!(first.len(), 100, "population_size");
    ga.tell(&vec![Merit::Feasible(1.0); 100]);
    assert_eq!(ga.ask().len(), 70, "30 parents are carried over unscored");

    let settings = LshadeSettings::new(10, 100_000);
    let mut lshade = Lshade::new(space(10), settings, Origin::new(1, 0));
    let mut sizes = Vec::new();
    while lshade.ended().is_none() {
        let asked = lshade.ask();
        sizes.push(asked.len());
        lshade.tell(&asked.iter().map(|x| Merit::Feasible(functions::ROSENBROCK.value(x))).collect::<Vec<_>>());
    }
    assert_eq!(sizes[0], 180, "18 per dimension");
    assert!(sizes.is_sorted_by(|a, b| a >= b) && *sizes[..sizes.len() - 1].last().unwrap() <= 5, "down to 4");
    assert_eq!(sizes.iter().sum::<usize>(), 100_000, "all evaluations, not one more");
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
fn feasible_comes_before_infeasible_and_late_before_early() {
    let (good, bad) = (Merit::Feasible(1.0), Merit::Feasible(2.0));
    let (late, early) = (Merit::Infeasible { survived: 90 }, Merit::Infeasible { survived: 3 });
    for pair in [good, bad, late, early].windows(2) {
        assert_eq!(pair[0].order(&pair[1]), Ordering::Less);
        assert!(pair[0].beats(&pair[1]) && !pair[1].beats(&pair[0]));
    }
    for odd in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(Merit::Feasible) {
        assert!(bad.beats(&odd) && !odd.beats(&bad), "{odd:?} is no value");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn candidates_stay_in_the_box(
        seed in any::<u64>(), lower in -1e3..1e3f64, width in 1e-6..1e3f64, infeasible in any::<bool>(),
    ) {
        for name in NAMES {
            let space = SearchBox { lower: vec![lower; 4], upper: vec![lower + width; 4] };
            let mut optimizer = make(name, space, 3000, seed, 0);
            for _ in 0..40 {
                if optimizer.ended().is_some() {
                    break;
                }
                let asked = optimizer.ask();
                for x in asked.iter().flatten() {
                    prop_assert!((lower..=lower + width).contains(x), "{name}: {x} outside [{lower}, {}]", lower + width);
                }
                let merit = |x: &Vec<f64>| match infeasible && x[1] < lower + 0.4 * width {
                    true => Merit::Infeasible { survived: 7 },
                    false => Merit::Feasible(x[0]),
                };
                optimizer.tell(&asked.iter().map(merit).collect::<Vec<_>>());
            }
        }
    }
}
