//! `leadlag list`: variants, parameters, causes, vehicles, goodness-of-fit functions, conventions.

use super::output;
use crate::api::bounds::read_bounds;
use crate::api::error::refuse;
use crate::api::model::{known, model};
use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::Case;
use crate::extension::Extension;
use crate::report::text::wrapped;
use crate::score::{self, GoodnessOfFit, Measure, Measures, POOLED};
use crate::symbols::{Bounds, Symbol};
use crate::trajectory::import::ColumnMap;
use crate::vehicle::Vehicle;
use crate::wgsl::{laws, library};
use clap::ValueEnum;
use serde_json::{Value, json};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// What to list
    #[arg(value_enum, default_value_t = Topic::Variants)]
    topic: Topic,
    /// Only the parameters of this variant
    #[arg(long, value_name = "MODEL", value_parser = known)]
    model: Option<String>,
    /// Vehicle whose road loads are bounded: a built-in one or FILE#NAME
    #[arg(long, value_name = "NAME|FILE#NAME")]
    vehicle: Option<String>,
    /// Bounds to show: acc, human or a TOML file; may be given several times [default: acc]
    #[arg(long, value_name = "acc|human|FILE.toml")]
    bounds: Vec<String>,
    /// Convention of the bounds
    #[arg(long, default_value = "paper")]
    convention: Convention,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Topic {
    /// The ninety variants of Table 1
    Variants,
    /// Calibration parameters with units and bounds
    Parameters,
    /// Built-in laws: base models that are not in the paper
    Laws,
    /// Built-in causes: effects that the base models lack
    Causes,
    /// Built-in vehicles
    Vehicles,
    /// Goodness-of-fit functions
    Gof,
    /// The rows of the conventions
    Conventions,
    /// Column maps of well-known tables
    Columns,
}

/// Name, JSON and one line of text per entry.
type Entry = (Value, String);

pub fn run(args: &Args) -> anyhow::Result<()> {
    let narrowed = args.model.is_some() || args.vehicle.is_some() || !args.bounds.is_empty();
    if narrowed && !matches!(args.topic, Topic::Parameters) {
        refuse!("--model, --vehicle and --bounds need `leadlag list parameters`");
    }
    let entries = match args.topic {
        Topic::Variants => Variant::all().map(|v| variant(&v)).collect(),
        Topic::Parameters => parameters(args)?,
        Topic::Laws => laws().iter().map(|law| entry_of_law(law)).collect(),
        Topic::Causes => library().iter().filter_map(|e| cause(e)).collect(),
        Topic::Vehicles => Vehicle::built_in().iter().map(vehicle).collect(),
        Topic::Gof => gof(),
        Topic::Conventions => conventions(),
        Topic::Columns => columns()?,
    };
    if args.json {
        return output::print_json(&entries.into_iter().map(|(value, _)| value).collect::<Vec<_>>());
    }
    let mut text = String::new();
    for (_, line) in entries {
        text += &line;
        text.push('\n');
    }
    output::print(&text)
}

fn variant(v: &Variant) -> Entry {
    let names: Vec<&str> = v.parameters().iter().map(|s| s.name()).collect();
    let value = json!({"model_id": v.id(), "variant": v.name(), "base": v.base.paper, "parameters": names});
    (value, wrapped(0, 36, &format!("{:>2}  {:<32} {}", v.id(), v.name(), names.join(" "))).trim_end().to_owned())
}

fn parameters(args: &Args) -> anyhow::Result<Vec<Entry>> {
    let vehicle = args.vehicle.as_deref().map(|text| crate::vehicle::find_for(text, false)).transpose()?;
    let asked = args.model.as_deref().map(model).transpose()?;
    let symbols = asked.map_or_else(|| Symbol::ALL.to_vec(), |m| m.parameters());
    let mut own = Overrides::new();
    for variant in asked.map_or_else(|| Variant::all().collect(), |model| vec![model]) {
        own.extend(read_bounds(&args.bounds, &variant)?);
    }
    let entry = |symbol: Symbol| {
        let of_table = || Case::bounds(symbol, vehicle.as_ref(), args.convention);
        let bounds = own.get(symbol.name()).copied().or_else(of_table);
        let shown = bounds.map_or("by --vehicle".to_owned(), |[lower, upper]| format!("{lower:.5} .. {upper:.5}"));
        let value = json!({
            "name": symbol.name(), "paper": symbol.paper(), "unit": symbol.unit(), "bounds": bounds,
            "meaning": symbol.meaning(),
        });
        let (name, unit) = (symbol.name(), symbol.unit());
        (value, format!("{name:<10} {unit:<5} {shown:>24}  {}", symbol.meaning()))
    };
    Ok(symbols.into_iter().map(entry).collect())
}

fn entry_of_law(law: &Extension) -> Entry {
    let names: Vec<&str> = law.parameters.iter().map(|symbol| symbol.name()).collect();
    let value = json!({"name": law.name, "meaning": law.meaning, "parameters": names, "reference": law.reference});
    let mut text = format!("{}: {}\n", law.name, names.join(" "));
    text += &wrapped(4, 4, &law.meaning);
    if let Some(reference) = &law.reference {
        text += &wrapped(4, 4, reference);
    }
    (value, text.trim_end().to_owned())
}

fn cause(extension: &Extension) -> Option<Entry> {
    let cause = extension.cause.as_ref()?;
    let parameters = extension.parameters.iter().map(|p| {
        let Bounds::Fixed(lower, upper) = p.bounds() else { unreachable!("extensions have their own bounds") };
        let value = json!({
            "name": p.name(), "unit": p.unit(), "bounds": [lower, upper], "neutral": p.neutral(), "meaning": p.meaning(),
        });
        (value, format!("{} [{}] {lower} to {upper}", p.name(), p.unit()))
    });
    let (values, texts): (Vec<Value>, Vec<String>) = parameters.unzip();
    let value = json!({
        "name": extension.name, "meaning": extension.meaning, "in_short": extension.in_short(), "equation": cause.equation,
        "family": cause.family, "parameters": values,
        "looks_like": cause.looks_like, "confounded_with": cause.confounded_with, "search": cause.search.into_str(),
        "hides": cause.hides, "experiment": cause.experiment, "reference": extension.reference,
    });
    let mut text = format!("{}: {}\n", extension.name, texts.join(", "));
    text += &wrapped(4, 4, &extension.meaning);
    text += &wrapped(4, 4, &format!("looks like: {}", cause.looks_like));
    if !cause.confounded_with.is_empty() {
        text += &wrapped(4, 4, &format!("confused with: {}", cause.confounded_with.join(", ")));
    }
    if let Some(experiment) = &cause.experiment {
        text += &wrapped(4, 4, &format!("distinguished by: {experiment}"));
    }
    Some((value, text.trim_end().to_owned()))
}

fn vehicle(v: &Vehicle) -> Entry {
    let value = json!({
        "slug": v.slug, "name": v.name, "aliases": v.aliases, "mass_unladen_kg": v.m_0, "phi": v.phi_f,
        "length_m": v.length, "f_0_N": v.f_0, "f_1_N_per_kmh": v.f_1_printed, "f_2_N_per_kmh2": v.f_2_printed,
    });
    let length = v.length.map_or("?".to_owned(), |l| format!("{l:.3}"));
    (value, format!("{:<13} {:<26} {:>5} kg  phi {:.4}  {length} m", v.slug, v.name, v.m_0, v.phi_f))
}

fn columns() -> anyhow::Result<Vec<Entry>> {
    let entry = |(name, text): &(&str, &str)| {
        let map = ColumnMap::parse(text, name)?;
        let value = json!({"name": name, "title": map.title, "columns": map.column_names(), "text": text});
        let line = format!("{name:<10} {}: {}", map.title, map.column_names().join(", "));
        Ok((value, wrapped(0, 11, &line).trim_end().to_owned()))
    };
    ColumnMap::shipped().iter().map(entry).collect()
}

/// Every value of `--gof`, without weights. Those of the authors' table are columns of `evaluate`, too.
fn gof() -> Vec<Entry> {
    let all: Vec<(&Measure, &str, String)> = score::names().collect();
    let pooled = all.iter().map(|(measure, signals, name)| (*measure, *signals, format!("{POOLED}{name}")));
    let pooled = pooled.filter(|(.., name)| name.parse::<GoodnessOfFit>().is_ok());
    all.iter().cloned().chain(pooled).map(|(measure, signals, name)| entry(measure, signals, &name)).collect()
}

fn entry(measure: &Measure, signals: &str, flag: &str) -> Entry {
    let unit_of = |signal: char| match signal {
        's' => "m",
        'v' => "m/s",
        _ => "m/s²",
    };
    let units: Vec<&str> = if measure.has_unit { signals.chars().map(unit_of).collect() } else { vec!["-"] };
    let of = |signal: char| match signal {
        's' => "spacing",
        'v' => "speed",
        _ => "acceleration",
    };
    let mut meaning = format!("{} of {}", measure.meaning, signals.chars().map(of).collect::<Vec<_>>().join(", "));
    if signals.len() > 1 {
        meaning += ", summed";
    }
    if units.len() > 1 {
        meaning += " although the units differ: weights behind a colon balance them";
    }
    if flag.starts_with(POOLED) {
        meaning += "; sums over the samples of all drives of --joint, not the mean over the drives";
    }
    let (column, unit) = (flag.replace('-', "_"), units.join(" + "));
    let column = Measures::NAMES.iter().find(|name| **name == column);
    let shown = wrapped(0, 31, &format!("{flag:<15} {unit:<14} {meaning}"));
    (json!({"name": flag, "column": column, "unit": unit, "meaning": meaning}), shown.trim_end().to_owned())
}

fn conventions() -> Vec<Entry> {
    let entry = |row: &crate::convention::Row| {
        let ((paper, paper_is), (authors, authors_is)) = (row.paper, row.authors);
        let value = json!({
            "row": row.name, "meaning": row.meaning, "paper": paper, "paper_meaning": paper_is,
            "authors": authors, "authors_meaning": authors_is,
        });
        let mut text = wrapped(0, 2, &format!("{}: {}", row.name, row.meaning));
        text += &wrapped(2, 23, &format!("paper    {paper:<11} {paper_is}"));
        text += wrapped(2, 23, &format!("authors  {authors:<11} {authors_is}")).trim_end();
        (value, text)
    };
    Convention::ROWS.iter().map(entry).collect()
}
