//! The state of a search over the rounds, without any fit.

use super::*;
use crate::calibrate::Overrides;
use crate::diagnose::made_up::{self, candidate, cause, search};
use crate::diagnose::question::Effort;

fn nothing() -> CrossValidated {
    CrossValidated { folds: [Vec::new(), Vec::new()] }
}

pub(super) fn row(round: usize, name: &str, evidence: f64, fate: Decision) -> Tried {
    let folds = [0.5 * evidence; 2];
    Tried { round, name: name.to_owned(), gain: evidence, evidence, folds, threshold: 20.0, checks: Vec::new(), fate }
}

fn as_likely_as(adopted: &str) -> Decision {
    Decision::AsLikely { adopted: adopted.to_owned() }
}

#[test]
fn a_rival_of_one_round_is_none_of_the_next() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let ladder = vec![
        row(1, "accel_cap", 90.0, Decision::Adopted),
        row(1, "power_cap", 88.0, as_likely_as("accel_cap")),
        row(2, "periodic", 60.0, Decision::Adopted),
        row(2, "power_cap", f64::NAN, Decision::Screened),
        row(2, "dead_zone", 58.0, as_likely_as("periodic")),
    ];
    let mut search = search(candidate(&drives, &["accel_cap"]), ladder);
    let names = ["periodic", "power_cap", "dead_zone"];
    let tried = names.iter().map(|name| (cause(name), candidate(&drives, &["accel_cap", name]))).collect();
    let held = names.iter().map(|_| Some(nothing())).collect();
    search.take(0, tried, held, 2);
    assert_eq!(search.evidence.last(), Some(&(60.0, 20.0)));
    let rivals: Vec<(&str, f64)> = search.rivals.iter().map(|r| (r.cause.name.as_str(), r.evidence)).collect();
    assert_eq!(rivals, [("dead_zone", 58.0)]);
}

#[test]
fn causes_that_hide_each_other_explain_no_more_than_the_whole() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let mut search = search(candidate(&drives, &["perception_delay", "leader_accel_ff"]), Vec::new());
    // 50 nats each, which the removal of either costs; together they gain 60 over the base, and then 500.
    search.bare = -60.0;
    assert_eq!(search.explained(), 60.0);
    search.bare = -500.0;
    assert_eq!(search.explained(), 100.0);
}

#[test]
fn enough_is_enough_beside_two_causes() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let quick = SearchBudget::of(Effort::Quick);
    for (names, simulated, enough) in [
        (&["dead_zone"][..], quick.enough + 1, false),
        (&["dead_zone", "actuation_lag"], quick.enough, false),
        (&["dead_zone", "actuation_lag"], quick.enough + 1, true),
    ] {
        let search = search(candidate(&drives, names), Vec::new());
        assert_eq!(search.has_enough(simulated, &quick), enough, "{names:?}");
        assert!(!search.has_enough(simulated, &SearchBudget::of(Effort::Thorough)));
    }
}

#[test]
fn a_family_has_one_member_in_a_model() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let causes = ["dead_zone", "actuation_lag", "asym_lag", "accel_cap"].map(cause);
    let beside = search(candidate(&drives, &["asym_lag"]), Vec::new());
    let names: Vec<&str> = beside.to_try(&causes).iter().map(|cause| cause.name.as_str()).collect();
    assert_eq!(names, ["dead_zone", "accel_cap"]);
}

/// The second lies on its bound. The first, which acts in one stretch only, is needed.
#[test]
fn what_is_no_name_any_more_goes() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let bounds = Overrides::new();
    let question = made_up::question(&drives, &[], &bounds);
    let mut search = search(candidate(&drives, &["set_speed_change", "accel_cap"]), Vec::new());
    let cap = search.current.model.positions(cause("accel_cap"))[0];
    search.current.fit.point.values[cap] = 4.0;
    search.evidence.iter_mut().for_each(|(_, need)| *need = f64::NEG_INFINITY);
    search.held = CrossValidated { folds: [vec![vec![1e9; 5]], vec![vec![1e9; 5]]] };
    search.prune(&Context::new(&question, None), &SearchBudget::of(Effort::Quick)).expect("it runs");
    assert_eq!(search.current.causes, [cause("set_speed_change")]);
    let [(stopped, .., objection)] = &search.stopped[..] else { panic!("{:?}", search.stopped) };
    assert!(*stopped == cause("accel_cap") && matches!(objection, Rejection::OnBound(_)), "{objection}");
}
