//! Torn, duplicate, contradictory, foreign and missing parts.

use super::common::{
    expected, fails, files, merged, number_before, ok, part_names, plan_text, planned, refused, same, small, succeeds,
    text,
};
use super::common::{json, leadlag, stderr};
use leadlag::internal::study::part::Part;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

fn finished(name: &str) -> (PathBuf, Vec<PathBuf>) {
    let study = small(name);
    ok(&["study", "run", text(&study)]);
    let mut names = part_names(&study);
    names.sort();
    let paths = names.iter().map(|name| study.join("parts").join(name)).collect();
    (study, paths)
}

fn status(study: &Path) -> serde_json::Value {
    json(&["study", "status", text(study), "--json"])
}

#[test]
fn torn_parts_are_noticed_and_computed_again() {
    let (study, paths) = finished("torn");
    let whole = fs::read(&paths[0]).unwrap();
    // Empty, cut in the middle, cut before the checksum, one digit changed, garbage, zeros as after a crash of a file system.
    let line = whole.iter().position(|b| *b == b'\n').unwrap();
    let mut changed = fs::read(&paths[3]).unwrap();
    let digit = changed.iter().rposition(|b| *b == b'7').unwrap();
    changed[digit] = b'8';
    for (path, bytes) in paths.iter().zip([
        Vec::new(),
        fs::read(&paths[1]).unwrap()[..1000].to_vec(),
        fs::read(&paths[2]).unwrap()[..line.min(500)].to_vec(),
        changed,
        b"no part at all\n".to_vec(),
        vec![0; 4096],
    ]) {
        fs::write(path, bytes).unwrap();
    }
    // And the files that a process leaves behind if it is killed while it writes.
    fs::write(study.join("parts/leftover-1-1.tmp"), &whole[..100]).unwrap();
    // A file without an end, or almost, is not read completely.
    fs::File::create(study.join("parts/large.json")).unwrap().set_len(1 << 40).unwrap();
    let found = status(&study);
    assert_eq!((found["done"].as_u64(), found["damaged"].as_array().unwrap().len()), (Some(18), 7));
    assert_eq!(found["missing"].as_array().unwrap().len(), 6);
    assert_eq!(found["unfinished"].as_array().unwrap().len(), 1);
    refused(1, &["study", "merge", text(&study)])
        .says("is not a complete part of this version: its task counts as missing")
        .says("6 of 24 tasks are missing");
    let output = leadlag(&["study", "run", text(&study)]);
    assert_eq!(number_before(&stderr(&output), "computed"), 6);
    same(&merged(&study, &[]), expected(), "after torn parts");
    // The next run removed the leftover.
    assert_eq!(status(&study)["unfinished"].as_array().unwrap().len(), 0);
}

#[test]
fn a_double_part_does_no_harm_and_a_contradiction_stops_the_merge() {
    let (study, paths) = finished("double");
    fs::copy(&paths[0], study.join("parts/copy of a part.json")).unwrap();
    let output = succeeds(&["study", "merge", text(&study)]);
    assert!(stderr(&output).contains("repeats another part: no harm"), "{}", stderr(&output));
    same(&merged(&study, &[]), expected(), "with a double part");

    let mut part = Part::decode(&fs::read(&paths[1]).unwrap()).expect("a whole part");
    part.calibration.evaluations += 1;
    let other = study.join("parts/other.json");
    fs::write(&other, part.encode()).unwrap();
    let (code, said) = fails(&["study", "merge", text(&study)]);
    assert_eq!(code, 1);
    let pair = format!("{}: contradicts {}, a part of the same task", other.display(), paths[1].display());
    assert!(
        said.contains(&pair) && said.contains("parts contradict each other (1 pair), and leadlag uses neither"),
        "{said}"
    );
    let shown = ok(&["study", "status", text(&study)]);
    assert!(shown.contains(&pair) && shown.contains("delete the wrong file of each pair"), "{shown}");
    // The file with the name of its task is first, whatever sorts before it.
    let early = study.join("parts/000.json");
    fs::rename(&other, &early).unwrap();
    let pair = serde_json::json!([text(&early), text(&paths[1])]);
    assert_eq!(status(&study)["conflicting"], serde_json::json!([pair]));
    // In another folder too.
    let elsewhere = study.with_file_name("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    let other = elsewhere.join("other.json");
    fs::rename(&early, &other).unwrap();
    assert_eq!(status(&study)["conflicting"], serde_json::json!([]));
    let shown = ok(&["study", "status", text(&study), "--parts", text(&elsewhere)]);
    assert!(shown.contains(&format!("{}: contradicts ", other.display())), "{shown}");
    let back = study.join("parts/other.json");
    fs::rename(&other, &back).unwrap();
    let other = back;
    refused(1, &["study", "report", text(&study)]).says("parts contradict each other (1 pair)");
    fs::remove_file(other).unwrap();
    same(&merged(&study, &[]), expected(), "without the contradiction");
}

#[test]
fn parts_of_another_plan_are_left_out() {
    let (study, _) = finished("foreign");
    let other = planned("foreign_other", &plan_text(1, 301));
    ok(&["study", "run", text(&other), "--shard", "1/3"]);
    let name = part_names(&other).remove(0);
    fs::copy(other.join("parts").join(&name), study.join("parts").join(&name)).unwrap();
    assert_eq!(status(&study)["foreign"].as_array().unwrap().len(), 1);
    same(&merged(&study, &[]), expected(), "with a foreign part");
}

#[test]
fn missing_parts_are_named_and_merged_without_only_when_asked() {
    let (study, paths) = finished("missing");
    fs::remove_file(&paths[5]).unwrap();
    let id = paths[5].file_stem().unwrap().to_string_lossy().into_owned();
    assert_eq!(status(&study)["missing"][0].as_str(), Some(id.as_str()));
    refused(1, &["study", "merge", text(&study)]).says(&format!("missing: {id} (S"));
    assert!(!study.join("merged").exists(), "nothing is written");
    let partial = merged(&study, &["--partial"]);
    let lines = String::from_utf8(partial["calibrations.csv"].clone()).unwrap().lines().count();
    assert_eq!(lines, 1 + 23);
    let lacking = String::from_utf8(partial["missing.csv"].clone()).unwrap();
    assert!(lacking.lines().count() == 2 && lacking.contains(&id), "{lacking}");
    let parquet = String::from_utf8_lossy(&partial["calibrations.parquet"]).into_owned();
    assert!(parquet.contains("leadlag_missing_tasks"), "a table says that it is not whole");
    ok(&["study", "run", text(&study)]);
    same(&merged(&study, &[]), expected(), "after the missing one");
}

#[test]
fn a_changed_plan_keeps_the_parts_that_stay_valid() {
    let (study, _) = finished("grown");
    let plan = study.join("plan.toml");
    let grown = fs::read_to_string(&plan).unwrap().replace("replicates = 2", "replicates = 3");
    let file = study.with_file_name("grown.toml");
    fs::write(&file, grown).unwrap();
    ok(&["study", "plan", text(&file), "--out", text(&study)]);
    let output = leadlag(&["study", "run", text(&study)]);
    assert!(stderr(&output).contains("36 tasks: 24 were done, 12 computed"), "{}", stderr(&output));
}

#[test]
fn what_a_killed_process_was_writing_counts_for_nothing_and_goes_after_an_hour() {
    let (study, _) = finished("leftovers");
    merged(&study, &[]);
    fs::create_dir(study.join("report")).unwrap();
    let before = status(&study);
    let log = fs::read_dir(study.join("runs")).unwrap().next().expect("a run").unwrap().path();
    // No process can lock the last one, as on a file system without locks.
    fs::create_dir(study.join("claims/part")).unwrap();
    let old = [
        "runs/1-1.1-1.tmp",
        "merged/calibrations.1-1.tmp",
        "report/report.1-1.tmp",
        "tasks.1-1.tmp",
        "parts/part.1-1.tmp",
    ];
    for name in old {
        let path = study.join(name);
        fs::copy(&log, &path).unwrap();
        let long_ago = SystemTime::now() - Duration::from_secs(2 * 3600);
        fs::File::options().write(true).open(path).unwrap().set_modified(long_ago).unwrap();
    }
    // Another process may be about to rename this one.
    let young = study.join("runs/1-2.2-1.tmp");
    fs::copy(&log, &young).unwrap();
    let after = status(&study);
    for key in ["evaluations", "wall_s"] {
        assert!(before[key].as_f64() > Some(0.0) && before[key] == after[key], "{key}: {before} {after}");
    }
    ok(&["study", "run", text(&study)]);
    assert_eq!(old.map(|name| study.join(name).exists()), [false; 5]);
    assert!(young.exists());
}

#[test]
fn empty_tables_do_not_replace_those_of_the_plan_before() {
    let (study, _) = finished("replanned");
    let tables = merged(&study, &[]);
    let file = study.with_file_name("other.toml");
    fs::write(&file, plan_text(2, 301)).unwrap();
    ok(&["study", "plan", text(&file), "--out", text(&study)]);
    refused(1, &["study", "merge", text(&study), "--partial"])
        .says("no task of this plan is done, and ")
        .says("--out DIR` writes elsewhere");
    same(&files(&study.join("merged")), &tables, "after the refusal");
    let elsewhere = study.with_file_name("elsewhere");
    ok(&["study", "merge", text(&study), "--partial", "--out", text(&elsewhere)]);
    let empty = fs::read_to_string(elsewhere.join("calibrations.csv")).unwrap();
    assert_eq!(empty.lines().count(), 1);
}

#[test]
fn a_study_that_was_copied_without_its_empty_folders_runs() {
    let study = small("copied");
    for name in ["parts", "claims", "runs"] {
        fs::remove_dir(study.join(name)).unwrap();
    }
    ok(&["study", "run", text(&study)]);
    same(&merged(&study, &[]), expected(), "a copy");
}

#[test]
fn without_locks_a_run_says_so_and_computes_the_same() {
    let study = small("no_locks");
    fs::create_dir(study.join("claims/locks")).unwrap();
    let output = succeeds(&["study", "run", text(&study)]);
    assert!(
        stderr(&output).contains("warning: ") && stderr(&output).contains("files cannot be locked here"),
        "{}",
        stderr(&output)
    );
    same(&merged(&study, &[]), expected(), "without locks");
}
