//! Choice of the evaluator.

use super::Usage;
use crate::api::values::one_of;
use crate::evaluator::AdapterChoice;
use crate::lanes::LanesPrecision;
use crate::select::{Kind, Selection};
use std::sync::Mutex;

#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Evaluator")]
pub struct EvaluatorArgs {
    /// Which evaluator simulates the candidates
    #[arg(long, default_value = "auto", value_parser = one_of(&[
        ("auto", Kind::Auto, "A hardware GPU for large work, else lanes"),
        ("reference", Kind::Reference, "Plain f64 on the CPU, one candidate after the other"),
        ("lanes", Kind::Lanes, "Blocks of candidates on the CPU"),
        ("gpu", Kind::Gpu, "The GPU, including a software one; never falls back to the CPU"),
    ]))]
    pub evaluator: Kind,
    /// Precision of lanes and gpu [default: plain; f64 for evaluate without --evaluator]
    #[arg(long, value_parser = one_of(&[
        ("plain", LanesPrecision::Plain, "f32"),
        ("compensated", LanesPrecision::Compensated, "f32 with compensated rounding errors"),
        ("f64", LanesPrecision::F64, "f64, on lanes only"),
    ]))]
    pub precision: Option<LanesPrecision>,
    /// The adapter of the gpu evaluator, by its name in `leadlag doctor` [default: the best one]
    #[arg(long, value_name = "INDEX|PCI|NAME")]
    pub gpu: Option<String>,
}

impl EvaluatorArgs {
    /// An evaluator that the user names is never replaced by another one.
    pub fn selection(&self) -> anyhow::Result<Selection> {
        let adapter = self.gpu.clone().map_or(AdapterChoice::Best, AdapterChoice::Named);
        let selection = Selection { kind: self.evaluator, precision: self.precision, adapter };
        selection.check().map_err(|e| Usage(e.to_string()))?;
        Ok(selection)
    }
}

static SAID: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// A warning, to stderr; the same warning of several evaluators is printed once.
pub fn warn(message: &str) {
    let Ok(mut said) = SAID.lock() else { return };
    if said.iter().all(|other| other != message) {
        said.push(message.to_owned());
        eprintln!("warning: {message}");
    }
}

/// The warnings so far.
pub fn printed_warnings() -> Vec<String> {
    SAID.lock().map(|said| said.clone()).unwrap_or_default()
}
