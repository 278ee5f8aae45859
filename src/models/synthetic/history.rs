//! The motion of the cars so far, looked up between the fine steps.

/// Position, speed and acceleration of one car at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    /// Front bumper along the road \[m\].
    pub(super) x: f64,
    /// Speed \[m/s\].
    pub(super) v: f64,
    /// Acceleration \[m/s²\].
    pub(super) a: f64,
}

/// Motion of one car at 0, h, 2h, ...
#[derive(Debug)]
pub(super) struct History {
    h: f64,
    motions: Vec<Motion>,
}

impl History {
    pub(super) fn new(h: f64, capacity: usize) -> History {
        History { h, motions: Vec::with_capacity(capacity) }
    }

    /// The motion of a recorded speed, every `dt` \[s\]: a smooth curve through its values, from position 0; its last value continues.
    pub(super) fn recorded(dt: f64, v: &[f64], h: f64, steps: usize) -> History {
        let value = |i: isize| v[i.clamp(0, v.len() as isize - 1) as usize];
        let slope = |i: isize| (value(i + 1) - value(i - 1)) / (2.0 * dt);
        let speed = |t: f64| {
            let place = t / dt;
            let i = place.floor() as isize;
            let u = place - i as f64;
            hermite(u, dt, (value(i), slope(i)), (value(i + 1), slope(i + 1))).max(0.0)
        };
        let mut history = History::new(h, steps + 1);
        let mut x = 0.0;
        for step in 0..=steps {
            let t = step as f64 * h;
            let a = (speed(t + 0.5 * h) - speed((t - 0.5 * h).max(0.0))) / if step == 0 { 0.5 * h } else { h };
            history.push(Motion { x, v: speed(t), a });
            // Simpson's rule, exact for a cubic.
            x += h / 6.0 * (speed(t) + 4.0 * speed(t + 0.5 * h) + speed(t + h));
        }
        history
    }

    pub(super) fn push(&mut self, motion: Motion) {
        self.motions.push(motion);
    }

    pub(super) fn get(&self, step: usize) -> Motion {
        self.motions[step]
    }

    /// Position and speed at a time up to the last step, by cubic Hermite polynomials (error of fourth order, like
    /// the integration); before time 0 every car stands at its start.
    pub(super) fn at(&self, t: f64) -> (f64, f64) {
        let last = self.motions.len() - 1;
        let place = (t / self.h).clamp(0.0, last as f64);
        let before = (place.floor() as usize).min(last.saturating_sub(1));
        let (from, to) = (self.motions[before], self.motions[(before + 1).min(last)]);
        let u = place - before as f64;
        let x = hermite(u, self.h, (from.x, from.v), (to.x, to.v));
        let v = hermite(u, self.h, (from.v, from.a), (to.v, to.a));
        (x, v.max(0.0))
    }
}

/// Value at the fraction `u` of a step `h`, from value and derivative at both ends.
fn hermite(u: f64, h: f64, from: (f64, f64), to: (f64, f64)) -> f64 {
    let w = 1.0 - u;
    w * w * ((1.0 + 2.0 * u) * from.0 + u * h * from.1) + u * u * ((1.0 + 2.0 * w) * to.0 - w * h * to.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_met_exactly() {
        let x = |t: f64| 1.0 + 2.0 * t + 0.5 * t * t + 0.25 * t * t * t;
        let v = |t: f64| 2.0 + t + 0.75 * t * t;
        let mut history = History::new(0.5, 4);
        for t in [0.0, 0.5, 1.0, 1.5] {
            history.push(Motion { x: x(t), v: v(t), a: 1.0 + 1.5 * t });
        }
        for t in [0.0, 0.1, 0.5, 0.77, 1.5] {
            let (found_x, found_v) = history.at(t);
            assert!((found_x - x(t)).abs() < 1e-12 && (found_v - v(t)).abs() < 1e-12);
        }
        assert!((history.at(-3.0).0 - 1.0).abs() < 1e-12);
    }
}
