//! The parameters of one driver of a fleet, from its table.

use super::change::settle;
use super::folder::{FLEET, read};
use super::report::fleet::rows;
use crate::api::error::refuse;
use crate::catalog::Variant;
use crate::evaluator::Case;
use crate::extension::Extension;
use crate::report::fleet::{FleetFile, Shown};
use crate::result::ExtensionEntry;
use crate::simulate::CalibratedVariant;
use crate::symbols::{Parameters, Symbol};
use crate::text::shown::{NAMED, first};
use crate::text::spelling::did_you_mean;
use crate::wgsl::extension_named;
use anyhow::Context;
use std::path::{Path, PathBuf};

/// The table of parameters of a fleet.
pub const TABLE: &str = "parameters.csv";

/// The folder of a fleet, if the given result is one: the folder itself, its table or its `fleet.json`.
pub fn folder_of(given: &Path) -> Option<PathBuf> {
    let is_file = given.file_name().is_some_and(|name| name == FLEET || name == TABLE);
    let folder = if given.is_dir() { given } else { given.parent().filter(|_| is_file)? };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.join(FLEET).is_file().then(|| folder.to_owned())
}

/// The `fleet.json` of a folder.
pub fn file_of(folder: &Path) -> anyhow::Result<FleetFile> {
    settle(folder)?;
    read(&folder.join(FLEET), "a fleet")
}

/// The fleet of a folder, and its rows that have a result of the model that it has chosen.
fn chosen(folder: &Path) -> anyhow::Result<(FleetFile, Vec<Shown>)> {
    let (file, path) = (file_of(folder)?, folder.join(FLEET));
    let own = file.chosen().with_context(|| format!("{}: expected a model, found none", path.display()))?;
    let is_own = |row: &Shown| row.model == own.model && row.gof == own.gof && row.score.is_finite();
    let all = rows(&folder.join(TABLE), &file)?.into_iter().filter(is_own).collect();
    Ok((file, all))
}

/// The calibrations of all drivers, each with its row.
pub fn of_all(folder: &Path) -> anyhow::Result<Vec<(Shown, CalibratedVariant)>> {
    let (file, all) = chosen(folder)?;
    all.into_iter().map(|row| calibrated(folder, &file, &row).map(|variant| (row, variant))).collect()
}

/// The fleet, and the calibration of a driver: the one with this id, else the one named after this file, else the only one; with the model that the
/// fleet has chosen.
pub fn of_driver(folder: &Path, driver: Option<&str>, drive: &Path) -> anyhow::Result<(FleetFile, CalibratedVariant)> {
    let (file, all) = chosen(folder)?;
    let table = folder.join(TABLE);
    let shown = table.display();
    let stem = drive.file_stem().and_then(|stem| stem.to_str());
    let by_file = stem.filter(|stem| all.iter().filter(|row| row.name == *stem).count() == 1);
    let found: Vec<&Shown> = all.iter().filter(|row| driver.or(by_file).is_none_or(|id| row.name == id)).collect();
    let [row] = found.as_slice() else {
        let names: Vec<&str> = all.iter().map(|row| row.name.as_str()).collect();
        let near = driver.map_or(String::new(), |id| did_you_mean(id, names.iter().copied()));
        let listed = first(&names, NAMED);
        let asked = match (driver, found.len()) {
            (None, _) => "give the driver by --follower or --trajectory".to_owned(),
            (Some(id), 0) => format!("found no driver {id}"),
            (Some(id), n) => format!("found {n} drives of driver {id}; calibrate with one of them alone"),
        };
        refuse!("{shown}: expected one driver; {asked}; it has {listed}{near}");
    };
    let variant = calibrated(folder, &file, row)?;
    Ok((file, variant))
}

/// The variant of a row with its parameters.
fn calibrated(folder: &Path, file: &FleetFile, row: &Shown) -> anyhow::Result<CalibratedVariant> {
    let (path, table) = (folder.join(FLEET), folder.join(TABLE));
    let own = file.chosen().with_context(|| format!("{}: expected a model, found none", path.display()))?;
    let (variant, extension_delay_upper) = model(file, &own.model).with_context(|| path.display().to_string())?;
    let mut parameters = Parameters::NONE;
    for symbol in variant.parameters() {
        let place = own.parameters.iter().position(|parameter| parameter.name == symbol.name());
        let value = place.and_then(|place| row.values.get(place)).copied().filter(|value| value.is_finite());
        parameters.set(
            symbol,
            value.with_context(|| {
                format!("{}: {}: expected a number for {}, found none", table.display(), row.name, symbol.name())
            })?,
        );
    }
    let convention = file.convention.parse()?;
    let tau_p_upper = if variant.delay { upper(file, &own.model, Symbol::tau_p).unwrap_or(0.0) } else { 0.0 };
    Ok(CalibratedVariant { variant, convention, parameters, tau_p_upper, extension_delay_upper, history_s: None })
}

/// The upper bound of a parameter of a model.
fn upper(file: &FleetFile, model: &str, symbol: Symbol) -> Option<f64> {
    let given = file.bounds.get(model).and_then(|bounds| bounds.get(symbol.name())).copied();
    given.or_else(|| Case::bounds(symbol, None, file.convention.parse().ok()?)).map(|[_, upper]| upper)
}

/// A model of a fleet by its name, and the upper bound of the delay of its extensions \[s\].
pub fn model(file: &FleetFile, name: &str) -> anyhow::Result<(Variant, Option<f64>)> {
    let own = file.own.iter().map(ExtensionEntry::read).collect::<Result<Vec<_>, _>>()?;
    let variant = variant(name, &own).with_context(|| {
        format!(
            "expected a built-in model or one whose texts are in the key own, found {name}: calibrate the fleet again"
        )
    })?;
    Ok((variant, variant.extensions.delay().and_then(|symbol| upper(file, name, symbol))))
}

/// A model by its name, followed by causes; `own` are not built in.
fn variant(name: &str, own: &[&'static Extension]) -> Option<Variant> {
    if let Ok(variant) = Variant::named(name, own).or_else(|_| name.parse()) {
        return Some(variant);
    }
    let (before, last) = name.rsplit_once('+')?;
    let cause = own.iter().copied().find(|own| own.name == last).or_else(|| extension_named(last))?;
    variant(before, own)?.with(cause).ok()
}
