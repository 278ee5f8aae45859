//! Regression on a wandering level: y = X β + w + e, with w the integral of the speeds' noise (a random walk) and e the gap's.
//!
//! The Kalman filter of the level whitens y and every column of X alike; the ratio of the two noises is estimated by maximum
//! likelihood, and the errors of β are those of Newey and West, because real noise differs from the model.

use super::jumps::Jump;
use super::link::{Link, rates};
use crate::statistics::rms;
use crate::trajectory::steps::runs;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Shorter stretches are not used \[s\].
const STRETCH_S: f64 = 5.0;
/// Lags of the autocorrelation that the errors allow for \[s\].
const LAG_S: f64 = 8.0;

/// Stretches of the drive in which both cars move and nothing is missing, held or jumping.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Usable {
    pub stretches: Vec<Range<usize>>,
}

impl Usable {
    pub fn new(link: &Link, broken: &[Range<usize>], jumps: &[Jump]) -> Usable {
        let mut good: Vec<bool> = (0..link.len()).map(|i| link.driving(i) && link.gap[i].is_finite()).collect();
        for range in broken {
            good[range.start.saturating_sub(1)..(range.end + 1).min(link.len())].fill(false);
        }
        for jump in jumps.iter().filter(|jump| jump.range.len() > 1) {
            good[jump.range.start..jump.range.end.min(link.len())].fill(false);
        }
        let shortest = link.samples(STRETCH_S);
        // The sample after a jump starts a new stretch.
        let starts: Vec<usize> = jumps.iter().filter(|jump| jump.range.len() == 1).map(|jump| jump.range.end).collect();
        let pieces = |run: Range<usize>| {
            let inside = starts.iter().copied().filter(|start| run.contains(start));
            let cuts: Vec<usize> = [run.start].into_iter().chain(inside).chain([run.end]).collect();
            cuts.windows(2).map(|ends| ends[0]..ends[1]).collect::<Vec<_>>()
        };
        let stretches = runs(0..link.len(), |i| good[i]).flat_map(pieces).filter(|piece| piece.len() >= shortest);
        Usable { stretches: stretches.collect() }
    }

    pub fn samples(&self) -> usize {
        self.stretches.iter().map(Range::len).sum()
    }
}

/// The root mean square of [`rates`] \[m/s\].
pub(super) fn rate_rms(link: &Link, stretches: &[Range<usize>]) -> Option<f64> {
    rms(rates(link, stretches).map(|(_, rate)| rate))
}

/// Steps of a singular value decomposition of a few columns at most.
const SVD_STEPS: usize = 1000;

/// A fitted regression.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit {
    pub beta: DVector<f64>,
    /// Covariance of `beta`, allowing for autocorrelation.
    pub covariance: DMatrix<f64>,
    /// Logarithm of the likelihood \[nats\], up to a constant.
    pub likelihood: f64,
}

/// y and X; a column that contains the noise e has an instrument that contains almost none of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    /// y, then X.
    pub values: Vec<Vec<f64>>,
    /// The index in `values` of the column with an instrument, and the instrument.
    pub instrument: (usize, Vec<f64>),
}

/// The likeliest ratio of variances of y = X β: walk per sample over gap noise.
pub(super) fn ratio(columns: &Columns, usable: &Usable) -> f64 {
    let likelihood =
        |ratio: f64| regress(columns, usable, ratio.exp(), 0).map_or(f64::NEG_INFINITY, |fit| fit.likelihood);
    golden(likelihood, -16.0, 10.0).exp()
}

/// Lags of the autocorrelation that the errors allow for \[samples\].
pub(super) fn lags(dt: f64) -> usize {
    (LAG_S / dt).round() as usize
}

/// Logarithm of the likelihood \[nats\] of y without any column, up to the same constant as that of a fit.
pub(super) fn likelihood_of(y: &[f64], usable: &Usable) -> f64 {
    let likelihood = |ratio: f64| {
        let (white, log_s) = whitened(&[y], usable, ratio.exp());
        log_likelihood(white.norm_squared(), white.nrows(), log_s)
    };
    likelihood(golden(likelihood, -16.0, 10.0))
}

fn log_likelihood(squares: f64, rows: usize, log_s: f64) -> f64 {
    let n = rows as f64;
    -0.5 * (n * (squares / n).max(1e-300).ln() + log_s)
}

/// Largest value of a unimodal function.
fn golden(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let share = 0.5 * (5f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut f_a, mut f_b) = (f(a), f(b));
    // 26 / 1.618^11 = 0.13: the estimates hardly depend on the ratio.
    for _ in 0..11 {
        if f_a > f_b {
            (high, b, f_b) = (b, a, f_a);
            a = high - share * (high - low);
            f_a = f(a);
        } else {
            (low, a, f_a) = (a, b, f_b);
            b = low + share * (high - low);
            f_b = f(b);
        }
    }
    0.5 * (low + high)
}

/// Innovations of columns by the filter of a wandering level, and the logarithm of the determinant of their covariance.
fn whitened(columns: &[&[f64]], usable: &Usable, ratio: f64) -> (DMatrix<f64>, f64) {
    let count = columns.len();
    let rows = usable.samples() - usable.stretches.len();
    let mut white = DMatrix::zeros(rows, count);
    let (mut row, mut log_s) = (0, 0.0);
    let mut level = vec![0.0; count];
    for stretch in &usable.stretches {
        // The level starts as the first sample, with the uncertainty of the gap.
        (0..count).for_each(|c| level[c] = columns[c][stretch.start]);
        let mut variance = 1.0;
        for i in stretch.clone().skip(1) {
            let predicted = variance + ratio;
            let s = predicted + 1.0;
            let gain = predicted / s;
            let root = s.sqrt();
            for c in 0..count {
                let innovation = columns[c][i] - level[c];
                white[(row, c)] = innovation / root;
                level[c] += gain * innovation;
            }
            variance = predicted * (1.0 - gain);
            log_s += s.ln();
            row += 1;
        }
    }
    (white, log_s)
}

/// Fits y = X β for a ratio of variances; each stretch has a level of its own. Without `lags` there is no covariance, which takes most of
/// the time. `None` if the columns depend on each other.
pub(super) fn regress(columns: &Columns, usable: &Usable, ratio: f64, lags: usize) -> Option<Fit> {
    let (instrumented, instrument) = &columns.instrument;
    let columns: Vec<&[f64]> = columns.values.iter().chain([instrument]).map(Vec::as_slice).collect();
    let count = columns.len();
    let rows = usable.samples() - usable.stretches.len();
    let parameters = count - 2;
    if rows < 10 * count {
        return None;
    }
    let (white, log_s) = whitened(&columns, usable, ratio);
    let y = white.column(0).clone_owned();
    let x = white.columns(1, parameters).clone_owned();
    let mut z = x.clone();
    z.set_column(instrumented - 1, &white.column(count - 1));
    // Columns of very different units: scaled for the solution.
    let scale: Vec<f64> = x.column_iter().map(|c| c.norm().max(1e-300)).collect();
    let mut normal = z.tr_mul(&x);
    for i in 0..parameters {
        for j in 0..parameters {
            normal[(i, j)] /= scale[i] * scale[j];
        }
    }
    let mut right = z.tr_mul(&y);
    (0..parameters).for_each(|i| right[i] /= scale[i]);
    // A constant signal gives infinite or undefined numbers, on which a decomposition would not converge.
    if !normal.iter().all(|x| x.is_finite()) {
        return None;
    }
    let singular = normal.clone().try_svd(false, false, f64::EPSILON, SVD_STEPS)?.singular_values;
    if singular.min() < 1e-10 {
        return None;
    }
    let inverse = normal.try_inverse()?;
    let solution = &inverse * right;
    let beta = DVector::from_fn(parameters, |i, _| solution[i] / scale[i]);
    let residual = &y - &x * &beta;
    let likelihood = log_likelihood(residual.norm_squared(), rows, log_s);
    if lags == 0 {
        return Some(Fit { beta, covariance: DMatrix::zeros(parameters, parameters), likelihood });
    }
    let scores = DMatrix::from_fn(rows, parameters, |i, j| z[(i, j)] / scale[j] * residual[i]);
    let mut middle = scores.tr_mul(&scores);
    for lag in 1..=lags.min(rows / 4) {
        let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
        let early = scores.rows(0, rows - lag);
        let late = scores.rows(lag, rows - lag);
        let cross = early.tr_mul(&late);
        middle += (&cross + cross.transpose()) * weight;
    }
    let mut covariance = &inverse * middle * inverse.transpose();
    for i in 0..parameters {
        for j in 0..parameters {
            covariance[(i, j)] /= scale[i] * scale[j];
        }
    }
    Some(Fit { beta, covariance, likelihood })
}
