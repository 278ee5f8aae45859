//! leadlag calibrates and validates car-following and adaptive-cruise-control models against measured trajectories.

pub mod calibrate;
pub mod catalog;
pub mod convention;
pub mod evaluate;
pub mod evaluator;
pub mod optimize;
pub mod plant;
pub mod reference;
pub mod report;
pub mod score;
pub mod simulate;
pub mod symbols;
pub mod trajectory;
pub mod vehicle;
