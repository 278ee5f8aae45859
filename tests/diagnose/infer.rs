//! The inference from the caller's view: refusals, stopping, and independence of threads.

use crate::common::made_up::{self, causes};
use leadlag::internal::bench::planted;
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::search::search_budget::SearchBudget;
use leadlag::internal::diagnose::{DiagnoseError, Drive, Effort, Inference, Progress, Question, infer, infer_with};
use leadlag::internal::extension::Extension;
use leadlag::internal::race::{Policy, Request, race};
use leadlag::internal::synthetic;
use leadlag::internal::trajectory::{Preparation, import, prepare};
use std::ops::ControlFlow;

/// A question about a linear car.
fn question<'a>(
    train: &'a [Drive],
    holdout: &'a [Drive],
    causes: &'a [&'static Extension],
    bounds: &'a Overrides,
) -> Question<'a> {
    made_up::question([train, holdout], "l-cth", causes, bounds)
}

fn ask(
    train: &[Drive],
    holdout: &[Drive],
    bounds: &Overrides,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Inference, DiagnoseError> {
    infer(&question(train, holdout, &causes(&["dead_zone", "actuation_lag"]), bounds), progress)
}

#[test]
fn the_same_for_any_number_of_threads() {
    let data = made_up::drives("dead_zone", "l-cth");
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
    // Input for other tests: runs over all three drives, and a model that they can simulate.
    assert_eq!(one.extended.innovations.len(), 3);
    assert!(one.extended.variant.extensions.get("lead").is_none());
    assert!(one.extended.parameters.get(one.adopted[0].extension.parameters[0]) > 0.0);
}

/// A linear car behind a leader with this profile; it perceives 0.8 s late and reacts to the leader's acceleration.
fn late_and_looking_ahead(profile: synthetic::Profile) -> Drive {
    let effect = |text: &str| text.parse().expect("a known effect");
    let mut follower = synthetic::drawn(synthetic::Base::LCth, 11, 1);
    follower.gusts = Some(synthetic::Gusts { sigma_mps2: 0.05, time_constant_s: 2.0 });
    follower.effects = vec![effect("perception_delay:tp=0.8"), effect("leader_accel_ff:ka=0.65")];
    let scenario = synthetic::Scenario {
        seed: 11,
        duration_s: 300.0,
        noise: synthetic::Noise { speed_mps: 0.02, gap_m: 0.02 },
        profile,
        followers: vec![follower],
        ..synthetic::Scenario::default()
    };
    let mut file = Vec::new();
    synthetic::write_pair(&synthetic::run(&scenario).expect("drives"), 1, &mut file).expect("memory");
    let recording = import::read_bytes(&file, "made_up.csv", None).expect("a pair file");
    let trajectory = prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0);
    Drive::of(&trajectory, None).expect("no jump").0.remove(0)
}

/// The look-ahead compensates for the delay: alone, it gains almost nothing. The race tries the two together.
#[test]
fn two_that_hide_each_other() {
    let drives = [synthetic::Profile::Restless, synthetic::Profile::Cruise, synthetic::Profile::StopAndGo]
        .map(late_and_looking_ahead);
    let causes = causes(&["actuation_lag", "perception_delay", "leader_accel_ff", "dead_zone"]);
    let bounds = Overrides::new();
    let request = Request { seed: 5, ..made_up::request(&drives, "l-cth", &causes, &[], &bounds) };
    let found = race(&request, &Policy::DEFAULT, &mut |_| ControlFlow::Continue(())).expect("a race");
    let named = found.named.expect("a name");
    let names: Vec<&str> = named.causes.iter().map(|cause| cause.name.as_str()).collect();
    assert_eq!(names, ["perception_delay", "leader_accel_ff"], "{:?}", found.tried);
    assert_eq!(named.rivals, [], "{:?}", found.set);
    // In sensor noise only the likelihood names.
    let noisy = Request { sensor_noise: Some(1.0), ..request };
    let found = race(&noisy, &Policy::DEFAULT, &mut |_| ControlFlow::Continue(())).expect("a race");
    assert!(found.named.is_none() && found.recommended().is_empty() && found.power.is_none(), "{:?}", found.tried);
}

/// With two causes the search ends at the simulation limit and reports it; the two causes are the same without the limit.
#[test]
fn it_ends_when_enough_was_simulated() {
    let task = made_up::task("pair", "l-cth", &["periodic", "multi_anticipation"], 0.0, 9116);
    let data = planted(&task).expect("a scenario that can be driven");
    let causes = causes(&["periodic", "multi_anticipation", "dead_zone"]);
    let bounds = Overrides::new();
    let question = question(&data.train, &data.holdout, &causes, &bounds);
    let quick = SearchBudget::of(Effort::Quick);
    let run = |enough| {
        let spending = SearchBudget { enough, ..quick };
        infer_with(&question, &spending, &mut |_| ControlFlow::Continue(())).expect("a diagnosis")
    };
    let (short, long) = (run(0), run(u64::MAX));
    let rounds = |found: &Inference| found.ladder.iter().map(|row| row.round).max();
    assert_eq!((rounds(&short), rounds(&long)), (Some(2), Some(3)), "{}, {}", short.reason, long.reason);
    let names = |found: &Inference| found.adopted.iter().map(|c| c.extension.name.clone()).collect::<Vec<_>>();
    assert_eq!((names(&short).len(), names(&short)), (2, names(&long)));
    let at_the_limit = "stopped at the simulation limit of `--effort quick`; `--effort normal` continues it";
    assert!(!short.complete && short.reason.ends_with(at_the_limit), "{}", short.reason);
    assert!(long.complete && !long.reason.contains("simulation limit"), "{}", long.reason);
    assert!(short.simulations < long.simulations);
}

#[test]
fn it_stops_when_asked_to() {
    let data = made_up::drives("dead_zone", "l-cth");
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
    let data = made_up::drives("dead_zone", "l-cth");
    let bounds = Overrides::from([("v_0".to_owned(), [8.0, 12.0])]);
    let found = ask(&data.train, &[], &bounds, &mut |_| ControlFlow::Continue(())).expect("a diagnosis");
    assert_eq!(found.verdict.into_str(), "bad_base", "{}", found.reason);
    assert!(found.reason.contains("v_0"), "{}", found.reason);
}
