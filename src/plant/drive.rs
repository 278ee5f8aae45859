//! The platoon in continuous time: classical Runge-Kutta on all cars at once, delayed signals from the history.

use super::car::{CarTruth, GRAVITY, Lead};
use super::controller::Seen;
use super::error::PlantError;
use super::history::{History, Motion};
use super::road::Hills;
use super::set_speed::SetSpeed;

/// Brake of the platoon leader at set speed 0 \[m/s²\]: it stops for good, also downhill.
const HOLD: f64 = -0.6;
/// Set speed at which that brake is released \[m/s\]; a gradual release keeps the equations smooth.
const RELEASED: f64 = 0.5;

/// State of one car.
#[derive(Debug, Clone, Copy)]
struct State {
    /// Front bumper along the road \[m\].
    x: f64,
    /// Speed \[m/s\].
    v: f64,
    /// Tractive acceleration behind the actuation lag \[m/s²\].
    a_t: f64,
}

/// Derivatives of a [`State`].
#[derive(Debug, Clone, Copy, Default)]
struct Rate {
    x: f64,
    v: f64,
    a_t: f64,
}

impl State {
    fn plus(self, rate: Rate, h: f64) -> State {
        State { x: self.x + h * rate.x, v: self.v + h * rate.v, a_t: self.a_t + h * rate.a_t }
    }
}

/// The equations of motion.
pub(super) struct Drive<'a> {
    pub(super) lead: &'a Lead,
    pub(super) followers: &'a [CarTruth],
    pub(super) hills: &'a Hills,
    pub(super) set_speed: &'a SetSpeed,
}

impl Drive<'_> {
    /// Integrates `steps` steps of length `h` \[s\] from standstill; one history per car, platoon leader first.
    pub(super) fn integrate(&self, h: f64, steps: usize) -> Result<Vec<History>, PlantError> {
        let mut states = self.start();
        let mut histories: Vec<History> = states.iter().map(|_| History::new(h, steps + 1)).collect();
        for step in 0..=steps {
            let t = step as f64 * h;
            self.check_gaps(&states, t)?;
            let mut k_1 = self.rates(&states, t, &histories);
            // Brakes hold a standing car: it does not roll back. Decided once a step, for all its stages.
            let stands: Vec<bool> =
                states.iter().zip(&k_1).map(|(state, rate)| state.v <= 0.0 && rate.v < 0.0).collect();
            hold_still(&mut k_1, &stands);
            for ((history, state), rate) in histories.iter_mut().zip(&states).zip(&k_1) {
                history.push(Motion { x: state.x, v: state.v, a: rate.v });
            }
            let stage = |rates: &[Rate], fraction: f64| {
                let states: Vec<State> =
                    states.iter().zip(rates).map(|(state, &rate)| state.plus(rate, fraction * h)).collect();
                let mut rates = self.rates(&states, t + fraction * h, &histories);
                hold_still(&mut rates, &stands);
                rates
            };
            let k_2 = stage(&k_1, 0.5);
            let k_3 = stage(&k_2, 0.5);
            let k_4 = stage(&k_3, 1.0);
            for (i, state) in states.iter_mut().enumerate() {
                *state = state.plus(k_1[i], h / 6.0).plus(k_2[i], h / 3.0).plus(k_3[i], h / 3.0).plus(k_4[i], h / 6.0);
                // A car that comes to rest within the step stands at its end.
                state.v = state.v.max(0.0);
            }
        }
        Ok(histories)
    }

    /// All cars stand, the platoon leader's front bumper at 0.
    fn start(&self) -> Vec<State> {
        let mut rear = -self.lead.length;
        let mut states = vec![State { x: 0.0, v: 0.0, a_t: 0.0 }];
        for car in self.followers {
            let x = rear - car.initial_gap;
            states.push(State { x, v: 0.0, a_t: 0.0 });
            rear = x - car.length;
        }
        states
    }

    fn length(&self, car: usize) -> f64 {
        match car {
            0 => self.lead.length,
            _ => self.followers[car - 1].length,
        }
    }

    fn check_gaps(&self, states: &[State], t: f64) -> Result<(), PlantError> {
        for (link, pair) in states.windows(2).enumerate() {
            let gap = pair[0].x - self.length(link) - pair[1].x;
            // NaN comes from parameters that make no sense together.
            if gap <= 0.0 || gap.is_nan() {
                return Err(PlantError::Collision { car: link + 2, t, gap });
            }
        }
        Ok(())
    }

    fn rates(&self, states: &[State], t: f64, histories: &[History]) -> Vec<Rate> {
        let mut rates = Vec::with_capacity(states.len());
        rates.push(self.lead_rate(states[0], t));
        for (i, car) in self.followers.iter().enumerate() {
            rates.push(self.follower_rate(car, i + 1, states, t, histories));
        }
        rates
    }

    fn lead_rate(&self, state: State, t: f64) -> Rate {
        let (v_set, a_set) = self.set_speed.at(t);
        let hold = HOLD * (1.0 - v_set / RELEASED).clamp(0.0, 1.0);
        let command = a_set + self.lead.k * (v_set - state.v) + hold;
        let (a_t, a_t_rate) = lagged(state.a_t, command, self.lead.tau_a);
        let a = a_t - GRAVITY * self.hills.sin_grade(state.x);
        kinematics(state.v, a, a_t_rate)
    }

    fn follower_rate(&self, car: &CarTruth, i: usize, states: &[State], t: f64, histories: &[History]) -> Rate {
        let now = states[i];
        let ((x_ahead, v_ahead), (x, v)) = if car.tau_p > 0.0 && t > 0.0 {
            let seen_at = t - car.tau_p;
            (histories[i - 1].at(seen_at), histories[i].at(seen_at))
        } else {
            ((states[i - 1].x, states[i - 1].v), (now.x, now.v))
        };
        let command = car.controller.command(Seen {
            gap: x_ahead - self.length(i - 1) - x,
            v: v.max(0.0),
            v_ahead: v_ahead.max(0.0),
            v_now: now.v.max(0.0),
        });
        let (a_t, a_t_rate) = lagged(now.a_t, command, car.tau_a);
        let a = match &car.load {
            Some(load) => load.net(a_t, now.v, self.hills.sin_grade(now.x)),
            None => a_t,
        };
        kinematics(now.v, a.clamp(car.a_lb, car.a_ub), a_t_rate)
    }
}

fn hold_still(rates: &mut [Rate], stands: &[bool]) {
    for (rate, _) in rates.iter_mut().zip(stands).filter(|(_, stands)| **stands) {
        rate.v = 0.0;
    }
}

/// Eq. 10: tractive acceleration and its rate; without lag the command acts at once.
fn lagged(a_t: f64, command: f64, tau_a: f64) -> (f64, f64) {
    if tau_a > 0.0 { (a_t, (command - a_t) / tau_a) } else { (command, 0.0) }
}

fn kinematics(v: f64, a: f64, a_t: f64) -> Rate {
    Rate { x: v.max(0.0), v: a, a_t }
}
