//! Calibrations on the reference, in lanes and on the GPU, over all of Table 3 and as a user starts them, end at the same optimum.
//!
//! L-SHADE searches by the scores of the evaluator. `auto` has derivatives of its own in f64, so that the evaluator beside it changes nothing.

use crate::common;
use crate::common::followers::{self, Follower};
use crate::common::gpu::skipped;
use crate::common::tolerance::SAME_OPTIMUM;
use leadlag::internal::calibrate::{Calibration, OptimizerKind, Replicate, Stop, calibrate};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::Evaluator;
use leadlag::internal::gpu::{AdapterChoice, Gpu};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::Reference;
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::wgsl::{Precision, extension_named};
use std::ops::ControlFlow;
use std::time::Instant;

const AUTHORS: Convention = Convention::AUTHORS;
const GOF: GoodnessOfFit = GoodnessOfFit::NRMSE_SVA;

/// Samples of the trajectory, and evaluations: enough for a surface with one basin, and few enough for the reference. On the first 1500
/// samples IDM has two, 5 % apart.
const SAMPLES: usize = 3000;
const EVALUATIONS: u64 = 16_000;
/// Number of samples where the result does not matter.
const SHORT: usize = 600;

#[test]
fn calibrations_end_at_the_same_optimum() {
    let name = "calibrations_end_at_the_same_optimum";
    let Some(shared) = common::shared(name) else { return };
    let no_gpu = skipped(name);
    // Separate threads, because the other test fills the common ones with long work.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    let follower = followers::all(&shared).remove(0).cut(SAMPLES);
    let wrong: Vec<String> =
        pool.install(|| [1, 4, 37].into_iter().flat_map(|id| compare(&follower, id, no_gpu)).collect());
    assert!(wrong.is_empty(), "other optima, after scoring in f64:\n{}", wrong.join("\n"));
}

#[test]
fn auto_gives_the_same_bytes_whatever_the_evaluator() {
    let name = "auto_gives_the_same_bytes_whatever_the_evaluator";
    let Some(shared) = common::shared(name) else { return };
    let follower = followers::all(&shared).remove(0).cut(SHORT);
    // A periodic command has so many basins that eight searches disagree; rounds by scores follow.
    let periodic = extension_named("periodic").expect("built in");
    let rugged = "gipps".parse::<Variant>().expect("a law").with(periodic).expect("they go together");
    let evaluations = [variant(28), rugged].map(|variant| {
        let mut first: Option<Replicate> = None;
        for mut evaluator in evaluators(&follower, variant, skipped(name)) {
            let found = found(evaluator.as_mut(), &follower, OptimizerKind::Auto, 3 * EVALUATIONS);
            assert!(found.score.is_finite() && !found.near.is_empty(), "{}: {found:?}", evaluator.name());
            assert_eq!(*first.get_or_insert_with(|| found.clone()), found, "{variant}, {}", evaluator.name());
        }
        first.expect("an evaluator").evaluations
    });
    assert!(evaluations[0] < EVALUATIONS && 2 * EVALUATIONS < evaluations[1], "{evaluations:?}");
}

fn variant(id: u32) -> Variant {
    Variant::from_id(id).expect("a variant of the paper")
}

fn evaluators(follower: &Follower, variant: Variant, no_gpu: bool) -> Vec<Box<dyn Evaluator>> {
    let cases = || vec![follower.case(variant, AUTHORS)];
    let mut evaluators: Vec<Box<dyn Evaluator>> = vec![
        Box::new(Reference::new(cases(), GOF)),
        Box::new(Lanes::new(cases(), GOF, LanesPrecision::Plain).expect("a variant that runs")),
    ];
    if !no_gpu {
        let gpu = Gpu::new(cases(), GOF, Precision::Plain, &AdapterChoice::Best).unwrap_or_else(|e| panic!("{e}"));
        evaluators.push(Box::new(gpu));
    }
    evaluators
}

/// Result of a calibration with the settings of `leadlag calibrate`.
fn found(
    evaluator: &mut dyn Evaluator,
    follower: &Follower,
    optimizer: OptimizerKind,
    max_evaluations: u64,
) -> Replicate {
    let variant = *evaluator.variant();
    let space = follower.space(variant, AUTHORS);
    let stop = Stop { max_evaluations, ..Stop::default() };
    let settings = Calibration { optimizer, seed: 1, stop, ..Calibration::default() };
    calibrate(evaluator, &space, &settings, &mut |_| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{variant}: {e}"))
        .remove(0)
}

/// Faults of the optima of a variant.
fn compare(follower: &Follower, id: u32, no_gpu: bool) -> Vec<String> {
    let variant = variant(id);
    let (mut wrong, mut first) = (Vec::new(), None);
    for mut evaluator in evaluators(follower, variant, no_gpu) {
        let started = Instant::now();
        let found = found(evaluator.as_mut(), follower, OptimizerKind::Lshade, EVALUATIONS);
        let expected = *first.get_or_insert(found.score);
        let (difference, seconds) = ((found.score - expected) / expected, started.elapsed().as_secs_f64());
        let line = format!(
            "{variant}, {}: {:.9} after {} evaluations, {difference:+.1e} from the reference's, {seconds:.1} s",
            evaluator.name(),
            found.score,
            found.evaluations
        );
        println!("{line}");
        if difference.abs() > SAME_OPTIMUM {
            wrong.push(line);
        }
    }
    wrong
}
