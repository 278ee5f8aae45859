//! The report: its numbers follow from the tables of the study, beside the paper's.

use super::common::{files, ok, part_names, plan_text, planned, refused, rows_in, same, text};
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::PathBuf;

/// Followers 1 and 2 of two platoons, the IDM with and without the paper's additions, and the base model of another class.
fn finished(name: &str) -> PathBuf {
    let variants = "[\"idm\", \"idm+linear\", \"idm+delay\", \"idm+delay+linear\", \"l-cth\"]";
    let plan = plan_text(3, 600).replace("[\"idm\", \"l-cth+linear\", 28]", variants);
    let study = planned(name, &plan);
    ok(&["study", "run", text(&study)]);
    study
}

fn reported(study: &std::path::Path, further: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let mut arguments = vec!["study", "report", text(study)];
    arguments.extend(further);
    ok(&arguments);
    files(&study.join("report"))
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column}: {:?}", row[column]))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len() % 2 == 1 { values[half] } else { (values[half - 1] + values[half]) / 2.0 }
}

#[test]
fn numbers_follow_from_the_tables_and_stand_beside_the_papers() {
    let study = finished("report");
    let report = reported(&study, &[]);
    let names: Vec<&str> = report.keys().map(String::as_str).collect();
    let figures = ["figure4", "figure5", "figure6", "figure7"];
    let mut expected: Vec<String> = figures.iter().flat_map(|f| [format!("{f}.csv"), format!("{f}.svg")]).collect();
    expected.extend(["report.md", "table4.csv", "table5.csv"].map(str::to_owned));
    assert_eq!(names, expected);
    assert!(String::from_utf8_lossy(&report["figure5.svg"]).contains("highest"), "of all five variants");
    ok(&["study", "merge", text(&study)]);
    let calibrations = rows_in(&fs::read(study.join("merged/calibrations.csv")).unwrap());
    let validations = rows_in(&fs::read(study.join("merged/validations.csv")).unwrap());
    let best: Vec<BTreeMap<String, String>> =
        calibrations.iter().filter(|row| row["is_best"] == "true").cloned().collect();
    let at = |row: &BTreeMap<String, String>| (row["platoon"].clone(), row["follower_position"].clone());

    // Table 4 by hand: Eq. 19, then the median over the trajectories.
    let mut lowest: HashMap<_, f64> = HashMap::new();
    for row in &best {
        let low = lowest.entry(at(row)).or_insert(f64::INFINITY);
        *low = low.min(number(row, "score"));
    }
    let normalized = |variant: &str| {
        let own = best.iter().filter(|row| row["variant"] == variant);
        own.map(|row| number(row, "score") / lowest[&at(row)] - 1.0).collect::<Vec<_>>()
    };
    let base = median(normalized("idm"));
    let four = rows_in(&report["table4.csv"]);
    assert_eq!(four.len(), 5);
    for row in &four {
        let found = median(normalized(&row["variant"]));
        assert!((number(row, "median") - found).abs() < 1e-12, "{}", row["variant"]);
        if row["variant"].starts_with("idm+") {
            assert!((number(row, "change_percent") - 100.0 * (found / base - 1.0)).abs() < 1e-9);
        }
    }
    // The paper's, from its Table 4.
    let printed: Vec<f64> = four.iter().map(|row| number(row, "paper_median")).collect();
    assert_eq!(printed, [0.248, 0.122, 0.160, 0.132, 0.187]);
    assert_eq!(four[0]["paper_change_percent"], "", "a base model is compared with nothing");

    // Table 5: the change of RMSE(s) in calibration and validation, and the collisions.
    let five = rows_in(&report["table5.csv"]);
    for row in five.iter().filter(|row| row["variant"].starts_with("idm+")) {
        let change = |rows: &[BTreeMap<String, String>], keys: &[&str], all: bool| {
            let of = |variant: &str| {
                let own = rows.iter().filter(|r| r["variant"] == variant);
                own.map(|r| (keys.iter().map(|k| r[*k].clone()).collect::<Vec<_>>(), r["rmse_s_m"].parse::<f64>().ok()))
                    .collect::<HashMap<_, _>>()
            };
            let class = ["idm", "idm+linear", "idm+delay", "idm+delay+linear"].map(of);
            let (own, base) = (of(&row["variant"]), &class[0]);
            let common = own.iter().filter(|(key, _)| !all || class.iter().all(|rows| rows[*key].is_some()));
            median(common.map(|(key, x)| 100.0 * (x.unwrap() / base[key].unwrap() - 1.0)).collect())
        };
        let calibrated = change(&best, &["platoon", "follower_position"], false);
        assert!((number(row, "calibration_rmse_s_percent") - calibrated).abs() < 1e-9, "{}", row["variant"]);
        let keys = ["platoon", "follower_position", "validation_platoon"];
        let validated = change(&validations, &keys, true);
        assert!((number(row, "validation_rmse_s_percent") - validated).abs() < 1e-9, "{}", row["variant"]);
    }
    for row in &five {
        let own = validations.iter().filter(|v| v["variant"] == row["variant"]);
        let (all, collided): (Vec<_>, Vec<_>) = own.map(|v| ((), v["collision"] == "true")).unzip();
        assert_eq!(number(row, "validation_runs") as usize, all.len());
        assert_eq!(number(row, "collisions") as usize, collided.into_iter().filter(|c| *c).count());
    }
    assert_eq!(five[4]["paper_collisions"], "34.0", "L-CTH in the paper's Table 5");

    for figure in figures {
        let svg = String::from_utf8(report[&format!("{figure}.svg")].clone()).unwrap();
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"), "{figure}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{figure} has numbers only");
        assert!(!svg.contains(" 1 outliers"), "{figure}");
        assert!(svg.contains("IDM") && svg.contains("L-CTH"), "{figure} names the classes");
    }
    let summary = String::from_utf8(report["report.md"].clone()).unwrap();
    assert!(summary.contains("| agrees | IDM-based variants show almost no collision in validation"), "{summary}");
    assert!(!summary.contains("cannot tell") && summary.contains(" further statements cannot be judged"), "{summary}");
    // The score itself is shown with its share above the best, which changes by many percent if it is small.
    let scores = median(best.iter().filter(|row| row["variant"] == "idm").map(|row| number(row, "score")).collect());
    let head = "| id | variant | nrmse-sva | share above the best | paper | change of this share % | paper |";
    assert!(summary.contains(head) && summary.contains(&format!("| 1 | `idm` | {scores:.4} | ")), "{summary}");
    // Five variants have room for their names.
    let boxes = String::from_utf8(report["figure6.svg"].clone()).unwrap();
    assert!(boxes.contains(">idm+delay+linear<") && !boxes.contains("ids of Table 1"), "{boxes}");

    // The page carries the same numbers, and those of each run on another trajectory.
    let page = study.join("study.html");
    ok(&["report", text(&study), "-o", text(&page)]);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("<h1>Study ") && html.contains("<title>1 idm: median "), "figures tell their numbers");
    // The result comes first, and the statements that the study cannot decide are one line.
    let (before, rest) = html.split_once("</strong> Median NRMSE(s,v,a) there ").expect("an answer");
    assert!(before.contains("<p class=\"verdict\">") && !before.contains("</section>"));
    assert!(before.contains("unseen drives") && rest.contains("the larger of two nested variants always fits better"));
    assert!(summary.contains("unseen drives"), "{summary}");
    assert!(!html.contains("<td>cannot tell</td>") && html.contains(" further statements cannot be judged"));
    let [ranking, paper] = ["id=\"vehicles\"", "id=\"paper\""].map(|id| html.find(id));
    assert!(ranking.is_some() && ranking < paper, "the own ranking stands before the paper's statements");
    let twin = html.split("id=\"result\">").nth(1).and_then(|rest| rest.split("</script>").next()).unwrap();
    let twin: serde_json::Value = serde_json::from_str(twin).unwrap();
    for (row, own) in four.iter().zip(twin["table4"].as_array().unwrap()) {
        assert_eq!(
            (own["variant"].as_str().unwrap(), own["median"].as_f64().unwrap()),
            (row["variant"].as_str(), number(row, "median"))
        );
    }
    let matrix = twin["validation_matrix"].as_array().unwrap();
    assert!(!matrix.is_empty());
    for cross in matrix {
        let word = |key: &str| cross[key].as_str().unwrap().to_owned();
        let (from, on) = (word("calibrated_on"), word("simulated_on"));
        let follower = cross["calibrated_follower"].to_string();
        let is_from =
            |row: &&BTreeMap<String, String>| (&row["platoon"], &row["follower_position"]) == (&from, &follower);
        let column = "nrmse_sva";
        let values: Vec<f64> = if from == on && cross["calibrated_follower"] == cross["simulated_follower"] {
            best.iter().filter(is_from).map(|row| number(row, column)).collect()
        } else {
            let on_it = validations.iter().filter(is_from).filter(|row| row["validation_platoon"] == on);
            let own: Vec<_> = on_it.collect();
            assert_eq!(own.len() as u64, cross["runs"].as_u64().unwrap(), "{cross}");
            own.iter().filter_map(|row| row[column].parse().ok()).collect()
        };
        assert!((cross["median_nrmse_sva"].as_f64().unwrap() - median(values)).abs() < 1e-12, "{cross}");
    }
}

#[test]
fn a_report_of_an_unfinished_study_says_so_and_a_finished_one_is_the_same_again() {
    let study = finished("report_partial");
    let status = ok(&["study", "status", text(&study)]);
    assert!(status.contains("60 tasks computed by 1 run in "), "{status}");
    // Paths may be long.
    let long = status.lines().filter(|line| !line.contains(text(&study))).find(|line| line.chars().count() > 80);
    assert_eq!(long, None, "a terminal has 80 columns");
    let whole = reported(&study, &[]);
    same(&reported(&study, &[]), &whole, "a second report");
    let parts = study.join("parts");
    fs::remove_file(parts.join(&part_names(&study)[0])).unwrap();
    refused(1, &["study", "report", text(&study)]).says("1 of 60 tasks are missing");
    let partial = reported(&study, &["--partial"]);
    let summary = String::from_utf8(partial["report.md"].clone()).unwrap();
    assert!(summary.contains("**1 task is missing: these numbers are preliminary.**"), "{summary}");
    ok(&["study", "run", text(&study)]);
    same(&reported(&study, &[]), &whole, "after the missing one");

    // Trajectories are in the order of the plan, whichever parts exist; in this test the first trajectory has none with the first
    // variant.
    let tasks = fs::read_to_string(study.join("tasks.jsonl")).unwrap();
    let tasks: Vec<serde_json::Value> = tasks.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let key = |task: &serde_json::Value| ["platoon", "follower", "variant"].map(|key| task[key].to_string());
    for task in tasks.iter().filter(|task| key(task) == key(&tasks[0])) {
        fs::remove_file(parts.join(format!("{}.json", task["id"].as_str().unwrap()))).unwrap();
    }
    let order = |report: &BTreeMap<String, Vec<u8>>| {
        let table = String::from_utf8(report["figure5.csv"].clone()).unwrap();
        let mut names: Vec<String> =
            table.lines().skip(1).map(|row| row.split(',').take(2).collect::<Vec<_>>().join(" ")).collect();
        names.dedup();
        names
    };
    assert_eq!(order(&reported(&study, &["--partial"])), order(&whole));
}

/// If a study has base models alone, the lowest and the highest of all variants are bars of the figure already.
#[test]
fn base_models_alone_have_no_bars_twice() {
    let study =
        planned("report_bases", &plan_text(1, 300).replace("[\"idm\", \"l-cth+linear\", 28]", "[\"idm\", \"gipps\"]"));
    ok(&["study", "run", text(&study)]);
    let report = reported(&study, &[]);
    let figure = String::from_utf8_lossy(&report["figure5.svg"]);
    assert!(figure.contains("IDM") && figure.contains("Gipps"), "{figure}");
    assert!(!figure.contains("lowest") && !figure.contains("highest"), "{figure}");
}

/// The paper's tables are of NRMSE(s,v,a), so they neither appear beside another measure nor judge it.
#[test]
fn a_study_of_another_goodness_of_fit_is_not_put_beside_the_papers_numbers() {
    let plan = plan_text(1, 300).replace("replicates = 1", "replicates = 1\ngof = \"rmse-s\"");
    let study = planned("report_rmse", &plan);
    ok(&["study", "run", text(&study)]);
    let report = reported(&study, &[]);
    for (name, column) in
        [("table4.csv", "paper_median"), ("table5.csv", "paper_collisions"), ("figure6.csv", "paper_median")]
    {
        let rows = rows_in(&report[name]);
        assert!(rows.len() == 3 && rows.iter().all(|row| row[column].is_empty()), "{name}: {rows:?}");
    }
    let summary = String::from_utf8(report["report.md"].clone()).unwrap();
    assert!(
        summary.contains("The following is for rmse-s; the paper's Tables 4 and 5 are of NRMSE(s,v,a)"),
        "{summary}"
    );
    assert!(!summary.contains("| agrees |") && !summary.contains("**differs**"), "{summary}");
    assert!(!summary.contains("the paper says") && !summary.contains("be judged by"), "{summary}");
    for figure in ["figure6.svg", "figure7.svg"] {
        let svg = String::from_utf8(report[figure].clone()).unwrap();
        assert!(!svg.contains("Open diamonds") && !svg.contains("Grey steps"), "{figure}");
    }
}
