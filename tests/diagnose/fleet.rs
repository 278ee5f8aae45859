//! Fleets: an effect of the drivers is named, with the share of drivers that have it; drivers who only differ have no cause.

use crate::common::program::{fails, ok, scratch, stderr, succeeds};
use leadlag::internal::diagnose::Verdict;
use leadlag::internal::result::diagnosis::Outcome;
use leadlag::{Diagnosis, Pairs, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::ops::ControlFlow;

/// Step of the simulation \[s\], and number of steps between samples.
const STEP: f64 = 0.02;
const EVERY: usize = 5;
/// Time constant of the drivers' lag \[s\].
const LAG: f64 = 1.0;
/// Shortest and longest drive \[s\].
const LASTS: [f64; 2] = [25.0, 50.0];

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// One drive of an IDM with own parameters, with a lag or without: rows of time, spacing, speed and speed ahead. Another one if it comes
/// too close.
fn drive(rng: &mut ChaCha8Rng, lags: bool) -> Vec<[f64; 4]> {
    let mut own = |middle: f64, spread: f64| middle * (spread * normal(rng)).exp();
    let [v_0, t_h, d_0, a_max, a_min] =
        [own(33.0, 0.05), own(1.3, 0.25), own(2.5, 0.25), own(1.4, 0.25), own(1.8, 0.25)];
    let samples = ((LASTS[0] + rng.random::<f64>() * (LASTS[1] - LASTS[0])) / STEP) as usize;
    let mut v_l = 8.0 + 18.0 * rng.random::<f64>();
    let (mut target, mut pull, mut change) = (v_l, 0.3, 0.0);
    let mut v = v_l * (0.9 + 0.15 * rng.random::<f64>());
    let mut s = (d_0 + t_h * v) * (0.95 + 0.35 * rng.random::<f64>());
    let (mut gust, mut moved, mut rows) = (0.0, 0.0, Vec::new());
    for k in 0..samples {
        let t = STEP * k as f64;
        if t >= change {
            (target, pull) = (2.0 + 26.0 * rng.random::<f64>(), 0.1 + 0.4 * rng.random::<f64>());
            change = t + 6.0 + 8.0 * rng.random::<f64>();
        }
        if k % EVERY == 0 {
            let noisy = |value: f64, rng: &mut ChaCha8Rng| value + 0.05 * normal(rng);
            rows.push([t, noisy(s, rng), noisy(v, rng).max(0.0), noisy(v_l, rng).max(0.0)]);
        }
        let a_l = (pull * (target - v_l)).clamp(-3.5, 2.0).max(-v_l / STEP);
        let wanted = d_0 + (t_h * v + v * (v - v_l) / (2.0 * (a_max * a_min).sqrt())).max(0.0);
        let command = a_max * (1.0 - (v / v_0).powi(4) - (wanted / s.max(0.3)).powi(2));
        moved += if lags { (command - moved) * STEP / LAG } else { command - moved };
        gust += -gust * STEP / 1.5 + 0.1 * (2.0 * STEP / 1.5_f64).sqrt() * normal(rng);
        let a = (moved + gust).max(-v / STEP);
        s += (v_l - v) * STEP + 0.5 * (a_l - a) * STEP * STEP;
        (v_l, v) = (v_l + a_l * STEP, v + a * STEP);
        if s < 1.0 {
            return drive(rng, lags);
        }
    }
    rows
}

/// A table of drivers; the first `with` of them have a lag.
fn table(drivers: usize, with: usize, seed: u64) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut table = String::from("driver,time_s,spacing_m,speed_mps,lead_speed_mps\n");
    for k in 0..drivers {
        for [t, s, v, v_l] in drive(&mut rng, k < with) {
            writeln!(table, "{k},{t:.1},{s:.3},{v:.3},{v_l:.3}").expect("a String");
        }
    }
    table
}

const MAP: &str = r#"
title = "events"
rows = "pairs"
[columns]
group = { name = "driver" }
time = { name = "time_s", unit = "s" }
speed = { name = "speed_mps", unit = "m/s" }
lead_speed = { name = "lead_speed_mps", unit = "m/s" }
gap = { name = "spacing_m", unit = "m" }
"#;

fn pairs(name: &str, table: &str) -> Pairs {
    let folder = scratch("diagnose_fleet", name);
    std::fs::write(folder.join("map.toml"), MAP).expect("can be written");
    let mut reading = Reading::default();
    reading.columns = Some(folder.join("map.toml").display().to_string());
    Pairs::of_text(&reading, table.as_bytes(), "events.csv").expect("readable")
}

fn diagnosed(name: &str, table: &str) -> Outcome {
    let pairs = pairs(name, table);
    let findings = Diagnosis::of("idm").and_then(|d| d.effort("quick")).and_then(|d| d.run_all(&pairs));
    serde_json::from_str(&findings.expect("it runs").to_json()).expect("a result")
}

#[test]
fn an_effect_of_many_drivers_is_named_with_their_share() {
    let outcome = diagnosed("lag", &table(80, 32, 11));
    let families: Vec<&str> = outcome.causes.iter().map(|cause| cause.family.as_str()).collect();
    assert_eq!(families, ["phase"], "{} {:?}", outcome.reason, outcome.closed_loop.trials);
    let fleet = outcome.fleet.expect("a fleet");
    assert_eq!((fleet.drivers, fleet.drives, fleet.unusable.len()), (80, 80, 0));
    let share = fleet.share.expect("a name has a share");
    assert!(share.interval[0] <= 0.4 && 0.4 <= share.interval[1], "{share:?}");
    assert!(share.interval[0] > 0.2 && share.interval[1] < 1.0, "{share:?}");
}

/// With common parameters, a dead zone follows drivers of different headways better.
#[test]
fn drivers_who_differ_have_no_cause() {
    let outcome = diagnosed("none", &table(60, 0, 12));
    assert_eq!(outcome.verdict, Verdict::Nothing, "{:?}", outcome.causes);
    let dead_zone = outcome.closed_loop.trials.iter().find(|trial| trial.causes == ["dead_zone"]);
    let gain = dead_zone.map_or(0.0, |trial| trial.horizons[0].gain.max(trial.horizons[1].gain));
    // With common settings only, it is 0.15.
    assert!(gain < 0.08, "a dead zone gains {gain} although no driver has one");
    assert!(outcome.recommended.is_none() && outcome.fleet.expect("a fleet").share.is_none());
}

/// A stage takes minutes, so the end of one is too late.
#[test]
fn a_request_to_stop_ends_a_stage() {
    let (mut last, mut stopped_in) = (String::new(), None);
    let diagnosis = Diagnosis::of("idm").expect("a law");
    let found = diagnosis.run_all_on(&pairs("stop", &table(40, 0, 13)), &mut |progress| {
        let is_same = std::mem::replace(&mut last, progress.stage.clone()) == progress.stage;
        stopped_in = stopped_in.take().or_else(|| is_same.then(|| progress.stage.clone()));
        if stopped_in.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(stopped_in.is_some() && found.is_err(), "the stages were not asked within: {found:?}");
    assert_eq!(stopped_in, Some(last), "another stage began");
}

#[test]
fn few_drivers_are_not_a_fleet() {
    let few = diagnosed("few", &table(4, 0, 13));
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
    let usable = table(12, 0, 14);
    let samples = usable.lines().count() - 1;
    std::fs::write(&pairs, usable + &short).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let rest = ["--base", "l-cth", "--effort", "quick", "--out", &out];
    let text = ok(&[&["diagnose", &pairs, "--all", "--columns", &map], &rest[..]].concat());
    assert!(text.contains("12 drives of 12 drivers") && text.contains("1 more cannot be used"), "{text}");
    // The text names the drive, and no follower where the file has many.
    assert!(text.contains("trajectory short") && !text.contains("[train] follower"), "{text}");
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
    std::fs::write(&pairs, table(3, 0, 15)).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let rest = ["--columns", &map, "--model", "l-cth", "--bounds", "human", "--out", &out];
    ok(&[&["calibrate", &pairs, "--all", "--no-intervals"], &rest[..]].concat());
    for verb in [["diagnose", "--all"], ["calibrate", "--joint"]] {
        let (code, said) = fails(&[&verb[..], &[&pairs], &rest[..]].concat());
        assert!(code == 2 && said.contains("fleet.json of a fleet"), "{said}");
    }
}

#[test]
fn no_pair_is_an_error_with_every_reason() {
    let folder = scratch("diagnose_fleet", "no_pair");
    let at = |name: &str| folder.join(name).display().to_string();
    let [pairs, map, empty, header] = ["pairs.csv", "map.toml", "empty.csv", "header.csv"].map(at);
    let all = table(2, 0, 16);
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
    let noisy: String = table(8, 0, 17).lines().enumerate().map(jumping).collect();
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
    std::fs::write(&pairs, table(2, 0, 15).lines().map(scaled).collect::<String>()).expect("can be written");
    std::fs::write(&map, MAP).expect("can be written");
    let text = ok(&["diagnose", &pairs, "--columns", &map, "--trajectory", "0,1", "--data-only"]);
    let (first, second) = text.split_once("trajectory 1").expect("two drives");
    assert!(first.contains("no contradictions found") && !second.contains("no contradictions found"), "{text}");
}
