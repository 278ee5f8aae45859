//! A spectrum whose noise ends at a frequency: the signal was sampled at twice that and interpolated.

use super::link::{Link, Signal};
use crate::fourier;
use crate::statistics::upper_median;

/// Samples of one periodogram.
const WINDOW: usize = 256;
/// Flatness of the plateau of noise before the end, and distance of the rest below it, as factors of power.
const FLAT: f64 = 4.0;
const DROP: f64 = 100.0;

/// Mean periodogram of the second differences, divided by that of differenced white noise.
fn noise_spectrum(signal: &Signal, link: &Link) -> Option<Vec<f64>> {
    let y = signal.values;
    let mut input = vec![0.0; WINDOW];
    let mut power = vec![0.0; WINDOW / 2 + 1];
    let mut windows = 0;
    let mut start = 0;
    while start + WINDOW + 2 <= y.len() {
        let complete = (start..start + WINDOW + 2).all(|i| y[i].is_finite() && link.driving(i));
        if !complete {
            start += WINDOW / 8;
            continue;
        }
        for (k, x) in input.iter_mut().enumerate() {
            let i = start + k;
            let hann = 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / WINDOW as f64).cos();
            *x = hann * (y[i + 2] - 2.0 * y[i + 1] + y[i]);
        }
        power.iter_mut().zip(fourier::power(&input)).for_each(|(sum, p)| *sum += p);
        windows += 1;
        start += WINDOW / 2;
    }
    if windows < 4 {
        return None;
    }
    for (k, p) in power.iter_mut().enumerate() {
        let gain = 2.0 - 2.0 * (std::f64::consts::TAU * k as f64 / WINDOW as f64).cos();
        *p /= f64::from(windows) * (gain * gain).max(1e-6);
    }
    Some(power)
}

/// File rate over true rate, if the noise has a plateau that ends.
pub(super) fn cut_off(signal: &Signal, link: &Link) -> Option<f64> {
    let power = noise_spectrum(signal, link)?;
    let last = power.len() - 1;
    let median =
        |from: f64, to: f64| upper_median(power[from.ceil() as usize..=(to as usize).min(last)].iter().copied());
    let found = (last / 8..last * 9 / 10).filter_map(|k| {
        let f = k as f64;
        let (low, high) = (median(0.5 * f, 0.7 * f)?, median(0.75 * f, 0.92 * f)?);
        let after = median(1.1 * f, (1.4 * f).min(last as f64))?;
        let ends = low < FLAT * high && high > DROP * after;
        // The end is where the power crosses the geometric mean of both sides.
        ends.then(|| {
            let edge = (high * after).sqrt();
            let from = (0.75 * f) as usize;
            (from..=last).find(|&i| power[i] < edge).unwrap_or(k)
        })
    });
    let edges: Vec<usize> = found.collect();
    let edge = edges.get(edges.len() / 2)?;
    Some(last as f64 / *edge as f64)
}
