//! One law for many drivers, with some parameters of each driver's own: their distribution is found, and drivers who are not known get its middle.

use crate::common::drivers::{MAP, MIDDLE, Own, RELATIVE, SPREAD, table};
use crate::common::program::{fails, ok, scratch, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Names of the parameters of a driver.
const NAMES: [&str; 5] = ["v_0", "t_h", "d_0", "a_max", "a_min"];

fn write(folder: &Path, name: &str, table: &str) -> PathBuf {
    fs::write(folder.join("map.toml"), MAP).expect("can be written");
    let file = folder.join(name);
    fs::write(&file, table).expect("can be written");
    file
}

/// The result of a joint calibration of the IDM.
fn fit(file: &Path, more: &[&str]) -> Value {
    let folder = file.parent().expect("a folder");
    let (map, out) = (folder.join("map.toml"), folder.join("fit"));
    let words = ["calibrate", text(file), "--columns", text(&map), "--joint", "--model", "idm", "--bounds", "human"];
    let rest = ["--fix", "delta=4", "--gof", "nrmse-s", "--no-intervals", "--json", "--out", text(&out)];
    serde_json::from_str(&ok(&[&words[..], &rest, more].concat())).expect("a result")
}

fn ends(value: &Value) -> [f64; 2] {
    [0, 1].map(|k| value[k].as_f64().expect("a number"))
}

#[test]
fn the_spread_of_each_parameter_is_found() {
    let folder = scratch("own_parameters", "spread");
    let (rows, drivers) = table(60, SPREAD, 0, 21);
    let found = fit(&write(&folder, "train.csv", &rows), &["--own", &NAMES.join(",")]);
    for (k, name) in NAMES.into_iter().enumerate() {
        let own = &found["own"]["parameters"][name];
        assert_eq!(own["logarithm"], true);
        // Mean and standard deviation of these sixty drivers, of whom the intervals tell.
        let logarithms: Vec<f64> = drivers.iter().map(|own: &Own| own[k].ln()).collect();
        let mean = logarithms.iter().sum::<f64>() / 60.0;
        let spread = (logarithms.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 59.0).sqrt();
        let [low, high] = ends(&own["spread_interval"]);
        assert!(low < spread && spread < high && high < 3.0 * SPREAD * RELATIVE[k], "{name}: {spread} {own}");
        let mut middle = ends(&own["middle_interval"]).map(f64::abs);
        middle.sort_by(f64::total_cmp);
        assert!(middle[0] < mean.exp() && mean.exp() < middle[1], "{name}: {} {own}", mean.exp());
        assert_eq!(own["middle"], found["parameters"][name]);
    }
    // Own headways are those of the drivers, and every drive is scored with its own.
    let entries = found["own"]["drivers"].as_array().expect("drivers");
    let headway = |k: usize| entries[k]["parameters"]["t_h"].as_f64().expect("a number");
    let near = (0..60).filter(|&k| (headway(k) / drivers[k][1] - 1.0).abs() < 0.15).count();
    assert!(near >= 50, "{near} of 60 headways");
    assert_eq!((entries.len(), &entries[7]["data"]), (60, &serde_json::json!([7])));
    let common = found["replicates"][0]["score"].as_f64().expect("a number");
    let own = found["per_drive"]["mean"].as_f64().expect("a number");
    assert!(own < 0.5 * common, "{own} {common}");
    // The written simulation is that of the driver.
    let simulation = fs::read_to_string(folder.join("fit/simulation_8.csv")).expect("written");
    let mut lines = simulation.lines().filter(|line| !line.starts_with('#'));
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let at =
        |name: &str| head.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name} in {head:?}"));
    let (simulated, measured) = (at("sim_spacing_m"), at("spacing_m"));
    let error = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        (cells[simulated] - cells[measured]).powi(2)
    };
    let errors: Vec<f64> = lines.map(error).collect();
    let rmse = (errors.iter().sum::<f64>() / (errors.len() - 1) as f64).sqrt();
    let told = found["per_drive"]["drives"][7]["rmse"][0].as_f64().expect("a number");
    assert!((rmse / told - 1.0).abs() < 1e-6, "{rmse} {told}");
    // The page begins with the score of the drivers, not with that of the common law.
    let page = folder.join("page.html");
    ok(&["report", text(&folder.join("fit")), "-o", text(&page)]);
    let html = fs::read_to_string(page).expect("written");
    let score = html.split("nrmse-s = ").nth(1).and_then(|rest| rest.split(".</p>").next()).expect("a score");
    let mean = found["per_drive"]["mean"].as_f64().expect("a number");
    assert!((score.parse::<f64>().expect("a number") / mean - 1.0).abs() < 0.01, "{score} {mean}");
}

/// Their estimates differ by the noise only.
#[test]
fn drivers_who_are_alike_have_no_spread() {
    let folder = scratch("own_parameters", "alike");
    let found = fit(&write(&folder, "train.csv", &table(60, 0.0, 0, 22).0), &["--own", "t_h,d_0"]);
    // Following cars that keep moving hardly show the standstill distance.
    for (name, truth, within) in [("t_h", MIDDLE[1], 0.05), ("d_0", MIDDLE[2], 0.2)] {
        let own = &found["own"]["parameters"][name];
        assert!(ends(&own["spread_interval"])[0] < 0.01, "{name}: {own}");
        assert!(own["spread"].as_f64().expect("a number") < 0.05, "{name}: {own}");
        assert!((own["middle"].as_f64().expect("a number") / truth - 1.0).abs() < within, "{name}: {own}");
    }
}

/// A common law of drivers who differ compromises with parameters that no driver has.
#[test]
fn drivers_who_are_not_known_get_the_middle() {
    let folder = scratch("own_parameters", "middle");
    let train = write(&folder, "train.csv", &table(60, SPREAD, 0, 23).0);
    let test = write(&folder, "test.csv", &table(60, SPREAD, 0, 24).0);
    let held = |own: &[&str]| {
        let found = fit(&train, &[&["--holdout", text(&test)], own].concat());
        assert_eq!(found["held_back"]["failed"], 0);
        found["held_back"]["mean"].as_f64().expect("a number")
    };
    let [common, own] = [held(&[]), held(&["--own", &NAMES.join(",")])];
    assert!(own < 1.02 * common, "{own} {common}");
    let told = ok(&[
        "calibrate",
        text(&train),
        "--columns",
        text(&folder.join("map.toml")),
        "--joint",
        "--model",
        "idm",
        "--bounds",
        "human",
        "--gof",
        "nrmse-s",
        "--own",
        "t_h",
        "--folds",
        "2",
        "--max-evaluations",
        "3000",
        "--out",
        text(&folder.join("folds")),
    ]);
    assert!(
        told.contains("own value") && told.contains("t_h [s]") && told.contains("held back, in 2 folds: 60"),
        "{told}"
    );
    let (_, own) = told.split_once("own value").expect("the table of own values");
    assert!(own.lines().take(6).all(|line| line.chars().count() <= 80), "{own}");
}

#[test]
fn own_parameters_that_cannot_be_own_are_refused() {
    let folder = scratch("own_parameters", "refused");
    let many = write(&folder, "many.csv", &table(12, SPREAD, 0, 25).0);
    let few = write(&folder, "few.csv", &table(4, SPREAD, 0, 26).0);
    let map = folder.join("map.toml");
    let refused = |file: &Path, more: &[&str]| {
        let words = ["calibrate", text(file), "--columns", text(&map), "--model", "idm", "--out", text(&folder)];
        let (code, said) = fails(&[&words[..], more].concat());
        assert_eq!(code, 2, "{said}");
        said
    };
    for (file, more, expected) in [
        (&few, &["--joint", "--own", "t_h"][..], "--own t_h: a distribution needs at least 10 drivers, found 4"),
        (&many, &["--joint", "--own", "th"], "--own th: variant idm has the parameters"),
        (&many, &["--joint", "--own", "t_h,t_h"], "--own t_h: t_h is given twice"),
        (&many, &["--joint", "--own", "t_h", "--fix", "t_h=1.2"], "--own t_h: t_h is fixed"),
        (&many, &["--joint", "--own", "t_h", "--gof", "u-s"], "--own: u-s is no norm of residuals"),
        (&many, &["--own", "t_h"], "--joint"),
    ] {
        let said = refused(file, more);
        assert!(said.contains(expected), "{more:?}: {said}");
    }
}
