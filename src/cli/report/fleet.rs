//! The page of a fleet, from its files.

use crate::report::fleet::{Fit, FleetFile, Shown, page as write};
use crate::result::read_bounded;
use crate::trajectory::is_nameless;
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::Path;

/// The columns of a table by name.
type Columns = BTreeMap<String, Vec<String>>;

fn columns(path: &Path) -> anyhow::Result<Columns> {
    let place = || format!("{}: cannot read the table", path.display());
    let mut reader = csv::Reader::from_path(path).with_context(place)?;
    let names: Vec<String> = reader.headers().with_context(place)?.iter().map(str::to_owned).collect();
    let mut columns: Vec<Vec<String>> = vec![Vec::new(); names.len()];
    for row in reader.records() {
        for (column, field) in columns.iter_mut().zip(row.with_context(place)?.iter()) {
            column.push(field.to_owned());
        }
    }
    Ok(names.into_iter().zip(columns).collect())
}

pub fn page(folder: &Path) -> anyhow::Result<String> {
    let path = folder.join("fleet.json");
    let text = read_bounded(&path)?;
    let file: FleetFile = serde_json::from_str(&text)
        .with_context(|| format!("{}: expected a fleet of this version of leadlag", path.display()))?;
    let table = columns(&folder.join("parameters.csv"))?;
    let rows = table.get("pair").map_or(0, Vec::len);
    let cell = |name: &str, row: usize| table.get(name).map_or("", |column| column[row].as_str());
    let number = |name: &str, row: usize| cell(name, row).parse().unwrap_or(f64::NAN);
    let shown = |row: usize| {
        let (model, gof) = (cell("model", row).to_owned(), cell("gof", row).to_owned());
        let own = file.overview.iter().find(|one| one.model == model && one.gof == gof);
        let parameters = own.into_iter().flat_map(|one| &one.parameters);
        let mut label = format!("{} {}", cell("file", row), cell("trajectory", row)).trim_end().to_owned();
        if cell("trajectory", row).is_empty() {
            label += &format!(", follower {}", cell("follower", row));
        }
        let name = match (cell("trajectory", row), cell("name", row)) {
            ("", name) if is_nameless(name) => format!("pair {}", cell("pair", row)),
            ("", name) => name.to_owned(),
            (id, _) => id.to_owned(),
        };
        Shown {
            name,
            pair: number("pair", row) as usize,
            label,
            values: parameters.map(|parameter| number(&parameter.column, row)).collect(),
            score: number("score", row),
            model,
            gof,
        }
    };
    let shown: Vec<Shown> = (0..rows).map(shown).collect();
    let signals = columns(&folder.join("fits.csv"))?;
    let column = |name: &str| -> Vec<f64> {
        let column = signals.get(name).map_or(&[][..], Vec::as_slice);
        column.iter().map(|field| field.parse().unwrap_or(f64::NAN)).collect()
    };
    let pairs = column("pair");
    let names = ["time_s", "spacing_m", "sim_spacing_m", "speed_mps", "sim_speed_mps"];
    let all = names.map(column);
    let mut fits: Vec<Fit> = Vec::new();
    for (row, pair) in pairs.iter().enumerate() {
        if fits.last().is_none_or(|fit| fit.pair != *pair as usize) {
            fits.push(Fit { pair: *pair as usize, signals: Default::default() });
        }
        if let Some(fit) = fits.last_mut() {
            for (own, all) in fit.signals.iter_mut().zip(&all) {
                own.push(all.get(row).copied().unwrap_or(f64::NAN));
            }
        }
    }
    Ok(write(&file, &shown, &fits, &text))
}
