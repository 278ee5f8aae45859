//! Segments between long gaps, for messages that offer the choice.

use crate::text::shown::NAMED;
use crate::trajectory::Trajectory;
use serde::Serialize;
use std::fmt;

/// One stretch between long gaps: a choice of `--segment`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// Its number, from 1, in the order of time.
    pub number: usize,
    /// First time \[s\], as written in the file.
    pub from_s: f64,
    /// Last time \[s\].
    pub to_s: f64,
    /// Number of samples, interpolated ones included.
    pub samples: usize,
}

impl Stretch {
    /// The stretches by the times of their samples, in order.
    pub(super) fn of<'a>(times: impl IntoIterator<Item = &'a [f64]>) -> Vec<Stretch> {
        let ends = |t: &[f64]| t.first().copied().zip(t.last().copied()).unwrap_or_default();
        let one = |(number, t): (usize, &'a [f64])| {
            let (from_s, to_s) = ends(t);
            Stretch { number, from_s, to_s, samples: t.len() }
        };
        (1..).zip(times).map(one).collect()
    }

    /// Segments that [`super::prepare`] has found, in order.
    pub fn of_trajectories(trajectories: &[Trajectory]) -> Vec<Stretch> {
        Stretch::of(trajectories.iter().map(|trajectory| trajectory.t.as_slice()))
    }

    /// The longest few, the longest first, equally long ones in order of time; and the number of the others.
    pub fn longest(all: &[Stretch]) -> (Vec<&Stretch>, usize) {
        let mut sorted: Vec<&Stretch> = all.iter().collect();
        sorted.sort_by_key(|stretch| std::cmp::Reverse(stretch.samples));
        sorted.truncate(NAMED);
        let more = all.len() - sorted.len();
        (sorted, more)
    }

    /// The longest few in words: `4 (35240.1 to 35249.5 s, 95 samples), ... and 22 more, none of them longer`.
    pub fn listed(all: &[Stretch]) -> String {
        let (longest, more) = Stretch::longest(all);
        let mut text = longest.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        match more {
            0 => {}
            1 => text += " and 1 more, not longer",
            more => text += &format!(" and {more} more, none of them longer"),
        }
        text
    }
}

/// `4 (35240.1 to 35249.5 s, 95 samples)`.
impl fmt::Display for Stretch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Stretch { number, from_s, to_s, samples } = self;
        write!(f, "{number} ({from_s:.1} to {to_s:.1} s, {samples} samples)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_are_named_and_the_others_counted() {
        let times: Vec<Vec<f64>> =
            [30, 50, 50, 20, 40, 60, 25].map(|n| (0..n).map(|i| f64::from(i) * 0.1).collect()).to_vec();
        let all = Stretch::of(times.iter().map(Vec::as_slice));
        let (longest, more) = Stretch::longest(&all);
        let numbers: Vec<usize> = longest.iter().map(|stretch| stretch.number).collect();
        assert_eq!((numbers, more), (vec![6, 2, 3, 5, 1], 2));
        assert!(Stretch::listed(&all).starts_with("6 (0.0 to 5.9 s, 60 samples), 2 (0.0 to 4.9 s, 50 samples), 3 ("));
        assert!(Stretch::listed(&all).ends_with("30 samples) and 2 more, none of them longer"));
        assert_eq!(Stretch::listed(&all[..1]), "1 (0.0 to 2.9 s, 30 samples)");
    }
}
