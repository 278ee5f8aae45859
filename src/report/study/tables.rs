//! The numbers of the report, each beside the paper's own.

use super::Material;
use crate::calibrate::coefficient_of_variation;
use crate::catalog::{BASES, Variant};
use crate::statistics::box_statistics;
use crate::study::outcome::claims::PAPERS_GOF;
use crate::study::paper::{Printed, VALIDATIONS};
use crate::study::table::Table;

/// The columns that identify the variant of a row.
fn variants(material: &Material) -> Table {
    let own = &material.own.variants;
    let mut table = Table::default();
    table.integer("model_id", own.iter().map(|v| Some(i64::from(v.id()))));
    let names: Vec<String> = own.iter().map(ToString::to_string).collect();
    table.text("variant", names.iter().map(|name| Some(name.as_str())));
    table
}

fn paper<'a>(
    material: &'a Material,
    of: impl Fn(&Printed) -> Option<f64> + 'a,
) -> impl Iterator<Item = Option<f64>> + 'a {
    material.own.variants.iter().map(move |v| material.paper.get(&v.id()).and_then(&of))
}

/// Table 4.
pub fn four(material: &Material) -> Table {
    let mut table = variants(material);
    table.number("median", material.four.iter().map(|row| row.median));
    table.number("paper_median", paper(material, |p| Some(p.median)));
    table.number("change_percent", material.four.iter().map(|row| row.change));
    table.number("paper_change_percent", paper(material, |p| p.change));
    table
}

/// Table 5.
pub fn five(material: &Material) -> Table {
    let mut table = variants(material);
    for (i, error) in ["rmse_s", "rmse_v", "rmse_a", "nrmse_sva"].into_iter().enumerate() {
        table.number(&format!("calibration_{error}_percent"), material.five.iter().map(|row| row.calibration[i]));
        table.number(&format!("paper_calibration_{error}_percent"), paper(material, move |p| p.calibration[i]));
    }
    for (i, error) in ["rmse_s", "rmse_v", "rmse_a", "nrmse_sva"].into_iter().enumerate() {
        table.number(&format!("validation_{error}_percent"), material.five.iter().map(|row| row.validation[i]));
        table.number(&format!("paper_validation_{error}_percent"), paper(material, move |p| p.validation[i]));
    }
    let whole = |of: fn(&crate::study::outcome::Table5Row) -> usize| {
        material.five.iter().map(move |row| i64::try_from(of(row)).ok())
    };
    table.integer("common_validation_runs", whole(|row| row.common));
    table.integer("collisions", whole(|row| row.collisions));
    table.integer("other_early_ends", whole(|row| row.other_ends));
    table.integer("validation_runs", whole(|row| row.runs));
    table.number("paper_collisions", paper(material, |p| Some(p.collisions)));
    table.number("paper_validation_runs", paper(material, |_| Some(VALIDATIONS)));
    table
}

/// Figure 4: one row per variant and trajectory.
pub fn variations(material: &Material) -> Table {
    let own = material.own;
    let cells: Vec<(usize, usize)> =
        (0..own.variants.len()).flat_map(|v| (0..own.drives.len()).map(move |d| (v, d))).collect();
    let names: Vec<String> = own.variants.iter().map(ToString::to_string).collect();
    let mut table = Table::default();
    table.text("base", cells.iter().map(|(v, _)| Some(own.variants[*v].base.name)));
    table.integer("model_id", cells.iter().map(|(v, _)| Some(i64::from(own.variants[*v].id()))));
    table.text("variant", cells.iter().map(|(v, _)| Some(names[*v].as_str())));
    table.text("platoon", cells.iter().map(|(_, d)| Some(own.drives[*d].platoon.as_str())));
    table.integer("follower_position", cells.iter().map(|(_, d)| i64::try_from(own.drives[*d].follower).ok()));
    table.integer("replicates", cells.iter().map(|(v, d)| i64::try_from(own.cells[*v][*d].scores.len()).ok()));
    let scores = |(v, d): &(usize, usize)| own.cells[*v][*d].scores.iter().copied();
    table.number("cv", cells.iter().map(|cell| coefficient_of_variation(scores(cell))));
    table
}

/// Figure 5: one row per trajectory.
pub fn trajectories(material: &Material) -> Table {
    let own = material.own;
    let mut table = Table::default();
    table.text("platoon", own.drives.iter().map(|d| Some(d.platoon.as_str())));
    table.integer("follower_position", own.drives.iter().map(|d| i64::try_from(d.follower).ok()));
    table.text("vehicle", own.drives.iter().map(|d| Some(d.vehicle.as_str())));
    let range = |i: usize| (0..own.drives.len()).map(move |d| own.range(d).map(|range| range[i]));
    table.number("score_min", range(0));
    let laws = own.bases().into_iter().filter(|base| !BASES.contains(base));
    for base in BASES.iter().copied().chain(laws) {
        let index = own.variants.iter().position(|v| v.name() == base.name);
        table.number(
            &format!("score_{}", base.name.replace('-', "_")),
            (0..own.drives.len()).map(|d| own.cells[index?][d].score),
        );
    }
    table.number("score_max", range(1));
    table
}

/// Figure 6: one row per variant.
pub fn boxes(material: &Material) -> Table {
    let boxes: Vec<_> = (0..material.own.variants.len()).map(|v| box_statistics(&material.own.normalized(v))).collect();
    let mut table = variants(material);
    for (i, name) in ["quartile_1", "median", "quartile_3"].into_iter().enumerate() {
        table.number(name, boxes.iter().map(|b| b.as_ref().map(|b| b.quartiles[i])));
    }
    table.number("paper_median", paper(material, |p| Some(p.median)));
    for (i, name) in ["whisker_low", "whisker_high"].into_iter().enumerate() {
        table.number(name, boxes.iter().map(|b| b.as_ref().map(|b| b.whiskers[i])));
    }
    table.number("mean", boxes.iter().map(|b| b.as_ref().map(|b| b.mean)));
    let outliers: Vec<String> = boxes
        .iter()
        .map(|b| b.iter().flat_map(|b| &b.outliers).map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" "))
        .collect();
    table.text("outliers", outliers.iter().map(|text| (!text.is_empty()).then_some(text.as_str())));
    table
}

/// Figure 7: one row per goodness of fit and variant.
pub fn collisions(material: &Material) -> Table {
    let all =
        material.all.iter().flat_map(|of| of.variants.iter().enumerate().map(move |(v, variant)| (of, v, variant)));
    let rows: Vec<(&str, &Variant, (usize, usize, usize))> =
        all.map(|(of, v, variant)| (of.gof.as_str(), variant, of.collisions(v))).collect();
    let counts = |of: fn((usize, usize, usize)) -> usize| rows.iter().map(move |row| i64::try_from(of(row.2)).ok());
    let mut table = Table::default();
    table.text("gof", rows.iter().map(|(gof, ..)| Some(*gof)));
    table.integer("model_id", rows.iter().map(|(_, variant, _)| Some(i64::from(variant.id()))));
    let names: Vec<String> = rows.iter().map(|(_, variant, _)| variant.name()).collect();
    table.text("variant", names.iter().map(|name| Some(name.as_str())));
    table.integer("collisions", counts(|(collisions, ..)| collisions));
    table.integer("other_early_ends", counts(|(_, other, _)| other));
    table.integer("validation_runs", counts(|(.., runs)| runs));
    let share = |(collisions, _, runs): (usize, usize, usize)| 100.0 * collisions as f64 / runs as f64;
    table.number("collision_percent", rows.iter().map(|(.., ends)| (ends.2 > 0).then(|| share(*ends))));
    // The paper prints numbers only for its own goodness of fit (Table 5); the other curves are in its figure.
    let printed = |(gof, variant, _): &(&str, &Variant, _)| {
        let row = material.paper.get(&variant.id()).filter(|_| *gof == PAPERS_GOF)?;
        Some(100.0 * row.collisions / VALIDATIONS)
    };
    table.number("paper_collision_percent", rows.iter().map(printed));
    table
}
