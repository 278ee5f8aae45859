//! From naga's form of a text to a block program: instructions over rows.
//!
//! [`flatten`] turns a function into scalar operations, [`schedule`] these into instructions (`fuse` and `group` decide which do several
//! operations at once). [`model`] puts the instructions of a whole model together. Nothing here computes a number.

pub mod code;
pub mod error;
pub mod flat;
pub mod flatten;
mod fuse;
mod group;
pub mod model;
pub mod schedule;
