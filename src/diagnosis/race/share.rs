//! The share of the drivers of a fleet that have the named causes.

use super::fit::Field;
use super::loss::SIGNALS;
use super::{Answer, HORIZONS, Horizon, OF_A_NAME, Policy};
use crate::diagnose::DiagnoseError;
use crate::optimize::stream;
use crate::statistics::order_statistic;
use rand::RngExt;

/// Sizes of the causes that are tried, as multiples of the common one: where few drivers have them, the common size is much too small.
const SIZES: [f64; 8] = [0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0];
/// Number of resamples of the drivers for an interval.
const RESAMPLES: usize = 999;
/// Halvings of the range of a share, to far below its error.
const HALVINGS: usize = 20;

/// The share of drivers with the named causes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The share, and its 95 % interval.
    pub share: f64,
    /// See `share`.
    pub interval: [f64; 2],
    /// Size of the causes of these drivers, as a multiple of the common one.
    pub size: f64,
}

/// For a driver: log-likelihoods with the causes at each size, over that without them.
type Ratios = [f64; SIZES.len()];

impl Answer {
    /// The share of drivers with the named causes, as a mixture of drivers without them and drivers with one size; `None` without a name, or
    /// without a fleet.
    ///
    /// # Errors
    /// As [`Field::model`].
    pub fn share(&self, seed: u64) -> Result<Option<Share>, DiagnoseError> {
        let Some(named) = &self.named else { return Ok(None) };
        let entry = &self.entries[named.entry];
        let Some(judged) = entry.fits[OF_A_NAME].as_ref().and_then(|fit| fit.judged.as_ref()) else {
            return Ok(None);
        };
        let positions: Vec<usize> = named.causes.iter().flat_map(|cause| entry.model.positions(cause)).collect();
        let model = self.field.model(entry.model.variant)?;
        let mut ratios: Vec<Ratios> = Vec::new();
        for (fold, common) in judged.folds.iter().enumerate() {
            let left_out: Vec<bool> = self.field.parts.folds.iter().map(|own| *own == fold).collect();
            let surface = self.field.surface(&model, &left_out, Horizon::ALL[OF_A_NAME]);
            let at = |size: f64| {
                let mut place = surface.place(common);
                for &k in &positions {
                    let neutral = entry.model.axes[k].coordinate(entry.neutral(k));
                    place[k] = (neutral + size * (place[k] - neutral)).clamp(0.0, 1.0);
                }
                let drivers = self.field.with_own_settings(&surface, &surface.values(&place))?;
                Ok(drivers
                    .iter()
                    .map(|driver| -0.5 * driver.cost * (SIGNALS * self.bins(driver.unit)) as f64)
                    .collect())
            };
            let without: Vec<f64> = at(0.0)?;
            let with: Vec<Vec<f64>> = SIZES.into_iter().map(at).collect::<Result<_, DiagnoseError>>()?;
            let ratio = |driver: usize| std::array::from_fn(|k| with[k][driver] - without[driver]);
            ratios.extend((0..without.len()).map(ratio).filter(|ratios: &Ratios| ratios.iter().all(|x| x.is_finite())));
        }
        if ratios.is_empty() {
            return Ok(None);
        }
        let all: Vec<&Ratios> = ratios.iter().collect();
        let (share, size) = mixture(&all);
        let mut rng = stream(seed, 0, HORIZONS as u64, 0);
        let mut shares = Vec::new();
        for _ in 0..RESAMPLES {
            let draw = |_| &ratios[((rng.random::<f64>() * ratios.len() as f64) as usize).min(ratios.len() - 1)];
            shares.push(mixture(&(0..ratios.len()).map(draw).collect::<Vec<_>>()).0);
        }
        let tail = 0.5 * (1.0 - Policy::FLEET.interval);
        let at = |share| order_statistic(shares.iter().copied(), share).unwrap_or(f64::NAN);
        Ok(Some(Share { share, interval: [at(tail), at(1.0 - tail)], size: SIZES[size] }))
    }

    /// Number of bins of a driver.
    fn bins(&self, unit: usize) -> usize {
        let Field { parts, sizes, .. } = &self.field;
        parts.units.iter().zip(sizes).filter(|(own, _)| **own == unit).map(|(_, sizes)| sizes.count()).sum()
    }
}

/// The share and the position of the size with the largest likelihood.
fn mixture(drivers: &[&Ratios]) -> (f64, usize) {
    let one = |size: usize| {
        let share = share_at(drivers, size);
        let likelihood: f64 = drivers.iter().map(|driver| (1.0 - share + share * driver[size].exp()).ln()).sum();
        (likelihood, share, size)
    };
    let best = (0..SIZES.len()).map(one).max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are sizes");
    (best.1, best.2)
}

/// The share with the largest likelihood, which is concave in the share.
fn share_at(drivers: &[&Ratios], size: usize) -> f64 {
    let slope = |share: f64| -> f64 {
        let one = |driver: &&Ratios| {
            let ratio = driver[size].exp();
            if ratio.is_infinite() { 1.0 / share } else { (ratio - 1.0) / (1.0 - share + share * ratio) }
        };
        drivers.iter().map(one).sum()
    };
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if slope(middle) > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drivers with a cause of twice the common size, seen with noise, and drivers without it.
    #[test]
    fn a_mixture_gives_its_share_and_size() {
        let driver = |k: usize| {
            let own = if k % 10 < 3 { 2.0 } else { 0.0 };
            let noise = 0.6 * (7.3 * k as f64).sin();
            std::array::from_fn(|i| 2.0 * ((own + noise).powi(2) - (own + noise - SIZES[i]).powi(2)))
        };
        let all: Vec<Ratios> = (0..400).map(driver).collect();
        let (share, size) = mixture(&all.iter().collect::<Vec<_>>());
        assert!((share - 0.3).abs() < 0.04 && SIZES[size] == 2.0, "{share} {}", SIZES[size]);
        let none: Vec<Ratios> =
            all.iter().enumerate().filter(|(k, _)| k % 10 >= 3).map(|(_, driver)| *driver).collect();
        assert!(mixture(&none.iter().collect::<Vec<_>>()).0 < 0.06);
    }
}
