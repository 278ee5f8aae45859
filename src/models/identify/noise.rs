//! Noise of a measured drive, and its effect on a simulation of the drive.
//!
//! Residuals of a free simulation do not measure the noise: the fit has removed the part that the parameters can follow, which for a short
//! drive is most of it. One-step errors from the measured state show the noise at all samples. It has two parts: errors of the measurement,
//! independent between samples, and a lasting acceleration that the model does not know (Ornstein-Uhlenbeck). Their sizes maximise the
//! restricted likelihood (H. D. Patterson and R. Thompson, Biometrika 58, 1971), which allows for the fitted parameters.

use crate::calibrate::SearchSpace;
use crate::evaluator::{Case, EvaluateError, Evaluator, Job, Observer, Population};
use crate::lanes::Lanes;
use crate::symbols::Parameters;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

/// An observer that resets the state to the measurement after each step.
const HELD: Observer = Observer { gain: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0], ..Observer::NONE };

/// Time constants of the unknown acceleration \[s\]: first, last and factor of the grid. The driver responds to longer ones.
const LASTS_S: [f64; 3] = [0.05, 8.0, 1.6];
/// Speed that the unknown acceleration adds in a sample, as a multiple of the error of a measured speed: first, last and factor of the
/// grid, in addition to zero.
const RATIO: [f64; 3] = [0.003, 1000.0, 2.0];
/// Fraction of a step for the refinement around the best.
const FINER: f64 = 0.25;
/// A parameter is not removed if a smaller share of its effect than this is unique: the others have the same effect.
const OWN: f64 = 1e-10;

/// Time in which a driver has responded to a disturbance \[s\]: the speed that the unknown acceleration adds in it is the size of the
/// noise.
const ANSWERED_S: f64 = 4.0;

/// Noise of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Standard deviation of the unknown acceleration \[m/s²\], and its duration \[s\].
    pub acceleration: f64,
    pub lasts: f64,
    /// Standard deviations of the measured spacing \[m\] and speed \[m/s\].
    pub spacing: f64,
    pub speed: f64,
}

impl Noise {
    /// From the one-step errors of a candidate; `None` if it cannot be simulated. `steps`: shares of the range by which each parameter is
    /// moved.
    pub fn of(
        lanes: &Lanes,
        case: usize,
        space: &SearchSpace,
        candidate: &[f64],
        step: f64,
    ) -> Result<Option<Noise>, EvaluateError> {
        let mut population = Population::new(&space.symbols);
        population.push(candidate);
        for i in space.free() {
            let [lower, upper] = space.bounds[i];
            for sign in [1.0, -1.0] {
                let mut moved = candidate.to_vec();
                moved[i] = (candidate[i] + sign * step * (upper - lower)).clamp(lower, upper);
                population.push(&moved);
            }
        }
        let runs = lanes.innovations(&Job { case, population: &population }, &vec![HELD; population.len()])?;
        let dt = lanes.cases()[case].dt;
        let first = runs.iter().map(|run| run.first).max().unwrap_or(0);
        let own = runs[0].residual.get(first..).filter(|errors| runs[0].failed.is_none() && errors.len() > runs.len());
        let Some(errors) = own else { return Ok(None) };
        let mut series = vec![errors.iter().map(|[_, r_v]| *r_v).collect::<Vec<f64>>()];
        for pair in runs[1..].chunks(2).filter(|pair| pair.iter().all(|run| run.failed.is_none())) {
            let sides = pair[0].residual[first..].iter().zip(&pair[1].residual[first..]);
            series.push(sides.map(|([_, above], [_, below])| above - below).collect());
        }
        // Two errors make a difference.
        let spacing = errors.iter().map(|[r_s, _]| r_s * r_s).sum::<f64>() / errors.len() as f64 / 2.0;
        Ok(Some(Noise { spacing: spacing.sqrt(), ..Noise::of_errors(&series, dt) }))
    }

    /// From the one-step errors of the speed, and their derivatives in each parameter.
    fn of_errors(series: &[Vec<f64>], dt: f64) -> Noise {
        // Sample by sample.
        let rows: Vec<f64> = (0..series[0].len()).flat_map(|t| series.iter().map(move |z| z[t])).collect();
        let best = |tried: Vec<[f64; 2]>| {
            let together = |some: &[[f64; 2]]| {
                let at = std::array::from_fn(|k| some[k.min(some.len() - 1)]);
                let found = Arch::new().dispatch(Restricted { rows: &rows, series: series.len(), at, dt });
                found.into_iter().zip(at).take(some.len()).collect::<Vec<_>>()
            };
            let found: Vec<_> = tried.par_chunks(TOGETHER).map(together).collect();
            found
                .into_iter()
                .flatten()
                .max_by(|((one, _), _), ((another, _), _)| one.total_cmp(another))
                .expect("something is tried")
        };
        let ratios = std::iter::once(0.0).chain(geometric(RATIO));
        let rough = ratios.flat_map(|ratio| geometric(LASTS_S).map(move |lasts| [ratio, lasts]));
        let mut found = best(rough.collect());
        // Its covariance with either neighbour counts, too.
        let (mut of_ratio, mut of_time) = (RATIO[2], LASTS_S[2]);
        for _ in 0..2 {
            (of_ratio, of_time) = (of_ratio.powf(FINER), of_time.powf(FINER));
            let near = |middle: f64, factor: f64| (-3..=3).map(move |k| middle * factor.powi(k));
            let (_, [ratio, lasts]) = found;
            let around = near(ratio, of_ratio).flat_map(|ratio| near(lasts, of_time).map(move |lasts| [ratio, lasts]));
            found = best(around.collect());
        }
        let ((_, speed), [ratio, lasts]) = found;
        Noise { acceleration: ratio * speed / dt, lasts, spacing: 0.0, speed }
    }

    /// Mean square of the speed that the unknown acceleration adds until a driver has responded \[m²/s²\].
    pub fn power(&self) -> f64 {
        self.added(ANSWERED_S, 0)
    }

    /// Covariance of the speeds that the unknown acceleration adds in two stretches of this length, this many stretches apart \[m²/s²\].
    pub fn added(&self, length: f64, apart: usize) -> f64 {
        let (square, t) = (self.acceleration.powi(2), self.lasts);
        match apart {
            0 => square * integrated(length, t),
            n => {
                let within = t * (1.0 - (-length / t).exp());
                square * within.powi(2) * (-((n - 1) as f64) * length / t).exp()
            }
        }
    }
}

/// Mean square of the speed that an acceleration of variance 1 which lasts `lasts` adds in `time`.
fn integrated(time: f64, lasts: f64) -> f64 {
    2.0 * lasts * lasts * (time / lasts - 1.0 + (-time / lasts).exp())
}

/// Number of noises that are tried in parallel: numbers of the widest vector.
const TOGETHER: usize = 8;
/// Number of samples whose variances are multiplied before taking the logarithm. A variance lies between 1 and the square of the largest of
/// [`RATIO`], so that the product stays far below the largest number.
const MULTIPLIED: usize = 32;

/// Restricted log-likelihoods (up to a constant) of the first of several series, which may contain any multiples of the others, and the
/// standard deviations of the measurement error at which they are highest; one for each noise that is tried. The model: z_t = m_t + u_t -
/// u_{t-1}, with u independent between samples, and m of standard deviation `ratio` (that of u is 1), of which exp(-dt / lasts) remains
/// from one sample to the next. A Kalman filter decorrelates them.
struct Restricted<'a> {
    /// The series, sample by sample.
    rows: &'a [f64],
    series: usize,
    /// Ratio and time constant \[s\] of each noise.
    at: [[f64; 2]; TOGETHER],
    dt: f64,
}

/// One number of each noise.
type Each = [f64; TOGETHER];

#[inline(always)]
fn each(of: impl Fn(usize) -> f64) -> Each {
    let mut all = [0.0; TOGETHER];
    for (w, one) in all.iter_mut().enumerate() {
        *one = of(w);
    }
    all
}

impl NullaryFnOnce for Restricted<'_> {
    type Output = [(f64, f64); TOGETHER];

    // Loops over noises use the vectors of this processor, operation for operation, so that every processor gives the same
    // bits.
    #[inline(always)]
    fn call(self) -> Self::Output {
        let Restricted { rows, series: n, at, dt } = self;
        let samples = rows.len() / n;
        let ratio2 = each(|w| at[w][0] * at[w][0]);
        let keep = each(|w| (-dt / at[w][1]).exp());
        let keep2 = each(|w| keep[w] * keep[w]);
        let renewed = each(|w| ratio2[w] * (1.0 - keep2[w]));
        // Means of m and u of each series, and their covariance, which all share.
        let (mut mean_m, mut mean_u, mut whitened) =
            (vec![[0.0; TOGETHER]; n], vec![[0.0; TOGETHER]; n], vec![[0.0; TOGETHER]; n]);
        let (mut mm, mut mu, mut uu) = (ratio2, [0.0; TOGETHER], [1.0; TOGETHER]);
        let mut products = vec![[0.0; TOGETHER]; n * (n + 1) / 2];
        let (mut logarithms, mut multiplied) = ([0.0; TOGETHER], [1.0; TOGETHER]);
        for (t, row) in rows.chunks_exact(n).enumerate() {
            let variance = each(|w| mm[w] - 2.0 * mu[w] + uu[w] + 1.0);
            let with_m = each(|w| mm[w] - mu[w]);
            let of_u = each(|w| 1.0 / variance[w]);
            let of_m = each(|w| with_m[w] * of_u[w]);
            let of_white = each(|w| of_u[w].sqrt());
            multiplied = each(|w| multiplied[w] * variance[w]);
            mm = each(|w| keep2[w] * (mm[w] - with_m[w] * of_m[w]) + renewed[w]);
            mu = each(|w| -keep[w] * of_m[w]);
            uu = each(|w| 1.0 - of_u[w]);
            if (t + 1).is_multiple_of(MULTIPLIED) || t + 1 == samples {
                logarithms = each(|w| logarithms[w] + multiplied[w].ln());
                multiplied = [1.0; TOGETHER];
            }
            for (k, z) in row.iter().enumerate() {
                let (m, u) = (mean_m[k], mean_u[k]);
                let innovation = each(|w| z - (m[w] - u[w]));
                mean_m[k] = each(|w| keep[w] * (m[w] + of_m[w] * innovation[w]));
                mean_u[k] = each(|w| of_u[w] * innovation[w]);
                whitened[k] = each(|w| of_white[w] * innovation[w]);
            }
            let mut own = products.iter_mut();
            for a in 0..n {
                let one = whitened[a];
                for (another, sums) in whitened[..=a].iter().zip(&mut own) {
                    let (another, before) = (*another, *sums);
                    *sums = each(|w| before[w] + one[w] * another[w]);
                }
            }
        }
        std::array::from_fn(|w| {
            let products = products.iter().map(|sums| sums[w]).collect();
            likelihood(products, n, samples, logarithms[w])
        })
    }
}

/// The likelihood from the products of whitened series, the lower triangle row by row, and the sum of the logarithms of the variances.
fn likelihood(mut products: Vec<f64>, n: usize, samples: usize, logarithms: f64) -> (f64, f64) {
    let at = |a: usize, b: usize| a.max(b) * (a.max(b) + 1) / 2 + a.min(b);
    // The parts that the others explain are removed, one after the other.
    let whole: Vec<f64> = (0..n).map(|a| products[at(a, a)]).collect();
    let (mut taken, mut determinant) = (0, 0.0);
    for (pivot, whole) in whole.iter().enumerate().skip(1) {
        let own = products[at(pivot, pivot)];
        if own <= OWN * whole {
            continue;
        }
        determinant += own.ln();
        taken += 1;
        let column: Vec<f64> = (0..n).map(|a| products[at(a, pivot)]).collect();
        for a in (0..n).filter(|a| *a == 0 || *a > pivot) {
            for b in (0..=a).filter(|b| *b == 0 || *b > pivot) {
                products[at(a, b)] -= column[a] * column[b] / own;
            }
        }
    }
    let freedom = (samples - taken) as f64;
    let variance = (products[0] / freedom).max(f64::MIN_POSITIVE);
    (-0.5 * (logarithms + determinant + freedom * variance.ln()), variance.sqrt())
}

fn geometric([first, last, factor]: [f64; 3]) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(first), move |x| (*x < last).then(|| (x * factor).min(last)))
}

/// Change of the speed, and of the spacing, whose effect is followed \[m/s, m\]: so small that the effect is linear.
const KICK: f64 = 0.01;
/// The effect is followed until it falls to this share of the kick, for this long \[s\]: by then a car has responded.
const GONE: f64 = 0.003;
const FOLLOWED_S: f64 = 120.0;

/// A simulated drive that can be kicked.
pub(super) struct Free<'a> {
    lanes: &'a Lanes,
    case: usize,
    parameters: Parameters,
    /// First simulated sample.
    pub first: usize,
    /// s, v and a from the first sample of the drive on.
    states: [Vec<f64>; 3],
}

/// Effect of a kick on s, v and a, per unit of the kick, from a sample on.
pub(super) struct Answer {
    pub from: usize,
    pub change: Vec<[f64; 3]>,
}

impl<'a> Free<'a> {
    /// `None` if the run fails.
    pub fn new(lanes: &'a Lanes, case: usize, parameters: Parameters) -> Result<Option<Free<'a>>, EvaluateError> {
        let Case { s, v_f, a_f, .. } = &lanes.cases()[case];
        let own = &lanes.cases()[case];
        let first = own.first_sample(own.delay(&parameters)).max(1);
        let mut states = [s, v_f, a_f].map(|signal| signal[..first].to_vec());
        let simulated = lanes.trace(case, &parameters, [s, v_f, a_f].map(|signal| &signal[..]), first, s.len())?;
        let whole = first + simulated.len() == s.len();
        for (k, states) in states.iter_mut().enumerate() {
            states.extend(simulated.iter().map(|state| state[k]));
        }
        Ok(whole.then_some(Free { lanes, case, parameters, first, states }))
    }

    /// Effect of kicks of the spacing (0) or the speed (1), each right before a sample.
    pub fn kicked(&self, kicks: &[(usize, usize)]) -> Result<Vec<Answer>, EvaluateError> {
        let case = &self.lanes.cases()[self.case];
        let followed = (FOLLOWED_S / case.dt) as usize;
        let from: Vec<usize> = kicks.iter().map(|(_, from)| *from).collect();
        let size = |(signal, _): &(usize, usize)| std::array::from_fn(|k| if k == *signal { KICK } else { 0.0 });
        let sizes: Vec<[f64; 3]> = kicks.iter().map(size).collect();
        let to = case.s.len().min(from.iter().max().unwrap_or(&0) + followed);
        let past = [0, 1, 2].map(|k| self.states[k].as_slice());
        let traces = self.lanes.kicked(self.case, &self.parameters, past, (&from, &sizes), to)?;
        let answer = |(from, states): (usize, Vec<[f64; 3]>)| {
            let change =
                |(t, state): (usize, &[f64; 3])| [0, 1, 2].map(|k| (state[k] - self.states[k][from + t]) / KICK);
            let mut change: Vec<[f64; 3]> = states.iter().take(followed).enumerate().map(change).collect();
            let last = change.iter().rposition(|change| change[0].abs().max(change[1].abs()) > GONE);
            change.truncate(last.map_or(0, |last| last + 1));
            Answer { from, change }
        };
        Ok(from.into_iter().zip(traces).map(answer).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::{normal, stream};
    use nalgebra::DMatrix;

    /// Noise of known size is recovered, even if parameters have removed a part of it.
    #[test]
    fn noise_is_estimated_from_one_step_errors() {
        let dt = 0.1;
        for (samples, within) in [(20_000, 0.1), (450, 0.3)] {
            for [acceleration, lasts, speed] in [[0.15, 1.5, 0.05], [0.3, 0.5, 0.02], [0.15, 1.5, 1e-6]] {
                let mut sizes: Vec<f64> = (0..if samples > 1000 { 1 } else { 40 })
                    .map(|seed| {
                        let mut rng = stream(seed, 0, 0, 0);
                        let (mut n, mut before) = (acceleration * normal(&mut rng), 0.0);
                        let keep = (-dt / lasts).exp();
                        let mut errors: Vec<f64> = (0..samples)
                            .map(|_| {
                                let error = speed * normal(&mut rng);
                                let step = n * dt + error - before;
                                n = keep * n + acceleration * (1.0 - keep * keep).sqrt() * normal(&mut rng);
                                before = error;
                                step
                            })
                            .collect();
                        // Five slow waves in place of parameters; least squares removes multiples of them.
                        let wave = |k: usize| {
                            move |t: usize| (t as f64 * (k + 1) as f64 * std::f64::consts::PI / samples as f64).cos()
                        };
                        let waves: Vec<Vec<f64>> = (0..5).map(|k| (0..samples).map(wave(k)).collect()).collect();
                        for wave in &waves {
                            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                            let share = dot(&errors, wave) / dot(wave, wave);
                            errors.iter_mut().zip(wave).for_each(|(e, w)| *e -= share * w);
                        }
                        let noise = Noise::of_errors(&[vec![errors], waves].concat(), dt);
                        assert!(speed < 1e-3 || (noise.speed / speed - 1.0).abs() < 0.3, "{noise:?}");
                        // Size of the noise: the speed that it adds in some seconds.
                        (noise.added(4.0, 0) / (acceleration.powi(2) * integrated(4.0, lasts))).sqrt()
                    })
                    .collect();
                sizes.sort_by(f64::total_cmp);
                let middle = sizes[sizes.len() / 2];
                assert!((middle - 1.0).abs() < within, "{middle} of {acceleration} {lasts} {speed}, {samples} samples");
            }
        }
    }

    /// Compared with the likelihood by the covariance of all samples, which needs no filter.
    #[test]
    fn likelihoods_are_those_of_the_whole_covariance() {
        let (samples, n, dt) = (50, 4, 0.1);
        let mut rng = stream(5, 0, 0, 0);
        let rows: Vec<f64> = (0..samples * n).map(|_| normal(&mut rng)).collect();
        let at =
            std::array::from_fn(|w| [[0.0, 0.01, 0.3, 1.0, 3.0, 50.0, 1000.0, 2.0][w], 0.05 * 1.9_f64.powi(w as i32)]);
        let found = Arch::new().dispatch(Restricted { rows: &rows, series: n, at, dt });
        for ([ratio, lasts], (likelihood, deviation)) in at.into_iter().zip(found) {
            let covariance = DMatrix::from_fn(samples, samples, |a, b| {
                let of_errors = [2.0, -1.0].get(a.abs_diff(b)).copied().unwrap_or(0.0);
                ratio * ratio * (-dt / lasts * a.abs_diff(b) as f64).exp() + of_errors
            });
            let z = DMatrix::from_row_slice(samples, n, &rows);
            let factor = covariance.cholesky().expect("a covariance");
            let white = factor.l().solve_lower_triangular(&z).expect("it is regular");
            let (y, x) = (white.column(0).into_owned(), white.columns(1, n - 1).into_owned());
            let normal = x.tr_mul(&x).cholesky().expect("independent");
            let left = y.norm_squared() - x.tr_mul(&y).dot(&normal.solve(&x.tr_mul(&y)));
            let freedom = (samples - n + 1) as f64;
            let expected = -0.5
                * (2.0 * factor.l().diagonal().map(f64::ln).sum()
                    + 2.0 * normal.l().diagonal().map(f64::ln).sum()
                    + freedom * (left / freedom).ln());
            assert!((likelihood / expected - 1.0).abs() < 1e-8, "{ratio} {lasts}: {likelihood} {expected}");
            assert!((deviation / (left / freedom).sqrt() - 1.0).abs() < 1e-8, "{ratio} {lasts}: {deviation}");
        }
    }

    /// Successive stretches add up to one.
    #[test]
    fn covariances_of_stretches_add_up() {
        let noise = Noise { acceleration: 0.2, lasts: 1.3, spacing: 0.0, speed: 0.0 };
        let sum = (0..3)
            .flat_map(|a: usize| (0..3).map(move |b| a.abs_diff(b)))
            .map(|apart| noise.added(0.7, apart))
            .sum::<f64>();
        assert!((sum / noise.added(2.1, 0) - 1.0).abs() < 1e-9, "{sum}");
    }
}
