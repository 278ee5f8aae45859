//! Random numbers of synthetic drives: one seed, one independent stream per purpose.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Standard deviations of the sensors' white noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Of every speed \[m/s\].
    pub speed_mps: f64,
    /// Of every gap \[m\].
    pub gap_m: f64,
}

impl Noise {
    /// Perfect sensors.
    pub const NONE: Noise = Noise { speed_mps: 0.0, gap_m: 0.0 };
}

/// As measured on the AstaZero drives (residual against an 11-point cubic fit): 0.0014 to 0.0039 m/s and
/// 0.0003 to 0.0009 m.
impl Default for Noise {
    fn default() -> Self {
        Noise { speed_mps: 0.003, gap_m: 0.0005 }
    }
}

/// Purpose of a stream; a stream's numbers do not change when another purpose draws more.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    Road,
    SetSpeed,
    SpeedOfCar(usize),
    GapOfLink(usize),
    GustsOfCar(usize),
    ParametersOfCar(usize),
}

/// Random numbers for one purpose.
pub(super) struct Stream(ChaCha8Rng);

impl Stream {
    pub(super) fn new(seed: u64, purpose: Purpose) -> Stream {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(match purpose {
            Purpose::Road => 0,
            Purpose::SetSpeed => 1,
            Purpose::SpeedOfCar(car) => 2 + 2 * car as u64,
            Purpose::GapOfLink(link) => 3 + 2 * link as u64,
            Purpose::GustsOfCar(car) => (1 << 32) + 2 * car as u64,
            Purpose::ParametersOfCar(car) => (1 << 32) + 2 * car as u64 + 1,
        });
        Stream(generator)
    }

    /// Uniform in [0, 1), with 53 random bits.
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two bounds.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Standard normal (Box and Muller).
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}
