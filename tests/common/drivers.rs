//! Tables of made-up drivers, each an IDM with own parameters, with a lag or without.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;

/// Step of the simulation \[s\], and number of steps between samples.
const STEP: f64 = 0.02;
const EVERY: usize = 5;
/// Time constant of the drivers' lag \[s\].
const LAG: f64 = 1.0;
/// Shortest and longest drive \[s\].
const LASTS: [f64; 2] = [25.0, 50.0];

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// v_0, t_h, d_0, a_max and a_min of a driver, the last without its sign.
pub type Own = [f64; 5];
/// Medians of the parameters.
pub const MIDDLE: Own = [33.0, 1.3, 2.5, 1.4, 1.8];
/// Standard deviations of their logarithms, over that of the headway: speed limits and cars make desired speeds alike.
pub const RELATIVE: Own = [0.2, 1.0, 1.0, 1.0, 1.0];
/// Standard deviation of the logarithm of a human driver's headway.
pub const SPREAD: f64 = 0.25;

/// One drive of an IDM with own parameters, with a lag or without: rows of time, spacing, speed and speed ahead. Another one if it comes
/// too close.
fn drive(rng: &mut ChaCha8Rng, spread: f64, lags: bool) -> (Vec<[f64; 4]>, Own) {
    let own: Own = std::array::from_fn(|k| MIDDLE[k] * (spread * RELATIVE[k] * normal(rng)).exp());
    let [v_0, t_h, d_0, a_max, a_min] = own;
    let samples = ((LASTS[0] + rng.random::<f64>() * (LASTS[1] - LASTS[0])) / STEP) as usize;
    let mut v_l = 8.0 + 18.0 * rng.random::<f64>();
    let (mut target, mut pull, mut change) = (v_l, 0.3, 0.0);
    let mut v = v_l * (0.9 + 0.15 * rng.random::<f64>());
    let mut s = (d_0 + t_h * v) * (0.95 + 0.35 * rng.random::<f64>());
    let (mut gust, mut moved, mut rows) = (0.0, 0.0, Vec::new());
    for k in 0..samples {
        let t = STEP * k as f64;
        if t >= change {
            (target, pull) = (2.0 + 26.0 * rng.random::<f64>(), 0.1 + 0.4 * rng.random::<f64>());
            change = t + 6.0 + 8.0 * rng.random::<f64>();
        }
        if k % EVERY == 0 {
            let noisy = |value: f64, rng: &mut ChaCha8Rng| value + 0.05 * normal(rng);
            rows.push([t, noisy(s, rng), noisy(v, rng).max(0.0), noisy(v_l, rng).max(0.0)]);
        }
        let a_l = (pull * (target - v_l)).clamp(-3.5, 2.0).max(-v_l / STEP);
        let wanted = d_0 + (t_h * v + v * (v - v_l) / (2.0 * (a_max * a_min).sqrt())).max(0.0);
        let command = a_max * (1.0 - (v / v_0).powi(4) - (wanted / s.max(0.3)).powi(2));
        moved += if lags { (command - moved) * STEP / LAG } else { command - moved };
        gust += -gust * STEP / 1.5 + 0.1 * (2.0 * STEP / 1.5_f64).sqrt() * normal(rng);
        let a = (moved + gust).max(-v / STEP);
        s += (v_l - v) * STEP + 0.5 * (a_l - a) * STEP * STEP;
        (v_l, v) = (v_l + a_l * STEP, v + a * STEP);
        if s < 1.0 {
            return drive(rng, spread, lags);
        }
    }
    (rows, own)
}

/// A table of drivers, and their parameters; the first `with` of them have a lag.
pub fn table(drivers: usize, spread: f64, with: usize, seed: u64) -> (String, Vec<Own>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut table = String::from("driver,time_s,spacing_m,speed_mps,lead_speed_mps\n");
    let mut all = Vec::new();
    for k in 0..drivers {
        let (rows, own) = drive(&mut rng, spread, k < with);
        for [t, s, v, v_l] in rows {
            writeln!(table, "{k},{t:.1},{s:.3},{v:.3},{v_l:.3}").expect("a String");
        }
        all.push(own);
    }
    (table, all)
}

/// The column map of the table.
pub const MAP: &str = r#"
title = "events"
rows = "pairs"
[columns]
group = { name = "driver" }
time = { name = "time_s", unit = "s" }
speed = { name = "speed_mps", unit = "m/s" }
lead_speed = { name = "lead_speed_mps", unit = "m/s" }
gap = { name = "spacing_m", unit = "m" }
"#;
