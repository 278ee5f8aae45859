//! Selects the causes of the model, round by round.

pub mod adopt;
pub mod other_laws;
pub mod prune;
