//! Effects hidden in synthetic drives are named; drives without an effect have no name.
//!
//! `synthetic` generates the truth and shares no code with the diagnosis. Seeds are fixed and were not used for tuning, unless stated;
//! `leadlag bench diagnosis` runs the same with any number of cases.

use crate::common::{
    self,
    made_up::{self, task},
};
use leadlag::internal::bench::{DiagnosisOutcome, DiagnosisTask, Judgement, infer_task, judge, planted};
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::describe::describe;
use leadlag::internal::diagnose::{Drive, Effort, Question, infer};
use leadlag::internal::extension::Extension;
use leadlag::internal::race::{Answer, Policy, race};
use leadlag::internal::trajectory::{Preparation, import, prepare};
use leadlag::internal::wgsl::library;
use std::ops::ControlFlow;

/// Allowed relative error of an estimate, and allowed number of standard errors; the larger limit counts.
const WITHIN: f64 = 0.10;
const ERRORS: f64 = 3.0;

/// Share of the truth's gain on the hold-out that the extended model has to reach.
const GAINED: f64 = 0.8;

fn told(outcome: &DiagnosisOutcome) -> String {
    format!(
        "{} on {}, seed {}: {} ({}), adopted {:?}, or {:?}; planted {:?}, estimated {:?}; NRMSE(s,v,a) of base, extended and truth {:?}; \
         fitted from the truth: {:?}",
        outcome.task.kind,
        outcome.task.base,
        outcome.task.seed,
        outcome.verdict,
        outcome.reason,
        outcome.adopted,
        outcome.confounded_with,
        outcome.truth,
        outcome.estimates,
        outcome.gain,
        outcome.known
    )
}

/// The cause is named, its size is right, and the extended model has most of the truth's gain.
fn named(base: &str, cause: &str, seed: u64) {
    let outcome = sized(&task("one", base, &[cause], 0.0, seed));
    let share = outcome.share_of_gain().unwrap_or_else(|| panic!("a crash, or nothing to gain: {}", told(&outcome)));
    assert!(share >= GAINED, "{:.0} % of the possible gain: {}", 100.0 * share, told(&outcome));
}

/// Named, and with the right size.
fn sized(task: &DiagnosisTask) -> DiagnosisOutcome {
    let outcome = infer_task(task);
    assert_eq!(judge(&outcome), Judgement::Right, "{}", told(&outcome));
    assert_eq!(outcome.adopted[..1], task.causes, "{}", told(&outcome));
    // The first parameter is the strength.
    let sizes = outcome.truth.iter().filter(|(name, _)| !name.ends_with(".t1") && !name.ends_with(".dur"));
    for (name, truth) in sizes {
        let [value, error] = outcome.estimates[name];
        let off = (value - truth).abs();
        assert!(off < (WITHIN * truth.abs()).max(ERRORS * error), "{name}: {}", told(&outcome));
    }
    outcome
}

fn silent(kind: &str, base: &str, causes: &[&str], gusts: f64, seed: u64) {
    let outcome = infer_task(&task(kind, base, causes, gusts, seed));
    assert_eq!(judge(&outcome), Judgement::Right, "{}", told(&outcome));
    assert!(outcome.adopted.is_empty(), "{}", told(&outcome));
}

/// On IDM, tests/program/report.rs finds one in the demo. Its gain is left out: no training drive accelerates freely, so v_0 (24.9 m/s
/// instead of 31.6) and a_max stay undetermined, and the hold-out depends more on these than on the grade.
#[test]
fn a_grade_that_is_not_made_up_for() {
    sized(&task("one", "gipps", &["grade"], 0.0, 9101));
}

#[test]
fn a_dead_zone() {
    named("idm", "dead_zone", 9102);
}

#[test]
fn a_largest_acceleration() {
    named("l-cth", "accel_cap", 9103);
}

#[test]
fn a_change_of_the_headway() {
    named("idm", "headway_mode_change", 9104);
}

#[test]
fn a_limit_of_the_jerk() {
    named("gipps", "jerk_limit", 9105);
}

#[test]
fn a_lag_or_one_of_its_family() {
    let outcome = infer_task(&task("one", "l-cth", &["actuation_lag"], 0.0, 9107));
    assert!(matches!(judge(&outcome), Judgement::Right | Judgement::InSet), "{}", told(&outcome));
}

/// These 240 s do not reveal the lag: fitted from the planted values, the model with it is no likelier than the one
/// without.
#[test]
fn nothing_where_the_truth_has_no_evidence() {
    let outcome = infer_task(&task("one", "l-cth", &["actuation_lag"], 0.0, 9106));
    let known = outcome.known.as_ref().expect("fitted from the truth, because it was not named");
    assert!(known.evidence < known.threshold, "{}", told(&outcome));
    assert_eq!(judge(&outcome), Judgement::Silent, "{}", told(&outcome));
}

#[test]
fn nothing_in_white_noise() {
    silent("none", "idm", &[], 0.0, 9111);
    silent("none", "gipps", &[], 0.0, 9112);
}

#[test]
fn nothing_in_gusts() {
    silent("none", "l-cth", &[], 0.05, 9113);
}

#[test]
fn nothing_in_coloured_noise() {
    silent("coloured", "idm", &[], 0.0, 9114);
}

#[test]
fn what_a_calibration_absorbs_is_not_named() {
    silent("absorbed", "l-cth", &["range_scale"], 0.0, 9115);
}

#[test]
fn two_at_once() {
    let outcome = infer_task(&task("pair", "l-cth", &["periodic", "multi_anticipation"], 0.0, 9116));
    assert_eq!(judge(&outcome), Judgement::Right, "{}", told(&outcome));
}

/// Ten minutes, because two drives have to cover the same places.
#[test]
fn what_no_cause_explains() {
    let outcome = infer_task(&DiagnosisTask { duration_s: 600.0, ..task("outside", "idm", &[], 0.0, 9117) });
    assert_eq!(outcome.verdict, "unexplained", "{}", told(&outcome));
    assert!(outcome.reason.contains("road"), "{}", told(&outcome));
}

/// An IDM car with the linear law as base, and the reverse with Gipps' law.
#[test]
fn another_law_is_not_papered_over() {
    for base in ["idm", "l-cth"] {
        let outcome = infer_task(&task("family", base, &[], 0.0, 9118));
        assert_eq!(judge(&outcome), Judgement::Right, "{}", told(&outcome));
    }
}

/// A sensor without a sign reads the absolute value of its noise while a car stands. On this seed, that gave a dead zone 19 nats (16
/// needed), as if the car tolerated an error of its position.
#[test]
fn a_standing_car_has_no_dead_zone() {
    let task = task("none", "gipps", &[], 0.05, 6_174_270);
    let outcome = infer_task(&DiagnosisTask { duration_s: 900.0, ..task });
    assert_eq!(outcome.verdict, "nothing", "{}", told(&outcome));
    let dead_zone = outcome.tried.iter().find(|(round, name, ..)| *round == 1 && name == "dead_zone").expect("tried");
    assert!(dead_zone.2[0].is_some_and(|gain| gain < 3.0), "{dead_zone:?}");
}

/// Noise of 2 cm/s that lasts for a second gives a reaction to the car two ahead 38 nats, of which 25 would be needed without it; this seed
/// shows it.
#[test]
fn nothing_in_noise_that_lasts() {
    let task = task("coloured", "l-cth", &[], 0.0, 5_851_181);
    let outcome = infer_task(&DiagnosisTask { duration_s: 900.0, ..task });
    assert_eq!(outcome.verdict, "nothing", "{}", told(&outcome));
}

/// Both of two effects, in fifteen minutes of driving.
fn both(base: &str, causes: &[&str], gusts: f64, seed: u64) {
    let outcome = infer_task(&DiagnosisTask { duration_s: 900.0, ..task("pair", base, causes, gusts, seed) });
    assert_eq!(judge(&outcome), Judgement::Right, "{}", told(&outcome));
}

/// 2178 nats that a search missed: with a base that is slightly off, steps of the right size are worse than none. Once they are found, a
/// limited jerk seems to smooth them over two samples; that is the coarse step of the model, and not a cause.
#[test]
fn steps_of_the_command() {
    sized(&DiagnosisTask { duration_s: 900.0, ..task("one", "idm", &["quantised_accel"], 0.0, 4_471_039) });
}

/// A calibration absorbs most of a heavier car, which is still a hundred nats likelier than a headway that depends on speed. That headway
/// must not be named in its place; this seed shows it.
#[test]
fn what_is_less_likely_than_something_absorbed_is_not_named() {
    let heavy = task("absorbed", "gipps", &["gain_mass"], 0.0, 8_086_282);
    let outcome = infer_task(&DiagnosisTask { duration_s: 900.0, ..heavy });
    assert_eq!(outcome.verdict, "not_testable", "{}", told(&outcome));
    assert!(outcome.not_testable.contains(&"gain_mass".to_owned()), "{}", told(&outcome));
}

/// The long version (`cargo test --test diagnose hidden_effect:: -- --ignored`): more causes, in fifteen minutes of driving each, and
/// difficult pairs. It does not check the share of the gain: `quick` calibrates with 4000 evaluations, which for integral action on Gipps
/// gives 41 % of it.
mod in_fifteen_minutes {
    use super::*;

    macro_rules! each_is_sized {
        ($($test:ident: $base:literal, $cause:literal, $seed:literal;)*) => {$(
            #[test]
            #[ignore = "a minute"]
            fn $test() {
                sized(&DiagnosisTask { duration_s: 900.0, ..task("one", $base, &[$cause], 0.0, $seed) });
            }
        )*};
    }

    each_is_sized! {
        aero_drag: "idm", "aero_drag", 9121;
        sensor_lowpass: "l-cth", "sensor_lowpass", 9122;
        integral_action: "gipps", "integral_action", 9123;
        power_cap: "idm", "power_cap", 9124;
        asym_lag: "gipps", "asym_lag", 9126;
        periodic: "idm", "periodic", 9127;
        decel_cap: "gipps", "decel_cap", 9128;
        quantised_accel: "l-cth", "quantised_accel", 9125;
        quantised_accel_on_gipps: "gipps", "quantised_accel", 9129;
    }
}

/// 2143 nats that the hold-out does not show unless its base, too, is searched without derivatives.
#[test]
#[ignore = "a minute"]
fn steps_of_the_command_that_carry_over() {
    let steps = task("one", "l-cth", &["quantised_accel"], 0.05, 6_689_139);
    sized(&DiagnosisTask { duration_s: 900.0, ..steps });
}

/// The hold-out has few blocks in which the jerk is limited: bootstraps without them have no vote.
#[test]
#[ignore = "half a minute"]
fn a_limit_that_few_blocks_show() {
    sized(&DiagnosisTask { duration_s: 900.0, ..task("one", "l-cth", &["jerk_limit"], 0.05, 7_703_121) });
}

/// 1897 nats, which Gipps' own spacing explains as well: a law that leads the named cause by a hundredth of that does not count against it.
#[test]
#[ignore = "half a minute"]
fn a_headway_that_another_law_has() {
    sized(&DiagnosisTask { duration_s: 900.0, ..task("one", "l-cth", &["speed_dep_headway"], 0.0, 4_471_125) });
}

/// Half a minute with a lower set speed, and a long way to catch up: a calibration with this stretch puts a gain of the base on its bound,
/// and from there a search finds 284 of 2050 nats.
#[test]
#[ignore = "half a minute"]
fn a_stretch_that_spoils_the_base() {
    let spoilt = task("one", "l-cth", &["set_speed_change"], 0.05, 4_471_130);
    sized(&DiagnosisTask { duration_s: 900.0, rms_mps: 0.03, ..spoilt });
}

/// The integral has a gain of 3e-5: 354 nats beside the headway, which a search from larger gains misses.
#[test]
#[ignore = "a minute"]
fn two_of_which_one_is_slow() {
    both("idm", &["speed_dep_headway", "integral_action"], 0.0, 2_718_089);
}

/// A power limit has 39 nats beside a dead zone of 311: more than a first cause leaves behind.
#[test]
#[ignore = "a minute"]
fn two_of_which_one_is_small() {
    both("gipps", &["dead_zone", "power_cap"], 0.05, 1_122_289);
}

/// A change of the headway in the first seconds replaces the drag and the dead zone until both are found, and is superfluous then.
#[test]
#[ignore = "a minute"]
fn two_without_what_stood_in_for_them() {
    both("gipps", &["aero_drag", "dead_zone"], 0.0, 9_587_289);
}

/// Answer of the race to a planted task; all three drives are given, and none is held out.
fn closed_loop(task: &DiagnosisTask) -> (Answer, Vec<Vec<String>>) {
    let planted = planted(task).expect("drivable");
    let drives: Vec<Drive> = planted.train.into_iter().chain(planted.holdout).collect();
    judged_in_closed_loop(&drives, &task.base, &[])
}

/// `named`: causes that the likelihood names.
fn judged_in_closed_loop(drives: &[Drive], base: &str, named: &[&'static Extension]) -> (Answer, Vec<Vec<String>>) {
    let causes: Vec<_> = library().iter().copied().filter(|extension| extension.cause.is_some()).collect();
    let bounds = Overrides::new();
    let request = made_up::request(drives, base, &causes, named, &bounds);
    let answer = race(&request, &Policy::DEFAULT, &mut |_| ControlFlow::Continue(())).expect("can be run");
    let passing = answer.tried.trials.iter().filter(|trial| trial.passes).map(|trial| trial.causes.clone()).collect();
    (answer, passing)
}

fn recommended(answer: &Answer) -> Vec<&str> {
    answer.recommended().iter().map(|cause| cause.name.as_str()).collect()
}

/// A task long enough for the required number of bins.
fn long(kind: &str, base: &str, causes: &[&str], gusts: f64, seed: u64) -> DiagnosisTask {
    DiagnosisTask { duration_s: 420.0, ..task(kind, base, causes, gusts, seed) }
}

fn families(answer: &Answer) -> Vec<&str> {
    answer.named.iter().flat_map(|named| &named.causes).map(|cause| cause.family()).collect()
}

#[test]
fn in_the_race_a_lag_is_named_by_its_family_and_recommended() {
    let (answer, passing) = closed_loop(&long("one", "l-cth", &["actuation_lag"], 0.0, 4201));
    assert_eq!(families(&answer), ["phase"], "{:?}", answer.set);
    let found = answer.recommended();
    let families: Vec<&str> = found.iter().map(|cause| cause.family()).collect();
    assert!(families.contains(&"phase"), "{families:?} of {passing:?}");
}

/// The missing acceleration of the recommended model is known, whichever test found the model.
#[test]
fn a_model_that_only_the_race_finds_leaves_less_missing_acceleration() {
    let task = long("one", "l-cth", &["actuation_lag"], 0.0, 4201);
    let drives: Vec<Drive> = planted(&task).map(|p| p.train.into_iter().chain(p.holdout).collect()).expect("drivable");
    let (answer, _) = judged_in_closed_loop(&drives, &task.base, &[]);
    let base = task.base.parse().expect("a law");
    let bounds = Overrides::new();
    let question =
        Question { train: &drives, holdout: &[], base, effort: Effort::Quick, seed: 1, causes: &[], bounds: &bounds };
    let inference = infer(&question, &mut |_| ControlFlow::Continue(())).expect("can be run");
    assert!(inference.named().is_empty());
    let outcome = describe(&question, inference, &answer, None).expect("can be run").outcome;
    let [base, left] = [&outcome.missing, &outcome.missing_left].map(|m| m.as_ref().expect("known").rms);
    let of_text = outcome.left_over.iter().find(|left| left.kind == "missing_acceleration").expect("left");
    assert!(outcome.recommended.is_some() && left < 0.8 * base, "{left} of {base}");
    assert_eq!(of_text.size.to_bits(), left.to_bits());
}

/// The likelihood names a dead zone here, so a lag would be a second story.
#[test]
fn in_the_race_only_families_with_a_name_are_recommended() {
    let task = long("one", "l-cth", &["actuation_lag"], 0.0, 4201);
    let drives: Vec<Drive> = planted(&task).map(|p| p.train.into_iter().chain(p.holdout).collect()).expect("drivable");
    let dead_zone = library().iter().find(|extension| extension.name == "dead_zone").expect("in the library");
    let (answer, _) = judged_in_closed_loop(&drives, &task.base, &[dead_zone]);
    assert_eq!(families(&answer), ["phase"], "{:?}", answer.set);
    assert!(!answer.recommended().iter().any(|cause| cause.family() == "phase"), "{:?}", answer.recommended());
}

/// Without gusts, a model lacks only the finer steps of the car: a lag with a reaction to the car ahead compensates for them.
#[test]
fn in_the_race_nothing_is_named_where_nothing_is_hidden() {
    for (base, gusts, seed) in [("l-idm", 0.0, 8_807_293), ("idm", 0.05, 4204)] {
        let (answer, passing) = closed_loop(&long("none", base, &[], gusts, seed));
        let best: Vec<_> = answer.tried.trials.iter().filter(|trial| trial.in_set || trial.passes).collect();
        assert!(families(&answer).is_empty() && recommended(&answer).is_empty(), "{base}: {best:?}");
        assert_eq!(passing, Vec::<Vec<String>>::new(), "{base}: {best:?}");
        assert!(answer.tried.not_testable.is_none(), "{base}: {:?}", answer.tried.not_testable);
    }
}

#[test]
fn in_the_race_short_drives_are_reported_as_too_short() {
    let (answer, passing) = closed_loop(&DiagnosisTask { duration_s: 35.0, ..task("none", "idm", &[], 0.0, 4205) });
    let why = answer.tried.not_testable.as_deref().expect("too few bins");
    assert!(why.contains("bins of 10 s") && passing.is_empty() && recommended(&answer).is_empty(), "{why}");
}

/// The Tesla of the AstaZero platoons reacts about a second late, and uses the acceleration of the car ahead.
#[test]
fn in_the_race_the_tesla_is_late() {
    let Some(shared) = common::shared("in_the_race_the_tesla_is_late") else { return };
    let drive = |platoon: u32| {
        let file = shared.join(format!("data/astazero_rebuilt/ASta_040719_platoon{platoon}.csv"));
        let recording = import::read(&file, None).expect("a platoon");
        let preparation = Preparation { from: Some(61.0), ..Preparation::default() };
        let trajectory = prepare(&recording, 1, &preparation).expect("complete").remove(0);
        Drive::of(&trajectory, None).expect("no jump").0
    };
    let drives: Vec<Drive> = [7, 8, 9].into_iter().flat_map(drive).collect();
    let (answer, passing) = judged_in_closed_loop(&drives, "l-cth", &[]);
    assert_eq!(families(&answer), ["phase", "anticipation"], "{:?}", answer.set);
    let found = answer.recommended();
    let families: Vec<&str> = found.iter().map(|cause| cause.family()).collect();
    assert!(families.contains(&"phase"), "{families:?} of {passing:?}");
}
