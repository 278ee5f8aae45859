//! A diagnosis as text for a terminal of 80 columns, for readers who know car-following models but not this method.

use super::causes;
use super::causes::{AT_BOUND, MEND_FIRST};
use super::short::{fleet_in_words, in_short};
use crate::diagnose::describe::error_breakdown::{Budget, Share};
use crate::diagnose::describe::missing::{PLACE, Profile, Profiles};
use crate::report::text::wrapped;
use crate::result::diagnosis::{DataEntry, FindingEntry, HeldBackEntry, Outcome, ParameterEntry};
use crate::text::option::CORRECT;
use indexmap::IndexSet;
use std::fmt::Write;

/// Widths of the first column of a table and of the others, in characters.
const NAME: usize = 28;
/// See [`NAME`].
const CELL: usize = 13;

/// Largest number of characters of a path in a list of drives: a usual file name.
const PATH: usize = 32;
/// Number of files that the text lists: a fleet can have thousands.
const FILES: usize = 8;

/// The next command after a diagnosis.
#[derive(Debug, Clone, Default)]
pub struct Again {
    /// Its words; a flag and its value are one word.
    pub words: Vec<String>,
    /// Its data, such as `on the files that were trained on`.
    pub on: String,
}

/// The whole text of a diagnosis, in the order of its steps, with the command that calibrates the extended model if the caller has one.
#[must_use]
pub fn diagnosis(outcome: &Outcome, again: Option<&Again>) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_all(&mut text, outcome, again);
    text
}

fn write_all(text: &mut String, outcome: &Outcome, again: Option<&Again>) -> std::fmt::Result {
    text.push_str("In short\n");
    in_short(outcome).sentences().for_each(|sentence| text.push_str(&wrapped(0, 2, sentence)));
    text.push('\n');
    text.push_str(&data(&outcome.data, &outcome.data_findings));
    outcome.fleet.iter().for_each(|fleet| text.push_str(&wrapped(0, 2, &fleet_in_words(fleet))));
    text.push_str(&wrapped(0, 2, &outcome.held_back));
    section(text, "2. What is wrong, and where?", |text| {
        wrong(text, outcome);
        Ok(())
    })?;
    section(text, "3. What explains it?", |text| {
        causes::race(text, outcome)?;
        causes::verdict(text, outcome);
        Ok(())
    })?;
    section(text, "4. The model with it", |text| models(text, outcome, again))?;
    section(text, "5. The gain on unseen drives", |text| held_back(text, &outcome.base_held_back))?;
    section(text, "6. What is left", |text| {
        left(text, outcome);
        Ok(())
    })?;
    let Outcome { simulations, seed, effort, program, convention, .. } = outcome;
    text.push_str(&wrapped(
        0,
        2,
        &format!("{simulations} simulations, convention {convention}, seed {seed}, effort {effort}, {program}"),
    ));
    Ok(())
}

/// A section with its title, or nothing if the section is empty.
fn section(text: &mut String, title: &str, write: impl FnOnce(&mut String) -> std::fmt::Result) -> std::fmt::Result {
    let mut body = String::new();
    write(&mut body)?;
    if !body.is_empty() {
        write!(text, "\n{title}\n{body}")?;
    }
    Ok(())
}

/// The errors of the base, and the acceleration that it lacks.
fn wrong(text: &mut String, outcome: &Outcome) {
    for entry in &outcome.broken_off {
        text.push_str(&wrapped(0, 2, &entry.told()));
    }
    if let Some(budget) = &outcome.budget {
        if !outcome.broken_off.is_empty() {
            text.push_str("The errors below are those of the other drives.\n");
        }
        text.push_str(&wrapped(0, 2, &errors(budget)));
    }
    if let Some(missing) = &outcome.missing {
        text.push_str(&wrapped(0, 2, &acceleration(missing)));
    }
}

/// The section on the data. Notes that all drives share are written once.
#[must_use]
pub fn data(data: &[DataEntry], findings: &[FindingEntry]) -> String {
    let mut text = "1. Are the data sound?\n".to_owned();
    let notes: Vec<Vec<String>> = data.iter().map(|entry| notes(entry, findings)).collect();
    let of_all = |note: &&String| data.len() > 1 && notes.iter().all(|other| other.contains(note));
    let shared: Vec<&String> = notes.first().into_iter().flatten().filter(of_all).collect();
    let has_fault =
        |entry: &DataEntry| entry.units.is_some() || findings.iter().any(|f| f.is_of(entry) && !f.is_minor());
    let mut listed: Vec<usize> = (0..data.len()).collect();
    if data.len() > FILES {
        listed.sort_by_cached_key(|&i| !has_fault(&data[i]));
    }
    for &i in listed.iter().take(FILES) {
        let (entry, own) = (&data[i], &notes[i]);
        let [from, to] = entry.window_s;
        let mut line = end(&entry.path, PATH);
        line += &entry.follower().map_or_else(String::new, |follower| format!(" follower {follower}"));
        line += &if entry.name.is_empty() { String::new() } else { format!(", {}", entry.name) };
        line += &entry.trajectory.as_ref().map_or_else(String::new, |id| format!(", trajectory {id}"));
        line += &format!(", {from:.1} to {to:.1} s");
        line += if entry.is_held_back() { ", held back" } else { "" };
        text.push_str(&wrapped(0, 2, &line));
        own.iter().filter(|note| !shared.contains(note)).for_each(|note| text.push_str(&wrapped(2, 4, note)));
    }
    let is_clean = |entry: &&DataEntry| entry.units.is_none() && !findings.iter().any(|f| f.is_of(entry));
    match data.iter().filter(is_clean).count() {
        0 => {}
        all if all == data.len() => text.push_str("No contradictions were found.\n"),
        some => text.push_str(&format!("No contradictions were found in {some} of {} drives.\n", data.len())),
    }
    if let Some(more) = listed.get(FILES..).filter(|more| !more.is_empty()) {
        let faulty = more.iter().filter(|&&i| has_fault(&data[i])).count();
        text.push_str(&format!("Files not listed: {}, with faults: {faulty}\n", more.len()));
    }
    if !shared.is_empty() {
        let shared: Vec<&str> = shared.into_iter().map(String::as_str).collect();
        text.push_str(&wrapped(0, 2, &format!("All drives: {}", shared.join("; "))));
    }
    let can_be_corrected =
        |f: &FindingEntry| f.correction.is_none() && f.remedies.iter().any(|remedy| *remedy == CORRECT.id());
    if findings.iter().any(can_be_corrected) {
        text.push_str(&format!("The data are unchanged. {CORRECT} repairs these faults where possible.\n"));
    }
    text
}

/// What the check of the data says about a drive.
fn notes(entry: &DataEntry, findings: &[FindingEntry]) -> Vec<String> {
    let mut notes: Vec<String> = entry.units.iter().map(|units| format!("UNITS: {units}. {MEND_FIRST}")).collect();
    let (shown, minor): (Vec<_>, Vec<_>) = findings.iter().filter(|f| f.is_of(entry)).partition(|f| !f.is_minor());
    for of_kind in shown.chunk_by(|a, b| (&a.name, &a.when, &a.correction) == (&b.name, &b.when, &b.correction)) {
        let (finding, others) = of_kind.split_first().expect("a chunk has a finding");
        let done = finding.correction.as_ref().map_or(String::new(), |done| format!("; done: {done}"));
        let also = if others.is_empty() { String::new() } else { format!("; also {}", signals(others)) };
        notes.push(format!("{}: {}{also}{done}", finding.name.to_uppercase(), finding.told()));
    }
    if !minor.is_empty() {
        let names: IndexSet<String> = minor.iter().map(|finding| finding.name.to_uppercase()).collect();
        let names: Vec<String> = names.into_iter().collect();
        notes.push(format!("too small to matter: {} (leadlag inspect shows more)", names.join(", ")));
    }
    notes.extend(entry.moved());
    notes.extend(entry.unseen.iter().map(|unseen| format!("not checked: {unseen}")));
    notes
}

/// The signals of findings, with their sizes.
fn signals(findings: &[&FindingEntry]) -> String {
    let signal = |f: &&FindingEntry| format!("{} of {} ({} {})", f.signal, f.car, small(f.value), f.unit);
    findings.iter().map(signal).collect::<Vec<_>>().join(", ")
}

fn small(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size < 1e-3 => format!("{value:.1e}"),
        _ => format!("{value:.3}"),
    }
}

/// The base beside the recommended model, otherwise beside the one with the named causes; and the command that calibrates it.
fn models(text: &mut String, outcome: &Outcome, again: Option<&Again>) -> std::fmt::Result {
    let Some(base) = &outcome.base else { return Ok(()) };
    let extended = outcome.extended.as_ref();
    let title = match extended {
        Some(model) => {
            let what = if outcome.recommended.is_some() { "recommended" } else { "not recommended" };
            format!("{}, and with {} ({what})", base.variant, model.extensions.join(" and "))
        }
        None => format!("{}; no extension is recommended", base.variant),
    };
    text.push_str(&wrapped(0, 2, &title));
    let own: Vec<&ParameterEntry> = base.of_car().collect();
    let more: Vec<&ParameterEntry> = extended.iter().flat_map(|model| model.of_car()).collect();
    let is_new = |p: &&&ParameterEntry| !own.iter().any(|own| own.name == p.name);
    let rows: Vec<&ParameterEntry> = own.iter().chain(more.iter().filter(is_new)).copied().collect();
    let cell =
        |all: &[&ParameterEntry], name: &str| all.iter().find(|p| p.name == name).map_or(String::new(), |p| value(p));
    let line =
        |row: &&ParameterEntry| [row.name.clone(), row.unit.clone(), cell(&own, &row.name), cell(&more, &row.name)];
    let head = ["", "", "base", if extended.is_some() { "extended" } else { "" }].map(str::to_owned);
    let lines: Vec<[String; 4]> = std::iter::once(head).chain(rows.iter().map(line)).collect();
    let widths: [usize; 4] =
        std::array::from_fn(|k| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0));
    for line in &lines {
        let cells: Vec<String> = line.iter().zip(widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        writeln!(text, "  {}", cells.join("  ").trim_end())?;
    }
    if own.iter().chain(&more).any(|p| p.at_bound) {
        writeln!(text, "  * {AT_BOUND}")?;
    }
    if let Some(again) = again.filter(|_| extended.is_some()) {
        text.push_str(&wrapped(0, 2, &format!("To calibrate it {}:", again.on)));
        text.push_str(&typed(&again.words));
    }
    Ok(())
}

/// A value with its interval, marked if it is at a bound.
fn value(p: &ParameterEntry) -> String {
    let interval = p.interval.map_or(String::new(), |[low, high]| format!(" [{low:.4}, {high:.4}]"));
    format!("{:.4}{interval}{}", p.value, if p.at_bound { "*" } else { "" })
}

/// Errors on data that the models were not fitted to; two numbers are those of the base and of the recommended model.
fn held_back(text: &mut String, drives: &[HeldBackEntry]) -> std::fmt::Result {
    if drives.is_empty() {
        return Ok(());
    }
    let both = drives.iter().any(|drive| drive.recommended.is_some());
    let of = if both { "errors: base, recommended" } else { "errors: base" };
    let heads = ["spacing [m]", "speed [m/s]", "accel [m/s²]", "NRMSE"].map(|head| format!("{head:>CELL$}"));
    writeln!(text, "{of:NAME$}{}", heads.concat())?;
    for drive in drives {
        let base = drive.rms.zip(drive.nrmse_sva);
        let more = drive.recommended.map(|errors| (errors.rms, errors.nrmse_sva));
        let numbers = |(rms, nrmse): ([f64; 3], f64)| [rms[0], rms[1], rms[2], nrmse].map(|x| format!("{x:.3}"));
        let [base, more] = [base, more].map(|errors| errors.map_or(["NaN"; 4].map(str::to_owned), numbers));
        let cell = |k: usize| match both {
            true => format!("{:>CELL$}", format!("{} {}", base[k], more[k])),
            false => format!("{:>CELL$}", base[k]),
        };
        writeln!(text, "{:<NAME$}{}", end(&drive.label, NAME - 1), (0..4).map(cell).collect::<String>())?;
    }
    if drives.iter().any(|drive| drive.rms.is_none() || (both && drive.recommended.is_none())) {
        text.push_str("NaN: the simulation ends early.\n");
    }
    Ok(())
}

/// The last characters, at most `most`: paths differ more in their file names than in their folders.
fn end(label: &str, most: usize) -> String {
    let letters: Vec<char> = label.chars().collect();
    if letters.len() <= most {
        label.to_owned()
    } else {
        format!("…{}", letters[letters.len() + 1 - most..].iter().collect::<String>())
    }
}

/// A command on lines of at most 80 columns, if its words allow that; a shell reads them as one command.
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

/// The size of the errors, and the regime with most of the speed error.
fn errors(budget: &Budget) -> String {
    const SPEED: usize = 1;
    let [s, v, a] = budget.rms;
    let share = |share: &Share| {
        let [error, time] = [share.error[SPEED], share.time].map(|share| 100.0 * share);
        format!("; {}: {error:.0} % of the speed's squared error in {time:.0} % of the time", share.name)
    };
    let worst = budget.worst_regime(SPEED).map_or(String::new(), share);
    format!("Rms errors: spacing {s:.3} m, speed {v:.3} m/s, acceleration {a:.3} m/s²{worst}.")
}

/// Largest mean chi-squared that may be chance: it is about 1 without a dependence, and the difference of a single pair of classes exceeds
/// 4, two standard errors, in one of twenty cases. With more classes the mean exceeds it more rarely; the margin allows for errors that are
/// estimates.
const CHANCE: f64 = 4.0;

/// The missing acceleration in words.
fn acceleration(missing: &Profiles) -> String {
    // The classes of a place have a few blocks each, too few for a test. The correlation between drives is one.
    let is_clear = |profile: &&Profile| match profile.name.as_str() {
        PLACE => missing.repeats().is_some(),
        _ => profile.chi2 > CHANCE,
    };
    let clear: Vec<String> = missing
        .profiles
        .iter()
        .filter(is_clear)
        .map(|profile| format!("{} ({:.0} %)", profile.name, 100.0 * profile.explained))
        .collect();
    let on =
        if clear.is_empty() { "on no signal beyond chance".to_owned() } else { format!("on {}", clear.join(", ")) };
    let chance = missing.repeats_by_chance.map_or(String::new(), |chance| format!(" (chance: ±{chance:.2})"));
    let repeats = missing.repeats_by_place.map_or(String::new(), |r| {
        format!(" Its correlation between drives at the same places of the road is {r:.2}{chance}.")
    });
    format!("The base lacks an acceleration of {} m/s² (rms). It depends {on}.{repeats}", small(missing.rms))
}

fn left(text: &mut String, outcome: &Outcome) {
    for left in &outcome.left_over {
        let kind = left.kind.replace('_', " ");
        let (size, place) = (small(left.size), &left.r#where);
        // For this kind, the text that follows gives the unit.
        let line = match left.kind.as_str() {
            "missing_acceleration" => format!("{kind}: {size} {place}"),
            _ => format!("{kind}: {place} ({size})"),
        };
        text.push_str(&wrapped(0, 2, &line));
    }
}
