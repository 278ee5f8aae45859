//! Effects of data, laws and failures on a fleet: drives that do not vary, laws that share a name, settings and journals that change.

use crate::common::program::{fails, leadlag, ok, refused, rows_of, scratch, stderr, stdout, succeeds, text};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// 40 s behind a car whose speed varies; the follower's own speed by its time \[s\].
fn pair(speed: impl Fn(f64) -> f64) -> String {
    let mut table = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    let (mut gap, mut before) = (30.0, 0.0);
    for k in 0..400 {
        let t = f64::from(k) / 10.0;
        let (v_l, v) = (20.0 + 3.0 * (t / 3.0).sin(), speed(t));
        // Trapezoids, by the speeds.
        gap += if k == 0 { 0.0 } else { 0.05 * (before + v_l - v) };
        before = v_l - v;
        writeln!(table, "{t:.1},{v_l:.6},{v:.6},{gap:.6}").expect("a String takes all");
    }
    table
}

fn varied(t: f64) -> f64 {
    20.0 + 2.5 * ((t - 1.0) / 3.0).sin()
}

fn file(folder: &Path, name: &str, content: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).expect("room");
    path
}

fn rows(folder: &Path) -> Vec<BTreeMap<String, String>> {
    rows_of(&folder.join("parameters.csv"))
}

const SETTINGS: [&str; 6] = ["--bounds", "human", "--gof", "nrmse-s", "--max-evaluations", "400"];

fn fleet<'a>(table: &'a Path, out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    [&["calibrate", text(table), "--all", "--out", text(out)], &SETTINGS[..], more].concat()
}

/// The NRMSE of an acceleration that is always 0 is NaN, and no row is lost for that reason.
#[test]
fn a_drive_at_constant_speed_is_read_again() {
    let folder = scratch("fleet_faults", "constant");
    let (table, out) = (file(&folder, "pair.csv", &pair(|_| 20.0)), folder.join("out"));
    let once = ok(&fleet(&table, &out, &["--model", "idm"]));
    let found = rows(&out);
    assert_eq!((found[0]["nrmse_a"].as_str(), found[0]["reason"].as_str()), ("", ""), "{found:?}");
    assert!(found[0]["rmse_a_mps2"].parse::<f64>().is_ok() && found[0]["nrmse_s"].parse::<f64>().is_ok(), "{found:?}");
    let written = fs::read(out.join("parameters.csv")).expect("written");
    let again = succeeds(&fleet(&table, &out, &["--model", "idm"]));
    assert!(stderr(&again).contains("1 of 1 calibrations were finished before"), "{}", stderr(&again));
    assert_eq!(stdout(&again), once);
    assert!(fs::read(out.join("parameters.csv")).expect("written") == written);
}

/// A law whose own parameters are these, by declaration; the first two are a gain and a headway.
fn law(folder: &Path, name: &str, members: [(&str, &str); 2]) -> PathBuf {
    let [(gain, gain_unit), (gap, gap_unit)] = members;
    let content = format!(
        "//! A law.\nstruct Parameters {{\n    /// gain [{gain_unit}], 0.01 to 1\n    {gain}: f32,\n    /// gap in time [{gap_unit}], 0.5 to 3\n    \
         {gap}: f32,\n}}\n\nfn {name}_law(own: Parameters, x: Perceived) -> f32 {{\n    \
         return own.{gain} * (x.s - own.{gap} * x.v_f) + 0.5 * (x.v_l - x.v_f);\n}}\n"
    );
    file(folder, &format!("{name}.wgsl"), &content)
}

#[test]
fn laws_share_a_column_of_one_name_and_unit() {
    let folder = scratch("fleet_faults", "laws");
    let (table, out) = (file(&folder, "pair.csv", &pair(varied)), folder.join("out"));
    let one = law(&folder, "one", [("gain", "1/s2"), ("gap", "s")]);
    let two = law(&folder, "two", [("gain", "1/s2"), ("rest", "s")]);
    ok(&fleet(&table, &out, &["--model", text(&one), "--model", text(&two)]));
    let found = rows(&out);
    assert_eq!(found.len(), 2);
    for (row, own, other) in [(0, "gap_s", "rest_s"), (1, "rest_s", "gap_s")] {
        let row = &found[row];
        assert!(row["gain_per_s2"].parse::<f64>().is_ok() && row[own].parse::<f64>().is_ok(), "{row:?}");
        assert_eq!(row[other], "", "{row:?}");
    }
    ok(&["report", text(&out), "--out", text(&folder.join("page.html"))]);
}

#[test]
fn parameters_that_would_be_another_column_are_refused() {
    let folder = scratch("fleet_faults", "columns");
    let (table, out) = (file(&folder, "pair.csv", &pair(varied)), folder.join("out"));
    let taken = |column: &str| format!("would be the column {column}, which the tables have already");
    let both = |column: &str| format!("would both be the column {column}; give one of them another name");
    let plain = [("gain", "1/s2"), ("gap", "s")];
    for (name, members, expected) in [
        ("score", [("score", "-"), ("gap", "s")], taken("score")),
        ("model", [("gain", "1/s2"), ("model", "-")], taken("model")),
        ("low", [("gain", "1/s2"), ("gain_per_s2_low", "-")], both("gain_per_s2_low")),
        ("twins", [("gap_s", "-"), ("gap", "s")], both("gap_s")),
        ("other", [("gain", "1/s2"), ("gap_s", "-")], both("gap_s")),
        ("built_in", [("gain", "1/s2"), ("t_h_s", "-")], both("t_h_s")),
    ] {
        let (first, second) = (law(&folder, "plain", plain), law(&folder, &format!("my_{name}"), members));
        let models = ["--model", "idm", "--model", text(&first), "--model", text(&second)];
        refused(2, &fleet(&table, &out, &models)).says(&expected);
    }
    let elsewhere = folder.join("elsewhere");
    fs::create_dir_all(&elsewhere).expect("room");
    let (first, second) = (law(&folder, "plain", plain), law(&elsewhere, "plain", [("rate", "1/s2"), ("gap", "s")]));
    let models = ["--model", text(&first), "--model", &format!("{}+delay", text(&second))];
    refused(2, &fleet(&table, &out, &models)).says("two laws have the name plain");
    assert!(!out.exists(), "before any work");
}

/// Everything that a simulation reads of a drive affects its rows.
#[test]
fn a_fleet_of_another_second_car_is_another_one() {
    let folder = scratch("fleet_faults", "second_car");
    let mut table = String::new();
    for (k, line) in pair(varied).lines().enumerate() {
        let more = if k == 0 { "v2,s2".to_owned() } else { format!("{:.4},25", 20.0 + 3.0 * (k as f64 / 27.0).sin()) };
        writeln!(table, "{line},{more}").expect("a String takes all");
    }
    let (table, map, out) = (file(&folder, "pairs.csv", &table), folder.join("map.toml"), folder.join("out"));
    let words = ["--columns", text(&map), "--model", "idm", "--extend", "multi_anticipation"];
    let with_unit = |unit: &str| {
        let content = format!(
            "title = \"two ahead\"\nrows = \"pairs\"\ncheck_units = false\n[columns]\ntime = {{ name = \"time_s\", unit = \"s\" }}\n\
             speed = {{ name = \"speed_mps\", unit = \"m/s\" }}\nlead_speed = {{ name = \"lead_speed_mps\", unit = \"m/s\" }}\n\
             gap = {{ name = \"spacing_m\", unit = \"m\" }}\nlead2_speed = {{ name = \"v2\", unit = \"{unit}\" }}\n\
             lead2_gap = {{ name = \"s2\", unit = \"m\" }}\n"
        );
        fs::write(&map, content).expect("room");
    };
    with_unit("m/s");
    ok(&fleet(&table, &out, &words));
    with_unit("km/h");
    refused(1, &fleet(&table, &out, &words)).says("a fleet of other data, settings or program");
    with_unit("m/s");
    ok(&fleet(&table, &out, &words));
}

#[test]
fn a_row_that_does_not_fit_is_refused_with_its_line() {
    let folder = scratch("fleet_faults", "journal");
    let (table, out) = (file(&folder, "pair.csv", &pair(varied)), folder.join("out"));
    let command = fleet(&table, &out, &["--model", "idm"]);
    ok(&command);
    let journal = out.join("journal.jsonl");
    let whole = fs::read_to_string(&journal).expect("written");
    let (head, row) = whole.split_once('\n').expect("two lines");
    let row: serde_json::Value = serde_json::from_str(row).expect("JSON");
    let changed = |pointer: &str, value: serde_json::Value| {
        let mut row = row.clone();
        *row.pointer_mut(pointer).expect("a row has it") = value;
        format!("{head}\n{row}\n")
    };
    for (content, expected) in [
        (changed("/Ok/parameters", serde_json::json!([1.0])), "expected 6 parameters, found 1"),
        (changed("/Ok/intervals", serde_json::json!([null])), "expected 6 intervals, found 1"),
        (changed("/pair", serde_json::json!(7)), "expected one of 1 pairs, 1 models and 1 measures"),
        (changed("/Ok/score", serde_json::Value::Null), "invalid type: null"),
    ] {
        fs::write(&journal, content).expect("room");
        let said = refused(1, &command).says("journal.jsonl:2: not a calibration of this fleet").says(expected);
        let said = said.says("; remove the line, and it is calibrated again").0;
        assert!(!said.contains("panicked"), "{said}");
    }
    // By the message: without the line it is calibrated again.
    fs::write(&journal, format!("{head}\n")).expect("room");
    ok(&command);
    assert_eq!(fs::read_to_string(&journal).expect("written"), whole);
    // Possible content of a file after a power cut.
    fs::write(&journal, [0; 4096]).expect("room");
    ok(&command);
    assert_eq!(fs::read_to_string(&journal).expect("written"), whole);
}

/// The same samples twice would make intervals too narrow and a diagnosis too certain.
#[test]
fn a_drive_counts_once() {
    let folder = scratch("fleet_faults", "once");
    let (one, copy) = (file(&folder, "one.csv", &pair(varied)), folder.join("copy.csv"));
    let other = file(&folder, "other.csv", &pair(|t| varied(t) + 0.3 * (t / 2.0).cos()));
    fs::write(&copy, pair(varied).replace('\n', "\r\n")).expect("room");
    let (out, [one, copy, other]) = (folder.join("out"), [&one, &copy, &other].map(|path| text(path)));
    let joint = |files: &[&str]| {
        let more = ["--joint", "--model", "idm", "--no-intervals", "--out", text(&out)];
        leadlag(&[&["calibrate"], files, &SETTINGS[..], &more[..]].concat())
    };
    let diagnose = |files: &[&str]| leadlag(&[&["diagnose", "--base", "idm", "--data-only"], files].concat());
    for (done, expected) in [
        (joint(&[one, other, one]), "is given twice"),
        (joint(&[one, copy]), "has samples of"),
        (diagnose(&[one, other, one]), "is given twice"),
        (diagnose(&[one, copy]), "has samples of"),
        (diagnose(&[other, "--holdout", one, "--holdout", one]), "is given twice"),
        (diagnose(&[one, "--holdout", copy]), "also given for training"),
    ] {
        let said = stderr(&done);
        assert!(done.status.code() == Some(2) && said.contains(expected) && said.contains("one.csv"), "{said}");
    }
    assert!(!out.exists(), "before any work");
    for done in [joint(&[one, other]), diagnose(&[one, other]), diagnose(&[one, "--holdout", other])] {
        assert!(done.status.success(), "{}", stderr(&done));
    }
    // Each row is correct; their summary is not.
    let command = |files: &[&str], name: &str| {
        let more = ["--all", "--model", "idm", "--no-intervals", "--out"];
        let said = succeeds(&[&["calibrate"], files, &SETTINGS[..], &more[..], &[text(&folder.join(name))]].concat());
        stderr(&said)
    };
    let said = command(&[one, other, copy], "copies");
    assert!(said.contains("1 of 3 pairs are copies of another one") && said.contains("copy.csv"), "{said}");
    assert!(command(&[one, one], "twice").contains("one.csv follower 1 is given twice"));
    assert!(!command(&[one, other], "apart").contains("copies"));
}

/// Ids stay as in the file; a warning says that a spreadsheet would run one of them.
#[test]
fn a_formula_among_the_ids_is_told() {
    let folder = scratch("fleet_faults", "formula");
    let head = "id,time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    let formula = "=HYPERLINK(A1)";
    let row = |line: &str| format!("{formula},{line}\n");
    let table = file(&folder, "pairs.csv", &(head + &pair(varied).lines().skip(1).map(row).collect::<String>()));
    let map = file(
        &folder,
        "map.toml",
        "title = \"ids\"\nrows = \"pairs\"\n[columns]\ngroup = { name = \"id\" }\ntime = { name = \"time_s\", unit = \"s\" }\n\
         speed = { name = \"speed_mps\", unit = \"m/s\" }\nlead_speed = { name = \"lead_speed_mps\", unit = \"m/s\" }\n\
         gap = { name = \"spacing_m\", unit = \"m\" }\n",
    );
    let out = folder.join("out");
    let done = succeeds(&fleet(&table, &out, &["--model", "idm", "--columns", text(&map)]));
    assert!(rows(&out).iter().all(|row| row["trajectory"] == formula), "{:?}", rows(&out));
    assert!(stderr(&done).contains("begins like a formula, which a spreadsheet"), "{}", stderr(&done));
}

/// The id of a driver is the driver's name: where drives are listed, chosen and tabulated.
#[test]
fn drivers_are_called_by_their_ids() {
    let folder = scratch("fleet_faults", "ids");
    let mut table = "driver,time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for (k, driver) in ["D01", "D02", "D03", "D04", "D05"].into_iter().enumerate() {
        let own = pair(|t| varied(t) + 0.2 * (t / (1.5 + k as f64)).cos());
        // The third one is the longest.
        let rows = if driver == "D03" { 401 } else { 350 };
        own.lines().take(rows).skip(1).for_each(|line| writeln!(table, "{driver},{line}").expect("a String takes all"));
    }
    let table = file(&folder, "drivers.csv", &table);
    let map = file(
        &folder,
        "map.toml",
        "title = \"drivers\"\nrows = \"pairs\"\n[columns]\ngroup = { name = \"driver\" }\n\
         time = { name = \"time_s\", unit = \"s\" }\nspeed = { name = \"speed_mps\", unit = \"m/s\" }\n\
         lead_speed = { name = \"lead_speed_mps\", unit = \"m/s\" }\ngap = { name = \"spacing_m\", unit = \"m\" }\n",
    );
    let columns = ["--columns", text(&map)];
    let shown = ok(&[&["inspect", text(&table)], &columns[..]].concat());
    let listed: Vec<&str> = shown.lines().filter(|line| line.contains(" preceding vehicle ")).collect();
    let first: Vec<&str> = listed.iter().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(first[..5], ["D03", "D01", "D02", "D04", "D05"], "the longest first: {shown}");
    assert!(
        shown.contains("\ntrajectory D03\n") && !shown.contains("trajectory D01\n"),
        "the longest in full: {shown}"
    );
    // Without the group, the message asks for the column that distinguishes drives; the surplus column with one value does not.
    let nameless = fs::read_to_string(&map).expect("written").replace("group = { name = \"driver\" }\n", "");
    let nameless = file(&folder, "nameless.toml", &nameless);
    let (code, said) = fails(&["inspect", text(&table), "--columns", text(&nameless)]);
    assert!(
        code == 1 && said.contains("if driver distinguishes drives, add `group = { name = \"driver\" }`"),
        "{said}"
    );
    assert!(!said.contains("remove one of them"), "{said}");
    let one = folder.join("one");
    let calibrate = |more: &[&str]| {
        let words = ["calibrate", text(&table), "--model", "idm", "--out", text(&one), "--no-intervals"];
        [&words, &SETTINGS[..], &columns[..], more].concat().iter().map(|&word| word.to_owned()).collect::<Vec<_>>()
    };
    let words = |owned: &[String]| leadlag(&owned.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(words(&calibrate(&["--follower", "D04"])).status.success());
    let result = fs::read_to_string(one.join("result.json")).expect("written");
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["data"][0]["name"], "D04");
    let refused = words(&calibrate(&["--follower", "D4"]));
    let said = stderr(&refused);
    assert!(
        refused.status.code() == Some(2) && said.contains("D01 (") && said.contains("did you mean `D04`?"),
        "{said}"
    );
    let all = folder.join("all");
    ok(&fleet(&table, &all, &[&columns[..], &["--model", "idm"]].concat()));
    assert!(rows(&all).iter().all(|row| row["name"] == row["trajectory"] && row["name"].starts_with("D0")));
    // A driver simulated by id with the row of the table has the same score there.
    let simulate = |result: &Path, more: &[&str]| {
        leadlag(&[&["simulate", text(&table), "--result", text(result), "--json"], &columns[..], more].concat())
    };
    let scored = |output: &std::process::Output| -> serde_json::Value {
        assert!(output.status.success(), "{}", stderr(output));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let row = rows(&all).into_iter().find(|row| row["name"] == "D04").expect("a row");
    for result in [all.clone(), all.join("parameters.csv"), all.join("fleet.json")] {
        let run = scored(&simulate(&result, &["--follower", "D04"]));
        assert_eq!(run["runs"][0]["score"]["nrmse_s"].as_f64(), row["nrmse_s"].parse().ok(), "{result:?}");
    }
    for (more, expected) in [
        (&["--follower", "D06"][..], "not a follower"),
        (&["--trajectory", "D06"], "found no driver D06; it has D01, D02, D03, D04, D05; did you mean"),
        (&[], "give the driver by --follower or --trajectory; it has D01"),
    ] {
        let refused = simulate(&all, more);
        assert!(refused.status.code() == Some(2), "{more:?}");
        let said = stderr(&refused);
        assert!(said.contains(expected) || said.contains("found no driver"), "{more:?}: {said}");
    }
    let page = folder.join("page.html");
    ok(&["report", text(&all), "--out", text(&page)]);
    let html = fs::read_to_string(page).expect("written");
    assert!(html.contains("D03: idm") && !html.contains("pair 3"), "the worst fits are named");
}

/// A human and a controller are two drivers, of whom one is calibrated and the other has a row with the reason.
#[test]
fn each_driver_of_a_drive_has_a_row() {
    let folder = scratch("fleet_faults", "takeover");
    let driven = pair(varied);
    let rows_of = |(k, line): (usize, &str)| match k {
        0 => format!("{line},driver\n"),
        k => format!("{line},{}\n", if k <= 250 { "ACC" } else { "Human" }),
    };
    let table = file(&folder, "pair.csv", &driven.lines().enumerate().map(rows_of).collect::<String>());
    let out = folder.join("out");
    ok(&fleet(&table, &out, &["--model", "idm"]));
    let rows = rows(&out);
    let told: Vec<[&str; 3]> =
        rows.iter().map(|row| ["name", "samples", "status"].map(|column| row[column].as_str())).collect();
    assert_eq!(told, [["follower", "250", "ok"], ["follower (Human)", "", "unusable"]]);
    let reason = &rows[1]["reason"];
    assert!(
        reason.contains("Human drives from 25.0 to 39.9 s") && reason.contains("--from 25.000 --to 39.900"),
        "{reason}"
    );
    // A single calibration takes the same piece, and names both drivers.
    let out = folder.join("alone");
    let alone = ["calibrate", text(&table), "--model", "idm", "--out", text(&out)];
    let said = stderr(&succeeds(&[&alone, &SETTINGS[..]].concat()));
    let (warned, options) =
        ("ACC drives until 24.9 s and Human after", "--to 24.900 or --from 25.000 selects one of them");
    assert!(said.contains(warned) && said.contains(options), "{said}");
    // That option calibrates it.
    ok(&fleet(&table, &folder.join("human"), &["--model", "idm", "--from", "25.000", "--to", "39.900"]));
}

/// Doubtful pairs are counted and named before the calibration, and have the kinds of faults in the table.
#[test]
fn doubtful_pairs_of_a_fleet_are_named() {
    let folder = scratch("fleet_faults", "doubtful");
    let sound = pair(varied);
    let jumps = sound.lines().enumerate().map(|(k, line)| match line.rsplit_once(',') {
        Some((before, gap)) if k > 200 => format!("{before},{}\n", gap.parse::<f64>().expect("a gap") + 8.0),
        _ => format!("{line}\n"),
    });
    let tables = [file(&folder, "sound.csv", &sound), file(&folder, "jumps.csv", &jumps.collect::<String>())];
    let out = folder.join("out");
    let files = ["calibrate", text(&tables[0]), text(&tables[1]), "--all", "--model", "idm", "--out", text(&out)];
    let said = stderr(&succeeds(&[&files, &SETTINGS[..]].concat()));
    let named = format!("1 of 2 pairs have implausible signals: {} follower 1 (inconsistent)", tables[1].display());
    assert!(said.contains(&named) && said.contains("up by 8.0 m"), "{said}");
    let findings: Vec<String> = rows(&out).iter().map(|row| row["findings"].clone()).collect();
    assert_eq!(findings, ["", "inconsistent"]);
}
