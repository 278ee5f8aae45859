//! leadlag calibrates and validates car-following and adaptive-cruise-control models against measured trajectories.

pub mod catalog;
pub mod convention;
pub mod evaluator;
pub mod optimize;
pub mod reference;
pub mod score;
pub mod symbols;
pub mod trajectory;
pub mod vehicle;
