//! One descent of the covariance matrix adaptation evolution strategy, with negative weights (N. Hansen, "The CMA Evolution
//! Strategy: A Tutorial", arXiv:1604.00772v2, 2023; symbols and equation numbers as there).

use super::super::stream::normal;
use super::super::{Ended, Member, Merit, Optimizer, Origin, SearchBox, keep_best};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::VecDeque;

/// Settings of a descent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescentSettings {
    /// Candidates of a generation (λ).
    pub population: usize,
    /// Evaluations after which the descent is finished.
    pub evaluations: u64,
    /// Finished once the values of a generation, and the best ones of the latest generations, differ by no more than this share of
    /// the best.
    pub tolerance: f64,
    /// The tolerance is a share of this if the best value is smaller, such as 0.
    pub floor: f64,
}

impl DescentSettings {
    /// The population of the tutorial, Eq. 48: 4 + 3 ln n.
    #[must_use]
    pub fn population_for(dimensions: usize) -> usize {
        4 + (3.0 * (dimensions as f64).ln()) as usize
    }
}

/// Where a descent starts.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// A point, and a step as a share of the box that is the same in all directions.
    Round {
        /// The point.
        middle: Vec<f64>,
        /// The step (σ), a share of the box.
        step: f64,
    },
    /// A point, and the shape and size of a population around it.
    Population {
        /// The point.
        middle: Vec<f64>,
        /// The population, the point itself included or not.
        points: Vec<Vec<f64>>,
    },
}

/// Constants of the strategy, Table 1 of the tutorial.
#[derive(Debug, Clone)]
struct Rates {
    weights: Vec<f64>,
    mu: usize,
    mu_eff: f64,
    c_c: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_1: f64,
    c_mu: f64,
    /// Expected length of a standard normal vector.
    chi_n: f64,
}

impl Rates {
    fn new(n: usize, lambda: usize) -> Rates {
        let nf = n as f64;
        let raw: Vec<f64> = (1..=lambda).map(|i| ((lambda as f64 + 1.0) / 2.0).ln() - (i as f64).ln()).collect();
        let mu = raw.iter().filter(|w| **w > 0.0).count();
        let effective = |w: &[f64]| w.iter().sum::<f64>().powi(2) / w.iter().map(|w| w * w).sum::<f64>();
        let (mu_eff, mu_eff_minus) = (effective(&raw[..mu]), effective(&raw[mu..]));
        let c_1 = 2.0 / ((nf + 1.3).powi(2) + mu_eff);
        let c_mu = (1.0 - c_1).min(2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((nf + 2.0).powi(2) + mu_eff));
        // Eqs. 50 to 53.
        let negative =
            (1.0 + c_1 / c_mu).min(1.0 + 2.0 * mu_eff_minus / (mu_eff + 2.0)).min((1.0 - c_1 - c_mu) / (nf * c_mu));
        let sum = |keep: fn(f64) -> bool| raw.iter().filter(|w| keep(**w)).map(|w| w.abs()).sum::<f64>();
        let (positive_sum, negative_sum) = (sum(|w| w > 0.0), sum(|w| w < 0.0));
        let scaled = |w: &f64| if *w >= 0.0 { w / positive_sum } else { negative * w / negative_sum };
        let c_sigma = (mu_eff + 2.0) / (nf + mu_eff + 5.0);
        Rates {
            weights: raw.iter().map(scaled).collect(),
            mu,
            mu_eff,
            c_c: (4.0 + mu_eff / nf) / (nf + 4.0 + 2.0 * mu_eff / nf),
            c_sigma,
            d_sigma: 1.0 + 2.0 * (((mu_eff - 1.0) / (nf + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_1,
            c_mu,
            chi_n: nf.sqrt() * (1.0 - 1.0 / (4.0 * nf) + 1.0 / (21.0 * nf * nf)),
        }
    }
}

/// One descent. It moves in the unit cube, continued beyond its faces by reflection: every candidate lies in the box, and a minimum on a
/// bound needs no special treatment.
#[derive(Debug, Clone)]
pub struct Descent {
    settings: DescentSettings,
    space: SearchBox,
    origin: Origin,
    rates: Rates,
    evaluations: u64,
    generation: u64,
    /// m, σ, C, and C = B D² Bᵀ.
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    axes: DMatrix<f64>,
    lengths: DVector<f64>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    /// Steps y = (x - m) / σ of the requested generation.
    steps: Vec<DVector<f64>>,
    /// Best values of the latest generations.
    latest: VecDeque<f64>,
    without_gain: u64,
    first_sigma: f64,
    converged: bool,
    best: Option<Member>,
}

impl Descent {
    /// A descent on a box.
    #[must_use]
    pub fn new(space: SearchBox, start: Start, settings: DescentSettings, origin: Origin) -> Descent {
        let n = space.dimensions();
        let (mean, sigma, covariance) = match start {
            Start::Round { middle, step } => (space.fractions(&middle), step, DMatrix::identity(n, n)),
            Start::Population { middle, points } => {
                let points: Vec<Vec<f64>> = points.iter().map(|p| space.fractions(p)).collect();
                let (sigma, shape) = shape(&points, n);
                (space.fractions(&middle), sigma, shape)
            }
        };
        let mut descent = Descent {
            rates: Rates::new(n, settings.population),
            settings,
            space,
            origin,
            evaluations: 0,
            generation: 0,
            mean: DVector::from_vec(mean),
            sigma,
            covariance,
            axes: DMatrix::identity(n, n),
            lengths: DVector::from_element(n, 1.0),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            steps: Vec::new(),
            latest: VecDeque::new(),
            without_gain: 0,
            first_sigma: sigma,
            converged: false,
            best: None,
        };
        descent.decompose();
        descent
    }

    /// Evaluations so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The stream that comes next.
    #[must_use]
    pub fn origin(&self) -> Origin {
        self.origin
    }

    fn decompose(&mut self) {
        // Symmetric up to rounding; made so, because the decomposition reads one half only.
        let symmetric = (&self.covariance + self.covariance.transpose()) * 0.5;
        let eigen = SymmetricEigen::new(symmetric.clone());
        let largest = eigen.eigenvalues.max();
        // 1e-14: the condition number beyond which the tutorial stops (Appendix B.3).
        self.converged |= !largest.is_finite() || largest <= 0.0 || eigen.eigenvalues.min() < 1e-14 * largest;
        let floor = (1e-14 * largest).max(f64::MIN_POSITIVE);
        self.lengths = eigen.eigenvalues.map(|value| value.max(floor).sqrt());
        self.axes = eigen.eigenvectors;
        self.covariance = symmetric;
    }

    /// Eqs. 41 to 47, with the steps sorted from best to worst.
    fn update(&mut self, sorted: &[&DVector<f64>]) {
        let n = self.mean.len();
        let r = &self.rates;
        let mut step = DVector::zeros(n);
        for (weight, y) in r.weights[..r.mu].iter().zip(sorted) {
            step.axpy(*weight, y, 1.0);
        }
        self.mean.axpy(self.sigma, &step, 1.0);
        let whitened = |y: &DVector<f64>| (self.axes.transpose() * y).component_div(&self.lengths);

        let length = (r.c_sigma * (2.0 - r.c_sigma) * r.mu_eff).sqrt();
        self.path_sigma = &self.path_sigma * (1.0 - r.c_sigma) + &self.axes * whitened(&step) * length;
        let norm = self.path_sigma.norm();
        let decay = 1.0 - (1.0 - r.c_sigma).powf(2.0 * (self.generation + 1) as f64);
        let short = norm / decay.sqrt() < (1.4 + 2.0 / (n as f64 + 1.0)) * r.chi_n;
        let h = f64::from(u8::from(short));
        self.path_c = &self.path_c * (1.0 - r.c_c) + step * (h * (r.c_c * (2.0 - r.c_c) * r.mu_eff).sqrt());

        let lost = r.c_1 * (1.0 - h) * r.c_c * (2.0 - r.c_c);
        let sum: f64 = r.weights.iter().sum();
        let mut covariance = &self.covariance * (1.0 + lost - r.c_1 - r.c_mu * sum);
        covariance.ger(r.c_1, &self.path_c, &self.path_c, 1.0);
        for (&weight, y) in r.weights.iter().zip(sorted) {
            let negative = if weight < 0.0 { n as f64 / whitened(y).norm_squared().max(1e-300) } else { 1.0 };
            covariance.ger(r.c_mu * weight * negative, y, y, 1.0);
        }
        self.covariance = covariance;
        // 1: the step may grow by e at most in a generation; without it a flat start can explode.
        self.sigma *= ((r.c_sigma / r.d_sigma) * (norm / r.chi_n - 1.0)).min(1.0).exp();
        self.decompose();
    }

    /// The stopping rules of the tutorial (Appendix B.3) that detect the end of progress.
    fn check(&mut self, values: &[f64]) {
        let n = self.mean.len() as f64;
        let lambda = self.settings.population as f64;
        let best = values[0];
        if best.is_finite() {
            self.latest.push_back(best);
        }
        let window = 10 + (30.0 * n / lambda).ceil() as usize;
        while self.latest.len() > window {
            self.latest.pop_front();
        }
        let range = |x: &mut dyn Iterator<Item = f64>| {
            let (low, high) = x.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        };
        let limit = self.settings.tolerance * best.abs().max(self.settings.floor);
        let within = range(&mut values.iter().copied());
        let flat = within <= limit && (self.latest.len() < window || range(&mut self.latest.iter().copied()) <= limit);
        let widest = self.sigma * self.lengths.max();
        // 1e-11 of the box; a step ten thousand times the first one; no gain for the length of a run with a slow covariance.
        let stuck = self.without_gain as f64 > 100.0 + 100.0 * n.powf(1.5) / lambda;
        self.converged |= flat && (self.latest.len() >= window || within == 0.0);
        self.converged |= widest < 1e-11 || widest > 1e4 * self.first_sigma || stuck;
    }
}

/// Step and shape of points in the unit cube: their covariance, scaled to a mean variance of 1.
fn shape(points: &[Vec<f64>], n: usize) -> (f64, DMatrix<f64>) {
    // 1e-4 of the box: a coordinate in which all agree is still searched a little.
    const LEAST: f64 = 1e-4;
    let count = points.len().max(1) as f64;
    let mean = |i: usize| points.iter().map(|p| p[i]).sum::<f64>() / count;
    let means: Vec<f64> = (0..n).map(mean).collect();
    let mut covariance = DMatrix::zeros(n, n);
    for p in points {
        let d = DVector::from_iterator(n, p.iter().zip(&means).map(|(x, m)| x - m));
        covariance.ger(1.0 / count, &d, &d, 1.0);
    }
    // Too few points do not determine directions.
    if points.len() < 2 * n {
        covariance = DMatrix::from_diagonal(&covariance.diagonal());
    }
    for i in 0..n {
        covariance[(i, i)] += LEAST * LEAST;
    }
    let variance = covariance.trace() / n as f64;
    (variance.sqrt(), covariance / variance)
}

/// The unit cube continued by reflection.
fn reflected(x: f64) -> f64 {
    let x = x.rem_euclid(2.0);
    if x > 1.0 { 2.0 - x } else { x }
}

impl Optimizer for Descent {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        let n = self.mean.len();
        let step = |k: usize| {
            let mut rng = self.origin.candidate(k);
            let z = DVector::from_fn(n, |_, _| normal(&mut rng));
            &self.axes * z.component_mul(&self.lengths)
        };
        self.steps = (0..self.settings.population).map(step).collect();
        let point = |y: &DVector<f64>| {
            let x = &self.mean + y * self.sigma;
            x.iter().enumerate().map(|(i, x)| self.space.along(i, reflected(*x))).collect()
        };
        self.steps.iter().map(point).collect()
    }

    fn tell(&mut self, merits: &[Merit]) {
        assert_eq!(merits.len(), self.steps.len(), "one merit per candidate asked for");
        let steps = std::mem::take(&mut self.steps);
        self.evaluations += merits.len() as u64;
        let mut order: Vec<usize> = (0..merits.len()).collect();
        // Stable: equals keep their order.
        order.sort_by(|&a, &b| merits[a].order(&merits[b]));
        let value = |&k: &usize| match merits[k] {
            Merit::Feasible(value) if value.is_finite() => value,
            _ => f64::INFINITY,
        };
        self.without_gain += 1;
        let first = order[0];
        if self.best.as_ref().is_none_or(|best| merits[first].beats(&best.merit)) {
            let x = &self.mean + &steps[first] * self.sigma;
            let point = x.iter().enumerate().map(|(i, x)| self.space.along(i, reflected(*x))).collect();
            keep_best(&mut self.best, &Member { point, merit: merits[first] });
            self.without_gain = 0;
        }
        let values: Vec<f64> = order.iter().map(value).collect();
        let sorted: Vec<&DVector<f64>> = order.iter().map(|&k| &steps[k]).collect();
        self.update(&sorted);
        self.check(&values);
        self.generation += 1;
        self.origin.generation += 1;
    }

    fn best(&self) -> Option<&Member> {
        self.best.as_ref()
    }

    fn ended(&self) -> Option<Ended> {
        if self.converged {
            Some(Ended::Converged)
        } else {
            (self.evaluations >= self.settings.evaluations).then_some(Ended::Spent)
        }
    }
}
