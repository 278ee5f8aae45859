//! Choice of the evaluator.

use super::Usage;
use crate::catalog::Variant;
use crate::evaluator::AdapterChoice;
use crate::lanes::LanesPrecision;
use crate::reference::knows;
use crate::select::{Kind, Selection};
use crate::wgsl::extension_named;
use clap::ValueEnum;
use std::sync::Mutex;

#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Evaluator")]
pub struct EvaluatorArgs {
    /// Which evaluator simulates the candidates
    #[arg(long, value_enum, default_value_t)]
    pub evaluator: Choice,
    /// Precision of lanes and gpu [default: plain; f64 for evaluate without --evaluator]
    #[arg(long, value_enum)]
    pub precision: Option<PrecisionArg>,
    /// The adapter of the gpu evaluator, by its name in `leadlag doctor` [default: the best one]
    #[arg(long, value_name = "INDEX|PCI|NAME")]
    pub gpu: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Choice {
    /// A hardware GPU for large work, else lanes
    #[default]
    Auto,
    /// Plain f64 on the CPU, one candidate after the other
    Reference,
    /// Blocks of candidates on the CPU
    Lanes,
    /// The GPU, including a software one; never falls back to the CPU
    Gpu,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PrecisionArg {
    /// f32
    Plain,
    /// f32 with compensated rounding errors
    Compensated,
    /// f64, on lanes only
    F64,
}

impl EvaluatorArgs {
    /// An evaluator that the user names is never replaced by another one.
    pub fn selection(&self) -> anyhow::Result<Selection> {
        let selection = Selection {
            kind: match self.evaluator {
                Choice::Auto => Kind::Auto,
                Choice::Reference => Kind::Reference,
                Choice::Lanes => Kind::Lanes,
                Choice::Gpu => Kind::Gpu,
            },
            precision: self.precision.map(|precision| match precision {
                PrecisionArg::Plain => LanesPrecision::Plain,
                PrecisionArg::Compensated => LanesPrecision::Compensated,
                PrecisionArg::F64 => LanesPrecision::F64,
            }),
            adapter: self.gpu.clone().map_or(AdapterChoice::Best, AdapterChoice::Named),
        };
        selection.check().map_err(|e| Usage(e.to_string()))?;
        Ok(selection)
    }
}

/// The option for an evaluator, and the option for one that can replace the reference.
pub const BY_FLAGS: [&str; 2] = ["--evaluator reference", "--evaluator lanes --precision f64"];
/// The same in the plan of a study.
pub const BY_PLAN: [&str; 2] = ["evaluator = \"reference\"", "evaluator = \"lanes\" and precision = \"f64\""];

/// Refuses the reference for a variant with a user's extension, of which it has no transcription.
pub fn transcribed(kind: Kind, variant: &Variant, [asked, instead]: [&str; 2]) -> anyhow::Result<()> {
    if kind != Kind::Reference || knows(variant) {
        return Ok(());
    }
    let own = variant.extensions.list().iter().filter(|e| extension_named(&e.name).is_none());
    let files: Vec<&str> = own.map(|e| e.file.as_str()).collect();
    let (is, files) = (if files.len() == 1 { "is" } else { "are" }, files.join(", "));
    Err(Usage(format!("`{asked}` knows the built-in causes only; {files} {is} your own: use `{instead}`")).into())
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
