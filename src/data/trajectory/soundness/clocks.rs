//! Speed scales and clocks of a link, by gap = ∫(v_l - v_f) dt.
//!
//! With measured speeds (1 + c) too large and late by τ, gap = ∫v_l dt / (1 + c_l) - ∫v_f dt / (1 + c_f) + constant for τ = 0. So
//! gap - ∫(v_l - v_f) dt = -D ∫(v_l + v_f) / 2 dt - C gap + τ_l v_l - τ_f v_f + constant, with 1 + c_l = (1 + C) / (1 - D / 2) and
//! 1 + c_f = (1 + C) / (1 + D / 2). The gap on the right has the noise of the left side in it, which would bias C; its instrument
//! is the gap averaged over two seconds (Fuller: Measurement Error Models, 1987, Section 1.4).
//!
//! Distance and speed determine differences between the two cars sharply. Only the changes of the gap determine the part common to both,
//! less sharply. So a contradiction is often obvious although the faulty car is not.

use super::finding::{Finding, FindingKind, Remedy, Who, Z_95, interval};
use super::level::{self, Columns, Usable};
use super::limits::LIMITS;
use super::link::Link;
use crate::text::option::CORRECT;
use crate::trajectory::factor;
use nalgebra::{Matrix2, Vector2};

/// A common scale of both cars follows from the few large changes of the gap, whose own imperfections matter. This standard error is added
/// to that of the noise, so that a common scale is at least 1 %.
const COMMON_SCALE_ERROR: f64 = 0.01 / LIMITS.significant;
/// The same if a signal of a low rate is joined by straight lines, which cut off the extremes of its changes.
const SLOW_SCALE_ERROR: f64 = 0.05 / LIMITS.significant;
/// Largest clock error in the search \[s\], and the step of the search.
const CLOCK_MAX_S: f64 = 3.0;
const CLOCK_STEP_S: f64 = 0.2;
/// Interval between the starts of the compared changes of the gap \[s\].
const PLACES_S: f64 = 1.0;
/// Largest number of steps of the estimation; each leaves a share of the clock's error that is half of the scale's.
const ROUNDS: usize = 6;
/// Half width of the window over which the gap is averaged \[s\].
const QUIET_S: f64 = 1.0;

/// Half width of the window over which the speeds are averaged as columns of the clocks \[s\].
const SMOOTH_S: f64 = 0.4;

/// Estimates of scales (0) and clocks (1): of the leader minus the follower, and of both in common.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Redundancy {
    estimate: [Pair; 2],
    /// Gain in log-likelihood over no fault \[nats\].
    gain: f64,
}

/// Difference and mean of the two cars, with covariance: D and C of the scales.
#[derive(Debug, Clone, PartialEq)]
struct Pair {
    value: Vector2<f64>,
    covariance: Matrix2<f64>,
}

/// Explanations that need one number: (difference, mean) per unit of it.
const EXPLANATIONS: [(Who, [f64; 2]); 3] =
    [(Who::Leader, [1.0, 0.5]), (Who::Follower, [-1.0, 0.5]), (Who::Both, [0.0, 1.0])];

/// The error of the car ahead by (difference, mean), and its derivatives; of the follower by (-difference, mean).
type Own = fn(Vector2<f64>) -> (f64, Vector2<f64>);

fn scale_of(at: Vector2<f64>) -> (f64, Vector2<f64>) {
    let (share, common) = (1.0 - 0.5 * at[0], 1.0 + at[1]);
    (common / share - 1.0, Vector2::new(0.5 * common / share.powi(2), share.recip()))
}

fn clock_of(at: Vector2<f64>) -> (f64, Vector2<f64>) {
    (at[1] + 0.5 * at[0], Vector2::new(0.5, 1.0))
}

/// Seen from the car: a positive difference for the leader is a negative one for the follower.
fn seen_by(who: Who, at: Vector2<f64>) -> Vector2<f64> {
    if who == Who::Follower { Vector2::new(-at[0], at[1]) } else { at }
}

impl Redundancy {
    /// The estimates; `slow` if a signal has a low rate. `None` if the drive is too short.
    pub fn estimate(link: &Link, usable: &Usable, slow: bool) -> Option<Redundancy> {
        if (usable.samples() as f64) * link.dt < LIMITS.least_drive {
            return None;
        }
        let none = level::likelihood_of(&columns(link, usable, [0.0; 2]).values[0], usable);
        let mut late = coarse(link, usable);
        let mut noises = None;
        // Gauss-Newton: the columns of the clocks are first-order.
        for round in 1..=ROUNDS {
            let columns = columns(link, usable, late);
            // The ratio of the noises hardly depends on the rest of a clock's error.
            let ratio = *noises.get_or_insert_with(|| level::ratio(&columns, usable));
            let beta = level::regress(&columns, usable, ratio, 0)?.beta;
            let [differ, common] = [late[0] - late[1] + beta[2], 0.5 * (late[0] + late[1]) + beta[3]];
            let next = [common + 0.5 * differ, common - 0.5 * differ];
            let moved = (next[0] - late[0]).abs().max((next[1] - late[1]).abs());
            if moved < 1e-3 || round == ROUNDS {
                let fit = level::regress(&columns, usable, ratio, level::lags(link.dt))?;
                return Some(Redundancy::of(&fit, late, none, usable, slow));
            }
            late = next.map(|l| l.clamp(-2.0 * CLOCK_MAX_S, 2.0 * CLOCK_MAX_S));
        }
        None
    }

    /// The estimates by the last fit, made for speeds read `late` seconds later; `none` is the likelihood of no error.
    fn of(fit: &level::Fit, late: [f64; 2], none: f64, usable: &Usable, slow: bool) -> Redundancy {
        let pair = |i: usize, at: Vector2<f64>| Pair {
            value: at + Vector2::new(fit.beta[i], fit.beta[i + 1]),
            covariance: fit.covariance.fixed_view::<2, 2>(i, i).clone_owned(),
        };
        let clock = pair(2, Vector2::new(late[0] - late[1], 0.5 * (late[0] + late[1])));
        let mut scale = pair(0, Vector2::zeros());
        scale.covariance[(1, 1)] += if slow { SLOW_SCALE_ERROR } else { COMMON_SCALE_ERROR }.powi(2);
        // The residual has the noise of the gap times 1 + C, so that a small C alone would look likelier.
        let shrunk = (usable.samples() - usable.stretches.len()) as f64 * (1.0 + scale.value[1]).max(1e-9).ln();
        Redundancy { estimate: [scale, clock], gain: fit.likelihood + shrunk - none }
    }

    /// Result of the estimates; `blurred` if a signal is smoothed or resampled, which moves its events a little.
    pub fn findings(&self, link: &Link, blurred: bool) -> Vec<Finding> {
        // A drive that oscillates at one frequency looks the same at other scales and clocks: a finding must be likelier there.
        if self.gain < 0.5 * LIMITS.significant.powi(2) {
            return Vec::new();
        }
        let [scale, clock] = &self.estimate;
        let mut findings = scale.explain(LIMITS.least_scale, scale_of, |who, value, error| Finding {
            interval: interval(value, error),
            matters: value.abs() > LIMITS.scale_matters,
            remedies: remedies(who),
            sentence: scale_sentence(who, value, error),
            ..Finding::new(FindingKind::SpeedScale, who, "speed", value, "-")
        });
        let share = if blurred { 1.0 } else { LIMITS.clock_share };
        let least = LIMITS.least_clock.max(share * link.dt);
        findings.extend(clock.explain(least, clock_of, |who, value, error| {
            // Both speeds late by the same time mean one late gap, with the opposite sign.
            let (car, signal, value) =
                if who == Who::Both { (Who::Follower, "gap", -value) } else { (who, "speed", value) };
            Finding {
                interval: interval(value, error),
                matters: value.abs() > LIMITS.clock_matters,
                remedies: remedies(car),
                sentence: clock_sentence(car, signal, value, error),
                ..Finding::new(FindingKind::ClockOffset, car, signal, value, "s")
            }
        }));
        findings
    }

    /// Gap rate minus speed difference, corrected by the estimates: root mean square over a second \[m/s\].
    pub fn residual_rate_rms(&self, link: &Link, usable: &Usable) -> f64 {
        let [scale, clock] = &self.estimate;
        let both = |pair: &Pair, own: Own| [Who::Leader, Who::Follower].map(|who| own(seen_by(who, pair.value)).0);
        let ([c_l, c_f], [late_l, late_f]) = (both(scale, scale_of), both(clock, clock_of));
        let (v_l, v_f) = (shifted(&link.v_l, late_l / link.dt), shifted(&link.v_f, late_f / link.dt));
        let corrected = Link {
            v_l: v_l.iter().map(|v| v / (1.0 + c_l)).collect(),
            v_f: v_f.iter().map(|v| v / (1.0 + c_f)).collect(),
            ..link.clone()
        };
        level::rate_rms(&corrected, &usable.stretches).unwrap_or(0.0)
    }
}

impl Pair {
    /// The explanations that the estimate supports: none, one car or both.
    fn explain(&self, least: f64, own: Own, finding: impl Fn(Who, f64, f64) -> Finding) -> Vec<Finding> {
        let Some(inverse) = self.covariance.try_inverse() else { return Vec::new() };
        let beyond = |i: usize| {
            let error = self.covariance[(i, i)].sqrt();
            self.value[i].abs() > least.max(LIMITS.significant * error)
        };
        let (differ, common) = (beyond(0), beyond(1));
        if !differ && !common {
            return Vec::new();
        }
        let of = |direction: [f64; 2]| {
            let a = Vector2::from(direction);
            let precision = (a.transpose() * inverse * a)[0];
            let size = (a.transpose() * inverse * self.value)[0] / precision;
            let left = self.value - a * size;
            (a * size, a * a.transpose() / precision, (left.transpose() * inverse * left)[0])
        };
        // Value and standard error of a car, at a place with this covariance.
        let sized = |who: Who, at: Vector2<f64>, covariance: Matrix2<f64>| {
            let (value, slope) = own(seen_by(who, at));
            let slope = seen_by(who, slope);
            (value, (slope.transpose() * covariance * slope)[0].sqrt())
        };
        let mut tried: Vec<_> =
            EXPLANATIONS.iter().filter(|(who, _)| differ || *who == Who::Both).map(|(who, d)| (*who, of(*d))).collect();
        tried.sort_by(|a, b| a.1.2.total_cmp(&b.1.2));
        let (who, (at, covariance, misfit)) = tried[0];
        let told = tried.get(1).is_none_or(|second| second.1.2 - misfit > LIMITS.told);
        // A second fault needs as much evidence as the first one.
        if told && (misfit < LIMITS.significant.powi(2) || !(differ && common)) {
            let (value, error) = sized(who, at, covariance);
            return vec![finding(who, value, error)];
        }
        if !told || !common {
            // As for the leader.
            let line = Vector2::new(1.0, 0.5);
            let (value, error) =
                sized(Who::Either, line * self.value[0], line * line.transpose() * self.covariance[(0, 0)]);
            return vec![finding(Who::Either, value, error)];
        }
        // Neither car alone: each has its own fault.
        [Who::Leader, Who::Follower]
            .into_iter()
            .filter_map(|who| {
                let (value, error) = sized(who, self.value, self.covariance);
                (value.abs() > least.max(LIMITS.significant * error)).then(|| finding(who, value, error))
            })
            .collect()
    }
}

/// Corrects faults that are known of one car.
fn remedies(who: Who) -> Vec<Remedy> {
    if matches!(who, Who::Leader | Who::Follower) { vec![Remedy::of(CORRECT)] } else { Vec::new() }
}

fn scale_sentence(who: Who, value: f64, error: f64) -> String {
    let (percent, error) = (100.0 * value, 100.0 * Z_95 * error);
    let hint = factor::explain(1.0 + value).map_or_else(String::new, |hint| format!(" ({hint})"));
    match who {
        Who::Either => format!(
            "the car ahead reads {percent:+.3} ± {error:.3} % faster than the follower over the same distance; this pair does not show which \
             of the two speeds is off{hint}"
        ),
        Who::Both => format!(
            "both speeds read {percent:+.2} ± {error:.2} % against the changes of the gap (or the gap too little){hint}"
        ),
        _ => format!(
            "the {}'s speed reads {percent:+.3} ± {error:.3} % against the gap and the other speed{hint}",
            who.into_str()
        ),
    }
}

fn clock_sentence(car: Who, signal: &str, value: f64, error: f64) -> String {
    let (late, size) = (if value > 0.0 { "late" } else { "early" }, value.abs());
    let error = Z_95 * error;
    match (car, signal) {
        (Who::Either, _) => format!(
            "the speed of the car ahead is {size:.3} ± {error:.3} s {late} against that of the follower; the data do not show which clock is off"
        ),
        (_, "gap") => format!("the gap is {size:.3} ± {error:.3} s {late} against both speeds"),
        _ => format!(
            "the {}'s speed is {size:.3} ± {error:.3} s {late} against the gap and the other speed",
            car.into_str()
        ),
    }
}

/// A signal read `samples` later, by cubic interpolation; NaN at the ends and near missing values.
pub(super) fn shifted(y: &[f64], samples: f64) -> Vec<f64> {
    if samples == 0.0 {
        return y.to_vec();
    }
    let whole = samples.floor();
    let u = samples - whole;
    // Lagrange through the samples -1, 0, 1, 2.
    let weights = [
        -u * (u - 1.0) * (u - 2.0) / 6.0,
        (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
        -(u + 1.0) * u * (u - 2.0) / 2.0,
        (u + 1.0) * u * (u - 1.0) / 6.0,
    ];
    (0..y.len() as isize)
        .map(|i| {
            let at = i + whole as isize;
            let value = |k: isize| usize::try_from(at + k).ok().and_then(|k| y.get(k)).copied().unwrap_or(f64::NAN);
            if u == 0.0 { value(0) } else { (-1..=2).zip(weights).map(|(k, w)| w * value(k)).sum() }
        })
        .collect()
}

/// The target, then the columns of (difference, mean) of scales and of clocks, for speeds read `late` seconds later.
fn columns(link: &Link, usable: &Usable, late: [f64; 2]) -> Columns {
    let read = |v: &[f64], late: f64| {
        // Beyond the ends the measured values remain, so a stretch loses little.
        let moved = shifted(v, late / link.dt);
        moved.iter().zip(v).map(|(m, v)| if m.is_finite() { *m } else { *v }).collect::<Vec<f64>>()
    };
    let (v_l, v_f) = (read(&link.v_l, late[0]), read(&link.v_f, late[1]));
    let mut columns = vec![vec![0.0; link.len()]; 5];
    let half = (SMOOTH_S / link.dt).round() as usize;
    let (smooth_l, smooth_f) = (averaged(&v_l, half), averaged(&v_f, half));
    let quiet = averaged(&link.gap, link.samples(QUIET_S)).into_iter().map(|gap| -gap).collect();
    for stretch in &usable.stretches {
        let (mut way_l, mut way_f) = (0.0, 0.0);
        for i in stretch.clone() {
            if i > stretch.start {
                way_l += way(&v_l[stretch.clone()], i - stretch.start) * link.dt;
                way_f += way(&v_f[stretch.clone()], i - stretch.start) * link.dt;
            }
            columns[0][i] = link.gap[i] - (way_l - way_f);
            columns[1][i] = -0.5 * (way_l + way_f);
            columns[2][i] = -(link.gap[i] - link.gap[stretch.start]);
            columns[3][i] = 0.5 * (smooth_l[i] + smooth_f[i]);
            columns[4][i] = smooth_l[i] - smooth_f[i];
        }
    }
    Columns { values: columns, instrument: (2, quiet) }
}

/// Mean of a speed from the sample before: of a cubic through four samples, because at 1 Hz straight lines are off by several per cent of
/// the changes of the gap.
fn way(v: &[f64], i: usize) -> f64 {
    let straight = 0.5 * (v[i - 1] + v[i]);
    let Some(before) = i.checked_sub(2).map(|before| v[before]) else { return straight };
    v.get(i + 1).map_or(straight, |after| (13.0 * (v[i - 1] + v[i]) - before - after) / 24.0)
}

/// A symmetric average over `half` samples to either side: the noise of a signal must not look like its changes.
fn averaged(v: &[f64], half: usize) -> Vec<f64> {
    (0..v.len())
        .map(|i| {
            let near = v[i.saturating_sub(half)..(i + half + 1).min(v.len())].iter().filter(|v| v.is_finite());
            let (sum, n) = near.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
            if n > 0.0 { sum / n } else { v[i] }
        })
        .collect()
}

/// Clock errors of both speeds on a coarse grid at which two-second changes of gap and distance agree best \[s\].
fn coarse(link: &Link, usable: &Usable) -> [f64; 2] {
    let way = |v: &[f64]| {
        let mut x = vec![0.0; v.len()];
        for i in 1..v.len() {
            let step = (v[i - 1] + v[i]) / 2.0 * link.dt;
            x[i] = x[i - 1] + if step.is_finite() { step } else { 0.0 };
        }
        x
    };
    let (x_l, x_f) = (way(&link.v_l), way(&link.v_f));
    let width = link.samples(2.0);
    let step = link.samples(CLOCK_STEP_S) as isize;
    let reach = (CLOCK_MAX_S / (step as f64 * link.dt)).round() as isize;
    let margin = (reach * step) as usize;
    let places: Vec<usize> = usable
        .stretches
        .iter()
        .flat_map(|r| (r.start + margin..r.end.saturating_sub(width + margin)).step_by(link.samples(PLACES_S)))
        .collect();
    let change = |x: &[f64], i: usize, by: isize| {
        let at = i.saturating_add_signed(by);
        x[at + width] - x[at]
    };
    let misfit = |l: isize, f: isize| -> f64 {
        let d = |i: &usize| change(&link.gap, *i, 0) - change(&x_l, *i, l) + change(&x_f, *i, f);
        places.iter().map(d).map(|d| d * d).sum()
    };
    let shifts = || (-reach..=reach).map(|k| k * step);
    let mut best = (misfit(0, 0), [0, 0]);
    // No change unless it removes half of the misfit.
    let worth = 0.5 * best.0;
    for l in shifts() {
        for f in shifts() {
            let found = misfit(l, f);
            if found < worth && found < best.0 {
                best = (found, [l, f]);
            }
        }
    }
    best.1.map(|k| k as f64 * link.dt)
}
