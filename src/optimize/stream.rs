//! Random numbers: one independent stream per (seed, replicate, generation, candidate).

use rand::SeedableRng;
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
