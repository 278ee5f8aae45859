//! What disturbed a measured drive, and what a disturbance does to a simulation of it.
//!
//! Residuals of a free simulation are no measure of the noise: the fit has taken out what the parameters can follow, and of a short drive
//! that is most of it. One step from the measured state to the next tells the noise from all samples. It has two parts: errors of the
//! measurement, new at each sample, and an acceleration that the model does not know and that lasts (Ornstein-Uhlenbeck). Their sizes are
//! those of the highest restricted likelihood (H. D. Patterson and R. Thompson, Biometrika 58, 1971): it allows for what the parameters take out.

use crate::calibrate::SearchSpace;
use crate::evaluator::{Case, EvaluateError, Evaluator, Job, Observer, Population};
use crate::lanes::Lanes;
use crate::symbols::Parameters;
use rayon::prelude::*;

/// An observer that puts the state on the measurement after each step.
const HELD: Observer = Observer { gain: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0], ..Observer::NONE };

/// How long an unknown acceleration may last \[s\]: first, last and factor of what is tried. What lasts longer is answered by the driver.
const LASTS_S: [f64; 3] = [0.05, 8.0, 1.6];
/// Speed that it adds in a sample as a multiple of the error of a measured speed: first, last and factor of what is tried, besides none.
const RATIO: [f64; 3] = [0.003, 1000.0, 2.0];
/// Once the best is known, so fine a part of a step.
const FINER: f64 = 0.25;
/// A parameter is not taken out if so small a share of what it does is its own: what it does is what others do, too.
const OWN: f64 = 1e-10;

/// In so many seconds a driver has answered a disturbance: how much speed the unknown acceleration adds in them is the size of the noise.
const ANSWERED_S: f64 = 4.0;

/// Noise of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Standard deviation of the unknown acceleration \[m/s²\], and how long it lasts \[s\].
    pub acceleration: f64,
    pub lasts: f64,
    /// Standard deviations of the measured spacing \[m\] and speed \[m/s\].
    pub spacing: f64,
    pub speed: f64,
}

impl Noise {
    /// By the one-step errors of a candidate; `None` if it cannot be simulated. `steps`: shares of the range by which each parameter is moved.
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
        Ok(Some(Noise { spacing: spacing.sqrt(), ..Noise::told_by(&series, dt) }))
    }

    /// By the errors of the speed in one step, and what each parameter changes of them.
    fn told_by(series: &[Vec<f64>], dt: f64) -> Noise {
        let best = |tried: Vec<[f64; 2]>| {
            let told = tried.into_par_iter().map(|at| (restricted(series, at[0], (-dt / at[1]).exp()), at));
            let told: Vec<_> = told.collect();
            told.into_iter()
                .max_by(|((one, _), _), ((another, _), _)| one.total_cmp(another))
                .expect("something is tried")
        };
        let ratios = std::iter::once(0.0).chain(geometric(RATIO));
        let rough = ratios.flat_map(|ratio| geometric(LASTS_S).map(move |lasts| [ratio, lasts]));
        let mut found = best(rough.collect());
        // And between its neighbours, twice.
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

    /// Mean square of the speed that the unknown acceleration adds until a driver has answered \[m²/s²\].
    pub fn power(&self) -> f64 {
        self.added(ANSWERED_S, 0)
    }

    /// Covariance of the speeds that the unknown acceleration adds in two stretches of this length, so many stretches apart \[m²/s²\].
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

/// Restricted log-likelihood (but for a constant) of the first of some series, in which any multiples of the others may be, and the standard
/// deviation of an error of the measurement at which it is highest. The model: z_t = m_t + u_t - u_{t-1}, u new at each sample, and m of
/// standard deviation `ratio` (that of u is 1), of which `keep` stays from a sample to the next. A Kalman filter makes both independent.
fn restricted(series: &[Vec<f64>], ratio: f64, keep: f64) -> (f64, f64) {
    let (n, samples) = (series.len(), series[0].len());
    // Means of m and u of each series, and their covariance, which all share.
    let (mut mean, mut whitened) = (vec![[0.0; 2]; n], vec![0.0; n]);
    let (mut mm, mut mu, mut uu) = (ratio * ratio, 0.0, 1.0);
    let (mut products, mut logarithms) = (vec![0.0; n * n], 0.0);
    for t in 0..samples {
        let variance = mm - 2.0 * mu + uu + 1.0;
        let with_m = mm - mu;
        let root = variance.sqrt();
        logarithms += variance.ln();
        for (k, z) in series.iter().enumerate() {
            let innovation = z[t] - (mean[k][0] - mean[k][1]);
            mean[k] = [keep * (mean[k][0] + with_m / variance * innovation), innovation / variance];
            whitened[k] = innovation / root;
        }
        for a in 0..n {
            (0..=a).for_each(|b| products[a * n + b] += whitened[a] * whitened[b]);
        }
        let left = mm - with_m * with_m / variance;
        mm = keep * keep * left + ratio * ratio * (1.0 - keep * keep);
        mu = keep * (-with_m / variance);
        uu = 1.0 - 1.0 / variance;
    }
    // What the others explain is taken out, one after the other.
    let at = |products: &[f64], a: usize, b: usize| products[a.max(b) * n + a.min(b)];
    let whole: Vec<f64> = (0..n).map(|a| at(&products, a, a)).collect();
    let (mut taken, mut determinant) = (0, 0.0);
    for (pivot, whole) in whole.iter().enumerate().skip(1) {
        let own = at(&products, pivot, pivot);
        if own <= OWN * whole {
            continue;
        }
        determinant += own.ln();
        taken += 1;
        let column: Vec<f64> = (0..n).map(|a| at(&products, a, pivot)).collect();
        for a in (0..n).filter(|a| *a == 0 || *a > pivot) {
            for b in (0..=a).filter(|b| *b == 0 || *b > pivot) {
                products[a * n + b] -= column[a] * column[b] / own;
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

/// Change of the speed, and of the spacing, whose effect is followed \[m/s, m\]: so small that the effect is in proportion.
const KICK: f64 = 0.01;
/// The effect is followed until it is this share of the kick, and so long \[s\]: by then a car has answered.
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

/// What a kick does to s, v and a, per unit of the kick, from a sample on.
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

    /// What a kick of the spacing (0) or the speed (1) right before a sample does.
    pub fn kicked(&self, signal: usize, from: usize) -> Result<Answer, EvaluateError> {
        let case = &self.lanes.cases()[self.case];
        let to = case.s.len().min(from + (FOLLOWED_S / case.dt) as usize);
        let mut past = [0, 1, 2].map(|k| self.states[k][..from].to_vec());
        past[signal][from - 1] += KICK;
        let history = [0, 1, 2].map(|k| past[k].as_slice());
        let states = self.lanes.trace(self.case, &self.parameters, history, from, to)?;
        let change = |(t, state): (usize, &[f64; 3])| [0, 1, 2].map(|k| (state[k] - self.states[k][from + t]) / KICK);
        let mut change: Vec<[f64; 3]> = states.iter().enumerate().map(change).collect();
        let last = change.iter().rposition(|change| change[0].abs().max(change[1].abs()) > GONE);
        change.truncate(last.map_or(0, |last| last + 1));
        Ok(Answer { from, change })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::{normal, stream};

    /// Noise of known size comes back, also where parameters have taken out a part of it.
    #[test]
    fn noise_is_told_by_one_step_errors() {
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
                        // Five slow waves, as parameters have them, with the multiples that least squares takes out.
                        let wave = |k: usize| {
                            move |t: usize| (t as f64 * (k + 1) as f64 * std::f64::consts::PI / samples as f64).cos()
                        };
                        let waves: Vec<Vec<f64>> = (0..5).map(|k| (0..samples).map(wave(k)).collect()).collect();
                        for wave in &waves {
                            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                            let share = dot(&errors, wave) / dot(wave, wave);
                            errors.iter_mut().zip(wave).for_each(|(e, w)| *e -= share * w);
                        }
                        let noise = Noise::told_by(&[vec![errors], waves].concat(), dt);
                        assert!(speed < 1e-3 || (noise.speed / speed - 1.0).abs() < 0.3, "{noise:?}");
                        // What counts: how much speed it adds in some seconds.
                        (noise.added(4.0, 0) / (acceleration.powi(2) * integrated(4.0, lasts))).sqrt()
                    })
                    .collect();
                sizes.sort_by(f64::total_cmp);
                let middle = sizes[sizes.len() / 2];
                assert!((middle - 1.0).abs() < within, "{middle} of {acceleration} {lasts} {speed}, {samples} samples");
            }
        }
    }

    /// Stretches that follow each other add up to one.
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
