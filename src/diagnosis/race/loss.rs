//! Errors of runs, bin by bin.

use super::Horizon;
use crate::diagnose::Drive;
use crate::evaluator::{Products, Slopes};
use crate::judge::mean;
use nalgebra::{DMatrix, DVector};

/// Signals of a loss: spacing, speed, acceleration.
pub const SIGNALS: usize = 3;
/// Errors below these do not matter: 5 cm, 2 cm/s, 2 cm/s².
pub const FLOOR: [f64; SIGNALS] = [0.05, 0.02, 0.02];
/// Length of a bin \[s\].
pub const BIN_S: f64 = 10.0;
/// Start of the first bin \[s\]: after the longest delay of a base and a cause together, so that all models have the same bins.
const FROM_S: f64 = 4.0;
/// Shortest drive with a bin \[s\].
pub const SHORTEST_S: f64 = FROM_S + 0.5 * BIN_S + 0.5;
/// Index of the penalty of a soft run.
pub const SHORTFALL: usize = 3;

/// The bins of a part.
#[derive(Debug, Clone)]
pub struct Sizes {
    /// The bin of every sample; `None` if it does not count.
    pub of: Vec<Option<u32>>,
    /// Number of samples in every bin.
    pub samples: Vec<f64>,
    /// Number of samples between two speeds whose difference gives the mean acceleration over 1 s.
    pub second: usize,
}

impl Sizes {
    /// Bins of a drive with this number of samples, `dt` \[s\] apart. A last bin that is less than half full is left out.
    #[must_use]
    pub fn new(samples: usize, dt: f64) -> Sizes {
        let number = |seconds: f64| ((seconds / dt).round() as usize).max(1);
        let (from, bin) = ((FROM_S / dt).ceil() as usize + 1, number(BIN_S));
        let place = |t: usize| Some(t.checked_sub(from)? / bin);
        let places: Vec<Option<usize>> = (0..samples).map(place).collect();
        let count = places.iter().flatten().max().map_or(0, |last| last + 1);
        let mut sizes = vec![0_usize; count];
        places.iter().flatten().for_each(|k| sizes[*k] += 1);
        let full = sizes.iter().take_while(|size| 2 * **size >= bin).count();
        let of = places.iter().map(|k| k.filter(|k| *k < full).map(|k| k as u32)).collect();
        Sizes { of, samples: sizes[..full].iter().map(|size| *size as f64).collect(), second: number(1.0) }
    }

    /// Number of bins.
    #[must_use]
    pub fn count(&self) -> usize {
        self.samples.len()
    }
}

/// Scales of the measured signals of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Root mean squares of spacing \[m\], speed \[m/s\], acceleration \[m/s²\].
    pub rms: [f64; SIGNALS],
    /// The smallest spacing \[m\].
    pub least: f64,
}

impl Scale {
    /// Scales of a drive.
    #[must_use]
    pub fn of(drive: &Drive) -> Scale {
        let (s, v, dt) = (&drive.trajectory.s, &drive.trajectory.v_f, drive.dt());
        let rms = |sum: f64, count: usize, floor: f64| (sum / count.max(1) as f64).sqrt().max(floor);
        let squares = |y: &[f64]| y.iter().map(|y| y * y).sum::<f64>();
        let a: Vec<f64> = v.windows(2).map(|v| (v[1] - v[0]) / dt).collect();
        // A standing car has no speed that an error could be relative to.
        let rms = [
            rms(squares(s), s.len(), FLOOR[0]),
            rms(squares(v), v.len(), FLOOR[1]),
            rms(squares(&a), a.len(), FLOOR[2]),
        ];
        Scale { rms, least: s.iter().copied().fold(f64::INFINITY, f64::min) }
    }
}

/// Mean squared errors of a part, bin by bin, of spacing, speed and acceleration.
#[derive(Debug, Clone, PartialEq)]
pub struct PartLoss {
    /// Bin by bin; infinite if the run failed.
    pub mse: Vec<[f64; SIGNALS]>,
    /// Σ of squared shortfalls of the spacing \[m²\].
    pub shortfall: f64,
}

impl PartLoss {
    /// Adds to the logarithm of each mean square.
    pub fn add(&mut self, logarithm: f64) {
        self.mse.iter_mut().flatten().for_each(|mse| *mse *= logarithm.exp());
    }
}

/// Converts sums of squares to a loss.
#[must_use]
pub fn of_squares(run: Option<&[[f64; 4]]>, sizes: &Sizes) -> PartLoss {
    let Some(run) = run else {
        return PartLoss { mse: vec![[f64::INFINITY; SIGNALS]; sizes.count()], shortfall: f64::INFINITY };
    };
    let bin = |(sums, samples): (&[f64; 4], &f64)| [sums[0], sums[1], sums[2]].map(|sum| sum / samples);
    let mse = run.iter().zip(&sizes.samples).map(bin).collect();
    PartLoss { mse, shortfall: run.iter().map(|sums| sums[SHORTFALL]).sum() }
}

/// The logarithmic loss of a bin.
#[must_use]
pub fn log(mse: &[f64; SIGNALS]) -> f64 {
    let of = |(mse, floor): (&f64, f64)| (mse + floor * floor).ln();
    mse.iter().zip(FLOOR).map(of).sum::<f64>() / SIGNALS as f64
}

/// Losses of parts; `None` for those that do not count.
#[derive(Debug, Clone, PartialEq)]
pub struct Losses {
    /// Part by part.
    pub parts: Vec<Option<PartLoss>>,
}

impl Losses {
    /// Adds the parts of others that are missing.
    pub fn take_from(&mut self, other: Losses) {
        for (own, part) in self.parts.iter_mut().zip(other.parts) {
            *own = own.take().or(part);
        }
    }

    /// Number of parts in which the model comes closer than 0.1 m to the car ahead.
    #[must_use]
    pub fn collisions(&self) -> usize {
        self.parts.iter().flatten().filter(|part| part.shortfall > 0.0).count()
    }

    /// The logarithmic loss of every bin, part after part.
    #[must_use]
    pub fn logs(&self) -> Vec<f64> {
        self.parts.iter().flatten().flat_map(|part| part.mse.iter().map(log)).collect()
    }

    /// The objective of a fit.
    #[must_use]
    pub fn cost(&self, horizon: Horizon, scales: &[Scale], price: f64) -> f64 {
        let shortfall: f64 = self.parts.iter().flatten().map(|part| part.shortfall).sum();
        let loss = if horizon.is_whole() { self.nrmse(scales) } else { mean(&self.logs()) };
        let cost = loss + price * shortfall;
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// For every bin, part after part: the sum over the signals of the error relative to the root mean square of the part, as in
    /// NRMSE(s,v,a).
    #[must_use]
    pub fn roots(&self, scales: &[Scale]) -> Vec<f64> {
        let parts = self.parts.iter().zip(scales).filter_map(|(part, scale)| Some((part.as_ref()?, scale)));
        parts.flat_map(|(part, scale)| part.mse.iter().map(|mse| root(mse, scale))).collect()
    }

    /// NRMSE(s,v,a), the mean over the parts.
    #[must_use]
    pub fn nrmse(&self, scales: &[Scale]) -> f64 {
        let of = |(part, scale): (&Option<PartLoss>, &Scale)| part.as_ref().map(|part| nrmse(&part.mse, scale));
        mean(&self.parts.iter().zip(scales).filter_map(of).collect::<Vec<f64>>())
    }
}

/// NRMSE(s,v,a) of these bins, from their mean squares, so that a short last bin has the same weight as another.
#[must_use]
pub fn nrmse(mse: &[[f64; SIGNALS]], scale: &Scale) -> f64 {
    let mean = std::array::from_fn(|k| mse.iter().map(|mse| mse[k]).sum::<f64>() / mse.len().max(1) as f64);
    root(&mean, scale)
}

fn root(mse: &[f64; SIGNALS], scale: &Scale) -> f64 {
    mse.iter().zip(scale.rms).map(|(mse, rms)| mse.sqrt() / rms).sum()
}

/// Numbers of bins and parts that count.
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    /// Bins.
    pub bins: f64,
    /// Parts.
    pub parts: f64,
}

/// Derivatives of the objective of one part, with its bins and scale; `n` coordinates.
#[must_use]
pub fn slopes(
    horizon: Horizon,
    products: &Products<'_>,
    n: usize,
    (sizes, scale): (&Sizes, &Scale),
    all: Counts,
    price: f64,
) -> Slopes {
    let (vector, matrix) = (DVector::zeros(n), DMatrix::zeros(n, n));
    let mut slopes = Slopes { cost: 0.0, gradient: vector, curvature: matrix.clone(), majorant: matrix };
    // Most runs have no shortfall.
    for bin in (0..sizes.count()).filter(|bin| products.square(*bin, SHORTFALL) > 0.0) {
        slopes.cost += price * products.square(bin, SHORTFALL);
        slopes.gradient += products.half_gradient(bin, SHORTFALL) * (2.0 * price);
        let products = products.products(bin, SHORTFALL) * (2.0 * price);
        slopes.curvature += &products;
        slopes.majorant += products;
    }
    let bins = || sizes.samples.iter().enumerate();
    if horizon.is_whole() {
        let share = 1.0 / sizes.count().max(1) as f64;
        for k in 0..SIGNALS {
            let (mut square, mut half, mut product) = (0.0, DVector::zeros(n), DMatrix::zeros(n, n));
            for (bin, samples) in bins() {
                square += share * products.square(bin, k) / samples;
                half += products.half_gradient(bin, k) * (share / samples);
                product += products.products(bin, k) * (share / samples);
            }
            let (root, weight) = (square.sqrt().max(f64::MIN_POSITIVE.sqrt()), 1.0 / (scale.rms[k] * all.parts));
            slopes.cost += weight * root;
            slopes.curvature -= &half * half.transpose() * (weight / root.powi(3));
            slopes.gradient += half * (weight / root);
            slopes.curvature += &product * (weight / root);
            slopes.majorant += product * (weight / root);
        }
        return slopes;
    }
    // The derivative of a logarithm is that of a sum of squares in which the weight of a bin depends on its present error.
    let weight = 1.0 / (all.bins * SIGNALS as f64);
    for (bin, samples) in bins() {
        for (k, floor) in FLOOR.iter().enumerate() {
            let mse = products.square(bin, k) / samples + floor * floor;
            slopes.cost += weight * mse.ln();
            let factor = 2.0 * weight / (mse * samples);
            slopes.gradient += products.half_gradient(bin, k) * factor;
            slopes.curvature += products.products(bin, k) * factor;
        }
    }
    slopes.majorant.clone_from(&slopes.curvature);
    slopes
}
