//! Classical Runge-Kutta for one car behind others whose motion is known already.

use super::error::SyntheticError;
use super::history::{History, Motion};

/// Places of position \[m\] and speed \[m/s\] in the state of every car; the rest is its own.
pub(super) const X: usize = 0;
pub(super) const V: usize = 1;

/// A car with N state variables.
pub(super) trait Car<const N: usize> {
    /// Before a step from time t \[s\]: refuses to continue, or stores values that stay constant during the step.
    fn begin(&mut self, t: f64, state: &[f64; N], own: &History) -> Result<(), SyntheticError>;

    /// Derivatives at a time within the step.
    fn rate(&self, t: f64, state: &[f64; N], own: &History) -> [f64; N];
}

/// Drives `steps` steps of length `h` \[s\].
pub(super) fn drive<const N: usize>(
    car: &mut impl Car<N>,
    start: [f64; N],
    h: f64,
    steps: usize,
) -> Result<History, SyntheticError> {
    let mut state = start;
    let mut own = History::new(h, steps + 1);
    for step in 0..=steps {
        let t = step as f64 * h;
        car.begin(t, &state, &own)?;
        let mut k_1 = car.rate(t, &state, &own);
        // Brakes hold a standing car: it does not roll back. Decided once a step, for all its stages.
        let stands = state[V] <= 0.0 && k_1[V] < 0.0;
        let hold = |rate: &mut [f64; N]| {
            if stands {
                rate[V] = 0.0;
            }
        };
        hold(&mut k_1);
        own.push(Motion { x: state[X], v: state[V], a: k_1[V] });
        let stage = |rate: &[f64; N], fraction: f64| {
            let mut rate = car.rate(t + fraction * h, &plus(&state, rate, fraction * h), &own);
            hold(&mut rate);
            rate
        };
        let k_2 = stage(&k_1, 0.5);
        let k_3 = stage(&k_2, 0.5);
        let k_4 = stage(&k_3, 1.0);
        for (rate, share) in [(k_1, 6.0), (k_2, 3.0), (k_3, 3.0), (k_4, 6.0)] {
            state = plus(&state, &rate, h / share);
        }
        // A car that comes to rest within the step stands at its end.
        state[V] = state[V].max(0.0);
    }
    Ok(own)
}

fn plus<const N: usize>(state: &[f64; N], rate: &[f64; N], h: f64) -> [f64; N] {
    std::array::from_fn(|i| state[i] + h * rate[i])
}

/// Eq. 10: tractive acceleration and its rate; without lag the command acts at once.
pub(super) fn lagged(a_t: f64, command: f64, tau_a: f64) -> (f64, f64) {
    if tau_a > 0.0 { (a_t, (command - a_t) / tau_a) } else { (command, 0.0) }
}
