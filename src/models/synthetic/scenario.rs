//! The scenario to drive, and its truth.

use serde::{Deserialize, Serialize};

use super::car::{CarTruth, Lead};
use super::default_cars;
use super::effect::{EffectKind, Effects};
use super::error::SyntheticError;
use super::noise::Noise;
use super::road::Road;
use super::set_speed::{Profile, Segment};

/// A synthetic drive.
///
/// The default is a five-car platoon, 10 minutes on a hilly track, sampled at 10 Hz. Behind the platoon leader
/// (cruise control) drive, all with bounds of -7 and 5 m/s²:
///
/// | car | controller | `tau_p` | `tau_a` | road load |
/// |---|---|---|---|---|
/// | 2 | IDM | 0.2 s | 0.2 s | none |
/// | 3 | linear, constant time headway | 0.1 s | 0.2 s | none |
/// | 4 | Gipps | 0.3 s | 0.1 s | none |
/// | 5 | IDM | 0.2 s | 0.3 s | Eq. 11, an electric saloon of 2230 kg |
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scenario {
    /// Seed of road, set speeds and noise, each from a separate stream.
    pub seed: u64,
    /// Length of the drive \[s\].
    pub duration_s: f64,
    /// Samples per second.
    pub rate_hz: u32,
    /// Largest step of the integration \[s\]; shortened so that a whole number of steps makes a sample.
    #[serde(rename = "dt_s")]
    pub dt: f64,
    pub road: Road,
    /// Seed of the road instead of `seed`: drives with the same one use the same hills.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub road_seed: Option<u64>,
    /// Noise of the sensors.
    pub noise: Noise,
    /// How the platoon leader drives.
    #[serde(default)]
    pub profile: Profile,
    /// The platoon leader.
    pub lead: Lead,
    /// The followers, front to back.
    pub followers: Vec<CarTruth>,
}

impl Default for Scenario {
    fn default() -> Self {
        Scenario {
            seed: 1,
            duration_s: 600.0,
            rate_hz: 10,
            dt: 0.01,
            // As AstaZero's rural road: 5.758 km, -2.9 to 3.0 %.
            road: Road::Hilly { period: 5700.0, max_sin: 0.029 },
            road_seed: None,
            noise: Noise::default(),
            profile: Profile::Cruise,
            lead: default_cars::lead(),
            followers: default_cars::followers(),
        }
    }
}

/// The truth of a synthetic drive, which a calibration should find.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Parameters of the cars, noise, road.
    pub scenario: Scenario,
    /// Set speed of the platoon leader.
    pub set_speed: Vec<Segment>,
}

impl Scenario {
    /// Range of [`duration_s`](Self::duration_s): bounds the memory of the history (24 bytes per step and car).
    pub const DURATION_S: [f64; 2] = [1.0, 1e5];
    /// Range of the standard deviation of the noise of speeds \[m/s\] and of gaps \[m\].
    pub const NOISE: [f64; 2] = [0.0, 10.0];

    /// Step of the integration \[s\] and number of steps per sample.
    pub(super) fn step(&self) -> (f64, usize) {
        let per_sample = (1.0 / (f64::from(self.rate_hz) * self.dt) - 1e-9).ceil().max(1.0);
        (1.0 / (f64::from(self.rate_hz) * per_sample), per_sample as usize)
    }

    /// Refuses impossible scenarios; only the simulation shows whether the controllers are safe.
    pub(super) fn check(&self) -> Result<(), SyntheticError> {
        let [shortest, longest] = Scenario::DURATION_S;
        in_range("duration", self.duration_s, shortest, longest, "s")?;
        in_range("sampling rate", f64::from(self.rate_hz), 1.0, 1e4, "Hz")?;
        // The finest step bounds the memory, too.
        in_range("integration step", self.dt, 1e-4, 0.1, "s")?;
        let [none, most] = Scenario::NOISE;
        in_range("noise of the speeds", self.noise.speed_mps, none, most, "m/s")?;
        in_range("noise of the gaps", self.noise.gap_m, none, most, "m")?;
        if let Road::Hilly { period, max_sin } = self.road {
            in_range("length of the lap", period, 100.0, 1e6, "m")?;
            in_range("largest sine of the grade", max_sin, 0.0, 0.2, "")?;
        }
        if let Profile::Recorded { dt, v } = &self.profile {
            in_range("time step of the recorded speed", *dt, 1e-3, 10.0, "s")?;
            in_range("number of recorded speeds", v.len() as f64, 2.0, 1e8, "")?;
            v.iter().try_for_each(|v| in_range("recorded speed", *v, 0.0, 100.0, "m/s"))?;
        }
        in_range("length of car 1", self.lead.length, 0.0, 30.0, "m")?;
        in_range("tau_a of car 1", self.lead.tau_a, 0.0, 10.0, "s")?;
        let (h, _) = self.step();
        for (car, number) in self.followers.iter().zip(2..) {
            for effect in &car.effects {
                let (effect, begins) = (effect.kind(), effect.begins());
                if let Some((parameter, begins_s)) = begins.filter(|(_, begins_s)| *begins_s >= self.duration_s) {
                    let (car, duration_s) = (number, self.duration_s);
                    return Err(SyntheticError::TooLate { effect, car, parameter, begins_s, duration_s });
                }
            }
            let of = |what: &str| format!("{what} of car {number}");
            in_range(&of("length"), car.length, 0.0, 30.0, "m")?;
            in_range(&of("initial gap"), car.initial_gap, 0.1, 1000.0, "m")?;
            in_range(&of("tau_a"), car.tau_a, 0.0, 10.0, "s")?;
            // A delay within one step would need a motion that is not yet known.
            let tau_p = car.tau_p + Effects(&car.effects).size(EffectKind::PerceptionDelay);
            if tau_p != 0.0 {
                in_range(&of("tau_p (unless it is 0)"), tau_p, h, 10.0, "s")?;
            }
            if let Some(gusts) = &car.gusts {
                in_range(&of("gusts"), gusts.sigma_mps2, 0.0, 5.0, "m/s²")?;
                in_range(&of("time constant of the gusts"), gusts.time_constant_s, 0.01, 1e3, "s")?;
            }
            in_range(&of("a_lb"), car.a_lb, -100.0, 0.0, "m/s²")?;
            in_range(&of("a_ub"), car.a_ub, 0.0, 100.0, "m/s²")?;
        }
        Ok(())
    }
}

fn in_range(what: &str, found: f64, low: f64, high: f64, unit: &str) -> Result<(), SyntheticError> {
    if (low..=high).contains(&found) {
        return Ok(());
    }
    Err(SyntheticError::OutOfRange {
        what: what.to_owned(),
        expected: format!("{low} to {high} {unit}").trim_end().to_owned(),
        found,
    })
}
