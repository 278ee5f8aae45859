//! The score near its minimum: a quadratic form, and how far each block of the drive pulls the minimum.
//!
//! The score is Σ_k w_k √m_k over signals (and the mean over cases), where m_k is the mean of squared residuals e². Its second
//! derivatives are taken without those of e (Gauss and Newton), which keeps the form from falling anywhere.

use super::student;
use crate::calibrate::SearchSpace;
use crate::convention::Denominators;
use crate::evaluator::Case;
use crate::reference::Trace;
use crate::rescore;
use crate::score::{Accumulation, GoodnessOfFit, Measured, denominator, is_relative};
use nalgebra::{DMatrix, DVector};

/// Steps of the differences, shares of a parameter's range: the first one at which anything changes.
const STEPS: [f64; 4] = [1e-3, 1e-2, 0.1, 0.3];

/// Share of its largest second derivative that is added to the quadratic form, so that a parameter that does nothing has a variance.
const RIDGE: f64 = 1e-9;

/// Why a candidate has no local picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refused {
    pub(super) note: &'static str,
    /// Simulations until that was known.
    pub(super) evaluations: u64,
}

/// Residuals of one signal of one case, and their derivatives by each searched parameter, in shares of its range.
struct SignalResiduals {
    /// Weight of √m in the score.
    weight: f64,
    /// 1 / number of samples that count.
    per_count: f64,
    residual: Vec<f64>,
    slopes: Vec<Vec<f64>>,
}

/// Numbers of blocks into which each drive is cut; the one that gives the widest interval counts. Few: blocks must be long against
/// the memory of the residuals. Three: a variance from so few blocks is sometimes far too small by chance.
const CUTS: [usize; 3] = [6, 10, 16];

/// The score of one case near the minimum.
struct CaseForm {
    curvature: DMatrix<f64>,
    /// What each sample adds to the gradient, whose mean it is.
    samples: Vec<DVector<f64>>,
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
    /// Steps tried on either side of each searched parameter, of the case that needed most.
    tried: Vec<u64>,
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
    /// Refused if the candidate, or all its neighbours in some direction, cannot be simulated, and if the score has no curvature.
    pub(super) fn new(
        cases: &[Case],
        gof: &GoodnessOfFit,
        space: &SearchSpace,
        candidate: &[f64],
    ) -> Result<Local, Refused> {
        let free = space.free();
        let on = space.at_bound(candidate);
        let on_bound = free.iter().map(|&i| on.contains(&space.symbols[i])).collect();
        let n = free.len();
        let (curvature, tried) = (DMatrix::zeros(n, n), vec![0; n]);
        let mut local = Local { free, on_bound, curvature, cases: Vec::new(), ridge: 0.0, tried };
        let mut sloped = false;
        for case in cases {
            let Some(signals) = local.signals(case, gof, space, candidate) else {
                return Err(local.refused("the score is not defined around the candidate"));
            };
            sloped |= signals.iter().any(|signal| signal.slopes.iter().flatten().any(|slope| *slope != 0.0));
            local.cases.push(CaseForm::new(&signals, n, cases.len() as f64));
        }
        for case in &local.cases {
            local.curvature += &case.curvature;
        }
        if !sloped {
            return Err(local.refused("no parameter changes the score"));
        }
        let largest = local.curvature.diagonal().max();
        if !largest.is_finite() {
            return Err(local.refused("the score is not defined around the candidate"));
        }
        if largest <= 0.0 {
            // A score of roots has a corner where all residuals are 0.
            return Err(local.refused("the score has no curvature around the candidate, as where the fit is perfect"));
        }
        local.ridge = RIDGE * largest;
        local.curvature += DMatrix::identity(n, n) * local.ridge;
        Ok(local)
    }

    /// Simulated candidates, each on all cases: the one of the middle, and its neighbours.
    pub(super) fn evaluations(&self) -> u64 {
        1 + 2 * self.tried.iter().sum::<u64>()
    }

    fn refused(&self, note: &'static str) -> Refused {
        Refused { note, evaluations: self.evaluations() }
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
            let whole = rescore::outcome(case, &parameters, &mut trace).is_ok_and(|outcome| outcome.result.is_ok());
            let first = case.first_sample(case.delay(&parameters));
            whole.then(|| ([trace.s.clone(), trace.v.clone(), trace.a.clone()], first))
        };
        let (here, mut first) = run(candidate)?;
        // Per parameter: the signals on both sides, and their distance.
        let mut sides = Vec::new();
        for (&i, tried) in self.free.iter().zip(&mut self.tried) {
            let [lower, upper] = space.bounds[i];
            let mut found = None;
            for (before, step) in STEPS.into_iter().enumerate() {
                *tried = (*tried).max(1 + before as u64);
                let at = |share: f64| {
                    let mut moved = candidate.to_vec();
                    moved[i] = (candidate[i] + share * (upper - lower)).clamp(lower, upper);
                    moved
                };
                let (below, above) = (at(-step), at(step));
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

    /// How far parameter `k` may be off. Each block of the drive would move the minimum by the sum of its influences; the variance of
    /// such sums is that of the parameter, whatever the autocorrelation within a block (batch means; H. R. Künsch, Annals of
    /// Statistics 17, 1989, for estimators such as this one).
    pub(super) fn spread(&self, k: usize) -> Spread {
        let inside = self.inside(k);
        let row = inside.iter().position(|&i| i == k).expect("k is among them");
        let inverse = inverse(&self.curvature, &inside);
        let pull = |g: &DVector<f64>| inside.iter().enumerate().map(|(c, &i)| inverse[(row, c)] * g[i]).sum::<f64>();
        let influences: Vec<Vec<f64>> = self.cases.iter().map(|case| case.samples.iter().map(pull).collect()).collect();

        let wide = CUTS.map(|blocks| {
            let variance: f64 = influences.iter().map(|u| variance_of_mean(u, blocks)).sum();
            (student(((blocks - 1) * influences.len()) as f64) * variance.sqrt(), variance)
        });
        let (half, variance) = wide.into_iter().fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
        // A parameter that changes nothing has the ridge as its curvature, and may be anywhere.
        if self.curvature[(k, k)] < 10.0 * self.ridge || half <= 0.0 {
            return Spread { half: 1.0, rise: f64::NAN, effective_samples: 0.0 };
        }
        let samples: usize = influences.iter().map(Vec::len).sum();
        let independent: f64 = influences.iter().map(|u| variance_of_mean(u, u.len())).sum();
        let effective_samples = (samples as f64 * independent / variance).min(samples as f64);
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
        let mut form = CaseForm { curvature: DMatrix::zeros(n, n), samples: vec![DVector::zeros(n); count] };
        for signal in signals {
            let mean_square = signal.residual.iter().map(|e| e * e).sum::<f64>() * signal.per_count;
            if mean_square <= 0.0 {
                continue;
            }
            // d(w √m)/dm, and d²(w √m)/dm².
            let first = signal.weight / cases / (2.0 * mean_square.sqrt());
            let second = -first / (2.0 * mean_square);
            let (mut mixed, mut square) = (DVector::zeros(n), DMatrix::zeros(n, n));
            for (t, (e, sample)) in signal.residual.iter().zip(&mut form.samples).enumerate() {
                let slope = DVector::from_iterator(n, signal.slopes.iter().map(|s| s[t]));
                mixed.axpy(2.0 * e * signal.per_count, &slope, 1.0);
                square.ger(2.0 * signal.per_count, &slope, &slope, 1.0);
                sample.axpy(2.0 * e * first * signal.per_count * count as f64, &slope, 1.0);
            }
            form.curvature += square * first + &mixed * mixed.transpose() * second;
            // What a sample changes in the weight of the signal.
            for (e, sample) in signal.residual.iter().zip(&mut form.samples) {
                sample.axpy(second * (e * e * signal.per_count * count as f64 - mean_square), &mixed, 1.0);
            }
        }
        form
    }
}

/// Variance of the mean of a series, from the means of so many blocks of it.
fn variance_of_mean(series: &[f64], blocks: usize) -> f64 {
    let (n, blocks) = (series.len(), blocks.min(series.len()));
    let mean = series.iter().sum::<f64>() / n as f64;
    let edges = (0..blocks).map(|b| (b * n / blocks, (b + 1) * n / blocks));
    let square: f64 = edges
        .map(|(from, to)| series[from..to].iter().map(|x| x - mean).sum::<f64>() / n as f64)
        .map(|pull| pull * pull)
        .sum();
    square * blocks as f64 / (blocks as f64 - 1.0).max(1.0)
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
