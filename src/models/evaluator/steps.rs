//! A drive in longer steps, for a search.

use super::case::{Case, differences};
use std::sync::Arc;

impl Case {
    /// The same drive by every second, third, ... sample: in steps of at most this many seconds, but with at least this many samples.
    #[must_use]
    pub fn in_steps(&self, longest_s: f64, samples: usize) -> Case {
        // 1e-9: 0.3 s / 0.1 s must be 3 samples and not 2, whatever the last bit of the quotient.
        let every = ((longest_s / self.dt + 1e-9) as usize).min(self.s.len() / samples).max(1);
        let own = |signal: &Arc<[f64]>| -> Arc<[f64]> { signal.iter().step_by(every).copied().collect() };
        let (v_f, dt) = (own(&self.v_f), self.dt * every as f64);
        let case = Case {
            dt,
            x_l: own(&self.x_l),
            v_l: own(&self.v_l),
            x_f: own(&self.x_f),
            a_f: differences(&v_f, dt, self.convention.acceleration).into(),
            v_f,
            s: own(&self.s),
            a_l: self.a_l.as_ref().map(own),
            v_l2: self.v_l2.as_ref().map(own),
            s_l2: self.s_l2.as_ref().map(own),
            earliest: self.earliest.div_ceil(every),
            ..self.clone()
        };
        // A drive that is too short in these steps is simulated whole.
        case.for_variant(self.variant).unwrap_or_else(|_| self.clone())
    }
}
