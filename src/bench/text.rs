//! A report for people, 80 columns wide.

use super::Row;
use super::measure::median;
use super::plan::{MANY, POPULATION, Report};
use crate::catalog::{BASES, Constraint, Dynamics, Variant};
use std::fmt::Write;

/// The whole report.
pub fn table(report: &Report) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_table(&mut text, report);
    text
}

fn write_table(text: &mut String, report: &Report) -> std::fmt::Result {
    let steps = report.rows.first().map_or(0, |row| row.steps);
    let mcs = (POPULATION * steps) as f64 / 1e6;
    writeln!(text, "How fast candidates (parameter vectors) are simulated and scored.\n")?;
    writeln!(text, "machine   {}", report.machine)?;
    let adapter = format!("adapter   {}", report.adapter.as_deref().unwrap_or("no GPU evaluator measured"));
    writeln!(text, "{}", textwrap::fill(&adapter, textwrap::Options::new(80).subsequent_indent("          ")))?;
    writeln!(text, "data      {}", report.data)?;
    if let Some(load) = report.machine.load {
        writeln!(text, "load      {load:.1} processes at the start; figures are most stable at 0")?;
    }
    writeln!(text)?;
    writeln!(text, "Mcs        million candidate-steps; {POPULATION} candidates on this drive are {mcs:.1} Mcs")?;
    writeln!(text, "/s         per second of wall time, all threads together")?;
    writeln!(text, "/core-s    per second of CPU time of the whole process: independent of the")?;
    writeln!(text, "           number of cores and less of other load; on a hardware GPU per")?;
    writeln!(text, "           second of wall time")?;
    writeln!(text, "native     a hand-written loop for variant 1 only; with AVX2, lanes are faster")?;
    writeln!(text, "reference  plain scalar f64 code, the oracle of the tests")?;
    writeln!(text, "done       share of the steps that were simulated; crashed candidates end early")?;

    for shown in &report.shown {
        let rows: Vec<&Row> = report.rows.iter().filter(|r| r.variant == *shown).collect();
        let Some(first) = rows.first() else { continue };
        writeln!(text, "\n{}", numbered(first))?;
        writeln!(
            text,
            "{:<10}{:<12}{:>6}{:>10}{:>8}{:>9}{:>8}{:>6}{:>10}",
            "evaluator", "precision", "cand.", "median ms", "Mcs/s", "/core-s", "native", "done", "transfer"
        )?;
        for row in &rows {
            let native = report.native(row);
            let share = native.map_or("-".to_owned(), |native| of_native(row.mcs_per_core_second / native));
            let wall = median(&row.wall_s);
            writeln!(
                text,
                "{:<10}{:<12}{:>6}{:>10.2}{:>8.0}{:>9.0}{:>8}{:>6}{:>10}",
                row.evaluator,
                row.precision,
                row.population,
                1e3 * wall,
                row.mcs_wall,
                row.mcs_per_core_second,
                share,
                format!("{:.0} %", 100.0 * row.executed),
                format!("{:.1} %", 100.0 * row.transfer_s / wall),
            )?;
        }
        write_against_lanes(text, report, &rows)?;
    }
    for what in &report.left_out {
        textwrap::wrap(&format!("not measured: {what}"), 80).iter().try_for_each(|line| writeln!(text, "{line}"))?;
    }
    // Among evaluators with the same kernel, the first one compiles it.
    let mut told = Vec::new();
    for row in report.rows.iter().filter(|r| r.first_dispatch_s > 0.0 && report.shown.contains(&r.variant)) {
        if told.contains(&(row.precision, &row.variant)) {
            continue;
        }
        told.push((row.precision, &row.variant));
        let (evaluator, precision, ms) = (row.evaluator, row.precision, 1e3 * row.first_dispatch_s);
        writeln!(text, "first dispatch of {evaluator} {precision}, {}: {ms:.0} ms", numbered(row))?;
    }
    write_ninety(text, report)?;
    if report.generations.is_empty() {
        return Ok(());
    }

    writeln!(text, "\nA generation of an optimiser, 100 candidates, besides simulation")?;
    writeln!(text, "(the same calibration on a drive of a few samples)")?;
    let (small, large): (Vec<_>, Vec<_>) = report.generations.iter().partition(|g| g.population == 100);
    for g in small {
        writeln!(text, "{:<10}{:<12}{:>10.3} ms", g.evaluator, g.precision, 1e3 * median(&g.wall_s))?;
    }
    writeln!(text, "\nA whole generation of ga: ask, simulate, reduce, tell")?;
    for g in large {
        writeln!(
            text,
            "{:<10}{:<12}{:>7} candidates{:>6} samples{:>10.1} ms",
            g.evaluator,
            g.precision,
            g.population,
            g.steps,
            1e3 * median(&g.wall_s)
        )?;
    }
    writeln!(text, "\n{:<54}{:>9}{:>10}", "goal (one 3.8 GHz core of Sapphire Rapids class)", "wanted", "found")?;
    for goal in report.goals() {
        let met = goal.is_met().map_or("", |met| if met { "met" } else { "missed" });
        let found = goal.found.map_or("-".to_owned(), short);
        let wanted = format!("{}{}", if goal.at_most { "<= " } else { ">= " }, short(goal.wanted));
        let what = if goal.unit == "Mcs/core-s" { format!("{}: Mcs/core-s", goal.what) } else { goal.what };
        let what = if matches!(goal.unit, "ms" | "%") { format!("{what}: {}", goal.unit) } else { what };
        for (k, line) in textwrap::wrap(&what, 52).iter().enumerate() {
            match k {
                0 => writeln!(text, "{line:<54}{wanted:>9}{found:>10} {met}")?,
                _ => writeln!(text, "  {line}")?,
            }
        }
    }
    Ok(())
}

/// How a hardware GPU compares with all cores of the CPU, by the number of candidates.
fn write_against_lanes(text: &mut String, report: &Report, rows: &[&Row]) -> std::fmt::Result {
    let on_device = |row: &&&Row| row.core_second_of == "device" && row.precision == "plain";
    let Some(first) = rows.iter().find(on_device) else { return Ok(()) };
    let Some(lanes) = report.row("lanes", "plain", &first.variant, POPULATION) else { return Ok(()) };
    let ratio = |row: &&Row| format!("{:.1} x with {}", row.mcs_wall / lanes.mcs_wall, row.population);
    let ratios: Vec<String> = rows.iter().filter(on_device).map(ratio).collect();
    let threads = report.machine.threads;
    let line =
        format!("gpu plain against lanes plain with {POPULATION} on {threads} threads, Mcs/s: {}", ratios.join(", "));
    textwrap::wrap(&line, 80).iter().try_for_each(|line| writeln!(text, "{line}"))
}

/// A variant, by its name in the table; a law has no id.
fn numbered(row: &Row) -> String {
    match row.model_id {
        0 => row.variant.clone(),
        id => format!("variant {id}, {}", row.variant),
    }
}

/// A share of the hand-written loop on one core; a GPU is many times beyond it.
fn of_native(share: f64) -> String {
    if share < 10.0 { format!("{:.0} %", 100.0 * share) } else { format!("{share:.0} x") }
}

/// All ninety on lanes, and on a hardware GPU: bases as columns, extensions as lines.
fn write_ninety(text: &mut String, report: &Report) -> std::fmt::Result {
    write_ninety_on(text, report, "lanes", (POPULATION, "Mcs/core-s"))?;
    write_ninety_on(text, report, "gpu", (MANY, "Mcs/s"))
}

fn write_ninety_on(
    text: &mut String,
    report: &Report,
    evaluator: &str,
    (population, unit): (usize, &str),
) -> std::fmt::Result {
    let Some((slowest, ratio)) = report.slowest(evaluator, population) else { return Ok(()) };
    writeln!(text, "\nAll ninety variants on {evaluator} plain, {population} candidates, {unit}")?;
    write!(text, "{:<28}", "extensions")?;
    BASES.iter().try_for_each(|base| write!(text, "{:>10}", base.name))?;
    writeln!(text)?;
    for k in 0..18 {
        let line: Vec<Variant> =
            (0..BASES.len() as u32).filter_map(|base| Variant::from_id(base * 18 + k + 1).ok()).collect();
        write!(text, "{:<28}", extensions(&line[0]))?;
        for variant in line {
            let speed = report.row(evaluator, "plain", &variant.name(), population).map(|row| row.mcs_per_core_second);
            write!(text, "{:>10}", speed.map_or("-".to_owned(), |x| format!("{x:.0}")))?;
        }
        writeln!(text)?;
    }
    let name = Variant::from_id(slowest).map(|v| v.name()).unwrap_or_default();
    writeln!(text, "slowest: variant {slowest} {name}, {ratio:.2} times slower than variant 1")
}

/// The parts that a variant adds to its base.
fn extensions(variant: &Variant) -> String {
    let parts = [
        variant.delay.then_some("delay"),
        (variant.dynamics != Dynamics::None).then(|| variant.dynamics.name()),
        (variant.constraint != Constraint::None).then(|| variant.constraint.name()),
    ];
    let named: Vec<&str> = parts.into_iter().flatten().collect();
    if named.is_empty() { "none".to_owned() } else { named.join("+") }
}

/// Three decimals below 20, none above.
fn short(x: f64) -> String {
    if x >= 100.0 {
        format!("{x:.0}")
    } else {
        format!("{x:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

impl Report {
    /// Speed of the hand-fused loop of the same width on as many candidates; there is one for variant 1 only.
    fn native(&self, row: &Row) -> Option<f64> {
        let width = if row.precision == "f64" { "f64" } else { "f32" };
        let exact = self.row("native", width, &row.variant, row.population);
        let native = exact.or_else(|| self.row("native", width, &row.variant, POPULATION))?;
        Some(native.mcs_per_core_second)
    }
}
