//! The score near its minimum: a quadratic form, and the displacement of the minimum by the noise of the drive.
//!
//! The score is Σ_k w_k √m_k over signals (and the mean over cases, unless m_k is pooled over them), where m_k is the mean of squared
//! residuals e². Its second derivatives omit those of e (Gauss-Newton), so that the form decreases in no direction.

use super::noise::{Answer, Free, Noise};
use super::{Exactly, Information, Optimism, student};
use crate::calibrate::SearchSpace;
use crate::convention::Denominators;
use crate::evaluator::{EvaluateError, Evaluator, Innovations, Job, Observer, Population, shares};
use crate::lanes::Lanes;
use crate::score::{Accumulation, Measured};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

/// Finite-difference steps, as shares of a parameter's range; the first one that changes the result is used.
const STEPS: [f64; 4] = [1e-3, 1e-2, 0.1, 0.3];

/// Share of its largest second derivative that is added to the quadratic form, so that a parameter without effect has a variance.
const RIDGE: f64 = 1e-9;

/// Weights of the squared residuals in the form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weights {
    /// Those of the score, which is a sum of roots: they fall as the residuals grow.
    OfScore,
    /// Their values at the candidate. Far from a minimum, most of the slope of a root of squares is the change of these weights.
    Fixed,
}

/// Share of the largest second derivative below which a direction is flat: an estimate there would be several tens of times less certain than
/// along the steepest one.
const FLAT: f64 = 1e-3;

/// Why a candidate has no quadratic form.
#[derive(Debug, Clone, Copy)]
pub(super) struct Refused {
    pub(super) note: &'static str,
    /// Simulations until that was known.
    pub(super) evaluations: u64,
}

/// Residuals of one signal of one case, and their derivatives by each searched parameter, in shares of its range.
struct SignalResiduals {
    /// 0: spacing, 1: speed, 2: acceleration.
    signal: usize,
    /// Derivative of each residual by the simulated value.
    per_simulated: Vec<f64>,
    /// Weight of √m in the score.
    weight: f64,
    /// 1 / number of samples that count.
    per_count: f64,
    residual: Vec<f64>,
    slopes: Vec<Vec<f64>>,
}

/// Spacing, speed and acceleration of a run, sample by sample.
type Signals = [Vec<f64>; 3];

/// A run to the end, and its first simulated sample.
#[derive(Clone)]
struct Whole {
    of: Signals,
    first: usize,
}

/// Free runs of some candidates on case `k`, together; `None` for one that fails.
fn runs(
    exactly: Exactly<'_>,
    k: usize,
    space: &SearchSpace,
    candidates: &[Vec<f64>],
) -> Result<Vec<Option<Whole>>, EvaluateError> {
    let mut population = Population::new(&space.symbols);
    candidates.iter().for_each(|candidate| population.push(candidate));
    let job = Job { case: exactly.first + k, population: &population };
    let runs = exactly.lanes.innovations(&job, &vec![Observer::NONE; candidates.len()])?;
    let whole = |run: Innovations| {
        let of = |k: usize| run.state.iter().map(|state| state[k]).collect();
        run.failed.is_none().then(|| Whole { of: [of(0), of(1), run.acceleration.clone()], first: run.first })
    };
    Ok(runs.into_iter().map(whole).collect())
}

/// Time between the disturbances whose effect is computed \[s\]: short against the response time of a driver.
const BETWEEN_S: f64 = 1.0;

/// The score of one case near the minimum.
struct CaseForm {
    gradient: DVector<f64>,
    curvature: DMatrix<f64>,
    /// Derivative of the gradient by the residuals of spacing, speed and acceleration at each sample, from the first that counts on.
    pulls: [Vec<DVector<f64>>; 3],
    /// Covariance of the gradient if all samples were independent.
    independent: DMatrix<f64>,
    /// First sample that counts.
    first: usize,
}

/// The quadratic form of a calibrated candidate.
pub(super) struct Local {
    /// Positions of the searched parameters in the space.
    pub(super) free: Vec<usize>,
    /// First derivatives of the score by shares of the ranges, 0 if the parameter lies on a bound, and second ones.
    gradient: DVector<f64>,
    curvature: DMatrix<f64>,
    /// Covariance of the gradient by the noise of the drives, and its value if all residuals were independent.
    noise: DMatrix<f64>,
    independent: DMatrix<f64>,
    samples: usize,
    /// Independent pieces of the noise, less the searched parameters.
    freedom: f64,
    /// Size of the noise, summed over the cases \[m²/s²\].
    pub(super) power: f64,
    /// Added to the diagonal of every form.
    ridge: f64,
    /// Number of steps tried on either side of each searched parameter, for the case that needed most.
    tried: Vec<u64>,
}

/// Standard error of a parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// Half of the interval that the quadratic form gives, a share of the range.
    pub(super) half: f64,
    /// Rise of the re-optimised score at its ends; NaN for a parameter without effect.
    pub(super) rise: f64,
    pub(super) effective_samples: f64,
}

impl Local {
    /// Fails if the candidate, or all its neighbours in some direction, cannot be simulated, or if the score has no curvature.
    pub(super) fn new(
        exactly: Exactly<'_>,
        space: &SearchSpace,
        candidate: &[f64],
        weights: Weights,
        stop: &mut dyn FnMut() -> bool,
    ) -> Result<Result<Local, Refused>, EvaluateError> {
        const STOPPED: &str = "stopped before it was known";
        let cases = exactly.cases();
        let free = space.free();
        let n = free.len();
        let on_bound = space.at_bound(candidate);
        let [curvature, noise, independent] = [0; 3].map(|_| DMatrix::zeros(n, n));
        let mut local = Local {
            free,
            gradient: DVector::zeros(n),
            curvature,
            noise,
            independent,
            samples: 0,
            freedom: 0.0,
            power: 0.0,
            ridge: 0.0,
            tried: vec![0; n],
        };
        let (mut sloped, mut all) = (false, Vec::new());
        for k in 0..cases.len() {
            if stop() {
                return Ok(Err(local.refused(STOPPED)));
            }
            let Some(signals) = local.signals(exactly, k, space, candidate)? else {
                return Ok(Err(local.refused("the score is not defined around the candidate")));
            };
            sloped |= signals.1.iter().any(|signal| signal.slopes.iter().flatten().any(|slope| *slope != 0.0));
            all.push(signals);
        }
        let shares = shares(cases, exactly.lanes.gof());
        let total: Option<f64> = shares.iter().map(|share| share.weight).sum();
        let squares = total.map(|total| {
            // The squares of all cases under one root, each with its weight.
            for (signal, share) in
                all.iter_mut().zip(&shares).flat_map(|((_, own), share)| own.iter_mut().map(move |s| (s, share)))
            {
                signal.per_count *= share.weight.unwrap_or_default() / total * signal.weight * signal.weight;
                signal.weight = 1.0;
            }
            let of_cases = all.iter().flat_map(|(_, signals)| signals).map(|signal| signal.squares(n));
            of_cases.fold((0.0, DVector::zeros(n)), |(m, mixed), own| (m + own.0, mixed + own.1))
        });
        let form = |(first, signals): &(usize, Vec<SignalResiduals>)| {
            CaseForm::new(signals, *first, n, (cases.len() as f64, squares.as_ref()), weights)
        };
        let forms: Vec<CaseForm> = all.iter().map(form).collect();
        drop(all);
        for form in &forms {
            local.gradient += &form.gradient;
            local.curvature += &form.curvature;
            local.independent += &form.independent;
            local.samples += form.pulls[0].len();
        }
        for (k, &i) in local.free.iter().enumerate() {
            if on_bound.contains(&space.symbols[i]) {
                local.gradient[k] = 0.0;
            }
        }
        if !sloped {
            return Ok(Err(local.refused("no parameter changes the score")));
        }
        let largest = local.curvature.diagonal().max();
        if !largest.is_finite() {
            return Ok(Err(local.refused("the score is not defined around the candidate")));
        }
        if largest <= 0.0 {
            // A score of roots has a corner where all residuals are 0.
            return Ok(Err(local.refused("the score has no curvature around the candidate, as with a perfect fit")));
        }
        local.ridge = RIDGE * largest;
        local.curvature += DMatrix::identity(n, n) * local.ridge;
        for (k, form) in forms.iter().enumerate() {
            if stop() {
                return Ok(Err(local.refused(STOPPED)));
            }
            match form.noise(exactly, k, space, candidate)? {
                Some((noise, pieces, power)) => {
                    local.noise += noise;
                    local.freedom += pieces;
                    local.power += power;
                }
                None => return Ok(Err(local.refused("the candidate lies on the edge of the feasible region"))),
            }
        }
        local.freedom -= n as f64;
        Ok(Ok(local))
    }

    /// Number of simulated candidates, each on all cases: the one in the middle and its neighbours.
    pub(super) fn evaluations(&self) -> u64 {
        1 + 2 * self.tried.iter().sum::<u64>()
    }

    fn refused(&self, note: &'static str) -> Refused {
        Refused { note, evaluations: self.evaluations() }
    }

    /// Residuals and slopes of all signals of case `k` that are compared; `None` if the score is undefined at the candidate or around it.
    fn signals(
        &mut self,
        exactly: Exactly<'_>,
        k: usize,
        space: &SearchSpace,
        candidate: &[f64],
    ) -> Result<Option<(usize, Vec<SignalResiduals>)>, EvaluateError> {
        let (case, gof) = (&exactly.cases()[k], exactly.lanes.gof());
        let beside = |i: usize, share: f64| {
            let [lower, upper] = space.bounds[i];
            let mut moved = candidate.to_vec();
            moved[i] = (candidate[i] + share * (upper - lower)).clamp(lower, upper);
            moved
        };
        let (mut middle, mut first) = (None, 0);
        // Per parameter: the signals on both sides, and their distance.
        let mut sides: Vec<Option<(Signals, Signals, f64)>> = self.free.iter().map(|_| None).collect();
        let mut open: Vec<usize> = (0..sides.len()).collect();
        for (before, step) in STEPS.into_iter().enumerate() {
            let candidates: Vec<Vec<f64>> = std::iter::once(candidate.to_vec())
                .chain(open.iter().flat_map(|&j| [-step, step].map(|share| beside(self.free[j], share))))
                .collect();
            let mut runs = runs(exactly, k, space, &candidates)?.into_iter().zip(&candidates);
            let Some((Some(here), _)) = runs.next() else { return Ok(None) };
            let mut still = Vec::new();
            for &j in &open {
                self.tried[j] = self.tried[j].max(1 + before as u64);
                let (i, [lower, upper]) = (self.free[j], space.bounds[self.free[j]]);
                let mut side = || match runs.next() {
                    Some((Some(run), moved)) => (moved[i], run),
                    _ => (candidate[i], here.clone()),
                };
                let ((below, low), (above, high)) = (side(), side());
                first = first.max(here.first).max(low.first).max(high.first);
                let distance = (above - below) / (upper - lower);
                if distance <= 0.0 || low.of == high.of {
                    still.push(j);
                }
                if distance > 0.0 {
                    sides[j] = Some((low.of, high.of, distance));
                }
            }
            middle = Some(here.of);
            open = still;
            if open.is_empty() {
                break;
            }
        }
        let (Some(here), Some(sides)) = (middle, sides.into_iter().collect::<Option<Vec<_>>>()) else {
            return Ok(None);
        };

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
                pairs.map(|(sim, obs)| kind.term(*sim, *obs, floor[k])).collect()
            };
            let slope = |(low, high, distance): &(Signals, Signals, f64)| -> Vec<f64> {
                let (low, high) = (residual_of(&low[k]), residual_of(&high[k]));
                low.iter().zip(&high).map(|(low, high)| (high - low) / distance).collect()
            };
            let mut weight = norm.weight[k];
            if kind == Accumulation::Theil {
                // The simulated part of the denominator at the minimum.
                let square: f64 = here[k][first..].iter().map(|x| x * x).sum();
                weight /= (square * norm.per_count[k]).sqrt() + norm.rms_measured[k];
            }
            let slopes = sides.iter().map(slope).collect();
            let per_simulated = observed[k][first..].iter().map(|obs| kind.slope(*obs, floor[k])).collect();
            signals.push(SignalResiduals {
                signal: k,
                per_simulated,
                weight,
                per_count: norm.per_count[k],
                residual: residual_of(&here[k]),
                slopes,
            });
        }
        Ok(Some((first, signals)))
    }

    /// Minimum of the quadratic form.
    pub(super) fn lowest(&self, space: &SearchSpace, candidate: &[f64]) -> Vec<f64> {
        let mut moved = candidate.to_vec();
        for (k, &i) in self.free.iter().enumerate() {
            let [lower, upper] = space.bounds[i];
            let step = inverse(&self.curvature, k).dot(&self.gradient);
            moved[i] = (candidate[i] - step * (upper - lower)).clamp(lower, upper);
        }
        moved
    }

    /// Mean excess of the score on another drive of the same driver over that on the fitted drive: the trace of the inverse curvature times
    /// the covariance of the gradient (K. Takeuchi, 1976; for independent residuals H. Akaike's 1974). `inside`: the searched parameters
    /// that lie on no bound; the others cannot follow the noise. `None` if the form is singular.
    pub(super) fn optimism(&self, inside: &[bool]) -> Option<Optimism> {
        let kept: Vec<usize> = (0..self.free.len()).filter(|&k| inside[k]).collect();
        let part = |form: &DMatrix<f64>| DMatrix::from_fn(kept.len(), kept.len(), |a, b| form[(kept[a], kept[b])]);
        let trace = part(&self.curvature).cholesky()?.solve(&part(&self.noise)).trace();
        (trace.is_finite() && trace >= 0.0).then_some(Optimism { score: trace, noise: self.power })
    }

    /// Inverse of the sandwich of [`Local::spread`], and the estimates at the minimum of the form; `None` if a matrix is singular.
    pub(super) fn information(&self) -> Option<Information> {
        let n = self.free.len();
        let kept: Vec<usize> = (0..n).filter(|&k| self.has_effect(k)).collect();
        let part = |form: &DMatrix<f64>| DMatrix::from_fn(kept.len(), kept.len(), |a, b| form[(kept[a], kept[b])]);
        if kept.is_empty() {
            return None;
        }
        let gradient = DVector::from_iterator(kept.len(), kept.iter().map(|k| self.gradient[*k]));
        // Directions in which the score is nearly flat, because one parameter has the effect of another, tell nothing.
        let SymmetricEigen { eigenvalues, eigenvectors } = part(&self.curvature).symmetric_eigen();
        let steep: Vec<usize> = (0..kept.len()).filter(|&j| eigenvalues[j] > FLAT * eigenvalues.max()).collect();
        let basis = eigenvectors.select_columns(&steep);
        let steepness = DVector::from_iterator(steep.len(), steep.iter().map(|j| eigenvalues[*j]));
        // No parameter is farther from the candidate than its range.
        let step = -(basis.transpose() * gradient).component_div(&steepness).map(|step| step.clamp(-1.0, 1.0));
        let noise = (basis.transpose() * part(&self.noise) * &basis).cholesky()?;
        let curvature = DMatrix::from_diagonal(&steepness) * basis.transpose();
        let own_matrix = curvature.transpose() * noise.solve(&curvature);
        let own_vector = &own_matrix * (&basis * step);
        let mut found = Information {
            matrix: DMatrix::zeros(n, n),
            vector: DVector::zeros(n),
            curvature: self.curvature.diagonal(),
        };
        for (a, &k) in kept.iter().enumerate() {
            found.vector[k] = own_vector[a];
            for (b, &l) in kept.iter().enumerate() {
                found.matrix[(k, l)] = own_matrix[(a, b)];
            }
        }
        let is_finite = found.matrix.iter().chain(&found.vector).all(|x| x.is_finite());
        is_finite.then_some(found)
    }

    /// A parameter without effect has the ridge as its curvature, and may have any value.
    fn has_effect(&self, k: usize) -> bool {
        self.curvature[(k, k)] >= 10.0 * self.ridge
    }

    /// Correlations between the errors of the parameters, by the same estimator as [`Local::spread`].
    pub(super) fn correlation(&self) -> Vec<Vec<f64>> {
        let n = self.free.len();
        let pulls: Vec<DVector<f64>> = (0..n).map(|k| inverse(&self.curvature, k)).collect();
        let covariance = |a: usize, b: usize| (&self.noise * &pulls[a.min(b)]).dot(&pulls[a.max(b)]);
        let entry = |a: usize, b: usize| {
            let scale = (covariance(a, a) * covariance(b, b)).sqrt();
            let known = self.has_effect(a) && self.has_effect(b) && scale > 0.0;
            if a == b {
                1.0
            } else if known {
                (covariance(a, b) / scale).clamp(-1.0, 1.0)
            } else {
                0.0
            }
        };
        (0..n).map(|a| (0..n).map(|b| entry(a, b)).collect()).collect()
    }

    /// Standard error of parameter `k`, from the covariance of the gradient and the curvature of the score (the sandwich estimator of P. J.
    /// Huber, 1967).
    pub(super) fn spread(&self, k: usize) -> Spread {
        let pull = inverse(&self.curvature, k);
        let variance_by = |form: &DMatrix<f64>| (form * &pull).dot(&pull);
        let variance = variance_by(&self.noise);
        let half = student(self.freedom) * variance.sqrt();
        if !self.has_effect(k) || half.is_nan() || half <= 0.0 {
            return Spread { half: 1.0, rise: f64::NAN, effective_samples: 0.0 };
        }
        let independent = variance_by(&self.independent);
        let samples = self.samples as f64;
        let effective_samples = (samples * independent / variance).min(samples);
        let rise = half * half / (2.0 * pull[k].max(f64::MIN_POSITIVE));
        Spread { half, rise, effective_samples }
    }
}

impl SignalResiduals {
    /// Mean of the squared residuals, and its gradient by the searched parameters.
    fn squares(&self, n: usize) -> (f64, DVector<f64>) {
        let mean_square = self.residual.iter().map(|e| e * e).sum::<f64>() * self.per_count;
        let mut mixed = DVector::zeros(n);
        for (t, e) in self.residual.iter().enumerate() {
            mixed.axpy(2.0 * e * self.per_count, &self.slope(t, n), 1.0);
        }
        (mean_square, mixed)
    }

    fn slope(&self, t: usize, n: usize) -> DVector<f64> {
        DVector::from_iterator(n, self.slopes.iter().map(|slope| slope[t]))
    }
}

impl CaseForm {
    /// The part of one case of this many; `pooled` has the mean square of all cases and its gradient, if the score is its root.
    fn new(
        signals: &[SignalResiduals],
        first: usize,
        n: usize,
        (cases, pooled): (f64, Option<&(f64, DVector<f64>)>),
        weights: Weights,
    ) -> CaseForm {
        // A mean is over the cases; a term of the pooled root is the same in each of them.
        let (of_root, of_bend) = if pooled.is_some() { (1.0, cases) } else { (cases, 1.0) };
        let count = signals[0].residual.len();
        let none = || vec![DVector::zeros(n); count];
        let (curvature, independent) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        let mut form =
            CaseForm { gradient: DVector::zeros(n), curvature, pulls: [none(), none(), none()], independent, first };
        let mut whole = none();
        for signal in signals {
            let (mean_square, mixed) = pooled.cloned().unwrap_or_else(|| signal.squares(n));
            if mean_square <= 0.0 {
                continue;
            }
            // d(w √m)/dm, and d²(w √m)/dm².
            let first = signal.weight / of_root / (2.0 * mean_square.sqrt());
            let second = match weights {
                Weights::OfScore => -first / (2.0 * mean_square),
                Weights::Fixed => 0.0,
            };
            let mut square = DMatrix::zeros(n, n);
            let slope = |t: usize| signal.slope(t, n);
            for t in 0..count {
                square.ger(2.0 * signal.per_count, &slope(t), &slope(t), 1.0);
            }
            form.gradient += &mixed * (first / of_bend);
            form.curvature += square * first + &mixed * mixed.transpose() * (second / of_bend);
            for (t, e) in signal.residual.iter().enumerate() {
                // From the residual itself, and from the weight of the signal, which the residual changes.
                let mut by_residual = slope(t) * (2.0 * first * signal.per_count);
                by_residual.axpy(2.0 * second * e * signal.per_count, &mixed, 1.0);
                whole[t].axpy(*e, &by_residual, 1.0);
                form.pulls[signal.signal][t] = by_residual * signal.per_simulated[t];
            }
        }
        for pull in &whole {
            form.independent.ger(1.0, pull, pull, 1.0);
        }
        form
    }

    /// Covariance of the gradient from the noise of the drive: that of the measurement, and the unknown acceleration, whose effect goes
    /// through the model. With it, the number of independent pieces of the noise, and its size. `None` if the run fails.
    fn noise(
        &self,
        exactly: Exactly<'_>,
        k: usize,
        space: &SearchSpace,
        candidate: &[f64],
    ) -> Result<Option<(DMatrix<f64>, f64, f64)>, EvaluateError> {
        let (lanes, at) = (exactly.lanes, exactly.first + k);
        let Some(noise) = Noise::of(lanes, at, space, candidate, STEPS[0])? else { return Ok(None) };
        let Some(free) = Free::new(lanes, at, space.parameters(candidate))? else { return Ok(None) };
        let dt = exactly.cases()[k].dt;
        let n = self.curvature.nrows();
        let samples = self.pulls[0].len();
        let gradient = |answer: Answer| {
            let mut sum = DVector::zeros(n);
            for (t, change) in (answer.from..).zip(&answer.change).filter(|(t, _)| *t >= self.first) {
                for (pulls, change) in self.pulls.iter().zip(change) {
                    sum.axpy(*change, &pulls[t - self.first], 1.0);
                }
            }
            sum
        };
        let gradients = |kicks: &[(usize, usize)]| -> Result<Vec<DVector<f64>>, EvaluateError> {
            Ok(free.kicked(kicks)?.into_iter().map(gradient).collect())
        };
        // The acceleration, as changes of the speed in successive stretches.
        let every = (BETWEEN_S / dt).round().max(1.0) as usize;
        let speeds: Vec<(usize, usize)> =
            (free.first..self.first + samples).step_by(every).map(|from| (1, from)).collect();
        let kicks = speeds.par_chunks(Lanes::TRACES).map(gradients).collect::<Result<Vec<_>, _>>()?.concat();
        let length = every as f64 * dt;
        let mut covariance = DMatrix::zeros(n, n);
        let farthest = (1..kicks.len()).find(|apart| noise.added(length, *apart) < 1e-3 * noise.added(length, 0));
        for apart in 0..farthest.unwrap_or(kicks.len()) {
            let added = noise.added(length, apart);
            for (one, another) in kicks.iter().zip(&kicks[apart..]) {
                covariance.ger(added, one, another, 1.0);
                if apart > 0 {
                    covariance.ger(added, another, one, 1.0);
                }
            }
        }
        // The measurement: each sample, whose speed enters two accelerations, and the one from which the run starts.
        let [by_s, by_v, by_a] = &self.pulls;
        for t in 0..samples {
            covariance.ger(noise.spacing.powi(2), &by_s[t], &by_s[t], 1.0);
            let mut by_speed = &by_v[t] + &by_a[t] / dt;
            if let Some(next) = by_a.get(t + 1) {
                by_speed.axpy(-1.0 / dt, next, 1.0);
            }
            covariance.ger(noise.speed.powi(2), &by_speed, &by_speed, 1.0);
        }
        let starts = gradients(&[(0, free.first), (1, free.first)])?;
        for (start, size) in starts.iter().zip([noise.spacing, noise.speed]) {
            covariance.ger(size.powi(2), start, start, 1.0);
        }
        // An effect that lasts T is negligible after 2 T.
        Ok(Some((covariance, samples as f64 * dt / (2.0 * noise.lasts).max(dt), noise.power())))
    }
}

/// Row of the inverse of a form. The ridge keeps it from being singular; if it is, each parameter counts separately.
fn inverse(form: &DMatrix<f64>, row: usize) -> DVector<f64> {
    let n = form.nrows();
    let unit = DVector::from_fn(n, |k, _| f64::from(u8::from(k == row)));
    let alone = DVector::from_fn(n, |k, _| unit[k] / form[(row, row)].max(f64::MIN_POSITIVE));
    form.clone().cholesky().map_or(alone, |c| c.solve(&unit))
}
