//! `leadlag bench diagnosis`: its journal, and the page that `scripts/naming.py` makes of its JSON.

use crate::common::made_up;
use leadlag::internal::batch::Journal;
use leadlag::internal::bench::{DiagnosisOutcome, DiagnosisTask, SIZES, diagnosis_tasks};
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::PROGRAM;
use leadlag::internal::diagnose::judge::oracle::known;
use leadlag::internal::wgsl::extension_named;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

/// A case with this name; its parameters are off by `off`.
fn outcome(task: &DiagnosisTask, adopted: &[String], off: f64) -> DiagnosisOutcome {
    let names = || adopted.iter().map(|cause| format!("{cause}.size"));
    DiagnosisOutcome {
        program: PROGRAM.clone(),
        task: task.clone(),
        truth: names().map(|name| (name, 1.0)).collect(),
        verdict: if adopted.is_empty() { "nothing" } else { "named" }.to_owned(),
        reason: String::new(),
        adopted: adopted.to_vec(),
        confounded_with: Vec::new(),
        not_testable: Vec::new(),
        estimates: names().map(|name| (name, [1.0 + off, 0.01])).collect::<BTreeMap<_, _>>(),
        simulations: 1000,
        cpu_s: 2.0,
        // Of 16 nats needed, the likeliest cause has 4.
        tried: vec![(1, "periodic".to_owned(), [Some(9.0), Some(4.0), Some(16.0)], "4.0 nats, 16.0 needed".to_owned())],
        base: [1.0, 0.01, 2.0],
        gain: None,
        known: None,
        recommended: Some(adopted.to_vec()),
        unknown: None,
        passing: Vec::new(),
    }
}

/// A journal in which every effect is named as planted except the first two single effects: one has no name, one a wrong name.
fn journal(folder: &Path) -> usize {
    let tasks = diagnosis_tasks(1, 900.0, "normal", &SIZES).expect("few cases");
    let singles: Vec<&DiagnosisTask> = tasks.iter().filter(|task| task.kind == "one").collect();
    let said = |task: &DiagnosisTask| match task {
        task if task == singles[0] => Vec::new(),
        task if task == singles[1] => vec!["gain_mass".to_owned()],
        task if ["one", "pair"].contains(&task.kind.as_str()) => task.causes.clone(),
        _ => Vec::new(),
    };
    let off = |task: &DiagnosisTask| if task == singles[2] { 0.2 } else { 0.02 };
    let line =
        |task: &DiagnosisTask| serde_json::to_string(&outcome(task, &said(task), off(task))).expect("JSON") + "\n";
    std::fs::write(folder.join("diagnosis.jsonl"), tasks.iter().map(line).collect::<String>()).expect("written");
    tasks.len()
}

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    command.args(["bench", "diagnosis"]).args(arguments).current_dir(folder);
    command.output().expect("leadlag starts")
}

/// Runs the script on the JSON of the cases and a page with this text; returns its messages, or the new page. `None` without Python.
fn page(folder: &Path, text: &str) -> Option<Result<String, String>> {
    let (report, page) = (folder.join("report.json"), folder.join("page.md"));
    std::fs::write(&report, bench(folder, &["--json"]).stdout).expect("written");
    std::fs::write(&page, text).expect("written");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/naming.py");
    let output =
        Command::new("python3").arg(script).args([&report, &page]).arg("leadlag bench diagnosis").output().ok()?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    Some(if output.status.success() { Ok(std::fs::read_to_string(&page).expect("a page")) } else { Err(said) })
}

#[test]
fn a_page_gets_tables_and_pictures() {
    const BEGIN: &str = "<!-- scripts/naming: what follows is written by it -->";
    const END: &str = "<!-- scripts/naming: end -->";
    let folder = tempfile::tempdir().expect("a folder");
    let count = journal(folder.path());
    let Some(made) = page(folder.path(), &format!("# Page\n\n{BEGIN}\nold\n{END}\n\nafter\n")) else {
        eprintln!("SKIPPED a_page_gets_tables_and_pictures: no python3");
        return;
    };
    let text = made.expect("a page with both marks");
    assert!(text.starts_with("# Page\n") && text.ends_with("after\n") && !text.contains("\nold\n"), "{text}");
    let tasks = diagnosis_tasks(1, 900.0, "normal", &SIZES).expect("few cases");
    let of = |kinds: &[&str]| tasks.iter().filter(|task| kinds.contains(&task.kind.as_str())).count();
    let (singles, pairs, silent) = (of(&["one"]), of(&["pair"]), of(&["none", "coloured"]));
    let right = singles - 2 + pairs;
    for part in [
        format!("`leadlag bench diagnosis`: all {count} cases. {}, ", PROGRAM.as_str()),
        format!("| wrong name, one effect of any size | 1 of {singles} |"),
        format!("named right, {} of {right} have all parameters", right - 1),
        "![Planted effects, and their names](images/diagnosis_names.svg)".to_owned(),
        "| one effect, named right | 0.03 m/s | 0.1 m/s |".to_owned(),
        format!("| all bases | {silent} | 0.25 | 0.25 | 0.25 |"),
    ] {
        assert!(text.contains(&part), "no `{part}` in {text}");
    }
    let picture = |name: &str| {
        let svg =
            std::fs::read_to_string(folder.path().join(format!("images/diagnosis_{name}.svg"))).expect("a picture");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg}");
        svg
    };
    let [names, power] = ["names", "power"].map(picture);
    assert!(names.contains(">gain_mass</text>") && names.contains(">no name</text>"), "{names}");
    assert!(power.contains("<title>all bases, 0.03 m/s: "), "{power}");
    let again = page(folder.path(), &text).expect("Python").expect("a page with both marks");
    // The page has the date.
    let undated = |text: &str| text.lines().filter(|line| !line.contains(", written 20")).map(str::to_owned).collect();
    let [first, second]: [Vec<String>; 2] = [&text, &again].map(|text| undated(text));
    assert_eq!(first, second, "the same again");
    for text in ["# Page\n".to_owned(), format!("{END}\n{BEGIN}\n"), format!("{BEGIN}\n{END}\n").repeat(2)] {
        let said = page(folder.path(), &text).expect("Python").expect_err("no place for the results");
        assert!(said.contains("put both where the results belong"), "{said}");
    }
}

#[test]
fn a_part_of_the_cases_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let count = journal(folder.path());
    let output = bench(folder.path(), &["--cases", "40"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains(&format!("\n40 of {count} cases, 0 of them could not be generated\n")), "{text}");
}

#[test]
fn lines_of_another_state_of_the_diagnosis_are_passed_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let count = journal(folder.path());
    let path = folder.path().join("diagnosis.jsonl");
    let text = std::fs::read_to_string(&path).expect("a journal");
    let lines = || DiagnosisOutcome::journal(&path).expect("a journal");
    let tasks = diagnosis_tasks(1, 900.0, "normal", &SIZES).expect("few cases");
    let kept = |journal: &Journal<DiagnosisOutcome>| tasks.iter().filter(|task| journal.get(task).is_some()).count();
    assert_eq!(kept(&lines()), count);
    let before = text.replacen(PROGRAM.as_str(), concat!("leadlag ", env!("CARGO_PKG_VERSION")), 3);
    std::fs::write(&path, before).expect("written");
    assert_eq!(kept(&lines()), count - 3);
}

#[test]
fn seeds_and_sizes_that_give_no_seeds_of_their_own_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let many: Vec<String> = (1..=20).map(|i| format!("0.{i:02}")).collect();
    let many = many.join(",");
    for (arguments, expected) in [
        (["--seed", "18446744073709551615"], "expected a whole number from 0 to 18446744073709550"),
        (["--sizes", &many], "a seed has at most 1000: give fewer sizes"),
    ] {
        let output = bench(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(expected), "{said}");
        assert!(!folder.path().join("diagnosis.jsonl").exists(), "nothing was started");
    }
}

/// An event is exempt from checks of other causes: held-out stretches, and the hold-out. Causes beside an event are not.
#[test]
fn the_evidence_for_two_effects_does_not_depend_on_their_order() {
    let data = made_up::drives("dead_zone", "l-cth");
    let [event, zone] = ["set_speed_change", "dead_zone"].map(|name| extension_named(name).expect("in the library"));
    let (train, holdout) = (&data.train[..1], &data.holdout[..]);
    let (causes, bounds) = ([event, zone], Overrides::new());
    let question = made_up::question([train, holdout], "l-cth", &causes, &bounds);
    let values = [("w", data.effects[0].values()[0]), ("vlim", 25.0), ("t1", 40.0), ("dur", 30.0)];
    let values = values.map(|(name, value)| (name.to_owned(), value));
    let [one, other] = [[event, zone], [zone, event]]
        .map(|causes| known(&question, &causes, &values).expect("no error").expect("both can be driven"));
    assert_eq!(one, other);
    assert_eq!(one.parts.len(), 2);
    // A gain on all of the data is no evidence for a lasting cause.
    assert!(one.evidence <= one.folds[0] + one.folds[1], "{one:?}");
}
