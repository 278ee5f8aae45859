//! Every number that decides what the race names and recommends, with its unit and its reason.

use crate::diagnose::Effort;
use serde::{Deserialize, Serialize};

/// When a model counts as better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// Mean length of the blocks of the bootstrap \[s\]: errors of a car that follows last for some tens of seconds.
    pub block_s: f64,
    /// Resamples of the bootstrap \[-\]: tens beyond the strictest probability.
    pub resamples: usize,
    /// Bins at least \[-\]: with fewer blocks than ten a bootstrap knows no tails.
    pub least_bins: usize,
    /// Probability of a name by chance, adjusted for all models of a race \[-\].
    pub chance_of_a_name: f64,
    /// Gain of a name at the middle horizon at least, as a share of the error \[-\]: in gusts a late model predicts the next seconds some per
    /// cent better, because a gust lasts; over a quarter of a minute that is gone.
    pub least_gain: f64,
    /// Probability of a recommendation by chance, adjusted likewise \[-\]: what else is asked of it lowers it further.
    pub chance: f64,
    /// Level of the confidence set \[-\].
    pub set: f64,
    /// Gain over whole drives in standard errors at least \[-\]: a recommendation has to gain where it is used, and the shorter horizons
    /// show what it is.
    pub whole_drives: f64,
    /// A size is one of the car if it is at most so many times as large at one horizon, or without one fold, as at another \[-\].
    pub spread: f64,
    /// A size nearer to none than this share of its axis is none \[-\], and has no ratio to another one.
    pub none: f64,
    /// Gain in training that is worth a judgement, as a share of the error \[-\]: less is nothing to change a model for.
    pub worth_trying: f64,
    /// Shares of the smallest measured spacing \[-\] that a model may fall short of in as many whole drives as the base, and no more: one that
    /// comes closer collides on the next drive.
    pub least_spacing: [f64; 3],
    /// A stretch is not followed if the error of the speed over 10 s is so many times the usual one \[-\], which nine of ten bins do not
    /// exceed: a law that is no good at something is off by twice that.
    pub not_followed: f64,
    /// And at least this \[m/s\]: what a driver does is not subtle.
    pub least_not_followed: f64,
    /// Share of the bins that are usual \[-\].
    pub usual: f64,
    /// Stretches that no model follows are left out so near to the begin or the end of a drive \[s\]: there drivers take over.
    pub edge_s: f64,
    /// What is left of a drive counts if it is this long \[s\]: six bins.
    pub least_piece_s: f64,
    /// Probability that an interval holds \[-\].
    pub interval: f64,
}

impl Policy {
    /// The policy of this state of the program.
    pub const DEFAULT: Policy = Policy {
        block_s: 60.0,
        resamples: 4_999,
        least_bins: 12,
        chance_of_a_name: 0.01,
        least_gain: 0.02,
        chance: 0.05,
        set: 0.95,
        whole_drives: 1.0,
        spread: 2.5,
        none: 0.02,
        worth_trying: 0.005,
        least_spacing: [0.25, 0.5, 0.75],
        not_followed: 3.0,
        least_not_followed: 0.5,
        usual: 0.9,
        edge_s: 60.0,
        least_piece_s: 60.0,
        interval: 0.95,
    };
}

/// Rounds at most: the first finds a cause or a pair, each further one a cause more, and costs as much.
#[must_use]
pub fn rounds(effort: Effort) -> usize {
    if effort == Effort::Quick { 1 } else { 2 }
}
