//! Drivers with a cause, and drivers without it.

use super::HORIZONS;
use crate::optimize::stream;
use crate::statistics::order_statistic;
use rand::RngExt;

/// Sizes of the causes that are tried, as multiples of the common one: of an effect in a third of the drivers, a common law has an eighth.
pub const SIZES: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Number of resamples of the drivers for the interval of their share.
const RESAMPLES: usize = 999;
/// Halvings of the range of a share, to far below its error.
const HALVINGS: usize = 20;

/// For a driver: log-likelihoods with the causes at each size, over that without them.
pub type Ratios = [f64; SIZES.len()];

/// A driver who is left out.
#[derive(Debug, Clone)]
pub struct DriverFit {
    /// The driver.
    pub unit: usize,
    /// The fold that leaves the driver out.
    pub fold: usize,
    /// The loss, with the penalty for the distance from the common parameters.
    pub cost: f64,
    /// Log-likelihoods with the added causes over that of the reference; `None` for a model without a reference.
    pub ratios: Option<Ratios>,
}

/// Drivers without a cause, and drivers with one size of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// Share of the drivers with the cause.
    pub share: f64,
    /// Position of their size in [`SIZES`].
    size: usize,
    /// Log-likelihood of all drivers over that without the cause.
    likelihood: f64,
}

impl Mixture {
    /// The mixture with the largest likelihood.
    #[must_use]
    pub fn of(drivers: &[&Ratios]) -> Mixture {
        let one = |size: usize| {
            let share = share_at(drivers, size);
            let mixture = Mixture { share, size, likelihood: 0.0 };
            Mixture { likelihood: drivers.iter().map(|driver| mixture.log_likelihood(driver)).sum(), ..mixture }
        };
        (0..SIZES.len()).map(one).max_by(|a, b| a.likelihood.total_cmp(&b.likelihood)).expect("there are sizes")
    }

    /// The interval of the share with this probability, from resampled drivers.
    #[must_use]
    pub fn interval(drivers: &[&Ratios], seed: u64, probability: f64) -> [f64; 2] {
        let mut rng = stream(seed, 0, HORIZONS as u64, 0);
        let mut draw = |_| drivers[((rng.random::<f64>() * drivers.len() as f64) as usize).min(drivers.len() - 1)];
        let mut resample = || Mixture::of(&(0..drivers.len()).map(&mut draw).collect::<Vec<_>>()).share;
        let shares: Vec<f64> = (0..RESAMPLES).map(|_| resample()).collect();
        let tail = 0.5 * (1.0 - probability);
        [tail, 1.0 - tail].map(|share| order_statistic(shares.iter().copied(), share).unwrap_or(f64::NAN))
    }

    /// Size of the cause of these drivers, as a multiple of the common one.
    #[must_use]
    pub fn size(&self) -> f64 {
        SIZES[self.size]
    }

    /// Log-likelihood of a driver over that without the cause.
    #[must_use]
    pub fn log_likelihood(&self, driver: &Ratios) -> f64 {
        if self.share == 0.0 {
            return 0.0;
        }
        let ratio = driver[self.size];
        // Whichever term is larger comes out of the logarithm, so that none overflows.
        let largest = ratio.max(0.0);
        largest + ((1.0 - self.share) * (-largest).exp() + self.share * (ratio - largest).exp()).ln()
    }
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
    let share = 0.5 * (low + high);
    // Fewer than half a driver are none: gains near zero would have errors near zero, and any number of standard errors.
    if share * drivers.len() as f64 > 0.5 { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drivers with a cause of twice the common size, seen with noise, and drivers without it.
    #[test]
    fn a_mixture_gives_its_share_and_size() {
        let drivers = |times: f64| -> Vec<Ratios> {
            let driver = |k: usize| {
                let own = if k % 10 < 3 { times } else { 0.0 };
                let noise = 0.6 * (7.3 * k as f64).sin();
                std::array::from_fn(|i| 2.0 * ((own + noise).powi(2) - (own + noise - SIZES[i]).powi(2)))
            };
            (0..400).map(driver).collect()
        };
        // A common law has a small part of an effect that few drivers have.
        for times in [2.0, 8.0] {
            let all = drivers(times);
            let all: Vec<&Ratios> = all.iter().collect();
            let Mixture { share, size, .. } = Mixture::of(&all);
            assert!((share - 0.3).abs() < 0.04 && SIZES[size] == times, "{share} {}", SIZES[size]);
            let [low, high] = Mixture::interval(&all, 1, 0.95);
            assert!(0.2 < low && low < 0.3 && 0.3 < high && high < 0.4, "{low} to {high}");
        }
        let all = drivers(2.0);
        let none: Vec<Ratios> =
            all.iter().enumerate().filter(|(k, _)| k % 10 >= 3).map(|(_, driver)| *driver).collect();
        assert!(Mixture::of(&none.iter().collect::<Vec<_>>()).share < 0.06);
        // Drivers whom no size follows better.
        let worse = [[-1.0; SIZES.len()]; 20];
        let mixture = Mixture::of(&worse.iter().collect::<Vec<_>>());
        assert_eq!((mixture.share, mixture.log_likelihood(&worse[0])), (0.0, 0.0));
    }
}
