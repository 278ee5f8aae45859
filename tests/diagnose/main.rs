//! Diagnoses: the data, the search for a cause, the output, and hidden effects.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod cli;
mod data;
mod describe;
mod drivers;
mod fleet;
mod hidden_effect;
mod infer;
mod not_followed;
mod own_cause;
mod page;
