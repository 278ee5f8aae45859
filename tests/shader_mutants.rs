//! Tests the strength of the proofs of the shaders: every constant, operator, comparison, minimum, maximum, selection and sign of the files
//! in `shaders/` is changed, one at a time, and the comparison with the reference must fail each time. Survivors are listed below, with the
//! reason.
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

use common::{gpu, sample};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use text::{Mutant, mutants};

/// A mutant that no test can detect: file, its line as written, the change, and the reason.
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
    Survivor {
        file: "shaders/equilibrium/idm.wgsl",
        line: "return (p.d_0 + p.t_h * v) / sqrt(max(1.0 - power(share, p.delta), 0.01));",
        change: "0.01 -> 0.01 * 1.01",
        reason: "a guard near the desired speed, without an equilibrium",
    },
    Survivor {
        file: "shaders/equilibrium/policy.wgsl",
        line: "return desired_spacing(p, Perceived(0.0, v, v));",
        change: "0.0 -> 0.01",
        reason: "never read: no spacing policy depends on the spacing",
    },
    Survivor {
        file: "shaders/extension/asym_lag.wgsl",
        line: "let lag = select(own.tb, own.ta, a_cmd >= 0.0);",
        change: ">= -> >",
        reason: "equivalent but for a command of exactly zero",
    },
    Survivor {
        file: "shaders/extension/integral_action.wgsl",
        line: "let waits = abs(part) >= LIMIT && part * error * own.ki > 0.0;",
        change: ">= -> >",
        reason: "equivalent but for a part of exactly the limit",
    },
    Survivor {
        file: "shaders/extension/integral_action.wgsl",
        line: "let waits = abs(part) >= LIMIT && part * error * own.ki > 0.0;",
        change: "* -> /",
        reason: "equivalent: only the sign counts",
    },
    Survivor {
        file: "shaders/extension/integral_action.wgsl",
        line: "let waits = abs(part) >= LIMIT && part * error * own.ki > 0.0;",
        change: "* -> / (2)",
        reason: "equivalent: only the sign counts",
    },
    Survivor {
        file: "shaders/extension/integral_action.wgsl",
        line: "let waits = abs(part) >= LIMIT && part * error * own.ki > 0.0;",
        change: "> -> >=",
        reason: "equivalent: at zero nothing is added either way",
    },
    Survivor {
        file: "shaders/extension/periodic.wgsl",
        line: "let folded = select(select(v, 0.5 - v, v > 0.25), -0.5 - v, v < -0.25);",
        change: "> -> >=",
        reason: "equivalent: both sides are equal there",
    },
    Survivor {
        file: "shaders/extension/periodic.wgsl",
        line: "let folded = select(select(v, 0.5 - v, v > 0.25), -0.5 - v, v < -0.25);",
        change: "0.25 -> 0.25 * 1.01",
        reason: "equivalent: around a quarter turn the series holds on both sides",
    },
    Survivor {
        file: "shaders/extension/periodic.wgsl",
        line: "let folded = select(select(v, 0.5 - v, v > 0.25), -0.5 - v, v < -0.25);",
        change: "< -> <=",
        reason: "equivalent: both sides are equal there",
    },
    Survivor {
        file: "shaders/extension/periodic.wgsl",
        line: "let folded = select(select(v, 0.5 - v, v > 0.25), -0.5 - v, v < -0.25);",
        change: "0.25 -> 0.25 * 1.01 (2)",
        reason: "equivalent: around a quarter turn the series holds on both sides",
    },
    Survivor {
        file: "shaders/extension/power_cap.wgsl",
        line: "return min(a_cmd, own.P / max(w.v_f, 0.1));",
        change: "0.1 -> 0.1 * 1.01",
        reason: "a guard for a standing car: ten times the power per mass is far above any command",
    },
    Survivor {
        file: "shaders/extension/probe_history.wgsl",
        line: "return Changed(a + own.history_a * both, State(state.slow + min(w.dt / (1.0 + 0.5 * w.dt), 1.0) * change));",
        change: "1.0 -> 1.0 * 1.01 (2)",
        reason: "the share reaches 1 only for steps above 2 s",
    },
    Survivor {
        file: "shaders/extension/probe_road.wgsl",
        line: "let lap = max(own.road_lap, 1.0);",
        change: "1.0 -> 1.0 * 1.01",
        reason: "a guard for a lap of zero; no lap is a metre long",
    },
    Survivor {
        file: "shaders/extension/probe_road.wgsl",
        line: "let off = abs(select(far, round, own.road_lap > 0.0));",
        change: "0.0 -> 0.01",
        reason: "no lap is a centimetre long",
    },
    Survivor {
        file: "shaders/extension/probe_thrust.wgsl",
        line: "return a + select(0.0, tent, a > 0.15);",
        change: "> -> >=",
        reason: "equivalent but for a command of exactly the limit",
    },
    Survivor {
        file: "shaders/extension/quantised_accel.wgsl",
        line: "let step = max(own.qz, 0.000001);",
        change: "0.000001 -> 0.000001 * 1.01",
        reason: "a guard for a step of zero",
    },
    Survivor {
        file: "shaders/extension/quantised_accel.wgsl",
        line: "let a = select(a_cmd, rounded, own.qz > 0.000001);",
        change: "> -> >=",
        reason: "a guard for a step of zero",
    },
    Survivor {
        file: "shaders/extension/quantised_accel.wgsl",
        line: "let a = select(a_cmd, rounded, own.qz > 0.000001);",
        change: "0.000001 -> 0.000001 * 1.01",
        reason: "a guard for a step of zero",
    },
    Survivor {
        file: "shaders/extension/periodic.wgsl",
        line: "var s = 42.05869394489765 * z - 76.70585975306136;",
        change: "42.05869394489765 -> 42.05869394489765 * 1.01",
        reason: "1 % of a term that is 1e-5 at most",
    },
    Survivor {
        file: "shaders/law/acc_kesting.wgsl",
        line: "let eased = a_free * (1.0 - power(min(z, 1.0), 2.0 * own.a_max / max(a_free, 1e-12)));",
        change: "1.0 -> 1.0 * 1.01 (2)",
        reason: "taken where z is below 1 only",
    },
    Survivor {
        file: "shaders/law/acc_kesting.wgsl",
        line: "let eased = a_free * (1.0 - power(min(z, 1.0), 2.0 * own.a_max / max(a_free, 1e-12)));",
        change: "1e-12 -> 1e-12 * 1.01",
        reason: "a guard of a division; only a speed at v_0 meets it, where the power is that of nothing",
    },
    Survivor {
        file: "shaders/law/acc_kesting.wgsl",
        line: "let stopping = x.v_f * x.v_f * a_l / select(1.0, apart, stops);",
        change: "1.0 -> 1.0 * 1.01",
        reason: "a guard of a division, whose result is not taken then",
    },
    Survivor {
        file: "shaders/law/acc_kesting.wgsl",
        line: "let e = exponential(2.0 * min(a_iidm - a_cah, 0.0) / b);",
        change: "0.0 -> 0.01",
        reason: "a guard: where the difference is above 0 the IIDM is taken",
    },
    Survivor {
        file: "shaders/law/acc_milanes.wgsl",
        line: "return clamp(75.0 / max(v, 1.0) - 5.0, 0.0, 2.0);",
        change: "1.0 -> 1.0 * 1.01",
        reason: "both give a margin of 2 m, because the quotient is beyond it",
    },
    Survivor {
        file: "shaders/law/acc_milanes.wgsl",
        line: "return Commanded(select(by_speed, by_gap, follows > 0.5), State(follows));",
        change: "0.5 -> 0.5 * 1.01",
        reason: "what is remembered is 0 or 1",
    },
    Survivor {
        file: "shaders/law/fvdm.wgsl",
        line: "let away = max(2.0 * s / own.ds, -40.0);",
        change: "40.0 -> 40.0 * 1.01",
        reason: "a guard for a spacing far below 0, where a run has ended",
    },
    Survivor {
        file: "shaders/law/iidm.wgsl",
        line: "let eased = a_free * (1.0 - power(min(z, 1.0), 2.0 * own.a_max / max(a_free, 1e-12)));",
        change: "1.0 -> 1.0 * 1.01 (2)",
        reason: "taken where z is below 1 only",
    },
    Survivor {
        file: "shaders/law/iidm.wgsl",
        line: "let eased = a_free * (1.0 - power(min(z, 1.0), 2.0 * own.a_max / max(a_free, 1e-12)));",
        change: "1e-12 -> 1e-12 * 1.01",
        reason: "a guard of a division; only a speed at v_0 meets it, where the power is that of nothing",
    },
    Survivor {
        file: "shaders/law/ovm.wgsl",
        line: "let away = max(2.0 * s / own.ds, -40.0);",
        change: "40.0 -> 40.0 * 1.01",
        reason: "a guard for a spacing far below 0, where a run has ended",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let outside = w.a_l + dv * dv / min(own.d_0 - x.s, -0.000001);",
        change: "- -> left out",
        reason: "a guard of a division, whose result is taken beyond d_0 only",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let outside = w.a_l + dv * dv / min(own.d_0 - x.s, -0.000001);",
        change: "0.000001 -> 0.000001 * 1.01",
        reason: "a guard of a division, whose result is taken beyond d_0 only",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let wanted = select(0.0, min(select(inside, outside, x.s > own.d_0), 0.0), dv < 0.0);",
        change: "0.0 -> 0.01",
        reason: "both ask for less than cc7, which is then taken",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let wanted = select(0.0, min(select(inside, outside, x.s > own.d_0), 0.0), dv < 0.0);",
        change: "0.0 -> 0.01 (2)",
        reason: "both ask for less than cc7, which is then taken",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let bounded = max(wanted, 0.5 * sqrt(max(x.v_f, 0.0)) - 10.0);",
        change: "0.0 -> 0.01",
        reason: "a guard of a root: the own speed is not below 0",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let slower = select(x.v_l, x.v_f, dv >= 0.0 || w.a_l < 1.0);",
        change: "0.0 -> 0.01",
        reason: "a speed difference below 1 cm/s and a_l above 1 m/s2 at a time: both speeds are the same then but for that",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let closing = 0.5 * dv * dv / min(opaque(sdxc - x.s) - 0.1, -0.1);",
        change: "- -> left out",
        reason: "a guard of a division, whose result is taken beyond the shortest spacing only",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let closing = 0.5 * dv * dv / min(opaque(sdxc - x.s) - 0.1, -0.1);",
        change: "0.1 -> 0.1 * 1.01 (2)",
        reason: "a guard of a division, whose result is taken beyond the shortest spacing only",
    },
    Survivor {
        file: "shaders/law/w99.wgsl",
        line: "let near = min(dv * dv / max(opaque(sdxo - x.s), 0.000001), most);",
        change: "0.000001 -> 0.000001 * 1.01",
        reason: "a guard of a division, whose result is below `most` only far from it",
    },
];

/// Files that are judged on the GPU by whole runs: the time loop, which only a GPU runs, a function that `lanes` knows by name, and the
/// step under an observer.
const ON_GPU: [&str; 3] = ["shaders/kernel.wgsl", "shaders/opaque.wgsl", "shaders/step_extended.wgsl"];

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
            // Random states do not lie exactly on a limit, and on most of them both sides are the same.
            let is_strictness = |mutant: &Mutant| {
                ["<", ">"].iter().any(|sign| {
                    mutant.change.starts_with(&format!("{sign} -> {sign}="))
                        || mutant.change.starts_with(&format!("{sign}= -> {sign}"))
                })
            };
            let judged = found.into_par_iter().filter(|mutant| !is_strictness(mutant)).map(|mutant| {
                let verdict = judge.verdict(&|name, _| (name == file).then(|| mutant.text.clone()));
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
                    let replace = |name: &str, _: &str| (name == file).then(|| mutant.text.clone());
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
            let replace = |name: &str, _: &str| (name == file).then(|| mutant.text.clone());
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
    compare(&survivors, &left, SURVIVORS);
}

/// Every survivor is listed, and every listed one survives, or was `left` out of this run.
fn compare(survivors: &[&Mutant], left: &[Mutant], listed: &[Survivor]) {
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
            survivors.iter().any(|m| is(m, s)) || left.iter().any(|m| is(m, s)),
            "{}: {} in `{}` is listed as a survivor ({}) but is noticed, or no longer exists",
            s.file,
            s.change,
            s.line,
            s.reason
        );
    }
}

/// Undetectable mutants of the files that only a GPU runs unchanged.
const SURVIVORS_ON_GPU: &[Survivor] = &[
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const ALL = 4u;",
        change: "4u -> 5u",
        reason: "equivalent: the host writes the name",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const DONE = 1u;",
        change: "1u -> 2u",
        reason: "equivalent: any value but 0 marks the end of a run, and nothing else reads it",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const CRASH: u32 = 0u << 28u;",
        change: "<< -> >>",
        reason: "equivalent: 0, however it is shifted",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const CRASH: u32 = 0u << 28u;",
        change: "28u -> 29u",
        reason: "equivalent: 0, however it is shifted",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const UNDEFINED: u32 = 0x7fc00000u;",
        change: "0x7fc00000u -> last bit",
        reason: "equivalent: another NaN",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;",
        change: "0x7f800000u -> last bit",
        reason: "the first of the two; arithmetic makes no NaN whose last bit is 1",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const AT_RELATIVE: u32 = AT_SIMULATED + select(0u, TRIPLE_WORDS, HAS_SIMULATED);",
        change: "0u -> 1u",
        reason: "the layout only has to agree with itself, and buffers have a word to spare",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const AT_FLOORED: u32 = AT_RELATIVE + select(0u, TRIPLE_WORDS, HAS_ALL);",
        change: "0u -> 1u",
        reason: "the layout only has to agree with itself, and buffers have a word to spare",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "const AT_BLOCK: u32 = AT_FLOORED + select(0u, TRIPLE_WORDS, HAS_ALL);",
        change: "0u -> 1u",
        reason: "the layout only has to agree with itself, and buffers have a word to spare",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "if (job.period > 0.0) {",
        change: "> -> >=",
        reason: "equivalent: without a period nothing is subtracted",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "if (job.period > 0.0) {",
        change: "0.0 -> 0.01",
        reason: "no track is shorter than 1 cm",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "let place = max((x - job.grade_origin) * job.grade_per_width, 0.0);",
        change: "0.0 -> 0.01",
        reason: "equivalent: both are in the first cell",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "let place = max((v - job.mfc_origin) * job.mfc_per_width, 0.0);",
        change: "0.0 -> 0.01",
        reason: "equivalent: both are in the first cell",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "let cell = min(u32(min(place, 1e6)), job.grade_cells - 1u);",
        change: "1e6 -> 1e6 * 1.01",
        reason: "equivalent: a table has at most 1e6 cells, and the last one is taken beyond",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "let cell = job.mfc_cell + 3u * min(u32(min(place, 1e6)), job.mfc_cells - 1u);",
        change: "1e6 -> 1e6 * 1.01",
        reason: "equivalent: a table has at most 1e6 cells, and the last one is taken beyond",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "return line.y + select(line.z, line.w, d > 0.0) * d;",
        change: "> -> >=",
        reason: "equivalent: the slope is multiplied by 0",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "let line = cells[cell + select(2u, 1u, d < 0.0)];",
        change: "< -> <=",
        reason: "equivalent: at the node its own value is taken",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "if (DELAY && !RING_IN_STATES) {",
        change: "&& -> ||",
        reason: "equivalent: fills a ring that nothing reads",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "let younger = min(older + 1u, t - 1u);",
        change: "- -> +",
        reason: "equivalent: only without any delay is there no younger sample, and then its share is 0",
    },
    Survivor {
        file: "shaders/kernel.wgsl",
        line: "for (var k = 0u; k < (RING | chunk.zero); k++) {",
        change: "< -> <=",
        reason: "writes a word that nothing reads",
    },
];

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
    compare(&survivors, &left, SURVIVORS_ON_GPU);
}

const SURVIVORS_AMONG_FUNCTIONS: &[Survivor] = &[
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);",
        change: "100.0 -> 100.0 * 1.01",
        reason: "equivalent: e to the power of 99 and more is infinity, of -99 and less 0",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);",
        change: "< -> <=",
        reason: "equivalent: e to the power of 99 and more is infinity, of -99 and less 0",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);",
        change: "100.0 -> 100.0 * 1.01 (2)",
        reason: "equivalent: e to the power of 99 and more is infinity, of -99 and less 0",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);",
        change: "100.0 -> 100.0 * 1.01 (3)",
        reason: "equivalent: e to the power of 99 and more is infinity, of -99 and less 0",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);",
        change: "> -> >=",
        reason: "equivalent: e to the power of 99 and more is infinity, of -99 and less 0",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);",
        change: "100.0 -> 100.0 * 1.01 (4)",
        reason: "equivalent: e to the power of 99 and more is infinity, of -99 and less 0",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "return select(result, x, (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u);",
        change: "0x7fffffffu -> last bit",
        reason: "only a NaN whose other bits are all 0 would tell",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "return select(result, x, (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u);",
        change: "0x7f800000u -> last bit",
        reason: "only the NaN next to infinity would tell",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "let y = select(x, 1.17549435e-38, x < 1.17549435e-38);",
        change: "< -> <=",
        reason: "equivalent: both sides are equal there",
    },
    Survivor {
        file: "shaders/exponential.wgsl",
        line: "return select(result, x, (bitcast<u32>(x) & 0x7f800000u) == 0x7f800000u);",
        change: "0x7f800000u -> last bit",
        reason: "no finite number has all bits of the exponent",
    },
    Survivor {
        file: "shaders/power.wgsl",
        line: "return select(0.0, power_of_two(exact_whole + rest_whole, rest - rest_whole), x >= 1.17549435e-38);",
        change: ">= -> >",
        reason: "the smallest normal number itself; its power is as good as 0",
    },
    Survivor {
        file: "shaders/power.wgsl",
        line: "return select(0.0, power_of_two(exact_whole + rest_whole, rest - rest_whole), x >= 1.17549435e-38);",
        change: "1.17549435e-38 -> 1.17549435e-38 * 1.01",
        reason: "between the smallest normal number and the next percent; its power is as good as 0",
    },
];

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
        let verdict = judge.verdict(&mutant.file, &mutant.text);
        (mutant, verdict)
    };
    let all: Vec<_> = todo.into_par_iter().map(judged).collect();
    report("shader_mutants_of_functions.csv", &all);
    let survivors: Vec<&Mutant> = all.iter().filter(|(_, verdict)| verdict.is_ok()).map(|(m, _)| m).collect();
    eprintln!("{} mutants of functions, {} survived", all.len(), survivors.len());
    let count = all.len() + left.len();
    assert!(count > 60, "only {count} mutants: are the files read?");
    compare(&survivors, &left, SURVIVORS_AMONG_FUNCTIONS);
}
