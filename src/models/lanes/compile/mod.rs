//! From naga's form of a text to a block program: instructions over rows.
//!
//! [`flatten`] turns a function into scalar operations, [`schedule`] these into instructions (`fuse` and `group` decide which are
//! combined). [`model`] assembles the instructions of a whole model. No numbers are computed here.

pub mod code;
pub mod error;
pub mod flat;
pub mod flatten;
mod fuse;
mod group;
pub mod model;
pub mod schedule;
