//! A follower with all its effects: perceive, decide, limit, actuate, move.

use super::car::{CarTruth, Controller, GRAVITY, behind};
use super::controller::Seen;
use super::effect::{EffectKind, Effects};
use super::error::SyntheticError;
use super::history::History;
use super::integrate::{Car, V, X, lagged};
use super::noise::Stream;
use super::road::Hills;

/// Places in the state after position and speed: tractive acceleration \[m/s²\], filtered spacing \[m\] and speed difference
/// \[m/s\], integral of the spacing error \[m s\].
const A_T: usize = 2;
const GAP: usize = 3;
const DV: usize = 4;
const INTEGRAL: usize = 5;

/// Half of the time over which the acceleration ahead is smoothed \[s\].
const HALF_SMOOTHING: f64 = 0.55;
/// Largest part of the command that is due to the integral \[m/s²\].
const INTEGRAL_LIMIT: f64 = 0.6;
/// Duration of a change of the headway \[s\].
const RAMP: f64 = 4.0;
/// Gain on the set speed while it is lowered \[1/s\].
const SET_SPEED_GAIN: f64 = 0.5;

/// The car, those ahead, and its memory from one step to the next.
pub(super) struct Follower<'a> {
    car: &'a CarTruth,
    effects: Effects<'a>,
    number: usize,
    ahead: &'a History,
    second_ahead: Option<&'a History>,
    length_ahead: f64,
    hills: &'a Hills,
    h: f64,
    /// Perception delay of the base and of an effect \[s\].
    tau_p: f64,
    /// The command, limited to its change in a step \[m/s²\].
    command: f64,
    /// Random acceleration, constant within a step \[m/s²\].
    gust: f64,
    stream: Stream,
}

impl<'a> Follower<'a> {
    /// The car with this number (1 leads the platoon) behind `cars`, the nearest one `length_ahead` \[m\] long.
    pub(super) fn new(
        car: &'a CarTruth,
        number: usize,
        cars: &'a [History],
        length_ahead: f64,
        hills: &'a Hills,
        stream: Stream,
        h: f64,
    ) -> Result<Follower<'a>, SyntheticError> {
        let effects = Effects(&car.effects);
        let second_ahead = cars.len().checked_sub(2).map(|k| &cars[k]);
        if second_ahead.is_none() && effects.get(EffectKind::MultiAnticipation).is_some() {
            return Err(SyntheticError::NobodyAhead { car: number });
        }
        Ok(Follower {
            car,
            effects,
            number,
            ahead: cars.last().expect("a follower has a car ahead"),
            second_ahead,
            length_ahead,
            hills,
            h,
            tau_p: car.tau_p + effects.size(EffectKind::PerceptionDelay),
            command: 0.0,
            gust: 0.0,
            stream,
        })
    }

    /// At rest at its initial gap.
    pub(super) fn start(&self) -> [f64; 6] {
        let x = behind(self.car, self.ahead.get(0).x - self.length_ahead);
        [x, 0.0, 0.0, self.car.initial_gap, 0.0, 0.0]
    }

    /// Spacing, own speed and speed ahead after sensors and delay, and the rates of the filtered values.
    fn perceive(&self, t: f64, state: &[f64; 6], own: &History) -> (Seen, [f64; 2]) {
        let e = self.effects;
        let seen_at = t - self.tau_p;
        let (x, v) = if self.tau_p > 0.0 && t > 0.0 { own.at(seen_at) } else { (state[X], state[V]) };
        let (x_ahead, v_ahead) = self.ahead.at(seen_at - e.size(EffectKind::TimeOffset));
        let gap =
            (x_ahead - self.length_ahead - x) * (1.0 + e.size(EffectKind::RangeScale)) + e.size(EffectKind::RangeBias);
        let v = v.max(0.0) * (1.0 + e.size(EffectKind::SpeedScale));
        let dv = v_ahead.max(0.0) - v;
        let tf = e.size(EffectKind::SensorLowpass);
        let (gap, dv, rates) = if tf > 0.0 {
            (state[GAP], state[DV], [(gap - state[GAP]) / tf, (dv - state[DV]) / tf])
        } else {
            (gap, dv, [0.0; 2])
        };
        (Seen { gap, v, v_ahead: v + dv, v_now: state[V].max(0.0) }, rates)
    }

    /// The controller with changes of its policy, and the spacing error \[m\].
    fn decide(&self, t: f64, seen: Seen, integral: f64) -> (f64, f64) {
        let e = self.effects;
        let mut controller = self.car.controller.clone();
        if let Some([r, t0, _]) = e.get(EffectKind::HeadwayModeChange) {
            controller.stretch_headway(1.0 + r * ((t - t0) / RAMP).clamp(0.0, 1.0));
        }
        let extra = e.size(EffectKind::SpeedDepHeadway) * seen.v * seen.v;
        let error = seen.gap - controller.equilibrium_gap(seen.v) - extra;
        // The reduction of the error is added to the gap.
        let unseen = error.clamp(-e.size(EffectKind::DeadZone), e.size(EffectKind::DeadZone));
        let mut command = controller.command(Seen { gap: seen.gap - unseen, ..seen }, extra);
        let part = e.size(EffectKind::IntegralAction) * integral;
        command += part.clamp(-INTEGRAL_LIMIT, INTEGRAL_LIMIT);
        if let (Some([k2, ..]), Some(second)) = (e.get(EffectKind::MultiAnticipation), self.second_ahead) {
            let at = t - self.tau_p;
            command += k2 * (second.at(at).1 - self.ahead.at(at).1);
        }
        if let Some([ka, ..]) = e.get(EffectKind::LeaderAccelFf) {
            let speed = |offset: f64| self.ahead.at(t - self.tau_p + offset).1;
            command += ka * (speed(HALF_SMOOTHING) - speed(-HALF_SMOOTHING)) / (2.0 * HALF_SMOOTHING);
        }
        if let Some([sine, cosine, f]) = e.get(EffectKind::Periodic) {
            let angle = std::f64::consts::TAU * f * t;
            command += sine * angle.sin() + cosine * angle.cos();
        }
        (command * (1.0 + e.size(EffectKind::GainMass)), error)
    }

    /// Limits of the command except that of its rate.
    fn limit(&self, t: f64, v: f64, mut command: f64) -> f64 {
        let e = self.effects;
        if let Some([vlim, t1, dur]) = e.get(EffectKind::SetSpeedChange)
            && (t1..t1 + dur).contains(&t)
        {
            command = command.min(SET_SPEED_GAIN * (vlim - v));
        }
        if let Some([cap, ..]) = e.get(EffectKind::AccelCap) {
            command = command.min(cap);
        }
        if let Some([cap, ..]) = e.get(EffectKind::DecelCap) {
            command = command.max(-cap);
        }
        if let Some([power, ..]) = e.get(EffectKind::PowerCap) {
            command = command.min(power / v.max(0.1));
        }
        match e.get(EffectKind::QuantisedAccel) {
            Some([step, ..]) if step > 0.0 => (command / step).round() * step,
            _ => command,
        }
    }

    /// Command, rates of the filtered values and of the integral.
    fn commanded(&self, t: f64, state: &[f64; 6], own: &History) -> (f64, [f64; 2], f64) {
        let (seen, rates) = self.perceive(t, state, own);
        let (command, error) = self.decide(t, seen, state[INTEGRAL]);
        let part = self.effects.size(EffectKind::IntegralAction) * state[INTEGRAL];
        // The integral waits while its part is at its limit.
        let waits = part.abs() >= INTEGRAL_LIMIT && part * error * self.effects.size(EffectKind::IntegralAction) > 0.0;
        (self.limit(t, state[V].max(0.0), command), rates, if waits { 0.0 } else { error })
    }
}

impl Car<6> for Follower<'_> {
    fn begin(&mut self, t: f64, state: &[f64; 6], own: &History) -> Result<(), SyntheticError> {
        let gap = self.ahead.at(t).0 - self.length_ahead - state[X];
        // Inconsistent parameters give NaN.
        if gap <= 0.0 || gap.is_nan() {
            return Err(SyntheticError::Collision { car: self.number, t, gap });
        }
        if let Some([jerk, ..]) = self.effects.get(EffectKind::JerkLimit) {
            let wanted = self.commanded(t, state, own).0;
            self.command += (wanted - self.command).clamp(-jerk * self.h, jerk * self.h);
        }
        if let Some(gusts) = &self.car.gusts {
            // First-order autoregression with this standard deviation and time constant, whatever the step.
            let kept = (-self.h / gusts.time_constant_s).exp();
            let new = if t > 0.0 { (1.0 - kept * kept).sqrt() } else { 1.0 };
            self.gust = kept * self.gust + new * gusts.sigma_mps2 * self.stream.normal();
        }
        Ok(())
    }

    fn rate(&self, t: f64, state: &[f64; 6], own: &History) -> [f64; 6] {
        let e = self.effects;
        let (wanted, filtered, error) = self.commanded(t, state, own);
        let command = if e.get(EffectKind::JerkLimit).is_some() { self.command } else { wanted };
        let lag = match e.get(EffectKind::AsymLag) {
            Some([ta, tb, _]) => {
                if command >= 0.0 {
                    ta
                } else {
                    tb
                }
            }
            None => e.size(EffectKind::ActuationLag),
        };
        let (a_t, a_t_rate) = lagged(state[A_T], command, self.car.tau_a + lag);
        let sin_grade = self.hills.sin_grade(state[X]);
        let driven = match &self.car.load {
            Some(load) => load.net(a_t, state[V], sin_grade),
            None => a_t,
        };
        let v = state[V].max(0.0);
        let moving = if v > 0.0 { 1.0 } else { 0.0 };
        let a = driven.clamp(self.car.a_lb, self.car.a_ub)
            - e.size(EffectKind::Grade) * GRAVITY * sin_grade
            - e.size(EffectKind::AeroDrag) * v * v
            - e.size(EffectKind::ConstDecel) * moving
            + self.gust;
        [v, a, a_t_rate, filtered[0], filtered[1], error]
    }
}

impl Controller {
    fn stretch_headway(&mut self, factor: f64) {
        match self {
            Controller::Idm { t_h, .. }
            | Controller::Gipps { t_h, .. }
            | Controller::Linear { t_h, .. }
            | Controller::LinearIdm { t_h, .. }
            | Controller::LinearGipps { t_h, .. } => {
                *t_h *= factor;
            }
        }
    }
}
