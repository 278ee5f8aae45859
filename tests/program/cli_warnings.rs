//! Refusals and warnings before the work: options without effect, parameters that the data do not determine, tables without a row that can
//! be simulated.

use super::cli_verbs::SOFT;
use crate::common::program::{
    edited, flat, json, json_of, leadlag, ok, quick, scale, scratch, stderr, succeeds, synth, text,
};
use leadlag::internal::score::GoodnessOfFit;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

fn drive() -> PathBuf {
    synth(60)
}

/// stderr of a short calibration of `idm`.
fn calibrate(extra: &[&str]) -> String {
    static CALLS: AtomicU32 = AtomicU32::new(0);
    let call = CALLS.fetch_add(1, Ordering::Relaxed);
    let (pair, out) = (drive().join("pair_follower1.csv"), scratch("cli_warnings", &format!("fit{call}")));
    stderr(&quick(&pair, &out, extra))
}

/// Reads the position, and no grade.
const PLACE: &str = "//! Slower behind a certain place.
struct Parameters {
    /// loss [m/s2], 0 to 1, neutral 0
    loss: f32,
}

fn place_command(own: Parameters, w: World, a_cmd: f32) -> f32 {
    return select(a_cmd, a_cmd - own.loss, w.x_f > 500.0);
}
";

#[test]
fn the_reference_refuses_extensions_of_ones_own_before_the_work() {
    let folder = scratch("cli_warnings", "own");
    let (soft, out) = (folder.join("soft.wgsl"), folder.join("never"));
    fs::write(&soft, SOFT).unwrap();
    let pair = drive().join("pair_follower1.csv");
    let with = ["calibrate", text(&pair), "--model", "idm", "--extend", text(&soft), "--out", text(&out)];
    let refused = leadlag(&[&with[..], &["--evaluator", "reference"]].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    let expected = "knows the built-in causes only; ";
    let remedy = "soft.wgsl is your own: use `--evaluator lanes --precision f64`";
    assert!(stderr(&refused).contains(expected) && stderr(&refused).contains(remedy), "{}", stderr(&refused));
    assert!(!out.exists(), "a command that is refused leaves no files");
    // The proposed command works, and so does the reference with built-in extensions.
    calibrate(&["--extend", text(&soft), "--evaluator", "lanes", "--precision", "f64"]);
    calibrate(&["--extend", "actuation_lag", "--evaluator", "reference"]);

    let plan = folder.join("plan.toml");
    let platoon = "schema_version = 1\n[data]\nfolder = \".\"\n[[platoon]]\nname = \"S\"\nfile = \"platoon.csv\"\n";
    let calibration = "[calibration]\nvariants = [\"idm\"]\nextend = [\"soft.wgsl\"]\nevaluator = \"reference\"\n";
    fs::write(&plan, format!("{platoon}{calibration}")).unwrap();
    fs::copy(drive().join("platoon.csv"), folder.join("platoon.csv")).unwrap();
    let refused = leadlag(&["study", "plan", text(&plan), "--out", text(&out)]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("soft.wgsl is your own: use `evaluator = \"lanes\" and"), "{}", stderr(&refused));
}

#[test]
fn a_grade_that_is_nowhere_is_told_and_one_that_gives_the_lap_is_not_called_useless() {
    let level = calibrate(&["--extend", "grade", "--grade", "level"]);
    assert!(level.contains("warning: the grade is 0 throughout: gg has no effect"), "{level}");
    assert!(!calibrate(&["--extend", "grade", "--grade", "level", "--fix", "gg=0"]).contains("gg has no effect"));
    assert!(!calibrate(&["--extend", "grade"]).contains("the grade is 0"), "the file has a slope");
    let place = scratch("cli_warnings", "place").join("place.wgsl");
    fs::write(&place, PLACE).unwrap();
    let lap = drive().join("Slope.csv");
    let said = calibrate(&["--extend", text(&place), "--grade", text(&lap)]);
    assert!(!said.contains("--grade changes nothing"), "the position counts modulo the lap: {said}");
    let said = calibrate(&["--extend", text(&place), "--grade", "level"]);
    assert!(said.contains("--grade changes nothing"), "there is no lap: {said}");
}

#[test]
fn a_road_that_nobody_has_placed_is_warned_of_by_every_verb_that_reads_it() {
    let (platoon, out) = (drive().join("platoon.csv"), scratch("cli_warnings", "placed"));
    let (table, fit) = (drive().join("Slope.csv"), out.join("fit"));
    let drive = [text(&platoon), "--follower", "1", "--grade"];
    let search =
        ["--model", "idm", "--extend", "grade", "--max-evaluations", "100", "--no-intervals", "-o", text(&fit)];
    let warning = format!(
        "warning: {}: it has no positions, so the preceding vehicle is assumed to start at 0 m of {}; ",
        platoon.display(),
        table.display()
    );
    let calibrate =
        |road: &[&str], search: &[&str]| stderr(&succeeds(&[&["calibrate"], &drive[..], road, search].concat()));
    let said = calibrate(&[text(&table)], &search);
    assert!(said.contains(&warning) && said.contains("give the start with --lead-start M\n"), "{said}");
    assert!(!calibrate(&[text(&table), "--lead-start", "0"], &search).contains("it has no positions"));
    assert!(!calibrate(&["level"], &search).contains("it has no positions"), "level is level everywhere");
    let plain = [&["--model", "idm"], &search[4..]].concat();
    assert!(!calibrate(&[text(&table)], &plain).contains("it has no positions"), "nothing reads the road");
    calibrate(&[text(&table)], &search);
    let said = stderr(&succeeds(&[&["simulate"], &drive[..], &[text(&table), "--result", text(&fit)]].concat()));
    assert!(said.contains(&warning), "{said}");
    // A diagnosis tries the grade with any base model; these data are too short for one.
    let said = stderr(&leadlag(&[&["diagnose"], &drive[..], &[text(&table), "--base", "idm"]].concat()));
    assert!(said.contains(&warning), "{said}");
}

#[test]
fn a_broken_gap_is_warned_of_in_the_words_of_inspect() {
    let folder = scratch("cli_warnings", "broken");
    let (file, fit) = (folder.join("broken.csv"), folder.join("fit"));
    let sound = fs::read_to_string(drive().join("pair_follower1.csv")).unwrap();
    let broken = edited(&sound, |i, fields| {
        if i % 4 < 2 {
            fields[3] = (fields[3].parse::<f64>().unwrap() + 3.0).to_string();
        }
    });
    fs::write(&file, broken).unwrap();
    let shown = ok(&["inspect", text(&file)]);
    let warned = shown.lines().find(|line| line.contains("contradicts the speeds")).expect("a warning");
    let warning = warned.replacen("warning: ", &format!("warning: {}: ", file.display()), 1);
    let said = stderr(&quick(&file, &fit, &[]));
    assert!(said.contains(&warning), "{said}");
    let result = json_of(fit.join("result.json"));
    let kept = result["data"][0]["findings"].as_array().unwrap();
    assert!(kept.iter().any(|finding| warned.contains(finding["sentence"].as_str().unwrap())), "{kept:?}");
    let said = stderr(&succeeds(&["simulate", text(&file), "--result", text(&fit)]));
    assert!(said.contains(&warning), "{said}");
    let said = stderr(&succeeds(&["diagnose", text(&file), "--data-only"]));
    assert!(said.contains(&warning), "{said}");
    assert!(!calibrate(&[]).contains("contradicts"), "the drive itself is sound");
}

/// Followers have the numbers of `--follower`, in text and JSON.
#[test]
fn inspect_says_what_follower_each_car_is() {
    let platoon = drive().join("platoon.csv");
    let shown = ok(&["inspect", text(&platoon)]);
    assert!(shown.contains("      gap of follower 1 [m] ") && shown.contains(": car 5 is follower 4\n"), "{shown}");
    assert!(shown.lines().all(|line| line.chars().count() <= 80 || line.starts_with(text(&platoon))), "{shown}");
    let json = json(&["inspect", text(&platoon), "--json"]);
    let cars = json["platoons"][0]["cars"].as_array().unwrap();
    let followers: Vec<Option<u64>> = cars.iter().map(|car| car["follower"].as_u64()).collect();
    assert_eq!(followers, [None, Some(1), Some(2), Some(3), Some(4)]);
}

#[test]
fn switches_and_bounds_that_make_no_sense_are_warned_of_once() {
    let said = calibrate(&["--convention", "authors,road_load=si"]);
    assert!(
        said.contains("--convention road_load=si changes nothing: variant idm has no nonlinear dynamics"),
        "{said}"
    );
    assert!(!calibrate(&["--convention", "authors"]).contains("--convention"));
    // The gap of a pair file is measured.
    let said = calibrate(&["--lead-start", "5", "--lead-length", "4"]);
    for flag in
        ["--lead-start changes nothing: variant idm reads", "--lead-length changes nothing: the gap is measured"]
    {
        assert!(said.contains(flag), "{said}");
    }
    let bounds = scratch("cli_warnings", "bounds").join("fast.toml");
    fs::write(&bounds, "v_0 = [40, 50]\n").unwrap();
    let (one, out) = (drive().join("pair_follower1.csv"), scratch("cli_warnings", "twice"));
    let (two, other) = (out.join("pair_follower1.csv"), out.join("fits"));
    fs::copy(&one, &two).unwrap();
    let search = ["--model", "idm", "--max-evaluations", "100", "--no-intervals", "--bounds", text(&bounds)];
    let arguments = [&["calibrate", text(&one), text(&two), "--out", text(&other)], &search[..]].concat();
    let output = succeeds(&arguments);
    let said = stderr(&output);
    assert_eq!(
        said.matches("never drives faster than 21.9 m/s, but v_0 is searched from 40 m/s on").count(),
        1,
        "{said}"
    );
    assert!(said.contains("in the file of --bounds, a lower bound near the driven speeds"), "{said}");
    let slow = scratch("cli_warnings", "slow").join("slow.csv");
    let whole = fs::read_to_string(&one).unwrap();
    let halved = edited(&whole, |_, fields| fields[1..3].iter_mut().for_each(|speed| scale(speed, 0.5)));
    fs::write(&slow, halved).unwrap();
    let told = stderr(&quick(&slow, &out, &[]));
    assert!(
        told.contains("searched from 30 m/s on")
            && told
                .contains("; to change this, use --bounds human (human drivers) or --bounds FILE.toml with `v_0 = ["),
        "{told}"
    );
    // Two files of the same name: the folder of each.
    for (file, folder) in [(&one, "pair_follower1_follower1"), (&two, "pair_follower1_follower1_2")] {
        let line = format!("files of {}, follower 1, in {}", file.display(), other.join(folder).display());
        assert!(said.contains(&line), "expected {line:?} in:\n{said}");
        let result = json_of(other.join(folder).join("result.json"));
        assert_eq!(result["data"][0]["path"], text(file));
    }
}

/// The driver is checked before a file of bounds is written.
#[test]
fn at_a_bound_of_acc_the_set_of_human_drivers_is_named() {
    let folder = scratch("cli_warnings", "at_bound");
    let (bounds, drive) = (folder.join("slow.toml"), drive().join("pair_follower1.csv"));
    fs::write(&bounds, "t_h = [2.9, 3.0]\n").unwrap();
    let told = |more: &[&str]| {
        let own = ["calibrate", text(&drive), "--model", "idm", "--max-evaluations", "1500", "--no-intervals"];
        flat(&ok(&[&own[..], more, &["--bounds", text(&bounds), "-o", text(&folder.join("fit"))]].concat()))
    };
    let human =
        "or do not determine the parameter; --bounds human is for a human driver, and --bounds FILE.toml widens them";
    let (acc, own) = (told(&[]), told(&["--bounds", "human"]));
    assert!(acc.contains(human), "{acc}");
    assert!(own.contains("or do not determine the parameter; --bounds FILE.toml widens them"), "{own}");
}

#[test]
fn every_goodness_of_fit_is_listed_with_its_unit() {
    let listed: Vec<Value> = serde_json::from_str(&ok(&["list", "gof", "--json"])).expect("JSON");
    let mut named: Vec<String> = listed.iter().map(|entry| entry["name"].as_str().unwrap().to_owned()).collect();
    for name in &named {
        assert_eq!(name.parse::<GoodnessOfFit>().map(|gof| gof.to_string()).as_deref(), Ok(name.as_str()));
    }
    named.sort();
    named.dedup();
    assert_eq!(
        named.len(),
        4 * 7 + 2 + 3 * 3,
        "every kind of every choice of signals, two of their own, and pooled ones"
    );
    let entry = |name: &str| listed.iter().find(|entry| entry["name"] == name).expect(name);
    assert_eq!((&entry("rmse-v")["unit"], &entry("rmse-v")["column"]), (&"m/s".into(), &"rmse_v".into()));
    assert_eq!((&entry("rmse-sva")["unit"], &entry("rmse-sva")["column"]), (&"m + m/s + m/s²".into(), &Value::Null));
    assert_eq!(entry("rmse-sn-vn-an")["unit"], "-");
    assert!(entry("rmse-sva")["meaning"].as_str().unwrap().contains("although the units differ"));
    assert!(!entry("nrmse-sva")["meaning"].as_str().unwrap().contains("differ"));
    let shown = ok(&["list", "gof"]);
    assert!(shown.lines().all(|line| line.chars().count() <= 80), "{shown}");
    assert!(shown.contains("root mean square error of spacing") && shown.contains("error of speed"), "{shown}");
}

/// Exit code, stdout and stderr of `evaluate` on rows for the drive, IDM.
fn evaluate(name: &str, header: &str, rows: &[&str]) -> (Option<i32>, String, String) {
    let cases = scratch("cli_warnings", name).join("cases.csv");
    fs::write(&cases, format!("model_id,platoon,follower_position,{header}\n{}\n", rows.join("\n"))).unwrap();
    let output = leadlag(&["evaluate", text(&cases), "--data", text(&drive())]);
    let said = stderr(&output);
    (output.status.code(), String::from_utf8(output.stdout).unwrap(), said)
}

#[test]
fn a_table_of_which_no_row_can_be_simulated_is_a_failure() {
    const GOOD: &str = "delta,v_0,d_0,t_h,a_max,a_min";
    const CAR: &str = "4,33,2,1.2,1.4,-2";
    let row = |start: &str| format!("{start},{CAR}");
    for (name, header, start, expected) in [
        ("column", "dleta,v_0,d_0,t_h,a_max,a_min", "1,platoon,1", "did you mean delta by the column `dleta`?"),
        ("file", GOOD, "1,nowhere,1", "no file nowhere.csv in "),
        ("follower", GOOD, "1,platoon,9", "platoon"),
    ] {
        let (code, table, said) = evaluate(name, header, &[&row(start), &row(start)]);
        assert_eq!(code, Some(1), "{name}: {said}");
        assert!(said.contains(".csv: no row could be simulated; the first of the invalid rows is row 1: "), "{said}");
        assert!(said.contains(expected), "expected {expected:?} in:\n{said}");
        assert_eq!(table.matches("invalid: ").count(), 2, "the table is written all the same: {table}");
    }
    let (code, _, said) = evaluate("mixed", GOOD, &[&row("1,platoon,1"), &row("1,nowhere,1")]);
    assert_eq!(code, Some(0), "one bad row is marked: {said}");
    assert!(said.contains("\nthe first of the invalid rows is row 2: platoon nowhere"), "{said}");
    assert_eq!(evaluate("empty", GOOD, &[]).0, Some(0));
}

#[test]
fn evaluate_says_once_which_parameters_their_variant_does_not_have() {
    const HEADER: &str = "delta,v_0,d_0,t_h,a_max,a_min,tau_p,tau_a,k_s";
    let row = |more: &str| format!("1,platoon,1,4,33,2,1.2,1.4,-2,{more}");
    let (code, _, said) = evaluate("surplus", HEADER, &[&row("0.4,,"), &row("0.3,0.2,"), &row(",NaN,0")]);
    assert_eq!(code, Some(0), "{said}");
    let warning = ".csv: 2 of 3 rows give parameters that their variant lacks; leadlag ignores them: tau_a, tau_p\n";
    assert!(said.contains(warning) && said.matches("warning: ").count() == 1, "{said}");
    let (_, _, said) = evaluate("absent", HEADER, &[&row("nan,0,"), &row(",0.0,NaN")]);
    assert!(!said.contains("warning: "), "that is how tables with all columns say that there is none: {said}");
}

#[test]
fn evaluate_lists_the_files_of_a_vehicle_where_they_were_used() {
    let folder = scratch("cli_warnings", "vehicles");
    fs::create_dir_all(folder.join("vehicles")).unwrap();
    fs::copy(drive().join("platoon.csv"), folder.join("platoon.csv")).unwrap();
    let columns = "slug,name,paper_name,mass_unladen_kg,phi,length_m,f_0_lb_N,f_0_ub_N,f_1_lb_N_per_kmh,f_1_ub_N_per_kmh,\
                   f_2_lb_N_per_kmh2,f_2_ub_N_per_kmh2";
    let car = "made_up,Synthetic(B),,1500,1.05,4.5,100,200,0,1,0.02,0.04";
    fs::write(folder.join("vehicles/vehicles.csv"), format!("{columns}\n{car}\n")).unwrap();
    fs::write(folder.join("vehicles/mfc_made_up.csv"), "speed_mps,a_ap,a_dp\n0,5,-8\n25,3,-8\n50,1,-8\n").unwrap();
    let used = |variant: &str| {
        let cases = folder.join("cases.csv");
        let header = "variant,platoon,follower_position,delta,v_0,d_0,t_h,a_max,a_min";
        fs::write(&cases, format!("{header}\n{variant},platoon,1,4,33,2,1.2,1.4,-2\n")).unwrap();
        let said = stderr(&succeeds(&["evaluate", text(&cases), "--data", text(&folder)]));
        (said.contains("vehicles.csv sha256"), said.contains("mfc_made_up.csv sha256"))
    };
    assert_eq!(used("idm"), (false, false));
    assert_eq!(used("idm+mfc"), (true, true));
}

/// The verbs that take a desired speed, of 432 km/h or in km/h.
#[test]
fn a_desired_speed_far_above_any_driven_is_warned_of_by_every_verb() {
    let folder = scratch("cli_warnings", "far");
    let (pair, fit, cases) = (drive().join("pair_follower1.csv"), folder.join("fit"), folder.join("cases.csv"));
    let calibrated = stderr(&quick(&pair, &fit, &["--fix", "v_0=120"]));
    let simulated = stderr(&succeeds(&["simulate", text(&pair), "--result", text(&fit)]));
    let row = |v_0: u32| format!("1,platoon,1,4,{v_0},2,1.2,1.4,-2\n");
    let header = "model_id,platoon,follower_position,delta,v_0,d_0,t_h,a_max,a_min\n";
    let evaluated = |v_0| {
        fs::write(&cases, format!("{header}{}", row(v_0))).unwrap();
        stderr(&succeeds(&["evaluate", text(&cases), "--data", text(&drive())]))
    };
    for said in [&calibrated, &simulated, &evaluated(120)] {
        let warned =
            said.lines().filter(|line| line.starts_with("warning: ") && line.contains("v_0 = 120 m/s is far above"));
        assert_eq!(warned.count(), 1, "{said}");
        assert!(said.contains("is it in km/h? m/s are expected"), "{said}");
    }
    assert!(!evaluated(33).contains("far above"));
    // The command and its warnings stand in run.json.
    let run = json_of(fit.join("run.json"));
    let kept = run["warnings"].as_array().unwrap();
    assert!(kept.iter().any(|text| text.as_str().unwrap().contains("v_0 = 120 m/s is far above")), "{run}");
}

#[test]
fn intervals_of_a_drive_below_a_minute_are_said_to_be_too_narrow() {
    let (pair, out) = (drive().join("pair_follower1.csv"), scratch("cli_warnings", "short"));
    let fixed = ["delta=4", "v_0=33", "d_0=3", "a_max=1.5", "a_min=-3"].map(|fix| ["--fix", fix]).concat();
    let search = ["--model", "idm", "--max-evaluations", "2000", "--out", text(&out), "--to", "50"];
    let short = flat(&ok(&[&["calibrate", text(&pair)], &search[..], &fixed].concat()));
    assert!(short.contains("95 % intervals contained the truth in 89 (v_0) and 86 (d_0) of 100 cases"), "{short}");
}

/// Of a folder in which calibrations were mixed up, a report shows no charts of the wrong one, and says why.
#[test]
fn a_simulation_of_another_result_is_left_out_of_a_report() {
    let folder = scratch("cli_warnings", "mixed_up");
    let fit = |name: &str, more: &[&str]| {
        quick(&drive().join("pair_follower1.csv"), &folder.join(name), more);
        folder.join(name)
    };
    let own = fit("own", &[]);
    let report = || stderr(&succeeds(&["report", text(&own), "-o", text(&folder.join("page.html"))]));
    assert!(!report().contains("left out"));
    for (other, why) in [
        (fit("cut", &["--to", "30"]), "belongs to another drive"),
        (fit("fixed", &["--fix", "t_h=3"]), "of another result"),
    ] {
        fs::copy(other.join("simulation.csv"), own.join("simulation.csv")).unwrap();
        let said = report();
        assert!(said.contains(why) && said.contains("its charts are left out"), "{said}");
    }
}

#[test]
fn a_simulation_with_another_mass_is_warned_of() {
    let folder = scratch("cli_warnings", "mass");
    let (pair, fit) = (drive().join("pair_follower1.csv"), folder.join("fit"));
    let model = ["--model", "idm+nonlinear", "--vehicle", "bmw_x5", "--grade", "level"];
    let search = ["--max-evaluations", "100", "--no-intervals", "--out", text(&fit)];
    succeeds(&[&["calibrate", text(&pair)], &model[..], &search].concat());
    let simulate = || stderr(&succeeds(&["simulate", text(&pair), "--result", text(&fit)]));
    assert!(!simulate().contains("was calibrated with m_0"));
    let mut result = json_of(fit.join("result.json"));
    let mass = result["vehicle"]["m_0"].as_f64().unwrap();
    result["vehicle"]["m_0"] = (mass - 100.0).into();
    fs::write(fit.join("result.json"), result.to_string()).unwrap();
    let said = simulate();
    assert!(said.contains(&format!("was calibrated with m_0 = {} kg", mass - 100.0)), "{said}");
    assert!(said.contains(&format!("bmw_x5 now has {mass} kg")), "{said}");
}

/// The verdict on a fault says which parameters it changes, measured or corrected.
#[test]
fn parameters_are_compared_with_and_without_correction() {
    let folder = scratch("cli_warnings", "compared");
    succeeds(&["synth", "--out", text(&folder), "--duration", "300", "--pairs"]);
    let sound = fs::read_to_string(folder.join("pair_follower1.csv")).unwrap();
    let (file, out) = (folder.join("slow.csv"), folder.join("fit"));
    fs::write(&file, edited(&sound, |_, fields| scale(&mut fields[2], 0.96))).unwrap();
    let said = |more: &[&str]| {
        let search = ["--model", "idm", "--max-evaluations", "2000", "--no-intervals", "--out", text(&out)];
        flat(&ok(&[&["calibrate", text(&file)], &search[..], more].concat()))
    };
    let (measured, corrected) = (said(&[]), said(&["--correct"]));
    assert!(measured.contains(" because of this; --correct gives "), "{measured}");
    assert!(corrected.contains("corrected: ") && corrected.contains("; as measured: "), "{corrected}");
}

/// A report says which of its parts are missing or belong to another result.
#[test]
fn missing_charts_and_a_stale_export_are_said() {
    let folder = scratch("cli_warnings", "stale");
    let (pair, fit, page) = (drive().join("pair_follower1.csv"), folder.join("fit"), folder.join("page.html"));
    quick(&pair, &fit, &[]);
    succeeds(&["export", "sumo", text(&fit), "--no-run"]);
    let report = || stderr(&succeeds(&["report", text(&fit), "-o", text(&page)]));
    assert!(!report().contains("warning: "));
    let result = fs::read_to_string(fit.join("result.json")).unwrap();
    fs::write(fit.join("result.json"), result + "\n").unwrap();
    fs::remove_file(fit.join("simulation.csv")).unwrap();
    let said = report();
    assert!(said.contains("simulation.csv is missing, and so are its charts"), "{said}");
    assert!(said.contains("belongs to another result than") && said.contains("export it again"), "{said}");
}

/// Who drives, by the file, against the bounds; and a desired speed that is below the driven ones.
#[test]
fn bounds_for_another_driver_are_warned_of() {
    let folder = scratch("cli_warnings", "drivers");
    let driven_by = |driver: &str, pair: &str| {
        let sound = fs::read_to_string(drive().join(pair)).unwrap();
        let rows = sound.lines().enumerate();
        let file = folder.join(format!("{driver}.csv"));
        let text = rows.map(|(i, row)| format!("{row},{}\n", if i == 0 { "driver" } else { driver }));
        fs::write(&file, text.collect::<String>()).unwrap();
        file
    };
    let (human, machine) = (driven_by("Human", "pair_follower1.csv"), driven_by("ACC", "pair_follower2.csv"));
    let said = |files: &[&Path], more: &[&str]| {
        let out = folder.join(format!("fit{}", more.len()));
        let search = ["--model", "idm", "--max-evaluations", "100", "--no-intervals", "--out", text(&out)];
        let files: Vec<&str> = files.iter().map(|file| text(file)).collect();
        stderr(&succeeds(&[&["calibrate"], &files[..], &search, more].concat()))
    };
    let bounds = "the file names a human driver, but these bounds are for ACC cars; use --bounds human";
    assert!(said(&[&human], &[]).contains(bounds));
    assert!(
        !said(&[&human], &["--bounds", "human"]).contains("human driver") && !said(&[&machine], &[]).contains("human")
    );
    let both = said(&[&human, &machine], &["--joint"]);
    assert!(
        both.contains("have a human driver and a controller according to the files, but get the same parameters"),
        "{both}"
    );
    let slow = folder.join("slow.toml");
    fs::write(&slow, "v_0 = [5, 15]\n").unwrap();
    let slow = said(&[&machine], &["--bounds", text(&slow)]);
    assert!(slow.contains("but v_0 is searched up to 15 m/s: the model cannot keep up"), "{slow}");
}

/// A simulated car that ends early leads no other one.
#[test]
fn a_platoon_ends_behind_a_car_that_ends_early() {
    let fit = scratch("cli_warnings", "platoon_ends").join("fit");
    let (pair, platoon) = (drive().join("pair_follower1.csv"), drive().join("platoon.csv"));
    // Hardly any reaction to the car ahead: feasible until it brakes.
    let weak = ["k_s=0.01", "k_v=0.01", "k_0=5", "t_h=0.1", "d_0=1"].map(|fix| ["--fix", fix]).concat();
    let search = ["--model", "l-cth", "--max-evaluations", "100", "--no-intervals", "--to", "40", "--out", text(&fit)];
    succeeds(&[&["calibrate", text(&pair)], &search[..], &weak].concat());
    let said = stderr(&leadlag(&["simulate", text(&platoon), "--platoon", "--result", text(&fit)]));
    assert!(said.contains("the platoon ends here because the simulation of the car ahead ended early"), "{said}");
}
