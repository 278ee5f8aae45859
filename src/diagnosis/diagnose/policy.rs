//! Every number that decides a name or a verdict of the likelihood, with its unit and reason.

pub use leadlag_data::numbers::Number;

leadlag_data::numbers! {
    /// The deciding numbers; each is defined only here.
    Policy POLICY:
    alpha = 0.01, "-", "Chance of a false name in a drive without a cause, shared among all causes";
    lasting = 1.7, "s", "If the missing acceleration lasts less, with and without the likeliest cause, it is sensor noise; gusts last longer";
    lasting_factor = 8.0, "-", "Factor on the threshold of a cause in that case, because any weakening of the law then gains";
    left_by_others = 0.08, "-", "Share of the evidence of earlier causes that a later one needs in addition, because no cause matches a car exactly";
    judged = 0.5, "-", "Share of its threshold from which a cause is cross-fitted";
    close = 6.0, "nats", "Rivals differ by less, times the inflation: odds of several hundred";
    alike = 0.04, "-", "Or by less than this share of the evidence: a change of the time step has that much effect";
    more_parameters = 0.5, "-", "A cause with more parameters is a rival only if it is ahead by this share of the margin";
    same = 0.001, "-", "Values that differ by less than this share of the range are equal, so a size is zero or on a bound";
    absorbed = 0.02, "-", "If other parameters leave less of an effect than this, a calibration absorbs it";
    time_resolution = 5.0, "s", "A searched time costs the logarithm of the number of these intervals";
    transfers = 0.9, "-", "Share of the bootstraps of the hold-out in which a cause has to gain";
    shown = 8.0, "nats", "If a cause changes the hold-out by less, the hold-out does not decide";
    block = 30.0, "s", "Blocks of the bootstraps: errors of a following car last that long";
    huber = 5.0, "-", "Beyond this many standard deviations an innovation counts linearly, so that two seconds do not outweigh a drive";
    lags = 100.0, "-", "Lags of the autocorrelation that inflates thresholds";
    fold_stretch = 60.0, "s", "Stretches that alternate between the two folds";
    fold_guard = 5.0, "s", "Omitted after every seam";
    borrowed = 0.1, "-", "Weight of all data in a fold, for parameters of the base: one that the fold does not determine must not run away";
    bases_agree = 100.0, "nats", "Calibrations of the base that differ by more have not found the optimum";
    faster = 0.01, "-", "Share of the samples that may be faster than the desired speed";
    faster_by = 0.5, "m/s", "The others may be faster by this: sensors err, and speeds oscillate";
    promise = 25.0, "nats", "If moving a bound by a tenth of the range would gain more, the data contradict the base";
    other_law = 10.0, "nats", "Another law is the answer only if it is likelier by more";
    left_share = 0.5, "-", "If the remaining structure has more than this share of the causes' evidence, they are not named";
    trimmed = 0.5, "-", "Share of its threshold that remaining structure needs without its two best blocks: one event is not structure";
    stopped = 2.0, "-", "Gain, relative to its threshold, from which a rejected cause is still reported";
    lost_size = 0.08, "m/s²", "With more missing acceleration, lasting longer than `lost_time`, the model is far off";
    lost_time = 10.0, "s", "See `lost_size`";
    burst = 22.0, "-", "Squared length of a burst, relative to the usual one: one of 60,000 normal innovations";
    bursts = 8.0, "-", "Number of bursts, times the inflation, from which they are reported";
    burst_blocks = 4.0, "-", "Smallest number of blocks with bursts";
    calm = 0.02, "m/s²", "With more missing acceleration, the family `phase` is named with a caveat";
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
