//! Bounds of parameters, by the name of a set or from files; an error names file and line.

use super::error::Usage;
use crate::calibrate::{self, BoundSet, BoundsError, Overrides, checked};
use crate::catalog::Variant;
use crate::symbols::Symbol;
use crate::text::spelling::did_you_mean;
use crate::vehicle::Vehicle;
use std::path::Path;

/// The bounds of sets and files for the parameters of a variant; later ones replace earlier ones.
pub fn read_bounds(given: &[String], variant: &Variant) -> anyhow::Result<Overrides> {
    let mut bounds = Overrides::new();
    for given in given {
        bounds.extend(match given.parse::<BoundSet>() {
            Ok(set) => set.overrides(variant),
            Err(_) => of_file(Path::new(given), variant)?,
        });
    }
    Ok(bounds)
}

/// Bounds of single parameters for a model: `known` are its parameters and others that may be bounded.
pub fn checked_single(single: &Overrides, variant: &Variant, known: &[Symbol]) -> anyhow::Result<Overrides> {
    let one = |(name, ends): (&String, &[f64; 2])| match known.iter().find(|symbol| symbol.name() == name) {
        Some(symbol) => Ok((name.clone(), checked(*symbol, *ends)?)),
        None => Err(unknown(&format!("bounds of {name}"), name, variant, known).into()),
    };
    single.iter().map(one).collect()
}

/// Error for a parameter that the variant lacks.
pub fn unknown(what: &str, name: &str, variant: &Variant, known: &[Symbol]) -> Usage {
    let known: Vec<&str> = known.iter().map(|symbol| symbol.name()).collect();
    let near = did_you_mean(name, known.iter().copied());
    Usage(format!("{what}: variant {variant} has the parameters {}{near}", known.join(", ")))
}

/// Source of the bounds and its reason, in words, for followers of these names and their driver, if known. It names no option: results keep
/// it, whatever front end made them.
pub fn origin<'a>(given: &[String], followers: impl IntoIterator<Item = (&'a str, Option<&'a str>)>) -> String {
    let told = |given: &String| match given.parse::<BoundSet>() {
        Ok(set) => format!("{}: {}", set.into_str(), set.source()),
        Err(_) => format!("{given}, because of what it names"),
    };
    let acc = format!("{}: {}", BoundSet::Acc.into_str(), BoundSet::Acc.source());
    if !given.is_empty() {
        let set = given.iter().any(|given| given.parse::<BoundSet>().is_ok());
        let table = (!set).then_some(acc);
        return format!("{}, as given", table.into_iter().chain(given.iter().map(told)).collect::<Vec<_>>().join("; "));
    }
    let followers: Vec<(&str, Option<&str>)> = followers.into_iter().collect();
    let unknown = |(name, driver): &&(&str, Option<&str>)| driver.is_none() && Vehicle::called(name).is_none();
    match followers.iter().find(unknown) {
        None if followers.iter().any(|(_, driver)| driver.is_some_and(is_human)) => {
            format!("{acc}, although the file says that a human drives; the set human is for human drivers")
        }
        None if followers.iter().any(|(_, driver)| driver.is_some_and(is_controller)) => {
            format!("{acc}, because the file says who drives")
        }
        None if followers.iter().any(|(_, driver)| driver.is_some()) => {
            format!(
                "{acc}, because the file names drivers, but not whether they are human; the set human is for human drivers"
            )
        }
        None => format!("{acc}, because the follower is known as a car with adaptive cruise control"),
        Some(_) => format!("{acc}, because the driver is unknown; the set human is for human drivers"),
    }
}

/// True for what files call a controller; other words than these and those of a human are names.
pub fn is_controller(driver: &str) -> bool {
    ["ACC", "CACC", "automated"].iter().any(|word| driver.eq_ignore_ascii_case(word))
}

/// True for what files call a human driver.
pub fn is_human(driver: &str) -> bool {
    ["human", "manual"].iter().any(|word| driver.eq_ignore_ascii_case(word))
}

/// The bounds of a file for the parameters of a variant.
fn of_file(path: &Path, variant: &Variant) -> anyhow::Result<Overrides> {
    calibrate::read_bounds(path, variant).map_err(|error| match error {
        BoundsError::Impossible { name, expected, lower, upper } => {
            let place = place(path, name);
            let message = if lower > upper {
                format!("{place}: {name}: the lower bound {lower} is above the upper bound {upper}; swap them")
            } else {
                format!("{place}: {name}: expected {expected} as both bounds, found [{lower}, {upper}]")
            };
            Usage(message).into()
        }
        other => other.into(),
    })
}

/// `FILE:LINE` of an entry; the file alone if the entry has no line of its own.
fn place(path: &Path, name: &str) -> String {
    let shown = path.display();
    let text = crate::text::bounded::read_to_string(path, crate::text::bounded::TEXT_MAX).unwrap_or_default();
    let is_entry =
        |line: &str| line.split_once('=').is_some_and(|(key, _)| key.trim().trim_matches(['"', '\'']) == name);
    let line = text.lines().position(is_entry);
    line.map_or_else(|| shown.to_string(), |line| format!("{shown}:{}", line + 1))
}
