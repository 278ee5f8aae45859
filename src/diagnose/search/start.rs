//! Where the fits start.

use super::fitted_model::FittedModel;
use super::textbook::with_textbook_values;
use crate::diagnose::drive::Drive;
use crate::diagnose::drive::smoothing::rough;
use crate::diagnose::likelihood::fit::Point;
use crate::diagnose::likelihood::model::{Event, Model};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::likelihood::space::Axis;
use crate::extension::Extension;
use crate::optimize::stream;
use crate::symbols::{SearchKind, Symbol};
use rand::RngExt;

/// Noise of a nearly free simulation: sees what a strong observer corrects away.
pub const NEARLY_FREE: (f64, f64) = (0.008, 1.0);
/// Noise of a strong observer: sees even a car whose parameters are far off.
pub const STRONG: (f64, f64) = (0.15, 2.0);

impl Noise {
    /// The same sensors with a strong observer.
    #[must_use]
    pub fn strong(&self) -> Noise {
        Noise { sigma_d: STRONG.0, tau_d: STRONG.1, ..*self }
    }

    /// The same sensors with a nearly free simulation.
    #[must_use]
    pub fn nearly_free(&self) -> Noise {
        Noise { sigma_d: NEARLY_FREE.0, tau_d: NEARLY_FREE.1, ..*self }
    }

    /// The same, but no stronger than it is: where nearly nothing is missing already, more of it would hide what a start is to show.
    #[must_use]
    pub fn freer(&self) -> Noise {
        Noise { sigma_d: NEARLY_FREE.0.min(self.sigma_d), tau_d: NEARLY_FREE.1, ..*self }
    }
}

/// Noise of ordinary sensors of spacing and speed \[m, m/s\].
const ORDINARY: [f64; 2] = [0.02, 0.02];
/// Share of the ordinary noise below which a sensor is precise.
const PRECISE: f64 = 0.5;
/// By how much the noise of ordinary sensors is exaggerated for an event.
pub const FOR_AN_EVENT: f64 = 10.0;
/// And for a size on which innovations depend in jumps.
pub const FOR_STEPS: f64 = 4.0;

/// The noise to search with where the likelihood is so rugged that a search stops beside the cause: where sensors are precise, as
/// if they were ordinary; for an event, whose time has to be found, as if they were poor. `None` where it is smooth enough.
#[must_use]
pub fn softened(noise: &Noise, event: bool) -> Option<Noise> {
    softened_by(noise, if event { FOR_AN_EVENT } else { 1.0 })
}

/// The same with the noise of ordinary sensors times a factor.
#[must_use]
pub fn softened_by(noise: &Noise, factor: f64) -> Option<Noise> {
    let precise = noise.r_s < PRECISE * ORDINARY[0] || noise.r_v < PRECISE * ORDINARY[1];
    if factor <= 1.0 && !precise {
        return None;
    }
    let least = ORDINARY.map(|r| factor * r);
    Some(Noise { r_s: noise.r_s.max(least[0]), r_v: noise.r_v.max(least[1]), ..*noise })
}

/// Noise levels of drives before anything is fitted, and a strong observer.
#[must_use]
pub fn first_noise(drives: &[Drive]) -> Noise {
    let mean = |of: &dyn Fn(&Drive) -> f64| drives.iter().map(of).sum::<f64>() / drives.len().max(1) as f64;
    Noise {
        sigma_d: STRONG.0,
        tau_d: STRONG.1,
        r_s: mean(&|drive| rough(&drive.trajectory.s)).max(1e-4),
        r_v: mean(&|drive| rough(&drive.trajectory.v_f)).max(1e-4),
        r_l: mean(&|drive| rough(&drive.v_l_measured)).max(1e-5),
    }
}

/// Random candidates within the bounds; the draws depend on the seed only.
#[must_use]
pub fn population(model: &Model, noise: &Noise, seed: u64, replicate: u64, count: usize) -> Vec<Point> {
    let point = |i: usize| {
        let mut rng = stream(seed, replicate, 0, i as u64);
        // Off the bounds, where derivatives are one-sided.
        let values = model.axes.iter().map(|axis| axis.value(0.02 + 0.96 * rng.random::<f64>())).collect();
        Point { values, noise: *noise }
    };
    (0..count).map(point).collect()
}

/// Coordinates of an axis worth trying for a parameter that does nothing at `neutral`.
fn probes(axis: &Axis, neutral: f64) -> Vec<f64> {
    let at = axis.coordinate(neutral);
    let shares: &[f64] = if axis.log { &[0.25, 0.45, 0.65] } else { &[0.002, 0.04, 0.15, 0.4] };
    let mut found = Vec::new();
    for share in shares {
        for target in [0.0, 1.0] {
            if (target - at).abs() > 0.001 {
                found.push(axis.value(at + share * (target - at)));
            }
        }
    }
    found
}

/// Values of a cause's parameters that are worth a start.
pub type Hint = Vec<(Symbol, f64)>;

/// Kinds of starts of [`with_cause`], which come in turn.
pub const KINDS: usize = 3;

/// Starts of a model that has one cause more than another: its parameters as they are, the cause at several sizes, under the
/// present observer and under a nearly free simulation; and, where the largest speed of the follower \[m/s\] is given, with textbook
/// values of free driving, under a strong observer.
#[must_use]
pub fn with_cause(
    current: &FittedModel,
    model: &Model,
    cause: &'static Extension,
    hints: &[Hint],
    fastest: Option<f64>,
) -> Vec<Point> {
    let values = model.adopt(&current.model, &current.fit.point.values);
    let noise = current.fit.point.noise;
    let free = noise.freer();
    let hinted =
        |hint: &Hint| hint.iter().filter_map(|(symbol, value)| Some((model.position(*symbol)?, *value))).collect();
    let sizes: Vec<Vec<(usize, f64)>> =
        if hints.is_empty() { sizes(model, cause) } else { hints.iter().map(hinted).collect() };
    let strong = noise.strong();
    let mut starts = Vec::new();
    for size in &sizes {
        let textbook = fastest.map(|fastest| with_textbook_values(model, &values, fastest));
        let kinds = [Some((&values, noise)), Some((&values, free)), textbook.as_ref().map(|values| (values, strong))];
        for (values, noise) in kinds.into_iter().flatten() {
            let mut values = values.clone();
            for &(k, value) in size {
                values[k] = model.axes[k].value(model.axes[k].coordinate(value));
            }
            starts.push(Point { values, noise });
        }
    }
    starts
}

/// Values of a cause's parameters that are worth a start: all that have a neutral value together at every size, and each alone.
#[must_use]
pub fn sizes(model: &Model, cause: &Extension) -> Vec<Vec<(usize, f64)>> {
    let positions = model.positions(cause);
    let sized: Vec<(usize, f64)> =
        positions.iter().filter_map(|&k| model.symbols[k].neutral().map(|neutral| (k, neutral))).collect();
    let of = |(k, neutral): &(usize, f64)| -> Vec<(usize, f64)> {
        probes(&model.axes[*k], *neutral).into_iter().map(|value| (*k, value)).collect()
    };
    if let [one] = sized.as_slice() {
        return of(one).into_iter().map(|size| vec![size]).collect();
    }
    let each: Vec<Vec<(usize, f64)>> = sized.iter().map(of).collect();
    let most = each.iter().map(Vec::len).min().unwrap_or(0);
    let together = (0..most).map(|i| each.iter().map(|sizes| sizes[i]).collect());
    together.chain(each.iter().filter_map(|sizes| sizes.get(sizes.len() / 2).map(|size| vec![*size]))).collect()
}

/// Hints for causes with a time, a place in the spectrum or a stretch of their own, with the drives in which they may act.
#[must_use]
pub fn hints(
    cause: &'static Extension,
    drives: &[Drive],
    missing: &[Vec<f64>],
    most: usize,
) -> Vec<(Option<Event>, Vec<Hint>)> {
    let frequency = cause.parameters.iter().find(|symbol| symbol.unit() == "Hz");
    let mut times = cause.parameters.iter().copied().filter(|symbol| symbol.is_time());
    match cause.search() {
        SearchKind::Integral => vec![(None, gains(cause))],
        SearchKind::Steps => vec![(None, steps_of(cause))],
        SearchKind::Size | SearchKind::Limit => vec![(None, Vec::new())],
        SearchKind::Harmonic => {
            let sized = |f: f64| {
                let amplitudes = cause.parameters.iter().filter(|symbol| symbol.neutral().is_some());
                let frequency = frequency.map(|symbol| (*symbol, f));
                amplitudes.map(|symbol| (*symbol, 0.02)).chain(frequency).collect::<Vec<_>>()
            };
            vec![(None, peaks(drives, missing, most).into_iter().map(sized).collect())]
        }
        SearchKind::Event | SearchKind::Stretch => match (times.next(), times.next()) {
            (Some(begin), length) => events(cause, begin, length, drives),
            (None, _) => vec![(None, Vec::new())],
        },
    }
}

/// Gains of an integral, from slow to fast: with one that is off by half, its swings have another period than those measured.
fn gains(cause: &'static Extension) -> Vec<Hint> {
    const GAINS: [f64; 11] = [-0.002, 3e-5, 1.5e-4, 5e-4, 0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035];
    let [gain] = cause.parameters.as_slice() else { return Vec::new() };
    GAINS.iter().map(|size| vec![(*gain, *size)]).collect()
}

/// Sizes on which innovations depend in jumps, so that no derivative shows the way.
fn steps_of(cause: &'static Extension) -> Vec<Hint> {
    let [size] = cause.parameters.as_slice() else { return Vec::new() };
    let crate::symbols::Bounds::Fixed(_, upper) = size.bounds() else { return Vec::new() };
    steps(upper).into_iter().map(|step| vec![(*size, step)]).collect()
}

/// A dense row of steps of the command up to the largest, in equal ratios.
#[must_use]
pub fn steps(largest: f64) -> Vec<f64> {
    const COUNT: usize = 240;
    const SMALLEST: f64 = 0.02;
    (0..COUNT).map(|i| largest * SMALLEST.powf(i as f64 / (COUNT - 1) as f64)).collect()
}

/// An event in all drives at the same time of the file, or in any one of them.
fn events(
    cause: &'static Extension,
    begin: Symbol,
    length: Option<Symbol>,
    drives: &[Drive],
) -> Vec<(Option<Event>, Vec<Hint>)> {
    let size = cause.parameters.iter().copied().find(|symbol| symbol.neutral().is_some());
    let mut scopes: Vec<Option<Event>> =
        (0..drives.len()).map(|drive| Some(Event { extension: cause, drive })).collect();
    // Times that run on through the files need no such choice: only one drive has the time.
    if overlap(drives) || drives.len() == 1 {
        scopes.push(None);
    }
    let of = |scope: &Option<Event>| {
        let inside = |k: usize| scope.as_ref().is_none_or(|event| event.drive == k);
        let mut hints = Vec::new();
        for (k, drive) in drives.iter().enumerate().filter(|(k, _)| inside(*k)) {
            match (length, size) {
                (Some(length), Some(size)) => {
                    let stretches = behind_faster(drive).into_iter();
                    hints.extend(stretches.map(|(t, dur, v)| vec![(size, v), (begin, t), (length, dur)]));
                }
                // Shared times are those of the first drive.
                (None, Some(size)) if k == 0 || scope.is_some() => {
                    let (first, last) = (drive.trajectory.t[0], drive.trajectory.t[drive.samples() - 1]);
                    let count = ((last - first) / 8.0).floor().max(2.0) as usize;
                    let t = |i: usize| first + (last - first) * (i as f64 + 0.5) / count as f64;
                    hints.extend((0..count).map(|i| vec![(size, 0.0), (begin, t(i))]));
                }
                _ => {}
            }
        }
        (*scope, hints)
    };
    scopes.iter().map(of).collect()
}

fn overlap(drives: &[Drive]) -> bool {
    let span = |d: &Drive| (d.trajectory.t[0], d.trajectory.t[d.samples() - 1]);
    let mut spans: Vec<(f64, f64)> = drives.iter().map(span).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    spans.windows(2).any(|w| w[1].0 < w[0].1)
}

/// Stretches of several lengths in which the car ahead is the faster one on the whole, with begin, length and a speed that the
/// follower hardly exceeds there: what a lower set speed would do.
fn behind_faster(drive: &Drive) -> Vec<(f64, f64, f64)> {
    /// Lengths \[s\].
    const LENGTHS: [f64; 5] = [12.0, 20.0, 33.0, 55.0, 90.0];
    /// Share of a length from stretch to stretch.
    const STRIDE: f64 = 0.4;
    /// Shares of the samples below the speed.
    const BELOW: [f64; 2] = [0.5, 0.95];
    let data = &drive.trajectory;
    let mut found = Vec::new();
    for length in LENGTHS {
        let samples = (length / data.dt).round() as usize;
        let stride = ((STRIDE * length / data.dt).round() as usize).max(1);
        for from in (0..data.len().saturating_sub(samples)).step_by(stride) {
            let range = from..from + samples;
            let faster = range.clone().map(|t| data.v_l[t] - data.v_f[t]).sum::<f64>();
            let mut speeds = data.v_f[range].to_vec();
            speeds.sort_by(f64::total_cmp);
            if faster > 0.0 && speeds[samples / 2] > 1.0 {
                let at = |share: f64| speeds[((samples - 1) as f64 * share) as usize];
                found.extend(BELOW.map(|share| (data.t[from], length, at(share))));
            }
        }
    }
    found
}

/// Frequencies \[Hz\] at which the missing acceleration has most power for its neighbourhood.
fn peaks(drives: &[Drive], missing: &[Vec<f64>], most: usize) -> Vec<f64> {
    const LOWEST: f64 = 0.005;
    const HIGHEST: f64 = 1.5;
    let longest = drives.iter().map(|d| d.samples() as f64 * d.dt()).fold(1.0, f64::max);
    let step = 0.5 / longest;
    let count = ((HIGHEST - LOWEST) / step) as usize;
    let power = |i: usize| -> f64 {
        let f = LOWEST + i as f64 * step;
        let sum = |(drive, d): (&Drive, &Vec<f64>)| {
            // Rotation instead of a sine and cosine per sample.
            let (turn_s, turn_c) = (std::f64::consts::TAU * f * drive.dt()).sin_cos();
            let (mut s, mut c, mut sine, mut cosine) = (0.0, 1.0, 0.0, 0.0);
            for d in d {
                sine += s * d;
                cosine += c * d;
                (s, c) = (s * turn_c + c * turn_s, c * turn_c - s * turn_s);
            }
            sine * sine + cosine * cosine
        };
        drives.iter().zip(missing).map(sum).sum()
    };
    use rayon::prelude::*;
    let spectrum: Vec<f64> = (0..count).into_par_iter().map(power).collect();
    let contrast = |i: usize| {
        let around = &spectrum[i.saturating_sub(40)..(i + 40).min(count)];
        spectrum[i] / (around.iter().sum::<f64>() / around.len() as f64).max(f64::MIN_POSITIVE)
    };
    let contrasts: Vec<f64> = (0..count).map(contrast).collect();
    highest(&contrasts, 5, most).into_iter().map(|i| LOWEST + i as f64 * step).collect()
}

/// Positions of the highest finite values, the highest first, none closer to another than `apart`.
#[must_use]
pub fn highest(values: &[f64], apart: usize, most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
    let mut taken: Vec<usize> = Vec::new();
    for i in order {
        if taken.len() < most && taken.iter().all(|t| t.abs_diff(i) >= apart) {
            taken.push(i);
        }
    }
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;

    #[test]
    fn textbook_values_leave_the_bounds_and_keep_distances() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let model = Model::new("gipps".parse().expect("a base"), &drives, &Overrides::new(), &[]).expect("a model");
        let on_bounds: Vec<f64> = model.axes.iter().map(|axis| axis.lower).collect();
        let moved = with_textbook_values(&model, &on_bounds, 23.0);
        let value = |of: &[f64], name: &str| of[model.symbols.iter().position(|s| s.name() == name).expect(name)];
        assert_eq!(["a_min", "a_hat_min", "theta", "v_0"].map(|name| value(&moved, name)), [-2.5, -2.5, 0.4, 27.0]);
        assert_eq!(["d_0", "t_h"].map(|name| value(&moved, name)), ["d_0", "t_h"].map(|name| value(&on_bounds, name)));
    }

    #[test]
    fn only_precise_sensors_and_events_are_searched_with_more_noise() {
        let noise = |r_s: f64, r_v: f64| Noise { sigma_d: 0.1, tau_d: 2.0, r_s, r_v, r_l: 1e-3 };
        let levels = |noise: &Noise| (noise.r_s, noise.r_v);
        assert_eq!(softened(&noise(0.02, 0.015), false), None);
        assert_eq!(softened(&noise(0.0005, 0.03), false).as_ref().map(levels), Some((0.02, 0.03)));
        assert_eq!(softened(&noise(0.05, 0.003), false).as_ref().map(levels), Some((0.05, 0.02)));
        assert_eq!(softened(&noise(0.02, 0.02), true).as_ref().map(levels), Some((0.2, 0.2)));
        assert_eq!(softened(&noise(0.0005, 0.003), true).map(|soft| soft.sigma_d), Some(0.1));
    }
}
