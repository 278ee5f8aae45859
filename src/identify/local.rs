//! The score near its minimum: a quadratic form, and the influence of every sample on every parameter.
//!
//! The score is Σ_k w_k √m_k over signals (and the mean over cases), where m_k is the mean of squared residuals e². Its second
//! derivatives are taken without those of e (Gauss and Newton), which keeps the form from falling anywhere.

use super::long_run::long_run;
use super::student;
use crate::calibrate::SearchSpace;
use crate::convention::Denominators;
use crate::evaluator::Case;
use crate::reference::{Reference, Trace};
use crate::score::{Accumulation, GoodnessOfFit, Measured, denominator, is_relative};
use nalgebra::{DMatrix, DVector};

/// Steps of the differences, shares of a parameter's range: the first one at which anything changes.
const STEPS: [f64; 4] = [1e-3, 1e-2, 0.1, 0.3];

/// Share of its largest eigenvalue that is added to the quadratic form, so that a parameter that does nothing has a variance.
const RIDGE: f64 = 1e-9;

/// Residuals of one signal of one case, and their derivatives by each searched parameter, in shares of its range.
struct SignalResiduals {
    /// Weight of √m in the score.
    weight: f64,
    /// 1 / number of samples that count.
    per_count: f64,
    residual: Vec<f64>,
    slopes: Vec<Vec<f64>>,
}

/// The local picture of a calibrated candidate.
pub(super) struct Local {
    /// Positions of the searched parameters in the space.
    pub(super) free: Vec<usize>,
    /// Which of them lie on a bound.
    on_bound: Vec<bool>,
    /// Second derivatives of the score by shares of the ranges.
    pub(super) curvature: DMatrix<f64>,
    /// Σ over samples of the score's gradient, one series per case: sample by sample, parameter by parameter.
    gradients: Vec<Vec<DVector<f64>>>,
    /// Simulations.
    pub(super) evaluations: u64,
}

/// How far a parameter may be off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// Half of the interval that the quadratic form gives, a share of the range.
    pub(super) half: f64,
    /// Rise of the re-optimised score at its ends.
    pub(super) rise: f64,
    pub(super) effective_samples: f64,
}

impl Local {
    /// `None` if the candidate, or all its neighbours in some direction, cannot be simulated.
    pub(super) fn new(cases: &[Case], gof: &GoodnessOfFit, space: &SearchSpace, candidate: &[f64]) -> Option<Local> {
        let free = space.free();
        let on = space.at_bound(candidate);
        let on_bound = free.iter().map(|&i| on.contains(&space.symbols[i])).collect();
        let n = free.len();
        let mut local =
            Local { free, on_bound, curvature: DMatrix::zeros(n, n), gradients: Vec::new(), evaluations: 0 };
        for case in cases {
            let signals = local.signals(case, gof, space, candidate)?;
            local.add(&signals, cases.len() as f64);
        }
        let largest = local.curvature.diagonal().max();
        if !largest.is_finite() || largest <= 0.0 {
            return None;
        }
        for i in 0..n {
            local.curvature[(i, i)] += RIDGE * largest;
        }
        Some(local)
    }

    /// Residuals and slopes of all signals that are compared.
    fn signals(
        &mut self,
        case: &Case,
        gof: &GoodnessOfFit,
        space: &SearchSpace,
        candidate: &[f64],
    ) -> Option<Vec<SignalResiduals>> {
        let mut trace = Trace::default();
        let mut run = |values: &[f64]| {
            let parameters = space.parameters(values);
            let whole = Reference::outcome(case, &parameters, &mut trace).result.is_ok();
            let first = case.first_sample(parameters.tau_p);
            whole.then(|| ([trace.s.clone(), trace.v.clone(), trace.a.clone()], first))
        };
        let (here, mut first) = run(candidate)?;
        self.evaluations += 1;
        // Per parameter: the signals on both sides, and their distance.
        let mut sides = Vec::new();
        for &i in &self.free {
            let [lower, upper] = space.bounds[i];
            let mut found = None;
            for step in STEPS {
                let at = |share: f64| {
                    let mut moved = candidate.to_vec();
                    moved[i] = (candidate[i] + share * (upper - lower)).clamp(lower, upper);
                    moved
                };
                let (below, above) = (at(-step), at(step));
                self.evaluations += 2;
                let low = run(&below).map_or((candidate[i], here.clone(), first), |(s, f)| (below[i], s, f));
                let high = run(&above).map_or((candidate[i], here.clone(), first), |(s, f)| (above[i], s, f));
                first = first.max(low.2).max(high.2);
                let distance = (high.0 - low.0) / (upper - lower);
                if distance > 0.0 {
                    let changes = low.1 != high.1;
                    found = Some((low.1, high.1, distance));
                    if changes {
                        break;
                    }
                }
            }
            sides.push(found?);
        }

        let floored = case.convention.denominators == Denominators::Floored;
        let observed: [&[f64]; 3] = [&case.s, &case.v_f, &case.a_f];
        let floor = [false, floored, false];
        let measured = [0, 1, 2].map(|k| Measured::of(&observed[k][first..], floor[k]));
        let norm = gof.norm(&measured);
        let kind = gof.accumulation();
        let mut signals = Vec::new();
        for k in (0..3).filter(|&k| norm.per_count[k] > 0.0) {
            let residual_of = |simulated: &[f64]| -> Vec<f64> {
                let pairs = simulated[first..].iter().zip(&observed[k][first..]);
                pairs.map(|(sim, obs)| residual(kind, *sim, *obs, floor[k])).collect()
            };
            let slope = |(low, high, distance): &([Vec<f64>; 3], [Vec<f64>; 3], f64)| -> Vec<f64> {
                let (low, high) = (residual_of(&low[k]), residual_of(&high[k]));
                low.iter().zip(&high).map(|(low, high)| (high - low) / distance).collect()
            };
            let mut weight = norm.weight[k];
            if kind == Accumulation::Theil {
                // The simulated part of the denominator as it is at the minimum.
                let square: f64 = here[k][first..].iter().map(|x| x * x).sum();
                weight /= (square * norm.per_count[k]).sqrt() + norm.rms_measured[k];
            }
            let slopes = sides.iter().map(slope).collect();
            signals.push(SignalResiduals {
                weight,
                per_count: norm.per_count[k],
                residual: residual_of(&here[k]),
                slopes,
            });
        }
        Some(signals)
    }

    /// Adds a case to the curvature, and its series of gradients.
    fn add(&mut self, signals: &[SignalResiduals], cases: f64) {
        let n = self.free.len();
        let samples = signals[0].residual.len();
        let mut series = vec![DVector::zeros(n); samples];
        for signal in signals {
            let mean_square = signal.residual.iter().map(|e| e * e).sum::<f64>() * signal.per_count;
            if mean_square <= 0.0 {
                continue;
            }
            // d(w √m)/dm, and d²(w √m)/dm².
            let first = signal.weight / (2.0 * mean_square.sqrt()) / cases;
            let second = -first / (2.0 * mean_square);
            let mut mean_slope = DVector::zeros(n);
            let mut form = DMatrix::zeros(n, n);
            for (t, e) in signal.residual.iter().enumerate() {
                let slope = DVector::from_iterator(n, signal.slopes.iter().map(|s| s[t]));
                mean_slope.axpy(2.0 * e * signal.per_count, &slope, 1.0);
                form.ger(2.0 * signal.per_count, &slope, &slope, 1.0);
            }
            self.curvature += form * first + &mean_slope * mean_slope.transpose() * second;
            // The mean over samples of these is the gradient; the second term is what the sample changes in the weight of the signal.
            let scale = signal.per_count * samples as f64;
            for (t, e) in signal.residual.iter().enumerate() {
                let slope = DVector::from_iterator(n, signal.slopes.iter().map(|s| s[t]));
                series[t].axpy(first * 2.0 * e * scale, &slope, 1.0);
                series[t].axpy(second * (e * e * scale - mean_square), &mean_slope, 1.0);
            }
        }
        self.gradients.push(series);
    }

    /// Inverse of the curvature over the parameters inside their bounds and parameter `k`: positions, matrix.
    fn inverse(&self, k: usize) -> (Vec<usize>, DMatrix<f64>) {
        let inside: Vec<usize> = (0..self.free.len()).filter(|&i| i == k || !self.on_bound[i]).collect();
        let form = DMatrix::from_fn(inside.len(), inside.len(), |a, b| self.curvature[(inside[a], inside[b])]);
        // Never singular: the ridge.
        let diagonal = DMatrix::from_diagonal(&form.diagonal().map(|x| 1.0 / x));
        let inverse = form.cholesky().map_or(diagonal, |c| c.inverse());
        (inside, inverse)
    }

    /// How far parameter `k` may be off.
    pub(super) fn spread(&self, k: usize) -> Spread {
        let (inside, inverse) = self.inverse(k);
        let row = inside.iter().position(|&i| i == k).expect("k is among them");
        let (mut long, mut short, mut samples) = (0.0, 0.0, 0.0);
        for series in &self.gradients {
            let influence: Vec<f64> = series
                .iter()
                .map(|g| inside.iter().enumerate().map(|(c, &i)| inverse[(row, c)] * g[i]).sum::<f64>())
                .collect();
            let variances = long_run(&influence);
            let count = influence.len() as f64;
            // The gradient of the score is the sum of the means over the cases, which are independent drives.
            long += variances.long_run / count;
            short += variances.variance / count;
            samples += count;
        }
        let effective_samples = if long > 0.0 { (samples * short / long).min(samples) } else { samples };
        let half = student(effective_samples - 1.0) * long.sqrt();
        let rise = half * half / (2.0 * inverse[(row, row)].max(f64::MIN_POSITIVE));
        Spread { half, rise, effective_samples }
    }

    /// How the others follow parameter `k` when it moves by 1: the bottom of the quadratic valley.
    pub(super) fn follow(&self, k: usize) -> DVector<f64> {
        let (inside, inverse) = self.inverse(k);
        let row = inside.iter().position(|&i| i == k).expect("k is among them");
        let mut direction = DVector::zeros(self.free.len());
        for (c, &i) in inside.iter().enumerate() {
            direction[i] = inverse[(c, row)] / inverse[(row, row)];
        }
        direction
    }
}

/// What is squared and averaged.
fn residual(kind: Accumulation, simulated: f64, observed: f64, floored: bool) -> f64 {
    let measured = denominator(observed, floored);
    match kind {
        Accumulation::Squared | Accumulation::Theil => simulated - observed,
        Accumulation::Floored => simulated - measured,
        Accumulation::Relative if is_relative(observed, floored) => (simulated - observed) / measured,
        Accumulation::Relative => 0.0,
    }
}
