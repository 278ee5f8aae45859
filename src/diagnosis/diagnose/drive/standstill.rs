//! The sign of the noise of a speed at standstill.
//!
//! A sensor that counts wheel revolutions reads no negative speed, and [`prepare`](crate::trajectory::prepare) sets it to zero. Noise
//! around zero is then one-sided, and its mean, up to 0.8 standard deviations, looks like a speed that no model of a standing car has.

use super::smoothing::rough;
use crate::optimize::normal;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Samples in a row in which a car stands if a speed of zero explains them.
const STRETCH: usize = 21;
/// Largest root mean square of such a stretch, in standard deviations of the noise: noise alone has 1, and one in seven of its stretches is
/// above. A sample counts as standing if any stretch with it does.
const ALONE: f64 = 1.15;
/// Share of exact zeros at which they are negative readings set to zero. Fewer come from rounding, more from a sensor that detects
/// standstill.
const CUT_OFF: std::ops::Range<f64> = 0.2..0.8;

/// A speed \[m/s\] with a random but reproducible sign for each reading at standstill. `stream` differs between the signals of a drive.
pub(crate) fn with_signs(v: &[f64], stream: u64) -> Vec<f64> {
    let mut signed = v.to_vec();
    let noise = rough(v);
    let standing = standing(v, noise);
    let (count, zeros) = (standing.len(), standing.iter().filter(|&&i| v[i] == 0.0).count());
    let share = zeros as f64 / count.max(1) as f64;
    if noise <= 0.0 || share >= CUT_OFF.end || v.iter().any(|v| *v < 0.0) {
        return signed;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(stream);
    let size = (standing.iter().map(|&i| v[i] * v[i]).sum::<f64>() / (count - zeros).max(1) as f64).sqrt();
    for i in standing {
        if share < CUT_OFF.start {
            signed[i] *= if rng.random() { 1.0 } else { -1.0 };
        } else if v[i] == 0.0 {
            signed[i] = -size * normal(&mut rng).abs();
        }
    }
    signed
}

/// Samples that a speed of zero explains.
fn standing(v: &[f64], noise: f64) -> Vec<usize> {
    let most = (ALONE * noise).powi(2) * STRETCH as f64;
    // A reading that was set to zero was as large as the rest of the noise.
    let square = |v: &f64| if *v == 0.0 { noise * noise } else { v * v };
    let mut stands = vec![false; v.len()];
    for (from, stretch) in v.windows(STRETCH).enumerate() {
        if stretch.iter().map(square).sum::<f64>() <= most {
            stands[from..from + STRETCH].fill(true);
        }
    }
    (0..v.len()).filter(|&i| stands[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: f64 = 0.02;

    /// A minute at 1.5 m/s and more, half a minute at rest, a minute of driving, with noise, as `sensor` reads it.
    fn read(sensor: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let true_speed = |i: usize| if (600..900).contains(&i) { 0.0 } else { 2.5 + (i as f64 / 50.0).sin() };
        (0..1500).map(|i| sensor(true_speed(i) + NOISE * normal(&mut rng))).collect()
    }

    fn mean_at_rest(v: &[f64]) -> f64 {
        v[600..900].iter().sum::<f64>() / 300.0
    }

    #[test]
    fn a_sensor_without_a_sign_gets_one() {
        let v = read(f64::abs);
        assert!(mean_at_rest(&v) > 0.7 * NOISE);
        let signed = with_signs(&v, 1);
        // Four standard deviations of a mean of 300.
        assert!(mean_at_rest(&signed).abs() < 4.0 * NOISE / 300.0_f64.sqrt(), "{}", mean_at_rest(&signed));
        assert!(v.iter().zip(&signed).all(|(v, signed)| *v == signed.abs()), "sizes are kept");
        assert!(v[..600] == signed[..600] && v[900..] == signed[900..], "a moving car is left alone");
        assert!(signed == with_signs(&v, 1), "the same every time");
        assert!(signed != with_signs(&v, 2), "signals have signs of their own");
    }

    #[test]
    fn readings_that_were_set_to_zero_get_the_size_of_the_others() {
        let v = read(|v| v.max(0.0));
        assert!(mean_at_rest(&v) > 0.3 * NOISE);
        let signed = with_signs(&v, 1);
        assert!(mean_at_rest(&signed).abs() < 4.0 * NOISE / 300.0_f64.sqrt(), "{}", mean_at_rest(&signed));
        let rms = (signed[600..900].iter().map(|v| v * v).sum::<f64>() / 300.0).sqrt();
        assert!((rms / NOISE - 1.0).abs() < 0.15, "{rms}");
        assert!(v.iter().zip(&signed).all(|(v, signed)| *v == 0.0 || v == signed), "the readings are kept");
    }

    #[test]
    fn other_speeds_are_left_alone() {
        let signed_already = read(|v| v);
        let knows_that_it_stands = read(|v| if v < 0.5 { 0.0 } else { v });
        let creeps = read(|v| if v < 0.5 { (v + 2.0 * NOISE).abs() } else { v });
        let without_noise: Vec<f64> = (0..1500).map(|i| f64::from((i - 600).max(0)) * 0.001).collect();
        for (k, v) in [signed_already, knows_that_it_stands, creeps, without_noise, Vec::new()].iter().enumerate() {
            assert!(with_signs(v, 1) == *v, "signal {k}");
        }
    }
}
