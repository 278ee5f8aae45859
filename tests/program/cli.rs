//! The command line: exit codes, streams, machine-readable output, files, the same bytes for the same seed.
//!
//! Everything runs on a synthetic platoon that the program makes itself.

use crate::common::program::{
    edited, fails, json, json_of, leadlag, ok, refused, scratch, stderr, stdout, succeeds, synth, text,
};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

fn platoon() -> PathBuf {
    synth(150)
}

fn calibrated(name: &str, extra: &[&str]) -> PathBuf {
    let (folder, file) = (scratch("cli", name), platoon().join("platoon.csv"));
    let mut arguments = vec!["calibrate", text(&file), "--follower", "1", "--model", "l-cth", "--out", text(&folder)];
    arguments.extend(["--max-evaluations", "1000"]);
    arguments.extend(extra);
    ok(&arguments);
    folder
}

#[test]
fn same_seed_same_bytes_on_one_and_two_threads() {
    let one = calibrated("threads1", &["--threads", "1", "--replicates", "2"]);
    let two = calibrated("threads2", &["--threads", "2", "--replicates", "2"]);
    for file in ["result.json", "simulation.csv", "plot.svg"] {
        assert_eq!(fs::read(one.join(file)).unwrap(), fs::read(two.join(file)).unwrap(), "{file}");
    }
    let other = calibrated("seed2", &["--seed", "2"]);
    assert_ne!(fs::read(one.join("result.json")).unwrap(), fs::read(other.join("result.json")).unwrap());
}

#[test]
fn result_has_every_key_of_the_contract() {
    let folder = calibrated("keys", &["--replicates", "2", "--optimizer", "ga"]);
    let result = json_of(folder.join("result.json"));
    for key in [
        "schema_version",
        "model_id",
        "variant",
        "convention",
        "extensions",
        "evaluator",
        "precision",
        "adapter",
        "data",
        "gof",
        "optimizer",
        "seed",
        "score",
        "parameters",
        "units",
        "at_bound",
        "intervals",
        "identifiability",
        "evaluations",
        "replicates",
        "cv",
    ] {
        assert!(result.get(key).is_some(), "result.json lacks {key}");
    }
    assert_eq!(result["model_id"], 37);
    assert_eq!(result["data"][0]["samples"], 1501);
    assert_eq!(result["data"][0]["sha256"].as_str().unwrap().len(), 64);
    assert_eq!(result["replicates"].as_array().unwrap().len(), 2);
    assert_eq!(result["evaluations"], 1880, "two replicates: 100, then 70 a generation, never above 1000");
    let score = result["score"].as_object().unwrap();
    let [s, v, a, sum] = ["nrmse_s", "nrmse_v", "nrmse_a", "nrmse_sva"].map(|n| score[n].as_f64().unwrap());
    assert!((s + v + a - sum).abs() < 1e-15, "{s} + {v} + {a} is not {sum}");
    let names: Vec<&String> = result["parameters"].as_object().unwrap().keys().collect();
    assert_eq!(names, ["k_s", "k_v", "k_0", "v_0", "d_0", "t_h"]);
    assert!(folder.join("timing.json").exists());
}

#[test]
fn simulate_repeats_the_calibration() {
    let folder = calibrated("repeat", &[]);
    let (result, file) = (folder.join("result.json"), platoon().join("platoon.csv"));
    let again = json(&["simulate", text(&file), "--follower", "1", "--result", text(&result), "--json"]);
    let before = json_of(&result);
    assert_eq!(again["runs"][0]["score"]["nrmse_sva"], before["score"]["nrmse_sva"]);
    assert_eq!(again["runs"][0]["success"], true);
}

#[test]
fn simulate_lets_each_simulated_car_lead_the_next() {
    let folder = calibrated("platoon_run", &[]);
    let (result, file, out) =
        (folder.join("result.json"), platoon().join("platoon.csv"), scratch("cli", "platoon_out"));
    let runs = json(&["simulate", text(&file), "--platoon", "--result", text(&result), "--json", "--out", text(&out)]);
    assert_eq!(runs["runs"].as_array().unwrap().len(), 4);
    let column = |follower: usize, name: &str| -> Vec<f64> {
        let mut reader = csv::Reader::from_path(out.join(format!("simulation_follower{follower}.csv"))).unwrap();
        let at = reader.headers().unwrap().iter().position(|h| h == name).unwrap();
        reader.records().map(|r| r.unwrap()[at].parse().unwrap()).collect()
    };
    // Behind the simulated car, not behind the measured one.
    assert_eq!(column(2, "lead_speed_mps"), column(1, "sim_speed_mps"));
    assert_eq!(column(4, "lead_speed_mps"), column(3, "sim_speed_mps"));
    for (follower, ahead) in [(1, ">preceding vehicle<"), (2, ">preceding vehicle (simulated)<")] {
        let plot = fs::read_to_string(out.join(format!("plot_follower{follower}.svg"))).unwrap();
        assert!(plot.contains(ahead), "follower {follower}");
    }
    // The gap is that to the simulated car: it changes by the two simulated speeds.
    let (s, v_l, v_f) = (column(2, "sim_spacing_m"), column(1, "sim_speed_mps"), column(2, "sim_speed_mps"));
    for i in 1..s.len() {
        let integrated = s[i - 1] + 0.05 * (v_l[i - 1] + v_l[i] - v_f[i - 1] - v_f[i]);
        assert!((s[i] - integrated).abs() < 1e-9, "sample {i}: spacing {} m, by the speeds {integrated} m", s[i]);
    }
}

#[test]
fn joint_calibration_has_one_parameter_set() {
    let (folder, out) = (platoon(), scratch("cli", "joint"));
    let files = [1, 3].map(|k| folder.join(format!("pair_follower{k}.csv")));
    let arguments = ["calibrate", text(&files[0]), text(&files[1]), "--joint", "--model", "idm", "--out", text(&out)];
    ok(&[&arguments[..], &["--max-evaluations", "500"]].concat());
    let result = json_of(out.join("result.json"));
    assert_eq!(result["data"].as_array().unwrap().len(), 2);
    assert!(out.join("simulation_1.csv").exists() && out.join("plot_2.svg").exists());

    // The drives that are held back are scored as `simulate` scores them.
    let held = folder.join("pair_follower2.csv");
    let some = [&arguments[..], &["--holdout", text(&held), "--max-evaluations", "500"]].concat();
    let told = ok(&some);
    assert!(told.contains("held back: 1, mean nrmse-sva"), "{told}");
    let result = json_of(out.join("result.json"));
    assert_eq!(result["per_drive"]["drives"].as_array().unwrap().len(), 2);
    let mean = result["per_drive"]["mean"].as_f64().unwrap();
    assert!((mean - result["score"]["nrmse_sva"].as_f64().unwrap()).abs() < 1e-12);
    let again = json(&["simulate", text(&held), "--result", text(&out), "--json"]);
    let score = &result["held_back"]["drives"][0]["score"];
    assert!(again.to_string().contains(&format!("\"nrmse_sva\":{score}")), "{score} {again}");
    let ends = json(&[&arguments[..], &["--holdout", "0.3", "--max-evaluations", "500", "--json"]].concat());
    assert_eq!(ends["held_back"]["drives"].as_array().unwrap().len(), 2);
    assert!(ends["data"][0]["samples"].as_u64() < result["data"][0]["samples"].as_u64());
    // Two drivers in two folds: each is scored as the calibration on the other scores him.
    let folds = ok(&[&arguments[..], &["--folds", "2", "--max-evaluations", "500"]].concat());
    assert!(folds.contains("held back, in 2 folds: 2, mean nrmse-sva"), "{folds}");
    let left_out = json_of(out.join("result.json"));
    for (k, other) in [(0, 1), (1, 0)] {
        let fold = scratch("cli", "fold");
        let single = ["calibrate", text(&files[other]), "--joint", "--model", "idm", "--max-evaluations", "500"];
        let single = [&single[..], &["--holdout", text(&files[k]), "--out", text(&fold), "--json"]];
        let single = json(&single.concat());
        assert_eq!(left_out["held_back"]["drives"][k]["score"], single["held_back"]["drives"][0]["score"]);
    }
    // Pooled squares: the score is that of all drives together, here and on drives held back.
    let pooled = [&arguments[..], &["--gof", "pooled-rmse-s", "--folds", "2", "--max-evaluations", "500"]].concat();
    let told = ok(&pooled);
    assert!(told.contains("drives: 2, pooled-rmse-s ") && !told.contains("mean pooled"), "{told}");
    let result: Value = serde_json::from_slice(&fs::read(out.join("result.json")).unwrap()).unwrap();
    for key in ["per_drive", "held_back"] {
        let of = |name: &str| -> Vec<f64> {
            let drives = result[key]["drives"].as_array().unwrap();
            drives.iter().map(|drive| drive[name].as_f64().unwrap()).collect()
        };
        let (scores, weights) = (of("score"), of("weight"));
        // The first sample is the measured start.
        let samples = [0, 1].map(|k| result["data"][k]["samples"].as_f64().unwrap() - 1.0);
        assert_eq!(weights, samples, "{key}");
        let squares: f64 = scores.iter().zip(&weights).map(|(score, weight)| weight * score * score).sum();
        let expected = (squares / weights.iter().sum::<f64>()).sqrt();
        let found = result[key]["pooled"].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-12 * expected, "{key}: {found} {expected}");
    }
    assert_eq!(result["per_drive"]["pooled"], result["replicates"][0]["score"]);
    refused(2, &[&arguments[..], &["--folds", "3"]].concat()).says("--folds 3: expected at least 3 drivers, found 2");
    let copy = scratch("cli", "joint_copy").join("copy.csv");
    fs::copy(&files[0], &copy).unwrap();
    refused(2, &[&arguments[..], &["--holdout", text(&copy)]].concat()).says("has samples of");

    // Without --follower, all followers of a platoon have one parameter set.
    let (file, out) = (folder.join("platoon.csv"), scratch("cli", "joint_platoon"));
    let all = ["calibrate", text(&file), "--joint", "--model", "idm", "--out", text(&out), "--max-evaluations", "500"];
    ok(&all);
    let whole = json_of(out.join("result.json"));
    let followers: Vec<_> = whole["data"].as_array().unwrap().iter().map(|data| data["follower"].clone()).collect();
    assert!(followers.len() > 2 && followers[..3] == [1, 2, 3], "{followers:?}");

    // After the same history, models with and without a delay are scored on the same samples, and simulated again alike.
    // The drive is shorter than the longest delay of that extension.
    let short = ["--to", "2.5"];
    let delayed = ["--extend", "perception_delay"];
    for (model, extend, window) in
        [("idm", &[][..], &[][..]), ("idm+delay", &[], &[]), ("idm", &delayed[..], &short[..])]
    {
        let out = scratch("cli", "history");
        let history = ["--history", "0.7", "--max-evaluations", "500", "--out", text(&out)];
        ok(&[&["calibrate", text(&files[0]), "--model", model], &history[..], extend, window].concat());
        let result = json_of(out.join("result.json"));
        assert_eq!(result["data"][0]["first_scored"], 8, "{model} {extend:?}");
        let again = json(&[&["simulate", text(&files[0]), "--result", text(&out), "--json"], window].concat());
        let score = format!("\"nrmse_sva\":{}", result["score"]["nrmse_sva"]);
        assert!(again.to_string().contains(&score), "{score} {again}");
    }

    let out = scratch("cli", "one_by_one");
    let arguments = ["calibrate", text(&files[0]), text(&files[1]), "--model", "idm", "--out", text(&out)];
    ok(&[&arguments[..], &["--max-evaluations", "500"]].concat());
    assert!(out.join("pair_follower1_follower1/result.json").exists());
    assert!(out.join("pair_follower3_follower1/result.json").exists());
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_calibration_in_flight_and_names_the_files_left_out() {
    use std::process::{Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};
    let folder = platoon();
    let files = [1, 3].map(|k| folder.join(format!("pair_follower{k}.csv")));
    // Schedulers send SIGTERM.
    for signal in ["-INT", "-TERM"] {
        let out = scratch("cli", &format!("interrupted{signal}"));
        let endless = ["--optimizer", "ga", "--max-evaluations", "1000000000", "--model", "idm", "--out", text(&out)];
        let mut run = Command::new(env!("CARGO_BIN_EXE_leadlag"));
        let run = run.args(["calibrate", text(&files[0]), text(&files[1])]).args(endless);
        let run = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
        // The folder is made just before the search begins.
        let (first, begun) = (out.join("pair_follower1_follower1"), Instant::now());
        while !first.exists() {
            assert!(begun.elapsed() < Duration::from_secs(60), "no search began");
            sleep(Duration::from_millis(10));
        }
        sleep(Duration::from_millis(500));
        let sent = Command::new("kill").args([signal, &run.id().to_string()]).status().expect("kill is there");
        assert!(sent.success());
        let output = run.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("stopping: results so far are kept"), "{signal}: {}", stderr(&output));
        let left = format!("interrupted; not calibrated: {}; repeat the command", text(&files[1]));
        assert!(stderr(&output).contains(&left), "{}", stderr(&output));
        assert!(first.join("result.json").exists() && !out.join("pair_follower3_follower1").exists());
    }
}

#[test]
fn bounds_and_fixed_values_hold() {
    let bounds = scratch("cli", "bounds").join("bounds.toml");
    fs::write(&bounds, "v_0 = [25, 26]\nd_0 = 2.5\n").unwrap();
    let folder = calibrated("bounded", &["--bounds", text(&bounds), "--fix", "t_h=1.25"]);
    let result = json_of(folder.join("result.json"));
    let parameter = |name: &str| result["parameters"][name].as_f64().unwrap();
    assert!((25.0..=26.0).contains(&parameter("v_0")));
    assert_eq!((parameter("d_0"), parameter("t_h")), (2.5, 1.25));
}

#[test]
fn evaluate_marks_bad_rows_and_keeps_the_others() {
    let (folder, cases) = (platoon(), scratch("cli", "cases").join("cases.csv"));
    let rows = "note,model_id,variant,platoon,follower_position,k_s,k_v,k_0,v_0,d_0,t_h,success,tau_p,success_in\n\
                good,37,,platoon,1,0.2,0.6,0.5,33,3,1.1,x,,mine\n\
                word,,l-cth,platoon,1,0.2,abc,0.5,33,3,1.1,x,,\n\
                car,37,,platoon,9,0.2,0.6,0.5,33,3,1.1,x,,\n\
                file,37,,nowhere,1,0.2,0.6,0.5,33,3,1.1,x,,\n\
                sign,37,,platoon,1,0.2,0.6,0.5,-33,3,1.1,x,,\n\
                late,,l-cth+delay,platoon,1,0.2,0.6,0.5,33,3,1.1,x,0.9,\n\
                short,37,,platoon\n\
                good,,l-cth,platoon,1,0.2,0.6,0.5,33,3,1.1,x,,\n\
                same,37,l-cth,platoon,1,0.2,0.6,0.5,33,3,1.1,x,,\n\
                both,2,l-cth,platoon,1,0.2,0.6,0.5,33,3,1.1,x,,\n";
    fs::write(&cases, rows).unwrap();
    let output = succeeds(&["evaluate", text(&cases), "--data", text(&folder), "--rescore"]);
    assert!(
        stderr(&output).contains("10 rows: 3 simulated to the end, 0 ended early, 7 invalid"),
        "{}",
        stderr(&output)
    );
    assert!(stderr(&output).contains("platoon.csv sha256 "), "files used are listed");
    let mut reader = csv::Reader::from_reader(output.stdout.as_slice());
    let headers = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let field = |row: usize, name: &str| rows[row][headers.iter().position(|h| h == name).unwrap()].to_owned();
    let names: std::collections::BTreeSet<&str> = headers.iter().collect();
    assert_eq!(names.len(), headers.len(), "no two columns have one name: {headers:?}");
    assert_eq!(field(0, "success_in"), "mine", "a column of that name is left alone");
    assert_eq!(field(0, "success_in_in"), "x", "an input column that bears an outcome's name gets a suffix");
    assert_eq!((field(0, "success").as_str(), field(0, "evaluator").as_str()), ("1", "lanes"));
    assert_eq!(field(0, "nrmse_sva"), field(7, "nrmse_sva"), "an id and a name are the same variant");
    assert_eq!(field(0, "nrmse_sva"), field(0, "nrmse_sva_f64"));
    for (row, expected) in [
        (1, "invalid: k_v: expected a number for variant l-cth, found `abc`"),
        (2, "invalid: "),
        (3, "invalid: platoon nowhere: no file nowhere.csv in "),
        (4, "invalid: v_0: expected a number above 0 and below 1e9, found -33"),
        (5, "invalid: tau_p: expected at most 0.8 s, found 0.9"),
        (6, "invalid: expected 14 fields as in the header, found 4"),
        (9, "invalid: model_id 2 is idm+constant, but the column variant says l-cth; leave one of the two empty"),
    ] {
        assert!(field(row, "fail_reason").starts_with(expected), "row {row}: {}", field(row, "fail_reason"));
        assert_eq!((field(row, "success").as_str(), field(row, "nrmse_sva").as_str()), ("0", ""), "row {row}");
    }
}

#[test]
fn wrong_usage_exits_with_2_and_failure_with_1() {
    let file = platoon().join("platoon.csv");
    let file = text(&file);
    let out = scratch("cli", "never").join("out");
    let calibrate = |extra: &[&str]| fails(&[&["calibrate", file, "--out", text(&out)], extra].concat());
    for (code, (found, message), expected) in [
        (2, fails(&["calibrat"]), "calibrate"),
        (2, calibrate(&["--model", "1000", "--follower", "1"]), "expected an id from 1 to 90"),
        (2, calibrate(&["--model", "gips", "--follower", "1"]), "did you mean `gipps`?"),
        (2, calibrate(&["--model", "idm"]), "--follower is needed"),
        (
            2,
            calibrate(&["--model", "idm", "--follower", "1", "--fix", "k_s=1"]),
            "variant idm has the parameters delta",
        ),
        (
            2,
            calibrate(&["--model", "idm", "--follower", "1", "--convention", "paper,delay=x"]),
            "expected `fractional` or `floor`",
        ),
        (2, calibrate(&["--model", "idm", "--follower", "1", "--gof", "nrmse-x"]), "goodness of fit `nrmse-x`"),
        (2, calibrate(&["--model", "idm", "--follower", "7"]), "no follower 7"),
        (2, calibrate(&["--model", "idm", "--follower", "1", "--fix", "v_0=-1"]), "v_0: expected a number above 0"),
        (
            2,
            calibrate(&["--model", "idm", "--follower", "1", "--fix", "t_h=1e9"]),
            "above 0 and below 1e9, found 1000000000",
        ),
        (2, calibrate(&["--model", "idm", "--all", "--fix", "t_h=1e9"]), "above 0 and below 1e9, found 1000000000"),
        (2, calibrate(&["--model", "idm", "--follower", "1", "--fix", "v_0=nan"]), "expected NAME=VALUE"),
        (2, calibrate(&["--model", "idm", "--follower", "1", "--max-seconds", "nan"]), "expected a finite number"),
        (2, calibrate(&["--model", "idm", "--follower", "1", "--max-seconds=-1"]), "seconds of at least 0"),
        (
            2,
            calibrate(&["--model", "idm", "--follower", "1", "--max-seconds", "1e300"]),
            "and at most 1e9, found `1e300`",
        ),
        (2, calibrate(&["--model", "idm", "--follower", "1", "--target", "nan"]), "expected a finite number"),
        (
            2,
            calibrate(&["--model", "idm", "--follower", "1", "--from", "10", "--to", "5"]),
            "--to 5 lies before --from 10",
        ),
        (2, calibrate(&["--model", "idm", "--joint", "--each"]), "cannot be used with"),
        (2, fails(&["list", "variants", "--model", "3"]), "need `leadlag list parameters`"),
        (
            1,
            calibrate(&["--model", "idm", "--follower", "1", "--evaluator", "gpu", "--gpu", "no such card"]),
            "no such card",
        ),
        (
            2,
            calibrate(&["--model", "idm", "--follower", "1", "--evaluator", "reference", "--precision", "plain"]),
            "--precision needs",
        ),
        (2, calibrate(&["--model", "idm+nonlinear", "--follower", "1"]), "give --vehicle"),
        (1, calibrate(&["--model", "idm+mfc", "--follower", "1", "--vehicle", "bmw_x5"]), "MFC curve"),
        (2, calibrate(&["--model", "idm+mfc", "--follower", "1", "--vehicle", "trabant"]), "it has audi_a6"),
        (1, fails(&["inspect", "nowhere.csv"]), "nowhere.csv"),
        (1, fails(&["simulate", file, "--result", file]), "expected a result.json"),
    ] {
        assert_eq!(found, code, "{message}");
        assert!(message.contains(expected), "expected {expected:?} in:\n{message}");
    }
    assert!(!out.exists(), "a command that fails leaves no files");
}

#[test]
fn a_folder_that_cannot_be_written_is_found_before_the_work() {
    let file = platoon().join("platoon.csv");
    let inside_a_file = file.join("out");
    let arguments = ["calibrate", text(&file), "--follower", "1", "--model", "1", "--out", text(&inside_a_file)];
    refused(1, &arguments).says("cannot make the folder");
}

#[test]
fn list_and_inspect_speak_json() {
    let variants = json(&["list", "variants", "--json"]);
    assert_eq!(variants.as_array().unwrap().len(), 90);
    assert_eq!(variants[30]["variant"], "gipps+delay+linear");
    let parameters = json(&["list", "parameters", "--json", "--model", "7", "--vehicle", "bmw_x5"]);
    let f_1 = parameters.as_array().unwrap().iter().find(|p| p["name"] == "f_1").unwrap();
    assert!((f_1["bounds"][0].as_f64().unwrap() + 2.268).abs() < 1e-12, "-0.63 N/(km/h) is -2.268 kg/s");
    for topic in ["vehicles", "gof", "conventions"] {
        let list = json(&["list", topic, "--json"]);
        assert!(!list.as_array().unwrap().is_empty(), "{topic}");
    }
    let inspection = ok(&["inspect", text(&platoon().join("platoon.csv")), "--json"]);
    assert!(serde_json::from_str::<Value>(&inspection).unwrap().is_object());
}

#[test]
fn several_calibrations_make_one_json_array_and_never_share_a_folder() {
    let (folder, out) = (platoon(), scratch("cli", "twins"));
    let copy = scratch("cli", "copy").join("platoon.csv");
    fs::create_dir_all(copy.parent().unwrap()).unwrap();
    fs::copy(folder.join("platoon.csv"), &copy).unwrap();
    let original = folder.join("platoon.csv");
    let arguments = ["calibrate", text(&original), text(&copy), "--model", "idm", "--follower", "2"];
    let printed = ok(&[&arguments[..], &["--max-evaluations", "200", "--json", "--out", text(&out)]].concat());
    let results: Value = serde_json::from_str(&printed).expect("one JSON document");
    assert_eq!(results.as_array().unwrap().len(), 2);
    assert!(out.join("platoon_follower2/result.json").exists());
    assert!(out.join("platoon_follower2_2/result.json").exists());
}

#[test]
fn a_variant_without_free_parameters_is_scored_once() {
    let fix = ["k_s=0.2", "k_v=0.6", "k_0=0.5", "v_0=33", "d_0=3", "t_h=1.1"].map(|f| ["--fix", f]);
    let folder = calibrated("all_fixed", &fix.concat());
    let result = json_of(folder.join("result.json"));
    assert_eq!(result["evaluations"], 1);
    assert_eq!(result["replicates"][0]["stop"], "every parameter is fixed");
}

#[test]
fn evaluate_may_write_onto_its_input_and_keeps_files_when_it_fails() {
    let cases = scratch("cli", "onto_itself").join("onto_itself.csv");
    let row = "37,platoon,1,0.2,0.6,0.5,33,3,1.1\n";
    fs::write(&cases, format!("model_id,platoon,follower_position,k_s,k_v,k_0,v_0,d_0,t_h\n{row}{row}")).unwrap();
    ok(&["evaluate", text(&cases), "--data", text(&platoon()), "--out", text(&cases)]);
    let written = fs::read_to_string(&cases).unwrap();
    assert_eq!(written.lines().count(), 3, "{written}");
    assert!(written.lines().nth(1).unwrap().starts_with("37,platoon,1,0.2,0.6,0.5,33,3,1.1,1,,,0,0,0,"), "{written}");

    let broken = scratch("cli", "no_columns").join("no_columns.csv");
    for (content, expected) in [
        ("model_id;platoon;follower_position\n", "column model_id is missing"),
        ("", "the file has nothing"),
        ("model_id,platoon,follower_position,v_0,v_0\n", "column v_0 occurs more than once"),
    ] {
        fs::write(&broken, content).unwrap();
        refused(1, &["evaluate", text(&broken), "--data", text(&platoon()), "--out", text(&cases)]).says(expected);
    }
    assert_eq!(fs::read_to_string(&cases).unwrap(), written, "an existing table survives a failed run");
    assert_eq!(
        fs::read_dir(cases.parent().unwrap())
            .unwrap()
            .filter(|f| { f.as_ref().unwrap().file_name().to_string_lossy().ends_with(".tmp") })
            .count(),
        0,
        "no half-written file is left"
    );

    let bounds = scratch("cli", "infinite").join("infinite.toml");
    fs::write(&bounds, "tau_p = [0.1, inf]\n").unwrap();
    refused(2, &["evaluate", text(&cases), "--data", text(&platoon()), "--bounds", text(&bounds)])
        .says("tau_p: expected a number of at least 0 and below 1e9 as both bounds");
    refused(1, &["evaluate", text(&cases), "--data", "nowhere"])
        .says("nowhere: expected the folder of the platoon files");
}

#[test]
fn simulate_says_when_the_data_are_treated_otherwise() {
    let folder = calibrated("treated", &["--smooth"]);
    let (result, file) = (folder.join("result.json"), platoon().join("platoon.csv"));
    let arguments = ["simulate", text(&file), "--follower", "1", "--result", text(&result)];
    let plain = leadlag(&arguments);
    assert!(
        stderr(&plain).contains("was calibrated on data prepared differently: smoothed, step 0.1 s"),
        "{}",
        stderr(&plain)
    );
    assert!(stdout(&plain).contains("spacing from the measured gap"), "{}", stdout(&plain));
    let same = leadlag(&[&arguments[..], &["--smooth"]].concat());
    assert_eq!(stderr(&same), "");
}

#[test]
fn a_platoon_needs_one_time_axis() {
    // IVS1 is missing in the first 30 s, IVS2 in the last 30 s.
    let whole = fs::read_to_string(platoon().join("platoon.csv")).unwrap();
    let holes = edited(&whole, |i, fields| match i {
        6..306 => fields[6].clear(),
        1207.. => fields[7].clear(),
        _ => {}
    });
    let file = scratch("cli", "two_axes").join("two_axes.csv");
    fs::write(&file, holes).unwrap();
    let result = calibrated("for_two_axes", &[]).join("result.json");
    refused(1, &["simulate", text(&file), "--platoon", "--result", text(&result)])
        .says("cut both to one gap-free window with --from and --to");
}

#[test]
fn a_run_that_crashes_says_when_and_why_everywhere() {
    // A controller that pushes forward, whatever the car ahead does.
    let fix = ["k_s=0.01", "k_v=0.01", "k_0=5", "v_0=35", "d_0=-900", "t_h=0.1"];
    let mut text_of = fs::read_to_string(calibrated("before_the_crash", &[]).join("result.json")).unwrap();
    let mut result: Value = serde_json::from_str(&text_of).unwrap();
    for (name, value) in fix.map(|f| f.split_once('=').unwrap()) {
        result["parameters"][name] = Value::from(value.parse::<f64>().unwrap());
    }
    text_of = result.to_string();
    let path = scratch("cli", "crash").join("crash.json");
    fs::write(&path, text_of).unwrap();
    let (file, out) = (platoon().join("platoon.csv"), scratch("cli", "crash_out"));
    let arguments = ["simulate", text(&file), "--follower", "1", "--result", text(&path), "--out", text(&out)];
    let run = json(&[&arguments[..], &["--json"]].concat());
    let run = &run["runs"][0];
    assert_eq!((&run["success"], &run["fail_reason"], &run["score"]), (&false.into(), &"spacing".into(), &Value::Null));
    let step = run["fail_step"].as_u64().expect("a sample");
    let said = format!("ended early at sample {step} (");
    let printed = ok(&arguments);
    assert!(printed.contains(&said) && printed.contains("crash, the spacing is not above 0"), "{printed}");
    let plot = fs::read_to_string(out.join("plot.svg")).unwrap();
    assert!(plot.contains(&said), "the plot names the same sample");
    let rows = fs::read_to_string(out.join("simulation.csv")).unwrap();
    let simulated = rows.lines().skip(1).filter(|line| !line.ends_with(",,,")).count() as u64;
    assert_eq!(simulated, step + 1, "simulated columns are empty after the failing sample");
}

#[test]
fn synth_hides_what_it_is_told_to() {
    let folder = scratch("cli", "hidden");
    let lead = platoon().join("pair_follower1.csv");
    let arguments = ["synth", "--out", text(&folder), "--base", "idm", "--leader", text(&lead), "--seed", "3"];
    let effect = ["--effect", "actuation_lag", "--amplitude", "weak", "--gusts", "0.05,2", "--gap-noise", "0.02"];
    ok(&[&arguments[..], &effect].concat());
    let truth = json_of(folder.join("truth.json"));
    let follower = &truth["scenario"]["followers"][0];
    assert_eq!(truth["scenario"]["followers"].as_array().unwrap().len(), 1);
    assert_eq!(follower["effects"][0]["name"], "actuation_lag");
    let lag = follower["effects"][0]["parameters"]["ta"].as_f64().unwrap();
    assert!((0.01..0.5).contains(&lag), "a weak lag of {lag} s");
    assert_eq!(follower["gusts"]["sigma_mps2"], 0.05);
    assert_eq!(truth["scenario"]["noise"]["gap_m"], 0.02);
    assert_eq!(truth["scenario"]["profile"]["kind"], "recorded");
    assert_eq!(truth["scenario"]["duration_s"], 150.0);

    let refused = |extra: &[&str]| fails(&[&["synth", "--out", text(&folder)], extra].concat());
    let (code, message) = refused(&["--effect", "grad"]);
    assert_eq!(code, 2);
    assert!(message.contains("unknown effect \"grad\"; expected one of perception_delay, "), "{message}");
    let (code, message) = refused(&["--effect", "grade", "--amplitude", "60"]);
    assert_eq!(code, 1);
    assert!(message.contains("at most on this drive, less than the requested 60 m/s"), "{message}");
    let (_, message) = refused(&["--effect", "grade", "--effect", "grade:gg=1"]);
    assert!(message.contains("--effect grade is given twice"), "{message}");
    assert!(ok(&["synth", "--list-effects"]).contains("\ngrade: this share of the grade force is not compensated\n"));
}
