//! Are the proofs of the shaders sharp? Every constant, operator, comparison, minimum, maximum, selection and sign of the files in
//! `shaders/` is changed, one at a time, and the comparison with the reference must fail each time. What survives is listed
//! below, with the reason.
//!
//! Shaders are texts that are composed at run time, so nothing is compiled again. `target/tmp/shader_mutants.csv` lists
//! every mutant and what became of it.

mod common;
#[path = "shader_mutants/exact.rs"]
mod exact;
#[path = "shader_mutants/judge.rs"]
mod judge;
#[path = "shader_mutants/shots.rs"]
mod shots;
#[path = "shader_mutants/text.rs"]
mod text;

use std::path::Path;
use std::time::Instant;
use text::{Mutant, mutants};

/// A mutant that no test can notice: file, its line as written, the change, why it survives.
struct Survivor {
    file: &'static str,
    line: &'static str,
    change: &'static str,
    reason: &'static str,
}

const SURVIVORS: &[Survivor] = &[
    Survivor {
        file: "shaders/controller/gipps.wgsl",
        line: "return Command((v_cmd - v_f) * per_t_h, radicand >= -1e-10);",
        change: ">= -> >",
        reason: "a guard against the last bits of a radicand; nothing real is -1e-10",
    },
    Survivor {
        file: "shaders/controller/gipps.wgsl",
        line: "return Command((v_cmd - v_f) * per_t_h, radicand >= -1e-10);",
        change: "1e-10 -> 1e-10 * 1.01",
        reason: "a guard against the last bits of a radicand; nothing real lies between -1e-10 and -1.01e-10",
    },
    Survivor {
        file: "shaders/motion/compensated.wgsl",
        line: "let stops = v_free.high < 0.0;",
        change: "< -> <=",
        reason: "equivalent: a speed of exactly zero was reached by an acceleration of -v / dt",
    },
    Survivor {
        file: "shaders/motion/plain.wgsl",
        line: "let a_next = select(a, -now.v_f * per_dt, v_free < 0.0);",
        change: "< -> <=",
        reason: "equivalent: a speed of exactly zero was reached by an acceleration of -v / dt",
    },
    Survivor {
        file: "shaders/spacing/inherent.wgsl",
        line: "return 0.0;",
        change: "0.0 -> 0.01",
        reason: "never read: Gipps' controller has its own spacing",
    },
    Survivor {
        file: "shaders/start/shifted.wgsl",
        line: "return select(x.s, shifted, radicand < 0.0);",
        change: "< -> <=",
        reason: "equivalent: a radicand of exactly zero is shifted by nothing",
    },
];

/// Files that are judged by other means: which.
const ELSEWHERE: [(&str, &str); 3] = [
    ("shaders/kernel.wgsl", "the time loop of the GPU: the GPU evaluator's own comparison"),
    ("shaders/power.wgsl", "bits and f32 only: the GPU against its Rust twin, which tests/power.rs judges"),
    ("shaders/opaque.wgsl", "changes no value, only what a driver may do with it"),
];

/// Path and text of every shader.
fn shaders() -> Vec<(String, String)> {
    fn walk(folder: &Path, found: &mut Vec<(String, String)>) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut entries: Vec<_> =
            std::fs::read_dir(folder).expect("shaders is readable").map(|e| e.expect("readable").path()).collect();
        entries.sort();
        for path in entries {
            if path.is_dir() {
                walk(&path, found);
            } else {
                let name = path.strip_prefix(root).expect("found below the root").to_string_lossy().replace('\\', "/");
                found.push((name, std::fs::read_to_string(&path).expect("shaders are readable")));
            }
        }
    }
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), &mut found);
    found
}

fn report(all: &[(Mutant, Result<(), String>)]) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shader_mutants.csv");
    let mut csv = csv::Writer::from_path(path).expect("the report can be written");
    csv.write_record(["file", "line", "column", "change", "source", "outcome"]).expect("written");
    for (m, verdict) in all {
        let outcome = verdict.as_ref().err().map_or("survived", String::as_str);
        let (line, column) = (m.line.to_string(), m.column.to_string());
        csv.write_record([&m.file, &line, &column, &m.change, &m.source, outcome]).expect("written");
    }
    csv.flush().expect("written");
}

#[test]
fn every_change_of_a_part_is_noticed() {
    let start = Instant::now();
    let judges = judge::judges();
    for judge in &judges {
        judge.verdict(&|_, _| None).expect("the texts as they are compute what the reference computes");
    }
    let mut all = Vec::new();
    for (file, text) in shaders() {
        if ELSEWHERE.iter().any(|(elsewhere, _)| *elsewhere == file) {
            continue;
        }
        let found = mutants(&file, &text);
        let own: Vec<_> = judges.iter().filter(|judge| judge.contains(&file)).collect();
        assert!(!own.is_empty(), "{file}: no recipe in tests/shader_mutants/judge.rs contains it");
        for mutant in found {
            let replace = |name: &str, _: &str| (name == file).then(|| mutant.text.clone());
            let verdict = own.iter().try_for_each(|judge| judge.verdict(&replace));
            all.push((mutant, verdict));
        }
    }
    report(&all);
    let survivors: Vec<&Mutant> = all.iter().filter(|(_, verdict)| verdict.is_ok()).map(|(m, _)| m).collect();
    eprintln!(
        "{} mutants of parts, {} noticed, {} survived; {:.1} s",
        all.len(),
        all.len() - survivors.len(),
        survivors.len(),
        start.elapsed().as_secs_f64()
    );
    assert!(all.len() > 150, "only {} mutants: is shaders/ read?", all.len());
    compare(&survivors, SURVIVORS);
}

/// Every survivor is listed, and everything that is listed survives.
fn compare(survivors: &[&Mutant], listed: &[Survivor]) {
    let is = |m: &Mutant, s: &Survivor| m.file == s.file && m.source == s.line && m.change == s.change;
    let unlisted: Vec<String> = survivors
        .iter()
        .filter(|m| !listed.iter().any(|s| is(m, s)))
        .map(|m| format!("{}:{}:{}: {} in `{}`", m.file, m.line, m.column, m.change, m.source))
        .collect();
    assert!(
        unlisted.is_empty(),
        "{} changes of the shaders make no test fail; add a step that shows them, or a row with the reason:\n{}",
        unlisted.len(),
        unlisted.join("\n")
    );
    for s in listed {
        assert!(
            survivors.iter().any(|m| is(m, s)),
            "{}: {} in `{}` is listed as a survivor ({}) but is noticed, or is not there any more",
            s.file,
            s.change,
            s.line,
            s.reason
        );
    }
}
