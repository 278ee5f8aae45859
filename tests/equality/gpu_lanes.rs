//! The same text gives the same bits on the GPU and in lanes: all ninety variants, both precisions, both conventions, on
//! measured trajectories; status, cuts and every sum, and the score of every kind of goodness of fit.
//!
//! Bits are asserted on lavapipe, whose arithmetic is exact; hardware may fuse a product with a sum and must stay within tolerances. Each
//! variant runs on the first 2000 samples of four of the twelve followers in turn, and one of the four combinations of convention and
//! precision also computes scores, of one kind in turn; with `LEADLAG_FULL` set, on whole trajectories, with scores of every kind in every
//! combination.

use crate::common;
use crate::common::followers::{self, Follower};
use crate::common::gpu::{job, scores, skipped, variant};
use crate::common::tolerance;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Differences, Evaluator, Observed, Observer, Population, Pull, Raw, Score, Slopes};
use leadlag::internal::gpu::{AdapterChoice, Gpu};
use leadlag::internal::lanes::{InstructionSet, Lanes, LanesPrecision};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::wgsl::Precision;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Candidates per variant, a fifth of the values on a bound.
const CANDIDATES: usize = 64;

const CONVENTIONS: [Convention; 2] = [Convention::PAPER, Convention::AUTHORS];

const PRECISIONS: [(Precision, LanesPrecision); 2] =
    [(Precision::Plain, LanesPrecision::Plain), (Precision::Compensated, LanesPrecision::Compensated)];

/// One goodness of fit per way of adding up.
const KINDS: [&str; 4] = ["nrmse-sva", "rmspe-sv", "u-sva", "rmse-sn-vn"];

fn is_full() -> bool {
    std::env::var_os("LEADLAG_FULL").is_some()
}

/// The followers to run on: whole, or their first samples.
fn followers(test_name: &str) -> Option<Vec<Follower>> {
    let shared = common::shared(test_name)?;
    let followers = followers::all(&shared).into_iter();
    Some(if is_full() { followers.collect() } else { followers.map(|follower| follower.cut(2000)).collect() })
}

fn gpu(follower: &Follower, variant: Variant, convention: Convention, precision: Precision, kind: &str) -> Gpu {
    let gof = kind.parse().expect("a goodness of fit");
    Gpu::new(vec![follower.case(variant, convention)], gof, precision, &AdapterChoice::Best)
        .unwrap_or_else(|e| panic!("{e}"))
}

fn lanes(
    follower: &Follower,
    variant: Variant,
    convention: Convention,
    precision: LanesPrecision,
    kind: &str,
) -> Lanes {
    let gof = kind.parse().expect("a goodness of fit");
    Lanes::new(vec![follower.case(variant, convention)], gof, precision).unwrap_or_else(|e| panic!("{e}"))
}

/// Lavapipe calls itself llvmpipe.
fn is_exact(gpu: &Gpu) -> bool {
    gpu.adapter().is_some_and(|name| name.to_lowercase().contains("llvmpipe"))
}

/// Every number of a run with its name and unit; of a run that ended early only how.
fn numbers(raw: &Raw) -> Vec<(&'static str, f64)> {
    let mut numbers = vec![("status", f64::from(raw.status))];
    if raw.status == 0 {
        let ([s, v, a], [s2, v2, a2], [s_rel, v_rel, a_rel]) = (raw.error2, raw.simulated2, raw.relative2);
        numbers.extend([
            ("steps clipped above", f64::from(raw.n_cut_acc)),
            ("steps clipped below", f64::from(raw.n_cut_dec)),
            ("squared errors of s [m2]", s),
            ("squared errors of v [m2/s2]", v),
            ("squared errors of a [m2/s4]", a),
            ("squares of s [m2]", s2),
            ("squares of v [m2/s2]", v2),
            ("squares of a [m2/s4]", a2),
            ("squared relative errors of s [1]", s_rel),
            ("squared relative errors of v [1]", v_rel),
            ("squared relative errors of a [1]", a_rel),
            ("squared floored errors of v [m2/s2]", raw.floored2_v),
        ]);
    }
    numbers
}

/// The first number that differs in any bit.
fn first_difference(gpu: &Raw, lanes: &Raw) -> Option<String> {
    let pairs = numbers(gpu).into_iter().zip(numbers(lanes));
    let mut differing = pairs.filter(|((_, a), (_, b))| a.to_bits() != b.to_bits());
    let ((name, gpu), (_, lanes)) = differing.next()?;
    Some(format!("{name}: GPU {gpu:?}, lanes {lanes:?}"))
}

fn same_score(a: &Score, b: &Score) -> bool {
    match (a, b) {
        (Score::Value(a), Score::Value(b)) => a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
        (a, b) => a == b,
    }
}

/// On hardware: equal ends, and sums that differ only by roundings, for most candidates.
fn assert_close(what: &str, gpu: &[Raw], lanes: &[Raw]) {
    let same = gpu.iter().zip(lanes).filter(|(a, b)| (a.status == 0) == (b.status == 0)).count();
    assert!(same as f64 >= 0.95 * gpu.len() as f64, "{what}: {same} of {} candidates end alike", gpu.len());
    let both = gpu.iter().zip(lanes).filter(|(a, b)| a.status == 0 && b.status == 0);
    let rmse = |raw: &Raw| raw.error2[0].sqrt();
    let mut differences: Vec<f64> = both.map(|(a, b)| ((rmse(a) - rmse(b)) / rmse(b)).abs()).collect();
    differences.sort_by(f64::total_cmp);
    let median = differences.get(differences.len() / 2).copied().unwrap_or(0.0);
    assert!(median <= tolerance::GPU_SCORE, "{what}: median difference of the root of squared errors {median:e}");
}

/// Result of one combination.
#[derive(Default)]
struct Found {
    candidates: usize,
    survivors: usize,
    scores: usize,
    failures: HashSet<u32>,
    differences: Vec<String>,
}

fn compare(
    follower: &Follower,
    variant: Variant,
    convention: Convention,
    precisions: (Precision, LanesPrecision),
    kinds: &[&str],
) -> Found {
    let seed = u64::from(variant.id()) + 1000;
    let population = follower.population(variant, convention, CANDIDATES, seed, 0.2);
    let mut found = Found::default();
    let what = format!("{variant}, {convention}, {:?}, {}", precisions.0, follower.trajectory.label);
    let new = |kind: &str| {
        (
            gpu(follower, variant, convention, precisions.0, kind),
            lanes(follower, variant, convention, precisions.1, kind),
        )
    };
    let mut evaluators: Vec<_> = kinds.iter().map(|kind| new(kind)).collect();
    if evaluators.is_empty() {
        evaluators.push(new(KINDS[0]));
    }
    let (gpu, lanes) = &mut evaluators[0];
    let jobs = [job(0, &population)];
    let (on_gpu, on_lanes) = (gpu.raw(&jobs).expect("a device"), lanes.raw(&jobs).expect("short delays"));
    if !is_exact(gpu) {
        assert_close(&what, &on_gpu, &on_lanes);
        return found;
    }
    found.candidates = on_gpu.len();
    for (i, (a, b)) in on_gpu.iter().zip(&on_lanes).enumerate() {
        found.survivors += usize::from(a.status == 0);
        found.failures.extend(a.failure().map(|failure| failure.kind as u32));
        if let Some(difference) = first_difference(a, b) {
            found.differences.push(format!("{what}, candidate {i} {:?}: {difference}", population.values(i)));
        }
    }
    for (kind, (gpu, lanes)) in kinds.iter().zip(&mut evaluators) {
        let (on_gpu, on_lanes) = (scores(gpu, &population), scores(lanes, &population));
        found.scores += on_gpu.len();
        for (i, (a, b)) in on_gpu.iter().zip(&on_lanes).enumerate() {
            if !same_score(a, b) {
                let values = population.values(i);
                found.differences.push(format!("{what}, candidate {i} {values:?}: {kind} GPU {a:?}, lanes {b:?}"));
            }
        }
    }
    found
}

#[test]
fn every_variant_gives_the_same_bits() {
    let name = "every_variant_gives_the_same_bits";
    if skipped(name) {
        return;
    }
    let Some(followers) = followers(name) else { return };
    let mut tasks = Vec::new();
    for variant in Variant::all() {
        let id = variant.id() as usize;
        for (k, convention) in CONVENTIONS.into_iter().enumerate() {
            for (l, precisions) in PRECISIONS.into_iter().enumerate() {
                // A driver needs 0.1 to 0.3 s for each kernel, and each kind of goodness of fit needs a separate kernel.
                let turn = 2 * k + l;
                let one = if id % 4 == turn { vec![KINDS[id / 4 % KINDS.len()]] } else { Vec::new() };
                let kinds = if is_full() { KINDS.to_vec() } else { one };
                tasks.push((&followers[(id + 5 * turn) % followers.len()], variant, convention, precisions, kinds));
            }
        }
    }
    let met: HashSet<&str> = tasks.iter().map(|task| task.0.trajectory.label.as_str()).collect();
    assert_eq!(met.len(), 12, "every follower occurs");
    let all: Vec<Found> = tasks.into_par_iter().map(|(f, v, c, p, kinds)| compare(f, v, c, p, &kinds)).collect();
    let sum = |of: &dyn Fn(&Found) -> usize| all.iter().map(of).sum::<usize>();
    let (candidates, survivors) = (sum(&|f| f.candidates), sum(&|f| f.survivors));
    if candidates == 0 {
        println!("{name}: the adapter is no lavapipe, so that bits need not agree: held to tolerances");
        return;
    }
    let differences: Vec<&String> = all.iter().flat_map(|f| &f.differences).collect();
    let failures: HashSet<u32> = all.iter().flat_map(|f| f.failures.iter().copied()).collect();
    println!(
        "{} combinations, {candidates} candidates, {survivors} to the end, {} kinds of failure, {} scores: {} differ in a bit",
        all.len(),
        failures.len(),
        sum(&|f| f.scores),
        differences.len()
    );
    assert!(survivors * 2 > candidates, "{survivors} of {candidates} candidates run to the end");
    assert!(failures.len() >= 2, "crashes and negative radicands occur");
    let shown: Vec<&str> = differences.iter().take(20).map(|d| d.as_str()).collect();
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), shown.join("\n"));
}

/// Survivors of two evaluations, and the number of those that differ in any bit.
fn changed(a: &[Raw], b: &[Raw]) -> (usize, usize) {
    let both: Vec<_> = a.iter().zip(b).filter(|(a, b)| a.status == 0 && b.status == 0).collect();
    (both.len(), both.iter().filter(|(a, b)| first_difference(a, b).is_some()).count())
}

#[test]
fn a_changed_text_changes_the_bits() {
    let name = "a_changed_text_changes_the_bits";
    if skipped(name) {
        return;
    }
    let Some(followers) = followers(name) else { return };
    let power = include_str!("../../shaders/power.wgsl").replace("fn power(", "fn our_power(")
        + "fn power(x: f32, y: f32) -> f32 {
    return select(0.0, pow(max(x, 1.17549435e-38), y), x >= 1.17549435e-38);
}";
    let motion = include_str!("../../shaders/motion/plain.wgsl");
    let (written, other) =
        ("now.s + (dx_l - (now.v_f + v_next) * half_dt)", "(now.s - now.v_f * half_dt) + (dx_l - v_next * half_dt)");
    assert_eq!(motion.matches(written).count(), 1, "shaders/motion/plain.wgsl has the position update in one place");
    let reassociated = motion.replace(written, other);
    let idm = variant("idm");
    for (file, text) in [("shaders/power.wgsl", power.as_str()), ("shaders/motion/plain.wgsl", reassociated.as_str())] {
        let follower = &followers[0];
        let population = follower.population(idm, Convention::PAPER, 256, 11, 0.0);
        let mut gpu = gpu(follower, idm, Convention::PAPER, Precision::Plain, KINDS[0]);
        let mut lanes = lanes(follower, idm, Convention::PAPER, LanesPrecision::Plain, KINDS[0]);
        let jobs = [job(0, &population)];
        let (as_is, on_lanes) = (gpu.raw(&jobs).expect("a device"), lanes.raw(&jobs).expect("short delays"));
        gpu.replace_shader(file, text).expect("the control is valid WGSL");
        let other = gpu.raw(&jobs).expect("a device");
        let (survivors, differ) = changed(&other, &on_lanes);
        println!("{file} replaced: {differ} of {survivors} candidates change a bit");
        assert!(survivors > 128, "{survivors} survivors");
        if is_exact(&gpu) {
            assert_eq!(changed(&as_is, &on_lanes).1, 0, "{file} as it is");
        }
        assert!(differ * 2 > survivors, "{file} replaced: {differ} of {survivors} candidates change a bit");
    }
}

fn observed_difference(gpu: &Observed, lanes: &Observed) -> Option<String> {
    if let Some(difference) = first_difference(&gpu.raw, &lanes.raw) {
        return Some(difference);
    }
    if gpu.raw.status != 0 {
        return None;
    }
    assert_eq!(gpu.blocks.len(), lanes.blocks.len(), "blocks");
    let pairs = gpu.blocks.iter().zip(&lanes.blocks).enumerate();
    let mut differing = pairs.filter(|(_, (a, b))| a.map(f64::to_bits) != b.map(f64::to_bits));
    let (block, (a, b)) = differing.next()?;
    Some(format!("block {block}, sums of whitened squares [1]: GPU {a:?}, lanes {b:?}"))
}

/// Candidates per variant under an observer.
const OBSERVED: usize = 24;

#[test]
fn an_observer_gives_the_same_bits() {
    let name = "an_observer_gives_the_same_bits";
    if skipped(name) {
        return;
    }
    let Some(followers) = followers(name) else { return };
    // Each candidate has another one.
    let observer = |i: usize| {
        let share = i as f64 / OBSERVED as f64;
        let gain = [0.2 * share, 0.02, -0.05, 0.1, -0.03 * share, 0.2];
        Observer { gain, whitening: [0.7, -0.3, 1.6 + share], decay: 0.95 - 0.1 * share }
    };
    // A minute each: an observer keeps every run close to the measured one.
    let followers: Vec<Follower> = followers.iter().map(|follower| follower.cut(600)).collect();
    let compare = |variant: Variant| -> Vec<String> {
        let id = variant.id() as usize;
        let (follower, convention) = (&followers[id * 5 % followers.len()], CONVENTIONS[id % 2]);
        // Neighbours in the catalog differ in their constraints, so that both precisions meet each of them.
        let (precision, on_lanes) = PRECISIONS[(id + id / 3) % 2];
        let population = follower.population(variant, convention, OBSERVED, 7, 0.2);
        let mut gpu = gpu(follower, variant, convention, precision, KINDS[0]);
        let lanes = lanes(follower, variant, convention, on_lanes, KINDS[0]);
        let job = job(0, &population);
        let observers: Vec<Observer> = (0..population.len()).map(observer).collect();
        let a = gpu.observed(&job, &observers, 100).expect("a device");
        let b = lanes.observed(&job, &observers, 100).expect("short delays");
        assert!(b.iter().any(|run| run.raw.status == 0), "{variant}: some candidate runs to the end");
        if !is_exact(&gpu) {
            let raws = |runs: &[Observed]| runs.iter().map(|run| run.raw).collect::<Vec<_>>();
            assert_close(&format!("{variant} observed"), &raws(&a), &raws(&b));
            return Vec::new();
        }
        let label = &follower.trajectory.label;
        let what = |i: usize| format!("{variant}, {convention}, {precision:?}, {label}, candidate {i}");
        let pairs = a.iter().zip(&b).enumerate();
        pairs.filter_map(|(i, (a, b))| Some(format!("{}: {}", what(i), observed_difference(a, b)?))).collect()
    };
    let variants: Vec<Variant> = Variant::all().collect();
    let differences: Vec<String> = variants.into_par_iter().flat_map_iter(compare).collect();
    let shown = &differences[..differences.len().min(20)];
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), shown.join("\n"));
}

/// The candidates of a population, each followed by copies with one value moved by a thousandth of its range.
fn groups(follower: &Follower, variant: Variant, convention: Convention, candidates: usize) -> Grouped {
    let centres = follower.population(variant, convention, candidates, 11, 0.0);
    let bounds = follower.space(variant, convention).bounds;
    let mut population = Population::new(centres.symbols());
    let mut differences = Vec::new();
    for i in 0..centres.len() {
        let centre = centres.values(i);
        let steps: Vec<f64> = bounds.iter().map(|[lower, upper]| 1e-3 * (upper - lower)).collect();
        let (first, held) = (population.len(), i % 2);
        population.push(centre);
        for (k, step) in steps.iter().enumerate().skip(held) {
            let mut moved = centre.to_vec();
            moved[k] += step;
            population.push(&moved);
        }
        differences.push(Differences { first, steps: steps[held..].to_vec() });
    }
    (population, differences)
}

type Grouped = (Population, Vec<Differences>);

/// A score with its derivatives, bit by bit.
fn bits_of(slopes: &Slopes) -> Vec<u64> {
    let numbers = [slopes.gradient.as_slice(), slopes.curvature.as_slice(), slopes.majorant.as_slice()].concat();
    [slopes.cost].iter().chain(&numbers).map(|x| x.to_bits()).collect()
}

/// Sums of products, of groups of two sizes: of each kind of errors, with and without delays, in both precisions.
#[test]
fn derivatives_have_the_same_bits() {
    let name = "derivatives_have_the_same_bits";
    if skipped(name) {
        return;
    }
    let Some(followers) = followers(name) else { return };
    let followers: Vec<Follower> = followers.iter().map(|follower| follower.cut(600)).collect();
    let compare = |variant: Variant| -> (usize, Vec<String>) {
        let id = variant.id() as usize;
        let (follower, convention) = (&followers[id * 5 % followers.len()], CONVENTIONS[id % 2]);
        let (precision, on_lanes) = PRECISIONS[(id + id / 3) % 2];
        let kind = ["nrmse-sva", "rmspe-sv", "rmse-sn-vn"][id / 2 % 3];
        let (population, differences) = groups(follower, variant, convention, 6);
        let mut gpu = gpu(follower, variant, convention, precision, kind);
        let job = job(0, &population);
        let a = gpu.slopes(&job, &differences).expect("a device").expect("a GPU has slopes");
        let b = lanes(follower, variant, convention, on_lanes, kind);
        let b = b.slopes(&job, &differences, Pull::NONE).expect("short delays");
        let complete = |(a, b): &(&Slopes, &Slopes)| a.cost.is_finite() || b.cost.is_finite();
        let pairs: Vec<_> = a.iter().zip(&b).filter(complete).collect();
        let differs = |(a, b): &&(&Slopes, &Slopes)| {
            let close = || {
                (a.cost / b.cost - 1.0).abs() < 1e-3 && (&a.gradient - &b.gradient).norm() < 0.05 * b.gradient.norm()
            };
            if is_exact(&gpu) { bits_of(a) != bits_of(b) } else { !close() }
        };
        let what = |(a, b): &(&Slopes, &Slopes)| {
            format!("{variant}, {convention}, {precision:?}, {kind}: GPU {a:?}, lanes {b:?}")
        };
        (pairs.len(), pairs.iter().filter(differs).map(what).collect())
    };
    let variants: Vec<Variant> = Variant::all().collect();
    let (compared, differences): (Vec<usize>, Vec<Vec<String>>) = variants.into_par_iter().map(compare).unzip();
    let (compared, differences) = (compared.iter().sum::<usize>(), differences.concat());
    println!("derivatives of {compared} scores compared");
    assert!(compared > 200, "only {compared} candidates run to the end");
    assert!(
        differences.is_empty(),
        "{} of {compared} differ:\n{}",
        differences.len(),
        differences[..differences.len().min(5)].join("\n")
    );
}

#[test]
fn every_instruction_set_and_block_size_gives_the_same_bits() {
    let name = "every_instruction_set_and_block_size_gives_the_same_bits";
    let Some(followers) = followers(name) else { return };
    let sets = InstructionSet::available();
    let compared = AtomicUsize::new(0);
    let compare = |(variant, (_, precision)): (Variant, (Precision, LanesPrecision))| -> Vec<String> {
        let turn = variant.id() as usize;
        let (follower, convention) = (&followers[turn % followers.len()], CONVENTIONS[turn / 2 % 2]);
        let population: Population = follower.population(variant, convention, CANDIDATES, 5, 0.2);
        let jobs = [job(0, &population)];
        let lanes = || lanes(follower, variant, convention, precision, KINDS[0]);
        let expected = lanes().raw(&jobs).expect("short delays");
        let others = sets.iter().map(|set| (format!("{set:?}"), lanes().with_instructions(*set)));
        let sizes = [16, 64].map(|size| (format!("blocks of {size}"), lanes().with_lanes(size)));
        let mut differences = Vec::new();
        for (what, mut other) in others.chain(sizes) {
            let found = other.raw(&jobs).expect("short delays");
            for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
                compared.fetch_add(1, Ordering::Relaxed);
                if let Some(difference) = first_difference(a, b) {
                    let label = &follower.trajectory.label;
                    let what = format!("{what}: {variant}, {convention}, {precision:?}, {label}, candidate {i}");
                    differences.push(format!("{what}: {}", difference.replace("GPU", "this").replace("lanes", "best")));
                }
            }
        }
        differences
    };
    let tasks: Vec<_> = Variant::all().flat_map(|v| PRECISIONS.map(|precision| (v, precision))).collect();
    let differences: Vec<String> = tasks.into_par_iter().flat_map_iter(compare).collect();
    println!("{sets:?}, {} runs compared, {} differ", compared.into_inner(), differences.len());
    let shown = &differences[..differences.len().min(20)];
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), shown.join("\n"));
}

/// The kinds above cover every way of adding up.
#[test]
fn kinds_are_goodness_of_fit_functions() {
    let ways: HashSet<String> = KINDS
        .iter()
        .map(|kind| format!("{:?}", kind.parse::<GoodnessOfFit>().expect("a goodness of fit").accumulation()))
        .collect();
    assert_eq!(ways.len(), KINDS.len(), "{ways:?}");
}
