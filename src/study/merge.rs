//! From parts to tables: a pure function. The order is that of the plan, whatever the order of the work was.

use super::folder::StudyFile;
use super::inventory::Inventory;
use super::part::{CalibrationRow, Part, RunRow, ValidationRow};
use super::table::Table;
use super::task::without_extensions;
use super::{SCHEMA_VERSION, Task};
use crate::catalog::Variant;
use crate::extension::Extension;
use crate::score::Measures;
use crate::symbols::Symbol;
use std::collections::HashSet;

/// The tables of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// One row per calibration.
    pub calibrations: Table,
    /// One row per validation run of the winner among the replicates.
    pub validations: Table,
    /// One row per task without a part.
    pub missing: Table,
}

/// Names of the measures as columns, with their units, if any.
pub fn measure_columns() -> Vec<String> {
    let unit = |name: &str| match name {
        "rmse_s" => "_m",
        "rmse_v" => "_mps",
        "rmse_a" => "_mps2",
        _ => "",
    };
    Measures::NAMES.iter().map(|name| format!("{name}{}", unit(name))).collect()
}

/// The reason why parameters cannot have columns of these names beside those that are `taken`, if any: two would be the same column. Parameters
/// with the same name and unit share a column.
pub(crate) fn column_clash(taken: &[String], columns: &[(Symbol, String)]) -> Option<String> {
    let shown = |symbol: Symbol| match symbol {
        Symbol::Extension(row) => format!("{} [{}] of {}", row.name, row.unit, row.extension),
        built_in => format!("{} [{}]", built_in.name(), built_in.unit()),
    };
    columns.iter().enumerate().find_map(|(k, (symbol, column))| {
        if let (true, Symbol::Extension(row)) = (taken.contains(column), symbol) {
            return Some(format!(
                "a parameter of {} would be the column {column}, which the tables have already; give it another name",
                row.extension
            ));
        }
        let same = |other: &&(Symbol, String)| other.1 == *column && other.0.name() != symbol.name();
        let (other, _) = columns[..k].iter().find(same)?;
        let (one, other) = (shown(*symbol), shown(*other));
        Some(format!("{one} and {other} would both be the column {column}; give one of them another name"))
    })
}

/// The tables of the present parts.
pub fn merge(study: &StudyFile, tasks: &[Task], inventory: &Inventory) -> Merged {
    let parts: Vec<&Part> = inventory.parts.iter().flatten().collect();
    let winners: HashSet<&str> = inventory.winners().iter().map(|part| part.id.as_str()).collect();
    let laws = study.read_laws();
    let calibrations = calibrations(&parts, &winners, &study.own_parameters(), &laws);
    let won = parts.iter().filter(|part| winners.contains(&part.id.as_str()));
    let rows: Vec<(&Part, &ValidationRow)> =
        won.flat_map(|part| part.validations.iter().map(move |row| (*part, row))).collect();
    let missing: Vec<&Task> = inventory.missing.iter().map(|&i| &tasks[i]).collect();
    Merged { calibrations, validations: validations(&rows, &laws), missing: task_list(&missing) }
}

fn task_list(tasks: &[&Task]) -> Table {
    let mut table = Table::default();
    table.integer("schema_version", tasks.iter().map(|_| Some(i64::from(SCHEMA_VERSION))));
    table.text("task_id", tasks.iter().map(|task| Some(task.id.as_str())));
    table.text("platoon", tasks.iter().map(|task| Some(task.platoon.as_str())));
    table.integer("follower_position", tasks.iter().map(|task| whole(task.follower)));
    table.integer("model_id", tasks.iter().map(|task| Some(i64::from(task.model_id))));
    table.text("variant", tasks.iter().map(|task| Some(task.variant.as_str())));
    table.text("gof", tasks.iter().map(|task| Some(task.gof.as_str())));
    table.integer("replicate", tasks.iter().map(|task| i64::try_from(task.replicate).ok()));
    table
}

/// Names of the columns that a table of calibrations has with any extension.
pub(super) fn calibration_columns() -> impl Iterator<Item = String> {
    calibrations(&[], &HashSet::new(), &[], &[]).columns.into_iter().map(|column| column.name)
}

fn calibrations(parts: &[&Part], winners: &HashSet<&str>, further: &[Symbol], laws: &[&'static Extension]) -> Table {
    let rows: Vec<&CalibrationRow> = parts.iter().map(|part| &part.calibration).collect();
    let mut table = Table::default();
    table.integer("schema_version", rows.iter().map(|_| Some(i64::from(SCHEMA_VERSION))));
    table.text("task_id", parts.iter().map(|part| Some(part.id.as_str())));
    table.text("program", rows.iter().map(|r| Some(r.program.as_str())));
    table.text("platoon", rows.iter().map(|r| Some(r.platoon.as_str())));
    table.integer("follower_position", rows.iter().map(|r| whole(r.follower)));
    table.text("vehicle", rows.iter().map(|r| Some(r.vehicle.as_str())));
    table.text("data_sha256", rows.iter().map(|r| Some(r.data_sha256.as_str())));
    table.integer("samples", rows.iter().map(|r| whole(r.samples)));
    table.number("dt_s", rows.iter().map(|r| Some(r.dt_s)));
    variant_columns(&mut table, &rows.iter().map(|r| (r.model_id, r.variant.as_str())).collect::<Vec<_>>(), laws);
    table.text("gof", rows.iter().map(|r| Some(r.gof.as_str())));
    table.text("convention", rows.iter().map(|r| Some(r.convention.as_str())));
    table.text("optimizer", rows.iter().map(|r| Some(r.optimizer.as_str())));
    table.integer("seed", rows.iter().map(|r| i64::try_from(r.seed).ok()));
    table.integer("replicate", rows.iter().map(|r| i64::try_from(r.replicate).ok()));
    table.text("evaluator", rows.iter().map(|r| Some(r.evaluator.as_str())));
    table.text("precision", rows.iter().map(|r| Some(r.precision.as_str())));
    table.text("adapter", rows.iter().map(|r| r.adapter.as_deref()));
    table.flag("success", rows.iter().map(|r| Some(r.success)));
    table.text("reason", rows.iter().map(|r| r.reason.as_deref()));
    table.flag("is_best", parts.iter().map(|part| Some(winners.contains(part.id.as_str()))));
    table.number("score", rows.iter().map(|r| r.score));
    table.integer("evaluations", rows.iter().map(|r| i64::try_from(r.evaluations).ok()));
    table.text("stop", rows.iter().map(|r| r.stop.as_deref()));
    let runs: Vec<Option<&RunRow>> = rows.iter().map(|r| r.run.as_ref()).collect();
    run_columns(&mut table, &runs);
    for &symbol in Symbol::ALL.iter().chain(further) {
        table.number(&symbol.column(), rows.iter().map(|r| r.parameters.get(symbol.name()).copied()));
    }
    let at_bound: Vec<String> = rows.iter().map(|r| r.at_bound.join(" ")).collect();
    table.text("at_bound", at_bound.iter().map(|names| (!names.is_empty()).then_some(names.as_str())));
    table
}

fn validations(rows: &[(&Part, &ValidationRow)], laws: &[&'static Extension]) -> Table {
    let own = || rows.iter().map(|(part, _)| &part.calibration);
    let on = || rows.iter().map(|(_, row)| *row);
    let mut table = Table::default();
    table.integer("schema_version", rows.iter().map(|_| Some(i64::from(SCHEMA_VERSION))));
    table.text("task_id", rows.iter().map(|(part, _)| Some(part.id.as_str())));
    table.text("platoon", own().map(|r| Some(r.platoon.as_str())));
    table.integer("follower_position", own().map(|r| whole(r.follower)));
    table.text("vehicle", own().map(|r| Some(r.vehicle.as_str())));
    variant_columns(&mut table, &own().map(|r| (r.model_id, r.variant.as_str())).collect::<Vec<_>>(), laws);
    table.text("gof", own().map(|r| Some(r.gof.as_str())));
    table.integer("replicate", own().map(|r| i64::try_from(r.replicate).ok()));
    table.text("validation_platoon", on().map(|r| Some(r.platoon.as_str())));
    table.integer("validation_follower_position", on().map(|r| whole(r.follower)));
    table.text("validation_data_sha256", on().map(|r| Some(r.data_sha256.as_str())));
    table.integer("validation_samples", on().map(|r| whole(r.samples)));
    table.flag("success", on().map(|r| Some(r.run.fail_reason.is_none())));
    table.flag("collision", on().map(|r| Some(r.run.fail_reason.as_deref() == Some("spacing"))));
    run_columns(&mut table, &on().map(|r| Some(&r.run)).collect::<Vec<_>>());
    table
}

/// The variant, and the parts it is made of.
fn variant_columns(table: &mut Table, rows: &[(u32, &str)], laws: &[&'static Extension]) {
    let variants: Vec<Option<Variant>> = rows.iter().map(|(_, name)| without_extensions(name, laws)).collect();
    let each = || variants.iter().map(Option::as_ref);
    table.integer("model_id", rows.iter().map(|(id, _)| Some(i64::from(*id))));
    table.text("variant", rows.iter().map(|(_, name)| Some(*name)));
    table.text("base", each().map(|v| v.map(|v| v.base.name)));
    table.flag("delay", each().map(|v| v.map(|v| v.delay)));
    table.text("dynamics", each().map(|v| v.map(|v| v.dynamics.name())));
    table.text("constraint", each().map(|v| v.map(|v| v.constraint.name())));
}

/// Outcome of a run.
fn run_columns(table: &mut Table, runs: &[Option<&RunRow>]) {
    let each = || runs.iter().copied();
    table.text("fail_reason", each().map(|run| run?.fail_reason.as_deref()));
    table.integer("fail_step", each().map(|run| run?.fail_step.and_then(whole)));
    table.number("fail_time_s", each().map(|run| run?.fail_time_s));
    table.integer("first_scored", each().map(|run| whole(run?.first_scored)));
    table.integer("n_cut_acc", each().map(|run| Some(i64::from(run?.n_cut_acc))));
    table.integer("n_cut_dec", each().map(|run| Some(i64::from(run?.n_cut_dec))));
    for (i, name) in measure_columns().iter().enumerate() {
        table.number(name, each().map(|run| run?.measures.get(i).copied().flatten()));
    }
}

fn whole(x: usize) -> Option<i64> {
    i64::try_from(x).ok()
}
