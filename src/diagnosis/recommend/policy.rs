//! Every number that decides what is recommended, with its unit and its reason.

use crate::diagnose::Effort;
use serde::{Deserialize, Serialize};

/// When an extension counts as better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// Bins of 10 s at least \[-\]: fewer say nothing about a tail probability of one in a hundred.
    pub least_bins: usize,
    /// Mean length of the blocks of the bootstrap \[s\]: errors of a car that follows last for some tens of seconds.
    pub block_s: f64,
    /// Resamples of the bootstrap \[-\]: hundreds beyond the strictest probability.
    pub resamples: usize,
    /// Probability of a gain by chance, adjusted for all models of a race, over both horizons together \[-\]: what else is asked lowers it
    /// further.
    pub chance: f64,
    /// Gain of the logarithmic loss at least \[-\]: less is nothing to change a model for.
    pub least_gain: f64,
    /// Gain at least on the drives that a model is fitted to, before it is tried on others \[-\]: half of what it has to gain there.
    pub worth_trying: f64,
    /// Share of the bins that are better at least \[-\]: one good stretch is no property of a car.
    pub better: f64,
    /// The largest size of a cause over the folds is at most so many times the smallest \[-\].
    pub spread: f64,
    /// A size nearer to none than this share of its axis is none \[-\], and has no ratio to another one.
    pub none: f64,
    /// Gain at least of both losses at both horizons \[-\]: about the same is good enough where the gain lies elsewhere.
    pub no_loss: f64,
    /// Smallest spacing over a whole drive as a share of the smallest measured one, at least \[-\]: a model that comes through by
    /// centimetres runs into somebody on the next drive.
    pub margin: f64,
    /// A stretch is not followed if the error of the speed over 10 s is so many times the usual one \[-\], which nine of ten bins do not
    /// exceed: a law that is no good at something is off by twice that.
    pub not_followed: f64,
    /// And at least this \[m/s\]: what a driver does is not subtle.
    pub least_not_followed: f64,
    /// Share of the bins that are usual \[-\].
    pub usual: f64,
    /// What is left of a drive counts if it is this long \[s\]: two windows.
    pub least_piece_s: f64,
    /// Level of the confidence set \[-\].
    pub set: f64,
    /// Probability that an interval holds \[-\].
    pub interval: f64,
}

impl Policy {
    /// The policy of this state of the program.
    pub const DEFAULT: Policy = Policy {
        least_bins: 60,
        block_s: 60.0,
        resamples: 9_999,
        chance: 0.05,
        least_gain: 0.02,
        worth_trying: 0.01,
        better: 0.5,
        spread: 2.5,
        none: 0.02,
        no_loss: -0.01,
        margin: 0.25,
        not_followed: 3.0,
        least_not_followed: 0.5,
        usual: 0.9,
        least_piece_s: 60.0,
        set: 0.9,
        interval: 0.95,
    };
}

/// Races at most: the first finds a cause or a pair, each further one a cause more, and costs as much.
#[must_use]
pub fn races(effort: Effort) -> usize {
    if effort == Effort::Quick { 1 } else { 2 }
}
