//! `leadlag export sumo`: the vehicle type, the parts that cannot be exported, and SUMO itself beside leadlag, if it is installed
//! (`scripts/check-sumo` installs it and runs this file).

use crate::common::program::{json_of, leadlag, ok, scratch, synth, text};
use leadlag::internal::optimize::{normal, stream};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// A short drive with stops.
fn pair() -> PathBuf {
    synth(120).join("pair_follower1.csv")
}

/// `test` keeps tests that calibrate the same variant apart.
fn calibrated(test: &str, model: &str, extra: &[&str]) -> PathBuf {
    let pair = pair();
    let file = text(&pair);
    let folder = scratch("sumo", &format!("{test}_{}", model.replace('+', "_")));
    let arguments =
        ["calibrate", file, "--model", model, "--max-evaluations", "200", "--no-intervals", "--optimizer", "ga"];
    ok(&[&arguments[..], extra, &["--out", text(&folder)]].concat());
    folder
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&ok(&[arguments, &["--json"]].concat())).expect("JSON")
}

/// True if SUMO can be run. `LEADLAG_SUMO_TEST` requires it.
fn sumo(test: &str) -> bool {
    let found = leadlag::internal::sumo::find(None);
    if found.is_err() {
        assert!(std::env::var_os("LEADLAG_SUMO_TEST").is_none(), "LEADLAG_SUMO_TEST is set: {found:?}");
        eprintln!("SKIPPED {test}: no SUMO (scripts/check-sumo installs it)");
    }
    found.is_ok()
}

#[test]
fn a_type_has_the_parameters_and_says_what_it_has_not() {
    let folder = calibrated("type", "idm+delay+linear", &["--fix", "tau_p=0.3", "--fix", "v_0=31.5"]);
    let exported = json(&["export", "sumo", text(&folder), "--no-run"]);
    let result = json_of(folder.join("result.json"));
    let attribute = |name: &str| exported["attributes"][name].as_str().unwrap().parse::<f64>().unwrap();
    let parameter = |name: &str| result["parameters"][name].as_f64().unwrap();
    for (attribute, parameter) in [
        (attribute("accel"), parameter("a_max")),
        (attribute("decel"), -parameter("a_min")),
        (attribute("tau"), parameter("t_h")),
        (attribute("minGap"), parameter("d_0")),
        (attribute("delta"), parameter("delta")),
        (attribute("maxSpeed"), 31.5),
        (attribute("speedDev"), 0.0),
    ] {
        assert_eq!(attribute, parameter);
    }
    let lost: Vec<&str> = exported["lost"].as_array().unwrap().iter().map(|entry| entry.as_str().unwrap()).collect();
    assert_eq!(lost[0], "the perception delay, tau_p = 0.3000 s");
    assert!(lost.len() == 2 && lost[1].starts_with("the actuation lag, tau_a = "), "{lost:?}");
    let xml = fs::read_to_string(folder.join("sumo/vtype.add.xml")).unwrap();
    assert!(xml.contains("<vType id=\"leadlag\" carFollowModel=\"IDM\" accel="), "{xml}");
    assert!(xml.contains("<!-- not exported: the perception delay, tau_p = 0.3000 s -->"), "{xml}");
    let page = report(&folder);
    assert!(page.contains("<p>Not exported: the perception delay, tau_p = 0.3000 s.</p>"));
    assert!(page.contains("It was not run."));
    // Calibrated again into the same folder: the export belongs to another result.
    let result = folder.join("result.json");
    let changed = fs::read_to_string(&result).expect("it was written") + "\n";
    fs::write(&result, changed).expect("writable");
    assert!(!report(&folder).contains("In SUMO"));
}

/// A fleet of three drivers, the third one with a gap in feet.
fn fleet() -> PathBuf {
    let drive = fs::read_to_string(pair()).expect("it was made");
    let mut table = "who,time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    let header: Vec<&str> = drive.lines().next().expect("a header").split(',').collect();
    let columns = ["time_s", "lead_speed_mps", "speed_mps", "spacing_m"];
    let places = columns.map(|name| header.iter().position(|column| *column == name).expect("a pair file"));
    for (who, size) in [("Anna", 1.0), ("Ben", 1.0), ("Cleo", 1.0 / 0.3048)] {
        let mut rng = stream(1, 0, 0, 0);
        for row in drive.lines().skip(1) {
            let fields: Vec<&str> = row.split(',').collect();
            let [t, v_l, v, gap] = places.map(|place| fields[place]);
            // Of Anna and Ben, the acceleration is mostly noise, which does not make parameters doubtful.
            let noise = if who == "Cleo" { 0.0 } else { 0.1 * normal(&mut rng) };
            let v = (v.parse::<f64>().expect("a number") + noise).max(0.0);
            let gap = gap.parse::<f64>().expect("a number") * size;
            table += &format!("{who},{t},{v_l},{v},{gap}\n");
        }
    }
    let folder = scratch("sumo", "fleet");
    fs::create_dir_all(&folder).expect("writable");
    let map = "rows = \"pairs\"\ncheck_units = false\n[columns]\ntime = { name = \"time_s\" }\nspeed = { name = \"speed_mps\" }\n\
               lead_speed = { name = \"lead_speed_mps\" }\ngap = { name = \"spacing_m\" }\ngroup = { name = \"who\" }\n";
    fs::write(folder.join("map.toml"), map).expect("writable");
    fs::write(folder.join("table.csv"), table).expect("writable");
    let (table, map, out) = (folder.join("table.csv"), folder.join("map.toml"), folder.join("fleet"));
    let arguments =
        ["calibrate", text(&table), "--columns", text(&map), "--all", "--model", "idm", "--out", text(&out)];
    ok(&[&arguments[..], &["--max-evaluations", "200", "--no-intervals"]].concat());
    out
}

#[test]
fn the_sound_drivers_of_a_fleet_become_a_distribution_and_its_page_names_the_others() {
    let folder = fleet();
    let table = fs::read_to_string(folder.join("parameters.csv")).expect("written");
    assert!(table.lines().any(|row| row.contains(",Ben,") && row.contains(",noisy,")), "{table}");
    let exported = json(&["export", "sumo", text(&folder)]);
    let ids: Vec<&str> =
        exported["types"].as_array().expect("types").iter().map(|t| t["id"].as_str().unwrap()).collect();
    assert_eq!(ids, ["leadlag_1_Anna", "leadlag_2_Ben"]);
    let left_out = exported["left_out"].to_string();
    assert!(left_out.contains("Cleo (unit)"), "{left_out}");
    let xml = fs::read_to_string(folder.join("sumo/vtype.add.xml")).expect("it was written");
    assert!(
        xml.contains("<vTypeDistribution id=\"leadlag\">") && xml.ends_with("</vTypeDistribution>\n</additional>\n"),
        "{xml}"
    );
    assert_eq!(xml.matches(" probability=\"1\"/>").count(), 2, "{xml}");
    assert_eq!(xml.matches("run SUMO with step-length 0.1 step-method.ballistic").count(), 1, "{xml}");
    let said = ok(&["export", "sumo", text(&folder), "--no-run"]);
    assert!(
        said.starts_with("2 drivers with idm as vTypeDistribution leadlag of SUMO: ") && said.contains("Cleo (unit)"),
        "{said}"
    );
    assert_eq!(leadlag(&["export", "sumo", text(&folder), "--sumo", "."]).status.code(), Some(2));
    let page = report(&folder);
    assert!(page.contains("<strong>3 pairs with doubtful data:</strong>") && page.contains("Cleo follower 1 (unit)"));
    // The page of a single driver uses the words of every other command.
    let (table, map) = (folder.with_file_name("table.csv"), folder.with_file_name("map.toml"));
    let out = folder.with_file_name("cleo");
    let arguments = ["calibrate", text(&table), "--columns", text(&map), "--trajectory", "Cleo", "--model", "idm"];
    ok(&[&arguments[..], &["--max-evaluations", "200", "--no-intervals", "--out", text(&out)]].concat());
    // The warning of the command names the fault, so nothing else does.
    let page = report(&out);
    let top = page.split("<main>").next().expect("a header");
    assert!(top.contains("Warnings of the command") && top.matches("is feet per metre").count() == 1, "{top}");
    // A result without its command has no warnings.
    std::fs::remove_file(out.join("run.json")).expect("written");
    assert!(
        report(&out).contains("<strong>A fault of the data.</strong>") && report(&out).contains("is feet per metre")
    );
}

/// The names of the files of a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("it is there").flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

#[test]
fn an_export_leaves_no_file_of_an_earlier_one() {
    let folder = calibrated("again", "idm", &[]);
    let sumo = folder.join("sumo");
    let export = || json(&["export", "sumo", text(&folder), "--no-run"]);
    // As a run of SUMO would have left it.
    let mut ran = export();
    let loss = serde_json::json!({"rms": 1.0, "largest": 2.0, "at_s": 3.0});
    ran["sumo"] = "1.28.0".into();
    ran["loss"] = serde_json::json!([{"samples": 2, "spacing_m": loss, "speed_mps": loss, "accel_mps2": loss,
        "nrmse_sva": 0.1, "sumo_nrmse_sva": 0.2, "collision": false}]);
    fs::write(sumo.join("loss.json"), ran.to_string()).expect("writable");
    for name in ["comparison.csv", "road.net.xml", "demand.rou.xml", "sumo.log", "own.txt"] {
        fs::write(sumo.join(name), "old").expect("writable");
    }
    export();
    assert_eq!(names(&sumo), ["loss.json", "own.txt", "run.json", "vtype.add.xml"]);
    // The next reader completes the change of a killed export.
    fs::create_dir(sumo.join(".leadlag-ready")).expect("writable");
    fs::rename(sumo.join("loss.json"), sumo.join(".leadlag-ready/loss.json")).expect("writable");
    fs::write(sumo.join(".leadlag-ready/.list"), "+ vtype.add.xml\n+ loss.json\n").expect("writable");
    assert!(report(&folder).contains("It was not run."));
    assert_eq!(names(&sumo), ["loss.json", "own.txt", "run.json", "vtype.add.xml"]);
}

#[cfg(unix)]
#[test]
fn an_export_that_fails_changes_nothing() {
    use std::os::unix::fs::PermissionsExt;
    let folder = calibrated("failing", "idm", &[]);
    let sumo = folder.join("sumo");
    ok(&["export", "sumo", text(&folder), "--no-run"]);
    let before = fs::read(sumo.join("vtype.add.xml")).expect("it was exported");
    // Another result, and a SUMO that ends as soon as it must drive.
    let other = calibrated("failing", "l-cth", &[]).join("result.json");
    let program = folder.join("ends");
    fs::write(
        &program,
        "#!/bin/sh\n[ \"$1\" = --version ] && echo Eclipse SUMO 1.28.0 && exit\necho no licence; exit 1\n",
    )
    .expect("writable");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("it is ours");
    let output = leadlag(&["export", "sumo", text(&other), "--sumo", text(&program), "--out", text(&sumo)]);
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(output.status.code() == Some(1) && message.contains("SUMO ended early: no licence"), "{message}");
    assert_eq!(fs::read(sumo.join("vtype.add.xml")).expect("it stays"), before);
    assert_eq!(names(&sumo), ["loss.json", "run.json", "vtype.add.xml"]);
}

/// The page of a calibration that has an export.
fn report(folder: &Path) -> String {
    let page = folder.join("report.html");
    ok(&["report", text(folder), "-o", text(&page)]);
    fs::read_to_string(page).expect("it was written")
}

#[test]
fn what_sumo_has_not_is_refused() {
    for (model, extra, expected) in [
        ("gipps", &[][..], "SUMO has no car-following model like gipps: its Krauss model descends from Gipps'"),
        ("l-idm", &[], "SUMO has no car-following model like l-idm"),
        ("l-cth", &["--to", "idm"], "--to IDM: l-cth can be exported as ACC"),
        ("idm", &["--to", "acc"], "--to ACC: idm can be exported as IDM or EIDM"),
        ("krauss", &["--to", "idm"], "--to IDM: krauss can be exported as KraussOrig1"),
        ("fvdm", &[], "SUMO has no car-following model like fvdm"),
    ] {
        let folder = calibrated("refused", model, &[]);
        let output = leadlag(&[&["export", "sumo", text(&folder), "--no-run"], extra].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(expected), "expected {expected:?} in:\n{message}");
        assert!(!folder.join("sumo").exists(), "a refused export leaves no files");
    }
    let folder = calibrated("nowhere", "idm", &[]);
    let output = leadlag(&["export", "sumo", text(&folder), "--sumo", "nowhere/sumo"]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("no SUMO found: nowhere/sumo cannot be run; install it"), "{message}");
}

/// SUMO computes Eqs. 2, 3 and 1 in f64, in another order; over 1200 steps only this difference remains \[m, m/s, m/s2\].
const ROUNDING: f64 = 1e-8;

#[test]
fn the_idm_of_sumo_is_the_idm_of_leadlag() {
    if !sumo("the_idm_of_sumo_is_the_idm_of_leadlag") {
        return;
    }
    let folder = calibrated("run", "idm", &[]);
    let loss = &json(&["export", "sumo", text(&folder)])["loss"][0];
    for signal in ["spacing_m", "speed_mps", "accel_mps2"] {
        let largest = loss[signal]["largest"].as_f64().unwrap();
        assert!(largest < ROUNDING, "{signal}: {largest}");
    }
    assert_eq!(loss["collision"], false);
    assert_eq!(loss["samples"], 1200);
    let [ours, theirs] = ["nrmse_sva", "sumo_nrmse_sva"].map(|name| loss[name].as_f64().unwrap());
    assert!((ours - theirs).abs() < ROUNDING, "{ours} and {theirs}");
}

#[test]
fn the_acc_of_sumo_keeps_a_larger_gap_at_low_speed_as_is_said() {
    if !sumo("the_acc_of_sumo_keeps_a_larger_gap_at_low_speed_as_is_said") {
        return;
    }
    let folder = calibrated("run", "l-cth", &[]);
    let exported = json(&["export", "sumo", text(&folder)]);
    let loss = &exported["loss"][0];
    let largest = loss["spacing_m"]["largest"].as_f64().unwrap();
    // The margin is 2 m at most; braking and starting overshoot it a little.
    assert!((1.0..3.0).contains(&largest), "spacing: {largest} m");
    // Every step of SUMO follows Eq. 6 with the margin that docs/SUMO.md states: nothing else is lost.
    let result = json_of(folder.join("result.json"));
    let [k_s, k_v, k_0, v_0, d_0, t_h] =
        ["k_s", "k_v", "k_0", "v_0", "d_0", "t_h"].map(|name| result["parameters"][name].as_f64().unwrap());
    let mut reader = csv::Reader::from_path(folder.join("sumo/comparison.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let at = |row: usize, name: &str| -> f64 {
        rows[row][header.iter().position(|column| column == name).unwrap()].parse().unwrap()
    };
    let mut followed = 0;
    for row in 0..rows.len() - 1 {
        let [s, v, v_l] = ["sumo_spacing_m", "sumo_speed_mps", "lead_speed_mps"].map(|name| at(row, name));
        let margin = if v > 0.0 { (75.0 / v - 5.0).clamp(0.0, 2.0) } else { 2.0 };
        let a = (k_v * (v_l - v) - k_s * (d_0 + t_h * v + margin - s)).min(k_0 * (v_0 - v));
        let found = at(row + 1, "sumo_accel_mps2");
        followed += usize::from((found - a.max(-v / 0.1).clamp(-9.0, 5.0)).abs() < ROUNDING);
    }
    assert!(
        followed as f64 > 0.98 * rows.len() as f64,
        "{followed} of {} steps follow the law as described",
        rows.len()
    );
}

/// Laws that SUMO has, and the largest difference of its spacing \[m, root mean square\]: the ACC by rounding; Krauss' model, whose positions follow
/// by another speed of the step; Wiedemann 99, for which SUMO draws random numbers.
const LAWS_OF_SUMO: [(&str, f64); 3] = [("acc_milanes", ROUNDING), ("krauss", 0.5), ("w99", 1.0)];

#[test]
fn laws_that_sumo_has_drive_like_its_own() {
    if !sumo("laws_that_sumo_has_drive_like_its_own") {
        return;
    }
    for (law, tolerance) in LAWS_OF_SUMO {
        let folder = calibrated("run", law, &["--bounds", "human"]);
        let loss = &json(&["export", "sumo", text(&folder)])["loss"][0];
        let rms = loss["spacing_m"]["rms"].as_f64().expect("a number");
        println!("{law}: {rms} m");
        assert!(rms < tolerance, "{law}: {loss}");
        assert_eq!(loss["collision"], false, "{law}");
    }
}

#[test]
fn what_is_lost_is_measured_and_written() {
    if !sumo("what_is_lost_is_measured_and_written") {
        return;
    }
    let folder = calibrated("run", "idm+delay", &["--fix", "tau_p=0.5"]);
    let printed = ok(&["export", "sumo", text(&folder)]);
    assert!(printed.contains("not exported: the perception delay, tau_p = 0.5000 s"), "{printed}");
    assert!(printed.contains("NRMSE(s,v,a) against the measured car: leadlag "), "{printed}");
    let written = json_of(folder.join("sumo/loss.json"));
    let rms = written["loss"][0]["speed_mps"]["rms"].as_f64().unwrap();
    assert!((0.01..2.0).contains(&rms), "half a second of delay is worth {rms} m/s");
    assert!(folder.join("sumo/demand.rou.xml").exists() && folder.join("sumo/road.net.xml").exists());
    let page = report(&folder);
    assert!(page.contains("SUMO against leadlag") && page.contains("leadlag and SUMO behind the leader of"));
}
