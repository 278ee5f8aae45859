//! Results for people and programs: one output format per file.
//!
//! A format does not depend on the computation of a result; it receives plain numbers and writes them. Formats return text and never access
//! the file system, so that the same result gives the same bytes.

pub mod csv;
pub mod diagnosis;
pub mod figure;
pub mod fleet;
pub mod html;
#[cfg(feature = "cli")]
mod own;
pub mod panel;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod plot;
pub mod residuals;
pub mod simulation;
pub mod study;
pub mod svg;
pub mod terminal;
pub mod text;
