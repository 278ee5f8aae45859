//! The program as its users start it.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, PoisonError};

/// Runs it.
pub fn leadlag(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_leadlag")).args(arguments).output().expect("the program starts")
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// A command that must succeed.
pub fn succeeds(arguments: &[&str]) -> Output {
    let output = leadlag(arguments);
    assert!(output.status.success(), "{arguments:?}\n{}", stderr(&output));
    output
}

/// Stdout of a command that must succeed.
pub fn ok(arguments: &[&str]) -> String {
    stdout(&succeeds(arguments))
}

/// A short calibration of `idm`, which must succeed.
pub fn quick(file: &Path, out: &Path, more: &[&str]) -> Output {
    let search = ["--model", "idm", "--max-evaluations", "100", "--no-intervals", "--out", text(out)];
    succeeds(&[&["calibrate", text(file)], &search[..], more].concat())
}

/// A table with every row but the header changed.
pub fn edited(table: &str, mut change: impl FnMut(usize, &mut [String])) -> String {
    let row = |(i, line): (usize, &str)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if i > 0 {
            change(i, &mut fields);
        }
        fields.join(",") + "\n"
    };
    table.lines().enumerate().map(row).collect()
}

/// Multiplies a number in a field.
pub fn scale(field: &mut String, factor: f64) {
    *field = (field.parse::<f64>().expect("a number") * factor).to_string();
}

/// Words with one blank between them, wherever the lines end.
pub fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The JSON of a command that must succeed.
pub fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&ok(arguments)).expect("JSON")
}

/// A file that holds JSON.
pub fn json_of(path: impl AsRef<Path>) -> Value {
    let path = path.as_ref();
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&bytes).expect("JSON")
}

/// The rows of a table by column; no two columns have one name.
pub fn rows_of(path: &Path) -> Vec<BTreeMap<String, String>> {
    rows_in(&fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// The same of the bytes of a table.
pub fn rows_in(table: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_reader(table);
    let columns = reader.headers().expect("a header").len();
    let rows: Vec<BTreeMap<_, _>> = reader.deserialize().map(|row| row.expect("a row")).collect();
    assert!(rows.iter().all(|row| row.len() == columns), "two columns have one name");
    rows
}

/// Files of a synthetic platoon that drives this long \[s\], made once: platoon.csv, pair_follower1.csv, Slope.csv. They are for reading only.
pub fn synth(seconds: u32) -> PathBuf {
    static MADE: Mutex<BTreeMap<u32, PathBuf>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let make = || {
        let folder = scratch(env!("CARGO_CRATE_NAME"), &format!("platoon_{seconds}"));
        ok(&["synth", "--out", text(&folder), "--duration", &seconds.to_string(), "--pairs"]);
        folder
    };
    made.entry(seconds).or_insert_with(make).clone()
}

/// stderr of a command that must end with this exit code.
pub fn exits(code: i32, arguments: &[&str]) -> String {
    let output = leadlag(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{}", stderr(&output));
    stderr(&output)
}

/// Exit code and stderr of a command that must fail, with nothing on stdout.
pub fn fails(arguments: &[&str]) -> (i32, String) {
    let output = leadlag(arguments);
    assert!(!output.status.success(), "{arguments:?} should fail");
    assert_eq!(stdout(&output), "", "{arguments:?}: stdout is for results only");
    (output.status.code().expect("no signal"), stderr(&output))
}

/// stderr of a command that failed.
pub struct Refused(pub String);

/// A command that must end with this exit code and nothing on stdout.
#[track_caller]
pub fn refused(code: i32, arguments: &[&str]) -> Refused {
    let (found, said) = fails(arguments);
    assert_eq!(found, code, "{arguments:?}\n{said}");
    Refused(said)
}

impl Refused {
    #[track_caller]
    pub fn says(self, expected: &str) -> Refused {
        assert!(self.0.contains(expected), "expected {expected}\nfound {}", self.0);
        self
    }
}

/// An empty folder for one test of a test file.
pub fn scratch(file: &str, name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(file).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

pub fn text(path: &Path) -> &str {
    path.to_str().expect("a UTF-8 path")
}
