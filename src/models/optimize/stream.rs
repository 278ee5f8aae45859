//! Random numbers: one independent stream per (seed, replicate, generation, candidate).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The generator of one candidate. Because every candidate has its own, results depend neither on the number of
/// threads nor on the order of work nor on where a run was resumed.
#[must_use]
pub fn stream(seed: u64, replicate: u64, generation: u64, candidate: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    for (bytes, number) in key.chunks_exact_mut(8).zip([seed, replicate, generation, candidate]) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
    ChaCha8Rng::from_seed(key)
}

/// Source of the random numbers of a run: a seed, a replicate, and the next generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Seed of all random numbers.
    pub seed: u64,
    pub replicate: u64,
    /// The generation; a run that follows another one continues its count, so that no stream is used twice.
    pub generation: u64,
}

/// Candidate number of the draws for a whole generation; candidates count from 0.
const WHOLE: u64 = u64::MAX;

impl Origin {
    /// The first generation of a replicate.
    #[must_use]
    pub fn new(seed: u64, replicate: u64) -> Origin {
        Origin { seed, replicate, generation: 0 }
    }

    /// The stream of a candidate of the generation.
    pub(super) fn candidate(&self, candidate: usize) -> ChaCha8Rng {
        stream(self.seed, self.replicate, self.generation, candidate as u64)
    }

    /// The stream of the draws for a whole generation.
    pub(super) fn whole(&self) -> ChaCha8Rng {
        stream(self.seed, self.replicate, self.generation, WHOLE)
    }
}

/// A normally distributed number of mean 0 and variance 1 (Box and Muller, 1958; the second one is not used).
#[must_use]
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // 1 - u: in (0, 1], so that the logarithm is finite.
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// A Cauchy distributed number of location 0 and scale 1.
pub(super) fn cauchy(rng: &mut ChaCha8Rng) -> f64 {
    (std::f64::consts::PI * (rng.random::<f64>() - 0.5)).tan()
}
