//! Plans: their studies, and the messages about invalid ones.

use super::common::{data, fails, flat, json_of, leadlag, ok, plan_text, refused, scratch, stderr, text};
use leadlag::internal::study::{Plan, Study};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Ids of the tasks of a plan, as printed.
fn ids(name: &str, plan: &str) -> Vec<String> {
    let folder = scratch(name);
    let file = folder.join("plan.toml");
    fs::write(&file, plan).unwrap();
    let lines = ok(&["study", "plan", text(&file), "--out", text(&folder.join("study"))]);
    let written = fs::read_to_string(folder.join("study/tasks.jsonl")).unwrap();
    assert_eq!(lines.lines().count(), written.lines().count(), "one task per line, here and there");
    lines.lines().map(|line| line.split('\t').next().unwrap().to_owned()).collect()
}

#[test]
fn an_id_changes_with_all_that_decides_a_result_and_with_nothing_else() {
    let plan = plan_text(2, 300);
    let first = ids("ids", &plan);
    assert_eq!(first.len(), 24);
    assert_eq!(first.iter().collect::<BTreeSet<_>>().len(), 24, "ids are unique");
    assert!(first.iter().all(|id| id.len() == 32 && id.bytes().all(|b| b.is_ascii_hexdigit())));
    let commented = format!("# a comment\n{plan}");
    assert_eq!(first, ids("ids_comment", &commented), "comments decide nothing");
    let named = plan.replace("schema_version = 1", "schema_version = 1\nname = \"other\"");
    assert_eq!(first, ids("ids_name", &named), "nor does the name");
    for (name, from, to) in [
        ("evaluations", "max_evaluations = 300", "max_evaluations = 301"),
        ("seed", "[calibration]", "[calibration]\nseed = 2"),
        ("convention", "[calibration]", "[calibration]\nconvention = \"authors\""),
        ("gof", "[calibration]", "[calibration]\ngof = [\"rmse-s\"]"),
        ("evaluator", "[calibration]", "[calibration]\nevaluator = \"reference\""),
        ("precision", "[calibration]", "[calibration]\nprecision = \"f64\""),
        ("window", "followers = [1, 2]", "followers = [1, 2]\nto_s = 50"),
        ("smooth", "followers = [1, 2]", "followers = [1, 2]\nsmooth = true"),
        ("validation", "[calibration]", "[validation]\non = \"none\"\n\n[calibration]"),
        ("bounds", "max_evaluations = 300", "max_evaluations = 300\n[calibration.bounds]\nv_0 = [30, 34]"),
    ] {
        let changed = ids(&format!("ids_{name}"), &plan.replace(from, to));
        assert!(changed.iter().all(|id| !first.contains(id)), "{name} decides the result");
    }
    let more: BTreeSet<String> = ids("ids_more", &plan_text(3, 300)).into_iter().collect();
    assert!(first.iter().all(|id| more.contains(id)), "more replicates leave the first ones as they are");
}

/// A plan in the working directory that names no data folder finds its files beside it.
#[test]
fn a_plan_in_the_working_directory_needs_no_folder() {
    let folder = scratch("here");
    fs::copy(data().join("one/platoon.csv"), folder.join("S1.csv")).unwrap();
    let plan = "schema_version = 1\n[data]\n[[platoon]]\nname = \"S1\"\nfile = \"S1.csv\"\nfollowers = [1]\n\
                [calibration]\nvariants = [\"idm\"]\nmax_evaluations = 300\n";
    fs::write(folder.join("plan.toml"), plan).unwrap();
    for words in [&["plan", "plan.toml", "--out", "study"][..], &["run", "study"]] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_leadlag"));
        let output = command.arg("study").args(words).current_dir(&folder).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
    }
}

#[test]
fn a_plan_says_what_it_uses_within_80_columns() {
    let folder = scratch("columns_80");
    let file = folder.join("plan.toml");
    fs::write(&file, plan_text(1, 300)).unwrap();
    let study = folder.join("study");
    let plan = ["study", "plan", text(&file), "--out", text(&study)];
    let short = stderr(&leadlag(&plan));
    assert!(short.contains("4 trajectories of 2 files; changes to ") && !short.contains("sha256"), "{short}");
    let output = leadlag(&[&plan[..], &["--verbose"]].concat());
    let said = stderr(&output);
    let flat = flat(&said);
    for expected in [
        "S2 uses two/platoon.csv sha256 ",
        " follower 2, ",
        "12 tasks = 4 trajectories x 3 variants x 1 goodness-of-fit function x 1 replicate; 12 validation runs",
    ] {
        assert!(flat.contains(expected), "expected {expected}\nfound {said}");
    }
    let long = said.lines().filter(|line| !line.contains(text(&folder))).find(|line| line.chars().count() > 80);
    assert_eq!(long, None);
}

#[test]
fn variants_are_given_by_id_name_range_or_all() {
    let count = |variants: &str| {
        let plan = plan_text(1, 300).replace("[\"idm\", \"l-cth+linear\", 28]", variants);
        // Synthetic cars have no known mass, so variants that need one are out of reach here.
        ids("variants", &plan).len() / 4
    };
    assert_eq!(count("[\"1-2\", 19]"), 3);
    assert_eq!(count("[\"gipps+delay\", \"4-5\", \"l-idm+constant\"]"), 4);
}

/// Error of a plan with one text replaced.
#[test]
fn bad_plans_say_where_what_and_what_to_do() {
    let plan = plan_text(2, 300);
    let file = scratch("bad").join("bad.toml");
    let out = file.with_file_name("study");
    let table: &[(&str, &str, &str)] = &[
        (
            "replicates = 2",
            "replicate = 2",
            ":19:1: unknown key `replicate`, expected one of `variants`, `extend`, `gof`, `convention`",
        ),
        ("replicates = 2", "replicate = 2", "; did you mean `replicates`?"),
        // Columns are characters.
        ("replicates = 2", "seed = \"é\" 7", ":19:12: unexpected key or value"),
        ("[calibration]", "[calibraton]", "unknown key `calibraton`"),
        ("[calibration]", "[calibraton]", "did you mean `calibration`?"),
        ("schema_version = 1", "schema_version = 2", ": schema_version: expected 1, found 2"),
        ("schema_version = 1", "", "missing key `schema_version`"),
        ("schema_version = 1", "schema_version = ", "bad.toml:1:"),
        ("\"idm\"", "\"idn\"", "calibration.variants: variant `idn`: `idn` is not a part"),
        ("\"idm\"", "\"idn\"", "; did you mean `idm`?"),
        ("\"idm\"", "\"1-91\"", "calibration.variants: variant 91: expected an id from 1 to 90"),
        ("\"idm\"", "\"9-1\"", "calibration.variants: expected a range FIRST-LAST, found `9-1`"),
        ("\"idm\"", "\"l-cth+linear\"", "calibration.variants: l-cth+linear occurs more than once"),
        ("[\"idm\", \"l-cth+linear\", 28]", "[]", "calibration.variants: expected at least one"),
        ("\"ga\"", "\"gaa\"", "calibration.optimizer: optimizer `gaa`"),
        ("\"ga\"", "\"gaa\"", "did you mean `ga`?"),
        ("replicates = 2", "replicates = 0", "calibration.replicates: expected at least 1, found 0"),
        (
            "replicates = 2",
            "replicates = \"two\"",
            "replicates: invalid type: string \"two\", expected a whole number from 0",
        ),
        ("replicates = 2", "seed = -1", "seed: invalid value: integer `-1`, expected a whole number from 0"),
        (
            "max_evaluations = 300",
            "max_evaluations = 99",
            "calibration.max_evaluations: expected at least 100, found 99",
        ),
        (
            "followers = [1, 2]",
            "followers = \"one\"",
            "followers: invalid type: string \"one\", expected a whole number from 0",
        ),
        (
            "followers = [1, 2]",
            "followers = [1, -2]",
            "followers: invalid value: integer `-2`, expected a whole number from 0",
        ),
        ("[\"idm\", \"l-cth+linear\", 28]", "[\"idm\", 1.5]", "variants: expected ids and names of variants"),
        ("replicates = 2", "replicates = 100001", "calibration.replicates: expected at most 100000, found 100001"),
        ("replicates = 2", "gof = [\"nrmse-svaa\"]", "did you mean `nrmse-sva`?"),
        ("replicates = 2", "gof = [\"rmse-s\", \"rmse_s\"]", "calibration.gof: rmse-s occurs more than once"),
        (
            "replicates = 2",
            "evaluator = \"lane\"",
            "expected lanes, reference, gpu or auto, found `lane`; did you mean `lanes`?",
        ),
        (
            "replicates = 2",
            "evaluator = \"gpu\"\nprecision = \"f64\"",
            "calibration.precision: precision f64 needs evaluator lanes",
        ),
        ("replicates = 2", "convention = \"author\"", "did you mean `authors`?"),
        (
            "max_evaluations = 300",
            "bounds = { f_2 = [0, 1] }",
            "calibration.bounds.f_2: not a parameter of any variant of this plan",
        ),
        ("max_evaluations = 300", "bounds = \"humans\"", "did you mean `human`?"),
        ("max_evaluations = 300", "bounds = { set = \"humans\" }", "calibration.bounds.set: expected"),
        ("max_evaluations = 300", "bounds = 3", "calibration.bounds: expected a set, such as \"human\", or a table"),
        (
            "max_evaluations = 300",
            "bounds = { v0 = 3 }",
            "calibration.bounds.v0: not a parameter of any variant of this plan; did you mean `v_0`?",
        ),
        (
            "max_evaluations = 300",
            "bounds = { v_0 = [40, 30] }",
            "calibration.bounds.v_0: expected [lower, upper] in order",
        ),
        ("[calibration]", "[validation]\non = \"same-vehicel\"\n[calibration]", "did you mean `same-vehicle`?"),
        ("name = \"S2\"", "name = \"S1\"", "platoon S1: name: occurs more than once"),
        ("name = \"S2\"", "name = \"S 2\"", "platoon S 2: name: expected letters, digits"),
        ("followers = [1, 2]", "followers = [0]", "platoon S1: followers: expected numbers from 1"),
        ("followers = [1, 2]", "layout = \"openac\"", "did you mean `openacc`?"),
    ];
    for (from, to, message) in table {
        fs::write(&file, plan.replacen(from, to, 1)).unwrap();
        refused(2, &["study", "plan", text(&file), "--out", text(&out)]).says(message);
        assert!(!out.exists(), "{to}: nothing is written");
    }
}

/// A set of bounds is named, and may be changed in parts.
#[test]
fn bounds_are_a_set_or_single_ones() {
    let bounds = |given: &str| {
        let plan = plan_text(1, 300)
            .replace("\"l-cth+linear\"", "\"idm+delay\"")
            .replace("max_evaluations = 300", &format!("max_evaluations = 300\nbounds = {given}"));
        Plan::parse(&plan, "plan.toml", Path::new(""), "plan").expect("a plan").calibration.bounds
    };
    let human = bounds("\"human\"");
    assert!(human["t_h"][1] > 2.5 && human.contains_key("tau_p"), "{human:?}");
    let mut changed = human.clone();
    changed.insert("t_h".to_owned(), [0.5, 1.5]);
    assert_eq!(bounds("{ set = \"human\", t_h = [0.5, 1.5] }"), changed);
    assert!(bounds("\"acc\"").is_empty());
}

/// A driver whose id occurs in two files is one driver, and a warning names drivers without validation.
#[test]
fn a_driver_is_known_by_the_id_in_training_and_test() {
    let folder = scratch("drivers");
    let table = |ids: [&str; 2]| {
        let mut table = "driver,t,vl,v,gap\n".to_owned();
        for (k, id) in ids.iter().enumerate() {
            for step in 0..300 {
                let t = f64::from(step) / 10.0;
                let v = 15.0 + 2.0 * (t / (3.0 + k as f64)).sin();
                table += &format!("{id},{t:.1},{v:.3},{:.3},{:.3}\n", v - 0.1, 20.0 + 0.1 * t);
            }
        }
        table
    };
    let map = "rows = \"pairs\"\n[columns]\ngroup = { name = \"driver\" }\ntime = { name = \"t\", unit = \"s\" }\n\
               speed = { name = \"v\", unit = \"m/s\" }\nlead_speed = { name = \"vl\", unit = \"m/s\" }\n\
               gap = { name = \"gap\", unit = \"m\" }\n";
    fs::write(folder.join("own.toml"), map).unwrap();
    fs::write(folder.join("train.csv"), table(["D01", "D02"])).unwrap();
    let entry = |name: &str, file: &str| {
        format!("[[platoon]]\nname = \"{name}\"\ntable = \"{file}\"\ncolumns = \"own.toml\"\ntrajectories = \"all\"\n")
    };
    let plan = format!(
        "schema_version = 1\n[data]\n{}{}[calibration]\nvariants = [\"idm\"]\nmax_evaluations = 200\n",
        entry("A", "train.csv"),
        entry("B", "test.csv")
    );
    let file = folder.join("plan.toml");
    fs::write(&file, plan).unwrap();
    let said = |ids| {
        fs::write(folder.join("test.csv"), table(ids)).unwrap();
        stderr(&leadlag(&["study", "plan", text(&file), "--out", text(&folder.join("study"))]))
    };
    let same = said(["D01", "D03"]);
    assert!(same.contains("2 validation runs") && !same.contains("nothing is validated"), "{same}");
    let other = flat(&said(["D03", "D04"]));
    assert!(other.contains("0 validation runs") && other.contains("the followers are D01, D02, D03, D04"), "{other}");
}

/// Three cars in a row, distinguished by ids, with their lengths \[m\], in a table that only a column map can read: cars.csv, own.toml.
fn three_cars(folder: &Path, frames: u32, lengths: [f64; 3]) {
    let mut table = "t,car,front,x,v,l\n".to_owned();
    for (car, length) in (1..).zip(lengths) {
        for frame in 0..frames {
            let t = f64::from(frame) / 10.0;
            let x = 500.0 - 30.0 * f64::from(car) + 15.0 * t;
            table += &format!("{t:.1},{car},{},{x:.3},15,{length}\n", car - 1);
        }
    }
    fs::write(folder.join("cars.csv"), table).unwrap();
    let map = "rows = \"vehicles\"\nnobody = [\"0\"]\n[columns]\ntime = { name = \"t\", unit = \"s\" }\nid = { name = \"car\" }\n\
               ahead = { name = \"front\" }\nposition = { name = \"x\", unit = \"m\" }\nspeed = { name = \"v\", unit = \"m/s\" }\n\
               length = { name = \"l\", unit = \"m\" }\n";
    fs::write(folder.join("own.toml"), map).unwrap();
}

#[test]
fn a_table_with_a_column_map_gives_the_pair_that_the_plan_names() {
    let folder = scratch("columns");
    three_cars(&folder, 600, [4.5; 3]);
    let (file, out) = (folder.join("plan.toml"), folder.join("study"));
    let plan = |more: &str| {
        let content = format!(
            "schema_version = 1\n[data]\n[[platoon]]\nname = \"T\"\nfile = \"cars.csv\"\n{more}\n[calibration]\nvariants = [\"idm\"]\n\
             max_evaluations = 200\n"
        );
        fs::write(&file, content).unwrap();
        ["study", "plan", text(&file), "--out", text(&out)].map(str::to_owned)
    };
    let refused = |more: &str| {
        let arguments = plan(more);
        fails(&arguments.each_ref().map(String::as_str)).1
    };
    let own = "columns = \"own.toml\"";
    let said = refused(own);
    assert!(said.contains("platoon T follower 1: 2 trajectories") && said.contains("trajectory 3-2"), "{said}");
    assert!(refused(&format!("{own}\ntrajectory = \"9-8\"")).contains("9-8"));
    assert!(refused(&format!("{own}\nlayout = \"openacc\"")).contains("platoon T: layout: not together with columns"));
    let said = refused("columns = \"ngsm\"");
    assert!(said.contains("platoon T: columns") && said.contains("did you mean ngsim?"), "{said}");

    let arguments = plan(&format!("{own}\ntrajectory = \"3-2\""));
    ok(&arguments.each_ref().map(String::as_str));
    ok(&["study", "run", text(&out)]);
    let study = json_of(out.join("study.json"));
    assert_eq!(
        (study["drives"][0]["samples"].as_u64(), study["drives"].as_array().map(Vec::len)),
        (Some(600), Some(1))
    );
    let notes = study["drives"][0]["notes"].to_string();
    assert!(notes.contains("own.toml") && !notes.contains(text(&folder)), "the folder is no part of a study: {notes}");
}

#[test]
fn data_that_are_not_there_say_how_to_name_others() {
    let file = scratch("no_data").join("plan.toml");
    let out = file.with_file_name("study");
    // As in `calibrate`: 1 for unreadable files, 2 for requests of missing items.
    for (expected, from, to, message) in [
        (
            1,
            "two/platoon.csv",
            "three/platoon.csv",
            "platoon S2; `--data DIR` names another data folder than the plan does",
        ),
        (2, "followers = [1, 2]", "followers = [7]", "platoon S1\n  because: "),
        (2, "followers = [1, 2]", "trajectory = \"9\"", "no trajectory 9"),
        (2, "followers = [1, 2]", "vehicle = \"trabant\"", "trabant"),
        (2, "28]", "7]", "S1 follower 1: variant idm+nonlinear needs the follower's vehicle; name it in the plan"),
    ] {
        fs::write(&file, plan_text(2, 300).replacen(from, to, 1)).unwrap();
        let (code, said) = fails(&["study", "plan", text(&file), "--out", text(&out)]);
        assert_eq!(code, expected, "{said}");
        assert!(said.contains(message), "{message}: {said}");
    }
    fs::write(&file, plan_text(2, 300).replace("two/platoon.csv", "three/platoon.csv")).unwrap();
    let (_, said) = fails(&["study", "plan", text(&file), "--out", text(&out)]);
    let missing = data().join("three/platoon.csv");
    assert!(said.starts_with(&format!("error: {}: no such file", missing.display())), "the file first: {said}");
    refused(1, &["study", "plan", text(&data().join("no.toml"))]).says("no.toml: cannot read the plan");
}

#[test]
fn a_plan_or_nothing_instead_of_a_folder_says_what_to_do() {
    let folder = scratch("no_study");
    let file = folder.join("plan.toml");
    fs::write(&file, plan_text(1, 300)).unwrap();
    for verb in ["run", "status", "merge"] {
        refused(2, &["study", verb, text(&file)])
            .says("expected a study folder, found a file; make one with `leadlag study plan ");
        refused(1, &["study", verb, text(&folder.join("none"))])
            .says("expected a study folder; make one with `leadlag study plan PLAN.toml --out ");
    }
}

#[test]
fn the_plans_that_come_with_the_program_can_be_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/plans");
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("examples/plans is there") {
        let path = entry.unwrap().path();
        let plan = leadlag::internal::study::Plan::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let of = &plan.calibration;
        let per_trajectory = (of.variants.len() * of.gofs.len()) as u64 * of.replicates;
        found.push((plan.name, per_trajectory, plan.data.platoons.len()));
    }
    found.sort();
    assert_eq!(
        found.iter().map(|(name, ..)| name.as_str()).collect::<Vec<_>>(),
        ["figure7", "laws", "paper", "processed", "small"]
    );
    assert_eq!((found[0].1, found[0].2), (180, 3), "30 variants, 6 goodness-of-fit functions, 3 platoons");
    assert_eq!((found[1].1, found[1].2), (42, 7), "five base models and nine laws, 3 replicates, 7 platoons");
    assert_eq!((found[2].1, found[2].2), (900, 7), "the paper: 90 variants, 10 replicates, 7 platoons");
    assert_eq!((found[3].1, found[3].2), (270, 3), "90 variants, 3 replicates, 3 platoons");
}

/// Cars 1, 2, 3 in a row, of 4, 12 and 5 m; the named pair, not the first of the file, gives the car ahead.
#[test]
fn the_length_of_the_car_ahead_is_that_of_the_pair_that_the_plan_names() {
    let folder = scratch("lengths");
    three_cars(&folder, 100, [4.0, 12.0, 5.0]);
    for (trajectory, expected) in [("2-1", 4.0), ("3-2", 12.0)] {
        let content = format!(
            "schema_version = 1\n[data]\n[[platoon]]\nname = \"T\"\nfile = \"cars.csv\"\ncolumns = \"own.toml\"\n\
             trajectory = \"{trajectory}\"\nleader_start_m = 0.0\n[calibration]\nvariants = [\"idm\"]\n"
        );
        let plan = Plan::parse(&content, "plan.toml", &folder, "lengths").unwrap_or_else(|error| panic!("{error}"));
        let study = Study::open(plan).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(study.drives[0].trajectory.len_l, expected, "{trajectory}");
    }
}

/// Into a pipe the tasks are listed; on a terminal a plan with thousands of them shows their number.
#[cfg(target_os = "linux")]
#[test]
fn tasks_are_listed_on_a_terminal_only_when_asked_for() {
    let folder = scratch("terminal");
    let (file, out) = (folder.join("plan.toml"), folder.join("study"));
    fs::write(&file, plan_text(2, 300)).unwrap();
    let listed = |flag: &str| {
        let plan =
            format!("'{}' study plan {} --out {} {flag}", env!("CARGO_BIN_EXE_leadlag"), text(&file), text(&out));
        let mut on_a_terminal = std::process::Command::new("script");
        on_a_terminal.args(["-qec", &plan, "/dev/null"]).stdin(std::process::Stdio::null());
        let output = on_a_terminal.output().ok()?;
        let shown = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(shown.contains("24 tasks = "), "{shown}");
        Some(shown.lines().filter(|line| line.contains("\tnrmse-sva\t")).count())
    };
    let Some(plain) = listed("") else {
        eprintln!("SKIPPED tasks_are_listed_on_a_terminal_only_when_asked_for: no `script` to make a terminal");
        return;
    };
    assert_eq!((plain, listed("--tasks")), (0, Some(24)));
}

#[test]
fn a_list_of_one_needs_no_brackets() {
    let listed = plan_text(1, 300)
        .replace("[\"idm\", \"l-cth+linear\", 28]", "[\"idm\"]")
        .replace("followers = [1, 2]", "followers = [1]")
        .replace("replicates = 1", "replicates = 1\ngof = [\"rmse-s\"]");
    let plain = listed.replace("[\"idm\"]", "\"idm\"").replace("[1]", "1").replace("[\"rmse-s\"]", "\"rmse-s\"");
    assert_eq!(ids("list_of_one", &listed), ids("one", &plain));
}

#[test]
fn a_plan_of_ones_own_is_not_replaced_by_the_copy_of_another() {
    let folder = scratch("own_plan");
    let (own, other) = (folder.join("plan.toml"), folder.join("other.toml"));
    fs::write(&own, "precious").unwrap();
    fs::write(&other, plan_text(1, 300)).unwrap();
    refused(2, &["study", "plan", text(&other), "--out", text(&folder)])
        .says("another plan, which the study's copy of this one would replace");
    assert_eq!(fs::read_to_string(&own).unwrap(), "precious");
    // The plan itself may stay in place.
    fs::rename(&other, &own).unwrap();
    ok(&["study", "plan", text(&own), "--out", text(&folder)]);
}

#[test]
fn a_file_that_is_validated_on_itself_is_warned_of() {
    let file = scratch("itself").join("plan.toml");
    let plan = |second: &str| {
        fs::write(&file, plan_text(1, 300).replace("two/platoon.csv\"", second)).unwrap();
        stderr(&leadlag(&["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))]))
    };
    let said = plan("one/platoon.csv\"\nfrom_s = 30").replace('\n', " ");
    assert!(said.contains("S1 follower 1 and S2 follower 1 share 301 of 601 and 301 samples"), "{said}");
    let said = plan("two/platoon.csv\"");
    assert!(!said.contains(" share "), "{said}");
    // Two halves of one file are separate drives that share a sample.
    let halves = plan_text(1, 300).replace("one/platoon.csv\"", "one/platoon.csv\"\nto_s = 30");
    fs::write(&file, halves.replace("two/platoon.csv\"", "one/platoon.csv\"\nfrom_s = 30")).unwrap();
    let said = stderr(&leadlag(&["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))]));
    assert!(!said.contains(" share "), "{said}");
}

/// The runs grow with the square of the platoons: 420 of them, ten variants and three goodness-of-fit functions.
#[test]
fn a_plan_that_validates_everything_on_everything_is_refused() {
    let file = scratch("square").join("plan.toml");
    let (head, rest) = plan_text(1, 300).split_once("[[platoon]]").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    let (platoon, _) = rest.split_once("[[platoon]]").unwrap();
    let platoons: String =
        (0..420).map(|k| format!("[[platoon]]{}", platoon.replace("S1", &format!("S{k}")))).collect();
    let settings = "[calibration]\nvariants = [1, 2, 3, 4, 5, 6, 19, 20, 21, 37]\ngof = [\"nrmse-s\", \"nrmse-v\", \"rmse-s\"]\n\
                    replicates = 1\nseed = 1\noptimizer = \"ga\"\nmax_evaluations = 300\n";
    let plan = format!("{head}{platoons}{settings}");
    fs::write(&file, &plan).unwrap();
    let out = file.with_file_name("study");
    let said = refused(1, &["study", "plan", text(&file), "--out", text(&out)])
        .says("validation runs, expected at most 5000000")
        .says("set validation.on = \"none\"")
        .0;
    assert!(!out.exists(), "{said}");
}

#[test]
fn a_fault_of_the_data_is_warned_of_by_the_plan() {
    let folder = scratch("faulty_data");
    fs::create_dir_all(folder.join("one")).expect("writable");
    let platoon = fs::read_to_string(data().join("one/platoon.csv")).expect("it was made");
    let mut rows = platoon.lines().skip_while(|line| !line.starts_with("Time")).collect::<Vec<_>>();
    let header: Vec<&str> = rows.remove(0).split(',').collect();
    let [t, v_l, v, gap] = ["Time", "Speed1", "Speed2", "IVS1"]
        .map(|name| header.iter().position(|column| *column == name).expect("OpenACC"));
    let mut pair = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for (k, row) in rows.iter().enumerate() {
        let fields: Vec<&str> = row.split(',').collect();
        let off = if k % 97 == 50 { 20.0 } else { 0.0 };
        let spacing = fields[gap].parse::<f64>().expect("a number") + off;
        pair += &format!("{},{},{},{spacing}\n", fields[t], fields[v_l], fields[v]);
    }
    fs::write(folder.join("pair.csv"), pair).expect("writable");
    let plan = folder.join("plan.toml");
    let content = format!(
        "schema_version = 1\n[data]\nfolder = \"{}\"\n[[platoon]]\nname = \"P\"\nfile = \"pair.csv\"\nfollowers = [1]\n\
         [calibration]\nvariants = [\"idm\"]\ngof = [\"nrmse-s\"]\nreplicates = 1\n",
        text(&folder)
    );
    fs::write(&plan, content).expect("writable");
    let out = folder.join("study");
    let said = stderr(&leadlag(&["study", "plan", text(&plan), "--out", text(&out)]));
    assert!(
        said.contains("spacing_m: ") && said.contains("samples are spikes") && said.contains("--correct"),
        "{said}"
    );
}
