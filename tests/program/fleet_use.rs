//! The use of a finished fleet: scores on other drives by `evaluate`, a result of each pair, simulations of some drivers.

use super::fleet::{HEADER, drives};
use crate::common::program::{fails, json_of, ok, refused, rows_of, scratch, stderr, stdout, succeeds, text};
use crate::common::tolerance::WHOLE_RUN;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

const MODELS: [&str; 4] = ["--model", "idm", "--model", "idm+delay"];

/// The folder of a fleet of three drivers, and its table.
fn fleet(name: &str, more: &[&str]) -> (PathBuf, PathBuf) {
    let folder = scratch("fleet_use", name);
    let (table, out) = (folder.join("pairs.csv"), folder.join("fleet"));
    fs::write(&table, HEADER.to_owned() + &drives(0..3, 300)).expect("room");
    let words = ["calibrate", text(&table), "--all", "--bounds", "human", "--out", text(&out)];
    ok(&[&words[..], &MODELS, more].concat());
    (out, table)
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column}: expected a number, found {:?}", row[column]))
}

/// The car is a setting of the fleet, as bounds and convention are; data that are treated otherwise are warned of.
#[test]
fn a_fleet_keeps_its_car_and_the_treatment_of_its_data() {
    let folder = scratch("fleet_use", "car");
    let (table, out) = (folder.join("pairs.csv"), folder.join("fleet"));
    fs::write(&table, HEADER.to_owned() + &drives(0..3, 300)).expect("room");
    let words = ["calibrate", text(&table), "--all", "--bounds", "human", "--out", text(&out), "--no-intervals"];
    let more = ["--max-evaluations", "300", "--model", "l-cth+nonlinear", "--vehicle", "tesla_model3"];
    let level = ["--grade", "level"];
    ok(&[&words[..], &more, &level].concat());
    let scored = folder.join("scores.csv");
    let evaluate = [&["evaluate", text(&out), "--out", text(&scored)][..], &level].concat();
    assert!(!stderr(&succeeds(&evaluate)).contains("prepared differently"));
    for row in rows_of(&scored) {
        assert!((number(&row, "calib_cost") / number(&row, "score") - 1.0).abs() < WHOLE_RUN, "{row:?}");
    }
    let simulate = ["simulate", text(&table), "--result", text(&out), "--trajectory", "1"];
    let simulate = [&simulate[..], &level].concat();
    assert!(stdout(&succeeds(&simulate)).contains("NRMSE(s,v,a)"));
    // Another car has other scores, and another treatment other data.
    ok(&[&evaluate[..], &["--vehicle", "audi_a8"]].concat());
    assert!(rows_of(&scored).iter().any(|row| (number(row, "calib_cost") / number(row, "score") - 1.0).abs() > 1e-4));
    for given in [&evaluate[..], &simulate] {
        let said = stderr(&succeeds(&[given, &["--smooth"]].concat()));
        assert!(said.contains("calibrated on data prepared differently: not smoothed"), "{said}");
    }
}

/// The reason why no drive of the held-back files can be used is the message.
#[test]
fn held_back_files_that_cannot_be_used_say_why() {
    let folder = scratch("fleet_use", "held_back");
    let [table, other, out] = ["pairs.csv", "other.csv", "fleet"].map(|name| folder.join(name));
    fs::write(&table, HEADER.to_owned() + &drives(0..3, 300)).expect("room");
    fs::write(&other, HEADER.to_owned() + &drives(0..3, 100)).expect("room");
    let words = ["calibrate", text(&table), "--all", "--model", "idm", "--out", text(&out)];
    refused(1, &[&words[..], &["--holdout", text(&other), "--from", "15"]].concat())
        .says("--holdout: none of 3 pairs can be used; the first: ");
}

#[test]
fn a_fleet_is_evaluated_on_its_own_drives_and_on_others() {
    let (fleet, table) = fleet("evaluated", &[]);
    let scored = fleet.with_file_name("scores.csv");
    // Bounds and convention are those of the fleet: another bound of the delay scores another window.
    ok(&["evaluate", text(&fleet), "--out", text(&scored)]);
    let found = rows_of(&scored);
    assert_eq!(found.len(), 6);
    for row in &found {
        let (score, expected) = (number(row, "calib_cost"), number(row, "score"));
        assert!((score / expected - 1.0).abs() < WHOLE_RUN, "{} of {}: {score}", row["model"], row["trajectory"]);
    }
    // The same drivers in another file, one of them missing, with another name for each column.
    let other = fleet.with_file_name("other.csv");
    let renamed = HEADER.replace("Trajectory_ID", "driver").replace("Speed_FAV", "v").replace("Speed_LV", "v_lead");
    fs::write(&other, renamed.replace("Spatial_Gap", "gap") + &drives(1..3, 200)).expect("room");
    let map = fleet.with_file_name("map.toml");
    let columns = "title = \"own\"\nrows = \"pairs\"\n[columns]\ngroup = { name = \"driver\" }\ntime = { name = \"Time_Index\", unit = \"s\" }\n\
                   speed = { name = \"v\", unit = \"m/s\" }\nlead_speed = { name = \"v_lead\", unit = \"m/s\" }\n\
                   gap = { name = \"gap\", unit = \"m\" }\n";
    fs::write(&map, columns).expect("room");
    let words = ["evaluate", text(&fleet), "--data", text(&other), "--columns", text(&map), "--out", text(&scored)];
    let said = stderr(&succeeds(&words));
    assert!(said.contains("no trajectory 0; the file has 1, 2"), "{said}");
    let found = rows_of(&scored);
    let simulated: Vec<&str> = found.iter().map(|row| row["success"].as_str()).collect();
    assert_eq!(simulated, ["0", "0", "1", "1", "1", "1"]);
    // A column of the user's table names the trajectory.
    let cases = fleet.with_file_name("cases.csv");
    let case = |columns: &str, values: &str| {
        fs::write(
            &cases,
            format!("model,follower,v_0,d_0,t_h,a_max,a_min,delta{columns}\nidm,1,31,2,1.2,1.3,-1.8,4{values}\n"),
        )
        .expect("room");
    };
    case(",trajectory", ",1");
    ok(&["evaluate", text(&cases), "--data", text(&table), "--out", text(&scored)]);
    assert_eq!(rows_of(&scored)[0]["success"], "1");
    case("", "");
    refused(1, &["evaluate", text(&cases), "--data", text(&table), "--out", text(&scored)])
        .says("in the column trajectory, such as 0");
    case(",platoon", ",elsewhere");
    let (_, said) = fails(&["evaluate", text(&cases), "--data", text(&table), "--out", text(&scored)]);
    assert!(said.contains("platoon elsewhere: expected") && said.contains("pairs.csv"), "{said}");
    let (_, said) = fails(&["evaluate", text(&cases), "--out", text(&scored)]);
    assert!(said.contains("platoon elsewhere") && said.contains("--data"), "{said}");
}

/// Drives of 2.5 s are shorter than the longest delay of the extension, 3 s, but not than that of the bounds.
#[test]
fn bounds_of_a_delay_make_short_drives_long_enough() {
    let folder = scratch("fleet_use", "short");
    let (table, bounds, out) = (folder.join("pairs.csv"), folder.join("bounds.toml"), folder.join("fleet"));
    fs::write(&table, HEADER.to_owned() + &drives(0..3, 26)).expect("room");
    fs::write(&bounds, "tp = [0, 0.5]\n").expect("room");
    let words =
        ["calibrate", text(&table), "--all", "--model", "idm", "--extend", "perception_delay", "--out", text(&out)];
    ok(&[&words[..], &["--bounds", text(&bounds), "--max-evaluations", "300", "--no-intervals"]].concat());
    let scored = folder.join("scores.csv");
    ok(&["evaluate", text(&out), "--out", text(&scored)]);
    let found = rows_of(&scored);
    let simulated: Vec<&str> = found.iter().map(|row| row["success"].as_str()).collect();
    assert_eq!(simulated, ["1", "1", "1"]);
}

/// A table of several drivers is not a drive with gaps.
#[test]
fn one_trajectory_of_several_says_how_to_take_the_others() {
    let folder = scratch("fleet_use", "one_of_several");
    let (table, out) = (folder.join("pairs.csv"), folder.join("fit"));
    fs::write(&table, HEADER.to_owned() + &drives(0..3, 300)).expect("room");
    let words = ["calibrate", text(&table), "--model", "idm", "--max-evaluations", "100", "--no-intervals", "--out"];
    let said = stderr(&succeeds(&[&words[..], &[text(&out)]].concat()));
    assert!(said.contains("3 trajectories (0,1,2), of which only the longest, "), "{said}");
    assert!(said.contains("--trajectory chooses others") && !said.contains("segment"), "{said}");
}

#[test]
fn the_parameters_of_every_model_are_shown() {
    let folder = scratch("fleet_use", "all_models");
    let (table, out, html) = (folder.join("pairs.csv"), folder.join("fleet"), folder.join("fleet.html"));
    fs::write(&table, HEADER.to_owned() + &drives(0..3, 300)).expect("room");
    let words =
        ["calibrate", text(&table), "--all", "--bounds", "human", "--out", text(&out), "--model", "gipps+delay+linear"];
    let printed = ok(&[&words[..], &MODELS].concat());
    ok(&["report", text(&out), "-o", text(&html)]);
    let page = fs::read_to_string(&html).expect("written");
    let tables: Vec<Vec<&str>> = printed
        .split("\n\n")
        .filter(|block| block.contains("middle half"))
        .map(|block| block.lines().take_while(|line| !line.starts_with("Intervals")).collect())
        .collect();
    assert_eq!(tables.len(), 3, "{printed}");
    for model in ["idm", "idm+delay", "gipps+delay+linear"] {
        assert!(tables.iter().any(|lines| lines[0] == model), "{model}: {printed}");
        let captions = ["Driver by driver", "Parameters over all pairs"];
        let named = captions.map(|caption| page.contains(&format!("{caption}: {model}, nrmse-sva")));
        assert_eq!(named, [tables[0][0] != model; 2], "{model}");
    }
    for line in tables.iter().flatten() {
        assert!(line.chars().count() <= 80, "{line}");
    }
}

#[test]
fn changes_to_many_drives_are_shown_on_demand() {
    let folder = scratch("fleet_use", "verbose");
    let (table, cases, out) = (folder.join("pairs.csv"), folder.join("cases.csv"), folder.join("scores.csv"));
    fs::write(&table, HEADER.to_owned() + &drives(0..8, 100)).expect("room");
    let rows: String = (0..8).map(|id| format!("idm,{id},1,31,2,1.2,1.3,-1.8,4\n")).collect();
    fs::write(&cases, format!("variant,trajectory,follower,v_0,d_0,t_h,a_max,a_min,delta\n{rows}")).expect("room");
    let lines = |more: &[&str]| {
        let words = ["evaluate", text(&cases), "--data", text(&table), "--out", text(&out)];
        let said = stderr(&succeeds(&[&words[..], more].concat()));
        (said.contains("more lines about the data: --verbose"), said.lines().count())
    };
    let [(is_short, few), (is_whole, all)] = [lines(&[]), lines(&["--verbose"])];
    assert!(is_short && !is_whole && few < all, "{few} of {all} lines");
}

/// The result of a pair is what `calibrate` writes of it alone, and several models have a folder each.
#[test]
fn each_pair_has_a_result_on_demand() {
    let (fleet, table) = fleet("each", &["--each"]);
    for (row, folder) in rows_of(&fleet.join("parameters.csv")).iter().zip([0, 0, 1, 1, 2, 2]) {
        let own = fleet.join(format!("each/pairs_follower1_trajectory{folder}")).join(&row["model"]);
        let result = json_of(own.join("result.json"));
        assert_eq!(result["score"]["nrmse_sva"].as_f64(), Some(number(row, "score")));
        assert_eq!(result["parameters"]["t_h"].as_f64(), Some(number(row, "t_h_s")));
        assert!(own.join("simulation.csv").is_file() && own.join("plot.svg").is_file());
    }
    let alone = fleet.with_file_name("alone");
    let words = ["calibrate", text(&table), "--trajectory", "1", "--bounds", "human", "--max-evaluations", "10000"];
    ok(&[&words[..], &["--model", "idm", "--out", text(&alone)]].concat());
    let own = fleet.join("each/pairs_follower1_trajectory1/idm/result.json");
    assert_eq!(json_of(&own)["parameters"], json_of(alone.join("result.json"))["parameters"]);
    assert_eq!(json_of(&own)["intervals"], json_of(alone.join("result.json"))["intervals"]);
    ok(&["report", text(own.parent().expect("a folder")), "--out", text(&fleet.with_file_name("page.html"))]);
    // The fleet beside it stays complete.
    ok(&["report", text(&fleet), "--out", text(&fleet.with_file_name("fleet.html"))]);
}

/// A law that collides on held-back data ranks last, however few parameters it has, and the table reports this.
#[test]
fn a_law_that_collides_on_what_was_held_back_is_not_chosen() {
    let folder = scratch("fleet_use", "collides");
    let (table, law, out) = (folder.join("pairs.csv"), folder.join("blind.wgsl"), folder.join("fleet"));
    fs::write(&table, HEADER.to_owned() + &drives(0..4, 400)).expect("room");
    // It collides with the car ahead after 30 s; the calibration uses 28 s.
    let text_of_law = "//! Follows for 30 s.\nstruct Parameters {\n    /// gain [1/s], 0.1 to 2\n    k: f32,\n}\n\nfn blind_law(own: Parameters, w: World, x: \
                       Perceived) -> f32 {\n    return select(own.k * (x.v_l - x.v_f), 5.0, w.t > 30.0);\n}\n";
    fs::write(&law, text_of_law).expect("room");
    let words = ["calibrate", text(&table), "--all", "--model", text(&law), "--model", "idm", "--bounds", "human"];
    let said =
        ok(&[&words[..], &["--holdout", "0.3", "--max-evaluations", "3000", "--no-intervals", "--out", text(&out)]]
            .concat());
    assert!(said.contains("idm follows these drivers best"), "{said}");
    let file = json_of(out.join("fleet.json"));
    let of = |key: &str| [0, 1].map(|k| file["overview"][k][key].clone());
    assert_eq!(of("failed"), [serde_json::json!(4), serde_json::Value::Null], "{file}");
    assert_eq!(of("chosen"), [false, true].map(serde_json::Value::from));
    assert_eq!(of("best"), [0, 4].map(serde_json::Value::from));
}

/// Drivers with one file each are named after it, on the page and in `simulate`.
#[test]
fn a_driver_without_a_name_goes_by_his_file() {
    let folder = scratch("fleet_use", "files");
    for seed in ["1", "2"] {
        ok(&["synth", "--out", text(&folder.join(seed)), "--seed", seed, "--duration", "60", "--pairs"]);
    }
    let file = |seed: &str, number: u32| folder.join(seed).join(format!("pair_follower{number}.csv"));
    let (all, out) = ([file("1", 1), file("1", 2), file("2", 3), file("1", 3)], folder.join("fleet"));
    let words: Vec<&str> = all.iter().map(|path| text(path)).collect();
    let settings = ["--all", "--model", "idm", "--max-evaluations", "500", "--no-intervals", "--out", text(&out)];
    ok(&[&["calibrate"][..], &words, &settings].concat());
    let page = folder.join("page.html");
    ok(&["report", text(&out), "--out", text(&page)]);
    let page = fs::read_to_string(page).expect("written");
    for (name, there) in [("pair_follower1", true), ("pair 3", true), ("pair 4", true), ("pair_follower3", false)] {
        assert_eq!(page.contains(&format!("<td>{name}</td>")), there, "{name}");
    }
    ok(&["simulate", text(&all[1]), "--result", text(&out)]);
    let (_, said) = fails(&["simulate", text(&all[2]), "--result", text(&out)]);
    assert!(said.contains("pair_follower1, pair_follower2, pair 3, pair 4"), "{said}");
}

#[test]
fn several_drivers_of_a_fleet_are_simulated_at_once() {
    let (fleet, table) = fleet("simulated", &[]);
    let simulate = |ids: &str| ok(&["simulate", text(&table), "--result", text(&fleet), "--trajectory", ids, "--json"]);
    let [one, other, both] = ["0", "2", "0,2"].map(|ids| {
        let json: serde_json::Value = serde_json::from_str(&simulate(ids)).expect("JSON");
        json["runs"].as_array().expect("runs").clone()
    });
    assert_eq!([one, other].concat(), both);
}
