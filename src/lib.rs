//! leadlag calibrates and validates car-following and adaptive-cruise-control models against measured trajectories.

pub mod plant;
pub mod report;
pub mod trajectory;
