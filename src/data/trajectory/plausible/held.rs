//! Values that stay the same to the last digit while the cars move: a sensor without a target, or one that hangs.

use super::Signals;
use crate::statistics::{order_statistic, robust_scale};
use std::ops::Range;

/// A gap that stays for so long is held \[s\] ...
const GAP_S: f64 = 2.0;
/// ... if the speeds say that it changes by more than this \[m\], and than two of its own smallest steps, ...
const CHANGE_M: f64 = 1.0;
/// ... or if it stays for so long whatever they say \[s\].
const LONG_S: f64 = 10.0;
/// Less than this is no change at all \[m\].
const STILL_M: f64 = 0.1;
/// A speed that stays for so long is held \[s\] ...
const SPEED_S: f64 = 3.0;
/// ... if the gap then changes otherwise than the speeds say, by more than this \[m\] and than usual.
const CONTRADICTS_M: f64 = 1.5;
const UNUSUAL: f64 = 6.0;
/// Cars slower than this stand \[m/s\].
const MOVING: f64 = 0.5;
/// Fewer equal samples are chance.
const SAMPLES: usize = 5;
/// A sensor with coarser steps than this shows the same value for long without a fault \[m\].
const COARSE_M: f64 = 0.2;

pub(super) fn said(signals: &Signals) -> Vec<String> {
    let told = signals.told();
    let Signals { t, v_l, v_f, gap, called } = *signals;
    let smallest = smallest_step(gap);
    let moves =
        |run: &Range<usize>| run.clone().filter(|&i| v_l[i] > MOVING || v_f[i] > MOVING).count() * 2 > run.len();
    let lasts = |run: &Range<usize>, seconds: f64| t[run.end - 1] - t[run.start] >= seconds;
    let range = |run: &Range<usize>| {
        let of = || told[run.clone()].iter().copied().filter(|x| x.is_finite());
        of().fold(f64::NEG_INFINITY, f64::max) - of().fold(f64::INFINITY, f64::min)
    };
    let gap_held = |run: &Range<usize>| {
        let changes = range(run) > CHANGE_M.max(2.0 * smallest);
        (lasts(run, GAP_S) && changes) || (lasts(run, LONG_S) && smallest < COARSE_M && range(run) > STILL_M)
    };
    let gaps: Vec<Range<usize>> = runs(gap).filter(|run| moves(run) && gap_held(run)).collect();
    let left = |i: usize| gap[i] - told[i];
    let usual = robust_scale(over_a_second(t).map(|(i, j)| left(j) - left(i))).unwrap_or(0.0);
    let mut found = Vec::new();
    found.extend(sentence(called, " m", gap, &gaps, t, "a sensor without a target?"));
    for (who, v) in [("the speed of the car ahead", v_l), ("the speed of the follower", v_f)] {
        let contradicts = |run: &Range<usize>| {
            let off = (left(run.end - 1) - left(run.start)).abs();
            off > CONTRADICTS_M.max(UNUSUAL * usual * (t[run.end - 1] - t[run.start]).sqrt())
        };
        // Where the gap is held as well, it tells nothing of the speeds.
        let apart = |run: &Range<usize>| !gaps.iter().any(|gap| gap.start < run.end && run.start < gap.end);
        let held = |run: &Range<usize>| moves(run) && lasts(run, SPEED_S) && apart(run) && contradicts(run);
        let speeds: Vec<Range<usize>> = runs(v).filter(held).collect();
        found.extend(sentence(who, " m/s", v, &speeds, t, "a sensor that hangs?"));
    }
    found
}

fn sentence(called: &str, unit: &str, y: &[f64], held: &[Range<usize>], t: &[f64], what: &str) -> Option<String> {
    let longest = held.iter().max_by(|a, b| (t[a.end - 1] - t[a.start]).total_cmp(&(t[b.end - 1] - t[b.start])))?;
    let seconds: f64 = held.iter().map(|run| t[run.end - 1] - t[run.start]).sum();
    let more = match held.len() {
        1 => String::new(),
        n => format!(", and so {n} times, {seconds:.1} s in all"),
    };
    Some(format!(
        "{called}: stays at {}{unit} to the last digit from {:.1} to {:.1} s while the cars move{more}: {what} Values that were not measured \
         are to be left empty",
        y[longest.start],
        t[longest.start],
        t[longest.end - 1]
    ))
}

/// Stretches of equal values.
fn runs(y: &[f64]) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut start = 0;
    std::iter::from_fn(move || {
        while start < y.len() {
            let from = start;
            while start < y.len() && y[start] == y[from] {
                start += 1;
            }
            // A missing value equals nothing, not even itself.
            start = start.max(from + 1);
            if start - from >= SAMPLES {
                return Some(from..start);
            }
        }
        None
    })
}

/// The smallest change that is usual: a tenth of all changes are smaller.
fn smallest_step(y: &[f64]) -> f64 {
    let steps = y.windows(2).map(|y| (y[1] - y[0]).abs()).filter(|step| *step > 0.0);
    order_statistic(steps, 0.1).unwrap_or(0.0)
}

/// Samples about a second apart.
fn over_a_second(t: &[f64]) -> impl Iterator<Item = (usize, usize)> + '_ {
    let mut j = 0;
    (0..t.len()).filter_map(move |i| {
        while j < t.len() && t[j] - t[i] < 1.0 - 1e-6 {
            j += 1;
        }
        (j < t.len() && t[j] - t[i] < 2.0).then_some((i, j))
    })
}
