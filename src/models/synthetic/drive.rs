//! The platoon in continuous time, one car after the other: none depends on those behind it.

use super::car::{GRAVITY, Lead};
use super::error::SyntheticError;
use super::follower::Follower;
use super::history::History;
use super::integrate::{Car, V, X, drive, lagged};
use super::noise::{Purpose, Stream};
use super::road::Hills;
use super::scenario::Scenario;
use super::set_speed::{Profile, SetSpeed};

/// Brake of the platoon leader at set speed 0 \[m/s²\]: it stops and stays at rest, even downhill.
const HOLD: f64 = -0.6;
/// Set speed at which that brake is released \[m/s\]; a gradual release keeps the equations smooth.
const RELEASED: f64 = 0.5;

/// Time for which a car continues after the end \[s\], for effects that look ahead (time offset, smoothed acceleration).
const MARGIN: f64 = 1.6;

/// The motion of all cars, platoon leader first, over at least `steps` steps of length `h` \[s\] from standstill.
pub(super) fn platoon(
    scenario: &Scenario,
    hills: &Hills,
    set_speed: &SetSpeed,
    h: f64,
    steps: usize,
) -> Result<Vec<History>, SyntheticError> {
    let margin = (MARGIN / h).ceil() as usize;
    let followers = &scenario.followers;
    let steps_of = |car: usize| steps + margin * (followers.len() - car);
    let lead = match &scenario.profile {
        Profile::Recorded { dt, v } => History::recorded(*dt, v, h, steps_of(0)),
        _ => drive(&mut Cruising { lead: &scenario.lead, hills, set_speed }, [0.0; 3], h, steps_of(0))?,
    };
    let mut cars = vec![lead];
    for i in 1..=followers.len() {
        let history = follow(scenario, i, &cars, hills, h, steps_of(i))?;
        cars.push(history);
    }
    Ok(cars)
}

/// The motion of one follower (1 drives behind the platoon leader) behind the cars ahead of it.
pub(super) fn follow(
    scenario: &Scenario,
    follower: usize,
    ahead: &[History],
    hills: &Hills,
    h: f64,
    steps: usize,
) -> Result<History, SyntheticError> {
    let length = match follower {
        1 => scenario.lead.length,
        _ => scenario.followers[follower - 2].length,
    };
    let stream = Stream::new(scenario.seed, Purpose::GustsOfCar(follower));
    let car = &scenario.followers[follower - 1];
    let mut car = Follower::new(car, follower + 1, ahead, length, hills, stream, h)?;
    let start = car.start();
    drive(&mut car, start, h, steps)
}

/// The platoon leader on cruise control: position, speed, tractive acceleration.
struct Cruising<'a> {
    lead: &'a Lead,
    hills: &'a Hills,
    set_speed: &'a SetSpeed,
}

impl Car<3> for Cruising<'_> {
    fn begin(&mut self, _: f64, _: &[f64; 3], _: &History) -> Result<(), SyntheticError> {
        Ok(())
    }

    fn rate(&self, t: f64, state: &[f64; 3], _: &History) -> [f64; 3] {
        let (v_set, a_set) = self.set_speed.at(t);
        let hold = HOLD * (1.0 - v_set / RELEASED).clamp(0.0, 1.0);
        let command = a_set + self.lead.k * (v_set - state[V]) + hold;
        let (a_t, a_t_rate) = lagged(state[2], command, self.lead.tau_a);
        [state[V].max(0.0), a_t - GRAVITY * self.hills.sin_grade(state[X]), a_t_rate]
    }
}
