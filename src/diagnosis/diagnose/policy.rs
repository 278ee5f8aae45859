//! Every number that decides what the likelihood names, what a verdict is, and what counts as a fault of the data, with its unit and its
//! reason.

use serde::Serialize;

/// A number of the policy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    /// Its name, as in `diagnosis.json`.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit; `-` for none.
    pub unit: &'static str,
    /// What it decides, and why it is what it is.
    pub reason: &'static str,
}

macro_rules! policy {
    ($($name:ident = $value:expr, $unit:literal, $reason:literal;)*) => {
        /// What decides. One home for each number.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
        pub struct Policy {
            $(#[doc = $reason] pub $name: f64,)*
        }

        /// The policy of this state of the program.
        pub const POLICY: Policy = Policy { $($name: $value,)* };

        impl Policy {
            /// All numbers in the order of the page.
            #[must_use]
            pub fn numbers(&self) -> Vec<Number> {
                vec![$(Number { name: stringify!($name), value: self.$name, unit: $unit, reason: $reason },)*]
            }
        }
    };
}

policy! {
    alpha = 0.01, "-", "Chance of a false name in a drive without a cause, shared among all causes";
    lasting = 1.7, "s", "If the missing acceleration lasts less, with the likeliest cause and without, it is noise of sensors; gusts last longer";
    lasting_factor = 2.5, "-", "Then a cause needs so many times as much, for whatever weakens the law gains";
    left_by_others = 0.08, "-", "Share of what earlier causes explain that a later one needs on top: none is exactly what the car does";
    judged = 0.5, "-", "Share of its need from which on a cause is cross-fitted";
    close = 6.0, "nats", "Rivals differ by less, times the inflation: odds of several hundred";
    alike = 0.04, "-", "Or by less than this share of the evidence: a time step changes each by that much";
    more_parameters = 0.5, "-", "A cause with more parameters is a rival only if it is ahead by this share of the margin";
    same = 0.001, "-", "Values that differ by less than this share of the range are the same: none, or on a bound";
    absorbed = 0.02, "-", "Less of an effect than this is left by other parameters: a calibration makes up for it";
    time_resolution = 5.0, "s", "A searched time costs the logarithm of how many of these there are";
    transfers = 0.9, "-", "Share of the bootstraps of the hold-out in which a cause has to gain";
    shown = 8.0, "nats", "A hold-out on which a cause changes less cannot object";
    block = 30.0, "s", "Blocks of the bootstraps: errors of a car that follows last that long";
    huber = 5.0, "-", "Standard deviations from which on an innovation counts by its length: two seconds must not outweigh a drive";
    lags = 100.0, "-", "Lags of the autocorrelation that inflates needs";
    fold_stretch = 60.0, "s", "Stretches of the two folds in turn";
    fold_guard = 5.0, "s", "Left out after every seam";
    borrowed = 0.1, "-", "Weight of all data in a fold, for parameters of the base: what it does not show must not run away";
    bases_agree = 100.0, "nats", "Calibrations of the base that differ by more have not found it";
    faster = 0.01, "-", "Share of the samples that may be faster than the desired speed";
    faster_by = 0.5, "m/s", "The others may be faster by this: sensors err, and cars swing";
    promise = 25.0, "nats", "If a bound were moved by a tenth of the range, and that gained more, the data contradict the base";
    other_law = 10.0, "nats", "By how much another law has to be likelier to be the answer";
    left_share = 0.5, "-", "If what is left has more than this share of the causes' evidence, they are not named";
    trimmed = 0.5, "-", "Share of its need that a left-over has without its two best blocks: one event is no structure";
    stopped = 2.0, "-", "So many times its need gains a stopped cause that is told nevertheless";
    lost_size = 0.08, "m/s²", "With more missing acceleration, for longer than `lost_time`, the model is far off";
    lost_time = 10.0, "s", "See `lost_size`";
    burst = 22.0, "-", "Squared length of a burst, relative to the usual: one of 60,000 normal innovations";
    bursts = 8.0, "-", "So many bursts, times the inflation, are told";
    burst_blocks = 4.0, "-", "In so many blocks at least";
    calm = 0.02, "m/s²", "With more missing acceleration the family `phase` is named with a warning";
    significant = 4.5, "-", "Standard errors of a fault of scale, clock or offset: one false alarm in some 100,000 links";
    least_scale = 1e-4, "-", "A smaller fault of a scale does not matter: a metre in ten kilometres";
    least_clock = 0.02, "s", "A smaller fault of a clock does not matter: a fifth of a usual time step";
    least_offset = 0.05, "m", "A smaller fault of the spacing does not matter";
    least_drive = 60.0, "s", "Driving that tells a scale or a clock";
    told = 9.0, "-", "Chi-squared by which the other car explains a fault worse: three standard errors";
    held_chance = 1e-4, "-", "A value that chance holds this seldom in a file was held";
    held = 0.5, "s", "A coarse sensor holds a value for longer";
    held_step = 0.3, "m or m/s", "And the value then jumps by more";
    coloured = 0.42, "-", "Autocorrelation of third differences beside that of white noise: sensors have up to 0.36";
    jump = 0.5, "m", "Within a sample the spacing changes by so much more than speeds allow where it jumps";
    slow_jump = 2.0, "m", "The same within a second";
    unusual = 12.0, "-", "Standard deviations of what the spacing usually does, for both";
    unrelated = 0.5, "m/s", "Rate of the spacing less speed difference, over a second, of signals that do not belong together";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_numbers_decide_and_each_says_why() {
        let numbers = POLICY.numbers();
        assert!(numbers.len() <= 90);
        for number in numbers {
            assert!(number.value.is_finite() && number.reason.len() > 10, "{number:?}");
        }
    }
}
