//! Effects that a car may have and the base models lack, for diagnoses to find.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use strum::VariantArray;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Its name in files.
    pub name: &'static str,
    /// SI unit, `-` if dimensionless.
    pub unit: &'static str,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// A value that changes the drive clearly.
    pub medium: f64,
}

const fn parameter(name: &'static str, unit: &'static str, bounds: [f64; 2], medium: f64) -> EffectParameter {
    EffectParameter { name, unit, lower: bounds[0], upper: bounds[1], medium }
}

macro_rules! effects {
    ($($ident:ident, $meaning:literal, $weakest:expr, [$(($p:literal, $unit:literal, $bounds:expr, $medium:expr)),*];)*) => {
        /// Kind of an effect, by its name in files and on the command line.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[derive(strum::Display, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
        #[strum(const_into_str, serialize_all = "snake_case", parse_err_ty = EffectError, parse_err_fn = unknown)]
        pub enum EffectKind {
            $(#[doc = $meaning] $ident,)*
        }

        impl EffectKind {
            /// The effect in words.
            pub fn meaning(self) -> &'static str {
                match self { $(EffectKind::$ident => $meaning),* }
            }

            /// Its parameters; the first is its strength.
            pub fn parameters(self) -> &'static [EffectParameter] {
                match self { $(EffectKind::$ident => const { &[$(parameter($p, $unit, $bounds, $medium)),*] }),* }
            }

            /// The value of the first parameter at which the effect vanishes, or almost.
            pub(super) fn weakest(self) -> f64 {
                match self { $(EffectKind::$ident => $weakest),* }
            }
        }
    };
}

effects! {
    PerceptionDelay, "the controller sees spacing and speeds as they were tp ago", 0.0, [("tp", "s", [0.0, 3.0], 0.4)];
    ActuationLag, "the acceleration follows the command with time constant ta", 0.0, [("ta", "s", [0.0, 2.5], 0.5)];
    AsymLag, "as actuation_lag, but ta for thrust and tb for braking", 0.0, [("ta", "s", [0.0, 4.0], 0.7), ("tb", "s", [0.0, 4.0], 0.3)];
    SensorLowpass, "spacing and speed difference pass a first-order filter", 0.0, [("tf", "s", [0.0, 2.5], 0.5)];
    TimeOffset, "the preceding vehicle is perceived with the delay to, the own state without delay", 0.0, [("to", "s", [-1.0, 1.0], 0.3)];
    Grade, "this share of the grade force is not compensated", 0.0, [("gg", "-", [-0.3, 1.3], 0.4)];
    AeroDrag, "acceleration -cD v^2", 0.0, [("cD", "1/m", [-2e-3, 2e-3], 2.5e-4)];
    ConstDecel, "acceleration -c0 while moving", 0.0, [("c0", "m/s2", [-0.5, 0.5], 0.1)];
    GainMass, "the command is multiplied by 1 + m", 0.0, [("m", "-", [-0.5, 0.6], 0.25)];
    AccelCap, "the command is at most acap", 4.0, [("acap", "m/s2", [0.15, 4.0], 0.6)];
    DecelCap, "the command is at least -bcap", 6.0, [("bcap", "m/s2", [0.3, 6.0], 0.8)];
    PowerCap, "the command is at most P / v", 60.0, [("P", "W/kg", [2.0, 60.0], 9.0)];
    JerkLimit, "the command changes by at most J", 8.0, [("J", "m/s3", [0.1, 8.0], 0.6)];
    SpeedDepHeadway, "the desired spacing grows by q v^2", 0.0, [("q", "s2/m", [-0.03, 0.05], 0.005)];
    HeadwayModeChange, "the time headway is multiplied by 1 + r from t0 on, within 4 s", 0.0, [("r", "-", [-0.6, 1.5], 0.2), ("t0", "s", [0.0, 1e5], 300.0)];
    SetSpeedChange, "the set speed is vlim from t1 on, for dur", 30.0, [("vlim", "m/s", [1.0, 60.0], 16.0), ("t1", "s", [0.0, 1e5], 250.0), ("dur", "s", [1.0, 1e5], 60.0)];
    MultiAnticipation, "also reacts to the speed of the car before the preceding one: + k2 (v_l2 - v_l)", 0.0, [("k2", "1/s", [-1.0, 1.5], 0.2)];
    LeaderAccelFf, "+ ka times the acceleration of the preceding vehicle, smoothed over 1.1 s", 0.0, [("ka", "-", [-0.6, 1.3], 0.3)];
    DeadZone, "spacing errors below w are not perceived, larger ones are w smaller", 0.0, [("w", "m", [0.0, 8.0], 1.5)];
    IntegralAction, "+ ki times the integral of the spacing error, at most 0.6 m/s2", 0.0, [("ki", "1/s3", [-0.02, 0.06], 0.004)];
    RangeScale, "the spacing is seen 1 + cs times as large", 0.0, [("cs", "-", [-0.2, 0.2], 0.05)];
    RangeBias, "the spacing is seen b larger", 0.0, [("b", "m", [-5.0, 5.0], 0.5)];
    SpeedScale, "the own speed is seen 1 + cv times as large", 0.0, [("cv", "-", [-0.15, 0.15], 0.03)];
    QuantisedAccel, "the command comes in steps of qz", 0.0, [("qz", "m/s2", [0.0, 1.2], 0.3)];
    Periodic, "+ As sin(2 pi f t) + Ac cos(2 pi f t)", 0.0, [("As", "m/s2", [-2.0, 2.0], 0.1), ("Ac", "m/s2", [-2.0, 2.0], 0.1), ("f", "Hz", [0.005, 1.5], 0.1)];
}

/// An effect with its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct Effect {
    kind: EffectKind,
    /// In the order of [`EffectKind::parameters`].
    values: [f64; 3],
}

/// An effect in a file.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Written {
    name: String,
    parameters: BTreeMap<String, f64>,
}

/// Fault of the description of an effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    #[error("unknown effect {found:?}; expected one of {}", names())]
    Unknown { found: String },
    #[error("{effect} has no parameter {found:?}; it has {}", parameters(*.effect))]
    Parameter { effect: EffectKind, found: String },
    #[error("{name} of {effect} is given twice; leave one out")]
    Twice { effect: EffectKind, name: String },
    #[error("{name} of {effect}: expected {lower} to {upper}{}, found {found}", if *unit == "-" { String::new() } else { format!(" {unit}") })]
    Range { effect: EffectKind, name: &'static str, lower: f64, upper: f64, unit: &'static str, found: String },
}

fn names() -> String {
    EffectKind::VARIANTS.iter().map(EffectKind::into_str).collect::<Vec<_>>().join(", ")
}

fn parameters(kind: EffectKind) -> String {
    kind.parameters().iter().map(|p| p.name).collect::<Vec<_>>().join(", ")
}

fn unknown(found: &str) -> EffectError {
    EffectError::Unknown { found: found.to_owned() }
}

impl Effect {
    /// An effect of medium size.
    pub fn medium(kind: EffectKind) -> Effect {
        let mut values = [0.0; 3];
        for (value, parameter) in values.iter_mut().zip(kind.parameters()) {
            *value = parameter.medium;
        }
        Effect { kind, values }
    }

    /// With another value of a parameter.
    pub fn with(mut self, name: &str, value: f64) -> Result<Effect, EffectError> {
        let kind = self.kind;
        let Some(k) = kind.parameters().iter().position(|p| p.name == name) else {
            return Err(EffectError::Parameter { effect: kind, found: name.to_owned() });
        };
        let EffectParameter { name, unit, lower, upper, .. } = kind.parameters()[k];
        if !(lower..=upper).contains(&value) {
            return Err(EffectError::Range { effect: kind, name, lower, upper, unit, found: value.to_string() });
        }
        self.values[k] = value;
        Ok(self)
    }

    pub fn kind(&self) -> EffectKind {
        self.kind
    }

    /// The values of its parameters, in the order of [`EffectKind::parameters`].
    pub fn values(&self) -> &[f64] {
        &self.values[..self.kind.parameters().len()]
    }

    /// The parameter of its start, and the value \[s\]; `None` for a permanent effect.
    pub fn begins(&self) -> Option<(&'static str, f64)> {
        let parameters = self.kind.parameters().iter().zip(&self.values);
        let mut beginnings = parameters.filter(|(parameter, _)| matches!(parameter.name, "t0" | "t1"));
        beginnings.next().map(|(parameter, value)| (parameter.name, *value))
    }

    /// The same effect, weaker or stronger: at 0 the first parameter has its neutral value, at 1 the bound on the side of its present
    /// value. For two that belong together (ta and tb, As and Ac), which have the same bounds, this applies to the larger one, and the
    /// other keeps its ratio to it.
    pub(super) fn at_strength(&self, strength: f64) -> Effect {
        let together = matches!(self.kind, EffectKind::AsymLag | EffectKind::Periodic);
        let first = usize::from(together && self.values[1].abs() > self.values[0].abs());
        let EffectParameter { lower, upper, .. } = self.kind.parameters()[first];
        let weakest = self.kind.weakest();
        let strongest = if self.values[first] < weakest { lower } else { upper };
        // Caps act in proportion to the part of the range that they cut off, which is logarithmic.
        let value = if weakest > 0.0 && strongest > 0.0 {
            weakest * (strongest / weakest).powf(strength)
        } else {
            weakest + (strongest - weakest) * strength
        };
        let mut scaled = self.clone();
        if together && self.values[first] != 0.0 {
            let other = 1 - first;
            // Rounding must not move the value out of bounds.
            scaled.values[other] = (self.values[other] * (value / self.values[first])).clamp(lower, upper);
        }
        scaled.values[first] = value;
        scaled
    }
}

/// `NAME` or `NAME:parameter=value,parameter=value`; omitted values are of medium size.
impl std::str::FromStr for Effect {
    type Err = EffectError;

    fn from_str(text: &str) -> Result<Effect, EffectError> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let mut effect = Effect::medium(name.trim().parse()?);
        let mut given: Vec<&str> = Vec::new();
        for assignment in rest.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let (name, value) = assignment.split_once('=').unwrap_or((assignment, ""));
            let number = value.trim().parse().unwrap_or(f64::NAN);
            effect = effect.with(name.trim(), number).map_err(|error| match error {
                EffectError::Range { effect, name, lower, upper, unit, .. } => {
                    EffectError::Range { effect, name, lower, upper, unit, found: value.trim().to_owned() }
                }
                error => error,
            })?;
            if given.contains(&name.trim()) {
                return Err(EffectError::Twice { effect: effect.kind, name: name.trim().to_owned() });
            }
            given.push(name.trim());
        }
        Ok(effect)
    }
}

impl TryFrom<Written> for Effect {
    type Error = EffectError;

    fn try_from(written: Written) -> Result<Effect, EffectError> {
        let effect = Effect::medium(written.name.parse()?);
        written.parameters.iter().try_fold(effect, |effect, (name, value)| effect.with(name, *value))
    }
}

impl From<Effect> for Written {
    fn from(effect: Effect) -> Written {
        let names = effect.kind.parameters().iter().map(|p| p.name.to_owned());
        Written { name: effect.kind.to_string(), parameters: names.zip(effect.values).collect() }
    }
}

/// The effects of one car, by kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effects<'a>(pub(super) &'a [Effect]);

impl Effects<'_> {
    /// The parameters of an effect that the car has.
    pub(super) fn get(self, kind: EffectKind) -> Option<[f64; 3]> {
        self.0.iter().find(|effect| effect.kind == kind).map(|effect| effect.values)
    }

    /// The first parameter of an effect; 0 if the car does not have it.
    pub(super) fn size(self, kind: EffectKind) -> f64 {
        self.get(kind).map_or(0.0, |values| values[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_it_writes() {
        for kind in EffectKind::VARIANTS {
            let effect = Effect::medium(*kind);
            let json = serde_json::to_string(&effect).expect("finite numbers");
            assert_eq!(serde_json::from_str::<Effect>(&json).expect("as written"), effect);
            assert!(effect.values().iter().zip(kind.parameters()).all(|(v, p)| (p.lower..=p.upper).contains(v)));
        }
    }

    #[test]
    fn says_what_is_wrong() {
        let error = |text: &str| text.parse::<Effect>().expect_err("refused").to_string();
        assert!(error("grad").starts_with("unknown effect \"grad\"; expected one of perception_delay, "));
        assert_eq!(error("grade:g=1"), "grade has no parameter \"g\"; it has gg");
        assert_eq!(error("grade:gg=2"), "gg of grade: expected -0.3 to 1.3, found 2");
        assert_eq!(error("grade:gg=much"), "gg of grade: expected -0.3 to 1.3, found much");
        assert_eq!(error("actuation_lag:ta=9"), "ta of actuation_lag: expected 0 to 2.5 s, found 9");
        let given: Effect = "periodic: f=0.2, As=0.3".parse().expect("good");
        assert_eq!(given.values(), [0.3, 0.1, 0.2]);
    }

    #[test]
    fn strength_goes_from_nothing_to_the_bound() {
        let cap = Effect::medium(EffectKind::AccelCap);
        assert_eq!(cap.at_strength(0.0).values(), [4.0]);
        assert!((cap.at_strength(1.0).values()[0] - 0.15).abs() < 1e-12);
        let lag = Effect::medium(EffectKind::AsymLag).at_strength(0.25);
        assert!((lag.values()[0] - 1.0).abs() < 1e-12 && (lag.values()[1] - 3.0 / 7.0).abs() < 1e-12);
    }

    /// Such effects became infinite, NaN, or larger than a file can hold.
    #[test]
    fn a_pair_ends_where_one_of_it_reaches_its_bound() {
        let at = |text: &str, strength: f64| text.parse::<Effect>().expect("good").at_strength(strength).values;
        let near = |found: [f64; 3], expected: [f64; 2]| {
            let off = |k: usize| (found[k] - expected[k]).abs();
            assert!(off(0) < 1e-12 && off(1) < 1e-12, "{found:?}, {expected:?}");
        };
        near(at("asym_lag:ta=0,tb=0.8", 0.25), [0.0, 1.0]);
        near(at("asym_lag:ta=0.1,tb=0.5", 1.0), [0.8, 4.0]);
        near(at("asym_lag:ta=0,tb=0", 0.25), [1.0, 0.0]);
        near(at("periodic:As=0", 0.5), [0.0, 1.0]);
        near(at("periodic:As=0.1,Ac=-0.2", 0.5), [0.5, -1.0]);
        for text in ["asym_lag:ta=0.1,tb=0.5", "asym_lag:ta=0.7,tb=0.7", "periodic:As=-0.03,Ac=0.1", "periodic"] {
            let strongest = text.parse::<Effect>().expect("good").at_strength(1.0);
            let json = serde_json::to_string(&strongest).expect("finite numbers");
            assert_eq!(serde_json::from_str::<Effect>(&json).expect("within its bounds"), strongest);
        }
    }
}
