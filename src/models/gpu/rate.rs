//! Number of samples of one submission, from the times of earlier ones.

/// Time that a submission should take \[s\]: short enough for a driver's watchdog (2 s on Windows) and for an interrupt.
const TARGET: f64 = 0.08;

/// Shorter times \[s\] show the overhead rather than the speed.
const MEASURABLE: f64 = 0.01;

/// Largest factor on the work if a device seems faster than expected: once most candidates have crashed, a submission takes almost no time,
/// and the next one may have others.
const GROWTH: f64 = 4.0;

/// Smallest number of samples per submission.
const SHORTEST: u32 = 16;

/// Candidate-steps per second of a device, if known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rate(f64);

impl Rate {
    /// A slow start, which one measured submission corrects.
    pub(super) const UNKNOWN: Rate = Rate(50e6);

    /// Samples of a submission of this many candidates.
    pub(super) fn samples(self, candidates: u32) -> u32 {
        let by_speed = self.0 * TARGET / f64::from(candidates);
        (by_speed.min(1e9) as u32).max(SHORTEST)
    }

    /// Updates the estimate from a submission of this many candidate-steps and its time. Unless the host `waited` for most of that time,
    /// the work was done some time ago, and the time gives only a lower limit of the speed.
    pub(super) fn learn(&mut self, candidate_steps: f64, took: f64, waited: bool) {
        let measured = candidate_steps / took.max(1e-6);
        if measured > self.0 {
            self.0 = measured.min(GROWTH * self.0);
        } else if waited && took > MEASURABLE {
            self.0 = 0.5 * (self.0 + measured);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds of each submission of a device with this many candidate-steps per second.
    fn times(speed: f64, candidates: u32, submissions: usize) -> Vec<f64> {
        let mut rate = Rate::UNKNOWN;
        let mut submit = || {
            let steps = f64::from(rate.samples(candidates)) * f64::from(candidates);
            rate.learn(steps, steps / speed, true);
            steps / speed
        };
        (0..submissions).map(|_| submit()).collect()
    }

    #[test]
    fn submissions_come_to_take_as_long_as_they_should() {
        for (speed, candidates) in [(5e9, 100_000), (2e8, 1_000), (5e7, 20_000), (2e6, 100)] {
            let times = times(speed, candidates, 12);
            for (k, took) in times.iter().enumerate().skip(8) {
                assert!((took / TARGET - 1.0).abs() < 0.1, "{speed:e} steps/s, submission {k}: {took} s of {times:?}");
            }
        }
        // Twenty-five times slower than expected; still, the first submission ends before a driver's watchdog.
        assert!(times(2e6, 100, 1)[0] < 2.1);
    }

    #[test]
    fn no_submission_is_shorter_than_it_is_worth() {
        assert_eq!(Rate::UNKNOWN.samples(u32::MAX), SHORTEST);
        assert_eq!(Rate(1e30).samples(1), 1_000_000_000);
    }

    #[test]
    fn a_submission_of_the_dead_makes_the_next_one_four_times_as_long_and_no_longer() {
        let (speed, candidates) = (2e8, 10_000);
        let mut rate = Rate(speed);
        let steps = f64::from(rate.samples(candidates)) * f64::from(candidates);
        rate.learn(steps, 1e-6, true);
        let took = f64::from(rate.samples(candidates)) * f64::from(candidates) / speed;
        assert!(took > 3.9 * TARGET && took < 4.1 * TARGET, "{took} s");
    }

    #[test]
    fn a_result_that_was_ready_long_ago_slows_nothing_down() {
        let mut rate = Rate(1e8);
        rate.learn(1e6, 1.0, false);
        assert_eq!(rate.0, 1e8, "the device may have been done at once");
        rate.learn(1e5, 0.001, true);
        assert_eq!(rate.0, 1e8, "a millisecond is mostly overhead, and no slower");
        rate.learn(1e6, 1.0, true);
        assert_eq!(rate.0, 0.5 * (1e8 + 1e6));
        rate.learn(1e8, 1.0, false);
        assert_eq!(rate.0, 1e8, "faster it is in any case");
    }
}
