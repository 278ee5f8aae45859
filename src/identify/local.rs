//! The score near its minimum: a quadratic form, and what becomes of its minimum when a part of the drive is left out.
//!
//! The score is Σ_k w_k √m_k over signals (and the mean over cases), where m_k is the mean of squared residuals e². Its second
//! derivatives are taken without those of e (Gauss and Newton), which keeps the form from falling anywhere.

use super::student;
use crate::calibrate::SearchSpace;
use crate::convention::Denominators;
use crate::evaluator::Case;
use crate::reference::{Reference, Trace};
use crate::score::{Accumulation, GoodnessOfFit, Measured, denominator, is_relative};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

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

/// Blocks into which each drive is cut for the jackknife. Ten: long against the memory of the residuals in a drive of minutes, and
/// enough for a variance.
const BLOCKS: usize = 10;

/// The score of one case and its derivatives; also those without each block.
struct CaseForm {
    whole: Form,
    without: Vec<Form>,
    /// What each sample adds to the gradient, whose mean it is.
    samples: Vec<DVector<f64>>,
}

/// Gradient and second derivatives by shares of the ranges.
#[derive(Clone)]
struct Form {
    gradient: DVector<f64>,
    curvature: DMatrix<f64>,
}

/// The local picture of a calibrated candidate.
pub(super) struct Local {
    /// Positions of the searched parameters in the space.
    pub(super) free: Vec<usize>,
    /// Which of them lie on a bound.
    on_bound: Vec<bool>,
    /// Second derivatives of the score by shares of the ranges.
    pub(super) curvature: DMatrix<f64>,
    cases: Vec<CaseForm>,
    /// Added to the diagonal of every form.
    ridge: f64,
    /// Simulations.
    pub(super) evaluations: u64,
}

/// How far a parameter may be off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// Half of the interval that the quadratic form gives, a share of the range.
    pub(super) half: f64,
    /// Rise of the re-optimised score at its ends; NaN for a parameter that changes nothing.
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
            Local { free, on_bound, curvature: DMatrix::zeros(n, n), cases: Vec::new(), ridge: 0.0, evaluations: 0 };
        for case in cases {
            let signals = local.signals(case, gof, space, candidate)?;
            local.cases.push(CaseForm::new(&signals, n, cases.len() as f64));
        }
        for case in &local.cases {
            local.curvature += &case.whole.curvature;
        }
        let largest = local.curvature.diagonal().max();
        if !largest.is_finite() || largest <= 0.0 {
            return None;
        }
        local.ridge = RIDGE * largest;
        local.curvature += DMatrix::identity(n, n) * local.ridge;
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

    /// The parameters inside their bounds, and parameter `k`.
    fn inside(&self, k: usize) -> Vec<usize> {
        (0..self.free.len()).filter(|&i| i == k || !self.on_bound[i]).collect()
    }

    /// How far parameter `k` may be off: the jackknife that leaves out one block at a time (H. R. Künsch, Annals of Statistics 17, 1989),
    /// one step of Newton's method from the whole drive's minimum each. A block that is long against the memory of the residuals
    /// takes their autocorrelation along.
    pub(super) fn spread(&self, k: usize) -> Spread {
        let inside = self.inside(k);
        let row = inside.iter().position(|&i| i == k).expect("k is among them");
        let n = self.free.len();
        let zero = Form { gradient: DVector::zeros(n), curvature: DMatrix::identity(n, n) * self.ridge };
        let whole = self.cases.iter().fold(zero, |sum, case| sum.plus(&case.whole, 1.0));
        let inverse = inverse(&whole.curvature, &inside);

        let (mut variance, mut independent, mut samples) = (0.0, 0.0, 0.0);
        for case in &self.cases {
            let without = case.without.iter().map(|form| {
                let left = whole.clone().plus(&case.whole, -1.0).plus(form, 1.0);
                left.step(&inside)[row]
            });
            let minima: Vec<f64> = without.collect();
            let blocks = minima.len() as f64;
            let mean = minima.iter().sum::<f64>() / blocks;
            variance += (blocks - 1.0) / blocks * minima.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
            let count = case.samples.len() as f64;
            let influence =
                |g: &DVector<f64>| inside.iter().enumerate().map(|(c, &i)| inverse[(row, c)] * g[i]).sum::<f64>();
            independent += case.samples.iter().map(|g| influence(g).powi(2)).sum::<f64>() / (count * count);
            samples += count;
        }
        let effective_samples = if variance > 0.0 { (samples * independent / variance).min(samples) } else { samples };
        // A parameter that changes nothing has the ridge as its curvature, and may be anywhere.
        if whole.curvature[(k, k)] < 10.0 * self.ridge || variance <= 0.0 {
            return Spread { half: 1.0, rise: f64::NAN, effective_samples: 0.0 };
        }
        let freedom = (BLOCKS - 1) * self.cases.len();
        let half = student(freedom as f64) * variance.sqrt();
        let rise = half * half / (2.0 * inverse[(row, row)].max(f64::MIN_POSITIVE));
        Spread { half, rise, effective_samples }
    }

    /// How the others follow parameter `k` when it moves by 1: the bottom of the quadratic valley.
    pub(super) fn follow(&self, k: usize) -> DVector<f64> {
        let inside = self.inside(k);
        let inverse = inverse(&self.curvature, &inside);
        let row = inside.iter().position(|&i| i == k).expect("k is among them");
        let mut direction = DVector::zeros(self.free.len());
        for (c, &i) in inside.iter().enumerate() {
            direction[i] = inverse[(c, row)] / inverse[(row, row)];
        }
        direction
    }
}

impl CaseForm {
    /// Of one case of so many.
    fn new(signals: &[SignalResiduals], n: usize, cases: f64) -> CaseForm {
        let count = signals[0].residual.len();
        let edges: Vec<usize> = (0..=BLOCKS).map(|b| b * count / BLOCKS).collect();
        let zero = Form { gradient: DVector::zeros(n), curvature: DMatrix::zeros(n, n) };
        let mut form =
            CaseForm { whole: zero.clone(), without: vec![zero; BLOCKS], samples: vec![DVector::zeros(n); count] };
        for signal in signals {
            let slope = |t: usize| DVector::from_iterator(n, signal.slopes.iter().map(|s| s[t]));
            let blocks: Vec<Sums> = edges.windows(2).map(|w| Sums::of(signal, w[0]..w[1], n)).collect();
            let all = blocks.iter().fold(Sums::zero(n), |sum, block| sum.plus(block, 1.0));
            form.whole = form.whole.plus(&all.form(signal.weight / cases, signal.per_count), 1.0);
            for (without, (block, w)) in form.without.iter_mut().zip(blocks.iter().zip(edges.windows(2))) {
                let per_count = signal.per_count * count as f64 / (count - (w[1] - w[0])) as f64;
                let rest = all.clone().plus(block, -1.0);
                *without = without.clone().plus(&rest.form(signal.weight / cases, per_count), 1.0);
            }
            let mean_square = all.square * signal.per_count;
            if mean_square > 0.0 {
                let factor = signal.weight / cases / mean_square.sqrt() * signal.per_count * count as f64;
                for (t, sample) in form.samples.iter_mut().enumerate() {
                    sample.axpy(factor * signal.residual[t], &slope(t), 1.0);
                }
            }
        }
        form
    }
}

/// Sums over samples of e², e ∂e and ∂e ∂eᵀ.
#[derive(Clone)]
struct Sums {
    square: f64,
    mixed: DVector<f64>,
    slopes: DMatrix<f64>,
}

impl Sums {
    fn zero(n: usize) -> Sums {
        Sums { square: 0.0, mixed: DVector::zeros(n), slopes: DMatrix::zeros(n, n) }
    }

    fn of(signal: &SignalResiduals, samples: Range<usize>, n: usize) -> Sums {
        let mut sums = Sums::zero(n);
        for t in samples {
            let (e, slope) = (signal.residual[t], DVector::from_iterator(n, signal.slopes.iter().map(|s| s[t])));
            sums.square += e * e;
            sums.mixed.axpy(e, &slope, 1.0);
            sums.slopes.ger(1.0, &slope, &slope, 1.0);
        }
        sums
    }

    fn plus(self, other: &Sums, factor: f64) -> Sums {
        Sums {
            square: self.square + factor * other.square,
            mixed: self.mixed + &other.mixed * factor,
            slopes: self.slopes + &other.slopes * factor,
        }
    }

    /// Derivatives of w √(Σ e² / count).
    fn form(&self, weight: f64, per_count: f64) -> Form {
        let mean_square = self.square * per_count;
        if mean_square <= 0.0 {
            let n = self.mixed.len();
            return Form { gradient: DVector::zeros(n), curvature: DMatrix::zeros(n, n) };
        }
        // d(w √m)/dm, and d²(w √m)/dm².
        let first = weight / (2.0 * mean_square.sqrt());
        let second = -first / (2.0 * mean_square);
        let slope = &self.mixed * (2.0 * per_count);
        let curvature = &self.slopes * (2.0 * per_count * first) + &slope * slope.transpose() * second;
        Form { gradient: slope * first, curvature }
    }
}

impl Form {
    fn plus(self, other: &Form, factor: f64) -> Form {
        let gradient = self.gradient + &other.gradient * factor;
        Form { gradient, curvature: self.curvature + &other.curvature * factor }
    }

    /// Newton's step to the minimum, in some of the parameters.
    fn step(&self, inside: &[usize]) -> DVector<f64> {
        let gradient = DVector::from_iterator(inside.len(), inside.iter().map(|&i| self.gradient[i]));
        -(inverse(&self.curvature, inside) * gradient)
    }
}

/// Inverse of a form in some of the parameters. The ridge keeps it from being singular; should it be, each parameter by itself.
fn inverse(curvature: &DMatrix<f64>, inside: &[usize]) -> DMatrix<f64> {
    let form = DMatrix::from_fn(inside.len(), inside.len(), |a, b| curvature[(inside[a], inside[b])]);
    let diagonal = DMatrix::from_diagonal(&form.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE)));
    form.cholesky().map_or(diagonal, |c| c.inverse())
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
