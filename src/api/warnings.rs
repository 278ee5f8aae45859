//! Settings without effect and likely mistakes: one warning each, before the work.

use super::bounds::{is_controller, is_human};
use super::loading::start_assumed;
use super::reading::Reading;
use crate::calibrate::Overrides;
use crate::catalog::{Constraint, Controller, Dynamics, Variant};
use crate::convention::Convention;
use crate::evaluator::Case;
use crate::simulate::{far_above, far_above_in_words};
use crate::symbols::Symbol;
use crate::text::option::{BOUNDS, CONVENTION, FIX, GRADE, LEAD_LENGTH, LEAD_START, VEHICLE};
use crate::text::shown::NAMED;
use crate::trajectory::{Note, Trajectory};
use crate::wgsl::extension_named;

/// A follower that never exceeds this share of the lowest v_0 is far below it.
const FAR_BELOW: f64 = 0.7;

/// A shorter time above v_0 counts as noise \[s\].
const ABOVE_S: f64 = 1.0;

/// Warnings about a calibration, one line each.
pub fn of(
    reading: &Reading,
    model: &Variant,
    convention: Convention,
    overrides: &Overrides,
    loaded: &[&Trajectory],
) -> Vec<String> {
    let mut said = unused(reading, model, loaded);
    said.extend(model.extensions.list().iter().flat_map(|extension| extension.warnings.iter().cloned()));
    said.extend(idle_switches(model, convention));
    said.extend(loaded.iter().filter(|_| model.needs_position()).filter_map(|one| start_assumed(one)));
    said.extend(level_road(model, overrides, loaded));
    said.extend(drivers(overrides, loaded));
    said.extend(off_bounds(model, convention, overrides, loaded));
    said
}

/// Users expect every setting to have an effect.
fn unused(reading: &Reading, model: &Variant, loaded: &[&Trajectory]) -> Vec<String> {
    let mut said = Vec::new();
    if reading.vehicle.is_some() && !model.needs_vehicle() {
        said.push(format!(
            "{VEHICLE} changes nothing: variant {model} has neither nonlinear dynamics nor the constraint mfc"
        ));
    }
    // Even if only the position is read, the table gives the length of a lap.
    let lap = loaded.iter().any(|l| l.grade.as_ref().is_some_and(|grade| grade.period.is_some()));
    if reading.grade.is_some() && !model.needs_grade() && !(model.needs_position() && lap) {
        said.push(format!(
            "{GRADE} changes nothing: variant {model} has neither nonlinear dynamics nor an extension that reads it"
        ));
    }
    if model.needs_position() {
        return said;
    }
    // Then positions matter only through the gap derived from them.
    let reads_none = format!("variant {model} reads neither the grade nor the position on the road");
    if reading.lead_start_m.is_some() {
        said.push(format!("{LEAD_START} changes nothing: {reads_none}"));
    }
    if reading.lead_length_m.is_some() && loaded.iter().all(|one| one.notes.iter().all(|note| !takes_length(note))) {
        said.push(format!("{LEAD_LENGTH} changes nothing: the gap is measured, and {reads_none}"));
    }
    said
}

/// True for a note of a spacing that may depend on the length of the car ahead: from positions, from a column map, or beside
/// positions in the authors' files.
fn takes_length(note: &Note) -> bool {
    matches!(note, Note::Derived { .. } | Note::Mapped { .. } | Note::LengthDerived { .. })
}

/// Single switches changed after a preset that do not concern the variant.
fn idle_switches(model: &Variant, convention: Convention) -> Vec<String> {
    let shown = convention.to_string();
    let changed = shown.split(',').skip(1);
    let idle = changed.filter_map(|switch| Some((switch, lacks(switch.split('=').next()?, model)?)));
    idle.map(|(switch, lack)| format!("{CONVENTION} {switch} changes nothing: variant {model} has no {lack}")).collect()
}

/// The part that a switch of the convention affects, if the variant lacks it.
fn lacks(switch: &str, model: &Variant) -> Option<&'static str> {
    let (lack, has) = match switch {
        "road_load" => ("nonlinear dynamics, so no f_1 and f_2 to be bounded", model.dynamics == Dynamics::Nonlinear),
        "mfc" => ("constraint mfc", model.constraint == Constraint::Mfc),
        "bounds" => ("acceleration constraint", model.constraint != Constraint::None),
        "grade" => ("nonlinear dynamics or extension that reads the grade", model.needs_grade()),
        "radicand" => ("controller of Gipps", model.base.controller == Controller::Gipps),
        "delay" => ("perception delay", model.perceives_late()),
        _ => return None,
    };
    (!has).then_some(lack)
}

/// Contradiction between the driver that the file names and the model or the bounds.
fn drivers(overrides: &Overrides, loaded: &[&Trajectory]) -> Vec<String> {
    let human: Vec<&Trajectory> = loaded.iter().filter(|one| one.driver().is_some_and(is_human)).copied().collect();
    let mut said = Vec::new();
    if !human.is_empty() && overrides.is_empty() {
        let all = paths(&human);
        said.push(format!(
            "{all}: the file names a human driver, but these bounds are for ACC cars; use {BOUNDS} human"
        ));
    }
    let machine = loaded.iter().find(|one| one.driver().is_some_and(is_controller));
    if let (Some(one), Some(other)) = (human.first(), machine) {
        said.push(format!(
            "{} and {} have a human driver and a controller according to the files, but get the same parameters",
            one.label, other.label
        ));
    }
    said
}

/// On a level road an extension that acts through the grade has no effect, but the search still gives it a value.
fn level_road(model: &Variant, overrides: &Overrides, loaded: &[&Trajectory]) -> Option<String> {
    let is_level = |l: &&&Trajectory| l.grade.as_ref().is_some_and(|g| g.sin.iter().all(|sin| *sin == 0.0));
    let level: Vec<&Trajectory> = loaded.iter().filter(is_level).copied().collect();
    let is_fixed = |symbol: &Symbol| overrides.get(symbol.name()).is_some_and(|[lower, upper]| lower == upper);
    let reading = model.extensions.list().iter().filter(|e| e.reads("sin_grade"));
    let idle: Vec<String> = reading
        .filter(|e| !e.parameters.iter().all(is_fixed))
        .map(|extension| match extension_named(&extension.name) {
            Some(_) => {
                let names: Vec<&str> = extension.parameters.iter().map(|symbol| symbol.name()).collect();
                format!("{} has no effect; its value is meaningless", names.join(", "))
            }
            // Other effects of a user's own text are not known here.
            None => format!("the effect of {} by the grade vanishes", extension.name),
        })
        .collect();
    if level.is_empty() || idle.is_empty() {
        return None;
    }
    let paths = if level.len() == loaded.len() { String::new() } else { format!("{}: ", paths(&level)) };
    Some(format!("{paths}the grade is 0 throughout: {}; give the slope with {GRADE} FILE", idle.join("; ")))
}

/// A car that never comes near its desired speed does not determine it, and Table 3 is for cars at 30 m/s and more; the model cannot follow one
/// that is faster than any desired speed.
fn off_bounds(model: &Variant, convention: Convention, overrides: &Overrides, loaded: &[&Trajectory]) -> Vec<String> {
    if !model.parameters().contains(&Symbol::v_0) {
        return Vec::new();
    }
    let given = overrides.get("v_0").copied();
    let bounds = given.or_else(|| Case::bounds(Symbol::v_0, None, convention));
    let Some([lower, upper]) = bounds else { return Vec::new() };
    let remedy = |which: &str| match given {
        Some([lower, upper]) if lower == upper => format!("{FIX} or the file of {BOUNDS} sets v_0 to {upper} m/s"),
        Some(_) => format!("in the file of {BOUNDS}, {which} changes that"),
        None => format!(
            "to change this, use {BOUNDS} human (human drivers) or {BOUNDS} FILE.toml with `v_0 = [LOWER, UPPER]`"
        ),
    };
    let highest = |l: &Trajectory| l.v_f.iter().copied().fold(0.0, f64::max);
    let mut said = Vec::new();
    let far: Vec<&Trajectory> =
        loaded.iter().filter(|l| lower == upper && far_above(upper, highest(l))).copied().collect();
    if let Some(fastest) = far.iter().map(|l| highest(l)).reduce(f64::max) {
        said.push(format!("{}: {}", paths(&far), far_above_in_words(upper, fastest)));
    }
    let slow: Vec<&Trajectory> =
        loaded.iter().filter(|l| lower < upper && highest(l) < FAR_BELOW * lower).copied().collect();
    if let Some(fastest) = slow.iter().map(|l| highest(l)).reduce(f64::max) {
        said.push(format!(
            "{}: the follower never drives faster than {fastest:.1} m/s, but v_0 is searched from {lower} m/s on: it will not \
             be the set speed; {}",
            paths(&slow),
            remedy("a lower bound near the driven speeds")
        ));
    }
    let above = |l: &&&Trajectory| {
        let seconds = l.v_f.iter().filter(|v| **v > upper).count() as f64 * l.dt;
        seconds >= ABOVE_S
    };
    let fast: Vec<&Trajectory> = loaded.iter().filter(above).copied().collect();
    if let Some(fastest) = fast.iter().map(|l| highest(l)).reduce(f64::max) {
        let first = fast[0].v_f.iter().position(|v| *v > upper).unwrap_or_default();
        said.push(format!(
            "{}: the follower drives up to {fastest:.1} m/s (above {upper} m/s from {:.1} s on), but v_0 is searched up to {upper} m/s: the model cannot keep up; {}",
            paths(&fast),
            fast[0].t[first],
            remedy("an upper bound above the driven speeds")
        ));
    }
    said
}

/// Each file once; the first ones of many.
fn paths(loaded: &[&Trajectory]) -> String {
    let mut paths: Vec<&str> = loaded.iter().map(|l| l.source.path.as_str()).collect();
    paths.dedup();
    let more = paths.len().saturating_sub(NAMED);
    paths.truncate(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let pairs = if loaded.len() > paths.len() { format!(" ({} drives)", loaded.len()) } else { String::new() };
    format!("{}{more}{pairs}", paths.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_switch_that_cannot_matter_is_named_and_others_are_not() {
        let said = |model: &str, convention: &str| {
            let (model, convention): (Variant, Convention) = (model.parse().unwrap(), convention.parse().unwrap());
            idle_switches(&model, convention).len()
        };
        for (model, convention, expected) in [
            ("gipps+delay+linear+mfc", "authors,road_load=si", 1),
            ("gipps+delay+nonlinear+mfc", "authors,road_load=si,mfc=linear", 0),
            ("idm", "authors", 0),
            ("idm", "paper", 0),
            ("idm", "paper,delay=floor,mfc=bisection,grade=held,bounds=reject", 4),
            ("idm+delay+constant", "paper,delay=floor,bounds=reject,step=raw,denominators=floored", 0),
            ("l-gipps", "paper,radicand=shifted", 1),
            ("gipps", "paper,radicand=shifted", 0),
        ] {
            assert_eq!(said(model, convention), expected, "{model} {convention}");
        }
    }
}
