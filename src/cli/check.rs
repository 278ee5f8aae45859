//! `leadlag check`: checks whether a file is a law or an extension, and shows its contents.

use super::output;
use crate::api::bounds::read_bounds;
use crate::api::error::refuse;
use crate::api::extension::find;
use crate::calibrate::Overrides;
use crate::catalog::{BASES, Variant};
use crate::convention::Radicand;
use crate::extension::Extension;
use crate::lanes::{Function, check_model};
use crate::report::text::wrapped;
use crate::symbols::{Bounds, Symbol};
use crate::wgsl::{Precision, Recipe, Source, member};
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag check my_cause.wgsl
  leadlag check --plot my_law.wgsl
  leadlag calibrate drive.csv --model l-cth --extend my_cause.wgsl --out fit")]
pub struct Args {
    /// Laws and extensions: one WGSL file each; built-in ones by name
    #[arg(required = true, value_name = "FILE.wgsl")]
    files: Vec<PathBuf>,
    /// Plot the commanded acceleration of a law over spacing, speed and speed difference, with parameters at mid-range
    #[arg(long, conflicts_with = "json")]
    plot: bool,
    /// Bounds to show, and to plot at the middle of: acc, human or a TOML file; may be given several times [default: acc]
    #[arg(long, value_name = "acc|human|FILE.toml")]
    bounds: Vec<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut entries = Vec::new();
    let mut text = String::new();
    for file in &args.files {
        let extension = find(&file.display().to_string())?;
        let bases = fitting_bases(extension)?;
        let bounds = read_bounds(&args.bounds, &with(extension, bases[0])?)?;
        if args.plot && !extension.is_law() {
            refuse!("--plot shows laws, and {} is an extension of other laws", extension.name);
        }
        extension.warnings.iter().for_each(|text| eprintln!("warning: {text}"));
        entries.push(json!({
            "name": extension.name,
            "kind": kind(extension),
            "meaning": extension.meaning,
            "parameters": extension.parameters.iter().map(|p| parameter(*p, &bounds)).collect::<Vec<_>>(),
            "stages": extension.stages.iter().map(|s| s.stage.into_str()).collect::<Vec<_>>(),
            "remembers": extension.state.iter().map(|(name, _)| name).collect::<Vec<_>>(),
            "reads": extension.reads,
            "bases": bases,
            "warnings": extension.warnings,
        }));
        text += &described(extension, &bases, &bounds)?;
    }
    if args.json {
        return output::print_json(&entries);
    }
    output::print(&text)?;
    if args.plot {
        for file in &args.files {
            let law = find(&file.display().to_string())?;
            plot(law, &args.bounds)?;
        }
    }
    Ok(())
}

/// Kind of a file, in a word.
fn kind(extension: &Extension) -> &'static str {
    match &extension.cause {
        _ if extension.is_law() => "law",
        Some(_) => "cause",
        None => "tool",
    }
}

/// Speeds \[m/s\] that have a chart each, and the leader's speed beside it in each line.
const SPEEDS_MPS: [f64; 3] = [5.0, 15.0, 25.0];
const DIFFERENCES_MPS: [(&str, f64); 3] = [("as fast", 0.0), ("3 m/s slower", -3.0), ("3 m/s faster", 3.0)];
/// Longest spacing of a chart \[m\].
const LONGEST_M: usize = 100;

/// Draws the accelerations that a law commands.
fn plot(law: &'static Extension, bounds: &[String]) -> anyhow::Result<()> {
    let variant = Variant::of_law(law);
    let overrides = read_bounds(bounds, &variant)?;
    let recipe = Recipe { variant, precision: Precision::Plain, radicand: Radicand::Measured, observed: true };
    let source = Source::model(&recipe);
    let function = Function::compile(&source, &crate::wgsl::check(&source)?, "law_at")?;
    let values: Vec<(Symbol, f64)> =
        variant.parameters().into_iter().map(|symbol| (symbol, middle(bounds_of(symbol, &overrides)))).collect();
    let at = |s: f64, v: f64, v_l: f64| {
        let input = |path: &String| match path.as_str() {
            "s" => s,
            "v" => v,
            "v_l" => v_l,
            path => values
                .iter()
                .find(|(symbol, _)| path.strip_prefix("p.") == Some(&member(*symbol)))
                .map_or(0.0, |(_, x)| *x),
        };
        function.call_f64(&function.inputs().iter().map(input).collect::<Vec<_>>())[0]
    };
    let spacings: Vec<f64> = (1..=LONGEST_M).map(|s| s as f64).collect();
    let charts = SPEEDS_MPS.map(|v| {
        let line = |(name, difference)| {
            let values = spacings.iter().map(|s| at(*s, v, v + difference).clamp(-SHOWN_MPS2, SHOWN_MPS2));
            (name, values.collect())
        };
        (format!("{v} m/s: acceleration [m/s2], the leader"), DIFFERENCES_MPS.map(line).to_vec())
    });
    let given: Vec<String> = values.iter().map(|(symbol, x)| format!("{} {x:.3}", symbol.name())).collect();
    let title = format!("{}, over the spacing, at {}", law.name, given.join(", "));
    super::plot::draw(&title, (&spacings, "m"), charts.into())
}

/// Accelerations are shown up to this limit, in both directions \[m/s²\]: larger ones would flatten the rest.
const SHOWN_MPS2: f64 = 6.0;

/// The middle of the bounds of a parameter; of wide ones the geometric one.
fn middle(bounds: Option<[f64; 2]>) -> f64 {
    let middle = |[lower, upper]: [f64; 2]| {
        if lower > 0.0 && upper > 10.0 * lower { (lower * upper).sqrt() } else { f64::midpoint(lower, upper) }
    };
    bounds.map_or(0.0, middle)
}

/// The base models that an extension fits, or the parts that a law can have; an error if it fits none.
fn fitting_bases(extension: &'static Extension) -> anyhow::Result<Vec<&'static str>> {
    let mut fitting = Vec::new();
    let mut first_problem = None;
    let names = if extension.is_law() { vec![LAW_PARTS] } else { BASES.iter().map(|base| base.name).collect() };
    for name in names {
        match fit(extension, name) {
            Ok(()) => fitting.push(name),
            Err(problem) => first_problem = first_problem.or(Some(problem)),
        }
    }
    match first_problem {
        Some(problem) if fitting.is_empty() => Err(problem),
        _ => Ok(fitting),
    }
}

/// Parts for every law.
const LAW_PARTS: &str = "+delay+linear+mfc";

/// Compiles an extension with a base model, or a law with parts.
fn fit(extension: &'static Extension, name: &str) -> anyhow::Result<()> {
    let variant = with(extension, name)?;
    let recipe = Recipe { variant, precision: Precision::Plain, radicand: Radicand::Measured, observed: true };
    Ok(check_model(&recipe)?)
}

/// A base model with an extension, or a law with parts.
fn with(extension: &'static Extension, name: &str) -> anyhow::Result<Variant> {
    Ok(match extension.is_law() {
        true => Variant::named(&format!("{}{name}", extension.name), &[extension])?,
        false => name.parse::<Variant>()?.with(extension)?,
    })
}

fn bounds_of(symbol: Symbol, overrides: &Overrides) -> Option<[f64; 2]> {
    match symbol.bounds() {
        _ if overrides.contains_key(symbol.name()) => overrides.get(symbol.name()).copied(),
        Bounds::Fixed(lower, upper) => Some([lower, upper]),
        Bounds::PerVehicle => None,
    }
}

fn parameter(symbol: Symbol, overrides: &Overrides) -> serde_json::Value {
    json!({
        "name": symbol.name(), "unit": symbol.unit(), "meaning": symbol.meaning(), "bounds": bounds_of(symbol, overrides),
        "neutral": symbol.neutral(),
    })
}

fn described(extension: &Extension, bases: &[&str], overrides: &Overrides) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    writeln!(text, "{}: valid, a {}", extension.name, kind(extension))?;
    if !extension.meaning.is_empty() {
        text += &wrapped(2, 2, &extension.meaning);
    }
    if let Some(reference) = extension.reference.as_ref().filter(|_| extension.is_law()) {
        text += &wrapped(2, 2, reference);
    }
    for symbol in &extension.parameters {
        let [lower, upper] = bounds_of(*symbol, overrides).unwrap_or_default();
        let neutral = symbol.neutral().map_or(String::new(), |x| format!(", neutral at {x}"));
        let (name, unit) = (symbol.name(), symbol.unit());
        text += &wrapped(2, 4, &format!("{name} [{unit}] {lower} to {upper}{neutral}: {}", symbol.meaning()));
    }
    let stages: Vec<&str> = extension.stages.iter().map(|s| s.stage.into_str()).collect();
    writeln!(text, "  acts at: {}", if stages.is_empty() { "the time loop".to_owned() } else { stages.join(", ") })?;
    if !extension.state.is_empty() {
        let names: Vec<&str> = extension.state.iter().map(|(name, _)| name.as_str()).collect();
        writeln!(text, "  remembers: {}", names.join(", "))?;
    }
    if !extension.reads.is_empty() {
        writeln!(text, "  reads of the world: {}", extension.reads.join(", "))?;
    }
    if extension.is_law() {
        let said = if extension.equilibrium { "as the file says" } else { "searched when needed" };
        writeln!(text, "  spacing at constant speed: {said}")?;
    } else {
        writeln!(text, "  fits: {}", bases.join(", "))?;
    }
    Ok(text)
}
