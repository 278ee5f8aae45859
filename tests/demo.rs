//! The demo: it sees files only, and says honestly whether it found what had been hidden.

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Long enough for each of the causes below, and short enough for a test.
const SECONDS: &str = "240";

fn demo(hide: &str) -> (String, PathBuf) {
    let name: String = hide.chars().take_while(|c| *c != ':').collect();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("demo").join(name);
    let _ = fs::remove_dir_all(&folder);
    let out = folder.to_str().expect("UTF-8");
    let arguments = ["demo", "--hide", hide, "--seed", "1", "--duration", SECONDS, "--out", out];
    let output = Command::new(env!("CARGO_BIN_EXE_leadlag")).args(arguments).output().expect("the program starts");
    assert!(output.status.success(), "{hide}\n{}", String::from_utf8_lossy(&output.stderr));
    (String::from_utf8(output.stdout).expect("UTF-8"), folder)
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("written")).expect("JSON")
}

/// The last lines agree with the files, and the report carries the diagnosis.
fn check_ending(text: &str, folder: &Path) -> Value {
    let ending = text.split("== What was found, and what had been hidden").nth(1).expect("an ending");
    for words in ["found ", "hidden ", "so ", "report.html", "$ leadlag inspect FILE.csv", "$ leadlag diagnose --data FILE.csv"] {
        assert!(ending.contains(words), "{words}: {text}");
    }
    let diagnosis = json(&folder.join("diagnosis").join("diagnosis.json"));
    let page = fs::read_to_string(folder.join("report.html")).expect("written");
    let reason = diagnosis["reason"].as_str().expect("a sentence");
    assert!(page.contains(&reason.replace('<', "&lt;").replace('>', "&gt;")) && page.len() < 5_000_000, "{reason}");
    // Each command that was shown is one that can be typed: it names the files of this folder, which are there.
    for line in text.lines().filter(|line| line.starts_with("$ leadlag ") && line.contains(" > ")) {
        let log = line.rsplit(" > ").next().expect("a file");
        assert!(Path::new(log).exists(), "{line}");
    }
    diagnosis
}

fn found(hide: &str) {
    let (text, folder) = demo(hide);
    let diagnosis = check_ending(&text, &folder);
    let name: String = hide.chars().take_while(|c| *c != ':').collect();
    assert_eq!(diagnosis["verdict"], "named", "{text}");
    assert_eq!(diagnosis["causes"][0]["name"], name.as_str(), "{text}");
    assert!(text.contains("so      right, "), "{text}");
    // What the analysis was given tells nothing of what is hidden; only truth.json does, which no command names.
    let truth = fs::read_to_string(folder.join("truth.json")).expect("written");
    assert!(truth.contains(&name) && !text.contains("truth.json"), "{text}");
    for file in ["platoon.csv", "Slope.csv"] {
        assert!(!fs::read_to_string(folder.join(file)).expect("written").contains(&name), "{file}");
    }
    // The extended model was calibrated on the same stretch, and both were tried on the rest.
    let [base, extended] = ["base", "extended"].map(|model| {
        let result = json(&folder.join(model).join("result.json"));
        let run = json(&folder.join(format!("{model}_held_back.json")));
        let (trained, held) = (&result["data"][0]["window_s"], run["runs"][0]["preparation"].to_string());
        assert_eq!((trained[0].as_f64(), trained[1].as_f64()), (Some(0.0), Some(160.0)), "{trained}");
        assert!(held.contains("160"), "{held}");
        (result, run["runs"][0]["score"]["nrmse_sva"].as_f64().expect("a score"))
    });
    assert_eq!(extended.0["extensions"][0]["name"], name.as_str());
    assert!(base.0["extensions"].as_array().is_some_and(Vec::is_empty));
    assert!(extended.1 < base.1, "on what was held back: base {}, extended {}", base.1, extended.1);
}

#[test]
fn a_slope_that_is_not_made_up_for_is_found() {
    found("grade:gg=0.8");
}

#[test]
fn another_gap_setting_is_found() {
    found("headway_mode_change:r=0.3");
}

#[test]
fn a_weak_engine_is_found() {
    found("accel_cap");
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let (text, folder) = demo("none");
    let diagnosis = check_ending(&text, &folder);
    assert_eq!(diagnosis["verdict"], "nothing", "{text}");
    assert!(text.contains("so      right: nothing was hidden, and nothing is named"), "{text}");
    assert!(!folder.join("extended").exists() && !text.contains("--extend"), "nothing to extend by");
}
