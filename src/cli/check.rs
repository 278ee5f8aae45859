//! `leadlag check`: is a file an extension, and what does it bring along?

use super::output;
use crate::api::extension::find;
use crate::catalog::{BASES, Variant};
use crate::convention::Radicand;
use crate::extension::Extension;
use crate::lanes::check_model;
use crate::report::text::wrapped;
use crate::symbols::{Bounds, Symbol};
use crate::wgsl::{Precision, Recipe};
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag check my_cause.wgsl
  leadlag calibrate drive.csv --model l-cth --extend my_cause.wgsl --out fit")]
pub struct Args {
    /// Extensions: one WGSL file each
    #[arg(required = true, value_name = "FILE.wgsl")]
    files: Vec<PathBuf>,
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
        extension.warnings.iter().for_each(|text| eprintln!("warning: {text}"));
        entries.push(json!({
            "name": extension.name,
            "meaning": extension.meaning,
            "parameters": extension.parameters.iter().map(|p| parameter(*p)).collect::<Vec<_>>(),
            "stages": extension.stages.iter().map(|s| s.stage.name()).collect::<Vec<_>>(),
            "remembers": extension.state.iter().map(|(name, _)| name).collect::<Vec<_>>(),
            "reads": extension.reads,
            "bases": bases,
            "warnings": extension.warnings,
        }));
        text += &described(extension, &bases)?;
    }
    if args.json { output::print_json(&entries) } else { output::print(&text) }
}

/// The base models that it can be part of; an error if it can be part of none.
fn fitting_bases(extension: &'static Extension) -> anyhow::Result<Vec<&'static str>> {
    let mut fitting = Vec::new();
    let mut first_problem = None;
    for base in BASES {
        let variant: Variant = base.name.parse()?;
        let recipe = Recipe {
            variant: variant.with(extension)?,
            precision: Precision::Plain,
            radicand: Radicand::Measured,
            observed: true,
        };
        match check_model(&recipe) {
            Ok(()) => fitting.push(base.name),
            Err(problem) => first_problem = first_problem.or(Some(problem)),
        }
    }
    match first_problem {
        Some(problem) if fitting.is_empty() => Err(problem.into()),
        _ => Ok(fitting),
    }
}

fn bounds(symbol: Symbol) -> Option<[f64; 2]> {
    match symbol.bounds() {
        Bounds::Fixed(lower, upper) => Some([lower, upper]),
        Bounds::PerVehicle => None,
    }
}

fn parameter(symbol: Symbol) -> serde_json::Value {
    json!({
        "name": symbol.name(), "unit": symbol.unit(), "meaning": symbol.meaning(), "bounds": bounds(symbol),
        "neutral": symbol.neutral(),
    })
}

fn described(extension: &Extension, bases: &[&str]) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    writeln!(text, "{}: valid", extension.name)?;
    if !extension.meaning.is_empty() {
        text += &wrapped(2, 2, &extension.meaning);
    }
    for symbol in &extension.parameters {
        let [lower, upper] = bounds(*symbol).unwrap_or_default();
        let neutral = symbol.neutral().map_or(String::new(), |x| format!(", does nothing at {x}"));
        let (name, unit) = (symbol.name(), symbol.unit());
        text += &wrapped(2, 4, &format!("{name} [{unit}] {lower} to {upper}{neutral}: {}", symbol.meaning()));
    }
    let stages: Vec<&str> = extension.stages.iter().map(|s| s.stage.name()).collect();
    writeln!(text, "  acts at: {}", if stages.is_empty() { "the time loop".to_owned() } else { stages.join(", ") })?;
    if !extension.state.is_empty() {
        let names: Vec<&str> = extension.state.iter().map(|(name, _)| name.as_str()).collect();
        writeln!(text, "  remembers: {}", names.join(", "))?;
    }
    if !extension.reads.is_empty() {
        writeln!(text, "  reads of the world: {}", extension.reads.join(", "))?;
    }
    writeln!(text, "  fits: {}", bases.join(", "))?;
    Ok(text)
}
