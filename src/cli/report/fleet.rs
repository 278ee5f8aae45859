//! The page of a fleet, from its files.

use super::super::folder::parsed;
use super::charts::columns;
use crate::report::fleet::{Fit, FleetFile, Shown, page as write};
use crate::report::html::MadeBy;
use crate::result::read_bounded;
use crate::text::bounded::Lines;
use crate::trajectory::is_nameless;
use anyhow::Context;
use std::collections::HashMap;
use std::path::Path;

/// The rows of the table of parameters.
pub fn rows(path: &Path, file: &FleetFile) -> anyhow::Result<Vec<Shown>> {
    let place = || format!("{}: cannot read the table", path.display());
    let mut reader = csv::Reader::from_reader(Lines::of_table(path).with_context(place)?);
    let names: HashMap<String, usize> =
        reader.headers().with_context(place)?.iter().enumerate().map(|(k, name)| (name.to_owned(), k)).collect();
    let (mut rows, mut files) = (Vec::new(), Vec::new());
    for row in reader.records() {
        let row = row.with_context(place)?;
        let cell = |name: &str| names.get(name).and_then(|&k| row.get(k)).unwrap_or_default();
        let number = |name: &str| cell(name).parse().unwrap_or(f64::NAN);
        let ends = |name: &str| {
            let end = |side: &str| cell(&format!("{name}_{side}")).parse().ok();
            Some([end("low")?, end("high")?])
        };
        let (model, gof) = (cell("model").to_owned(), cell("gof").to_owned());
        let own = file.overview.iter().find(|one| one.model == model && one.gof == gof);
        let parameters = own.into_iter().flat_map(|one| &one.parameters);
        let mut label = format!("{} {}", cell("file"), cell("trajectory")).trim_end().to_owned();
        if cell("trajectory").is_empty() {
            label += &format!(", follower {}", cell("follower"));
        }
        let name = match (cell("trajectory"), cell("name")) {
            ("", name) if is_nameless(name) => String::new(),
            ("", name) => name.to_owned(),
            (id, _) => id.to_owned(),
        };
        files.push(cell("file").to_owned());
        rows.push(Shown {
            name,
            pair: number("pair") as usize,
            label,
            values: parameters.clone().map(|parameter| number(&parameter.column)).collect(),
            ends: parameters.map(|parameter| ends(&parameter.column)).collect(),
            score: number("score"),
            findings: cell("findings").to_owned(),
            step_s: number("duration_s") / (number("samples") - 1.0),
            model,
            gof,
        });
    }
    name_by_files(&mut rows, &files);
    Ok(rows)
}

/// Names those without a name by their file, or by their number if several files have the same name.
fn name_by_files(rows: &mut [Shown], files: &[String]) {
    let stems: Vec<&str> = files
        .iter()
        .map(|file| Path::new(file).file_stem().and_then(|stem| stem.to_str()).unwrap_or_default())
        .collect();
    let mut pairs: HashMap<&str, Option<usize>> = HashMap::new();
    for (row, stem) in rows.iter().zip(&stems).filter(|(row, _)| row.name.is_empty()) {
        let only = pairs.entry(stem).or_insert(Some(row.pair));
        *only = only.filter(|pair| *pair == row.pair);
    }
    for (row, stem) in rows.iter_mut().zip(&stems).filter(|(row, _)| row.name.is_empty()) {
        row.name = match pairs[stem] {
            Some(_) if !stem.is_empty() => (*stem).to_owned(),
            _ => format!("pair {}", row.pair),
        };
    }
}

pub fn page(folder: &Path, made: Option<&MadeBy>) -> anyhow::Result<String> {
    let path = folder.join("fleet.json");
    let text = read_bounded(&path)?;
    let file: FleetFile = parsed(&text, &path, "a fleet")?;
    let shown = rows(&folder.join("parameters.csv"), &file)?;
    let signals = columns(&folder.join("fits.csv"))?;
    let column = |name: &str| signals.get(name).map_or(&[][..], Vec::as_slice);
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
    Ok(write(&file, &shown, &fits, &text, made))
}
