//! Which causes become part of the model, round by round.

pub mod adopt;
pub mod bootstrap;
pub mod global_restart;
pub mod masked_pairs;
pub mod other_laws;
pub mod repair;
pub mod trial;
