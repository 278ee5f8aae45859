//! Every pair of features of `calibrate --all` and `calibrate --joint`, on a table in the user's own units: the command works, and so do the
//! verbs that use its result. Pairs that contradict each other are refused.

use super::fleet::drives;
use super::own_law::FVDM;
use crate::common::program::{leadlag, ok, scratch, stderr, text};
use crate::common::sample;
use std::fs;
use std::path::Path;

const MAP: &str = "title = \"own\"
rows = \"pairs\"
[columns]
group = { name = \"driver\" }
time = { name = \"clock\", unit = \"s\" }
speed = { name = \"v\", unit = \"km/h\" }
lead_speed = { name = \"v_lead\", unit = \"km/h\" }
gap = { name = \"gap\", unit = \"m\" }
";

const CAUSE: &str = "struct Parameters {
    /// drag per speed [1/s], -0.05 to 0.05, neutral 0
    c1: f32,
}
fn my_drag_response(own: Parameters, w: World, a: f32) -> f32 {
    return a - own.c1 * w.v_f;
}
";

/// A feature: its name, and its arguments. Names of files are those in the folder of the test.
type Feature = (&'static str, &'static [&'static str]);

const BOTH: [Feature; 15] = [
    ("law", &["--model", "my_law.wgsl"]),
    ("own cause", &["--extend", "my_drag.wgsl"]),
    ("cause", &["--extend", "actuation_lag"]),
    ("share", &["--holdout", "0.3"]),
    ("file", &["--holdout", "other.csv"]),
    ("bounds", &["--bounds", "human", "--bounds", "bounds.toml"]),
    ("fixed", &["--fix", "t_h=1.2"]),
    ("measure", &["--gof", "rmse-s"]),
    ("smooth", &["--smooth"]),
    ("step", &["--resample", "0.2", "--max-gap", "2"]),
    ("gap", &["--correct", "--reconcile", "speeds", "--lead-length", "4.5"]),
    ("ids", &["--trajectory", "0,2"]),
    ("reference", &["--evaluator", "reference"]),
    ("authors", &["--convention", "authors", "--optimizer", "lshade"]),
    ("intervals", &[]),
];
const FLEET: [Feature; 3] = [
    ("models", &["--model", "gipps", "--model", "idm+delay"]),
    ("measures", &["--gof", "nrmse-s", "--gof", "rmse-sv"]),
    ("each", &["--each"]),
];
const JOINT: [Feature; 4] = [
    ("folds", &["--folds", "2"]),
    ("history", &["--history", "1"]),
    ("replicates", &["--replicates", "2", "--plot"]),
    ("later", &["--from", "2"]),
];
/// Pairs that contradict each other.
const REFUSED: [[&str; 2]; 5] =
    [["law", "reference"], ["own cause", "reference"], ["share", "file"], ["share", "folds"], ["file", "folds"]];

fn files(folder: &Path) {
    let table = drives(0..3, 350);
    let [mut pairs, mut other] = ["driver,clock,v,v_lead,gap\n".to_owned(), "driver,clock,v,v_lead,gap\n".to_owned()];
    for line in table.lines() {
        let field: Vec<&str> = line.split(',').collect();
        let kmh = |k: usize| 3.6 * field[k].parse::<f64>().expect("a number");
        let to = if field[1].parse::<f64>().expect("a number") < 25.0 { &mut pairs } else { &mut other };
        *to += &format!("{},{},{:.4},{:.4},{}\n", field[0], field[1], kmh(9), kmh(5), field[11]);
    }
    let bounds = "v_0 = [15, 45]\n".to_owned();
    let [map, cause] = [MAP, CAUSE].map(str::to_owned);
    let law = FVDM.replace("my_fvdm", "my_law");
    for (name, content) in [
        ("pairs.csv", pairs),
        ("other.csv", other),
        ("map.toml", map),
        ("my_law.wgsl", law),
        ("my_drag.wgsl", cause),
        ("bounds.toml", bounds),
    ] {
        fs::write(folder.join(name), content).expect("room");
    }
}

/// Runs every pair that this run takes; `used` tries the verbs that take the folder of the result.
fn every_pair(kind: &str, own: &[Feature], used: &dyn Fn(&Path, &str)) {
    let folder = scratch("pairs", &kind[2..]);
    files(&folder);
    let file = |name: &str| folder.join(name).to_str().expect("UTF-8").to_owned();
    let [table, map, out] = ["pairs.csv", "map.toml", "out"].map(file);
    let features: Vec<&Feature> = BOTH.iter().chain(own).collect();
    let pairs =
        features.iter().enumerate().flat_map(|(k, one)| features[..k].iter().map(move |other| [**one, **other]));
    for pair in sample::split(pairs.collect()).0 {
        let names = pair.map(|(name, _)| name);
        let given = pair.iter().flat_map(|(_, words)| *words).map(|word| match word.rsplit_once('.') {
            Some((_, "csv" | "toml" | "wgsl")) => file(word),
            _ => (*word).to_owned(),
        });
        let mut words: Vec<String> = given.collect();
        for (without, more) in [("law", ["--model", "idm"].as_slice()), ("intervals", &["--no-intervals"])] {
            if !names.contains(&without) {
                words.extend(more.iter().map(|word| (*word).to_owned()));
            }
        }
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let always = ["calibrate", &table, "--columns", &map, kind, "--out", &out, "--max-evaluations", "300"];
        let _ = fs::remove_dir_all(&out);
        let output = leadlag(&[&always[..], &words].concat());
        let is_refused = REFUSED.iter().any(|pair| pair.iter().all(|name| names.contains(name)));
        assert_eq!(output.status.code(), Some(if is_refused { 2 } else { 0 }), "{words:?}: {}", stderr(&output));
        if !is_refused {
            let page = file("page.html");
            ok(&["report", &out, "-o", &page]);
            let page = fs::read_to_string(page).expect("it was written");
            let (said, _) = page.split_once("<script").expect("there are charts");
            assert!(said.contains("pairs.csv") && !said.contains("NaN"), "{words:?}");
            used(&folder, said);
        }
    }
}

#[test]
fn of_a_fleet() {
    every_pair("--all", &FLEET, &|folder, page| {
        let [out, scores, map, table] = ["out", "scores.csv", "map.toml", "pairs.csv"].map(|name| folder.join(name));
        let mut rows = csv::Reader::from_path(out.join("parameters.csv")).expect("it was written");
        let ids = rows.headers().expect("a header").iter().position(|name| name == "name").expect("a column");
        let rows: Vec<csv::StringRecord> = rows.records().map(|row| row.expect("a row")).collect();
        assert!(rows.len() >= 2 && rows.iter().all(|row| page.contains(&row[ids])));
        ok(&["evaluate", text(&out), "--out", text(&scores)]);
        let mut found = csv::Reader::from_path(&scores).expect("it was written");
        let success = found.headers().expect("a header").iter().position(|name| name == "success").expect("a column");
        assert_eq!(
            found.records().filter(|row| row.as_ref().is_ok_and(|row| &row[success] == "1")).count(),
            rows.len()
        );
        let simulate = ["simulate", text(&table), "--columns", text(&map), "--result", text(&out)];
        assert!(ok(&[&simulate[..], &["--trajectory", "2"]].concat()).contains("NRMSE(s,v,a)"));
    });
}

#[test]
fn of_a_joint_calibration() {
    every_pair("--joint", &JOINT, &|folder, _| {
        let [out, map, other] = ["out", "map.toml", "other.csv"].map(|name| folder.join(name));
        let simulate =
            ["simulate", text(&other), "--columns", text(&map), "--result", text(&out), "--trajectory", "0,2"];
        assert!(ok(&simulate).contains("NRMSE(s,v,a)"));
    });
}
