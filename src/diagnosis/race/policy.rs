//! Every number that decides names and recommendations of the race, with its unit and reason.

use crate::diagnose::Effort;
use serde::{Deserialize, Serialize};

/// The criteria for a better model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// Mean length of the bootstrap blocks \[s\]: errors of a following car last for some tens of seconds.
    pub block_s: f64,
    /// Number of resamples \[-\]: the strictest probability is still that of tens of resamples.
    pub resamples: usize,
    /// Smallest number of bins, or of drivers \[-\]: with fewer than ten blocks a bootstrap has no tails.
    pub least_bins: usize,
    /// Largest probability of a name by chance, adjusted for all models of a race \[-\].
    pub chance_of_a_name: f64,
    /// Smallest gain of a name at the middle horizon, as a share of the error of those who have the cause \[-\]: in gusts, a model with a delay predicts the next
    /// seconds some per cent better, because a gust lasts; over a quarter of a minute this gain vanishes.
    pub least_gain: f64,
    /// Smallest gain of the base over the same law without a car ahead at the shortest horizon, as a share of the error of the speed \[-\];
    /// the lower end of its interval counts. With L-CTH, 11 of 13 measured fleets reach 0.14 or more, fleets behind the car ahead of another
    /// driver at most 0.08.
    pub least_reaction: f64,
    /// Largest gain that `power` reports, as a share of the error \[-\]: drives that only show larger ones show nothing.
    pub most_power: f64,
    /// Largest probability of a recommendation by chance, adjusted likewise \[-\]: the other checks lower it further.
    pub chance: f64,
    /// Level of the confidence set \[-\].
    pub set: f64,
    /// Smallest share of the causes of a recommended model that are of named families \[-\]: those of one car may not carry over to other
    /// drives, but hundreds of left-out drivers show what a further cause gains.
    pub named: f64,
    /// Smallest gain over whole drives in standard errors \[-\]: a recommended model has to gain in its use. By chance, one of twenty models
    /// does.
    pub whole_drives: f64,
    /// Largest ratio of a size between two horizons, or without one fold, if it is to be a property of the car \[-\].
    pub spread: f64,
    /// Share of its axis below which a size is zero \[-\]; ratios of zero sizes are undefined.
    pub none: f64,
    /// Smallest training gain that is worth a test, as a share of the error \[-\]: a smaller one does not justify a change of the model.
    pub worth_trying: f64,
    /// Shares of the smallest measured spacing \[-\]: a model may fall below each in no more whole drives than the base, because one that
    /// comes closer collides on the next drive.
    pub least_spacing: [f64; 3],
    /// Largest number of left-out parts in which a recommended model collides \[-\]: one that collides there does so on further drives, too.
    pub collisions: f64,
    /// Number of standard errors by which close approaches, and collisions behind a car that stops, may exceed those of the base \[-\]: among
    /// hundreds of drivers, some do by chance.
    pub excess: f64,
    /// The same for collisions behind a car that stops gently \[-\]: many bases collide in an ordinary stop, too.
    pub gentle_excess: f64,
    /// A stretch is not followed if the error of the speed over 10 s is this multiple of the usual one \[-\], which nine of ten bins do not
    /// exceed: a law that lacks an effect is off by twice the usual error.
    pub not_followed: f64,
    /// Smallest error of such a stretch \[m/s\]: a driver's intervention is large.
    pub least_not_followed: f64,
    /// Share of the bins that are usual \[-\].
    pub usual: f64,
    /// Distance from the start or the end of a drive within which such stretches are left out \[s\]: there drivers take over.
    pub edge_s: f64,
    /// Shortest remainder of a drive that counts \[s\]: six bins.
    pub least_piece_s: f64,
    /// Probability of the intervals \[-\].
    pub interval: f64,
}

impl Policy {
    /// The policy of this version.
    pub const DEFAULT: Policy = Policy {
        block_s: 60.0,
        resamples: 4_999,
        least_bins: 12,
        chance_of_a_name: 0.01,
        least_gain: 0.02,
        least_reaction: 0.1,
        most_power: 0.5,
        chance: 0.05,
        set: 0.95,
        named: 1.0,
        whole_drives: 1.645,
        spread: 2.5,
        none: 0.02,
        worth_trying: 0.005,
        least_spacing: [0.25, 0.5, 0.75],
        collisions: 0.0,
        excess: 0.0,
        gentle_excess: 0.0,
        not_followed: 3.0,
        least_not_followed: 0.5,
        usual: 0.9,
        edge_s: 60.0,
        least_piece_s: 60.0,
        interval: 0.95,
    };

    /// The policy for a fleet. A pooled model follows an unusual driver badly over whole drives, so no stretch is left out, and collisions
    /// on left-out drives only count as close approaches. Gentle stops do not count: a pooled model often collides in them, and a lag that
    /// some drivers have makes it collide more often.
    pub const FLEET: Policy = Policy {
        named: 0.5,
        not_followed: f64::INFINITY,
        collisions: f64::INFINITY,
        excess: 1.0,
        gentle_excess: f64::INFINITY,
        ..Policy::DEFAULT
    };
}

/// Largest number of rounds: the first finds a cause or a pair, each further one adds a cause and costs as much.
#[must_use]
pub fn rounds(effort: Effort) -> usize {
    if effort == Effort::Quick { 1 } else { 2 }
}
