//! First and second derivatives of the likelihood of innovations, from finite differences.
//!
//! Fisher scoring for a Gaussian innovations likelihood: model parameters change the innovations, noise parameters also change their
//! covariance, and one step estimates both.

use super::observer::{KalmanGain, Noise};
use crate::evaluator::{Failure, Residuals};
use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Half the sum of squares and log-determinants, with gradient and information.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    /// Negative log-likelihood, without the constant.
    pub cost: f64,
    pub gradient: DVector<f64>,
    /// Fisher's information.
    pub information: DMatrix<f64>,
    /// Samples that count.
    pub samples: usize,
}

/// Accumulates negative log-likelihoods of runs, stretch by stretch.
#[derive(Debug)]
pub struct Costs<'a> {
    observers: &'a [KalmanGain],
    /// Samples that count.
    mask: &'a [bool],
    blocks: Vec<Squares>,
}

/// Sums of whitened squares over the lanes of a block.
#[derive(Debug)]
struct Squares {
    whitening: [Vec<f64>; 3],
    sums: Vec<f64>,
}

impl Costs<'_> {
    /// An accumulator for runs with these observers.
    #[must_use]
    pub fn new<'a>(observers: &'a [KalmanGain], mask: &'a [bool]) -> Costs<'a> {
        Costs { observers, mask, blocks: Vec::new() }
    }

    /// Adds a stretch of all runs.
    pub fn add(&mut self, stretch: &Residuals) {
        if self.blocks.is_empty() {
            let squares = |observers: &[KalmanGain]| {
                let row = |k: usize| padded(observers.iter().map(|designed| designed.whitening[k]), stretch.lanes);
                Squares { whitening: std::array::from_fn(row), sums: vec![0.0; stretch.lanes] }
            };
            self.blocks = self.observers.chunks(stretch.lanes).map(squares).collect();
        }
        let mask = &self.mask[stretch.from..];
        self.blocks
            .par_iter_mut()
            .zip(&stretch.blocks)
            .for_each(|(squares, rows)| Arch::new().dispatch(AddSquares { squares, rows, mask }));
    }

    /// The costs, infinite if a run failed.
    #[must_use]
    pub fn finish(self, failed: &[Option<Failure>]) -> Vec<f64> {
        let samples = self.mask.iter().filter(|counts| **counts).count() as f64;
        let squares = self.blocks.iter().flat_map(|block| &block.sums).copied().chain(std::iter::repeat(f64::INFINITY));
        let cost = |((squares, designed), failed): ((f64, &KalmanGain), &Option<Failure>)| {
            if failed.is_some() { f64::INFINITY } else { 0.5 * (squares + samples * designed.log_det) }
        };
        squares.zip(self.observers).zip(failed).map(cost).collect()
    }
}

/// `count` numbers, filled with zeros.
fn padded(numbers: impl Iterator<Item = f64>, count: usize) -> Vec<f64> {
    numbers.chain(std::iter::repeat(0.0)).take(count).collect()
}

/// Adds the rows of a block to its sums.
struct AddSquares<'a> {
    squares: &'a mut Squares,
    rows: &'a [f64],
    mask: &'a [bool],
}

// Explicit vectors, because the compiler vectorises loops for the oldest processor, if at all. No multiplication is fused with an addition,
// so that every processor gives the same bits.
impl WithSimd for AddSquares<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Squares { whitening, sums } = self.squares;
        let lanes = sums.len();
        let [w_11, w_21, w_22] = whitening.each_ref().map(|w| vectors::<S>(w));
        for (rows, _) in self.rows.chunks_exact(2 * lanes).zip(self.mask).filter(|(_, counts)| **counts) {
            let (r_s, r_v) = rows.split_at(lanes);
            let (r_s, r_v) = (vectors::<S>(r_s), vectors::<S>(r_v));
            for (i, sum) in S::as_mut_simd_f64s(sums).0.iter_mut().enumerate() {
                let z_1 = simd.mul_f64s(w_11[i], r_s[i]);
                let z_2 = simd.add_f64s(simd.mul_f64s(w_21[i], r_s[i]), simd.mul_f64s(w_22[i], r_v[i]));
                *sum = simd.add_f64s(*sum, simd.add_f64s(simd.mul_f64s(z_1, z_1), simd.mul_f64s(z_2, z_2)));
            }
        }
    }
}

/// A row as vectors.
///
/// # Panics If the length is not a multiple of [`Residuals::STRIDE`], the widest vector.
#[inline(always)]
fn vectors<S: Simd>(row: &[f64]) -> &[S::f64s] {
    let (vectors, rest) = S::as_simd_f64s(row);
    assert!(rest.is_empty(), "rows of whole vectors");
    vectors
}

/// Products of the columns of a run. The first column holds the innovations; each other column holds their derivative in a coordinate, from a
/// run with this coordinate one step further.
#[derive(Debug)]
pub struct Products<'a> {
    /// Index of the run.
    first: usize,
    /// Observers of the run and of the moved runs.
    observers: Vec<KalmanGain>,
    /// Finite-difference steps of the moved runs.
    steps: Vec<f64>,
    /// Samples that count.
    mask: &'a [bool],
    window: Window,
    /// Products of all columns in the window, row by row; used up to the diagonal.
    sums: Vec<f64>,
    /// Products of the innovations, signal by signal.
    outer: [[f64; 2]; 2],
    /// Whitened columns of a tile.
    z_1: Vec<f64>,
    z_2: Vec<f64>,
}

/// Vectors of the blocks that contain the columns, contiguously; they also contain unused numbers.
#[derive(Debug, Default)]
struct Window {
    /// Blocks, and the range of vectors in their rows.
    vectors: Vec<[usize; 2]>,
    /// Positions of the columns.
    places: Vec<usize>,
    /// Factors that whiten a difference and divide it by its step.
    scale: [Vec<f64>; 3],
}

/// Samples in a tile of whitened columns: few enough for the first-level cache.
const TILE: usize = 32;
/// Columns multiplied at once by two vectors in turn: the sums stay in registers over a tile.
const AT_ONCE: usize = 4;

impl<'a> Products<'a> {
    /// Products of the run `first` and the runs that follow it, with their observers and the steps of the latter.
    #[must_use]
    pub fn new(first: usize, observers: Vec<KalmanGain>, steps: Vec<f64>, mask: &'a [bool]) -> Products<'a> {
        let window = Window::default();
        Products {
            first,
            observers,
            steps,
            mask,
            window,
            sums: Vec::new(),
            outer: [[0.0; 2]; 2],
            z_1: Vec::new(),
            z_2: Vec::new(),
        }
    }

    /// Adds a stretch of all runs.
    pub fn add(&mut self, stretch: &Residuals) {
        Arch::new().dispatch(AddProducts { products: self, stretch });
    }

    /// Product of two columns, the second no later than the first; 0 if a run failed.
    fn get(&self, failed: &[Option<Failure>], j: usize, k: usize) -> f64 {
        if failed[self.first + j].or(failed[self.first + k]).is_some() {
            return 0.0;
        }
        let places = &self.window.places;
        self.sums[places[j] * self.window.scale[0].len() + places[k]]
    }
}

impl Window {
    /// A layout in vectors of `numbers` numbers.
    fn new(products: &Products<'_>, lanes: usize, numbers: usize) -> Window {
        let mut window = Window::default();
        for (j, observer) in products.observers.iter().enumerate() {
            let (block, lane) = ((products.first + j) / lanes, (products.first + j) % lanes);
            let vector = [block, lane / numbers];
            if window.vectors.last() != Some(&vector) {
                window.vectors.push(vector);
                window.scale.iter_mut().for_each(|scale| scale.resize(window.vectors.len() * numbers, 0.0));
            }
            let place = (window.vectors.len() - 1) * numbers + lane % numbers;
            window.places.push(place);
            if j > 0 {
                for (scale, whitening) in window.scale.iter_mut().zip(observer.whitening) {
                    scale[place] = whitening / products.steps[j - 1];
                }
            }
        }
        window
    }
}

/// Adds a stretch to products.
struct AddProducts<'a, 'b> {
    products: &'a mut Products<'b>,
    stretch: &'a Residuals,
}

impl WithSimd for AddProducts<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (products, stretch) = (self.products, self.stretch);
        let (lanes, numbers) = (stretch.lanes, S::F64_LANES);
        if products.sums.is_empty() {
            products.window = Window::new(products, lanes, numbers);
            let width = products.window.vectors.len() * numbers;
            products.sums = vec![0.0; width * width];
            products.z_1 = vec![0.0; TILE * width];
            products.z_2 = vec![0.0; TILE * width];
        }
        let Products { first, observers, mask, window, sums, outer, z_1, z_2, .. } = products;
        let width = window.vectors.len() * numbers;
        let scale = window.scale.each_ref().map(|scale| vectors::<S>(scale));
        let counts = |k: &usize| mask[stretch.from + k];
        let mut counting = (0..stretch.samples).filter(counts);
        loop {
            let mut samples = 0;
            let rows = z_1.chunks_exact_mut(width).zip(z_2.chunks_exact_mut(width));
            for ((z_1, z_2), t) in rows.zip(&mut counting) {
                samples += 1;
                let at = 2 * t * lanes + *first % lanes;
                let r = [stretch.blocks[*first / lanes][at], stretch.blocks[*first / lanes][at + lanes]];
                let (now_s, now_v) = (simd.splat_f64s(r[0]), simd.splat_f64s(r[1]));
                let whitened = S::as_mut_simd_f64s(z_1).0.iter_mut().zip(S::as_mut_simd_f64s(z_2).0);
                for ((k, (z_1, z_2)), &[block, vector]) in whitened.enumerate().zip(&window.vectors) {
                    let (r_s, r_v) = stretch.blocks[block][2 * t * lanes..2 * (t + 1) * lanes].split_at(lanes);
                    let d_s = simd.sub_f64s(vectors::<S>(r_s)[vector], now_s);
                    let d_v = simd.sub_f64s(vectors::<S>(r_v)[vector], now_v);
                    *z_1 = simd.mul_f64s(scale[0][k], d_s);
                    *z_2 = simd.add_f64s(simd.mul_f64s(scale[1][k], d_s), simd.mul_f64s(scale[2][k], d_v));
                }
                let z = observers[0].white(r);
                (z_1[window.places[0]], z_2[window.places[0]]) = (z[0], z[1]);
                for (i, z_i) in z.iter().enumerate() {
                    outer[i][0] += z_i * z[0];
                    outer[i][1] += z_i * z[1];
                }
            }
            if samples == 0 {
                break;
            }
            let (z_1, z_2) = (&z_1[..samples * width], &z_2[..samples * width]);
            for places in window.places.chunks(AT_ONCE) {
                // Repeats the last column if there are fewer.
                let places: [usize; AT_ONCE] = std::array::from_fn(|i| places[i.min(places.len() - 1)]);
                let last = places[AT_ONCE - 1] / numbers;
                for k in (0..=last).step_by(2) {
                    let with = [k, last.min(k + 1)];
                    let sum = |place: usize| {
                        let line = vectors::<S>(&sums[place * width..(place + 1) * width]);
                        [line[with[0]], line[with[1]]]
                    };
                    let mut added = places.map(sum);
                    for (z_1, z_2) in z_1.chunks_exact(width).zip(z_2.chunks_exact(width)) {
                        let (with_1, with_2) = (vectors::<S>(z_1), vectors::<S>(z_2));
                        let (with_1, with_2) = ([with_1[with[0]], with_1[with[1]]], [with_2[with[0]], with_2[with[1]]]);
                        for (sums, place) in added.iter_mut().zip(places) {
                            let (of_1, of_2) = (simd.splat_f64s(z_1[place]), simd.splat_f64s(z_2[place]));
                            for i in 0..2 {
                                let product =
                                    simd.add_f64s(simd.mul_f64s(of_1, with_1[i]), simd.mul_f64s(of_2, with_2[i]));
                                sums[i] = simd.add_f64s(sums[i], product);
                            }
                        }
                    }
                    for (added, place) in added.into_iter().zip(places) {
                        let line = S::as_mut_simd_f64s(&mut sums[place * width..(place + 1) * width]).0;
                        (line[with[0]], line[with[1]]) = (added[0], added[1]);
                    }
                }
            }
        }
    }
}

impl NormalEquations {
    /// Zero equations for `n` coordinates.
    #[must_use]
    pub fn zero(coordinates: usize) -> NormalEquations {
        let (gradient, information) = (DVector::zeros(coordinates), DMatrix::zeros(coordinates, coordinates));
        NormalEquations { cost: 0.0, gradient, information, samples: 0 }
    }

    /// Predicted decrease of the cost from here to another point.
    #[must_use]
    pub fn promise(&self, from: &[f64], to: &[f64]) -> f64 {
        let change = DVector::from_iterator(from.len(), to.iter().zip(from).map(|(to, from)| to - from));
        -change.dot(&self.gradient) - 0.5 * change.dot(&(&self.information * &change))
    }

    /// Adds one drive, unless the run itself failed. `coordinates` are those of the moved runs; the last [`Noise::COUNT`] of them belong to
    /// the noise.
    pub fn add(&mut self, products: &Products<'_>, coordinates: &[usize], failed: &[Option<Failure>]) {
        let Products { first, observers, steps, mask, outer, .. } = products;
        if failed[*first].is_some() {
            return;
        }
        let designed = &observers[0];
        let first_noise = coordinates.len() - Noise::COUNT;
        let samples = mask.iter().filter(|counts| **counts).count();
        let n = samples as f64;
        self.samples += samples;
        self.cost += 0.5 * (outer[0][0] + outer[1][1] + n * designed.log_det);
        for (a, &j) in coordinates.iter().enumerate() {
            self.gradient[j] += products.get(failed, 1 + a, 0);
            for (b, &k) in coordinates[..=a].iter().enumerate() {
                let product = products.get(failed, 1 + a, 1 + b);
                self.information[(j, k)] += product;
                if k < j {
                    self.information[(k, j)] += product;
                }
            }
        }
        // Effect of the noise on the covariance: dW W^-1, lower triangular.
        let noise = || observers[1 + first_noise..].iter().zip(&steps[first_noise..]);
        let relative: Vec<[f64; 3]> = noise().map(|(moved, step)| relative(designed, moved, *step)).collect();
        let noisy = &coordinates[first_noise..];
        for ((a, &j), (moved, step)) in relative.iter().zip(noisy).zip(noise()) {
            let log_det = (moved.log_det - designed.log_det) / step;
            self.gradient[j] += a[0] * outer[0][0] + a[1] * outer[1][0] + a[2] * outer[1][1] + 0.5 * n * log_det;
            for (b, &k) in relative.iter().zip(noisy) {
                let trace = 4.0 * (a[0] * b[0] + a[2] * b[2]) + 2.0 * a[1] * b[1];
                self.information[(j, k)] += 0.5 * n * trace;
            }
        }
    }
}

/// dW W^-1 per step: elements 11, 21 and 22.
fn relative(designed: &KalmanGain, moved: &KalmanGain, step: f64) -> [f64; 3] {
    let [w_11, w_21, w_22] = designed.whitening;
    let mut change = moved.whitening;
    change.iter_mut().zip(designed.whitening).for_each(|(new, old)| *new = (*new - old) / step);
    let [d_11, d_21, d_22] = change;
    [d_11 / w_11, (d_21 - d_22 * w_21 / w_22) / w_11, d_22 / w_22]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::likelihood::observer::design;
    use crate::evaluator::FailureKind;
    use crate::optimize::stream;
    use rand::RngExt;

    const SAMPLES: usize = 300;
    const LANES: usize = 16;

    /// Cuts runs into stretches.
    fn stretches(runs: &[Vec<[f64; 2]>]) -> Vec<Residuals> {
        let block = |of: &[Vec<[f64; 2]>], from: usize, samples: usize| {
            let mut block = vec![f64::NAN; 2 * samples * LANES];
            for (lane, run) in of.iter().enumerate() {
                for (k, r) in run[from..from + samples].iter().enumerate() {
                    (block[2 * k * LANES + lane], block[(2 * k + 1) * LANES + lane]) = (r[0], r[1]);
                }
            }
            block
        };
        let stretch = |from: usize| {
            let samples = (SAMPLES - from).min(128);
            let blocks = runs.chunks(LANES).map(|of| block(of, from, samples)).collect();
            Residuals { lanes: LANES, from, samples, signals: 2, blocks }
        };
        (0..SAMPLES).step_by(128).map(stretch).collect()
    }

    /// A group that spans two blocks beside other runs, with samples that do not count, a failed column and an omitted one: the same bits
    /// as scalar loops, in the costs, too.
    #[test]
    fn products_and_costs_are_those_of_plain_loops() {
        let rng = &mut stream(1, 0, 0, 0);
        let mut number = || rng.random::<f64>() - 0.5;
        let (first, coordinates) = (11, [0, 1, 3, 4, 5, 6, 7, 8]);
        let runs: Vec<Vec<[f64; 2]>> = (0..27).map(|_| (0..SAMPLES).map(|_| [number(), number()]).collect()).collect();
        let noise = |k: usize| {
            let mut logs = [-3.0, 0.7, -4.0, -3.5, -5.0];
            if let Some(k) = (k + Noise::COUNT).checked_sub(coordinates.len() + 1) {
                logs[k] += 1e-4;
            }
            Noise::from_logs(logs)
        };
        let observers: Vec<KalmanGain> = (0..=coordinates.len()).map(|k| design(&noise(k), 0.1)).collect();
        let steps: Vec<f64> = (0..coordinates.len()).map(|a| if a < 3 { 1e-5 } else { 1e-4 }).collect();
        let mask: Vec<bool> = (0..SAMPLES).map(|t| t > 4 && t % 7 != 0).collect();
        let mut failed = vec![None; runs.len()];
        failed[first + 2] = Some(Failure { kind: FailureKind::Crash, step: 9 });

        let mut products = Products::new(first, observers.clone(), steps.clone(), &mask);
        stretches(&runs).iter().for_each(|stretch| products.add(stretch));
        let mut gram = NormalEquations::zero(9);
        gram.add(&products, &coordinates, &failed);

        let counting: Vec<usize> = (0..SAMPLES).filter(|t| mask[*t]).collect();
        let column = |a: usize, t: usize| -> [f64; 2] {
            let [now, moved] = [runs[first][t], runs[first + 1 + a][t]];
            let (d, w) = ([moved[0] - now[0], moved[1] - now[1]], observers[1 + a].whitening.map(|w| w / steps[a]));
            if failed[first + 1 + a].is_some() { [0.0; 2] } else { [w[0] * d[0], w[1] * d[0] + w[2] * d[1]] }
        };
        let sum = |of: &dyn Fn(usize) -> f64| counting.iter().fold(0.0, |sum, t| sum + of(*t));
        for (a, &j) in coordinates.iter().enumerate() {
            for (b, &k) in coordinates.iter().enumerate().filter(|(b, _)| *b <= a) {
                let expected = sum(&|t| column(a, t)[0] * column(b, t)[0] + column(a, t)[1] * column(b, t)[1]);
                assert_eq!(products.get(&failed, 1 + a, 1 + b), expected);
                // The terms of the covariance are additional.
                assert!(b >= 3 || gram.information[(j, k)] == expected);
                assert_eq!(gram.information[(k, j)], gram.information[(j, k)]);
            }
            let white = |t: usize| observers[0].white(runs[first][t]);
            let expected = sum(&|t| column(a, t)[0] * white(t)[0] + column(a, t)[1] * white(t)[1]);
            assert!(a >= 3 || gram.gradient[j] == expected, "{a}: {} not {expected}", gram.gradient[j]);
        }
        assert!((0..9).all(|j| gram.information[(2, j)] == 0.0 && gram.information[(1, j)] == 0.0));

        let same = vec![observers[0]; runs.len()];
        let mut costs = Costs::new(&same, &mask);
        stretches(&runs).iter().for_each(|stretch| costs.add(stretch));
        let costs = costs.finish(&failed);
        // The sum there runs signal by signal.
        assert!((costs[first] - gram.cost).abs() < 1e-12 * gram.cost);
        assert!(costs[first + 2].is_infinite() && costs.iter().filter(|cost| cost.is_finite()).count() == 26);
    }
}
