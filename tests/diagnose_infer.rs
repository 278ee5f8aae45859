//! The inference as its callers see it: what it refuses, how it is stopped, and that threads do not change it.

use leadlag::bench::{DiagnosisTask, Planted, planted};
use leadlag::calibrate::Overrides;
use leadlag::diagnose::{DiagnoseError, Drive, Effort, Inference, Progress, Question, infer};
use leadlag::extension::Extension;
use leadlag::wgsl::extension_named;
use std::ops::ControlFlow;

fn drives(base: &str, cause: &str) -> Planted {
    let task = DiagnosisTask {
        kind: "one".to_owned(),
        base: base.to_owned(),
        causes: vec![cause.to_owned()],
        rms_mps: 0.10,
        gusts_mps2: 0.0,
        duration_s: 120.0,
        seed: 77,
        effort: "quick".to_owned(),
    };
    planted(&task).expect("a scenario that can be driven")
}

fn ask(
    train: &[Drive],
    holdout: &[Drive],
    bounds: &Overrides,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Inference, DiagnoseError> {
    let causes: Vec<&'static Extension> =
        ["dead_zone", "actuation_lag"].into_iter().map(|name| extension_named(name).expect("in the library")).collect();
    let base = "l-cth".parse().expect("a base");
    infer(&Question { train, holdout, base, effort: Effort::Quick, seed: 5, causes: &causes, bounds }, progress)
}

#[test]
fn the_same_for_any_number_of_threads() {
    let data = drives("l-cth", "dead_zone");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| ask(&data.train, &data.holdout, &Overrides::new(), &mut |_| ControlFlow::Continue(())))
            .expect("a diagnosis")
    };
    let (one, three) = (run(1), run(3));
    assert_eq!((one.verdict, &one.reason, one.simulations), (three.verdict, &three.reason, three.simulations));
    assert_eq!(one.extended.log_likelihood.to_bits(), three.extended.log_likelihood.to_bits());
    assert_eq!(one.extended.noise, three.extended.noise);
    assert_eq!(one.adopted, three.adopted);
    assert_eq!(one.adopted.first().map(|cause| cause.extension.name.as_str()), Some("dead_zone"), "{}", one.reason);
    // What others need of it: runs over all three drives, and a model that they can simulate.
    assert_eq!(one.extended.innovations.len(), 3);
    assert!(one.extended.variant.extensions.get("lead").is_none());
    assert!(one.extended.parameters.get(one.adopted[0].extension.parameters[0]) > 0.0);
}

#[test]
fn it_stops_when_asked_to() {
    let data = drives("l-cth", "dead_zone");
    let mut told = Vec::new();
    let stopped = ask(&data.train, &[], &Overrides::new(), &mut |progress| {
        told.push(progress);
        ControlFlow::Break(())
    });
    assert!(matches!(stopped, Err(DiagnoseError::Stopped)), "{stopped:?}");
    assert_eq!(told.len(), 1);
}

#[test]
fn it_needs_data() {
    let nothing = ask(&[], &[], &Overrides::new(), &mut |_| ControlFlow::Continue(()));
    assert!(matches!(nothing, Err(DiagnoseError::NoData)));
}

#[test]
fn bounds_that_the_data_contradict_are_a_bad_base() {
    let data = drives("l-cth", "dead_zone");
    let bounds = Overrides::from([("v_0".to_owned(), [8.0, 12.0])]);
    let found = ask(&data.train, &[], &bounds, &mut |_| ControlFlow::Continue(())).expect("a diagnosis");
    assert_eq!(found.verdict.name(), "bad_base", "{}", found.reason);
    assert!(found.reason.contains("v_0"), "{}", found.reason);
}
