//! Tests the strength of the proofs of the shaders: every constant, operator, comparison, minimum, maximum, selection and sign of the files
//! in `shaders/` is changed, one at a time, and the comparison with the reference must fail each time. Survivors are listed in
//! tests/shader_mutants/survivors.tsv, with the reason.
//!
//! Shaders are texts that are composed at run time, so nothing is compiled again. A run takes the changes that tests/common/sample.rs chooses;
//! `target/tmp/shader_mutants.csv` lists them with their outcome.

mod common;
#[path = "shader_mutants/exact.rs"]
mod exact;
#[path = "shader_mutants/extended.rs"]
mod extended;
#[path = "shader_mutants/judge.rs"]
mod judge;
#[path = "shader_mutants/kernel.rs"]
mod kernel;
#[path = "shader_mutants/shots.rs"]
mod shots;
#[path = "shader_mutants/text.rs"]
mod text;
#[path = "shader_mutants/values.rs"]
mod values;

use common::mutant::compare;
use common::{gpu, sample};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use text::{Mutant, mutants};

const SURVIVORS: &str = include_str!("shader_mutants/survivors.tsv");
const REMEDY: &str = "add a step that shows them";

/// Files that are judged on the GPU by whole runs: the time loop and the sums, which only a GPU runs, a function that `lanes` knows by name,
/// and the step under an observer.
const ON_GPU: [&str; 5] = [
    "shaders/kernel.wgsl",
    "shaders/opaque.wgsl",
    "shaders/products.wgsl",
    "shaders/step_extended.wgsl",
    "shaders/sums.wgsl",
];

/// Files that declare and compute nothing: nothing in them can be changed.
const DECLARATIONS: [&str; 3] = ["shaders/world.wgsl", "shaders/unextended.wgsl", "shaders/between.wgsl"];

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
            } else if path.extension().is_some_and(|extension| extension == "wgsl") {
                let name = path.strip_prefix(root).expect("found below the root").to_string_lossy().replace('\\', "/");
                found.push((name, std::fs::read_to_string(&path).expect("shaders are readable")));
            }
        }
    }
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), &mut found);
    found
}

fn report(name: &str, all: &[(Mutant, Result<(), String>)]) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
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
    let laws = common::laws::judges();
    let (mut all, mut left) = (Vec::new(), Vec::new());
    for (file, text) in shaders() {
        let elsewhere = [&ON_GPU[..], &values::FILES[..], &DECLARATIONS[..]].concat();
        if elsewhere.contains(&file.as_str()) {
            continue;
        }
        let (found, others) = sample::split(mutants(&file, &text));
        left.extend(others);
        if let Some(judge) = laws.iter().find(|judge| judge.judges(&file)) {
            judge.verdict(&|_, _| None).expect("the texts as they are compute what the reference computes");
            let judged = found.into_par_iter().filter(|mutant| !mutant.is_strictness()).map(|mutant| {
                let verdict = judge.verdict(&|name, _| (name == file).then(|| mutant.made.clone()));
                (mutant, verdict)
            });
            all.extend(judged.collect::<Vec<_>>());
            continue;
        }
        if extended::judges_file(&file) {
            let judges = extended::judges(&file);
            for judge in &judges {
                judge.verdict(&|_, _| None).expect("the texts as they are compute what the reference computes");
            }
            let judged: Vec<_> = found
                .into_par_iter()
                .map(|mutant| {
                    let replace = |name: &str, _: &str| (name == file).then(|| mutant.made.clone());
                    let verdict = judges.iter().try_for_each(|judge| judge.verdict(&replace));
                    (mutant, verdict)
                })
                .collect();
            all.extend(judged);
            continue;
        }
        let own: Vec<_> = judges.iter().filter(|judge| judge.contains(&file)).collect();
        assert!(!own.is_empty(), "{file}: no recipe in tests/shader_mutants/judge.rs contains it");
        for mutant in found {
            let replace = |name: &str, _: &str| (name == file).then(|| mutant.made.clone());
            let verdict = own.iter().try_for_each(|judge| judge.verdict(&replace));
            all.push((mutant, verdict));
        }
    }
    report("shader_mutants.csv", &all);
    let survivors: Vec<&Mutant> = all.iter().filter(|(_, verdict)| verdict.is_ok()).map(|(m, _)| m).collect();
    eprintln!(
        "{} mutants of parts, {} noticed, {} survived; {:.1} s",
        all.len(),
        all.len() - survivors.len(),
        survivors.len(),
        start.elapsed().as_secs_f64()
    );
    let count = all.len() + left.len();
    assert!(count > 150, "only {count} mutants: is shaders/ read?");
    compare(&survivors, &left, SURVIVORS, |file| !ON_GPU.contains(&file) && !values::FILES.contains(&file), REMEDY);
}

/// Loops that would not end: a watchdog would stop the driver, if there is one.
const ENDLESS: &[(&str, &str, &str)] = &[("shaders/kernel.wgsl", "for (; t < to && status == 0u; t++) {", "&& -> ||")];

#[test]
fn every_change_of_the_kernel_is_noticed() {
    if gpu::skipped("every_change_of_the_kernel_is_noticed") {
        return;
    }
    let start = Instant::now();
    let files: Vec<_> = shaders().into_iter().filter(|(file, _)| ON_GPU.contains(&file.as_str())).collect();
    let (todo, left) = sample::split(files.iter().flat_map(|(file, text)| mutants(file, text)).collect());
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                let mut scenes = kernel::Scenes::new();
                while let Some(mutant) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let endless = |(file, line, change): &(&str, &str, &str)| {
                        (*file, *line, *change) == (&*mutant.file, &*mutant.source, &*mutant.change)
                    };
                    let verdict = if ENDLESS.iter().any(endless) {
                        Err("would not end".to_owned())
                    } else {
                        scenes.verdict(mutant)
                    };
                    done.lock().expect("no thread panics with the lock").push((mutant.clone(), verdict));
                }
            });
        }
    });
    let mut all = done.into_inner().expect("no thread panics with the lock");
    all.sort_by(|(a, _), (b, _)| (&a.file, a.line, a.column).cmp(&(&b.file, b.line, b.column)));
    report("shader_mutants_on_gpu.csv", &all);
    let survivors: Vec<&Mutant> = all.iter().filter(|(_, verdict)| verdict.is_ok()).map(|(m, _)| m).collect();
    eprintln!(
        "{} mutants of the kernel, {} noticed, {} survived; {:.1} s",
        all.len(),
        all.len() - survivors.len(),
        survivors.len(),
        start.elapsed().as_secs_f64()
    );
    compare(&survivors, &left, SURVIVORS, |file| ON_GPU.contains(&file), REMEDY);
}

#[test]
fn every_change_of_our_functions_is_noticed() {
    if gpu::skipped("every_change_of_our_functions_is_noticed") {
        return;
    }
    let shaders = shaders();
    let judge = values::Values::new(&shaders);
    let files = shaders.iter().filter(|(file, _)| values::FILES.contains(&file.as_str()));
    let (todo, left) = sample::split(files.flat_map(|(file, text)| mutants(file, text)).collect::<Vec<Mutant>>());
    let judged = |mutant: Mutant| {
        let verdict = judge.verdict(&mutant.file, &mutant.made);
        (mutant, verdict)
    };
    let all: Vec<_> = todo.into_par_iter().map(judged).collect();
    report("shader_mutants_of_functions.csv", &all);
    let survivors: Vec<&Mutant> = all.iter().filter(|(_, verdict)| verdict.is_ok()).map(|(m, _)| m).collect();
    eprintln!("{} mutants of functions, {} survived", all.len(), survivors.len());
    let count = all.len() + left.len();
    assert!(count > 60, "only {count} mutants: are the files read?");
    compare(&survivors, &left, SURVIVORS, |file| values::FILES.contains(&file), REMEDY);
}
