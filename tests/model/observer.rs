//! The observer computed independently, one number at a time, from docs/DIAGNOSIS.md section 1 and the paper's Eqs. 1 to 3, 6 and 7: its
//! gains, innovations and states. Only the data come from the program.

use crate::common::cars;
use leadlag::internal::convention::Convention;
use leadlag::internal::diagnose::Noise;
use leadlag::internal::diagnose::likelihood::observer::design;
use leadlag::internal::evaluator::{Case, Innovations, Job, Observer, Population};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::score::GoodnessOfFit;

/// Runs of 900 steps, in which roundings add up but are corrected at every sample; gains by some ten thousand steps of an iteration.
const EQUAL: f64 = 1e-9;
/// Number of steps until the filter is stationary: many times the slowest time constant.
const STEADY: usize = 60_000;

type Square = [[f64; 3]; 3];

fn product(a: &Square, b: &Square) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// The gains on the innovations of s and v_f, by the textbook filter after a long run: state (s, v_f, d), s and v_f measured.
fn gains(noise: &Noise, dt: f64) -> [[f64; 2]; 3] {
    let decay = (-dt / noise.tau_d).exp();
    let a = [[1.0, -dt, -dt * dt / 2.0], [0.0, 1.0, dt], [0.0, 0.0, decay]];
    let transposed = std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]));
    let driven = [(noise.r_l * dt).powi(2), 0.0, noise.sigma_d.powi(2) * (1.0 - decay * decay)];
    let mut p: Square = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut k = [[0.0; 2]; 3];
    for _ in 0..STEADY {
        let (s_11, s_12, s_22) = (p[0][0] + noise.r_s.powi(2), p[0][1], p[1][1] + noise.r_v.powi(2));
        let det = s_11 * s_22 - s_12 * s_12;
        k = p.map(|row| [(row[0] * s_22 - row[1] * s_12) / det, (row[1] * s_11 - row[0] * s_12) / det]);
        let known: Square =
            std::array::from_fn(|i| std::array::from_fn(|j| p[i][j] - k[i][0] * p[0][j] - k[i][1] * p[1][j]));
        p = product(&product(&a, &known), &transposed);
        (0..3).for_each(|i| p[i][i] += driven[i]);
    }
    k
}

/// Innovations (r_s, r_v) and states (s, v_f, d) from sample 1 on: predicted with the model and d, corrected by the measurement.
fn observed(
    case: &Case,
    k: &[[f64; 2]; 3],
    decay: f64,
    law: &dyn Fn(f64, f64, f64) -> f64,
) -> Vec<([f64; 2], [f64; 3])> {
    let (mut s, mut v, mut d) = (case.s[0], case.v_f[0], 0.0);
    let mut runs = Vec::new();
    for t in 1..case.s.len() {
        let v_next = (v + (law(s, v, case.v_l[t - 1]) + d) * case.dt).max(0.0);
        s += case.x_l[t] - case.x_l[t - 1] - (v + v_next) / 2.0 * case.dt;
        (v, d) = (v_next, d * decay);
        let r = [s - case.s[t], v - case.v_f[t]];
        let correction = k.map(|row| row[0] * r[0] + row[1] * r[1]);
        (s, v, d) = (s - correction[0], (v - correction[1]).max(0.0), d - correction[2]);
        runs.push((r, [s, v, d]));
    }
    runs
}

/// The same by the program, with its own design of the observer.
fn of_lanes(case: &Case, values: &[f64], noise: &Noise) -> Innovations {
    let mut population = Population::new(&case.variant.parameters());
    population.push(values);
    let designed = design(noise, case.dt);
    let observer = Observer { gain: designed.gain, whitening: designed.whitening, decay: designed.decay };
    let lanes = Lanes::new(vec![case.clone()], GoodnessOfFit::default(), LanesPrecision::F64).expect("a valid text");
    let job = Job { case: 0, population: &population };
    lanes.innovations(&job, &[observer]).expect("no delay").remove(0)
}

#[test]
fn a_scalar_observer_from_the_formulas_sees_the_same() {
    let [v_0, d_0, t_h] = [33.0, 2.5, 1.4];
    let [delta, a_max, a_min]: [f64; 3] = [4.0, 1.5, -2.0];
    let idm = |s: f64, v: f64, v_l: f64| {
        let desired = d_0 + (t_h * v - v * (v_l - v) / (2.0 * (-a_max * a_min).sqrt())).max(0.0);
        a_max * (1.0 - (v / v_0).powf(delta) - (desired / s).powi(2))
    };
    let [k_s, k_v, k_0] = [0.15, 0.5, 0.4];
    let linear = |s: f64, v: f64, v_l: f64| (k_v * (v_l - v) - k_s * (d_0 + t_h * v - s)).min(k_0 * (v_0 - v));
    let value = |name: &str| match name {
        "v_0" => v_0,
        "d_0" => d_0,
        "t_h" => t_h,
        "delta" => delta,
        "a_max" => a_max,
        "a_min" => a_min,
        "k_s" => k_s,
        "k_v" => k_v,
        "k_0" => k_0,
        other => panic!("{other} is not a parameter of these models"),
    };
    let drive = cars::drive(90.0);
    // A usual observer, a strong one, and almost a free simulation.
    let usual = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.03, r_l: 0.02 };
    let noises = [usual, Noise { sigma_d: 0.5, tau_d: 0.5, ..usual }, Noise { sigma_d: 0.003, r_l: 0.001, ..usual }];
    for (base, law) in [("idm", &idm as &dyn Fn(f64, f64, f64) -> f64), ("l-cth", &linear)] {
        let case = cars::case(&drive, base.parse().expect("a base"), Convention::PAPER);
        let values: Vec<f64> = case.variant.parameters().iter().map(|symbol| value(symbol.name())).collect();
        for noise in &noises {
            let k = gains(noise, case.dt);
            let theirs = of_lanes(&case, &values, noise);
            let mine = observed(&case, &k, (-case.dt / noise.tau_d).exp(), law);
            assert_eq!((theirs.failed, theirs.first), (None, 1), "{base} {noise:?}");
            let mut largest: f64 = 0.0;
            for (t, (r, state)) in mine.iter().enumerate().map(|(i, run)| (i + 1, run)) {
                let pairs = r.iter().zip(&theirs.residual[t]).chain(state.iter().zip(&theirs.state[t]));
                for (mine, theirs) in pairs {
                    assert!((mine - theirs).abs() <= EQUAL, "{base} {noise:?}, sample {t}: {mine} not {theirs}");
                }
                largest = largest.max(r[0].abs());
            }
            // There is a correction.
            assert!(largest > 0.001, "{base} {noise:?}: innovations of at most {largest} m");
        }
    }
}
