//! `leadlag diagnose` as a program: its JSON, its text, its files, its exit codes.

use crate::common::program::{edited, fails, json, leadlag, ok, refused, scale, scratch};
use leadlag::internal::optimize::{normal, stream};
use leadlag::internal::result::diagnosis::Outcome;
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The first follower of a synthetic drive as a pair file.
fn pair(folder: &Path, seed: u64, seconds: u64, more: &[&str]) -> String {
    let drive = folder.join(format!("drive{seed}"));
    let (seed, seconds, out) = (seed.to_string(), seconds.to_string(), drive.to_str().expect("UTF-8").to_owned());
    let mut arguments = vec!["synth", "--out", &out, "--seed", &seed, "--duration", &seconds, "--pairs"];
    arguments.extend(more);
    ok(&arguments);
    drive.join("pair_follower1.csv").to_str().expect("UTF-8").to_owned()
}

/// The same file with the leader's speeds multiplied.
fn scaled(path: &str, factor: f64) -> String {
    scaled_in(path, &[1], factor)
}

/// The same file with these columns multiplied.
fn scaled_in(path: &str, columns: &[usize], factor: f64) -> String {
    let text = fs::read_to_string(path).expect("written");
    let changed = edited(&text, |_, fields| columns.iter().for_each(|column| scale(&mut fields[*column], factor)));
    let to = path.replace(".csv", "_scaled.csv");
    fs::write(&to, changed).expect("writable");
    to
}

/// An IDM driver who compensates for this share of the slopes, behind his leader, with positions and without the grade.
fn on_slopes(folder: &Path, seed: u64, compensated: f64) -> String {
    let mut rng = stream(seed, 0, 0, 0);
    let mut table = "time_s,lead_speed_mps,speed_mps,spacing_m,lead_position_m\n".to_owned();
    let (mut v_l, mut v, mut s, mut x, mut gusts) = (15.0, 15.0, 26.0, 40.0 * seed as f64, 0.0);
    for k in 0..3000 {
        let t = f64::from(k) * 0.1;
        let [seen_l, seen, gap] = [v_l, v, s].map(|x| x + 0.02 * normal(&mut rng));
        writeln!(table, "{t:.1},{:.3},{:.3},{gap:.3},{:.2}", seen_l.max(0.0), seen.max(0.0), x + s)
            .expect("a String takes all");
        gusts = 0.93 * gusts + 0.02 * normal(&mut rng);
        let slope = 0.03 * (x / 250.0).sin() + 0.02 * (x / 97.0 + 1.0).sin() + 0.015 * (x / 170.0 + 2.0).cos();
        let wanted = 2.5 + (1.3 * v + v * (v - v_l) / (2.0 * 1.4_f64.sqrt() * 1.5_f64.sqrt())).max(0.0);
        let a =
            1.4 * (1.0 - (v / 33.0_f64).powi(4) - (wanted / s).powi(2)) + gusts - (1.0 - compensated) * 9.81 * slope;
        let ahead = 15.0 + 5.0 * (t / 11.0 + 2.0 * seed as f64).sin() + 3.0 * (t / 4.7 + seed as f64).cos();
        let next_l: f64 = v_l + 0.1 * (ahead - v_l).clamp(-2.0, 1.5);
        let next = (v + 0.1 * a).max(0.0);
        s += 0.05 * (v_l + next_l - v - next);
        x += 0.05 * (v + next);
        (v_l, v) = (next_l, next);
    }
    let path = folder.join(format!("slopes{seed}.csv"));
    fs::write(&path, table).expect("room");
    path.to_str().expect("UTF-8").to_owned()
}

#[test]
fn errors_that_repeat_by_place_are_told_first() {
    let folder = scratch("diagnose_cli", "by_place");
    let first = |paths: &[String]| {
        let said = ok(&["diagnose", "--data", &paths.join(","), "--base", "idm", "--effort", "quick"]);
        said.split("\n\n").next().expect("a paragraph").replace("\n  ", " ")
    };
    let hidden = [1, 2, 3].map(|seed| on_slopes(&folder, seed, 0.5));
    let said = first(&hidden);
    assert!(said.contains("repeats at the same places of the road in other drives (correlation 0."), "{said}");
    assert!(said.contains("as on slopes: give the grade of the road (--grade)"), "{said}");
    assert!(said.contains("Not tried: ") && said.contains("grade (needs the road grade)"), "{said}");
    let said = first(&[4, 5].map(|seed| on_slopes(&folder, seed, 1.0)));
    assert!(!said.contains("same places"), "{said}");
    // Without positions nothing is known about places.
    for path in &hidden {
        let text = fs::read_to_string(path).expect("written");
        let without = text.lines().map(|line| line.rsplit_once(',').expect("five columns").0.to_owned() + "\n");
        fs::write(path, without.collect::<String>()).expect("writable");
    }
    let said = first(&hidden[..2]);
    assert!(said.contains("grade (needs the road grade)") && !said.contains("same places"), "{said}");
}

/// A drive with the grade of its road, but without positions: how far it has come is no place. One drive alone does not show what belongs
/// to a place, even with positions.
#[test]
fn without_positions_nothing_depends_on_the_place() {
    let folder = scratch("diagnose_cli", "no_place");
    let placed = pair(&folder, 3, 200, &["--base", "idm", "--effect", "grade:gg=0.6"]);
    let text = fs::read_to_string(&placed).expect("written");
    let columns = |line: &str| line.split(',').take(5).collect::<Vec<_>>().join(",") + "\n";
    let without = folder.join("without.csv");
    fs::write(&without, text.lines().map(columns).collect::<String>()).expect("room");
    for (path, is_placed) in [(placed.as_str(), true), (without.to_str().expect("UTF-8"), false)] {
        let given = ["diagnose", path, "--base", "idm", "--effort", "quick"];
        let found = json(&[&given[..], &["--json"]].concat());
        let profiles = found["missing"]["profiles"].as_array().expect("a list");
        let has = |name: &str| profiles.iter().any(|profile| profile["name"] == name);
        assert!(has("sine of the grade") && has("place") == is_placed, "{path}: {profiles:?}");
        let said = ok(&given);
        assert!(said.lines().count() <= 60, "{said}");
        let said = said.replace("\n  ", " ");
        assert!(said.contains("sine of the grade (") && !said.contains(", place ("), "{said}");
    }
}

#[test]
fn the_data_alone_can_be_checked() {
    let folder = scratch("diagnose_cli", "data_only");
    let clean = pair(&folder, 1, 300, &[]);
    let text = ok(&["diagnose", "--data", &clean, "--data-only"]);
    assert!(text.contains("No contradictions were found."), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80 || line.contains(&clean[..40])), "{text}");
    let faulty = scaled(&clean, 1.03);
    let both = format!("{clean},{faulty}");
    let json = json(&["diagnose", "--data", &both, "--data-only", "--json"]);
    let findings = json["data_findings"].as_array().expect("a list");
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert_eq!((findings[0]["name"].as_str(), findings[0]["car"].as_str()), (Some("speed_scale"), Some("leader")));
    let value = findings[0]["value"].as_f64().expect("a number");
    assert!((value - 0.03).abs() < 0.002, "{value}");
    assert_eq!(findings[0]["file"].as_str(), Some(faulty.as_str()));
    let corrected = ok(&["diagnose", "--data", &faulty, "--data-only", "--correct"]);
    assert!(corrected.split_whitespace().any(|word| word == "done:"), "{corrected}");
}

#[test]
fn units_that_contradict_each_other_are_told_before_any_size() {
    let folder = scratch("diagnose_cli", "units");
    let clean = pair(&folder, 1, 300, &["--leader", "stop-and-go"]);
    // Speeds in km/h, and a gap in feet.
    for (columns, factor) in [(&[1, 2][..], 3.6), (&[3], 1.0 / 0.3048)] {
        let faulty = scaled_in(&clean, columns, factor);
        let output = leadlag(&["diagnose", &faulty, "--data-only", "--exit-code"]);
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        assert_eq!(output.status.code(), Some(7), "{text}");
        let (units, sizes) = (text.find("UNITS: spacing_m: changes"), text.find("SPEED_SCALE"));
        // A wrong unit explains every wrong size.
        assert!(units.is_some() && sizes.is_none(), "{text}");
        let text = ok(&["diagnose", &faulty, "--base", "idm", "--effort", "quick"]);
        let (first, verdict) = (text.find("THE DATA FIRST. The units"), text.find("Tentative verdict: "));
        assert!(first.is_some() && first < verdict, "{text}");
    }
}

#[test]
fn files_are_taken_as_arguments_as_by_every_other_verb() {
    let folder = scratch("diagnose_cli", "arguments");
    let [one, two] = [1, 2].map(|seed| pair(&folder, seed, 120, &[]));
    let by_flag = ok(&["diagnose", "--data", &format!("{one},{two}"), "--data-only"]);
    assert_eq!(ok(&["diagnose", &one, &two, "--data-only"]), by_flag);
    assert_eq!(ok(&["diagnose", "--data", &one, &two, "--data-only"]), by_flag);
    assert!(!by_flag.contains("held back"), "a check of the data holds nothing back: {by_flag}");
    refused(2, &["diagnose", "--base", "idm"]).says("<FILE>");
    let help = ok(&["diagnose", "--help"]);
    assert!(help.contains("--base <NAME|ID> <FILE>...") && help.contains("--data-only <FILE>..."), "{help}");
    let faulty = scaled(&one, 1.03);
    let said = ok(&["diagnose", &faulty, "--data-only"]);
    assert!(said.contains("The data are unchanged. --correct repairs these faults where possible."), "{said}");
}

#[test]
fn wrong_usage_is_said() {
    let folder = scratch("diagnose_cli", "usage");
    let file = pair(&folder, 2, 120, &[]);
    refused(2, &["diagnose", "--data", &file]).says("--base");
    refused(2, &["diagnose", "--data", &file, "--base", "l-cht"]).says("l-cth");
    refused(1, &["diagnose", "--data", "none.csv", "--base", "idm"]).says("none.csv");
    let (code, message) = fails(&["diagnose", "--data", &file, "--follower", "3", "--data-only"]);
    assert!(code != 0 && message.contains("follower 3"), "{message}");
    refused(2, &["diagnose", "--data", &file, "--holdout", &file, "--base", "idm"]).says("also given for training");
    refused(2, &["diagnose", "--data", &file, "--data-only", "--out", "nowhere"]).says("--data-only");
    let own = folder.join("mine.wgsl");
    fs::write(&own, "fn nothing() {}\n").expect("writable");
    let own = own.to_str().expect("UTF-8");
    let (code, message) = fails(&["diagnose", "--data", &file, "--base", "idm", "--causes", own]);
    assert!(code != 0 && message.contains("mine.wgsl"), "{message}");
}

/// The diagnosis finds the hidden effect in one drive of `synth`. Sensors accurate to millimetres make the likelihood rugged, and a base
/// explains a change this large by a missing acceleration of 0.2 m/s² over minutes. Searches from there alone miss each of these effects.
#[test]
fn large_effects_are_found_with_precise_sensors() {
    let folder = scratch("diagnose_cli", "precise");
    let value = |base: &str, seed: u64, seconds: u64, effect: &str, parameter: &str| -> f64 {
        let file = pair(&folder, seed, seconds, &["--base", base, "--effect", effect]);
        let arguments = ["diagnose", "--data", &file, "--base", base, "--effort", "quick", "--json"];
        let json = json(&arguments);
        let (verdict, cause) = (&json["verdict"], &json["causes"][0]);
        assert_eq!((verdict.as_str(), json["causes"].as_array().map(Vec::len)), (Some("named"), Some(1)), "{json}");
        assert!(effect.starts_with(cause["name"].as_str().expect("a name")), "{cause}");
        let parameters = cause["parameters"].as_array().expect("a list");
        let own = parameters.iter().find(|p| p["name"] == parameter).expect("its parameter");
        // The gain on unseen drives says nothing about a change that occurs once.
        let gain = if json["recommended"].is_null() { &json["gain"] } else { &json["recommended"]["gain"] };
        let gains = gain["interval"][0].as_f64().map(|low| low > 0.0);
        assert_eq!(gains, (parameter != "r").then_some(true), "{gain}");
        own["value"].as_f64().expect("a number")
    };
    let r = value("l-cth", 23, 300, "headway_mode_change:r=0.3,t0=120", "r");
    assert!((r - 0.3).abs() < 0.003, "{r}");
    let w = value("gipps", 12, 600, "dead_zone:w=1.34", "w");
    assert!((w - 1.34).abs() < 0.013, "{w}");
}

/// An IDM car with Gipps' law as the base: no cause passes, and the verdict still reports that Gipps' law is not enough.
#[test]
fn a_car_of_another_law_is_not_called_nothing() {
    let folder = scratch("diagnose_cli", "other_law");
    let noise = ["--base", "idm", "--leader", "restless", "--gap-noise", "0.02", "--speed-noise", "0.02"];
    let file = pair(&folder, 3, 300, &noise);
    for (base, verdict) in [("gipps", "unexplained"), ("idm", "nothing")] {
        let text = ok(&["diagnose", "--data", &file, "--base", base, "--effort", "quick", "--json"]);
        let json: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(json["verdict"], verdict, "{base}: {}", json["reason"]);
        let named =
            json["left_over"].as_array().expect("a list").iter().any(|l| l["kind"] == "family" && l["where"] == "idm");
        assert_eq!(named, base == "gipps", "{base}: {}", json["left_over"]);
    }
}

#[test]
fn a_diagnosis_has_the_fields_of_its_contract() {
    let folder = scratch("diagnose_cli", "whole");
    let file =
        pair(&folder, 3, 300, &["--effect", "actuation_lag:ta=0.8", "--gap-noise", "0.02", "--speed-noise", "0.02"]);
    let out = folder.join("out");
    let out = out.to_str().expect("UTF-8");
    let arguments =
        ["diagnose", "--data", &file, "--base", "idm", "--effort", "quick", "--json", "--exit-code", "--out", out];
    let output = leadlag(&arguments);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let json: Value = serde_json::from_str(&text).expect("JSON");
    let keys: Vec<&str> = json.as_object().expect("an object").keys().map(String::as_str).collect();
    let contract = [
        "schema_version",
        "verdict",
        "reason",
        "causes",
        "confounded_with",
        "not_testable",
        "data_findings",
        "gain",
        "recommended",
        "base_laws",
        "base_notes",
        "left_over",
        "simulations",
    ];
    assert_eq!(&keys[..contract.len()], contract);
    let verdict = json["verdict"].as_str().expect("a word");
    let codes = [("named", 0), ("nothing", 3), ("ambiguous", 4), ("unexplained", 5), ("not_testable", 6)];
    let code = codes.iter().find(|(name, _)| *name == verdict).expect("a verdict of the contract").1;
    assert_eq!(output.status.code(), Some(code));
    // A lag of 0.8 s is found, alone or with an equally likely relative.
    let causes = json["causes"].as_array().expect("a list");
    assert!(["named", "ambiguous"].contains(&verdict) && !causes.is_empty(), "{verdict}: {causes:?}");
    for cause in causes {
        for key in ["name", "family", "parameters", "evidence", "threshold", "threshold_kind"] {
            assert!(!cause[key].is_null(), "{key} of {cause}");
        }
    }
    // The score of the base on left-out data is printed with any verdict.
    let held = json["base_held_back"].as_array().expect("a list");
    assert!(held.len() == 1 && held[0]["nrmse_sva"].as_f64().is_some_and(|nrmse| nrmse > 0.0), "{held:?}");
    assert_eq!(held[0]["rms"].as_array().map(Vec::len), Some(3));
    assert!(json["held_back"].as_str().is_some_and(|text| text.contains("last third of each file")));
    assert_eq!(fs::read_to_string(Path::new(out).join("diagnosis.json")).expect("written"), text);
    // Reading returns everything that was written.
    let outcome: Outcome = serde_json::from_str(&text).expect("as written");
    assert_eq!(serde_json::to_value(&outcome).expect("finite numbers"), json);
    let table = fs::read_to_string(Path::new(out).join("missing_acceleration_1.csv")).expect("written");
    assert!(table.starts_with("time_s,missing_accel_mps2,missing_accel_sd_mps2") && table.lines().count() > 1900);
    for name in ["simulation_1.svg", "simulation_2.svg", "missing_acceleration.svg", "race.svg"] {
        assert!(fs::read_to_string(Path::new(out).join(name)).expect(name).contains("</svg>"), "{name}");
    }
    // The report needs no other file and contains the whole result.
    let page = Path::new(out).join("report.html");
    ok(&["report", out, "-o", page.to_str().expect("UTF-8")]);
    let html = fs::read_to_string(page).expect("written");
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "<link rel=\"stylesheet"] {
        assert!(!html.contains(outside), "{outside}");
    }
    let embedded = |id: &str| {
        let start = html.find(&format!("id=\"{id}\">")).expect("a script") + id.len() + 6;
        let end = start + html[start..].find("</script>").expect("its end");
        serde_json::from_str::<Value>(&html[start..end]).expect("JSON")
    };
    assert_eq!(embedded("result"), json);
    let charts = embedded("charts");
    assert_eq!(charts.as_array().map(Vec::len), Some(2));
    assert_eq!(charts[0]["panels"].as_array().map(Vec::len), Some(4));
    assert!(html.len() < 5_000_000 && html.contains("MIT License"), "{} bytes", html.len());
    // The same bytes for the same seed, whatever the number of threads.
    let again =
        leadlag(&["--threads", "1", "diagnose", "--data", &file, "--base", "idm", "--effort", "quick", "--json"]);
    assert_eq!(String::from_utf8(again.stdout).expect("UTF-8"), text);
}

/// The folder of a diagnosis is a result: its recommended model runs on other drives, and a diagnosis without one is refused.
#[test]
fn a_recommended_model_can_be_simulated() {
    let folder = scratch("diagnose_cli", "recommended");
    let noise = ["--base", "l-cth", "--gap-noise", "0.02", "--speed-noise", "0.02"];
    let late = pair(&folder, 3, 600, &[&noise[..], &["--effect", "actuation_lag:ta=0.8"]].concat());
    let out = folder.join("out");
    let out = out.to_str().expect("UTF-8");
    let found = json(&["diagnose", &late, "--base", "l-cth", "--effort", "quick", "--json", "--out", out]);
    let recommended = &found["recommended"];
    assert_eq!(recommended["causes"][0]["name"], "actuation_lag", "{recommended}");
    assert_eq!(recommended["safe"], true, "{recommended}");
    let ta = recommended["parameters"]["ta"].as_f64().expect("a number");
    assert!((ta - 0.8).abs() < 0.03, "{ta}");
    // Fitted to the whole drive, it is at least as good there as where its fits left parts out.
    let run = json(&["simulate", &late, "--result", out, "--json"]);
    let score = run["runs"][0]["score"]["nrmse_sva"].as_f64().expect("a score");
    let left_out = recommended["per_drive"][0]["extended"].as_f64().expect("a score");
    assert!(score <= 1.02 * left_out, "{score} {left_out}");
    let short = pair(&folder, 4, 120, &noise);
    let nothing = folder.join("nothing");
    let nothing = nothing.to_str().expect("UTF-8");
    ok(&["diagnose", &short, "--base", "l-cth", "--effort", "quick", "--out", nothing]);
    refused(2, &["simulate", &short, "--result", nothing]).says("this diagnosis recommends no model");
}
