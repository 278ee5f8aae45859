//! Calibrations on the reference, in lanes and on the GPU end at the same optimum.

use crate::common::tolerance::SAME_OPTIMUM;
use crate::common::{self, followers};
use crate::gpu_common::skipped;
use leadlag::calibrate::{Calibration, Stop, calibrate};
use leadlag::catalog::Variant;
use leadlag::convention::Convention;
use leadlag::evaluator::{Case, Evaluator, Score};
use leadlag::gpu::{AdapterChoice, Gpu};
use leadlag::lanes::{Lanes, LanesPrecision};
use leadlag::reference::{Reference, Trace};
use leadlag::score::GoodnessOfFit;
use leadlag::symbols::Parameters;
use leadlag::wgsl::Precision;
use std::ops::ControlFlow;
use std::time::Instant;

const AUTHORS: Convention = Convention::AUTHORS;
const GOF: GoodnessOfFit = GoodnessOfFit::NRMSE_SVA;

/// Evaluations of each calibration.
const EVALUATIONS: u64 = 20_000;
/// Samples of the trajectory.
const SAMPLES: usize = 1500;

fn best(
    case: &Case,
    space: &leadlag::calibrate::SearchSpace,
    seed: u64,
    evaluator: &mut dyn Evaluator,
) -> (f64, Vec<f64>) {
    let stop = Stop { max_evaluations: EVALUATIONS, ..Stop::default() };
    let settings = Calibration { seed, stop, ..Calibration::default() };
    let found =
        calibrate(evaluator, space, &settings, &mut |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    let candidate = found[0].candidate.clone();
    let mut parameters = Parameters::NONE;
    space.symbols.iter().zip(&candidate).for_each(|(symbol, value)| parameters.set(*symbol, *value));
    let outcome = Reference::outcome(case, &parameters, &mut Trace::default());
    match outcome.score(&GOF, case.convention.bounds) {
        Score::Value(score) => (score, candidate),
        other => panic!("{}: the optimum {candidate:?} has no score in f64: {other:?}", case.variant),
    }
}

#[test]
fn calibrations_end_at_the_same_optimum() {
    let name = "calibrations_end_at_the_same_optimum";
    let Some(shared) = common::shared(name) else { return };
    let no_gpu = skipped(name);
    let follower = followers::all(&shared).remove(0).cut(SAMPLES);
    let mut wrong = Vec::new();
    for id in [1, 4, 37] {
        let variant = Variant::from_id(id).expect("a variant of the paper");
        let (case, space) = (follower.case(variant, AUTHORS), follower.space(variant, AUTHORS));
        let cases = || vec![case.clone()];
        let mut evaluators: Vec<Box<dyn Evaluator>> = vec![
            Box::new(Reference::new(cases(), GOF)),
            Box::new(Lanes::new(cases(), GOF, LanesPrecision::Plain).expect("a lane")),
        ];
        if !no_gpu {
            evaluators.push(Box::new(
                Gpu::new(cases(), GOF, Precision::Plain, &AdapterChoice::Best).unwrap_or_else(|e| panic!("{e}")),
            ));
        }
        let mut found = Vec::new();
        for evaluator in &mut evaluators {
            let started = Instant::now();
            let (score, candidate) = best(&case, &space, 1, evaluator.as_mut());
            let seconds = started.elapsed().as_secs_f64();
            println!("{variant}, {}: {score:.9} in f64 at {candidate:?}, {seconds:.1} s", evaluator.name());
            found.push(score);
        }
        let (other, _) = best(&case, &space, 2, evaluators[1].as_mut());
        println!("{variant}, another seed: {other:.9}, {:.1e} away", ((other - found[0]) / found[0]).abs());
        for (evaluator, score) in evaluators.iter().zip(&found).skip(1) {
            let difference = ((score - found[0]) / found[0]).abs();
            if difference > SAME_OPTIMUM {
                wrong.push(format!("{variant}, {}: {score}, the reference {}", evaluator.name(), found[0]));
            }
        }
    }
    assert!(wrong.is_empty(), "other optima, after scoring in f64:\n{}", wrong.join("\n"));
}
