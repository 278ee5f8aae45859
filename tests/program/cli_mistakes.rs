//! Mistakes on the command line, and their messages: the range, the nearest name, the file, the remedy.

use crate::common::program::{exits, json, leadlag, quick, refused, scratch, stderr, stdout, succeeds, synth, text};
use std::fs;
use std::path::{Path, PathBuf};

/// A file of one follower.
fn pair() -> PathBuf {
    synth(60).join("pair_follower1.csv")
}

/// Message of a failed calibration with these options.
fn calibrate(code: i32, extra: &[&str]) -> String {
    exits(code, &[&["calibrate", text(&pair()), "--out", "never"], extra].concat())
}

#[test]
fn a_number_out_of_its_range_is_told_the_range() {
    let idm = |extra: &[&str]| calibrate(2, &[&["--model", "idm"], extra].concat());
    let synth = |extra: &[&str]| exits(2, &[&["synth", "--out", "never"], extra].concat());
    for (message, expected) in [
        (idm(&["--lead-length", "-3"]), "'-3' for '--lead-length <M>': expected 0 to 30 m"),
        (idm(&["--max-gap", "-1"]), "expected 0 to 60 s"),
        (idm(&["--resample", "9"]), "expected 0.001 to 5 s"),
        (idm(&["--max-evaluations", "-5"]), "expected a whole number from 100 to 1000000000000"),
        (idm(&["--max-stall", "0"]), "expected a whole number from 1 to "),
        (idm(&["--replicates", "18446744073709551615"]), "expected a whole number from 1 to 100000"),
        (idm(&["--seed", "x"]), "expected a whole number from 0 to 18446744073709551615"),
        (idm(&["--segment", "-1"]), "expected a whole number from 1 to "),
        (idm(&["--threads", "-1"]), "expected a whole number from 1 to 1024"),
        (idm(&["--follower", "-1"]), "expected a number, 1 right behind the platoon leader"),
        (idm(&["--follower", "0"]), "followers count from 1"),
        (synth(&["--gap-noise", "-1"]), "expected 0 to 10 m"),
        (synth(&["--duration", "0"]), "expected 1 to 100000 s"),
        (synth(&["--effect", "grade:gg=9"]), "expected -0.3 to 1.3, found 9"),
        (synth(&["--effect", "grade:gg=1,gg=0.5"]), "gg of grade is given twice; leave one out"),
    ] {
        assert!(message.contains(expected), "expected {expected:?} in:\n{message}");
    }
}

#[test]
fn the_nearest_name_is_suggested_here_too() {
    for (message, expected) in [
        (exits(2, &["synth", "--out", "never", "--effect", "graed"]), "did you mean `grade`?"),
        (exits(2, &["synth", "--out", "never", "--effect", "actuation_lag:tau=1"]), "it has ta"),
        (exits(2, &["synth", "--out", "never", "--leader", "cruse"]), "no such file; did you mean `cruise`?"),
        (exits(2, &["demo", "--out", "never", "--hide", "graed"]), "did you mean `grade`?"),
        (calibrate(2, &["--model", "idm", "--optimizer", "cmae"]), "did you mean `cmaes`?"),
        (calibrate(2, &["--model", "idm", "--columns", "higd"]), "did you mean "),
    ] {
        assert!(message.contains(expected), "expected {expected:?} in:\n{message}");
    }
}

#[test]
fn a_variant_that_needs_a_vehicle_says_so_in_one_way() {
    for variant in ["idm+mfc", "idm+nonlinear"] {
        let expected = format!(
            "error: {}: variant {variant} needs the vehicle of follower 1, but no vehicle has the name `follower`; give --vehicle NAME \
             or FILE#NAME (`leadlag list vehicles`)\n",
            text(&pair())
        );
        assert_eq!(calibrate(2, &["--model", variant]), expected);
    }
}

#[test]
fn files_that_are_not_there_are_failures_and_what_they_say_is_usage() {
    for flag in ["--columns", "--bounds"] {
        let message = calibrate(1, &["--model", "idm", "--follower", "1", flag, "nowhere.toml"]);
        assert!(message.contains("nowhere.toml"), "{flag}: {message}");
    }
    refused(1, &["inspect", text(&scratch("cli_mistakes", "a_folder"))]).says("expected a file, found a folder");
    let message = exits(1, &["synth", "--out", "never", "--leader", "nowhere.csv"]);
    let first = message.lines().next().expect("a line");
    assert_eq!(first, "error: --leader nowhere.csv: cannot be read");

    let bounds = scratch("cli_mistakes", "bounds").join("b1.toml");
    for (content, expected) in [
        ("# mine\nv_0 = [40, 25]\n", ":2: v_0: the lower bound 40 is above the upper bound 25; swap them\n"),
        ("v_0 = [-1, 25]\n", ":1: v_0: expected a number above 0 and below 1e9 as both bounds, found [-1, 25]\n"),
        (
            "v_0 = [25,\n",
            ": expected bounds as TOML, such as v_0 = [25, 40]: TOML parse error at line 1, column 11\n  |\n1 | v_0 = [25,\n  \
             |           ^\nunclosed array, expected `]`\n",
        ),
    ] {
        fs::write(&bounds, content).expect("writable");
        let message = calibrate(2, &["--model", "idm", "--bounds", text(&bounds)]);
        assert_eq!(message, format!("error: {}{expected}", bounds.display()));
    }
}

#[test]
fn contradictions_are_refused() {
    let message = calibrate(2, &["--model", "idm", "--fix", "v_0=33", "--fix", "v_0=34"]);
    assert!(message.contains("--fix v_0 is given twice, as 33 and as 34"), "{message}");
    let bounds = scratch("cli_mistakes", "fixed").join("bounds.toml");
    for (content, says) in [("v_0 = 30\n", "30"), ("v_0 = [25, 32]\n", "[25, 32]")] {
        fs::write(&bounds, content).expect("writable");
        let message = calibrate(2, &["--model", "idm", "--bounds", text(&bounds), "--fix", "v_0=40"]);
        let expected = format!("error: --fix v_0=40 contradicts {}, which says v_0 = {says};", bounds.display());
        assert!(message.starts_with(&expected), "{message}");
        // Within its bounds it is one of them.
        let out = scratch("cli_mistakes", "narrowed");
        quick(&pair(), &out, &["--bounds", text(&bounds), "--fix", "v_0=30"]);
    }
    let synth = |extra: &[&str]| exits(2, &[&["synth", "--out", "never"], extra].concat());
    assert!(synth(&["--amplitude", "medium"]).contains("--effect"));
    let message = synth(&["--effect", "headway_mode_change", "--duration", "60"]);
    assert!(message.contains("begins at 300 s, and the drive ends at 60 s"), "{message}");
    assert!(message.contains("headway_mode_change:t0=24"), "{message}");
    let message = synth(&["--effect", "grade", "--effect", "grade:gg=1"]);
    assert!(message.contains("--effect grade is given twice"), "{message}");
    assert!(!Path::new("never").exists(), "a command that fails leaves no files");
}

#[test]
fn what_is_nearly_right_is_told_the_right_way() {
    let message = calibrate(2, &["--model", "idm", "--extend", "grade,actuation_lag"]);
    assert!(message.contains("several times: --extend grade --extend actuation_lag\n"), "{message}");
    let cases = scratch("cli_mistakes", "cases").join("cases.csv");
    fs::write(&cases, "model_id,platoon,follower_position\n").expect("writable");
    refused(1, &["evaluate", text(&cases), "--data", "nowhere"])
        .says("expected the folder of the platoon files, or one file; there is none");
    // An unknown follower is the same wrong usage in every command.
    let said = calibrate(2, &["--model", "idm", "--follower", "9"]);
    assert!(said.ends_with("followers with data: 1\n"), "{said}");
    assert_eq!(exits(2, &["diagnose", text(&pair()), "--base", "idm", "--follower", "9"]), said);
    refused(2, &["diagnose", text(&pair()), "--model", "idn"]).says("--base").says("did you mean `idm`?");
}

#[test]
fn a_bad_file_does_not_hide_the_good_ones() {
    let folder = scratch("cli_mistakes", "several");
    let bad = folder.join("bad.csv");
    fs::write(&bad, "a,b\n1,2\n").expect("writable");
    let output = leadlag(&["inspect", text(&bad), text(&pair()), "nowhere.csv"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).starts_with(text(&pair())), "{}", stdout(&output));
    let message = stderr(&output);
    assert!(message.contains("bad.csv:1: no known layout") && message.contains("nowhere.csv: expected"), "{message}");
    let output = leadlag(&["inspect", text(&pair()), text(&bad), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    assert_eq!(json.as_array().expect("several files were asked for").len(), 1);
}

#[test]
fn segments_are_listed_wherever_one_has_to_be_chosen() {
    let folder = scratch("cli_mistakes", "hole");
    let file = folder.join("hole.csv");
    let whole = fs::read_to_string(pair()).expect("a table");
    // 6 s are missing after 20 s.
    let kept = whole.lines().enumerate().filter(|(i, _)| !(202..261).contains(i)).map(|(_, line)| line);
    fs::write(&file, kept.collect::<Vec<_>>().join("\n") + "\n").expect("writable");
    let (first, second) = ("1 (0.0 to 20.0 s, 201 samples)", "2 (26.0 to 60.0 s, 341 samples)");
    let shown = stdout(&succeeds(&["inspect", text(&file)]));
    assert!(shown.contains(&format!("is number {second}")), "{shown}");
    let json = json(&["inspect", text(&file), "--json"]);
    let segments = json["platoons"][0]["followers"][0]["segments"].as_array().expect("segments");
    assert_eq!(segments.len(), 2);
    assert_eq!((&segments[1]["number"], &segments[1]["samples"]), (&2.into(), &341.into()));
    let arguments = ["calibrate", text(&file), "--model", "idm", "--segment", "3", "--out", "never"];
    refused(2, &arguments).says(&format!("there are 2 segments: {second}, {first}"));
    let output = quick(&file, &folder.join("fit"), &[]);
    let warning = "2 segments, of which only the longest, number 2, is used; the longest are 2 (26.0";
    assert!(stderr(&output).contains(warning), "{}", stderr(&output));
}

#[test]
fn simulate_takes_the_folder_and_counts_the_results() {
    let out = scratch("cli_mistakes", "fit");
    let search = ["--model", "l-cth", "--max-evaluations", "100", "--no-intervals", "--out", text(&out)];
    succeeds(&[&["calibrate", text(&pair())][..], &search].concat());
    succeeds(&["simulate", text(&pair()), "--result", text(&out)]);
    let two = ["--result", text(&out), "--result", text(&out)];
    refused(2, &[&["simulate", text(&pair()), "--platoon"][..], &two].concat())
        .says("--result is given 2 times; expected one, because ")
        .says("has 1 follower");
    refused(2, &[&["simulate", text(&pair())][..], &two].concat()).says("--platoon simulates all");
}

#[test]
fn what_every_verb_takes_comes_last_in_its_help() {
    for verb in ["calibrate", "synth", "diagnose"] {
        let help = stdout(&succeeds(&[verb, "--help"]));
        let (own, global) = help.split_once("\nGlobal options:\n").expect("a heading");
        assert!(!own.contains("--threads") && !own.contains("--quiet"), "{verb}: {own}");
        let headings = global.lines().filter(|line| line.ends_with(':') && !line.starts_with(' '));
        assert_eq!(headings.collect::<Vec<_>>(), ["Examples:"], "{verb}: {global}");
    }
    let help = stdout(&succeeds(&["calibrate", "--help"]));
    let words: Vec<&str> = help.split_whitespace().collect();
    assert!(words.join(" ").contains("at least 100 [default: 300000"), "{help}");
}
