//! Selection of a device on a machine.

use std::str::FromStr;

/// The adapter to use (`--gpu`).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AdapterChoice {
    /// The best one: hardware before software.
    #[default]
    Best,
    /// The one with this index, PCI address or name (a part of it is enough).
    Named(String),
}

impl FromStr for AdapterChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(AdapterChoice::Named(text.trim().to_owned()))
    }
}
