//! The built-in causes, transcribed by hand in f64, to compare with shaders/extension/.
//!
//! One function per stage; each names its causes in the order in which they act. A law has a separate file.

use super::law::{self, Law, Seen};
use super::spacing;
use super::types::Perceived;
use crate::catalog::{Controller, Variant};
use crate::evaluator::{Case, LEADER_SMOOTHING};
use crate::extension::Extension;
use crate::symbols::Parameters;

/// Standard gravity, as in shaders/extension/grade.wgsl \[m/s²\].
const GRAVITY: f64 = 9.81;
/// Duration of a change of the headway \[s\].
const RAMP: f64 = 4.0;
/// Largest part of the command that is due to the integral \[m/s²\].
const INTEGRAL_LIMIT: f64 = 0.6;
/// Decrease of a command with the own speed \[1/s\], halved.
const FALL: f64 = 0.8;
/// Gain on the set speed while it is lowered \[1/s\].
const SET_SPEED_GAIN: f64 = 0.5;

const KNOWN: &[&str] = &[
    "speed_dep_headway",
    "headway_mode_change",
    "perception_delay",
    "time_offset",
    "range_scale",
    "range_bias",
    "speed_scale",
    "lead",
    "sensor_lowpass",
    "dead_zone",
    "integral_action",
    "multi_anticipation",
    "leader_accel_ff",
    "periodic",
    "gain_mass",
    "set_speed_change",
    "accel_cap",
    "decel_cap",
    "power_cap",
    "quantised_accel",
    "jerk_limit",
    "actuation_lag",
    "asym_lag",
    "grade",
    "aero_drag",
    "const_decel",
];

/// True if every extension of the variant is one of those transcribed here.
pub fn knows(variant: &Variant) -> bool {
    untranscribed(variant).is_none()
}

/// The first law or extension of the variant that is not transcribed here.
pub fn untranscribed(variant: &Variant) -> Option<&'static Extension> {
    let known =
        |e: &Extension| if e.is_law() { law::named(&e.name).is_some() } else { KNOWN.contains(&e.name.as_str()) };
    variant.extensions.list().iter().copied().find(|e| !known(e))
}

/// World of an extension at a step.
#[derive(Debug, Clone, Copy)]
pub struct Now {
    /// Index of the sample from which the step starts.
    pub sample: usize,
    /// The same, earlier by the perception delay.
    pub perceived: f64,
    pub sin_grade: f64,
    pub v_f: f64,
    pub a_f: f64,
}

/// One extension of a run: its parameters by position, its memory.
struct One {
    extension: &'static Extension,
    own: [f64; 3],
    memory: [f64; 2],
}

/// The law of a run.
struct OwnLaw {
    law: &'static Law,
    own: Vec<f64>,
    /// Its look-back time \[s\].
    look_back: f64,
    memory: law::Memory,
}

/// The law and the extensions of a run.
pub struct Extended<'a> {
    case: &'a Case,
    law: Option<OwnLaw>,
    all: Vec<One>,
}

impl<'a> Extended<'a> {
    /// At the sample before the first simulated one. Panics with an extension that has no transcription: see [`knows`].
    pub fn new(case: &'a Case, p: &Parameters, sample: usize) -> Extended<'a> {
        assert!(knows(&case.variant), "the reference has no transcription of all of {}", case.variant);
        let one = |extension: &'static Extension| {
            let mut own = [0.0; 3];
            for (value, symbol) in own.iter_mut().zip(&extension.parameters) {
                *value = p.get(*symbol);
            }
            let memory = match extension.name.as_str() {
                "sensor_lowpass" => [case.s[sample], 0.0],
                "quantised_accel" | "jerk_limit" | "actuation_lag" | "asym_lag" => [case.a_f[sample], 0.0],
                _ => [0.0; 2],
            };
            One { extension, own, memory }
        };
        let law = case.variant.law().map(|extension| OwnLaw {
            law: law::named(&extension.name).expect("known"),
            own: own_values(extension, p),
            look_back: extension.needs.look_back.map_or(0.0, |k| p.get(extension.parameters[k])),
            memory: law::Memory::default(),
        });
        Extended { case, law, all: case.variant.causes().map(one).collect() }
    }

    fn each(&mut self) -> impl Iterator<Item = (&'static str, [f64; 3], &mut [f64; 2])> {
        self.all.iter_mut().map(|one| (one.extension.name.as_str(), one.own, &mut one.memory))
    }

    fn time(&self, now: Now) -> f64 {
        self.case.t_0 + now.sample as f64 * self.case.dt
    }

    /// The parameters as the policy changes them.
    pub fn policy(&mut self, p: &Parameters, x: &Perceived, now: Now) -> Parameters {
        let t = self.time(now);
        let mut q = *p;
        for (name, own, _) in self.each() {
            match name {
                "speed_dep_headway" => q.d_0 += own[0] * x.v_f * x.v_f,
                "headway_mode_change" => q.t_h *= 1.0 + own[0] * ((t - own[1]) / RAMP).clamp(0.0, 1.0),
                _ => {}
            }
        }
        q
    }

    /// The perceived values.
    pub fn perception(&mut self, q: &Parameters, mut x: Perceived, now: Now) -> Perceived {
        let case = self.case;
        let dt = case.dt;
        for (name, own, memory) in self.each() {
            match name {
                "time_offset" => {
                    let then = at(&case.v_l, now.perceived - own[0] / dt);
                    let half = at(&case.v_l, now.perceived - 0.5 * own[0] / dt);
                    // Simpson's rule.
                    x.s -= own[0] * (x.v_l + 4.0 * half + then) / 6.0;
                    x.v_l = then;
                }
                "range_scale" => x.s *= 1.0 + own[0],
                "range_bias" => x.s += own[0],
                "speed_scale" => x.v_f *= 1.0 + own[0],
                "sensor_lowpass" => {
                    let s = lagged(&mut memory[0], x.s, own[0], dt);
                    let dv = lagged(&mut memory[1], x.dv(), own[0], dt);
                    x = Perceived { s, v_f: x.v_f, v_l: x.v_f + dv };
                }
                "lead" => {
                    let h = own[0];
                    let a_l = leader_acceleration(case, now.perceived);
                    x = Perceived { s: x.s + h * x.dv(), v_f: x.v_f + h * now.a_f, v_l: x.v_l + h * a_l };
                }
                "dead_zone" => x.s -= (x.s - equilibrium(&case.variant, q, x.v_f)).clamp(-own[0], own[0]),
                "integral_action" => {
                    let error = x.s - equilibrium(&case.variant, q, x.v_f);
                    let part = own[0] * memory[0];
                    if part.abs() < INTEGRAL_LIMIT || part * error * own[0] <= 0.0 {
                        memory[0] += error * dt;
                    }
                    // The command of this step has the new integral.
                    memory[1] = (own[0] * memory[0]).clamp(-INTEGRAL_LIMIT, INTEGRAL_LIMIT);
                }
                _ => {}
            }
        }
        x
    }

    /// The present own speed, as the controller starts from it.
    pub fn speed(&mut self, mut v_f: f64, now: Now) -> f64 {
        for (name, own, _) in self.each() {
            if name == "lead" {
                v_f += own[0] * now.a_f;
            }
        }
        v_f
    }

    /// The acceleration that the law commands, if there is one; otherwise the given one.
    pub fn law(&mut self, q: &Parameters, x: Perceived, given: f64, now: Now) -> f64 {
        let case = self.case;
        let Some(OwnLaw { law, own, look_back, memory }) = &mut self.law else { return given };
        let earlier = |share: f64| at(&case.v_l, now.perceived - share * *look_back / case.dt);
        let seen = Seen {
            p: q,
            own,
            x,
            v_f: given,
            a_f: now.a_f,
            a_l: leader_acceleration(case, now.perceived),
            v_l_then: earlier(1.0),
            v_l_half: earlier(0.5),
            dt: case.dt,
        };
        (law.acceleration)(&seen, memory)
    }

    /// The commanded acceleration.
    pub fn command(&mut self, x: &Perceived, mut a: f64, now: Now) -> f64 {
        let case = self.case;
        let (t, dt) = (self.time(now), case.dt);
        for (name, own, memory) in self.each() {
            match name {
                "integral_action" => a += memory[1],
                "multi_anticipation" => {
                    let v_l2 = case.v_l2.as_ref().map_or(f64::NAN, |v| at(v, now.perceived));
                    a += own[0] * (v_l2 - x.v_l);
                }
                "leader_accel_ff" => a += own[0] * leader_acceleration(case, now.perceived),
                "periodic" => {
                    let angle = std::f64::consts::TAU * own[2] * (t + 0.5 * dt);
                    a += own[0] * angle.sin() + own[1] * angle.cos();
                }
                "gain_mass" => a *= 1.0 + own[0],
                "set_speed_change" => {
                    // v' = gain (vlim - (v + v' dt / 2)): the speed in the middle of the step counts.
                    let held = a.min(SET_SPEED_GAIN * (own[0] - now.v_f) / (1.0 + 0.5 * SET_SPEED_GAIN * dt));
                    a += within(t - own[1], own[2], dt) * (held - a);
                }
                "accel_cap" => a = a.min(own[0]),
                "decel_cap" => a = a.max(-own[0]),
                "power_cap" => a = a.min(own[0] / now.v_f.max(0.1)),
                "quantised_accel" => {
                    if own[0] > 1e-6 {
                        a = steps(a, memory[0], own[0], FALL * dt);
                    }
                    memory[0] = a;
                }
                "jerk_limit" => {
                    memory[0] += (a - memory[0]).clamp(-own[0] * dt, own[0] * dt);
                    a = memory[0];
                }
                "actuation_lag" => a = lagged(&mut memory[0], a, own[0], dt),
                "asym_lag" => a = lagged(&mut memory[0], a, if a >= 0.0 { own[0] } else { own[1] }, dt),
                _ => {}
            }
        }
        a
    }

    /// The response of the vehicle.
    pub fn response(&mut self, mut a: f64, now: Now) -> f64 {
        for (name, own, _) in self.each() {
            match name {
                "grade" => a -= own[0] * GRAVITY * now.sin_grade,
                "aero_drag" => a -= own[0] * now.v_f * now.v_f,
                "const_decel" if now.v_f > 0.0 => a -= own[0],
                _ => {}
            }
        }
        a
    }
}

/// Mean output of a first-order lag with `input` over a step; `state` is the output at its beginning, and then at its end:
/// (state' - state) / dt = (input - (state + state') / 2) / time constant, so that a steady rise is late by the time constant.
fn lagged(state: &mut f64, input: f64, time_constant: f64, dt: f64) -> f64 {
    let before = *state;
    *state = ((time_constant - 0.5 * dt) * before + dt * input) / (time_constant + 0.5 * dt);
    0.5 * (before + *state)
}

/// Share of a step of `dt` that lies in a stretch of this `length`, which began `since` before the step. All in seconds.
fn within(since: f64, length: f64, dt: f64) -> f64 {
    let begun = (since + dt).min(dt);
    let left = (length - since).min(dt);
    (begun + left - dt).max(0.0) / dt
}

/// The response y to a command that falls by `slope` (y - `before`) because of it: the remaining command, rounded to a multiple of `step`.
/// If no multiple is consistent, because either one would move the command to the other side, y leaves it between the two.
fn steps(command: f64, before: f64, step: f64, slope: f64) -> f64 {
    let x = (command + slope * before) / step + 0.5;
    let whole = (x / (1.0 + slope)).floor();
    let rest = x - whole * (1.0 + slope);
    (whole + (rest - 1.0).max(0.0) / slope) * step
}

/// A signal at a fractional index: linear between samples, constant beyond the ends.
fn at(signal: &[f64], index: f64) -> f64 {
    let index = index.clamp(0.0, (signal.len() - 1) as f64);
    let k = (index.floor() as usize).min(signal.len() - 2);
    signal[k] + (signal[k + 1] - signal[k]) * (index - k as f64)
}

/// Acceleration of the preceding vehicle over [`LEADER_SMOOTHING`], linear between samples \[m/s²\].
fn leader_acceleration(case: &Case, index: f64) -> f64 {
    let last = (case.v_l.len() - 1) as f64;
    let half = 0.5 * LEADER_SMOOTHING / case.dt;
    let smooth = |i: f64| {
        if let Some(a_l) = &case.a_l {
            return a_l[i as usize];
        }
        let (from, to) = ((i - half).max(0.0), (i + half).min(last));
        (at(&case.v_l, to) - at(&case.v_l, from)) / ((to - from) * case.dt)
    };
    let (older, younger) = (index.floor(), index.ceil());
    smooth(older) + (smooth(younger) - smooth(older)) * (index - older)
}

/// A law's own parameters, in the order of its file.
fn own_values(law: &Extension, p: &Parameters) -> Vec<f64> {
    law.own_parameters().map(|symbol| p.get(symbol)).collect()
}

/// Spacing at which a car at constant speed v \[m/s\] behind another at that speed does not change it \[m\]. Panics with a law that has no
/// transcription: see [`knows`].
fn equilibrium(variant: &Variant, p: &Parameters, v: f64) -> f64 {
    if let Some(extension) = variant.law() {
        let law = law::named(&extension.name).expect("known");
        return (law.equilibrium)(p, &own_values(extension, p), v);
    }
    match variant.base.controller {
        Controller::Idm => (p.d_0 + p.t_h * v) / (1.0 - (v.max(0.0) / p.v_0).powf(p.delta)).max(0.01).sqrt(),
        Controller::Gipps => p.d_0 + (p.t_h + p.theta) * v + v * v * (1.0 / p.a_hat_min - 1.0 / p.a_min) / 2.0,
        // The spacing of the policy.
        _ => spacing::pick(variant.base.spacing)(p, &Perceived { s: 0.0, v_f: v, v_l: v }),
    }
}
