//! The program as its users start it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

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

/// Exit code and stderr of a command that must fail, with nothing on stdout.
pub fn fails(arguments: &[&str]) -> (i32, String) {
    let output = leadlag(arguments);
    assert!(!output.status.success(), "{arguments:?} should fail");
    assert_eq!(stdout(&output), "", "{arguments:?}: stdout is for results only");
    (output.status.code().expect("no signal"), stderr(&output))
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
