//! Measured trajectories: import, checks, preparation; vehicles; statistics and words that every floor needs.
//!
//! A part of leadlag without a promise of its own: use the crate `leadlag`.

pub mod statistics;
pub mod text;
pub mod trajectory;
pub mod vehicle;
