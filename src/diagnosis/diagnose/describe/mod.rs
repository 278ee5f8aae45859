//! What the fitted models get right and wrong, in numbers: gains, what is missing, what is left.

pub mod covariates;
pub mod error_breakdown;
pub mod event_mask;
pub mod free;
pub mod gain;
pub mod missing;
pub mod specification;
