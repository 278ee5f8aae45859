//! The rows as a table, and their summary.

use super::{Comparison, Drive, HeldScore, ModelRank, Pair, Row, Rule, SCHEMA_VERSION, Settings};
use crate::catalog::Variant;
use crate::statistics::quantile;
use crate::study::merge::column_clash;
use crate::study::outcome::Behind;
use crate::study::table::Table;
use crate::symbols::Symbol;

/// Suffixes of the name of a parameter in the columns of its interval.
const ENDS: [&str; 2] = ["low", "high"];

/// The columns of the parameters of a model.
fn columns_of(model: &Variant) -> Vec<String> {
    model.parameters().into_iter().map(Symbol::column).collect()
}

/// Why the models cannot share a table: two parameters would be one column, or one would have the name of a fixed column. `None` if they
/// can.
pub fn clash(settings: &Settings) -> Option<String> {
    let alone = Settings { models: Vec::new(), ..settings.clone() };
    let of_rule = |rule| table(&[], &alone, &[], &Comparison { rule, scores: Vec::new(), ranks: Vec::new() });
    let fixed = [Rule::HeldBack, Rule::Expected].map(of_rule);
    let taken: Vec<String> = fixed.into_iter().flat_map(|table| table.columns).map(|column| column.name).collect();
    let ends = if settings.intervals { &ENDS[..] } else { &[] };
    let mut columns: Vec<(Symbol, String)> = Vec::new();
    for symbol in settings.models.iter().flat_map(|model| model.variant.parameters()) {
        let name = symbol.column();
        columns.push((symbol, name.clone()));
        columns.extend(ends.iter().map(|end| (symbol, format!("{name}_{end}"))));
    }
    column_clash(&taken, &columns)
}

/// One row per pair, model and measure; a column per parameter of any of the models, with its unit in its name.
pub fn table(pairs: &[Pair], settings: &Settings, rows: &[Row], comparison: &Comparison) -> Table {
    let of = |row: &Row| &pairs[row.place.pair];
    let drive = |row: &Row| of(row).drive.as_ref().ok();
    let whole = |n: usize| i64::try_from(n).ok();
    let mut table = Table::default();
    table.integer("schema_version", rows.iter().map(|_| Some(i64::from(SCHEMA_VERSION))));
    table.integer("pair", rows.iter().map(|row| whole(row.place.pair + 1)));
    table.text("file", rows.iter().map(|row| Some(of(row).file.as_str())));
    table.text("trajectory", rows.iter().map(|row| of(row).trajectory.as_deref()));
    table.integer("follower", rows.iter().map(|row| whole(of(row).follower)));
    table.text("name", rows.iter().map(|row| Some(of(row).name.as_str())));
    table.integer("samples", rows.iter().map(|row| whole(drive(row)?.trajectory.len())));
    table.number("duration_s", rows.iter().map(|row| Some(duration(drive(row)?))));
    let models: Vec<String> = settings.models.iter().map(|model| model.variant.name()).collect();
    let measures: Vec<String> = settings.measures.iter().map(ToString::to_string).collect();
    table.text("model", rows.iter().map(|row| Some(models[row.place.model].as_str())));
    table.text("gof", rows.iter().map(|row| Some(measures[row.place.measure].as_str())));
    let found = || rows.iter().map(|row| row.found.as_ref().ok());
    table.number("score", found().map(|found| Some(found?.score)));
    for (k, name) in ["rmse_s_m", "rmse_v_mps", "rmse_a_mps2"].into_iter().enumerate() {
        table.number(name, found().map(|found| found?.rmse[k]));
    }
    for (k, name) in ["nrmse_s", "nrmse_v", "nrmse_a"].into_iter().enumerate() {
        table.number(name, found().map(|found| found?.nrmse[k]));
    }
    compared(&mut table, comparison);
    let own: Vec<Vec<String>> = settings.models.iter().map(|model| columns_of(&model.variant)).collect();
    let mut names: Vec<&String> = Vec::new();
    for name in own.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let at = |row: &Row, name: &str| own[row.place.model].iter().position(|own| own == name);
    for name in names {
        let value = |row: &Row| Some(row.found.as_ref().ok()?.parameters[at(row, name)?]);
        table.number(name, rows.iter().map(value));
        if settings.intervals {
            for (end, side) in ENDS.into_iter().enumerate() {
                let value = |row: &Row| Some(row.found.as_ref().ok()?.intervals.as_ref()?[at(row, name)?]?[end]);
                table.number(&format!("{name}_{side}"), rows.iter().map(value));
            }
        }
    }
    let at_bound: Vec<Option<String>> =
        found().map(|found| found.map(|found| found.at_bound.join(" ")).filter(|names| !names.is_empty())).collect();
    table.text("at_bound", at_bound.iter().map(Option::as_deref));
    let doubts: Vec<String> = rows.iter().map(|row| of(row).doubts(&[settings.measures[row.place.measure]])).collect();
    table.text("findings", doubts.iter().map(|kinds| Some(kinds.as_str()).filter(|kinds| !kinds.is_empty())));
    table.integer("evaluations", found().map(|found| i64::try_from(found?.evaluations).ok()));
    table.text("stop", found().map(|found| Some(found?.stop.as_str())));
    let status = |row: &Row| match (&row.found, &of(row).drive) {
        (Ok(_), _) => "ok",
        (Err(_), Ok(_)) => "infeasible",
        (Err(_), Err(_)) if of(row).is_short => "short",
        (Err(_), Err(_)) => "unusable",
    };
    table.text("status", rows.iter().map(|row| Some(status(row))));
    table.text("reason", rows.iter().map(|row| row.found.as_ref().err().map(String::as_str)));
    table
}

/// The columns of the comparison of models.
fn compared(table: &mut Table, comparison: &Comparison) {
    let scores = || comparison.scores.iter().map(|score| score.as_ref());
    let finite = |score: &HeldScore| Some(score.score).filter(|score| score.is_finite());
    match comparison.rule {
        Rule::HeldBack => {
            table.number("heldout_score", scores().map(|score| finite(score?)));
            for (k, name) in ["heldout_rmse_s_m", "heldout_rmse_v_mps", "heldout_rmse_a_mps2"].into_iter().enumerate() {
                table.number(name, scores().map(|score| score?.rmse[k]));
            }
            for (k, name) in ["heldout_nrmse_s", "heldout_nrmse_v", "heldout_nrmse_a"].into_iter().enumerate() {
                table.number(name, scores().map(|score| score?.nrmse[k]));
            }
        }
        Rule::Expected => table.number("expected_score", scores().map(|score| finite(score?))),
        Rule::None => {}
    }
}

fn duration(drive: &Drive) -> f64 {
    (drive.trajectory.len() - 1) as f64 * drive.trajectory.dt
}

/// Quantiles of some numbers.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Spread {
    pub median: f64,
    /// A quarter is below the first, and above the second.
    pub middle_half: [f64; 2],
    /// A twentieth is below the first, and above the second.
    pub nine_tenths: [f64; 2],
}

impl Spread {
    /// The median of no values is missing.
    pub fn of(values: &[f64]) -> Option<Spread> {
        let at = |q| quantile(values, q);
        Some(Spread { median: at(0.5)?, middle_half: [at(0.25)?, at(0.75)?], nine_tenths: [at(0.05)?, at(0.95)?] })
    }
}

/// Summary of the rows of a model and measure.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Overview {
    pub model: String,
    /// The measure.
    pub gof: String,
    /// Pairs with a result.
    pub calibrated: usize,
    /// Number of those with doubtful data.
    #[serde(default)]
    pub doubtful: usize,
    /// Pairs on which this model leads all others of the measure by more than the noise.
    pub best: usize,
    /// The scores on the drives that were calibrated on.
    pub score: Option<Spread>,
    /// The scores of the comparison.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared: Option<Spread>,
    /// Distance of the mean of these scores from the lowest one of all models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub behind: Option<Behind>,
    /// Pairs on which a simulation of held-back data ends early.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub failed: usize,
    /// True for the model with the fewest searched parameters of those that cannot be distinguished from the best one.
    #[serde(default)]
    pub chosen: bool,
    /// The parameters, in the order of the model.
    pub parameters: Vec<ParameterOverview>,
}

/// Summary of a parameter over all pairs.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ParameterOverview {
    pub name: String,
    pub unit: String,
    pub column: String,
    /// Its values.
    pub spread: Option<Spread>,
    /// The same without pairs of doubtful data, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound: Option<Spread>,
    /// Share of the pairs on which it is on a bound.
    pub at_bound: f64,
    /// Share of the pairs whose drive determines it; `None` without intervals.
    pub determined: Option<f64>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// One entry per model and measure, measures first.
pub fn overview(pairs: &[Pair], settings: &Settings, rows: &[Row], comparison: &Comparison) -> Vec<Overview> {
    let mut all = Vec::new();
    for (k, measure) in settings.measures.iter().enumerate() {
        let sound: Vec<bool> = pairs.iter().map(|pair| pair.doubts(&[*measure]).is_empty()).collect();
        for (m, model) in settings.models.iter().enumerate() {
            let own: Vec<_> = rows
                .iter()
                .filter(|row| row.place.model == m && row.place.measure == k)
                .filter_map(|row| Some((row.found.as_ref().ok()?, sound[row.place.pair])))
                .collect();
            let ModelRank { best, failed, behind, chosen } = comparison.ranks[all.len()];
            let scored =
                rows.iter().zip(&comparison.scores).filter(|(row, _)| row.place.model == m && row.place.measure == k);
            let compared: Vec<f64> =
                scored.filter_map(|(_, score)| Some(score.as_ref()?.score).filter(|score| score.is_finite())).collect();
            let (own, is_sound): (Vec<&super::Found>, Vec<bool>) = own.into_iter().unzip();
            let doubtful = is_sound.iter().filter(|sound| !**sound).count();
            let share = |count: usize| count as f64 / own.len().max(1) as f64;
            let parameter = |(i, symbol): (usize, &Symbol)| ParameterOverview {
                name: symbol.name().to_owned(),
                unit: symbol.unit().to_owned(),
                column: symbol.column(),
                spread: Spread::of(&own.iter().map(|found| found.parameters[i]).collect::<Vec<_>>()),
                sound: (doubtful > 0).then_some(()).and_then(|()| {
                    let sound = own.iter().zip(&is_sound).filter(|(_, sound)| **sound);
                    Spread::of(&sound.map(|(found, _)| found.parameters[i]).collect::<Vec<_>>())
                }),
                at_bound: share(
                    own.iter().filter(|found| found.at_bound.iter().any(|name| name == symbol.name())).count(),
                ),
                // A fixed parameter needs no determination.
                determined: (settings.intervals && own.iter().any(|found| found.parameters[i] != own[0].parameters[i]))
                    .then(|| {
                        let known =
                            |found: &&&super::Found| found.intervals.as_ref().is_some_and(|all| all[i].is_some());
                        share(own.iter().filter(known).count())
                    }),
            };
            all.push(Overview {
                model: model.variant.name(),
                gof: measure.to_string(),
                calibrated: own.len(),
                doubtful,
                best,
                score: Spread::of(&own.iter().map(|found| found.score).collect::<Vec<_>>()),
                compared: Spread::of(&compared),
                behind,
                failed,
                chosen,
                parameters: model.variant.parameters().iter().enumerate().map(parameter).collect(),
            });
        }
    }
    all
}
