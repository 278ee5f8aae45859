//! A tiny study and helpers for it.

#[path = "../common/program.rs"]
#[allow(dead_code, reason = "every test program uses some of it")]
mod program;

pub use program::{fails, flat, json, json_of, leadlag, ok, refused, rows_in, stderr, succeeds, text};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// The program with arguments.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// An empty folder for one test.
pub fn scratch(name: &str) -> PathBuf {
    program::scratch("study", name)
}

/// Two synthetic platoons with the same cars, made once.
pub fn data() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = scratch("data");
        for (name, seed) in [("one", "1"), ("two", "2")] {
            ok(&["synth", "--out", text(&folder.join(name)), "--seed", seed, "--duration", "60"]);
        }
        folder
    })
}

/// The text of a plan: followers 1 and 2 of both platoons, three variants, by the genetic algorithm.
pub fn plan_text(replicates: u32, evaluations: u32) -> String {
    plan_by("ga", replicates, evaluations)
}

/// The same by another optimiser.
pub fn plan_by(optimizer: &str, replicates: u32, evaluations: u32) -> String {
    format!(
        r#"schema_version = 1

[data]
folder = "{}"

[[platoon]]
name = "S1"
file = "one/platoon.csv"
followers = [1, 2]

[[platoon]]
name = "S2"
file = "two/platoon.csv"
followers = [1, 2]

[calibration]
variants = ["idm", "l-cth+linear", 28]
optimizer = "{optimizer}"
replicates = {replicates}
max_evaluations = {evaluations}
"#,
        data().display()
    )
}

/// Lays a study out in a fresh folder.
pub fn planned(name: &str, plan: &str) -> PathBuf {
    let folder = scratch(name);
    let (file, study) = (folder.join("plan.toml"), folder.join("study"));
    fs::write(&file, plan).expect("the plan can be written");
    ok(&["study", "plan", text(&file), "--out", text(&study)]);
    study
}

/// The small plan that most tests run: 24 tasks.
pub fn small(name: &str) -> PathBuf {
    planned(name, &plan_text(2, 300))
}

/// Merged tables of an uninterrupted run of the small plan, computed once.
pub fn expected() -> &'static BTreeMap<String, Vec<u8>> {
    static BYTES: OnceLock<BTreeMap<String, Vec<u8>>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let study = small("expected");
        ok(&["study", "run", text(&study)]);
        merged(&study, &[])
    })
}

/// Merges, and returns the bytes of every resulting file.
pub fn merged(study: &Path, further: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let mut arguments = vec!["study", "merge", text(study)];
    arguments.extend(further);
    ok(&arguments);
    files(&study.join("merged"))
}

/// Name and bytes of every file of a folder.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("the folder is there").map(|e| e.expect("it is readable").path());
    let name = |path: &Path| path.file_name().expect("a file has a name").to_string_lossy().into_owned();
    entries.filter(|path| path.is_file()).map(|path| (name(&path), fs::read(&path).expect("readable"))).collect()
}

/// Asserts that two sets of files are the same, naming the file that differs.
pub fn same(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>, what: &str) {
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected), "{what}");
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{what}: {name} differs");
    }
}

/// Number of finished parts, by file name alone.
pub fn part_names(study: &Path) -> Vec<String> {
    let entries = fs::read_dir(study.join("parts")).expect("the folder is there");
    let names = entries.map(|e| e.expect("it is readable").file_name().to_string_lossy().into_owned());
    names.filter(|name| name.ends_with(".json")).collect()
}

/// The number before a word in a summary: `12 computed`.
pub fn number_before(text: &str, word: &str) -> usize {
    let words: Vec<&str> = text.split_whitespace().collect();
    let at = words.iter().position(|w| w.trim_end_matches([',', ';']) == word);
    let at = at.unwrap_or_else(|| panic!("no `{word}` in: {text}"));
    words[at - 1].parse().unwrap_or_else(|_| panic!("no number before `{word}` in: {text}"))
}
