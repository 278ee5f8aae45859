//! What a base model lacks: the data, the search for a cause, what is said of it, and effects that were hidden.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod cli;
mod data;
mod describe;
mod hidden_effect;
mod infer;
mod not_followed;
mod own_cause;
mod page;
