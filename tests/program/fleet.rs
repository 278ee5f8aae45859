//! Every pair of a table by `calibrate --all`: one row each, independent of the rest of the table, and no loss.
//!
//! `LEADLAG_KILLS=100` sets the number of kills; by default a few.

use crate::common::gpu::skipped;
use crate::common::program::{self, fails, json, leadlag, ok, refused, rows_of, scratch, stderr, succeeds, text};
use crate::common::sample;
use leadlag::internal::optimize::{normal, stream};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// v_0, t_h, d_0, a_max, a_min of the different drivers.
fn driver(number: u64) -> [f64; 5] {
    let mut rng = stream(7, number, 0, 0);
    [31.0, 1.2, 2.2, 1.3, 1.8].map(|middle| middle * (0.2 * normal(&mut rng)).exp())
}

pub const HEADER: &str = "Trajectory_ID,Time_Index,ID_LV,Type_LV,Pos_LV,Speed_LV,Acc_LV,ID_FAV,Pos_FAV,Speed_FAV,Acc_FAV,Spatial_Gap,\
                      Spatial_Headway,Speed_Diff\n";

/// Rows of drives of so many samples at 10 Hz, each of a separate driver behind a separate leader.
pub fn drives(numbers: std::ops::Range<u64>, samples: usize) -> String {
    delayed_drives(numbers, samples, 0, 0.03)
}

/// The same with drivers who all perceive this many samples late, with noise of this size.
fn delayed_drives(numbers: std::ops::Range<u64>, samples: usize, late: usize, noise: f64) -> String {
    let mut table = String::new();
    for number in numbers {
        let [v_0, t_h, d_0, a_max, a_min] = driver(number);
        let mut rng = stream(8, number, 0, 0);
        let (mut x_l, mut v_l, mut v) = (100.0, 15.0, 14.0);
        let mut x = x_l - 4.6 - d_0 - t_h * v - 4.0;
        let mut lasting = 0.0;
        let mut seen = std::collections::VecDeque::new();
        for k in 0..samples {
            let t = k as f64 * 0.1;
            let gap = x_l - 4.6 - x;
            writeln!(
                table,
                "{number},{t:.1},{},1,{x_l:.4},{v_l:.4},0,{},{x:.4},{v:.4},0,{gap:.4},{:.4},{:.4}",
                2 * number,
                2 * number + 1,
                x_l - x,
                v_l - v
            )
            .expect("a String takes all");
            lasting = 0.93 * lasting + noise * normal(&mut rng);
            seen.push_back((gap, v, v_l));
            seen.drain(..seen.len().saturating_sub(late + 1));
            let (s, u, u_l) = seen[0];
            let wanted = d_0 + (t_h * u + u * (u - u_l) / (2.0 * (a_max * a_min).sqrt())).max(0.0);
            let a = a_max * (1.0 - (u / v_0).powi(4) - (wanted / s).powi(2)) + lasting;
            let ahead = 15.0 + 7.0 * (t / 9.0 + number as f64).sin() + 4.0 * (t / 4.0).cos();
            let next = (v + 0.1 * a).max(0.0);
            (x, v) = (x + 0.05 * (v + next), next);
            let next = v_l + 0.1 * (ahead - v_l).clamp(-2.5, 1.5);
            (x_l, v_l) = (x_l + 0.05 * (v_l + next), next);
        }
    }
    table
}

/// The rows of the table of parameters.
fn rows(folder: &Path) -> Vec<BTreeMap<String, String>> {
    rows_of(&folder.join("parameters.csv"))
}

/// Files of the result without the journal, whose order depends on the threads.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    ["parameters.csv", "parameters.parquet", "fleet.json", "fits.csv"]
        .into_iter()
        .map(|name| (name.to_owned(), fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))))
        .collect()
}

/// Each row equals the result of the pair alone; a pair that cannot be calibrated is a row with its reason; threads change nothing.
#[test]
fn every_pair_is_a_row() {
    let folder = scratch("fleet", "rows");
    let (table, out) = (folder.join("pairs.csv"), folder.join("one"));
    // The last but one is too short, the last one ends before it starts: a gap below 0.
    let mut content = HEADER.to_owned() + &drives(0..6, 300) + &drives(6..7, 8);
    content += &drives(7..8, 100)
        .lines()
        .map(|line| {
            let mut fields: Vec<&str> = line.split(',').collect();
            fields[11] = "-1";
            fields.join(",") + "\n"
        })
        .collect::<String>();
    fs::write(&table, content).expect("room");
    let all = ["calibrate", text(&table), "--all", "--model", "idm", "--model", "l-cth", "--bounds", "human", "--out"];
    let said = ok(&[&all[..], &[text(&out), "--threads", "1"]].concat());
    let begin = "8 pairs of 1 file: 12 of 16 calibrations have a result\n";
    assert!(said.starts_with(begin), "{said}");
    assert!(said.lines().all(|line| line.chars().count() <= 80), "{said}");
    let found = rows(&out);
    assert_eq!(found.len(), 16);
    for (k, row) in found.iter().enumerate() {
        assert_eq!(row["trajectory"], (k / 2).to_string());
        assert_eq!(row["model"], ["idm", "l-cth"][k % 2]);
        assert_eq!(row["reason"].is_empty(), k < 12, "{row:?}");
        assert_eq!(row["score"].is_empty(), k >= 12, "{row:?}");
        // A parameter of the other model is NaN.
        assert_eq!(row["a_max_mps2"].is_empty(), k % 2 == 1 || k >= 12, "{row:?}");
    }
    assert!(found[12]["reason"].contains("at least 2 s"), "{:?}", found[12]);
    let status: Vec<&str> = found.iter().step_by(2).map(|row| row["status"].as_str()).collect();
    assert_eq!(status, ["ok", "ok", "ok", "ok", "ok", "ok", "short", "unusable"], "{:?}", found[14]);

    let again = folder.join("two");
    ok(&[&all[..], &[text(&again), "--threads", "3"]].concat());
    assert!(files(&out) == files(&again), "threads change nothing");

    let alone = folder.join("alone");
    let row = &found[4];
    let one = ["calibrate", text(&table), "--trajectory", "2", "--model", "idm", "--bounds", "human"];
    let result = json(&[&one[..], &["--max-evaluations", "10000", "--json", "--out", text(&alone)]].concat());
    for (column, name) in [("t_h_s", "t_h"), ("v_0_mps", "v_0"), ("a_min_mps2", "a_min")] {
        assert_eq!(row[column].parse::<f64>().ok(), result["parameters"][name].as_f64(), "{name}");
        let low = row[&format!("{column}_low")].parse::<f64>().ok();
        assert_eq!(low, result["intervals"][name][0].as_f64(), "{name}");
    }

    let page = folder.join("page.html");
    ok(&["report", text(&out), "--out", text(&page)]);
    let html = fs::read_to_string(&page).expect("written");
    assert!(html.contains("6 of 8 pairs calibrated with"), "the answer first");
    assert!(html.contains("expected at least"), "reasons are listed");
}

/// A table of its own pairs is found in a folder, and an invalid file does not affect the others.
#[test]
fn files_of_a_folder_are_one_fleet() {
    let folder = scratch("fleet", "folder");
    let data = folder.join("data");
    fs::create_dir(&data).expect("room");
    fs::write(data.join("a.csv"), HEADER.to_owned() + &drives(0..1, 200)).expect("room");
    fs::write(data.join("b.csv"), HEADER.to_owned() + &drives(1..2, 200)).expect("room");
    fs::write(data.join("notes.md"), "not a table").expect("room");
    fs::write(data.join("Slope.csv"), "X,Y\n0,0\n1,0\n").expect("room");
    let all = ["calibrate", text(&data), "--all", "--model", "idm", "--no-intervals", "--out"];
    let out = folder.join("out");
    assert!(ok(&[&all[..], &[text(&out)]].concat()).starts_with("2 pairs of 2 files: 2 of 2"));
    fs::write(data.join("c.csv"), "what,is,this\n1,2,3\n").expect("room");
    let other = folder.join("other");
    let output = leadlag(&[&all[..], &[text(&other)]].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("c.csv"), "{}", stderr(&output));
    assert_eq!(rows(&other).len(), 2);
    // A result does not replace its own input.
    let inside = data.join("parameters.csv");
    fs::copy(data.join("a.csv"), &inside).expect("room");
    refused(2, &["calibrate", text(&inside), "--all", "--model", "idm", "--out", text(&data)])
        .says("would replace the input");
    fs::remove_file(inside).expect("it can be removed");
    // A folder refuses another data set.
    refused(1, &[&all[..], &[text(&out), "--seed", "2"]].concat()).says("a fleet of other data, settings or program");
}

/// The larger of two nested models fits its own sample better in any case. It is best only if it follows other drives better, too.
#[test]
fn of_nested_models_the_larger_has_to_earn_it() {
    let folder = scratch("fleet", "nested");
    for (late, noise, name) in [(0, 0.03, "none"), (10, 0.01, "late")] {
        let table = folder.join(format!("{name}.csv"));
        fs::write(&table, HEADER.to_owned() + &delayed_drives(0..8, 1200, late, noise)).expect("room");
        for (rule, column) in [(&[][..], "expected_score"), (&["--holdout", "0.3"], "heldout_score")] {
            let out = folder.join(format!("{name}{}", rule.len()));
            let models = ["--model", "idm", "--model", "idm+delay", "--gof", "nrmse-s", "--bounds", "human"];
            let all = ["calibrate", text(&table), "--all", "--out", text(&out)];
            let said = ok(&[&all[..], &models, rule].concat());
            println!("{said}");
            assert!(said.lines().all(|line| line.chars().count() <= 80), "{said}");
            let file = fs::read_to_string(out.join("fleet.json")).expect("written");
            let file: serde_json::Value = serde_json::from_str(&file).expect("JSON");
            let [idm, delayed] = [0, 1].map(|k| &file["overview"][k]);
            assert!(idm["score"]["median"].as_f64() >= delayed["score"]["median"].as_f64() || late == 0);
            if late == 0 {
                assert!(delayed["best"].as_u64() <= Some(1), "{said}");
                assert_eq!(idm["chosen"], true, "{said}");
                assert!(said.contains("undecided") || said.contains("idm follows these drivers best"), "{said}");
            } else {
                assert!(delayed["best"].as_u64() > Some(1) && idm["best"].as_u64() == Some(0), "{said}");
                assert_eq!(delayed["chosen"], true, "{said}");
                assert!(idm["behind"]["interval"][0].as_f64() > Some(0.0), "{said}");
                assert!(said.contains("idm+delay follows these drivers best"), "{said}");
            }
            assert!(rows(&out).iter().all(|row| row[column].parse::<f64>().is_ok()), "{column}");
            let page = folder.join("page.html");
            ok(&["report", text(&out), "--out", text(&page)]);
            let html = fs::read_to_string(&page).expect("written");
            assert!(html.contains("Compared: the score"), "the page names the rule");
        }
    }
}

/// Held-back data may be other files: a driver is found in them by the id of the car or the trajectory.
#[test]
fn other_drives_of_the_same_drivers_are_held_back() {
    let folder = scratch("fleet", "held");
    let [fit, other] = ["fit.csv", "other.csv"].map(|name| folder.join(name));
    fs::write(&fit, HEADER.to_owned() + &drives(0..3, 300)).expect("room");
    fs::write(&other, HEADER.to_owned() + &drives(1..5, 250)).expect("room");
    let out = folder.join("out");
    let all = ["calibrate", text(&fit), "--all", "--model", "idm", "--no-intervals", "--out", text(&out), "--holdout"];
    let output = succeeds(&[&all[..], &[text(&other)]].concat());
    assert!(stderr(&output).contains("1 of 3 pairs have no data held back"), "{}", stderr(&output));
    let scored: Vec<bool> = rows(&out).iter().map(|row| !row["heldout_score"].is_empty()).collect();
    assert_eq!(scored, [false, true, true]);
    fs::write(&other, HEADER.to_owned() + &drives(7..9, 250)).expect("room");
    for (given, expected) in [
        (text(&other), "belong to none of the calibrated drivers, automated vehicle 1, automated vehicle 3"),
        (text(&fit), "it is also used for calibration"),
        ("1.5", "expected a share above 0 and below 1"),
        ("nan", "expected a share above 0 and below 1"),
    ] {
        refused(2, &[&all[..], &[given]].concat()).says(expected);
    }
    // Two seconds are needed on either side.
    let (_, said) = fails(&[&all[..], &["0.95"]].concat());
    assert!(said.contains("in either part, found 1."), "{said}");
}

#[test]
fn what_does_not_go_with_many_pairs_is_told() {
    let folder = scratch("fleet", "usage");
    let table = folder.join("pairs.csv");
    fs::write(&table, HEADER.to_owned() + &drives(0..1, 100)).expect("room");
    let out = folder.join("out");
    let one = ["calibrate", text(&table), "--out", text(&out), "--model", "idm"];
    for (more, expected) in [
        (&["--model", "gipps"][..], "one model is calibrated at a time, unless --all"),
        (&["--gof", "nrmse-s", "--gof", "nrmse-v"], "one measure is minimised at a time, unless --all"),
        (&["--all", "--joint"], "cannot be used with"),
        (&["--all", "--replicates", "3"], "cannot be used with"),
        (&["--all", "--model", "idm"], "--model idm is given twice"),
    ] {
        refused(2, &[&one[..], more].concat()).says(expected);
    }
}

/// Killed at any moment and started again, a fleet ends with the same bytes, and finished calibrations are not repeated.
/// Many pairs share an evaluator on a device, and few do on the CPU: the same bytes.
#[test]
fn a_device_finds_what_the_cpu_finds() {
    if skipped("a_device_finds_what_the_cpu_finds") {
        return;
    }
    let folder = scratch("fleet", "device");
    let table = folder.join("pairs.csv");
    fs::write(&table, HEADER.to_owned() + &drives(0..6, 200)).expect("room");
    let found = ["lanes", "gpu"].map(|evaluator| {
        let out = folder.join(evaluator);
        let words = ["--model", "idm", "--evaluator", evaluator, "--max-evaluations", "2000", "--out", text(&out)];
        ok(&[&["calibrate", text(&table), "--all"][..], &words].concat());
        files(&out)
    });
    assert!(!found[0].is_empty());
    for (name, bytes) in &found[0] {
        assert!(bytes == &found[1][name], "{name} differs");
    }
}

#[test]
fn a_killed_fleet_goes_on() {
    let kills: usize =
        std::env::var("LEADLAG_KILLS").map_or_else(|_| sample::times(5), |kills| kills.parse().expect("a number"));
    let folder = scratch("fleet", "killed");
    let table = folder.join("pairs.csv");
    fs::write(&table, HEADER.to_owned() + &drives(0..120, 150)).expect("room");
    let command = |out: &Path| {
        let words =
            ["calibrate", text(&table), "--all", "--model", "idm", "--max-evaluations", "4000", "--no-intervals"];
        [&words[..], &["--out", text(out)]].concat().iter().map(|&word| word.to_owned()).collect::<Vec<_>>()
    };
    let whole = folder.join("whole");
    let begun = std::time::Instant::now();
    ok(&command(&whole).iter().map(String::as_str).collect::<Vec<_>>());
    let lasts = begun.elapsed();
    let expected = files(&whole);
    let mut killed = 0;
    for turn in 0.. {
        assert!(turn < 20 * kills, "the run is hardly ever hit");
        if killed >= kills {
            break;
        }
        let out = folder.join(format!("killed{turn}"));
        let mut lines = 0;
        // Until it finishes: each kill comes somewhat later.
        for time in 1.. {
            let mut child = Command::new(env!("CARGO_BIN_EXE_leadlag"))
                .args(command(&out))
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("the program starts");
            sleep(lasts.mul_f64(0.13 * f64::from(time) + 0.01 * turn as f64).max(Duration::from_millis(20)));
            child.kill().expect("SIGKILL can be sent");
            let hit = child.wait().expect("it ends").code().is_none();
            let journal = fs::read_to_string(out.join("journal.jsonl")).unwrap_or_default();
            let now = journal.lines().count();
            assert!(now + 1 >= lines, "rows were lost: {lines} lines, then {now}");
            lines = now;
            if !hit {
                break;
            }
            killed += 1;
        }
        assert!(files(&out) == expected, "after {killed} kills");
        fs::remove_dir_all(&out).expect("it can be removed");
    }
}

/// With drivers of known parameters: intervals of determined parameters contain the truth as often as they should, and not all are determined.
#[test]
fn intervals_of_short_drives_hold_the_truth() {
    let folder = scratch("fleet", "coverage");
    let table = folder.join("pairs.csv");
    fs::write(&table, HEADER.to_owned() + &drives(100..180, 400)).expect("room");
    let out = folder.join("out");
    ok(&["calibrate", text(&table), "--all", "--model", "idm", "--bounds", "human", "--out", text(&out)]);
    let (mut held, mut all) = (0, 0);
    for row in rows(&out) {
        let number: u64 = row["trajectory"].parse().expect("a number");
        let truth = driver(number);
        let signs = [1.0, 1.0, 1.0, 1.0, -1.0];
        let columns = ["v_0_mps", "t_h_s", "d_0_m", "a_max_mps2", "a_min_mps2"];
        for (column, truth) in columns.iter().zip(truth.iter().zip(signs).map(|(x, sign)| x * sign)) {
            let end = |side: &str| row[&format!("{column}_{side}")].parse::<f64>().ok();
            if let (Some(low), Some(high)) = (end("low"), end("high")) {
                held += i32::from(low <= truth && truth <= high);
                all += 1;
            }
        }
    }
    println!("{held} of {all} intervals hold the truth");
    // 95 % should; intervals of one drive are correlated, so that 90 % is two standard deviations below.
    assert!(held * 10 >= all * 9, "{held} of {all} intervals hold the truth");
    assert!((100..400).contains(&all), "{all} of 400 parameters are determined");
}

/// A plan names a table or a pattern once, and every trajectory is a separate platoon.
#[test]
fn a_study_takes_every_trajectory_of_a_table_or_pattern() {
    let folder = scratch("fleet", "study");
    fs::write(folder.join("pairs.csv"), HEADER.to_owned() + &drives(0..3, 150) + &drives(3..4, 8)).expect("room");
    for name in ["one", "two"] {
        let numbers = if name == "one" { 5..6 } else { 6..7 };
        fs::write(folder.join(format!("own_{name}.csv")), HEADER.to_owned() + &drives(numbers, 150)).expect("room");
    }
    let plan = |entry: &str| {
        let calibration = "[calibration]\nvariants = [\"idm\"]\nmax_evaluations = 500\n";
        format!("schema_version = 1\n[data]\n[[platoon]]\nname = \"P\"\n{entry}\n{calibration}")
    };
    let file = folder.join("plan.toml");
    let all = "table = \"pairs.csv\"\ntrajectories = \"all\"";
    for (entry, platoons) in [(all, &["P-0", "P-1", "P-2"][..]), ("files = \"own_*.csv\"", &["P-own_one", "P-own_two"])]
    {
        fs::write(&file, plan(entry)).expect("room");
        let out = folder.join(format!("study{}", platoons.len()));
        let output = succeeds(&["study", "plan", text(&file), "--out", text(&out)]);
        let planned = program::stdout(&output);
        let names: Vec<&str> = planned.lines().filter_map(|line| line.split('\t').nth(1)).collect();
        assert_eq!(names, platoons);
        assert_eq!(stderr(&output).contains("left out: 1 of 4 trajectories"), entry == all, "{}", stderr(&output));
        // Different vehicles are not validated on each other.
        assert!(stderr(&output).contains("0 validation runs"), "{}", stderr(&output));
        ok(&["study", "run", text(&out)]);
        ok(&["study", "merge", text(&out)]);
        let merged = fs::read_to_string(out.join("merged/calibrations.csv")).expect("merged");
        assert_eq!(merged.lines().count(), 1 + platoons.len());
    }
    for (entry, expected) in [
        ("files = \"pairs.csv\"", "expected one * in the name of the file"),
        ("files = \"none_*.csv\"", "expected files"),
        ("table = \"pairs.csv\"\ntrajectories = \"some\"", "expected all"),
        ("table = \"pairs.csv\"\nfile = \"pairs.csv\"", "expected one of file, table and files, found 2"),
    ] {
        fs::write(&file, plan(entry)).expect("room");
        let (_, said) = fails(&["study", "plan", text(&file), "--out", text(&folder.join("no"))]);
        assert!(said.contains(expected), "{entry}: {said}");
    }
}
