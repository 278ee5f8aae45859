//! Runs that are corrected towards the measurement: what a diagnosis needs.

use super::Raw;

/// Correction of the state by the residuals r of each sample, and sums of whitened squares per block of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    /// s -= `gain[0]` r_s + `gain[1]` r_v; v_f -= `gain[2]` r_s + `gain[3]` r_v, then at least 0.
    pub gain: [f64; 4],
    /// A block adds up (`whitening[0]` r_s)² and (`whitening[1]` r_s + `whitening[2]` r_v)².
    pub whitening: [f64; 3],
    /// Samples in a block, counted from sample 0 of the trajectory; at least 1.
    pub block: usize,
}

/// What an observed run tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Status, cuts and sums.
    pub raw: Raw,
    /// Both sums of each block; 0 where a run did not come to the end of the block.
    pub blocks: Vec<[f64; 2]>,
}
