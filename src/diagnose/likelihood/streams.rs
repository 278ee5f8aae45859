//! Streams of random numbers beside those of the searches, whose replicates count from 0: no two purposes draw the same numbers.

/// Another look around a fit; turn by turn down from here, with at least one cause as the generation.
pub const AROUND: u64 = u64::MAX;
/// Bootstraps of the hold-out, of generation 0.
pub const HOLDOUT: u64 = u64::MAX - 1;
/// Surrogates of the bootstrap: behind the turns of [`AROUND`].
pub const SURROGATES: u64 = u64::MAX - 4;
/// Descents.
pub const DESCENT: u64 = u64::MAX - 100;
/// A cause searched anew.
pub const ANEW: u64 = 0x616e_6577;
/// Bootstrap of the gain.
pub const GAIN: u64 = 0x6761_696e;
