//! Are the proofs sharp? Every constant, operator, comparison, minimum and maximum of `src/reference` is changed, one at
//! a time, and `tests/reference_paper.rs` must fail each time. What survives is listed below, with the reason.
//!
//! The crate is copied to `target/tmp/mutants` with all changes in it at once, each behind a switch that an environment variable
//! sets (mutant schemata), and compiled once; then the judging tests run once per mutant, in a process of their own.
//! `target/tmp/mutants/report.csv` lists every mutant and what became of it.

#[path = "mutants/build.rs"]
mod build;
#[path = "mutants/schemata.rs"]
mod schemata;

use schemata::Mutant;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A mutant that no test can notice: file below `src/reference`, its line as written, the change, why it survives.
struct Survivor {
    file: &'static str,
    line: &'static str,
    change: &'static str,
    reason: &'static str,
}

const SURVIVORS: &[Survivor] = &[];

/// A judging run takes some 0.1 s; a mutant that loops for ever is stopped after this long, and counts as noticed.
const PATIENCE: Duration = Duration::from_secs(20);

/// True if the judging tests pass with this mutant switched on (0: none).
fn passes(judge: &Path, id: usize) -> bool {
    let mut child = Command::new(judge)
        .args(["--quiet", "--test-threads=1"])
        .env(schemata::SWITCH, id.to_string())
        .env("RUST_BACKTRACE", "0")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the judging tests start");
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().expect("the judging tests can be waited for") {
            return status.success();
        }
        if start.elapsed() > PATIENCE {
            child.kill().expect("the judging tests can be stopped");
            child.wait().expect("the judging tests can be waited for");
            return false;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Which mutants the judging tests do not notice.
fn survivors<'a>(judge: &Path, mutants: &'a [Mutant]) -> Vec<&'a Mutant> {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(mutant) = mutants.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if passes(judge, mutant.id) {
                        found.lock().expect("no thread panics with the lock").push(mutant);
                    }
                }
            });
        }
    });
    let mut found = found.into_inner().expect("no thread panics with the lock");
    found.sort_by_key(|m| m.id);
    found
}

fn report(path: &Path, mutants: &[Mutant], survivors: &[&Mutant]) {
    let mut csv = csv::Writer::from_path(path).expect("the report can be written");
    csv.write_record(["id", "file", "line", "column", "change", "source", "outcome"]).expect("written");
    for m in mutants {
        let outcome = if survivors.iter().any(|s| s.id == m.id) { "survived" } else { "noticed" };
        let (id, line, column) = (m.id.to_string(), m.line.to_string(), m.column.to_string());
        csv.write_record([&id, &m.file, &line, &column, &m.change, &m.source, outcome]).expect("written");
    }
    csv.flush().expect("written");
}

#[test]
fn every_change_of_the_reference_is_noticed() {
    let start = Instant::now();
    let built = build::build();
    let compiled = start.elapsed();
    assert!(built.mutants.len() > 200, "only {} mutants: is src/reference read?", built.mutants.len());
    assert!(passes(&built.judge, 0), "the judging tests fail without any mutant: {}", built.judge.display());
    let survivors = survivors(&built.judge, &built.mutants);
    report(&built.folder.join("report.csv"), &built.mutants, &survivors);
    eprintln!(
        "{} mutants, {} noticed, {} survived; {:.0} s to compile, {:.0} s to judge",
        built.mutants.len(),
        built.mutants.len() - survivors.len(),
        survivors.len(),
        compiled.as_secs_f64(),
        (start.elapsed() - compiled).as_secs_f64()
    );
    let is = |m: &Mutant, s: &Survivor| m.file == s.file && m.source == s.line && m.change == s.change;
    let unlisted: Vec<String> = survivors
        .iter()
        .filter(|m| !SURVIVORS.iter().any(|s| is(m, s)))
        .map(|m| format!("src/reference/{}:{}:{}: {} in `{}`", m.file, m.line, m.column, m.change, m.source))
        .collect();
    assert!(
        unlisted.is_empty(),
        "{} changes of the reference make no test fail; add a hand-worked test, or a row with the reason:\n{}",
        unlisted.len(),
        unlisted.join("\n")
    );
    for s in SURVIVORS {
        assert!(
            survivors.iter().any(|m| is(m, s)),
            "src/reference/{}: {} in `{}` is listed as a survivor ({}) but is noticed, or is not there any more",
            s.file,
            s.change,
            s.line,
            s.reason
        );
    }
}
