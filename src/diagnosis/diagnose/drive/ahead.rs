//! Drives with another car ahead: one that stops, or none.

use super::Drive;
use crate::trajectory::integrate;

/// Deceleration of the car ahead in an ordinary stop \[m/s²\], within what every ACC has to follow (at least 3.5 m/s², ISO 15622).
pub const BRAKING: f64 = 2.0;
/// The same in a gentle stop \[m/s²\], in which most bases do not collide.
pub const GENTLE_BRAKING: f64 = 1.0;
/// Time before it brakes \[s\], in which the effect of the first measured state fades.
const BEFORE_S: f64 = 60.0;
/// Time for which it stands \[s\]: the car behind it has stopped by then, even with weak control gains.
const STANDING_S: f64 = 60.0;
/// Distance of a car ahead at which a law drives freely \[m\].
const AWAY_M: f64 = 1e4;

impl Drive {
    /// This drive without a car ahead: it is far away, at the follower's mean speed, so that it tells nothing of the moment.
    #[must_use]
    pub fn alone(&self) -> Drive {
        let mut drive = self.clone();
        let own = &mut drive.trajectory;
        let mean = own.v_f.iter().sum::<f64>() / own.v_f.len() as f64;
        for speed in [Some(&mut own.v_l), own.v_l2.as_mut()].into_iter().flatten() {
            speed.fill(mean);
        }
        own.x_f = integrate(0.0, &own.v_f, own.dt);
        own.x_l = integrate(AWAY_M, &own.v_l, own.dt);
        own.s = own.x_l.iter().zip(&own.x_f).map(|(x_l, x_f)| x_l - x_f).collect();
        if let Some(s_l2) = &mut own.s_l2 {
            s_l2.fill(AWAY_M);
        }
        drive.v_l_measured.clone_from(&own.v_l);
        drive
    }

    /// This drive up to its highest speed; then the car ahead, and the one in front of it, brake to a standstill at this deceleration
    /// \[m/s²\]. The follower's measured state stays as it was.
    #[must_use]
    pub fn until_it_stops(&self, braking: f64) -> Drive {
        let (v_l, dt) = (&self.trajectory.v_l, self.dt());
        let fastest = (0..v_l.len()).max_by(|&a, &b| v_l[a].total_cmp(&v_l[b])).unwrap_or(0);
        let before = (BEFORE_S / dt).round() as usize;
        let mut drive = self.part(fastest.saturating_sub(before)..fastest + 1);
        let samples = ((v_l[fastest] / braking + STANDING_S) / dt).ceil() as usize;
        let own = &mut drive.trajectory;
        for _ in 0..samples {
            let last = own.t.len() - 1;
            let speed = (own.v_l[last] - braking * dt).max(0.0);
            own.x_l.push(own.x_l[last] + 0.5 * (own.v_l[last] + speed) * dt);
            own.v_l.push(speed);
            own.t.push(own.t[last] + dt);
            let held = [&mut own.x_f, &mut own.v_f, &mut own.s, &mut drive.x_road, &mut drive.v_l_measured];
            let held = held.into_iter().chain([&mut own.v_l2, &mut own.s_l2].into_iter().flatten());
            held.for_each(|signal| signal.push(signal[last]));
            if let Some(v_l2) = &mut own.v_l2 {
                v_l2[last + 1] = (v_l2[last] - braking * dt).max(0.0);
            }
        }
        drive
    }
}

#[cfg(test)]
mod tests {
    use super::{BRAKING, GENTLE_BRAKING};
    use crate::diagnose::made_up;

    #[test]
    fn the_car_ahead_stops_from_its_highest_speed() {
        let drive = made_up::drive("made_up.csv", 0.0);
        let highest = drive.trajectory.v_l.iter().copied().fold(0.0, f64::max);
        for deceleration in [GENTLE_BRAKING, BRAKING] {
            let stop = drive.until_it_stops(deceleration);
            let own = &stop.trajectory;
            let braking = own.v_l.iter().position(|v| *v == highest).expect("it brakes from there");
            let most = deceleration * stop.dt() + 1e-9;
            assert!(own.v_l[braking..].windows(2).all(|v| v[1] <= v[0] && v[0] - v[1] <= most));
            assert_eq!(own.v_l.last(), Some(&0.0));
            let way = own.x_l[own.x_l.len() - 1] - own.x_l[braking];
            let expected = highest * highest / (2.0 * deceleration);
            assert!((way - expected).abs() < highest * stop.dt(), "{way} m from {highest} m/s");
            let lengths = [&own.t, &own.x_f, &own.v_f, &own.s, &stop.x_road, &stop.v_l_measured].map(Vec::len);
            assert_eq!(lengths, [own.x_l.len(); 6]);
        }
    }
}
