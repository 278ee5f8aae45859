//! Streams of random numbers besides those of the searches, whose replicates count from 0: each purpose has its own.

/// Bootstraps of the hold-out, of generation 0.
pub const HOLDOUT: u64 = u64::MAX - 1;
/// Searches by CMA-ES.
pub const DESCENT: u64 = u64::MAX - 100;
