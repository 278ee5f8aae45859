//! What a search keeps of the rounds, without fitting anything.

use super::*;
use crate::calibrate::Overrides;
use crate::diagnose::judge::decide::proxy;
use crate::diagnose::made_up::{self, candidate, cause};
use crate::diagnose::question::Effort;
use crate::diagnose::select::global_restart::has_sizes_only;

fn nothing() -> CrossValidated {
    CrossValidated { folds: [Vec::new(), Vec::new()] }
}

pub(super) fn row(round: usize, name: &str, evidence: f64, fate: Fate) -> Tried {
    let (folds, trimmed) = ([0.5 * evidence; 2], evidence);
    Tried { round, name: name.to_owned(), gain: evidence, evidence, folds, trimmed, threshold: 20.0, fate }
}

pub(super) fn search(current: FittedModel, ladder: Vec<Tried>) -> Search {
    Search {
        evidence: current.causes.iter().map(|_| (50.0, 20.0)).collect(),
        current,
        held: nothing(),
        bare: 0.0,
        rivals: Vec::new(),
        ladder,
        stopped: Vec::new(),
        not_testable: Vec::new(),
        untried: Vec::new(),
        lost: Vec::new(),
        need: 20.0,
        margin: 6.0,
        inflation: 1.5,
        short_list: 5,
        last_round: 0,
        cut_short: false,
        trial: None,
    }
}

fn as_likely_as(adopted: &str) -> Fate {
    Fate::AsLikely { adopted: adopted.to_owned() }
}

fn fates(search: &Search) -> Vec<Fate> {
    search.ladder.iter().map(|row| row.fate.clone()).collect()
}

#[test]
fn a_rival_of_one_round_is_none_of_the_next() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let ladder = vec![
        row(1, "accel_cap", 90.0, Fate::Adopted),
        row(1, "power_cap", 88.0, as_likely_as("accel_cap")),
        row(2, "periodic", 60.0, Fate::Adopted),
        row(2, "power_cap", f64::NAN, Fate::Screened),
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
    // 50 nats each, what the removal of either costs; they gain 60 over the base, and then 500.
    search.bare = -60.0;
    assert_eq!(search.explained(), 60.0);
    search.bare = -500.0;
    assert_eq!(search.explained(), 100.0);
}

#[test]
fn after_a_failed_trial_all_is_as_before() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let bounds = Overrides::new();
    let question = made_up::question(&drives, &[], &bounds);
    let objection = Objection::NoTransfer { share: 0.4 };
    let ladder = vec![
        row(1, "actuation_lag", 90.0, Fate::Adopted),
        row(1, "asym_lag", 70.0, Fate::LessLikely),
        row(2, "dead_zone", 80.0, Fate::Stopped(objection.clone())),
    ];
    let before = fates(&search(candidate(&drives, &[]), ladder.clone()));
    let mut search = search(candidate(&drives, &["actuation_lag", "dead_zone"]), ladder);
    search.stopped.push((cause("dead_zone"), 80.0, 20.0, objection.clone()));
    search.begin_trial(candidate(&drives, &["actuation_lag"]), nothing(), vec![(90.0, 20.0)], 2);
    assert_eq!(search.ladder[2].fate, Fate::OnTrial(objection));
    // A round next to it.
    search.ladder.push(row(3, "range_bias", 60.0, Fate::Adopted));
    search.note_exchange(cause("actuation_lag"), cause("asym_lag"));
    (search.need, search.margin, search.inflation) = (44.0, 9.0, 3.0);
    search.end_trial(&Context::new(&question, None)).expect("nothing is simulated");
    assert_eq!([search.need, search.margin, search.inflation], [20.0, 6.0, 1.5]);
    assert_eq!(search.current.causes, [cause("actuation_lag")]);
    let (last, others) = (search.ladder.last().map(|row| row.fate.clone()), &fates(&search)[..3]);
    assert_eq!((last, others), (Some(Fate::OnlyNextTo { other: "dead_zone".to_owned() }), &before[..]));
}

#[test]
fn the_ladder_tells_of_an_exchange() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let ladder = vec![
        row(1, "actuation_lag", 90.0, Fate::Adopted),
        row(1, "asym_lag", 89.0, as_likely_as("actuation_lag")),
        row(2, "dead_zone", 80.0, Fate::Adopted),
        row(2, "time_offset", 30.0, Fate::LessLikely),
    ];
    let mut search = search(candidate(&drives, &["asym_lag", "dead_zone"]), ladder);
    search.note_exchange(cause("dead_zone"), cause("dead_zone"));
    search.note_exchange(cause("actuation_lag"), cause("asym_lag"));
    let exchanged = Fate::Exchanged { by: "asym_lag".to_owned() };
    assert_eq!(fates(&search), [exchanged, Fate::Adopted, Fate::Adopted, Fate::LessLikely]);
    assert_eq!(search.ladder[0].fate.to_string(), "dropped again: asym_lag took its place");
    // One that was not tried in that round.
    search.note_exchange(cause("asym_lag"), cause("time_offset"));
    assert!(search.ladder[1].fate.is_dropped() && search.ladder[3].fate.is_adopted(), "{:?}", fates(&search));
}

#[test]
fn rivals_of_other_families_stay_when_a_place_is_put_right() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let rival = |of: &str, name: &str| Rival {
        of: cause(of),
        cause: cause(name),
        candidate: candidate(&drives, &[name]),
        evidence: 50.0,
        need: 20.0,
    };
    let mut search = search(candidate(&drives, &["perception_delay", "range_bias"]), Vec::new());
    search.rivals = vec![
        rival("actuation_lag", "asym_lag"),
        rival("actuation_lag", "dead_zone"),
        rival("range_bias", "range_scale"),
    ];
    let again = vec![rival("sensor_lowpass", "sensor_lowpass"), rival("perception_delay", "perception_delay")];
    search.settle_rivals(cause("actuation_lag"), cause("perception_delay"), again);
    let found: Vec<(&str, &str)> =
        search.rivals.iter().map(|rival| (rival.of.name.as_str(), rival.cause.name.as_str())).collect();
    assert_eq!(
        found,
        [("perception_delay", "dead_zone"), ("range_bias", "range_scale"), ("perception_delay", "sensor_lowpass")]
    );
}

#[test]
fn a_limit_that_limits_nothing_is_no_name() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let objection = |name: &str, sizes: &[f64]| {
        let mut candidate = candidate(&drives, &[name]);
        for (k, size) in candidate.model.positions(cause(name)).into_iter().zip(sizes) {
            candidate.fit.point.values[k] = *size;
        }
        proxy(&candidate, cause(name))
    };
    assert!(matches!(objection("accel_cap", &[4.0]), Some(Objection::OnBound(_))));
    assert_eq!(objection("accel_cap", &[1.3]), None);
    // One of two lags may be none.
    assert_eq!(objection("asym_lag", &[0.4, 0.0]), None);
    assert!(matches!(objection("asym_lag", &[0.0, 0.0]), Some(Objection::OnBound(_))));
}

/// The noise of the measured gap is 0.02 m.
#[test]
fn a_dead_zone_within_the_noise_of_the_gap_is_no_name() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let said = |w: f64| {
        let mut candidate = candidate(&drives, &["dead_zone"]);
        let k = candidate.model.positions(cause("dead_zone"))[0];
        candidate.fit.point.values[k] = w;
        proxy(&candidate, cause("dead_zone"))
    };
    assert!(matches!(said(0.055), Some(Objection::Blurred { .. })));
    assert_eq!(said(0.065), None);
}

/// What goes faster than a set speed is not held by it; the first seconds are left for slowing down, and short stretches say nothing.
#[test]
fn a_set_speed_that_the_car_outruns_is_no_name() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let fastest = drives[0].trajectory.v_f.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let said = |values: [f64; 3]| {
        let mut candidate = candidate(&drives, &["set_speed_change"]);
        for (k, value) in candidate.model.positions(cause("set_speed_change")).into_iter().zip(values) {
            candidate.fit.point.values[k] = value;
        }
        proxy(&candidate, cause("set_speed_change"))
    };
    let Some(Objection::Outrun { size, share }) = said([5.0, 10.0, 60.0]) else { panic!("it drives faster than that") };
    assert_eq!((size.name.as_str(), size.value), ("vlim", 5.0));
    assert!(share > 0.9, "{share}");
    assert_eq!(said([5.0, 10.0, 7.0]), None);
    assert_eq!(said([fastest, 10.0, 60.0]), None);
}

#[test]
fn enough_is_enough_beside_two_causes_or_one_and_one_that_was_lost() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let quick = SearchBudget::of(Effort::Quick);
    let before = quick.enough - 40_000;
    for (names, lost, simulated, last_round, enough) in [
        (&["dead_zone"][..], false, quick.enough, 40_000, false),
        (&["dead_zone"], true, before, 40_001, true),
        (&[], true, quick.enough, 40_000, false),
        (&["dead_zone", "actuation_lag"], false, before, 40_000, false),
        (&["dead_zone", "actuation_lag"], false, before, 40_001, true),
    ] {
        let lost = if lost { vec![(cause("accel_cap"), Vec::new())] } else { Vec::new() };
        let search = Search { last_round, lost, ..search(candidate(&drives, names), Vec::new()) };
        assert_eq!(search.has_enough(simulated, &quick), enough, "{names:?}");
        assert!(!search.has_enough(simulated, &SearchBudget::of(Effort::Thorough)));
    }
    // A single cause on trial has the round in which it is decided.
    let mut on_trial = Search { last_round: 40_001, ..search(candidate(&drives, &["dead_zone"]), Vec::new()) };
    on_trial.lost.push((cause("accel_cap"), Vec::new()));
    assert!(on_trial.has_enough(before, &quick));
    on_trial.begin_trial(candidate(&drives, &[]), nothing(), Vec::new(), 0);
    assert!(!on_trial.has_enough(before, &quick));
}

#[test]
fn what_was_lost_is_not_tried_beside_the_same_again() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let names = |tried: Vec<&'static Extension>| tried.iter().map(|cause| cause.name.clone()).collect::<Vec<_>>();
    let causes = ["dead_zone", "actuation_lag", "asym_lag", "accel_cap"].map(cause);
    let mut alone = search(candidate(&drives, &[]), Vec::new());
    alone.lost.push((cause("accel_cap"), Vec::new()));
    assert_eq!(names(alone.to_try(&causes)), ["dead_zone", "actuation_lag", "asym_lag"]);
    // Beside another one it is another question; a second lag is none.
    let beside = Search { lost: alone.lost, ..search(candidate(&drives, &["asym_lag"]), Vec::new()) };
    assert_eq!(names(beside.to_try(&causes)), ["dead_zone", "accel_cap"]);
}

/// The second goes on its bound; the first is needed, the third is not asked.
#[test]
fn what_is_lost_is_noted_with_what_was_before_it() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let bounds = Overrides::new();
    let question = made_up::question(&drives, &[], &bounds);
    let mut search = search(candidate(&drives, &["dead_zone", "accel_cap", "range_bias"]), Vec::new());
    let cap = search.current.model.positions(cause("accel_cap"))[0];
    search.current.fit.point.values[cap] = 4.0;
    search.evidence[0].1 = f64::NEG_INFINITY;
    assert!(search.prune(&Context::new(&question, None), &SearchBudget::of(Effort::Quick)).expect("it runs"));
    let caps: Vec<_> = search.lost.iter().filter(|(lost, _)| *lost == cause("accel_cap")).collect();
    assert!(matches!(caps[..], [(_, before)] if *before == [cause("dead_zone")]), "{:?}", search.lost);
}

#[test]
fn only_the_likeliest_that_the_hold_out_objects_to_are_searched_anew() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let mut search = search(candidate(&drives, &[]), Vec::new());
    let names = ["power_cap", "range_bias", "dead_zone", "aero_drag"];
    let tried: Vec<ScreenedCause> = names.iter().map(|name| (cause(name), candidate(&drives, &[name]))).collect();
    assert!(search.doubted(&tried).is_empty());
    let stopped = |name: &str, evidence: f64, objection: Objection| (cause(name), evidence, 20.0, objection);
    search.stopped = vec![
        stopped("power_cap", 40.0, Objection::NoTransfer { share: 0.4 }),
        stopped("range_bias", 90.0, Objection::Absorbed { by: Vec::new() }),
        stopped("dead_zone", 60.0, Objection::NoTransfer { share: 0.6 }),
        stopped("aero_drag", 50.0, Objection::NoTransfer { share: 0.8 }),
    ];
    assert_eq!(search.doubted(&tried), [2, 3]);
}

#[test]
fn times_and_steps_are_not_drawn_at_random() {
    for (name, only) in
        [("grade", true), ("asym_lag", true), ("quantised_accel", false), ("headway_mode_change", false)]
    {
        assert_eq!(has_sizes_only(cause(name)), only, "{name}");
    }
}
