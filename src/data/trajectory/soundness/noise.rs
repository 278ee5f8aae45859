//! The noise of a signal: absent, not white, or that of a lower sampling rate.
//!
//! Third differences of a smoothly driven car are nearly all noise: those of white noise of deviation σ have the variance 20
//! σ² (1, -3, 3, -1) and the autocorrelation -0.75, 0.3, -0.05.

use super::finding::{Finding, FindingKind, Remedy, Who, interval};
use super::limits::LIMITS;
use super::link::{Link, Signal};
use super::spectrum;
use crate::statistics::robust_scale;
use crate::text::option::{CORRECT, GOF, RESAMPLE, SMOOTH};

/// Variance of third differences of white noise of variance 1.
const THIRD_DIFFERENCE: f64 = 20.0;
/// Autocorrelation of third differences of white noise.
const WHITE: [f64; 3] = [-0.75, 0.3, -0.05];
/// Lags to examine: moving averages of up to this many samples show at their length.
const LAGS: usize = 25;
/// Larger third differences are events and not noise \[robust standard deviations\].
const CLIP: f64 = 6.0;
/// Fewer third differences are too few for an estimate.
const ENOUGH: usize = 200;
/// Blocks for the standard error of a noise level \[s\].
const BLOCK_S: f64 = 20.0;
/// Runs of a resampled signal that have the usual length or one sample more or less \[share\].
const REGULAR: f64 = 0.85;
/// Rounded values repeat by chance; fewer runs than this are not regular.
const RUNS: usize = 50;

/// A signal of a lower rate.
pub(super) struct Resampled {
    /// File rate over true rate.
    pub factor: f64,
    /// Whether values are held between its own samples, so that these are known.
    pub held: bool,
    pub finding: Finding,
}

/// Smallest step between two values: the resolution of the file or the sensor.
pub(super) fn quantum(values: &[f64]) -> f64 {
    let steps = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 1e-9);
    steps.fold(f64::INFINITY, f64::min).min(1.0)
}

/// Third differences.
fn thirds(y: &[f64]) -> impl Iterator<Item = f64> + '_ {
    y.windows(4).map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0])
}

/// Third differences while the car drives, without events (NaN).
fn third(signal: &Signal, link: &Link) -> Vec<f64> {
    let drives = |i: usize| (i..i + 4).all(|k| link.driving(k));
    let mut d: Vec<f64> =
        thirds(signal.values).enumerate().map(|(i, d)| if drives(i) { d } else { f64::NAN }).collect();
    let scale = robust_scale(d.iter().copied()).unwrap_or(f64::NAN);
    d.iter_mut().filter(|d| d.abs() > CLIP * scale).for_each(|d| *d = f64::NAN);
    d
}

/// Standard deviation of the noise by third differences, with its standard error.
fn level(d: &[f64], block: usize) -> Option<(f64, f64)> {
    let blocks: Vec<(f64, f64)> = d
        .chunks(block)
        .map(|chunk| {
            let finite = chunk.iter().filter(|d| d.is_finite());
            finite.fold((0.0, 0.0), |(sum, n), d| (sum + d * d, n + 1.0))
        })
        .filter(|(_, n)| *n > 0.0)
        .collect();
    let n: f64 = blocks.iter().map(|(_, n)| n).sum();
    if n < ENOUGH as f64 || blocks.len() < 3 {
        return None;
    }
    let variance = blocks.iter().map(|(sum, _)| sum).sum::<f64>() / n;
    // Ratio estimator over blocks.
    let spread: f64 = blocks.iter().map(|(sum, m)| (sum - variance * m).powi(2)).sum();
    let error = spread.sqrt() / n;
    let sigma = (variance / THIRD_DIFFERENCE).sqrt();
    Some((sigma, if variance > 0.0 { sigma * error / (2.0 * variance) } else { 0.0 }))
}

/// True if there is as much noise as a sensor has, and the rate is high enough to distinguish it from driving.
pub(super) fn noisy(signal: &Signal, link: &Link) -> bool {
    resolves_noise(link)
        && level(&third(signal, link), link.samples(BLOCK_S)).is_some_and(|(sigma, _)| sigma > signal.noise_floor)
}

/// Autocorrelation at lags 1 to [`LAGS`].
fn autocorrelation(d: &[f64]) -> Vec<f64> {
    let mean = |lag: usize| {
        let pairs = d.iter().zip(&d[lag.min(d.len())..]).map(|(a, b)| a * b).filter(|p| p.is_finite());
        let (sum, n) = pairs.fold((0.0, 0.0), |(sum, n), p| (sum + p, n + 1.0));
        sum / n
    };
    let variance = mean(0);
    (1..=LAGS).map(|lag| mean(lag) / variance).collect()
}

/// True if the rate is high enough to distinguish noise from driving.
fn resolves_noise(link: &Link) -> bool {
    link.dt * LIMITS.noise_rate <= 1.0
}

/// A signal that is smoother than that of a sensor.
pub(super) fn smoothed(signal: &Signal, link: &Link) -> Option<Finding> {
    if !resolves_noise(link) {
        return None;
    }
    let d = third(signal, link);
    let (sigma, error) = level(&d, link.samples(BLOCK_S))?;
    let off = autocorrelation(&d)
        .iter()
        .enumerate()
        .map(|(i, r)| (r - WHITE.get(i).copied().unwrap_or(0.0)).abs())
        .fold(0.0, f64::max);
    let coloured = off > LIMITS.coloured && quantum(signal.values) < sigma;
    if sigma > signal.noise_floor && !coloured {
        return None;
    }
    let why = if sigma <= signal.noise_floor {
        format!("third differences leave {sigma:.1e} {} for noise, less than any sensor has", signal.unit)
    } else {
        format!(
            "its noise of {sigma:.1e} {} is not white (autocorrelation off by {off:.2}), as if filtered",
            signal.unit
        )
    };
    Some(Finding {
        interval: interval(sigma, error),
        sentence: format!("{}: smoothed; {why}; {}", signal.title, FindingKind::Smoothed.effect()),
        ..Finding::new(FindingKind::Smoothed, signal.who, signal.name, sigma, signal.unit)
    })
}

/// Steps of a quantised signal are at least this share of the coarse ones, or multiples of them.
const WHOLE: f64 = 0.01;
/// At least this share of all steps is.
const MOST: f64 = 0.99;

/// A signal whose values are multiples of a large step.
pub(super) fn quantised(signal: &Signal) -> Option<Finding> {
    let q = quantum(signal.values);
    let least = if signal.name == "gap" { LIMITS.coarse_gap } else { LIMITS.coarse_speed };
    let steps = || signal.values.windows(2).map(|w| (w[1] - w[0]).abs() / q).filter(|step| *step > 1e-6);
    let whole = steps().filter(|step| (step - step.round()).abs() <= WHOLE * step.max(1.0)).count();
    let count = steps().count();
    (q >= least && count >= RUNS && whole as f64 >= MOST * count as f64).then(|| Finding {
        matters: true,
        remedies: vec![Remedy::of(SMOOTH)],
        sentence: format!("{}: has steps of {q:.3} {}, and nothing between", signal.title, signal.unit),
        ..Finding::new(FindingKind::Quantised, signal.who, signal.name, q, signal.unit)
    })
}

/// A signal whose rate is lower than the file's: held, joined by straight lines, or without high frequencies.
pub(super) fn resampled(signal: &Signal, link: &Link) -> Option<Resampled> {
    let y = signal.values;
    let q = quantum(y);
    let tolerance = 2.5 * q.min(1e-4);
    let drives = |i: usize, before: usize| (i - before..=i).all(|k| link.driving(k) && y[k].is_finite());
    // Held: the value changes only at some samples.
    let changes = (1..y.len()).map(|i| drives(i, 1).then(|| y[i] != y[i - 1]));
    let (factor, how) = match regular(changes) {
        Some(factor) => (factor, HELD),
        None => {
            // Straight lines: the slope changes only at some samples.
            let bends =
                (2..y.len()).map(|i| drives(i, 2).then(|| (y[i] - 2.0 * y[i - 1] + y[i - 2]).abs() > tolerance));
            match regular(bends) {
                Some(factor) => (factor, "joined by straight lines between its own samples"),
                // Without noise, the end of its spectrum is invisible.
                None if !noisy(signal, link) => return None,
                None => (spectrum::cut_off(signal, link)?, "interpolated: its noise ends at half its own rate"),
            }
        }
    };
    let rate = 1.0 / (link.dt * factor);
    let held = how == HELD;
    let finding = Finding {
        matters: rate < if held { LIMITS.held_rate } else { LIMITS.slow_rate },
        remedies: if held { vec![Remedy::of(CORRECT)] } else { Vec::new() },
        sentence: format!(
            "{}: sampled at {rate:.3} Hz, not at the file's {:.3} Hz, and {how}",
            signal.title,
            1.0 / link.dt
        ),
        ..Finding::new(FindingKind::Resampled, signal.who, signal.name, rate, "Hz")
    };
    Some(Resampled { factor, held, finding })
}

/// How a signal of a lower rate was brought to the rate of the file.
const HELD: &str = "held between its own samples";

/// The measured samples of a held signal, joined by straight lines; values held longer than usual stay.
pub(super) fn joined(y: &[f64], factor: f64) -> Vec<f64> {
    let mut joined = y.to_vec();
    let mut last = 0;
    for i in 1..y.len() {
        if y[i] == y[i - 1] {
            continue;
        }
        let steps = i - last;
        if steps as f64 <= 1.5 * factor && (y[last] - y[i]).is_finite() {
            for k in 1..steps {
                joined[last + k] = y[last] + (y[i] - y[last]) * k as f64 / steps as f64;
            }
        }
        last = i;
    }
    joined
}

/// Mean distance of the events in samples, if they come at regular distances of more than one; neighbouring events count as one.
fn regular(events: impl Iterator<Item = Option<bool>>) -> Option<f64> {
    let (mut distances, mut since, mut quiet) = (Vec::new(), None::<usize>, true);
    let mut count = 0;
    for event in events {
        count += usize::from(event == Some(true));
        match event {
            None => (since, quiet) = (None, true),
            Some(true) if quiet => {
                distances.extend(since.map(|d| d + 1));
                (since, quiet) = (Some(0), false);
            }
            Some(true) => since = since.map(|d| d + 1),
            Some(false) => (since, quiet) = (since.map(|d| d + 1), true),
        }
    }
    let n = distances.len();
    // An event takes up to two samples, where its time lies between them.
    if n < RUNS || count > 3 * n {
        return None;
    }
    let mut sorted = distances.clone();
    sorted.sort_unstable();
    let median = sorted[n / 2];
    let usual: Vec<usize> = distances.iter().copied().filter(|d| d.abs_diff(median) <= 1).collect();
    let regular = usual.len() as f64 >= REGULAR * n as f64;
    // Random events most often have distances of 2, but equally often larger ones; the events must fill the drive.
    let mean = usual.iter().sum::<usize>() as f64 / usual.len() as f64;
    let near = usual.iter().filter(|d| (**d as f64 - mean).abs() < 1.0).count() as f64;
    (regular && near >= REGULAR * n as f64).then_some(mean)
}

/// Fewer differences do not determine their noise.
const DIFFERENCES: usize = 50;

/// The acceleration of the follower, differences of its speed over a time step, is noise that changes from sample to sample.
pub(super) fn drowned(link: &Link) -> Option<Finding> {
    let (v, dt) = (&link.v_f, link.dt);
    let squares: Vec<f64> =
        v.windows(2).map(|v| ((v[1] - v[0]) / dt).powi(2)).filter(|square| square.is_finite()).collect();
    if squares.len() < DIFFERENCES {
        return None;
    }
    let total = squares.iter().sum::<f64>() / squares.len() as f64;
    // Third differences remove the motion of a car within three samples.
    let noise = robust_scale(thirds(v)).unwrap_or(0.0).powi(2) / THIRD_DIFFERENCE;
    let share = (2.0 * noise / (dt * dt) / total).min(1.0);
    (total > 0.0 && share > LIMITS.mostly_noise).then(|| Finding {
        matters: true,
        remedies: vec![
            Remedy { option: GOF, value: Some("nrmse-s".to_owned()) },
            Remedy::of(SMOOTH),
            Remedy::of(RESAMPLE),
        ],
        sentence: format!(
            "the acceleration of the follower, from its speeds every {dt} s, is noise to {:.0} % (of its variance)",
            100.0 * share
        ),
        ..Finding::new(FindingKind::Noisy, Who::Follower, "speed", share, "-")
    })
}
