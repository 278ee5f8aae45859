//! Fits of a model with a cause: starts and strategies.

pub mod base;
pub mod fitted_model;
pub mod observers;
pub mod screen;
pub mod search_budget;
pub mod skipped;
pub mod strategy;
pub mod textbook;
