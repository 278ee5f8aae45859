//! Tests the strength of the proofs: every constant, operator, comparison, minimum and maximum of `reference`, `score` and
//! `evaluator/case.rs` in `src/models` is changed, one at a time, and `tests/model/reference_paper` or `tests/equality/causes.rs` must fail
//! each time. Survivors are listed in tests/mutants/survivors.tsv, with the reason.
//!
//! The crate is copied to `target/tmp/mutants` with all changes in it at once, each behind a switch that an environment variable sets
//! (mutant schemata), and compiled once; then the judging tests run once per mutant, in a separate process. A run takes those that
//! tests/common/sample.rs chooses; `target/tmp/mutants/report.csv` lists them with their outcome.

#[path = "mutants/build.rs"]
mod build;
#[path = "common/copy.rs"]
mod copy;
#[path = "common/mutant.rs"]
mod mutant;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "common/sample.rs"]
mod sample;
#[path = "mutants/schemata.rs"]
mod schemata;

use mutant::compare;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A change behind the switch of a number, in a file below `src/models`.
type Mutant = mutant::Mutant<usize>;

/// The causes of the reference.
const CAUSES: &str = "reference/extension.rs";

/// A judging run takes up to 0.5 s; a mutant that loops endlessly is stopped after this long, and counts as detected.
const PATIENCE: Duration = Duration::from_secs(20);

/// Laws are judged state by state, everything else by all other tests.
const LAWS: &str = "reference/law/";
const OF_LAWS: [&str; 1] = ["laws_equal_the_reference_point_by_point"];
const OF_THE_REST: [&str; 2] = ["--skip", OF_LAWS[0]];

/// True if these judging tests pass with this mutant switched on (0: none).
fn passes(judge: &Path, id: usize, tests: &[&str]) -> bool {
    let mut child = Command::new(judge)
        .args(["--quiet", "--test-threads=1"])
        .args(tests)
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

/// Returns the mutants that no judging test detects; the test of the causes judges their files first.
fn survivors<'a>(judges: &[PathBuf; 2], mutants: &'a [Mutant]) -> Vec<&'a Mutant> {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(mutant) = mutants.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let [paper, causes] = judges;
                    let is_noticed = match mutant.file.as_str() {
                        file if file.starts_with(LAWS) => !passes(causes, mutant.made, &OF_LAWS),
                        file => {
                            let order = if file == CAUSES { [causes, paper] } else { [paper, causes] };
                            !order.iter().all(|judge| passes(judge, mutant.made, &OF_THE_REST))
                        }
                    };
                    if !is_noticed {
                        found.lock().expect("no thread panics with the lock").push(mutant);
                    }
                }
            });
        }
    });
    let mut found = found.into_inner().expect("no thread panics with the lock");
    found.sort_by_key(|m| m.made);
    found
}

fn report(path: &Path, mutants: &[Mutant], survivors: &[&Mutant]) {
    let mut csv = csv::Writer::from_path(path).expect("the report can be written");
    csv.write_record(["id", "file", "line", "column", "change", "source", "outcome"]).expect("written");
    for m in mutants {
        let outcome = if survivors.iter().any(|s| s.made == m.made) { "survived" } else { "noticed" };
        let (id, line, column) = (m.made.to_string(), m.line.to_string(), m.column.to_string());
        csv.write_record([&id, &m.file, &line, &column, &m.change, &m.source, outcome]).expect("written");
    }
    csv.flush().expect("written");
}

#[test]
fn every_change_of_the_reference_is_noticed() {
    let start = Instant::now();
    let built = build::build();
    let compiled = start.elapsed();
    assert!(built.mutants.len() > 200, "only {} mutants: is src/models/reference read?", built.mutants.len());
    for judge in &built.judges {
        assert!(passes(judge, 0, &[]), "the judging tests fail without any mutant: {}", judge.display());
    }
    let is_strictness = |mutant: &Mutant| mutant.file.starts_with(LAWS) && mutant.is_strictness();
    let mutants: Vec<Mutant> = built.mutants.into_iter().filter(|mutant| !is_strictness(mutant)).collect();
    let (mutants, left) = sample::split(mutants);
    let survivors = survivors(&built.judges, &mutants);
    report(&built.folder.join("report.csv"), &mutants, &survivors);
    eprintln!(
        "{} mutants, {} noticed, {} survived; {:.0} s to compile, {:.0} s to judge",
        mutants.len(),
        mutants.len() - survivors.len(),
        survivors.len(),
        compiled.as_secs_f64(),
        (start.elapsed() - compiled).as_secs_f64()
    );
    compare(&survivors, &left, include_str!("mutants/survivors.tsv"), |_| true, "add a hand-worked test");
}
