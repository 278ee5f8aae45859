//! The drive of the demo: five cars on a hilly road, an effect hidden in one of them, files as from a test track.

use super::super::synth;
use super::Args;
use crate::synthetic::{Base, Effect, EffectKind, Profile, Scenario, drawn, run};
use std::str::FromStr;

/// The hidden effect, as on the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    effect: Option<Effect>,
    /// Names of the given parameters; the demo chooses the others.
    given: Vec<String>,
}

impl FromStr for Hidden {
    type Err = String;

    fn from_str(text: &str) -> Result<Hidden, String> {
        if text == "none" {
            return Ok(Hidden { effect: None, given: Vec::new() });
        }
        let values = text.split_once(':').map_or("", |(_, values)| values);
        let names = values.split(',').map(|value| value.split('=').next().unwrap_or_default().trim().to_owned());
        Ok(Hidden { effect: Some(synth::effect(text)?), given: names.collect() })
    }
}

impl Hidden {
    /// The effect; one that begins at a certain time does so within the training part of the drive.
    pub fn effect(&self, duration: f64) -> Option<Effect> {
        let times: &[(&str, f64)] = match self.effect.as_ref()?.kind() {
            EffectKind::HeadwayModeChange => &[("t0", 0.4)],
            EffectKind::SetSpeedChange => &[("t1", 0.35), ("dur", 0.15)],
            _ => &[],
        };
        let mut effect = self.effect.clone()?;
        for (name, share) in times.iter().filter(|(name, _)| !self.given.iter().any(|given| given == name)) {
            effect = effect.with(name, (share * duration).round()).expect("within a drive is within the bounds");
        }
        Some(effect)
    }

    /// The car with the effect: the one behind the platoon leader, unless the effect needs two cars ahead.
    pub fn follower(&self) -> usize {
        let kind = self.effect.as_ref().map(Effect::kind);
        if kind == Some(EffectKind::MultiAnticipation) { 2 } else { 1 }
    }
}

/// Writes platoon.csv (layout astazero-rebuilt), Slope.csv (the road) and truth.json.
pub fn write(args: &Args, follower: usize) -> anyhow::Result<()> {
    let mut scenario =
        Scenario { seed: args.seed, duration_s: args.duration, profile: Profile::Cruise, ..Scenario::default() };
    let car = &mut scenario.followers[follower - 1];
    *car = drawn(Base::Idm, args.seed, follower);
    car.effects.extend(args.hide.effect(args.duration));
    synth::write(&run(&scenario)?, &args.out, false).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_begins_at_a_time_begins_within_the_drive_unless_told_otherwise() {
        let values = |text: &str| {
            let hidden: Hidden = text.parse().expect("good");
            hidden.effect(300.0).map(|effect| effect.values().to_vec())
        };
        assert_eq!(values("none"), None);
        assert_eq!(values("headway_mode_change"), Some(vec![0.2, 120.0]));
        assert_eq!(values("headway_mode_change:t0=90,r=0.3"), Some(vec![0.3, 90.0]));
        assert_eq!(values("set_speed_change"), Some(vec![16.0, 105.0, 45.0]));
        assert_eq!(values("grade: gg=0.5"), Some(vec![0.5]));
        assert!("gradient".parse::<Hidden>().expect_err("unknown").contains("expected one of"));
        let follower = |text: &str| text.parse::<Hidden>().expect("good").follower();
        assert_eq!((follower("multi_anticipation"), follower("none"), follower("grade")), (2, 1, 1));
    }
}
