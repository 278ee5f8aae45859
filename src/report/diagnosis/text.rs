//! A diagnosis as text for a terminal of 80 columns, for readers who know car-following models but not this method.

use super::causes;
use super::causes::MEND_FIRST;
use super::short::in_short;
use crate::diagnose::describe::error_breakdown::{Budget, Share};
use crate::diagnose::describe::missing::Profiles;
use crate::report::text::wrapped;
use crate::result::diagnosis::recommended::Recommended;
use crate::result::diagnosis::{DataEntry, FindingEntry, HeldBackEntry, ModelEntry, Outcome};
use std::fmt::Write;

/// Rows of a table of places, speeds or times: the worst ones.
const ROWS: usize = 5;

/// Columns of a class's name.
const NAME: usize = 36;

/// The nuisance parameter of every base model of a diagnosis.
const LEAD: &str = "lead_h";

/// What the caller knows beside the result.
#[derive(Debug, Clone, Default)]
pub struct Beside<'a> {
    /// Window of every file to train on whose end is held back \[s\]; empty if files of their own are.
    pub trained: &'a [[f64; 2]],
    /// How to calibrate the extended model.
    pub again: Option<Again>,
}

/// A command that goes on where a diagnosis ends.
#[derive(Debug, Clone, Default)]
pub struct Again {
    /// Its words; a flag and its value are one.
    pub words: Vec<String>,
    /// What it works on, such as `on the files that were trained on`.
    pub on: String,
}

/// Everything that a diagnosis has to say, in the order of its steps.
#[must_use]
pub fn diagnosis(outcome: &Outcome, beside: &Beside) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_all(&mut text, outcome, beside);
    text
}

fn write_all(text: &mut String, outcome: &Outcome, beside: &Beside) -> std::fmt::Result {
    heading(text, "In short");
    in_short(outcome).sentences().for_each(|sentence| text.push_str(&wrapped(0, 2, sentence)));
    if let Some(again) = beside.again.as_ref().filter(|_| outcome.recommended.is_some()) {
        text.push_str(&wrapped(0, 2, &format!("To calibrate it {}:", again.on)));
        text.push_str(&typed(&again.words));
    }
    text.push('\n');
    text.push_str(&data(&outcome.data, &outcome.data_findings, beside.trained));
    text.push_str(&wrapped(0, 2, &outcome.held_back));
    if let Some(base) = &outcome.base {
        heading(text, "2. The base model");
        model(text, base)?;
    }
    if outcome.budget.is_some() || !outcome.broken_off.is_empty() {
        heading(text, "3. Where its simulation goes wrong (training data)");
    }
    for entry in &outcome.broken_off {
        text.push_str(&wrapped(0, 2, &entry.told()));
    }
    if let Some(budget) = &outcome.budget {
        if !outcome.broken_off.is_empty() {
            text.push_str("The errors below are those of the other drives.\n\n");
        }
        errors(text, budget)?;
    }
    if let Some(missing) = &outcome.missing {
        text.push('\n');
        acceleration(text, missing, outcome.base.as_ref())?;
    }
    heading(text, "4. Which cause");
    causes::ladder(text, &outcome.ladder)?;
    causes::verdict(text, outcome)?;
    heading(text, "5. The extended model");
    extended(text, outcome, beside.again.as_ref().filter(|_| outcome.recommended.is_none()))?;
    heading(text, "6. Gain on the data held back");
    match (&outcome.gain, outcome.verdict) {
        (Some(gain), _) => {
            text.push_str(&wrapped(0, 2, &gain.sentence));
            if let Some([base, extended]) = gain.signals {
                writeln!(text, "\n{:<12}{:>10}{:>10}{:>10}", "NRMSE", "spacing", "speed", "accel.")?;
                for (name, [s, v, a]) in [("base", base), ("extended", extended)] {
                    writeln!(text, "{name:<12}{s:>10.4}{v:>10.4}{a:>10.4}")?;
                }
            }
            for (where_, [base, extended, all]) in ["held back", "training"].into_iter().zip(gain.crashes()) {
                writeln!(text, "runs that crash or break off, {where_}: base {base}, extended {extended}, of {all}")?;
            }
        }
        (None, _) if outcome.gain_error.is_some() => {
            text.push_str(&wrapped(0, 2, outcome.gain_error.as_deref().unwrap_or_default()))
        }
        (None, _) => match &outcome.recommended {
            Some(recommended) => gained(text, recommended)?,
            None => text.push_str("no extension is recommended\n"),
        },
    }
    held_back(text, &outcome.base_held_back)?;
    heading(text, "7. What is left");
    left(text, outcome)?;
    let Outcome { simulations, seed, effort, program, evaluator, precision, convention, .. } = outcome;
    text.push('\n');
    text.push_str(&wrapped(
        0,
        2,
        &format!("{simulations} simulations by {evaluator} ({precision}), convention {convention}, seed {seed}, effort {effort}, {program}"),
    ));
    Ok(())
}

fn heading(text: &mut String, title: &str) {
    text.push_str(&format!("\n{title}\n{}\n", "-".repeat(title.chars().count())));
}

/// What the data say about themselves; `trained` as in [`Beside`].
#[must_use]
pub fn data(data: &[DataEntry], findings: &[FindingEntry], trained: &[[f64; 2]]) -> String {
    let title = "1. Are the data sound?";
    let mut text = format!("{title}\n{}\n", "-".repeat(title.len()));
    for (i, entry) in data.iter().enumerate() {
        let [from, to] = entry.window_s;
        let window = match trained.get(i) {
            Some([from, until]) => format!("{from:.1} to {until:.1} s, held back from there to {to:.1} s"),
            None => format!("{from:.1} to {to:.1} s"),
        };
        let mut who = if entry.name.is_empty() { String::new() } else { format!(", {}", entry.name) };
        who += &entry.trajectory.as_ref().map_or_else(String::new, |id| format!(", trajectory {id}"));
        text.push_str(&wrapped(
            0,
            2,
            &format!("{} [{}] follower {}{who}, {window}", entry.path, entry.role, entry.follower),
        ));
        if let Some(rms) = entry.gap_rate_rms_mps {
            text.push_str(&wrapped(
                2,
                4,
                &format!(
                    "gap and speeds agree within {} m/s (rms of gap rate minus speed difference over 1 s)",
                    small(rms)
                ),
            ));
        }
        if let Some(units) = &entry.units {
            text.push_str(&wrapped(2, 4, &format!("UNITS: {units}. {MEND_FIRST}")));
        }
        let mut own = findings.iter().filter(|finding| finding.file == entry.path).peekable();
        if own.peek().is_none() && entry.units.is_none() {
            text.push_str("  nothing contradicts itself\n");
        }
        for finding in own {
            text.push_str(&wrapped(2, 4, &format!("{}: {}", finding.name.to_uppercase(), finding.told())));
            if let Some(correction) = &finding.correction {
                text.push_str(&wrapped(4, 6, &format!("done: {correction}")));
            }
        }
        if let Some(moved) = entry.moved() {
            text.push_str(&wrapped(2, 4, &moved));
        }
        for unseen in &entry.unseen {
            text.push_str(&wrapped(2, 4, &format!("cannot be seen: {unseen}")));
        }
    }
    if findings.iter().any(|finding| finding.correction.is_none()) {
        let others = if findings.iter().all(|finding| finding.correction.is_none()) { "" } else { "other " };
        text.push_str(&format!("The {others}data were left as they are. --correct repairs what can be repaired.\n"));
    }
    text
}

fn small(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size < 1e-3 => format!("{value:.1e}"),
        _ => format!("{value:.3}"),
    }
}

fn model(text: &mut String, model: &ModelEntry) -> std::fmt::Result {
    writeln!(text, "{}", model.variant)?;
    causes::parameters(text, &model.parameters)?;
    if model.parameters.iter().any(|p| p.name == LEAD) {
        text.push_str(&wrapped(
            0,
            2,
            &format!(
                "{LEAD} is no property of the car: it makes up for the measured car not being controlled in steps as long as those of \
                 the simulation."
            ),
        ));
    }
    text.push_str(&wrapped(
        0,
        2,
        &format!(
            "What the model does not know of acts on this car like a random acceleration of {} m/s² that lasts for {:.1} s. \
             Noise of the sensors, as estimated: gap {} m, speed {} m/s.",
            small(model.sigma_d_mps2),
            model.tau_d_s,
            small(model.noise_gap_m),
            small(model.noise_speed_mps)
        ),
    ));
    Ok(())
}

/// What the named causes make of the base model, and how to go on with it.
fn extended(text: &mut String, outcome: &Outcome, again: Option<&Again>) -> std::fmt::Result {
    if let Some(recommended) = &outcome.recommended {
        let base = outcome.base.as_ref().map_or("the base", |base| base.variant.as_str());
        let names: Vec<&str> = recommended.causes.iter().map(|cause| cause.name.as_str()).collect();
        writeln!(text, "recommended: {base} with {}", names.join(" and "))?;
        return causes::parameters(text, &recommended.parameters);
    }
    let Some(extended) = outcome.extended.as_ref().filter(|_| !outcome.causes.is_empty()) else {
        text.push_str("no extension is recommended\n");
        return Ok(());
    };
    writeln!(text, "{}", extended.variant)?;
    causes::parameters(text, &extended.parameters)?;
    if let Some(again) = again {
        text.push_str(&wrapped(0, 2, &format!("To calibrate it {}:", again.on)));
        text.push_str(&typed(&again.words));
    }
    Ok(())
}

/// What the recommended model gains on drives, or parts of them, that it was not fitted to.
fn gained(text: &mut String, recommended: &Recommended) -> std::fmt::Result {
    writeln!(text, "NRMSE(s,v,a) of what was left out of the fits, with the base and with the recommended model:")?;
    for drive in &recommended.per_drive {
        let gain = 100.0 * (1.0 - drive.extended / drive.base);
        text.push_str(&wrapped(
            2,
            4,
            &format!("{}: {:.4}, {:.4} ({gain:+.1} %)", drive.path, drive.base, drive.extended),
        ));
    }
    Ok(())
}

/// Errors of the base model on the drives that it was not fitted to.
fn held_back(text: &mut String, drives: &[HeldBackEntry]) -> std::fmt::Result {
    if drives.is_empty() {
        return Ok(());
    }
    text.push_str("\nThe base model of section 2 on the drives held back, root mean square:\n");
    writeln!(text, "{:<NAME$}{:>10} {:>10} {:>11}{:>9}", "", "spacing", "speed", "accel.", "NRMSE")?;
    for drive in drives {
        let name: String = drive.label.chars().take(NAME).collect();
        match (drive.rms, drive.nrmse_sva) {
            (Some([s, v, a]), Some(nrmse)) => {
                writeln!(text, "{name:<NAME$}{s:>8.3} m {v:>6.3} m/s {a:>6.3} m/s²{nrmse:>9.4}")?;
            }
            _ => text.push_str(&wrapped(0, 2, &format!("{}: the run does not come to the end", drive.label))),
        }
    }
    Ok(())
}

/// A command over lines that a shell takes as one, of at most 80 columns where its words allow.
fn typed(words: &[String]) -> String {
    const WIDTH: usize = 78;
    let mut lines = vec![String::from(" ")];
    for word in words {
        let last = lines.last_mut().expect("there is a first line");
        if last.trim().is_empty() || last.chars().count() + 1 + word.chars().count() <= WIDTH {
            *last += &format!(" {word}");
        } else {
            lines.push(format!("    {word}"));
        }
    }
    lines.join(" \\\n") + "\n"
}

fn errors(text: &mut String, budget: &Budget) -> std::fmt::Result {
    writeln!(text, "{:<28}{:>10} {:>10} {:>11}", "", "spacing", "speed", "accel.")?;
    let [s, v, a] = budget.rms;
    writeln!(text, "{:<28}{s:>8.3} m {v:>6.3} m/s {a:>6.3} m/s²", "error, root mean square")?;
    let [s, v, a] = budget.bias;
    writeln!(text, "{:<28}{s:>+8.3} m {v:>+6.3} m/s {a:>+6.3} m/s²", "mean (simulated - measured)")?;
    writeln!(text, "\nshare of the squared error, beside the share of the time")?;
    writeln!(text, "{:<NAME$}{:>8}{:>10}{:>10}{:>10}", "", "time", "spacing", "speed", "accel.")?;
    let rows = |text: &mut String, shares: &mut dyn Iterator<Item = &Share>| {
        for share in shares {
            let time = share.time.map_or("-".to_owned(), |time| format!("{:.0} %", 100.0 * time));
            let [s, v, a] = share.error.map(|e| format!("{:.0} %", 100.0 * e));
            let name: String = share.name.chars().take(NAME).collect();
            writeln!(text, "{name:<NAME$}{time:>8}{s:>10}{v:>10}{a:>10}")?;
        }
        Ok(())
    };
    rows(text, &mut budget.regime.iter())?;
    text.push('\n');
    rows(text, &mut budget.frequency.iter())?;
    text.push('\n');
    rows(text, &mut budget.speed.iter())?;
    if !budget.place.is_empty() {
        writeln!(text, "\nplaces with the most error in speed")?;
        rows(text, &mut worst(&budget.place).into_iter())?;
    }
    if !budget.time.is_empty() {
        writeln!(text, "\ntimes with the most error in speed")?;
        rows(text, &mut worst(&budget.time).into_iter())?;
    }
    if let Some(regime) = budget.worst_regime(1) {
        let (time, error) = (100.0 * regime.time.unwrap_or(0.0), 100.0 * regime.error[1]);
        writeln!(text, "\n{}: {time:.0} % of the time and {error:.0} % of the speed error", regime.name)?;
    }
    Ok(())
}

/// The classes with the largest share of the speed's error.
fn worst(shares: &[Share]) -> Vec<&Share> {
    let mut all: Vec<&Share> = shares.iter().collect();
    all.sort_by(|a, b| b.error[1].total_cmp(&a.error[1]));
    all.truncate(ROWS);
    all
}

/// Mean chi-squared up to which a dependence may be chance: where there is none it is about 1, and a single difference of two classes
/// exceeds 4, two standard errors, in one of twenty cases. More classes do so more rarely, which leaves room for errors that are estimates.
const CHANCE: f64 = 4.0;

/// The missing acceleration in words.
fn acceleration(text: &mut String, missing: &Profiles, model: Option<&ModelEntry>) -> std::fmt::Result {
    let sigma = model.map_or(String::new(), |m| format!(" (its model's own estimate: {} m/s²)", small(m.sigma_d_mps2)));
    text.push_str(&wrapped(
        0,
        2,
        &format!(
            "The missing acceleration is what has to be added to the model's acceleration, moment by moment, so that it keeps \
             to the measured car: {} m/s² root mean square{sigma}. Does it depend on something?",
            small(missing.rms)
        ),
    ));
    writeln!(text, "{:<30}{:>9}  strongest class, d in m/s²", "against", "explains")?;
    for profile in &missing.profiles {
        let strongest = profile.classes.iter().max_by(|a, b| {
            let z = |c: &crate::diagnose::describe::missing::Class| (c.mean / c.error.max(1e-12)).abs();
            z(a).total_cmp(&z(b))
        });
        let class = strongest.map_or(String::new(), |c| {
            format!("{:+.3} ± {:.3} at {}", c.mean, 1.96 * c.error, at(c.at, &profile.unit))
        });
        let clear = if profile.chi2 > CHANCE { "" } else { " ?" };
        writeln!(text, "{:<30}{:>7.0} %  {class}{clear}", profile.name, 100.0 * profile.explained)?;
    }
    if missing.profiles.iter().any(|profile| profile.chi2 <= CHANCE) {
        writeln!(text, "?: no more than chance may do")?;
    }
    if let Some(r) = missing.repeats_by_place {
        text.push_str(&wrapped(
            0,
            2,
            &format!("It repeats at the same places of the road in other runs with correlation {r:.2}."),
        ));
    }
    Ok(())
}

/// A value of a quantity with its unit.
fn at(value: f64, unit: &str) -> String {
    let digits = if value.abs() >= 100.0 {
        0
    } else if value.abs() >= 1.0 {
        1
    } else {
        3
    };
    let unit = if unit == "-" { "" } else { unit };
    format!("{value:.digits$} {unit}").trim_end().to_owned()
}

fn left(text: &mut String, outcome: &Outcome) -> std::fmt::Result {
    for left in &outcome.left_over {
        let formula = left.formula.as_ref().map_or(String::new(), |f| format!("; {f}"));
        let kind = left.kind.replace('_', " ");
        let (size, place) = (small(left.size), &left.r#where);
        // Here the words that follow say what the number is; elsewhere the kind does.
        let line = match left.kind.as_str() {
            "missing_acceleration" => format!("{kind}: {size} {place}{formula}"),
            _ => format!("{kind}: {place} ({size}){formula}"),
        };
        text.push_str(&wrapped(0, 2, &line));
    }
    match &outcome.formula {
        Some(formula) => text.push_str(&wrapped(
            0,
            2,
            &format!(
                "Shortest formula for it: {} [SI]; explains {:.0} % of it where it was fitted, {:.0} % where it was not. A \
                 description, not a cause.",
                formula.equation(),
                100.0 * formula.explained,
                100.0 * formula.explained_held_out
            ),
        )),
        None => text.push_str("No short formula in s, v, dv, a_l and grade describes it.\n"),
    }
    Ok(())
}
