//! Plans with extensions: part of a task, stored with the study, separate columns.

use super::common::{flat, ok, plan_text, refused, scratch, stderr, succeeds, text};
use leadlag::internal::study::{Plan, Study};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

const OWN: &str = "//! The car brakes less than commanded.
struct Parameters {
    /// share of the braking that is lost [-], 0 to 0.9, neutral 0
    lost: f32,
    /// a limit of braking [m/s2], 1 to 9
    hardest: f32,
}

fn soft_command(own: Parameters, a_cmd: f32) -> f32 {
    return max(select(a_cmd, (1.0 - own.lost) * a_cmd, a_cmd < 0.0), 0.0 - own.hardest);
}
";

/// A plan of two variants with extensions, and the file `soft.wgsl` beside it.
fn plan(name: &str, extend: &str, soft: &str) -> PathBuf {
    let folder = scratch(name);
    fs::write(folder.join("soft.wgsl"), soft).unwrap();
    let text = plan_text(1, 300).replace("[\"idm\", \"l-cth+linear\", 28]", "[\"idm\", \"idm+linear\"]");
    let file = folder.join("plan.toml");
    fs::write(&file, text.replace("[calibration]", &format!("[calibration]\n{extend}"))).unwrap();
    file
}

fn ids(name: &str, extend: &str, soft: &str) -> BTreeSet<String> {
    let file = plan(name, extend, soft);
    let lines = ok(&["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))]);
    lines.lines().map(|line| line.split('\t').next().unwrap().to_owned()).collect()
}

#[test]
fn the_text_of_an_extension_is_part_of_a_task() {
    let own = "extend = [\"soft.wgsl\"]";
    let all = [
        ids("extend_none", "", OWN),
        ids("extend_own", own, OWN),
        ids("extend_other", own, &OWN.replace("0.0 - own", "0.5 - own")),
        ids("extend_built_in", "extend = [\"dead_zone\"]", OWN),
        ids("extend_both", "extend = [\"soft.wgsl\", \"dead_zone\"]", OWN),
    ];
    let distinct: BTreeSet<&String> = all.iter().flatten().collect();
    assert_eq!(distinct.len(), 8 * all.len(), "each plan has tasks of its own");
    assert_eq!(all[0], ids("extend_empty", "extend = []", OWN), "no extension is as none");
}

#[test]
fn an_extended_study_keeps_the_text_and_tells_its_parameters() {
    let file = plan("extend_run", "extend = [\"soft.wgsl\", \"dead_zone\"]\nbounds = { lost = 0.25, w_none = 0 }", OWN);
    let wrong = fs::read_to_string(&file).unwrap();
    let study = file.with_file_name("study");
    refused(2, &["study", "plan", text(&file), "--out", text(&study)])
        .says("calibration.bounds.w_none: not a parameter of any variant");
    fs::write(&file, wrong.replace(", w_none = 0", "")).unwrap();
    ok(&["study", "plan", text(&file), "--out", text(&study)]);
    // Only the folder of the study is needed from here on.
    fs::remove_file(file.with_file_name("soft.wgsl")).unwrap();
    ok(&["study", "run", text(&study)]);
    // As the program advises if data, plan or program have changed.
    let tasks = fs::read(study.join("tasks.jsonl")).unwrap();
    ok(&["study", "plan", text(&study.join("plan.toml")), "--out", text(&study)]);
    assert!(fs::read(study.join("tasks.jsonl")).unwrap() == tasks, "the same tasks");
    assert!(fs::read_to_string(study.join("study.json")).unwrap().contains("\"name\": \"plan\""));
    ok(&["study", "merge", text(&study)]);
    let table = fs::read_to_string(study.join("merged/calibrations.csv")).unwrap();
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let columns: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let at = |name: &str| columns.iter().position(|c| c == name).unwrap_or_else(|| panic!("no {name}: {columns:?}"));
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 8);
    for row in &rows {
        assert!(row[at("variant")].ends_with("+dead_zone+soft"), "{}", &row[at("variant")]);
        assert_eq!((&row[at("base")], &row[at("lost")], &row[at("success")]), ("idm", "0.25", "true"));
        let hardest: f64 = row[at("hardest_mps2")].parse().unwrap();
        assert!((1.0..=9.0).contains(&hardest));
    }
    assert_eq!(rows.iter().filter(|row| &row[at("dynamics")] == "linear").count(), 4);
    ok(&["study", "report", text(&study)]);
    let report = fs::read_to_string(study.join("report/report.md")).unwrap();
    assert!(report.contains("extended by soft, dead_zone"), "{report}");
    assert!(report.contains("| 4 | `idm+linear` |"), "{report}");
}

#[test]
fn extensions_that_cannot_be_say_why() {
    for (extend, message) in [
        ("\"actuation_lug\"", "did you mean `actuation_lag`?"),
        ("\"hard.wgsl\"", "hard.wgsl: cannot be read; its path is relative to the folder of the plan"),
        ("\"soft.wgsl\", \"soft.wgsl\"", "calibration.extend: extension soft: the model contains it already"),
    ] {
        let file = plan("extend_bad", &format!("extend = [{extend}]"), OWN);
        refused(2, &["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))]).says(message);
    }
    let file = plan("extend_broken", "extend = [\"soft.wgsl\"]", &OWN.replace("own.lost", "own.gone"));
    refused(2, &["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))]).says("soft.wgsl:10");
    let file = plan("extend_part", "extend = [\"linear.wgsl\"]", OWN);
    fs::write(file.with_file_name("linear.wgsl"), OWN.replace("soft_", "linear_")).unwrap();
    refused(2, &["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))])
        .says("linear is a part of the paper's variants");
    let file = plan("extend_column", "extend = [\"soft.wgsl\"]", &OWN.replace("lost", "score"));
    refused(2, &["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))])
        .says("a parameter of soft would be the column score, which the tables");
    let file = plan("extend_columns", "extend = [\"soft.wgsl\"]", &OWN.replace("lost", "hardest_mps2"));
    refused(2, &["study", "plan", text(&file), "--out", text(&file.with_file_name("study"))])
        .says("would both be the column hardest_mps2; give one of them another name");
}

/// The delay of an extension moves the first scored sample, as that of the variant does.
#[test]
fn the_first_scored_sample_counts_the_delay_of_an_extension() {
    let more = "convention = \"authors\"\nbounds = { tp = 0.35 }";
    let file = plan("extend_delay", &format!("extend = [\"perception_delay\"]\n{more}"), OWN);
    let study = file.with_file_name("study");
    ok(&["study", "plan", text(&file), "--out", text(&study)]);
    ok(&["study", "run", text(&study)]);
    ok(&["study", "merge", text(&study)]);
    for name in ["calibrations", "validations"] {
        let table = fs::read_to_string(study.join(format!("merged/{name}.csv"))).unwrap();
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let at = reader.headers().unwrap().iter().position(|c| c == "first_scored").unwrap();
        let found: BTreeSet<String> = reader.records().map(|row| row.unwrap()[at].to_owned()).collect();
        // floor(0.35 s / 0.1 s) + 1
        assert_eq!(found, BTreeSet::from(["4".to_owned()]), "{name}");
    }
}

/// 25 s of a car behind two others, from a start time on; steps of 1/8 s have the same bits for any start.
fn pair(start: f64, lead2: f64) -> String {
    let head = "time_s,lead_speed_mps,speed_mps,spacing_m,lead2_speed_mps,lead2_spacing_m\n".to_owned();
    (0..200).fold(head, |mut text, i| {
        let t = f64::from(i) / 8.0;
        let (v_l, s) = (15.0 + (0.5 * t).sin(), 22.0 - 2.0 * (0.5 * t).cos());
        writeln!(text, "{},{v_l:.3},15,{s:.3},{lead2},30", start + t).unwrap();
        text
    })
}

/// Ids of the tasks on drive A, which is always the same and is validated on drive B, which the plan may describe further. `folder` is
/// separate for each test, because tests run in parallel.
fn ids_beside(folder: &Path, more: &str, b: &str) -> Vec<String> {
    fs::write(folder.join("a.csv"), pair(0.0, 15.0)).unwrap();
    fs::write(folder.join("b.csv"), b).unwrap();
    let content = format!(
        "schema_version = 1\n[data]\n[[platoon]]\nname = \"A\"\nfile = \"a.csv\"\n[[platoon]]\nname = \"B\"\nfile = \"b.csv\"\n{more}\n\
         [calibration]\nvariants = [\"idm\"]\n"
    );
    let plan = Plan::parse(&content, "plan.toml", folder, "beside").unwrap_or_else(|error| panic!("{error}"));
    let study = Study::open(plan).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(study.validated_on(0), [1]);
    study.tasks().into_iter().filter(|task| task.platoon == "A").map(|task| task.id).collect()
}

/// Files of pairs name no car.
#[test]
fn cars_without_a_name_are_told_to_be_taken_for_one() {
    let folder = scratch("extend_nameless");
    let told = |validation: &str| {
        let plan = format!(
            "schema_version = 1\n[data]\n[[platoon]]\nname = \"A\"\nfile = \"a.csv\"\n[[platoon]]\nname = \"B\"\nfile = \"b.csv\"\n\
             [calibration]\nvariants = [\"idm\"]\n[validation]\non = \"{validation}\"\n"
        );
        for file in ["a.csv", "b.csv"] {
            fs::write(folder.join(file), pair(0.0, 15.0)).unwrap();
        }
        fs::write(folder.join("nameless.toml"), plan).unwrap();
        let out = folder.join(validation);
        let output = succeeds(&["study", "plan", text(&folder.join("nameless.toml")), "--out", text(&out)]);
        flat(&stderr(&output))
    };
    let (tried, apart) = (told("same-vehicle"), told("none"));
    assert!(tried.contains("the files do not name the cars: those called follower in several platoons"), "{tried}");
    assert!(!apart.contains("do not name the cars"), "{apart}");
}

/// All input of a validation run affects the result of a task; so do the bytes of its file, whose checksum the part holds.
#[test]
fn an_id_changes_with_what_is_read_of_the_other_drives_and_with_their_files() {
    let file = pair(0.0, 15.0);
    let other_line_ends = file.replace('\n', "\r\n");
    let folder = scratch("extend_beside_files");
    let ids = |more, b: &str| ids_beside(&folder, more, b);
    let beside = [
        ids("", &file),
        ids("", &pair(100.0, 15.0)),
        ids("", &pair(0.0, 16.0)),
        ids("", &other_line_ends),
        ids("from_s = 1", &file),
    ];
    assert_eq!(beside.iter().collect::<BTreeSet<_>>().len(), beside.len());
    assert_eq!(ids("", &file), beside[0]);
}

/// The same numbers from another start time: the end of a run is given in the time of the file.
#[test]
fn an_id_changes_with_the_time_at_which_a_drive_begins() {
    let steady = |rows: std::ops::Range<i32>| {
        let head = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
        rows.fold(head, |text, i| text + &format!("{},15,15,30\n", f64::from(i) / 8.0))
    };
    let file = steady(0..200);
    let folder = scratch("extend_beside_times");
    assert_ne!(ids_beside(&folder, "to_s = 20", &file), ids_beside(&folder, "from_s = 4\nto_s = 24", &file));
}
