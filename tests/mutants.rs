//! Tests the strength of the proofs: every constant, operator, comparison, minimum and maximum of `reference`, `score` and
//! `evaluator/case.rs` in `src/models` is changed, one at a time, and `tests/model/reference_paper` or `tests/equality/causes.rs` must fail
//! each time. Survivors are listed below, with the reason.
//!
//! The crate is copied to `target/tmp/mutants` with all changes in it at once, each behind a switch that an environment variable sets
//! (mutant schemata), and compiled once; then the judging tests run once per mutant, in a separate process. A run takes those that
//! tests/common/sample.rs chooses; `target/tmp/mutants/report.csv` lists them with their outcome.

#[path = "mutants/build.rs"]
mod build;
#[path = "common/copy.rs"]
mod copy;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "common/sample.rs"]
mod sample;
#[path = "mutants/schemata.rs"]
mod schemata;

use schemata::Mutant;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A mutant that no test can detect: file below `src/models`, its line as written, the change, and the reason.
struct Survivor {
    file: &'static str,
    line: &'static str,
    change: &'static str,
    reason: &'static str,
}

/// Both sides of a comparison share the change.
const SHARED: &str = "for extensions only, and what tests/equality/causes.rs compares has it on both sides";

const SURVIVORS: &[Survivor] = &[
    Survivor {
        file: "reference/lookup.rs",
        line: "if u < grade.x[1] { grade.sin[1] } else { grade.sin[n - 2] }",
        change: "1 -> 1 + 1",
        reason: "equivalent: u lies outside x[1]..=x[n - 2] here, so below x[1] or above x[2]",
    },
    Survivor {
        file: "reference/lookup.rs",
        line: "if u < grade.x[1] { grade.sin[1] } else { grade.sin[n - 2] }",
        change: "< -> <=",
        reason: "equivalent: u = x[1] has returned above",
    },
    Survivor {
        file: "reference/lookup.rs",
        line: "if v <= mfc.v[0] {",
        change: "<= -> <",
        reason: "equivalent: at the first node the first segment starts, with fraction 0",
    },
    Survivor {
        file: "reference/lookup.rs",
        line: "mfc.v.partition_point(|node| *node <= v) - 1",
        change: "<= -> <",
        reason: "equivalent up to the last bit: at a node one segment ends and the next starts",
    },
    Survivor {
        file: "reference/lookup.rs",
        line: "let (mut low, mut high, mut middle) = (0, nodes.len(), 0);",
        change: "0 -> 0 + 1 (2)",
        reason: "equivalent: overwritten in the first turn; a curve has at least two nodes",
    },
    Survivor {
        file: "reference/lookup.rs",
        line: "} else if nodes[middle] > v {",
        change: "> -> >=",
        reason: "equivalent up to the last bit: continuing from an equal node ends at the node before it, whose segment ends at v",
    },
    Survivor {
        file: "reference/simulate.rs",
        line: "if p.a_min * p.a_min * h * h - p.a_min * (2.0 * room - brake) < 0.0 {",
        change: "< -> <=",
        reason: "equivalent up to the last bit: a radicand of exactly zero is shifted by nothing",
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "Delay::Fractional => (self.delay_steps(self.longest_delay()) - 1e-9).ceil(),",
        change: "1e-9 -> 1e-9 * 1.01",
        reason: "a guard against the last bit of a quotient; nothing real lies between 1e-9 and 1.01e-9 samples",
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "let earliest = ((seconds / self.dt - 1e-9).ceil() as usize).saturating_add(1);",
        change: "1e-9 -> 1e-9 * 1.01",
        reason: "a guard against the last bit of a quotient; nothing real lies between 1e-9 and 1.01e-9 samples",
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "let first = forward.clone().next().unwrap_or(0.0);",
        change: "0.0 -> 0.01",
        reason: "never read: a case has at least three samples",
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "t_0: trajectory.t.first().copied().unwrap_or(0.0),",
        change: "0.0 -> 0.01",
        reason: "a trajectory has a sample",
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "base + extension.map_or(0.0, |bounds| if let Bounds::Fixed(_, upper) = bounds { upper } else { 0.0 })",
        change: "0.0 -> 0.01 (2)",
        reason: "the bounds of an extension are always its own",
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "let extension = self.variant.extensions.delay().map_or(0.0, |symbol| part(true, parameters.get(symbol)));",
        change: "true -> false",
        reason: SHARED,
    },
    Survivor {
        file: "evaluator/case.rs",
        line: "let base = if self.variant.delay { self.tau_p_upper } else { 0.0 };",
        change: "0.0 -> 0.01",
        reason: SHARED,
    },
    Survivor {
        file: "reference/extension.rs",
        line: "let mut own = [0.0; 3];",
        change: "0.0 -> 0.01",
        reason: "never read: a cause reads the parameters that it has",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "\"quantised_accel\" | \"jerk_limit\" | \"actuation_lag\" | \"asym_lag\" => [case.a_f[sample], 0.0],",
        change: "0.0 -> 0.01",
        reason: "never read: these remember one number",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "if part.abs() < INTEGRAL_LIMIT || part * error * own[0] <= 0.0 {",
        change: "< -> <=",
        reason: "no sum of measured errors is the limit to the last bit",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "if part.abs() < INTEGRAL_LIMIT || part * error * own[0] <= 0.0 {",
        change: "* -> /",
        reason: "equivalent: only the sign counts",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "if part.abs() < INTEGRAL_LIMIT || part * error * own[0] <= 0.0 {",
        change: "* -> / (2)",
        reason: "equivalent: only the sign counts",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "if part.abs() < INTEGRAL_LIMIT || part * error * own[0] <= 0.0 {",
        change: "<= -> <",
        reason: "no measured error is zero while the limit is reached",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "\"power_cap\" => a = a.min(own[0] / now.v_f.max(0.1)),",
        change: "0.1 -> 0.1 * 1.01",
        reason: "a guard against a division by zero: so slow, no power in its bounds is a limit",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "if own[0] > 1e-6 {",
        change: "1e-6 -> 1e-6 * 1.01",
        reason: "a guard against a division by zero; nothing real lies between",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "if own[0] > 1e-6 {",
        change: "> -> >=",
        reason: "a guard against a division by zero; no step is 1e-6 to the last bit",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "\"asym_lag\" => a = lagged(&mut memory[0], a, if a >= 0.0 { own[0] } else { own[1] }, dt),",
        change: ">= -> >",
        reason: "no command of a moving car is zero to the last bit",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "Controller::Idm => (p.d_0 + p.t_h * v) / (1.0 - (v.max(0.0) / p.v_0).powf(p.delta)).max(0.01).sqrt(),",
        change: "0.01 -> 0.01 * 1.01",
        reason: "a guard against a root of nothing; the cars of tests/equality/causes.rs stay below the desired speed",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "_ => spacing::pick(variant.base.spacing)(p, &Perceived { s: 0.0, v_f: v, v_l: v }),",
        change: "0.0 -> 0.01",
        reason: "equivalent: no policy asks for the present spacing",
    },
    Survivor {
        file: "reference/extension.rs",
        line: "look_back: extension.needs.look_back.map_or(0.0, |k| p.get(extension.parameters[k])),",
        change: "0.0 -> 0.01",
        reason: "unused by a law that does not look back",
    },
    Survivor {
        file: "reference/law/acc_kesting.rs",
        line: "let b = -seen.p.a_min;",
        change: "- -> left out",
        reason: "equivalent: b tanh(y / b) is the same for -b",
    },
    Survivor {
        file: "reference/law/acc_kesting.rs",
        line: "if x.v_l * closing < -2.0 * s * a_l {",
        change: "2.0 -> 2.0 * 1.01",
        reason: "where both cases meet they have one slope, too",
    },
    Survivor {
        file: "reference/law/acc_milanes.rs",
        line: "(75.0 / v.max(0.0) - 5.0).clamp(0.0, 2.0)",
        change: "0.0 -> 0.01",
        reason: "both give a margin of 2 m, because the quotient is beyond it",
    },
    Survivor {
        file: "reference/law/w99.rs",
        line: "let slower = if dv >= 0.0 || seen.a_l < 1.0 { v } else { v_l };",
        change: "0.0 -> 0.01",
        reason: "the speeds are the same but for that, and a_l is above 1 m/s2",
    },
    Survivor {
        file: "reference/law/w99.rs",
        line: "0.0",
        change: "0.0 -> 0.01",
        reason: "both are above -cc7, which is then taken",
    },
    Survivor {
        file: "reference/law/w99.rs",
        line: "(seen.a_l + dv * dv / (cc0 - dx)).min(0.0)",
        change: "0.0 -> 0.01",
        reason: "both are above -cc7, which is then taken",
    },
    Survivor {
        file: "reference/law/w99.rs",
        line: "(seen.a_l + 0.5 * (dv - opening)).min(0.0)",
        change: "0.0 -> 0.01",
        reason: "both are above -cc7, which is then taken",
    },
];

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
                        file if file.starts_with(LAWS) => !passes(causes, mutant.id, &OF_LAWS),
                        file => {
                            let order = if file == CAUSES { [causes, paper] } else { [paper, causes] };
                            !order.iter().all(|judge| passes(judge, mutant.id, &OF_THE_REST))
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
    assert!(built.mutants.len() > 200, "only {} mutants: is src/models/reference read?", built.mutants.len());
    for judge in &built.judges {
        assert!(passes(judge, 0, &[]), "the judging tests fail without any mutant: {}", judge.display());
    }
    // States of laws are drawn at random, so none lies exactly on a limit, and on most of them both sides are the same.
    let is_strictness = |mutant: &Mutant| {
        mutant.file.starts_with(LAWS)
            && ["<", ">"].iter().any(|sign| {
                let (strict, loose) = (format!("{sign} -> {sign}="), format!("{sign}= -> {sign}"));
                mutant.change.starts_with(&strict) || mutant.change.starts_with(&loose)
            })
    };
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
    let is = |m: &Mutant, s: &Survivor| m.file == s.file && m.source == s.line && m.change == s.change;
    let unlisted: Vec<String> = survivors
        .iter()
        .filter(|m| !SURVIVORS.iter().any(|s| is(m, s)))
        .map(|m| format!("src/models/{}:{}:{}: {} in `{}`", m.file, m.line, m.column, m.change, m.source))
        .collect();
    assert!(
        unlisted.is_empty(),
        "{} changes of the reference make no test fail; add a hand-worked test, or a row with the reason:\n{}",
        unlisted.len(),
        unlisted.join("\n")
    );
    for s in SURVIVORS {
        assert!(
            survivors.iter().any(|m| is(m, s)) || left.iter().any(|m| is(m, s)),
            "src/models/{}: {} in `{}` is listed as a survivor ({}) but is noticed, or no longer exists",
            s.file,
            s.change,
            s.line,
            s.reason
        );
    }
}
