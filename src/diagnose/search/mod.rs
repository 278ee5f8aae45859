//! From where, and in which way, a model with a cause is fitted.

pub mod base;
pub mod fitted_model;
pub mod profile_grid;
pub mod scan;
pub mod scope;
pub mod screen;
pub mod search_budget;
pub mod skipped;
pub mod start;
pub mod textbook;
pub mod undisturbed;
