//! Runs that are corrected towards the measurement, for diagnoses.

use super::{Failure, Raw, Share, Together};
use nalgebra::{DMatrix, DVector};

/// The correction of one candidate's run towards the measurement, with r = predicted - measured: a steady-state Kalman observer in
/// innovations form over spacing, speed and d, the missing acceleration \[m/s²\], which is added to the model's acceleration after all its
/// limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    /// After each step: s -= `gain[0]` r_s + `gain[1]` r_v; v_f -= `gain[2]` r_s + `gain[3]` r_v, then at least 0;
    /// d -= `gain[4]` r_s + `gain[5]` r_v. Zeros: free simulation.
    pub gain: [f64; 6],
    /// z_1 = `whitening[0]` r_s, z_2 = `whitening[1]` r_s + `whitening[2]` r_v.
    pub whitening: [f64; 3],
    /// d is multiplied by it in every step.
    pub decay: f64,
}

impl Observer {
    /// Free simulation with unweighted residuals.
    pub const NONE: Observer = Observer { gain: [0.0; 6], whitening: [1.0, 0.0, 1.0], decay: 0.0 };
}

/// A run in windows: each begins at the measurement and is free to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Windows {
    /// First sample of the first window's run-up.
    pub from: usize,
    /// Samples of a run-up, in which the run is kept on the measurement while memories adjust.
    pub run_up: usize,
    /// Samples of a window after the run-up.
    pub free: usize,
}

impl Windows {
    /// True if the run is kept on the measurement.
    pub fn holds(&self, t: usize) -> bool {
        t < self.from || (t - self.from) % (self.run_up + self.free) < self.run_up
    }
}

/// A run that continues with a penalty beyond a collision or a negative radicand of Gipps, or where a convention rejects it at an
/// acceleration bound, so that a search sees its distance from a valid run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Soft {
    /// Spacing below which a run pays the penalty \[m\].
    pub least: f64,
    /// Cost of the sum over the samples of (shortfall of the spacing \[m\] + cut of the acceleration \[m/s²\])², in units of the score.
    pub price: f64,
}

/// A run of a search: pulled towards the measurement, soft or plain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// Share of the residuals of spacing and speed that is taken back after each step; 0: free simulation.
    pub share: f64,
    /// `None`: a run that collides fails.
    pub soft: Option<Soft>,
}

impl Pull {
    /// A plain run.
    pub const NONE: Pull = Pull { share: 0.0, soft: None };
}

/// A score with its derivatives with respect to the coordinates of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// The score and the cost of shortfalls; infinite if the run failed.
    pub cost: f64,
    pub gradient: DVector<f64>,
    /// The Gauss-Newton approximation of its second derivatives.
    pub curvature: DMatrix<f64>,
    /// The same for the weighted sum of squares that touches the score here from above.
    pub majorant: DMatrix<f64>,
}

impl Slopes {
    /// The derivatives of the score of several drives, each with its share, in `n` coordinates, from those of each drive in the coordinates
    /// that are moved.
    pub fn together(drives: &[&Slopes], shares: &[Share], moved: &[usize], n: usize) -> Slopes {
        let mut all = Together::default();
        drives.iter().zip(shares).for_each(|(slopes, share)| all.add(slopes.cost, *share));
        // A root of squares is bent.
        let root = all.value().max(f64::MIN_POSITIVE.sqrt());
        let (vector, matrix) = (DVector::zeros(n), DMatrix::zeros(n, n));
        let mut sum = Slopes { cost: 0.0, gradient: vector, curvature: matrix.clone(), majorant: matrix };
        for (slopes, share) in drives.iter().zip(shares) {
            // First and second derivative by the score of the drive.
            let (first, second) = match share.weight {
                None => (1.0 / drives.len() as f64, 0.0),
                Some(weight) => (weight * slopes.cost / (all.weights() * root), weight / (all.weights() * root)),
            };
            sum.cost += first * slopes.cost;
            for (a, &i) in moved.iter().enumerate() {
                sum.gradient[i] += first * slopes.gradient[a];
                for (b, &j) in moved.iter().enumerate() {
                    sum.curvature[(i, j)] += first * slopes.curvature[(a, b)];
                    sum.majorant[(i, j)] += first * slopes.majorant[(a, b)];
                    if second > 0.0 {
                        sum.curvature[(i, j)] += second * slopes.gradient[a] * slopes.gradient[b];
                    }
                }
            }
        }
        if shares.iter().any(|share| share.weight.is_some()) {
            sum.curvature -= &sum.gradient * sum.gradient.transpose() / root;
        }
        sum
    }
}

/// Sums of an observed run.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// Status, cuts and sums.
    pub raw: Raw,
    /// Sums of z_1² and z_2² of each block of samples, counted from sample 0; 0 if a run did not reach the end of the block.
    pub blocks: Vec<[f64; 2]>,
}

/// An observed run sample by sample; all series are as long as the trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct Innovations {
    /// Sample at which the run ended early; all later values are NaN. `None` for a complete run.
    pub failed: Option<Failure>,
    /// First simulated sample; before it, residuals are 0 and the state is the measured one.
    pub first: usize,
    /// r_s \[m\] and r_v \[m/s\] before the correction.
    pub residual: Vec<[f64; 2]>,
    /// s \[m\], v_f \[m/s\] and d \[m/s²\] after the correction.
    pub state: Vec<[f64; 3]>,
    /// Acceleration of the model without d \[m/s²\].
    pub acceleration: Vec<f64>,
}

/// Residuals of observed runs before their corrections, over a stretch of samples. The candidates of a block are interleaved sample by
/// sample, in the order of their computation, so that a sum reads memory once, while it is cached.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Candidates in a block; the last block may have fewer, followed by undefined numbers.
    pub lanes: usize,
    /// First sample of the stretch.
    pub from: usize,
    pub samples: usize,
    /// Numbers of a candidate per sample.
    pub signals: usize,
    /// Candidate i is in block i / `lanes`, whose number (`signals` k + signal) `lanes` + i % `lanes` is its residual of s \[m\] (signal 0)
    /// or v \[m/s\] (signal 1) at sample `from` + k. After a run has failed, its values are undefined.
    pub blocks: Vec<Vec<f64>>,
}

impl Residuals {
    /// Blocks have a multiple of this many candidates, the numbers of the widest vector, so that sums have no remainder.
    pub const STRIDE: usize = 8;

    /// Residuals of whole runs, one by one; all have the length of the longest.
    pub fn new(runs: &[Vec<[f64; 2]>]) -> Residuals {
        let (lanes, samples) =
            (runs.len().max(1).next_multiple_of(Self::STRIDE), runs.iter().map(Vec::len).max().unwrap_or(0));
        let mut block = vec![f64::NAN; 2 * samples * lanes];
        for (i, run) in runs.iter().enumerate() {
            for (t, r) in run.iter().enumerate() {
                block[2 * t * lanes + i] = r[0];
                block[(2 * t + 1) * lanes + i] = r[1];
            }
        }
        Residuals { lanes, from: 0, samples, signals: 2, blocks: vec![block] }
    }

    /// The numbers of one candidate that belong to a signal, sample by sample.
    pub fn signal(&self, candidate: usize, signal: usize) -> impl Iterator<Item = f64> {
        let (lanes, lane) = (self.lanes, candidate % self.lanes);
        let rows = self.blocks[candidate / lanes].chunks_exact(self.signals * lanes);
        rows.map(move |row| row[signal * lanes + lane])
    }

    /// Residuals of s and v of one candidate, sample by sample.
    pub fn of(&self, candidate: usize) -> impl Iterator<Item = [f64; 2]> {
        let (lanes, lane) = (self.lanes, candidate % self.lanes);
        let rows = self.blocks[candidate / lanes].chunks_exact(2 * lanes);
        rows.map(move |row| [row[lane], row[lanes + lane]])
    }
}
