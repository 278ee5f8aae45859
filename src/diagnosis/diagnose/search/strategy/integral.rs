//! A gain on an integral: with a value that is off by half, the model oscillates with another period than the measured car.

use super::{Scope, Search, Stop, Task, Values};

/// Gains, from slow to fast.
const GAINS: [f64; 11] = [-0.002, 3e-5, 1.5e-4, 5e-4, 0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035];

/// See [`Search`].
pub struct Integral;

impl Search for Integral {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let model = task.model(None)?;
        let gain = task.only(&model);
        let gains: Vec<Values> = GAINS.iter().map(|size| vec![(gain, *size)]).collect();
        Ok(vec![task.scope(model, &gains, Vec::new())])
    }
}
