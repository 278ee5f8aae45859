//! What people are shown: the demo, which sees files only and says honestly whether it found what had been hidden; pages and text charts.

mod common;

use common::program::{leadlag, ok, scratch, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Seconds that are long enough for most causes, and short enough for a test.
const SHORT: u32 = 240;
/// Seconds that show both settings of the gap on the two thirds that are trained on.
const LONG: u32 = 600;

fn demo(hide: &str, seconds: u32) -> (String, PathBuf) {
    let name: String = hide.chars().take_while(|c| *c != ':').collect();
    let folder = scratch("report", &name);
    let said = ok(&["demo", "--hide", hide, "--seed", "1", "--duration", &seconds.to_string(), "--out", text(&folder)]);
    (said, folder)
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("written")).expect("JSON")
}

/// The last lines agree with the files, and the report carries the diagnosis.
fn check_ending(said: &str, folder: &Path) -> Value {
    let ending = said.split("== What was found, and what had been hidden").nth(1).expect("an ending");
    for words in [
        "found ",
        "hidden ",
        "so ",
        "report.html",
        "$ leadlag inspect FILE.csv",
        "$ leadlag diagnose --data FILE.csv",
        "--lead-start POSITION: ",
    ] {
        assert!(ending.contains(words), "{words}: {said}");
    }
    let diagnosis = json(&folder.join("diagnosis").join("diagnosis.json"));
    let page = fs::read_to_string(folder.join("report.html")).expect("written");
    let reason = diagnosis["reason"].as_str().expect("a sentence");
    assert!(page.contains(&reason.replace('<', "&lt;").replace('>', "&gt;")) && page.len() < 5_000_000, "{reason}");
    // Each command that was shown is one that can be typed: it names the files of this folder, which are there.
    for line in said.lines().filter(|line| line.starts_with("$ leadlag ") && line.contains(" > ")) {
        let log = line.rsplit(" > ").next().expect("a file");
        assert!(Path::new(log).exists(), "{line}");
    }
    diagnosis
}

fn found(hide: &str, seconds: u32) {
    let (said, folder) = demo(hide, seconds);
    let diagnosis = check_ending(&said, &folder);
    let name: String = hide.chars().take_while(|c| *c != ':').collect();
    assert_eq!(diagnosis["verdict"], "named", "{said}");
    assert_eq!(diagnosis["causes"][0]["name"], name.as_str(), "{said}");
    assert!(said.contains("so      right, "), "{said}");
    // What the analysis was given tells nothing of what is hidden; only truth.json does, which no command names.
    let truth = fs::read_to_string(folder.join("truth.json")).expect("written");
    assert!(truth.contains(&name) && !said.contains("truth.json"), "{said}");
    for file in ["platoon.csv", "Slope.csv"] {
        assert!(!fs::read_to_string(folder.join(file)).expect("written").contains(&name), "{file}");
    }
    // The extended model was calibrated on the same stretch, and both were tried on the rest.
    let [base, extended] = ["base", "extended"].map(|model| {
        let result = json(&folder.join(model).join("result.json"));
        let run = json(&folder.join(format!("{model}_held_back.json")));
        let (trained, held) = (&result["data"][0]["window_s"], run["runs"][0]["preparation"].to_string());
        assert_eq!(
            (trained[0].as_f64(), trained[1].as_f64()),
            (Some(0.0), Some(f64::from(seconds * 2 / 3))),
            "{trained}"
        );
        assert!(held.contains(&(seconds * 2 / 3).to_string()), "{held}");
        (result, run["runs"][0]["score"]["nrmse_sva"].as_f64().expect("a score"))
    });
    assert_eq!(extended.0["extensions"][0]["name"], name.as_str());
    assert!(base.0["extensions"].as_array().is_some_and(Vec::is_empty));
    assert!(extended.1 < base.1, "on what was held back: base {}, extended {}", base.1, extended.1);
    go_on(&folder, &diagnosis, &base.0["data"][0]["window_s"]);
}

/// The command that the diagnosis ends with can be pasted into a shell, and calibrates on what was trained on.
fn go_on(folder: &Path, diagnosis: &Value, trained: &Value) {
    let said = fs::read_to_string(folder.join("diagnosis.txt")).expect("kept");
    let flat: Vec<&str> = said.split_whitespace().collect();
    assert!(flat.join(" ").contains(" s, held back from there to "), "{said}");
    let (_, rest) = said.split_once("\nTo calibrate it on what was trained on, ").expect("a way to go on");
    let (_, rest) = rest.split_once(":\n  leadlag ").expect("a command");
    let typed: Vec<&str> =
        rest.split_inclusive('\n').take_while(|line| line.starts_with("    ") || rest.starts_with(line)).collect();
    let command = format!(
        "'{}' {} --max-evaluations 200 --no-intervals",
        env!("CARGO_BIN_EXE_leadlag"),
        typed.concat().trim_end()
    );
    let output = Command::new("sh").args(["-c", &command]).output().expect("a shell");
    assert!(output.status.success(), "{command}\n{}", String::from_utf8_lossy(&output.stderr));
    let warned = String::from_utf8_lossy(&output.stderr);
    assert!(!warned.contains("changes nothing: variant idm+grade"), "{warned}");
    let result = json(&folder.join("diagnosis").join("extended").join("result.json"));
    assert_eq!((&result["data"][0]["window_s"], result["data"][0]["follower"].as_u64()), (trained, Some(1)));
    let names = |list: &Value| -> Vec<String> {
        list.as_array().expect("a list").iter().map(|one| one["name"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!(names(&result["extensions"]), names(&diagnosis["causes"]));
    if result["extensions"][0]["name"] == "grade" {
        let table = result["data"][0]["grade"]["path"].as_str().expect("a table of the slope");
        assert!(table.ends_with("Slope.csv"), "{table}");
    }
}

#[test]
fn a_slope_that_is_not_made_up_for_is_found() {
    found("grade:gg=0.8", SHORT);
}

#[test]
fn another_gap_setting_is_found() {
    found("headway_mode_change", LONG);
}

#[test]
fn a_weak_engine_is_found() {
    found("accel_cap", SHORT);
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let (said, folder) = demo("none", SHORT);
    let diagnosis = check_ending(&said, &folder);
    assert_eq!(diagnosis["verdict"], "nothing", "{said}");
    assert!(said.contains("so      right: nothing was hidden, and nothing is named"), "{said}");
    assert!(!folder.join("extended").exists() && !said.contains("--extend"), "nothing to extend by");
}

#[test]
fn a_calibration_is_shown_in_the_terminal_and_as_a_page() {
    let drive = scratch("report", "drive");
    ok(&["synth", "--out", text(&drive), "--duration", "150"]);
    let (folder, file) = (drive.join("fit"), drive.join("platoon.csv"));
    let result = folder.join("result.json");
    let calibrate = ["calibrate", text(&file), "--follower", "1", "--model", "l-cth", "--max-evaluations", "1000"];
    ok(&[&calibrate[..], &["--out", text(&folder)]].concat());
    let simulate = ["simulate", text(&file), "--follower", "1", "--result", text(&result)];
    let plain = ok(&simulate);
    let drawn = ok(&[&simulate[..], &["--plot"]].concat());
    let charts = drawn.strip_prefix(&plain).expect("the charts come last");
    for words in ["spacing s [m]  . measured  x simulated", "speed v [m/s]", "150 s"] {
        assert!(charts.contains(words), "{words}: {charts}");
    }
    // Into a file: 80 columns, no colours.
    assert!(charts.lines().all(|line| line.chars().count() <= 80) && !charts.contains('\x1b'), "{charts}");
    let output = leadlag(&[&simulate[..], &["--plot", "--json"]].concat());
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));

    let page = folder.join("page.html");
    ok(&["report", text(&folder), "-o", text(&page)]);
    let html = fs::read_to_string(&page).expect("written");
    let carried = html.split("id=\"result\">").nth(1).and_then(|rest| rest.split("</script>").next()).expect("a twin");
    let written = fs::read_to_string(&result).expect("written");
    assert_eq!(carried.replace("\\u003c", "<"), written);
    for words in
        ["Error by what the car is doing", "Error by frequency", "Residuals over speed", "class=\"number share\""]
    {
        assert!(html.contains(words), "{words}");
    }
    // The budget's shares of the time are those of the file: how long the measured car stands.
    let simulation = fs::read_to_string(folder.join("simulation.csv")).expect("written");
    let first =
        serde_json::from_str::<Value>(&written).expect("JSON")["data"][0]["first_scored"].as_u64().expect("a number");
    let speeds: Vec<f64> = simulation
        .lines()
        .skip(1 + first as usize)
        .map(|line| line.split(',').nth(3).and_then(|v| v.parse().ok()).expect("a speed"))
        .collect();
    let standing = speeds.iter().filter(|v| **v < 0.5).count() as f64 / speeds.len() as f64;
    assert!(html.contains(&format!(
        "<td>standstill</td><td class=\"number share\" style=\"--share:{:.1}%\">",
        100.0 * standing
    )));
}
