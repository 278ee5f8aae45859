//! Output of a run under way, without a terminal.

use super::common::{command, leadlag, scratch, small, stderr, text};
use std::fs;

/// Whole lines of progress on stderr of a run, with this many seconds between them.
fn lines(name: &str, every_s: &str, further: &[&str]) -> Vec<String> {
    let study = small(name);
    let mut run = command(&["study", "run", text(&study), "--batch", "1", "--threads", "1"]);
    let output = run.args(further).env("LEADLAG_PROGRESS_S", every_s).output().expect("the program starts");
    assert!(output.status.success(), "{}", stderr(&output));
    stderr(&output).lines().filter(|line| line.contains("/24 tasks, ")).map(str::to_owned).collect()
}

#[test]
fn a_run_without_a_terminal_says_how_far_it_is() {
    let said = lines("lines", "0", &[]);
    let done = |line: &String| line.split('/').next().unwrap().parse::<usize>().expect("a number of tasks");
    assert!(said.iter().map(done).is_sorted(), "{said:?}");
    let running = |line: &&String| line.contains("/s, ") && line.contains(" left, ") && line.contains(" simulations/s");
    assert!(said.iter().filter(running).count() > 3, "{said:?}");
    assert!(lines("lines_seldom", "3600", &[]).is_empty(), "not before it is time");
    assert!(lines("lines_quiet", "0", &["--quiet"]).is_empty(), "--quiet");
}

#[test]
fn quiet_verbs_say_nothing_but_errors() {
    let study = small("quiet");
    let (study, plan) = (text(&study), study.join("plan.toml"));
    let other = scratch("quiet_plan");
    let quietly = |arguments: &[&str]| {
        let output = leadlag(&[&["-q", "study"][..], arguments].concat());
        (output.status.code(), stderr(&output))
    };
    let silent = (Some(0), String::new());
    assert_eq!(quietly(&["plan", text(&plan), "--out", text(&other)]), silent);
    let (code, said) = quietly(&["merge", study]);
    assert!(code == Some(1) && said.starts_with("error: 24 of 24 tasks are missing"), "{said}");
    assert_eq!(quietly(&["run", study, "--shard", "1/3"]), silent);
    // An invalid part gives a warning, which --quiet silences.
    fs::write(std::path::Path::new(study).join("parts/torn.json"), "{").unwrap();
    assert_eq!(quietly(&["merge", study, "--partial"]), silent);
    assert_eq!(quietly(&["report", study, "--partial"]), silent);
}
