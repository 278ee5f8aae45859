//! A user's law in a file can do everything that a base model of the paper can.

use crate::common::program::{fails, json_of, ok, scratch, text};
use crate::common::tolerance::WHOLE_RUN;
use leadlag::{Calibration, Fit, Law, Study, read, synthetic};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

/// The full velocity difference model (Jiang, Wu, Zhu 2001), as a user would write it.
pub const FVDM: &str = "//! Full velocity difference model with a linear optimal speed.
struct Parameters {
    v_0: f32,
    d_0: f32,
    t_h: f32,
    /// rate of the relaxation to the optimal speed [1/s], 0.01 to 3
    kappa: f32,
    /// gain for the speed difference [1/s], 0 to 3
    lambda: f32,
}

fn my_fvdm_law(own: Parameters, x: Perceived) -> f32 {
    let optimal = clamp((x.s - own.d_0) / own.t_h, 0.0, own.v_0);
    return own.kappa * (optimal - x.v_f) + own.lambda * (x.v_l - x.v_f);
}
";

/// A law without a kink: the acceleration tends to its bounds as the error of the spacing grows.
const SMOOTH: &str = "//! A spacing policy whose acceleration has a smooth bound.
struct Parameters {
    d_0: f32,
    t_h: f32,
    a_max: f32,
    /// gain for the spacing [1/s^2], 0.01 to 1
    gain: f32,
    /// gain for the speed difference [1/s], 0 to 2
    damping: f32,
}

fn my_smooth_law(own: Parameters, x: Perceived) -> f32 {
    let wanted = own.gain * (x.s - own.d_0 - own.t_h * x.v_f) + own.damping * (x.v_l - x.v_f);
    let share = wanted / own.a_max;
    return wanted / sqrt(1.0 + share * share);
}
";

struct Drive {
    folder: PathBuf,
    file: PathBuf,
    law: PathBuf,
}

fn drive(name: &str, duration: &str) -> Drive {
    let folder = scratch("own_law", name);
    ok(&["synth", "--out", text(&folder), "--seed", "1", "--duration", duration, "--pairs"]);
    let law = folder.join("my_fvdm.wgsl");
    fs::write(&law, FVDM).expect("the folder can be written");
    Drive { file: folder.join("pair_follower1.csv"), folder, law }
}

#[test]
fn it_is_calibrated_and_its_result_needs_no_file() {
    let Drive { folder, file, law } = drive("calibrated", "60");
    let out = folder.join("out");
    let model = format!("{}+delay+linear", text(&law));
    let words = ["--model", &model, "--bounds", "human", "--max-evaluations", "2000", "--out", text(&out)];
    let told = ok(&[&["calibrate", text(&file)][..], &words].concat());
    assert!(told.contains("my_fvdm+delay+linear") && told.contains("rate of the relaxation"), "{told}");
    let result = json_of(out.join("result.json"));
    // The parameters of the paper that it names, those of the parts, and its own; all of them are read.
    let names: Vec<&str> = result["parameters"].as_object().expect("a table").keys().map(String::as_str).collect();
    assert_eq!(names, ["v_0", "d_0", "t_h", "tau_p", "tau_a", "kappa", "lambda"]);
    assert_eq!(result["bounds"]["v_0"], serde_json::json!([1.0, 70.0]), "of the set, as for every model");
    assert_eq!(result["law"]["text"], FVDM);
    assert_eq!((&result["model_id"], &result["extensions"]), (&Value::from(0), &serde_json::json!([])));
    fs::remove_file(&law).expect("it is there");

    let other = folder.join("pair_follower2.csv");
    let (result, simulated) = (out.join("result.json"), folder.join("simulated.csv"));
    let told = ok(&["simulate", "--result", text(&result), text(&other), "--out", text(&simulated)]);
    assert!(told.contains("NRMSE"), "{told}");
    let page = folder.join("page.html");
    ok(&["report", text(&out), "--out", text(&page)]);
    assert!(fs::read_to_string(page).expect("it was written").contains("my_fvdm+delay+linear"));

    // From its text in the library: the same bytes.
    let model = Law::from_text("my_fvdm", FVDM).and_then(|law| law.with("+delay+linear")).expect("a law");
    let fit = model
        .calibration()
        .bounds("human")
        .max_evaluations(2000)
        .run(&read(&file).expect("sound").follower(1).expect("there"));
    let written = fs::read_to_string(out.join("result.json")).expect("it was written");
    assert_eq!(fit.expect("feasible").to_json(), written);
}

/// Calibration by derivatives needs only the text of a law: on an unknown law and on others it reaches the result of a long search by
/// scores, with a fraction of its simulations. The share is the gain at which a descent ends.
#[test]
fn auto_comes_as_far_as_a_long_search() {
    const LONG: u64 = 40_000;
    let drive = synthetic(1, 40.0).and_then(|made| made.follower(1)).expect("sound");
    let stranger = Law::from_text("my_smooth", SMOOTH).and_then(|law| law.with("")).expect("a law");
    let built_in = ["helly", "fvdm", "iidm"].map(|name| Calibration::of(name).expect("a law"));
    for calibration in std::iter::once(stranger.calibration()).chain(built_in) {
        let calibration = calibration.bounds("human").intervals(false);
        let auto = calibration.run(&drive).expect("feasible");
        let scored = calibration.clone().optimizer("lshade").expect("there is").max_evaluations(LONG);
        let long = scored.run(&drive).expect("feasible");
        let evaluations = |fit: &Fit| {
            let result: Value = serde_json::from_str(&fit.to_json()).expect("JSON");
            result["replicates"][0]["evaluations"].as_u64().expect("a number")
        };
        let (model, [fast, slow]) = (calibration.model(), [&auto, &long].map(evaluations));
        let told = format!("{model}: {} after {fast}, {} after {slow}", auto.score(), long.score());
        println!("{told}");
        assert!(auto.score() <= long.score() * (1.0 + 1e-6), "{told}");
        assert!(fast < LONG / 2, "{told}");
    }
}

#[test]
fn it_is_evaluated_in_tables_and_computed_alike_by_all() {
    let Drive { folder, law, .. } = drive("evaluated", "40");
    let table = folder.join("cases.csv");
    let model = format!("{}+delay", text(&law));
    let lines = [
        "variant,platoon,follower_position,v_0,d_0,t_h,tau_p,kappa,lambda,delta,a_max,a_min".to_owned(),
        format!("{model},platoon,1,30,2,1.2,0.3,0.3,0.6,,,"),
        "idm,platoon,1,30,2,1.2,,,,4,1.5,-2".to_owned(),
        "fvdm,platoon,1,30,,,,0.3,0.6,,,".to_owned(),
        format!("{},platoon,1,30,2,1.2,0.3,0.3,0.6,,,", model.replace("my_fvdm.wgsl", "other/my_fvdm.wgsl")),
    ];
    // Another law of the same name.
    fs::create_dir(folder.join("other")).expect("the folder can be written");
    fs::write(folder.join("other/my_fvdm.wgsl"), FVDM.replace("own.kappa *", "0.5 * own.kappa *")).expect("it can");
    fs::write(&table, lines.join("\n") + "\n").expect("the folder can be written");
    let told = |evaluator: &[&str]| {
        let out = folder.join("out.csv");
        let words = ["evaluate", text(&table), "--data", text(&folder), "--out", text(&out)];
        ok(&[&words[..], evaluator].concat());
        fs::read_to_string(out).expect("it was written")
    };
    let exact = told(&["--evaluator", "lanes", "--precision", "f64"]);
    let rows: Vec<&str> = exact.lines().collect();
    assert_eq!(rows.len(), 5, "{exact}");
    assert!(rows[3].contains("ds: variant fvdm needs this parameter, but there is no such column"), "{exact}");
    let score = |text: &str, row: usize| -> f64 {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let column = reader.headers().expect("a header").iter().position(|name| name == "nrmse_sva").expect("there");
        let found = reader.records().nth(row).expect("a row").expect("sound")[column].to_owned();
        found.parse().unwrap_or_else(|_| panic!("{found}: {text}"))
    };
    let plain = told(&["--evaluator", "lanes"]);
    assert!((score(&plain, 0) / score(&exact, 0) - 1.0).abs() < 1e-4, "{plain}{exact}");
    assert!(score(&exact, 1) > 0.0);
    assert!((score(&exact, 3) / score(&exact, 0) - 1.0).abs() > 1e-3, "each row has its own law: {exact}");
}

#[test]
fn it_is_studied_beside_others() {
    let Drive { folder, law, .. } = drive("studied", "40");
    let plan = folder.join("plan.toml");
    fs::write(
        &plan,
        r#"schema_version = 1
[data]
folder = "."
[[platoon]]
name = "A"
file = "pair_follower1.csv"
[[platoon]]
name = "B"
file = "pair_follower2.csv"
[calibration]
variants = ["idm", "my_fvdm.wgsl", "my_fvdm.wgsl+delay", "ovm", "krauss"]
max_evaluations = 500
bounds = { kappa = [0.1, 1.0] }
"#,
    )
    .expect("the folder can be written");
    let study = folder.join("study");
    ok(&["study", "plan", text(&plan), "--out", text(&study)]);
    // The text stored in the study is enough.
    fs::remove_file(&law).expect("it is there");
    fs::remove_file(&plan).expect("it is there");
    let by_library = Study::open(&study).expect("it is there");
    by_library.run(&|| false, &mut |_, _| ()).expect("it can be");
    ok(&["study", "run", text(&study)]);
    ok(&["study", "merge", text(&study)]);
    let [calibrations, _] = by_library.merged().expect("they are there");
    let merged = fs::read(study.join("merged/calibrations.csv")).expect("it was written");
    assert_eq!(leadlag::internal::report::csv::write(&calibrations), merged);
    ok(&["study", "report", text(&study), "--out", text(&folder.join("report"))]);
    let mut merged = csv::Reader::from_path(study.join("merged/calibrations.csv")).expect("it was written");
    let header = merged.headers().expect("a header").clone();
    let of = |row: &csv::StringRecord, name: &str| row[header.iter().position(|h| h == name).expect(name)].to_owned();
    let rows: Vec<csv::StringRecord> = merged.records().map(|row| row.expect("sound")).collect();
    assert_eq!(rows.len(), 10);
    for row in &rows {
        let (base, own) = (of(row, "base"), of(row, "kappa_per_s"));
        assert_eq!(own.is_empty(), base == "idm" || base == "krauss", "{base}: kappa {own}");
        assert!(own.is_empty() || (0.1..=1.0).contains(&own.parse().expect("a number")), "{own}");
        // One of each variant on each trajectory, and it is trivially the best.
        assert_eq!(of(row, "is_best"), "true", "{row:?}");
    }
    let bases: std::collections::BTreeSet<String> = rows.iter().map(|row| of(row, "base")).collect();
    assert_eq!(bases.into_iter().collect::<Vec<_>>(), ["idm", "krauss", "my_fvdm", "ovm"]);
}

#[test]
fn it_is_diagnosed() {
    let Drive { folder, file, law } = drive("diagnosed", "120");
    let out = folder.join("out");
    let words = ["--base", text(&law), "--bounds", "human", "--effort", "quick", "--out", text(&out)];
    let told = ok(&[&["diagnose", "--data", text(&file)][..], &words].concat());
    assert!(told.contains("my_fvdm"), "{told}");
    let diagnosis = json_of(out.join("diagnosis.json"));
    let base = &diagnosis["base"];
    assert_eq!((&base["variant"], &base["extensions"]), (&Value::from("my_fvdm"), &serde_json::json!([])));
    let names: Vec<&str> =
        base["parameters"].as_array().expect("a list").iter().filter_map(|p| p["name"].as_str()).collect();
    assert!(names.contains(&"kappa") && names.contains(&"t_h"), "{names:?}");
}

/// The fleet keeps the text of the law, so that its drivers can be scored and simulated anywhere.
#[test]
fn a_fleet_of_an_own_law_and_an_extension_is_scored_and_simulated() {
    let Drive { folder, file, law } = drive("fleet", "60");
    let (out, scores, cause) = (folder.join("fleet"), folder.join("scores.csv"), folder.join("fades.wgsl"));
    let own = "//! A share of the acceleration is lost.\nstruct Parameters {\n    /// share that is lost [-], 0 to 0.9, neutral 0\n    lost: f32,\n}\n\n\
               fn fades_response(own: Parameters, a: f32) -> f32 {\n    return a * (1.0 - own.lost);\n}\n";
    fs::write(&cause, own).expect("room");
    let model = format!("{}+delay", text(&law));
    let words =
        ["calibrate", text(&file), "--all", "--model", &model, "--extend", text(&cause), "--extend", "sensor_lowpass"];
    ok(&[&words[..], &["--bounds", "human", "--max-evaluations", "500", "--no-intervals", "--out", text(&out)]]
        .concat());
    fs::remove_file(&law).and_then(|()| fs::remove_file(&cause)).expect("written");
    ok(&["evaluate", text(&out), "--out", text(&scores)]);
    let mut table = csv::Reader::from_path(&scores).expect("written");
    let names = table.headers().expect("a header").clone();
    let row = table.records().next().expect("one driver").expect("a row");
    let number = |name: &str| {
        let place = names.iter().position(|own| own == name).unwrap_or_else(|| panic!("{name}: {names:?}"));
        row[place].parse::<f64>().unwrap_or_else(|_| panic!("{name}: {row:?}"))
    };
    assert!((number("calib_cost") / number("score") - 1.0).abs() < WHOLE_RUN, "{row:?}");
    ok(&["simulate", text(&file), "--result", text(&out), "--out", text(&folder.join("simulated"))]);
    let simulated = fs::read_to_string(folder.join("simulated/simulation.csv")).expect("written");
    assert!(simulated.lines().count() > 500, "{simulated}");
}

#[test]
fn a_file_is_told_for_what_it_is() {
    let Drive { folder, file, law } = drive("told", "40");
    let told = ok(&["check", text(&law), "--plot"]);
    for expected in ["my_fvdm: valid, a law", "t_h [s]", "searched when needed", "15 m/s: acceleration"] {
        assert!(told.contains(expected), "{expected}: {told}");
    }
    assert!(told.contains("v_0 [m/s] 30 to 35") && told.contains("at v_0 32.500"), "{told}");
    let human = ok(&["check", text(&law), "--plot", "--bounds", "human"]);
    assert!(human.contains("v_0 [m/s] 1 to 70") && human.contains("at v_0 8.367"), "{human}");
    let listed = ok(&["list", "parameters", "--bounds", "human"]);
    assert!(listed.lines().any(|line| line.starts_with("v_0 ") && line.contains("1.00000 .. 70.00000")), "{listed}");
    assert!(listed.lines().any(|line| line.starts_with("f_0 ") && line.contains("by --vehicle")), "{listed}");
    let (code, said) = fails(&["list", "laws", "--bounds", "human"]);
    assert!(code == 2 && said.contains("need `leadlag list parameters`"), "{said}");
    assert!(ok(&["check", "krauss"]).contains("as the file says"));
    assert!(ok(&["list", "laws"]).contains("krauss: v_0 d_0 t_h a_max a_min"));

    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).expect("the folder can be written");
        path
    };
    let calibrate = |model: &str, more: &[&str]| {
        let out = folder.join("no");
        let words = ["calibrate", text(&file), "--model", model, "--out", text(&out)];
        fails(&[&words[..], more].concat())
    };
    let extension = write("slow.wgsl", "fn slow_command(a: f32) -> f32 {\n    return 0.9 * a;\n}\n");
    let taken = write("idm.wgsl", &FVDM.replace("my_fvdm", "idm"));
    for (model, more, code, expected) in [
        (text(&extension), &[][..], 2, "is an extension: it has no function `slow_law`"),
        ("idm", &["--extend", text(&law)][..], 2, "my_fvdm is a law, a separate base model"),
        ("kraus", &[][..], 2, "did you mean `krauss`?"),
        ("no_such.wgsl", &[][..], 1, "no_such.wgsl: cannot be read"),
        (
            "ovm",
            &["--extend", "headway_mode_change"][..],
            2,
            "it uses t_h, and ovm has no t_h; take a model that has one",
        ),
        (text(&taken), &[][..], 1, "`idm` is built in; give the file another name"),
    ] {
        let (found, told) = calibrate(model, more);
        assert!(found == code && told.contains(expected), "{model}: {found}: {told}");
    }
    for (name, from, to, expected) in [
        ("a.wgsl", "t_h", "tau_p", "tau_p belongs to the perception delay or the vehicle dynamics"),
        (
            "b.wgsl",
            "    t_h: f32,",
            "    /// gap [s], 0.5 to 2\n    t_h: f32,",
            "t_h is the paper's parameter: its unit is s",
        ),
        (
            "d.wgsl",
            "_law(own: Parameters, ",
            "_far(p: Params) -> f32 {\n    return equilibrium_spacing(p, 1.0);\n}\nfn d_law(own: Parameters, ",
            "cannot call it; define `fn d_equilibrium(own: Parameters, v: f32) -> f32`",
        ),
        ("c.wgsl", "own.t_h", "own.t_head", "Parameters has no field t_head; it has v_0"),
    ] {
        let own = FVDM.replace("my_fvdm", &name[..1]).replace(from, to);
        let (code, told) = calibrate(text(&write(name, &own)), &[]);
        assert!(code == 1 && told.contains(expected) && told.contains(&format!("{name}:")), "{expected}: {told}");
    }
}
