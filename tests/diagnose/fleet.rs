//! Fleets: an effect of the drivers is named, with the share of drivers that have it; drivers who only differ have no cause.

use crate::common::drivers::{MAP, SPREAD, table};
use crate::common::program::{fails, ok, refused, scratch, stderr, succeeds};
use leadlag::internal::diagnose::Verdict;
use leadlag::internal::result::diagnosis::Outcome;
use leadlag::{Diagnosis, Pairs, Reading};
use std::ops::ControlFlow;

fn pairs(name: &str, table: &str) -> Pairs {
    let folder = scratch("diagnose_fleet", name);
    std::fs::write(folder.join("map.toml"), MAP).expect("can be written");
    let mut reading = Reading::default();
    reading.columns = Some(folder.join("map.toml").display().to_string());
    Pairs::of_text(&reading, table.as_bytes(), "events.csv").expect("readable")
}

fn diagnosed(name: &str, table: &str) -> Outcome {
    diagnosed_on("idm", name, table)
}

fn diagnosed_on(base: &str, name: &str, table: &str) -> Outcome {
    let pairs = pairs(name, table);
    let findings = Diagnosis::of(base).and_then(|d| d.effort("quick")).and_then(|d| d.run_all(&pairs));
    serde_json::from_str(&findings.expect("it runs").to_json()).expect("a result")
}

#[test]
fn an_effect_of_many_drivers_is_named_with_their_share() {
    let outcome = diagnosed("lag", &table(80, SPREAD, 32, 11).0);
    let families: Vec<&str> = outcome.causes.iter().map(|cause| cause.family.as_str()).collect();
    assert_eq!(families, ["phase"], "{} {:?}", outcome.reason, outcome.closed_loop.trials);
    assert!(outcome.closed_loop.reaction.expect("judged").interval[0] > 0.3, "they react to the car ahead");
    let fleet = outcome.fleet.expect("a fleet");
    assert_eq!((fleet.drivers, fleet.drives, fleet.unusable.len()), (80, 80, 0));
    let share = fleet.share.expect("a name has a share");
    assert!(share.interval[0] <= 0.4 && 0.4 <= share.interval[1], "{share:?}");
    assert!(share.interval[0] > 0.2 && share.interval[1] < 1.0, "{share:?}");
}

/// With common parameters, a dead zone follows drivers of different headways better.
#[test]
fn drivers_who_differ_have_no_cause() {
    let outcome = diagnosed("none", &table(60, SPREAD, 0, 12).0);
    assert_eq!(outcome.verdict, Verdict::Nothing, "{:?}", outcome.causes);
    let dead_zone = outcome.closed_loop.trials.iter().find(|trial| trial.causes == ["dead_zone"]);
    let gain = dead_zone.map_or(0.0, |trial| trial.horizons[0].gain.max(trial.horizons[1].gain));
    // With common settings only, it is 0.15.
    assert!(gain < 0.08, "a dead zone gains {gain} although no driver has one");
    assert!(outcome.recommended.is_none() && outcome.fleet.expect("a fleet").share.is_none());
}

/// The same drivers, each behind the car ahead of the next one, at a spacing of 2 m and more.
fn behind_others(table: &str) -> String {
    let (head, rows) = table.split_once('\n').expect("a table");
    let mut drives: Vec<Vec<[f64; 3]>> = Vec::new();
    let rows: Vec<Vec<&str>> = rows.lines().map(|row| row.split(',').collect()).collect();
    for rows in rows.chunk_by(|a, b| a[0] == b[0]) {
        let number = |text: &str| text.parse::<f64>().expect("a number");
        drives.push(rows.iter().map(|row| [number(row[1]), number(row[3]), number(row[4])]).collect());
    }
    let mut text = format!("{head}\n");
    for (k, own) in drives.iter().enumerate() {
        let ahead = &drives[(k + 1) % drives.len()];
        let samples = own.len().min(ahead.len());
        let mut spacing = vec![0.0; samples];
        for t in 1..samples {
            let rate = |t: usize| ahead[t][2] - own[t][1];
            spacing[t] = spacing[t - 1] + 0.5 * (rate(t - 1) + rate(t)) * (own[t][0] - own[t - 1][0]);
        }
        let least = spacing.iter().copied().fold(f64::INFINITY, f64::min);
        for ((own, ahead), s) in own.iter().zip(ahead).zip(spacing) {
            text += &format!("{k},{:.1},{:.3},{},{}\n", own[0], s - least + 2.0, own[1], ahead[2]);
        }
    }
    text
}

#[test]
fn nothing_is_named_behind_the_car_ahead_of_another_driver() {
    let outcome = diagnosed("another", &behind_others(&table(40, SPREAD, 16, 16).0));
    assert_eq!(outcome.verdict, Verdict::NotTestable, "{:?}", outcome.closed_loop);
    assert!(outcome.causes.is_empty() && outcome.reason.contains("check which car is ahead"), "{}", outcome.reason);
}

/// Drivers of another law: no cause of this one follows them as well.
#[test]
fn another_law_is_named_where_it_follows_the_drivers_better_than_any_cause() {
    let outcome = diagnosed_on("l-gipps", "law", &table(40, SPREAD, 0, 12).0);
    assert_eq!(outcome.verdict, Verdict::Unexplained, "{} {:?}", outcome.reason, outcome.closed_loop.trials);
    let reason = "idm without causes predicts left-out drivers better over 2 and 15 s than l-gipps with any cause";
    assert_eq!(outcome.reason, reason);
}

/// A stage takes minutes, so the end of one is too late.
#[test]
fn a_request_to_stop_ends_a_stage() {
    let (mut last, mut stopped_in) = (String::new(), None);
    let diagnosis = Diagnosis::of("idm").expect("a law");
    let found = diagnosis.run_all_on(&pairs("stop", &table(40, SPREAD, 0, 13).0), &mut |progress| {
        let is_same = std::mem::replace(&mut last, progress.stage.clone()) == progress.stage;
        stopped_in = stopped_in.take().or_else(|| is_same.then(|| progress.stage.clone()));
        if stopped_in.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(stopped_in.is_some() && found.is_err(), "the stages were not asked within: {found:?}");
    assert_eq!(stopped_in, Some(last), "another stage began");
}

#[test]
fn few_drivers_are_not_a_fleet() {
    let mut stages = Vec::new();
    let diagnosis = Diagnosis::of("idm").expect("a law");
    let found = diagnosis.run_all_on(&pairs("few", &table(4, SPREAD, 0, 13).0), &mut |progress| {
        stages.push(progress.stage);
        ControlFlow::Continue(())
    });
    let few: Outcome = serde_json::from_str(&found.expect("it runs").to_json()).expect("a result");
    assert!(!stages.iter().any(|stage| stage.starts_with("fitting")), "nothing is fitted: {stages:?}");
    assert_eq!(few.verdict, Verdict::NotTestable);
    assert!(few.reason.contains("at least 12 drivers, found 4"), "{}", few.reason);
}

/// The command reads every pair, also short ones, and lists those that it cannot use.
#[test]
fn the_command_diagnoses_every_pair_of_a_table() {
    let folder = scratch("diagnose_fleet", "pairs");
    let short: String = (0..60).map(|i| format!("short,{:.1},20,15,15\n", 0.1 * i as f64)).collect();
    let at = |name: &str| folder.join(name).display().to_string();
    let [pairs, map, out] = ["pairs.csv", "map.toml", "out"].map(at);
    let usable = table(12, SPREAD, 0, 14).0;
    let samples = usable.lines().count() - 1;
    std::fs::write(&pairs, usable + &short).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let rest = ["--base", "l-cth", "--effort", "quick", "--out", &out];
    let text = ok(&[&["diagnose", &pairs, "--all", "--columns", &map], &rest[..]].concat());
    assert!(text.contains("12 drives of 12 drivers") && text.contains("1 more cannot be used"), "{text}");
    // The text names the drive, and no follower where the file has many.
    assert!(text.contains("trajectory short") && !text.contains("pairs.csv follower"), "{text}");
    let outcome: Outcome =
        serde_json::from_slice(&std::fs::read(folder.join("out/diagnosis.json")).expect("written")).expect("a result");
    let unusable = outcome.fleet.expect("a fleet").unusable;
    assert!(unusable.len() == 1 && unusable[0][0].contains("short"), "{unusable:?}");
    assert_eq!((outcome.data.len(), outcome.data[0].follower, outcome.data[0].samples), (1, 0, samples));
    let page = at("page.html");
    ok(&["report", &out, "-o", &page]);
    let page = std::fs::read_to_string(page).expect("written");
    assert!(page.contains("<td>all</td>") && !page.contains("each simulated freely"));
}

/// The files of a fleet's calibrations and those of a diagnosis never share a folder, because `report` would show one of them.
#[test]
fn a_diagnosis_and_a_fleet_have_separate_folders() {
    let folder = scratch("diagnose_fleet", "folders");
    let at = |name: &str| folder.join(name).display().to_string();
    let [pairs, map, out] = ["pairs.csv", "map.toml", "out"].map(at);
    std::fs::write(&pairs, table(3, SPREAD, 0, 15).0).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let rest = ["--columns", &map, "--model", "l-cth", "--bounds", "human", "--out", &out];
    ok(&[&["calibrate", &pairs, "--all", "--no-intervals"], &rest[..]].concat());
    for verb in [["diagnose", "--all"], ["calibrate", "--joint"]] {
        refused(2, &[&verb[..], &[&pairs], &rest[..]].concat()).says("fleet.json of a fleet");
    }
}

#[test]
fn no_pair_is_an_error_with_every_reason() {
    let folder = scratch("diagnose_fleet", "no_pair");
    let at = |name: &str| folder.join(name).display().to_string();
    let [pairs, map, empty, header] = ["pairs.csv", "map.toml", "empty.csv", "header.csv"].map(at);
    let all = table(2, SPREAD, 0, 16).0;
    std::fs::write(&pairs, &all).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    std::fs::write(&empty, "").expect("can be written");
    std::fs::write(&header, all.lines().next().unwrap_or_default()).expect("can be written");
    let out = at("out");
    for verb in [&["diagnose"][..], &["calibrate", "--out", &out]] {
        let with = |more: &[&str]| fails(&[verb, more, &["--all", "--columns", &map, "--model", "l-cth"]].concat()).1;
        let said = with(&[&empty, &header]);
        assert!(said.contains("empty.csv:1") && said.contains("header.csv:1"), "{said}");
        let said = with(&[&pairs, "--follower", "9"]);
        assert!(said.contains("no leader-follower pair") && said.contains("leadlag inspect"), "{said}");
    }
}

/// Warnings on hundreds of drives would hide the other warnings.
#[test]
fn a_joint_calibration_of_a_table_limits_its_warnings() {
    let folder = scratch("diagnose_fleet", "warnings");
    let at = |name: &str| folder.join(name).display().to_string();
    let [pairs, map, out] = ["pairs.csv", "map.toml", "out"].map(at);
    let jumping = |(k, line): (usize, &str)| {
        let (rest, lead) = line.rsplit_once(',').expect("columns");
        let (rest, speed) = rest.rsplit_once(',').expect("columns");
        let off = if k % 2 == 0 { 0.4 } else { 0.0 };
        speed.parse::<f64>().map_or_else(|_| format!("{line}\n"), |v| format!("{rest},{:.3},{lead}\n", v + off))
    };
    let noisy: String = table(8, SPREAD, 0, 17).0.lines().enumerate().map(jumping).collect();
    std::fs::write(&pairs, noisy).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let settings = ["--model", "l-cth", "--bounds", "human", "--no-intervals", "--out", &out];
    let said = stderr(&succeeds(&[&["calibrate", &pairs, "--joint", "--columns", &map], &settings[..]].concat()));
    assert_eq!(said.matches("warning: trajectory ").count(), 3, "{said}");
    assert!(said.contains("more such warnings on other trajectories"), "{said}");
}

/// Of a table with several drives, a fault stands under its drive only.
#[test]
fn a_fault_is_of_its_drive() {
    let folder = scratch("diagnose_fleet", "faults");
    let scaled = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        match fields.as_slice() {
            ["1", t, s, v, v_l] => format!("1,{t},{s},{:.3},{v_l}\n", 1.1 * v.parse::<f64>().expect("a number")),
            _ => format!("{line}\n"),
        }
    };
    let at = |name: &str| folder.join(name).display().to_string();
    let [pairs, map] = ["pairs.csv", "map.toml"].map(at);
    std::fs::write(&pairs, table(2, SPREAD, 0, 15).0.lines().map(scaled).collect::<String>()).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let text = ok(&["diagnose", &pairs, "--columns", &map, "--trajectory", "0,1", "--data-only"]);
    let (first, second) = text.split_once("trajectory 1").expect("two drives");
    assert!(!first.contains("INCONSISTENT") && second.contains("INCONSISTENT"), "{text}");
    assert!(second.contains("\nNo contradictions were found in 1 of 2 drives.\n"), "{text}");
}
