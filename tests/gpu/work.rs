//! The way in which the GPU evaluator splits work in time, candidates and cases changes no bit, and a lost device is replaced.

use crate::common;
use crate::common::gpu::{case, gpu, job, population, scores, skipped, space, variant};
use crate::common::program::{json_of, ok, scratch, text};
use leadlag::internal::calibrate::{Calibration, OptimizerKind, Replicate, Stop, calibrate};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{
    BufferSet, Case, Course, EvaluateError, Evaluator, Fallback, Job, Observer, Population, Raw, Score, Share,
};
use leadlag::internal::gpu::{AdapterChoice, Gpu, Limits};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::Reference;
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::symbols::Symbol;
use leadlag::internal::wgsl::Precision;
use serde_json::{Value, json};
use std::ops::ControlFlow;

const PAPER: Convention = Convention::PAPER;
const NAMES: [&str; 3] = ["idm", "gipps+delay+nonlinear+mfc", "l-gipps+delay+linear+constant"];

/// Bits, so that NaN equals NaN.
fn bits(raw: &[Raw]) -> Vec<String> {
    raw.iter().map(|raw| format!("{raw:?}")).collect()
}

fn cases(variant: Variant) -> Vec<Case> {
    [(700, 0.0), (1100, 1.0), (400, 2.0)].map(|(samples, phase)| case(variant, PAPER, samples, phase)).to_vec()
}

#[test]
fn chunks_and_limits_change_no_bit() {
    if skipped("chunks_and_limits_change_no_bit") {
        return;
    }
    // 16 KiB hold the samples of one case only, and about 100 candidates.
    let binding = 1100 * 48 + 768;
    let small = [
        ("chunks of 37 samples", Limits { chunk: Some(37), ..Limits::NONE }),
        ("chunks shorter than a delay", Limits { chunk: Some(5), ..Limits::NONE }),
        ("two workgroups a dimension", Limits { workgroups: 2, ..Limits::NONE }),
        ("small bindings", Limits { binding, ..Limits::NONE }),
        ("all of it", Limits { binding, buffer: 2 * binding, workgroups: 2, chunk: Some(200), ..Limits::NONE }),
        ("workgroups of hardware", Limits { as_hardware: true, ..Limits::NONE }),
    ];
    for name in NAMES {
        let variant = variant(name);
        let populations = [1, 2, 3].map(|seed| population(variant, PAPER, 300, seed));
        // Out of order, one case twice.
        let jobs = [job(2, &populations[0]), job(0, &populations[1]), job(2, &populations[2]), job(1, &populations[1])];
        for precision in [Precision::Plain, Precision::Compensated] {
            let mut whole = gpu(cases(variant), precision, Limits::NONE);
            let expected = bits(&whole.raw(&jobs).unwrap());
            let mut expected_scores = vec![Score::Rejected; 1200];
            whole.submit(BufferSet::A, &jobs).unwrap();
            whole.collect(BufferSet::A, &mut expected_scores).unwrap();
            for (what, limits) in small {
                let mut gpu = gpu(cases(variant), precision, limits);
                assert!(bits(&gpu.raw(&jobs).unwrap()) == expected, "{name}, {precision:?}, {what}: raw sums differ");
                let mut found = vec![Score::Rejected; 1200];
                gpu.submit(BufferSet::B, &jobs).unwrap();
                gpu.collect(BufferSet::B, &mut found).unwrap();
                assert!(found == expected_scores, "{name}, {precision:?}, {what}: scores differ");
            }
        }
    }
}

/// On hardware other samples are in uniform memory than on software: none if each candidate begins at another one.
#[test]
fn the_kernels_of_hardware_give_the_same_bits() {
    if skipped("the_kernels_of_hardware_give_the_same_bits") {
        return;
    }
    for (name, convention) in NAMES.into_iter().flat_map(|name| [(name, PAPER), (name, Convention::AUTHORS)]) {
        let variant = variant(name);
        let population = population(variant, convention, 150, 7);
        let run = |limits| {
            let mut gpu = gpu(vec![case(variant, convention, 700, 0.5)], Precision::Plain, limits);
            let raw = bits(&gpu.raw(&[job(0, &population)]).unwrap());
            (raw, scores(&mut gpu, &population))
        };
        let expected = run(Limits::NONE);
        for chunk in [None, Some(90)] {
            assert!(
                run(Limits { as_hardware: true, chunk, ..Limits::NONE }) == expected,
                "{name}, {convention}, {chunk:?}"
            );
        }
    }
}

#[test]
fn observers_go_with_their_candidates_into_every_part() {
    if skipped("observers_go_with_their_candidates_into_every_part") {
        return;
    }
    let variant = variant("gipps+delay");
    let population = population(variant, PAPER, 300, 3);
    let observer = |i: usize| {
        let share = i as f64 / 300.0;
        let gain = [0.1 + share, 0.02, 0.03, 0.2 * share, -0.05, 0.3];
        Observer { gain, whitening: [1.0, 0.3 * share, 2.0], decay: 0.9 }
    };
    let observers: Vec<Observer> = (0..300).map(observer).collect();
    let observed = |limits| {
        let mut gpu = gpu(vec![case(variant, PAPER, 300, 0.0)], Precision::Plain, limits);
        format!("{:?}", gpu.observed(&job(0, &population), &observers, 30).unwrap())
    };
    // Two workgroups in either direction are 128 candidates.
    assert!(observed(Limits { workgroups: 2, ..Limits::NONE }) == observed(Limits::NONE));
}

#[test]
fn jobs_together_are_jobs_one_by_one() {
    if skipped("jobs_together_are_jobs_one_by_one") {
        return;
    }
    for name in NAMES {
        let variant = variant(name);
        let mut gpu = gpu(cases(variant), Precision::Plain, Limits::NONE);
        let populations = [1, 2, 3, 4].map(|seed| population(variant, PAPER, 50 + seed as usize, seed));
        let all: Vec<Job> = [2, 0, 1, 0].into_iter().zip(&populations).map(|(case, p)| job(case, p)).collect();
        let together = bits(&gpu.raw(&all).unwrap());
        let alone: Vec<String> = all.iter().flat_map(|job| bits(&gpu.raw(&[*job]).unwrap())).collect();
        assert!(together == alone, "{name}");
    }
}

#[test]
fn many_candidates_are_laid_out_as_few_are() {
    if skipped("many_candidates_are_laid_out_as_few_are") {
        return;
    }
    for name in ["gipps+delay", "l-cth"] {
        let variant = variant(name);
        let mut gpu = gpu(vec![case(variant, PAPER, 60, 0.0)], Precision::Plain, Limits::NONE);
        // As many as several threads share.
        let many = population(variant, PAPER, 12_000, 5);
        let together = bits(&gpu.raw(&[job(0, &many)]).unwrap());
        for from in (0..many.len()).step_by(1_000) {
            let mut few = Population::new(many.symbols());
            (from..from + 1_000).for_each(|i| few.push(many.values(i)));
            assert!(bits(&gpu.raw(&[job(0, &few)]).unwrap()) == together[from..from + 1_000], "{name}, from {from}");
        }
    }
}

#[test]
fn two_buffer_sets_do_not_disturb_each_other() {
    if skipped("two_buffer_sets_do_not_disturb_each_other") {
        return;
    }
    let variant = variant(NAMES[1]);
    let mut gpu = gpu(cases(variant), Precision::Plain, Limits { chunk: Some(150), ..Limits::NONE });
    let populations: Vec<Population> =
        (0..6).map(|seed| population(variant, PAPER, 80 + 30 * seed, seed as u64)).collect();
    let alone: Vec<Vec<Score>> = populations.iter().map(|p| scores(&mut gpu, p)).collect();
    let jobs: Vec<Vec<Job>> = populations.iter().map(|p| (0..3).map(|case| job(case, p)).collect()).collect();
    let collect = |gpu: &mut Gpu, set, k: usize| {
        let n = populations[k].len();
        let mut found = vec![Score::Rejected; 3 * n];
        gpu.collect(set, &mut found).unwrap();
        let shares = [700, 1100, 400].map(|samples| Share { samples, weight: None });
        (0..n).map(|i| Score::joint((0..3).map(|case| (found[case * n + i], shares[case])))).collect::<Vec<_>>()
    };
    let sets = [BufferSet::A, BufferSet::B];
    gpu.submit(BufferSet::A, &jobs[0]).unwrap();
    for k in 0..6 {
        if k < 5 {
            gpu.submit(sets[(k + 1) % 2], &jobs[k + 1]).unwrap();
        }
        // Outcomes in between use neither set.
        assert_eq!(gpu.outcomes(&[job(0, &populations[0])]).unwrap().len(), populations[0].len());
        assert!(collect(&mut gpu, sets[k % 2], k) == alone[k], "population {k}");
    }
    let mut none = [Score::Rejected; 1];
    assert!(matches!(gpu.collect(BufferSet::A, &mut none), Err(EvaluateError::Room { candidates: 0, scores: 1 })));
    gpu.submit(BufferSet::A, &[]).unwrap();
    gpu.collect(BufferSet::A, &mut []).unwrap();
}

#[test]
fn generations_allocate_nothing_on_the_device() {
    if skipped("generations_allocate_nothing_on_the_device") {
        return;
    }
    let variant = variant(NAMES[2]);
    let mut gpu = gpu(cases(variant), Precision::Plain, Limits { chunk: Some(150), ..Limits::NONE });
    let before = gpu.allocations();
    let populations: Vec<Population> =
        (0..9).map(|seed| population(variant, PAPER, 300 - 7 * seed, seed as u64)).collect();
    let mut generation = |k: usize, set: BufferSet| {
        let jobs: Vec<Job> = (0..3).map(|case| job(case, &populations[k])).collect();
        let mut found = vec![Score::Rejected; 3 * populations[k].len()];
        gpu.submit(set, &jobs).unwrap();
        gpu.collect(set, &mut found).unwrap();
        gpu.allocations()
    };
    let first = generation(0, BufferSet::A);
    assert!(first > before, "the first generation makes the buffers");
    let both = generation(1, BufferSet::B);
    assert!(both > first, "each set has its own");
    for k in 2..9 {
        let set = if k % 2 == 0 { BufferSet::A } else { BufferSet::B };
        assert_eq!(generation(k, set), both, "generation {k}");
    }
}

#[test]
fn rings_of_every_length_remember_alike() {
    if skipped("rings_of_every_length_remember_alike") {
        return;
    }
    for (dt, upper, ring) in [(0.1, 0.8, 10), (0.1, 1.5, 17), (0.02, 0.8, 42), (0.1, 7.0, 72)] {
        for name in ["idm+delay", "gipps+delay+linear+constant"] {
            let variant = variant(name);
            let mut case = case(variant, PAPER, 400, 0.4);
            (case.dt, case.tau_p_upper) = (dt, upper);
            assert_eq!(Course::new(&case).expect("a short course").ring, ring, "ceil({upper} s / {dt} s) + 2");
            // Well-behaved candidates, so that a sample too early or too late shows, and rounding does not.
            let space = space(variant, PAPER);
            let mut population = Population::new(&space.symbols);
            for k in 0..=40 {
                let value = |(symbol, [lower, upper_bound]): (&Symbol, &[f64; 2])| match symbol {
                    Symbol::tau_p => upper * f64::from(k) / 40.0,
                    _ => 0.7 * lower + 0.3 * upper_bound,
                };
                population.push(&space.symbols.iter().zip(&space.bounds).map(value).collect::<Vec<_>>());
            }
            let jobs = [job(0, &population)];
            let what = format!("{name}, {dt} s, delays up to {upper} s");
            let mut lanes = Lanes::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain).unwrap();
            let expected = lanes.raw(&jobs).unwrap();
            assert!(expected.iter().filter(|raw| raw.status == 0).count() > 10, "{what}: many run to the end");
            for chunk in [None, Some(7)] {
                let mut gpu = gpu(vec![case.clone()], Precision::Plain, Limits { chunk, ..Limits::NONE });
                if gpu.adapter().is_some_and(|adapter| adapter.contains("llvmpipe")) {
                    assert!(bits(&gpu.raw(&jobs).unwrap()) == bits(&expected), "{what}, chunks of {chunk:?}");
                }
            }
            let exact = scores(&mut Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA), &population);
            let mut in_f64 = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64).unwrap();
            for (k, pair) in exact.iter().zip(scores(&mut in_f64, &population)).enumerate() {
                match pair {
                    (Score::Value(a), Score::Value(b)) => {
                        assert!(((a - b) / a).abs() < common::tolerance::WHOLE_RUN, "{what}, candidate {k}: {a}, {b}");
                    }
                    (a, b) => assert_eq!(*a, b, "{what}, candidate {k}"),
                }
            }
        }
    }
}

/// Destroys the device during some of the submissions; from the seventh on, its replacement as well, if it is to stay lost.
struct Saboteur {
    gpu: Gpu,
    submissions: u32,
    for_good: bool,
}

impl Evaluator for Saboteur {
    leadlag::internal::forward_evaluator!(gpu: cases, gof, name, precision, outcomes);

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        self.submissions += 1;
        if self.submissions == 4 {
            self.gpu.destroy_device();
        }
        self.gpu.submit(set, jobs)
    }
    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        if self.submissions == 7 {
            self.gpu.destroy_device();
            self.gpu.doom(if self.for_good { 1000 } else { 0 });
        }
        self.gpu.collect(set, scores)
    }
}

/// Some generations of a calibration.
fn calibrated(variant: Variant, evaluator: &mut dyn Evaluator) -> Vec<Replicate> {
    let stop = Stop { max_evaluations: 1500, ..Stop::default() };
    let settings = Calibration { optimizer: OptimizerKind::Ga, seed: 5, stop, ..Calibration::default() };
    calibrate(evaluator, &space(variant, PAPER), &settings, &mut |_| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_calibration_survives_a_lost_device() {
    if skipped("a_calibration_survives_a_lost_device") {
        return;
    }
    let variant = variant("l-cth+delay");
    let run = |evaluator: &mut dyn Evaluator| calibrated(variant, evaluator);
    let undisturbed = run(&mut gpu(cases(variant), Precision::Plain, Limits::NONE));
    let gpu = gpu(cases(variant), Precision::Plain, Limits { chunk: Some(300), ..Limits::NONE });
    let mut saboteur = Saboteur { gpu, submissions: 0, for_good: false };
    assert_eq!(run(&mut saboteur), undisturbed);
    assert!(saboteur.submissions > 10);
}

#[test]
fn lanes_go_on_where_a_device_is_lost_for_good() {
    if skipped("lanes_go_on_where_a_device_is_lost_for_good") {
        return;
    }
    let variant = variant("l-cth+delay");
    let run = |evaluator: &mut dyn Evaluator| calibrated(variant, evaluator);
    let mut undisturbed = gpu(cases(variant), Precision::Plain, Limits::NONE);
    let is_exact = undisturbed.adapter().is_some_and(|adapter| adapter.contains("llvmpipe"));
    let expected = run(&mut undisturbed);
    let gpu = gpu(cases(variant), Precision::Plain, Limits { chunk: Some(300), ..Limits::NONE });
    let replace = |error: &EvaluateError, cases| {
        assert!(matches!(error, EvaluateError::Device { .. }), "{error}");
        let lanes = Lanes::new(cases, GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain)?;
        Ok(Box::new(lanes) as Box<dyn Evaluator>)
    };
    let saboteur = Saboteur { gpu, submissions: 0, for_good: true };
    let mut fallback = Fallback::new(Box::new(saboteur), Box::new(replace));
    let found = run(&mut fallback);
    assert_eq!(fallback.name(), "lanes");
    // Lavapipe and lanes have the same bits, so the point of the takeover does not show.
    if is_exact {
        assert_eq!(found, expected);
    }
}

#[test]
fn work_in_flight_survives_and_a_second_failure_is_told() {
    if skipped("work_in_flight_survives_and_a_second_failure_is_told") {
        return;
    }
    let variant = variant("idm");
    let population = population(variant, PAPER, 100, 1);
    let mut gpu =
        gpu(vec![case(variant, PAPER, 500, 0.0)], Precision::Plain, Limits { chunk: Some(90), ..Limits::NONE });
    let expected = scores(&mut gpu, &population);
    let jobs = [job(0, &population)];
    let mut found = vec![Score::Rejected; 100];
    gpu.submit(BufferSet::A, &jobs).unwrap();
    gpu.submit(BufferSet::B, &jobs).unwrap();
    gpu.destroy_device();
    for set in [BufferSet::A, BufferSet::B] {
        gpu.collect(set, &mut found).unwrap();
        assert_eq!(found, expected);
    }
    gpu.destroy_device();
    gpu.doom(1);
    let mut failed = gpu.submit(BufferSet::A, &jobs);
    if failed.is_ok() {
        failed = gpu.collect(BufferSet::A, &mut found);
    }
    let Err(EvaluateError::Device { adapter, message, .. }) = failed else { panic!("{failed:?}") };
    assert!(adapter == gpu.adapter().unwrap() && !message.is_empty(), "{adapter}: {message}");
    // Once the driver works again, so does the evaluator.
    assert_eq!(scores(&mut gpu, &population), expected);
}

#[test]
fn an_adapter_that_is_not_there_is_told_with_those_that_are() {
    if skipped("an_adapter_that_is_not_there_is_told_with_those_that_are") {
        return;
    }
    let case = case(variant("idm"), PAPER, 300, 0.0);
    let new = |choice: &str| {
        let choice: AdapterChoice = choice.parse().unwrap();
        Gpu::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA, Precision::Plain, &choice)
    };
    let error = new("Voodoo 2").map(|_| ()).unwrap_err();
    let EvaluateError::Adapter { wanted, present } = &error else { panic!("{error}") };
    assert_eq!(wanted.as_deref(), Some("Voodoo 2"));
    assert!(!present.is_empty() && error.to_string().contains(&present[0]), "{error}");
    let first = new("0").unwrap().adapter().unwrap();
    assert!(first.starts_with(present[0].split("  ").nth(1).unwrap().split(" (").next().unwrap()), "{first}");
}

/// The same candidates as on the CPU, where the device computes the same bits; a result in any case.
#[test]
fn a_calibration_on_the_gpu_by_the_command_line() {
    if skipped("a_calibration_on_the_gpu_by_the_command_line") {
        return;
    }
    let folder = scratch("gpu_work", "calibrated");
    ok(&["synth", "--out", text(&folder), "--duration", "60"]);
    let file = folder.join("platoon.csv");
    for (optimizer, more) in [("ga", &[][..]), ("ga", &["--population", "300"]), ("auto", &[])] {
        let calibrated = |evaluator: &str| -> Value {
            let out = folder.join(format!("{optimizer}_{evaluator}_{}", more.len()));
            let model =
                ["calibrate", text(&file), "--follower", "1", "--model", "idm+delay", "--max-evaluations", "600"];
            let how = ["--optimizer", optimizer, "--evaluator", evaluator, "--precision", "plain", "--out", text(&out)];
            ok(&[&model[..], &how, more].concat());
            json_of(out.join("result.json"))
        };
        let [on_gpu, on_cpu] = ["gpu", "lanes"].map(calibrated);
        assert_eq!((&on_gpu["evaluator"], &on_gpu["optimizer"]), (&json!("gpu"), &on_cpu["optimizer"]), "{optimizer}");
        assert_eq!(on_gpu["population"].as_u64(), (!more.is_empty()).then_some(300));
        assert!(on_gpu["score"]["nrmse_sva"].as_f64().is_some_and(|score| score > 0.0), "{optimizer}");
        let adapter = on_gpu["adapter"].as_str().expect("its name");
        if adapter.contains("llvmpipe") {
            for key in ["parameters", "score", "evaluations", "replicates"] {
                assert_eq!(on_gpu[key], on_cpu[key], "{optimizer}, {key}");
            }
        }
    }
}
