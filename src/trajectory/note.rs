//! What was done to measured data before it is simulated against.

/// One thing that was done to the data, in the order in which it was done.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Note {}
