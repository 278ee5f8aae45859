//! The GPU evaluator: every variant runs, its scores are those of the reference, failures are distinct, and no candidate
//! disturbs another.

use crate::common::gpu::{case, gpu, job, population, scores, skipped, variant};
use crate::common::tolerance;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{BufferSet, Case, Evaluator, Failure, FailureKind, Observer, Population, Score};
use leadlag::internal::gpu::Limits;
use leadlag::internal::reference::Reference;
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::symbols::Symbol;
use leadlag::internal::wgsl::Precision;

const PAPER: Convention = Convention::PAPER;

/// The same candidates, every value changed by a few f32 roundings.
fn shaken(population: &Population, by: f64) -> Population {
    let mut shaken = Population::new(population.symbols());
    for i in 0..population.len() {
        let sign = |k: usize| if (i + k).is_multiple_of(2) { by } else { -by };
        let values = population.values(i).iter().enumerate();
        shaken.push(&values.map(|(k, value)| value * (1.0 + sign(k))).collect::<Vec<f64>>());
    }
    shaken
}

/// Error of each score, in multiples of the limit; `None` if rounding the parameters already changes the f64
/// reference.
fn misses(variant: Variant, convention: Convention, precision: Precision) -> Vec<Option<f64>> {
    let case = case(variant, convention, 300, 0.0);
    let population = population(variant, convention, 64, 1);
    let mut reference = Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA);
    let expected = scores(&mut reference, &population);
    let near = [1e-6, -1e-6, 1e-7, -1e-7].map(|by| scores(&mut reference, &shaken(&population, by)));
    let found = scores(&mut gpu(vec![case], precision, Limits::NONE), &population);
    let miss = |i: usize| match (expected[i], found[i]) {
        (Score::Value(a), Score::Value(found)) => {
            let change = |near: &Vec<Score>| match near[i] {
                Score::Value(b) => (a - b).abs(),
                _ => f64::INFINITY,
            };
            let change = near.iter().map(change).fold(0.0, f64::max);
            (change <= tolerance::GPU_ILL_CONDITIONED * a).then(|| (found - a).abs() / (tolerance::GPU_SCORE * a))
        }
        (a, found) => near.iter().all(|near| near[i] == a).then_some(if found == a { 0.0 } else { f64::INFINITY }),
    };
    (0..population.len()).map(miss).collect()
}

#[test]
fn every_variant_is_close_to_the_reference() {
    if skipped("every_variant_is_close_to_the_reference") {
        return;
    }
    let authors = ["idm", "gipps", "gipps+delay", "gipps+delay+nonlinear+mfc", "l-idm+delay+nonlinear+constant"];
    let paper = Variant::all().flat_map(|v| [(v, PAPER, Precision::Plain), (v, PAPER, Precision::Compensated)]);
    let authors = authors.map(|name| (variant(name), Convention::AUTHORS, Precision::Plain));
    let (mut worst, mut judged, mut all) = (0.0_f64, 0, 0);
    for (variant, convention, precision) in paper.chain(authors) {
        let misses = misses(variant, convention, precision);
        for (i, miss) in misses.iter().enumerate().filter_map(|(i, miss)| Some((i, (*miss)?))) {
            assert!(miss <= 1.0, "{variant}, {convention}, {precision:?}, candidate {i}: {miss} times the tolerance");
            worst = worst.max(miss);
        }
        judged += misses.iter().flatten().count();
        all += misses.len();
    }
    println!("{judged} of {all} candidates are well conditioned; the worst takes {worst:.2} of the tolerance");
    assert!(judged > all / 2, "too few candidates are judged: {judged} of {all}");
}

#[test]
fn compensated_sums_differ_from_plain_ones_and_are_better() {
    if skipped("compensated_sums_differ_from_plain_ones_and_are_better") {
        return;
    }
    let idm = variant("idm");
    let (case, population) = (case(idm, PAPER, 9000, 0.0), population(idm, PAPER, 256, 1));
    let expected = scores(&mut Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA), &population);
    let error = |precision| {
        let found = scores(&mut gpu(vec![case.clone()], precision, Limits::NONE), &population);
        let values = expected.iter().zip(&found).filter_map(|pair| match pair {
            (Score::Value(a), Score::Value(b)) => Some(((b - a) / a).abs()),
            _ => None,
        });
        let mut errors: Vec<f64> = values.collect();
        errors.sort_by(f64::total_cmp);
        println!("{precision:?}: median {:e}, largest {:e}", errors[errors.len() / 2], errors[errors.len() - 1]);
        errors[errors.len() / 2]
    };
    let (plain, compensated) = (error(Precision::Plain), error(Precision::Compensated));
    // Equal values would mean that the driver has cancelled the compensation.
    assert!(compensated < 0.5 * plain, "median error plain {plain}, compensated {compensated}");
}

#[test]
fn failures_have_kind_and_step_and_stay_alone() {
    if skipped("failures_have_kind_and_step_and_stay_alone") {
        return;
    }
    let gipps = variant("gipps+delay+linear+constant");
    let case = case(gipps, PAPER, 1500, 0.0);
    let good = population(gipps, PAPER, 256, 3);
    let mut bad = Population::new(good.symbols());
    let column = |symbol| good.symbols().iter().position(|s| *s == symbol).expect("a parameter of Gipps");
    for i in 0..good.len() {
        let mut values = good.values(i).to_vec();
        match i {
            7 => values[column(Symbol::a_max)] = f64::NAN,
            100 => values[column(Symbol::tau_p)] = f64::NAN,
            101 => values[column(Symbol::v_0)] = f64::INFINITY,
            // Long reaction, weak brakes, and a spacing at standstill that is beyond the measured one: no speed is safe.
            150..170 => {
                values[column(Symbol::t_h)] = 3.0;
                values[column(Symbol::a_min)] = -0.5;
                values[column(Symbol::a_hat_min)] = -5.0;
                values[column(Symbol::theta)] = 0.0;
                values[column(Symbol::d_0)] = 60.0;
            }
            _ => {}
        }
        bad.push(&values);
    }
    let mut gpu = gpu(vec![case.clone()], Precision::Plain, Limits::NONE);
    let (without, with) = (scores(&mut gpu, &good), scores(&mut gpu, &bad));
    let expected = scores(&mut Reference::new(vec![case], GoodnessOfFit::NRMSE_SVA), &bad);
    let mut kinds = [0; 3];
    for i in 0..good.len() {
        if let Score::Failed(Failure { kind, .. }) = with[i] {
            kinds[kind as usize] += 1;
        }
        if [7, 100, 101].contains(&i) {
            assert_eq!(with[i], Score::Failed(Failure { kind: FailureKind::NotFinite, step: 9 }), "candidate {i}");
            assert_eq!(with[i], expected[i], "candidate {i}");
        } else if !(150..170).contains(&i) {
            assert_eq!(with[i], without[i], "candidate {i}");
        }
    }
    println!("crashes, radicands, not finite: {kinds:?}");
    assert!(kinds.iter().all(|count| *count > 0), "every kind occurs: {kinds:?}");
    // Steps: those of the reference, except where rounding decides.
    let same = expected.iter().zip(&with).filter(|(a, b)| match (a, b) {
        (Score::Failed(a), Score::Failed(b)) => a == b,
        (a, b) => matches!(a, Score::Value(_)) == matches!(b, Score::Value(_)),
    });
    assert!(same.count() >= 250, "failures of the reference and of the GPU");
}

#[test]
fn rejected_candidates_and_outcomes_are_those_of_the_reference() {
    if skipped("rejected_candidates_and_outcomes_are_those_of_the_reference") {
        return;
    }
    let (idm, convention) = (variant("l-cth+linear+constant"), Convention::AUTHORS);
    let (case, population) = (case(idm, convention, 600, 0.0), population(idm, convention, 200, 5));
    let mut reference = Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA);
    let mut gpu = gpu(vec![case], Precision::Compensated, Limits::NONE);
    let (expected, found) = (scores(&mut reference, &population), scores(&mut gpu, &population));
    let rejected = |scores: &[Score]| scores.iter().filter(|s| **s == Score::Rejected).count();
    assert!(rejected(&expected) > 0 && rejected(&expected) < 200, "{} rejected", rejected(&expected));
    assert_eq!(rejected(&expected), rejected(&found));
    let jobs = [job(0, &population)];
    let pairs = reference.outcomes(&jobs).unwrap().into_iter().zip(gpu.outcomes(&jobs).unwrap());
    for (i, (a, b)) in pairs.enumerate() {
        assert_eq!(
            (a.n_cut_acc, a.n_cut_dec, a.delay_steps),
            (b.n_cut_acc, b.n_cut_dec, b.delay_steps),
            "candidate {i}"
        );
        let (Ok(a), Ok(b)) = (a.result, b.result) else { continue };
        for (name, (a, b)) in leadlag::internal::score::Measures::NAMES.iter().zip(a.values().iter().zip(b.values())) {
            assert!((a - b).abs() <= tolerance::GPU_SCORE * a.abs(), "candidate {i}, {name}: {a}, {b}");
        }
    }
}

#[test]
fn an_observer_without_gain_changes_no_bit() {
    if skipped("an_observer_without_gain_changes_no_bit") {
        return;
    }
    for precision in [Precision::Plain, Precision::Compensated] {
        let variant = variant("gipps+delay+linear");
        let population = population(variant, PAPER, 100, 2);
        let case = case(variant, PAPER, 1050, 0.0);
        for chunk in [None, Some(130)] {
            let mut gpu = gpu(vec![case.clone()], precision, Limits { chunk, ..Limits::NONE });
            let raw = gpu.raw(&[job(0, &population)]).unwrap();
            let all = |observer: Observer| vec![observer; population.len()];
            let observed = gpu.observed(&job(0, &population), &all(Observer::NONE), 100).unwrap();
            for (i, (raw, observed)) in raw.iter().zip(&observed).enumerate() {
                assert_eq!(*raw, observed.raw, "candidate {i}");
                assert_eq!(observed.blocks.len(), 11);
                if raw.status == 0 {
                    let total: f64 = observed.blocks.iter().map(|block| block[0]).sum();
                    assert!((total - raw.error2[0]).abs() <= 1e-4 * total, "candidate {i}: {total}, {:?}", raw.error2);
                }
            }
            let pull = Observer { gain: [0.2, 0.0, -0.05, 0.1, 0.0, 0.0], ..Observer::NONE };
            let pulled = gpu.observed(&job(0, &population), &all(pull), 100).unwrap();
            let better = pulled.iter().zip(&raw).filter(|(p, r)| p.raw.error2[0] < r.error2[0] || r.status != 0);
            assert!(better.count() > 80, "a correction brings the state closer to the measurement");
        }
    }
}

/// As tests/equality/lanes.rs has it for lanes.
#[test]
fn a_delay_may_equal_its_bound() {
    if skipped("a_delay_may_equal_its_bound") {
        return;
    }
    let variant = variant("idm+delay");
    let drive = case(variant, PAPER, 300, 0.0);
    let mut population = population(variant, PAPER, 8, 1);
    // 0.07/0.01, 0.14/0.02 and 0.28/0.04 are 7 and one last bit.
    for (dt, bound) in [(0.01, 0.07), (0.02, 0.14), (0.04, 0.28)] {
        let mut at_bound = Population::new(population.symbols());
        for i in 0..population.len() {
            let mut values = population.values(i).to_vec();
            *values.last_mut().expect("tau_p is the last") = bound;
            at_bound.push(&values);
        }
        population = at_bound;
        let case = Case { dt, tau_p_upper: bound, ..drive.clone() };
        let expected = scores(&mut Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA), &population);
        let found = scores(&mut gpu(vec![case], Precision::Compensated, Limits::NONE), &population);
        for (a, b) in expected.iter().zip(&found) {
            match (a, b) {
                (Score::Value(a), Score::Value(b)) => assert!((a - b).abs() <= 1e-3 * a, "{dt}: {b} not {a}"),
                (a, b) => assert_eq!(a, b, "{dt}"),
            }
        }
    }
}

#[test]
fn the_other_buffer_set_is_not_waited_for() {
    if skipped("the_other_buffer_set_is_not_waited_for") {
        return;
    }
    let variant = variant("idm");
    let (few, many) = (population(variant, PAPER, 1, 1), population(variant, PAPER, 1 << 13, 2));
    let limits = Limits { chunk: Some(300), ..Limits::NONE };
    let mut gpu = gpu(vec![case(variant, PAPER, 600, 0.0)], Precision::Plain, limits);
    // Kernels are built before.
    scores(&mut gpu, &few);
    gpu.submit(BufferSet::A, &[job(0, &few)]).expect("a device");
    gpu.submit(BufferSet::B, &[job(0, &many)]).expect("a device");
    gpu.collect(BufferSet::A, &mut [Score::Rejected]).expect("a device");
    // Hardware may have finished both.
    assert!(gpu.is_hardware() || !gpu.is_idle(), "the set B was waited for");
    gpu.collect(BufferSet::B, &mut vec![Score::Rejected; many.len()]).expect("a device");
    assert!(gpu.is_idle());
}

#[test]
fn times_count_since_the_evaluator_was_made() {
    if skipped("times_count_since_the_evaluator_was_made") {
        return;
    }
    let variant = variant("idm");
    let population = population(variant, PAPER, 10, 1);
    let limits = Limits { chunk: Some(150), ..Limits::NONE };
    let mut gpu = gpu(vec![case(variant, PAPER, 300, 0.0)], Precision::Plain, limits);
    scores(&mut gpu, &population);
    let before = gpu.timings();
    assert!(before.first_dispatch_s > 0.0 && before.transfer_s > 0.0, "{before:?}");
    // The device is lost, and so are those that are opened in its place.
    gpu.destroy_device();
    gpu.doom(2);
    let mut found = vec![Score::Rejected; population.len()];
    gpu.evaluate(&population, &mut found).expect_err("there is no device");
    let after = gpu.timings();
    assert!(after.first_dispatch_s >= before.first_dispatch_s, "{after:?} after {before:?}");
    assert!(after.transfer_s >= before.transfer_s, "{after:?} after {before:?}");
}
