//! Choice of the evaluator.

use anyhow::bail;
use clap::ValueEnum;

/// Which evaluator simulates the candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Choice {
    /// The best one that this version has
    #[default]
    Auto,
    /// Plain f64 on the CPU
    Reference,
    /// Vectorised CPU evaluator; not in this version
    Lanes,
    /// GPU evaluator; not in this version
    Gpu,
}

impl Choice {
    /// An evaluator that was asked for by name is never replaced by another one.
    pub fn check(self) -> anyhow::Result<()> {
        match self {
            Choice::Auto | Choice::Reference => Ok(()),
            Choice::Lanes => bail!("--evaluator lanes: not in this version; use --evaluator reference"),
            Choice::Gpu => {
                bail!("--evaluator gpu: not in this version, no adapter is looked for; use --evaluator reference")
            }
        }
    }
}
