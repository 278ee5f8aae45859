//! The tables are those of docs/STUDY.md.

use super::common::{expected, ok, rows_in, small, text};
use std::collections::{BTreeMap, HashMap};

const DOCUMENT: &str = include_str!("../../docs/STUDY.md");

/// Names in the first cells of the table under a heading: `a`, `b` in backquotes, several to a cell.
fn documented(heading: &str) -> Vec<String> {
    let section =
        DOCUMENT.split(&format!("\n### {heading}\n")).nth(1).unwrap_or_else(|| panic!("no section {heading}"));
    let section = section.split("\n##").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    rows.flat_map(|line| {
        let cell = line.trim_start_matches('|').split(" | ").next().unwrap();
        cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>()
    })
    .collect()
}

/// Fields by column.
type Row = BTreeMap<String, String>;

fn read(name: &str) -> (Vec<String>, Vec<Row>) {
    let mut reader = csv::Reader::from_reader(expected()[name].as_slice());
    let headers: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (headers, rows_in(&expected()[name]))
}

#[test]
fn every_column_is_documented_and_every_documented_column_is_there() {
    for heading in ["calibrations", "validations", "missing"] {
        assert_eq!(
            read(&format!("{heading}.csv")).0,
            documented(heading),
            "{heading}.csv against docs/STUDY.md, in order"
        );
    }
    let study = small("schema_report");
    ok(&["study", "run", text(&study)]);
    ok(&["study", "report", text(&study)]);
    for name in ["table4.csv", "table5.csv", "figure4.csv", "figure5.csv", "figure6.csv", "figure7.csv"] {
        let table = std::fs::read_to_string(study.join("report").join(name)).unwrap();
        let head: Vec<String> = table.lines().next().unwrap().split(',').map(str::to_owned).collect();
        assert_eq!(head, documented(name), "{name} against docs/STUDY.md, in order");
    }
}

#[test]
fn one_row_per_calibration_and_one_winner_per_variant_and_trajectory() {
    let (_, rows) = read("calibrations.csv");
    assert_eq!(rows.len(), 24);
    let mut cells: HashMap<_, Vec<&Row>> = HashMap::new();
    for row in &rows {
        let key = (row["variant"].clone(), row["platoon"].clone(), row["follower_position"].clone());
        cells.entry(key).or_default().push(row);
    }
    assert_eq!(cells.len(), 12);
    for (cell, replicates) in cells {
        let score = |row: &Row| row["score"].parse::<f64>().expect("a score");
        let winners: Vec<_> = replicates.iter().filter(|row| row["is_best"] == "true").collect();
        assert_eq!(winners.len(), 1, "{cell:?}");
        assert!(replicates.iter().all(|row| score(row) >= score(winners[0])), "{cell:?}");
        assert_eq!(score(winners[0]).to_string(), winners[0]["nrmse_sva"], "the score is the measure of that name");
    }
}

#[test]
fn one_row_per_validation_run_of_a_winner_on_the_other_platoon() {
    let (_, calibrations) = read("calibrations.csv");
    let (_, rows) = read("validations.csv");
    assert_eq!(rows.len(), 12, "one other platoon each");
    for row in &rows {
        assert_ne!(row["platoon"], row["validation_platoon"]);
        assert_eq!(row["follower_position"], row["validation_follower_position"], "the same car drives there");
        let own = calibrations.iter().find(|c| c["task_id"] == row["task_id"]).expect("its calibration");
        assert_eq!(own["is_best"], "true");
        assert_eq!(row["success"] == "true", row["fail_reason"].is_empty());
        assert_eq!(row["collision"] == "true", row["fail_reason"] == "spacing");
        assert_eq!(row["nrmse_sva"].is_empty(), row["success"] != "true");
    }
}

#[test]
fn a_validation_row_is_what_evaluate_finds_for_the_same_parameters() {
    let (_, calibrations) = read("calibrations.csv");
    let (_, rows) = read("validations.csv");
    let row = rows.iter().find(|row| row["variant"] == "l-cth+linear" && row["platoon"] == "S1").expect("a row");
    let own = calibrations.iter().find(|c| c["task_id"] == row["task_id"]).expect("its calibration");
    let folder = small("evaluate");
    let data = super::common::data().join("two");
    let names = [
        ("k_s", "k_s_per_s2"),
        ("k_v", "k_v_per_s"),
        ("k_0", "k_0_per_s"),
        ("v_0", "v_0_mps"),
        ("d_0", "d_0_m"),
        ("t_h", "t_h_s"),
        ("tau_a", "tau_a_s"),
    ];
    let header: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
    let values: Vec<&str> = names.iter().map(|(_, column)| own[*column].as_str()).collect();
    let cases = folder.join("cases.csv");
    let content = format!(
        "variant,platoon,follower_position,{}\nl-cth+linear,platoon,{},{}\n",
        header.join(","),
        row["validation_follower_position"],
        values.join(",")
    );
    std::fs::write(&cases, content).unwrap();
    let table = ok(&["evaluate", text(&cases), "--data", text(&data), "--evaluator", "reference"]);
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let headers = reader.headers().unwrap().clone();
    let record = reader.records().next().unwrap().unwrap();
    let field = |name: &str| record[headers.iter().position(|h| h == name).unwrap()].to_owned();
    assert_eq!(field("nrmse_sva"), row["nrmse_sva"]);
    assert_eq!(field("rmse_s"), row["rmse_s_m"]);
}
