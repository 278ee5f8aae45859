//! Describes the fitted models: gains, missing acceleration, unexplained structure.

pub mod covariates;
pub mod error_breakdown;
pub mod free;
pub mod missing;
pub mod specification;
