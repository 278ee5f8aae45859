//! The set speed of the platoon leader: steps with bounded acceleration and jerk, and one stop.

use serde::{Deserialize, Serialize};

use super::noise::Stream;

/// How the platoon leader drives.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Profile {
    /// A new set speed every 15 to 45 s, and one stop.
    #[default]
    Cruise,
    /// A congested road: stops, and never fast.
    StopAndGo,
    /// A new set speed every few seconds, from slow to fast.
    Restless,
    Recorded {
        /// Time step of the record \[s\].
        #[serde(rename = "dt_s")]
        dt: f64,
        /// Speeds \[m/s\]; the last one continues.
        #[serde(rename = "speed_mps")]
        v: Vec<f64>,
    },
}

/// A piece of the set speed with constant jerk; it lasts until the next one begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Begin \[s\].
    #[serde(rename = "time_s")]
    pub t: f64,
    /// Set speed at the start \[m/s\].
    #[serde(rename = "speed_mps")]
    pub v: f64,
    /// Its rate of change at the start \[m/s²\].
    #[serde(rename = "accel_mps2")]
    pub a: f64,
    /// Jerk \[m/s³\].
    #[serde(rename = "jerk_mps3")]
    pub jerk: f64,
}

/// Jerk of every change of the set speed \[m/s³\]; comfortable by the usual bounds of 0.9 to 2.
const JERK: f64 = 1.2;
/// Range of set speeds \[m/s\], as driven by the AstaZero platoon leader.
const SPEEDS: (f64, f64) = (14.0, 27.5);
/// A new set speed differs by at least this much \[m/s\].
const SMALLEST_CHANGE: f64 = 2.5;

/// Set speed over time.
#[derive(Debug)]
pub(super) struct SetSpeed {
    segments: Vec<Segment>,
    /// Time and set speed at the end of the last segment.
    end: (f64, f64),
}

impl SetSpeed {
    /// From standstill, according to a profile; a recorded one has no set speeds.
    pub(super) fn new(profile: &Profile, duration: f64, stream: &mut Stream) -> SetSpeed {
        match profile {
            Profile::Cruise => SetSpeed::cruise(duration, stream),
            Profile::StopAndGo => SetSpeed::stop_and_go(duration, stream),
            Profile::Restless => SetSpeed::restless(duration, stream),
            Profile::Recorded { .. } => SetSpeed { segments: Vec::new(), end: (0.0, 0.0) },
        }
    }

    fn stop_and_go(duration: f64, stream: &mut Stream) -> SetSpeed {
        let mut plan = SetSpeed { segments: Vec::new(), end: (0.0, 0.0) };
        plan.hold(stream.between(4.0, 8.0));
        while plan.end.0 < duration {
            for _ in 0..3 {
                let speed = stream.between(3.0, 14.0);
                plan.change(speed, stream);
                plan.hold(stream.between(4.0, 15.0));
            }
            plan.change(0.0, stream);
            plan.hold(stream.between(3.0, 12.0));
        }
        plan
    }

    fn restless(duration: f64, stream: &mut Stream) -> SetSpeed {
        let mut plan = SetSpeed { segments: Vec::new(), end: (0.0, 0.0) };
        plan.hold(stream.between(4.0, 8.0));
        while plan.end.0 < duration {
            let speed = stream.between(5.0, SPEEDS.1);
            plan.change(speed, stream);
            plan.hold(stream.between(0.0, 6.0));
        }
        plan
    }

    /// Changes every 15 to 45 s, and stops or nearly stops once, after about 0.6 of the time.
    fn cruise(duration: f64, stream: &mut Stream) -> SetSpeed {
        let mut plan = SetSpeed { segments: Vec::new(), end: (0.0, 0.0) };
        plan.hold(stream.between(6.0, 10.0));
        let stop_at = duration * stream.between(0.55, 0.7);
        let mut stopped = false;
        while plan.end.0 < duration {
            let speed = plan.next_speed(stream);
            plan.change(speed, stream);
            let hold = stream.between(15.0, 45.0);
            if stopped || plan.end.0 + hold < stop_at {
                plan.hold(hold);
            } else {
                stopped = true;
                plan.hold((stop_at - plan.end.0).max(5.0));
                let slow = stream.between(-3.0, 3.0).max(0.0);
                plan.change(slow, stream);
                plan.hold(stream.between(6.0, 12.0));
            }
        }
        plan
    }

    fn next_speed(&self, stream: &mut Stream) -> f64 {
        loop {
            let speed = stream.between(SPEEDS.0, SPEEDS.1);
            if (speed - self.end.1).abs() >= SMALLEST_CHANGE {
                return speed;
            }
        }
    }

    fn hold(&mut self, duration: f64) {
        self.push(0.0, 0.0, duration);
    }

    /// An S-shaped step: jerk up, constant, jerk down.
    fn change(&mut self, to: f64, stream: &mut Stream) {
        let dv = to - self.end.1;
        let limit = stream.between(0.8, 1.8);
        let sign = dv.signum();
        // A small step ends before the acceleration limit is reached.
        let peak = limit.min((dv.abs() * JERK).sqrt());
        let rise = peak / JERK;
        self.push(0.0, sign * JERK, rise);
        self.push(sign * peak, 0.0, dv.abs() / peak - rise);
        self.push(sign * peak, -sign * JERK, rise);
        // The sum of three pieces misses the target by a rounding error; a stop must be exactly 0.
        self.end.1 = to;
    }

    fn push(&mut self, a: f64, jerk: f64, duration: f64) {
        let (t, v) = self.end;
        self.segments.push(Segment { t, v, a, jerk });
        self.end = (t + duration, v + (a + jerk * duration / 2.0) * duration);
    }

    /// Set speed \[m/s\] and its rate of change \[m/s²\].
    pub(super) fn at(&self, t: f64) -> (f64, f64) {
        let after = self.segments.partition_point(|segment| segment.t <= t);
        let segment = self.segments[after.saturating_sub(1)];
        let age = t - segment.t;
        let v = segment.v + (segment.a + segment.jerk * age / 2.0) * age;
        (v, segment.a + segment.jerk * age)
    }

    pub(super) fn into_segments(self) -> Vec<Segment> {
        self.segments
    }
}
