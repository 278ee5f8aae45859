//! Findings of a check of the data.

use crate::text::option::{FROM, Opt, TO};
use serde::Serialize;
use std::fmt;

/// The kind of a fault, by its name in result files.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, strum::IntoStaticStr, strum::EnumIter,
)]
#[strum(const_into_str, serialize_all = "snake_case")]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// One car's speed is off by a constant factor.
    SpeedScale,
    /// The gap is off by a constant length.
    GapOffset,
    /// Two signals do not share a clock.
    ClockOffset,
    /// The speeds of the two cars are exchanged.
    Exchanged,
    /// Gap and speeds differ by a factor: confused units.
    Unit,
    /// Values are missing, held or filled in.
    Dropout,
    /// Single values are far off those around them.
    Spike,
    /// The signal was sampled at a lower rate than the file's.
    Resampled,
    /// The signal has less noise than a sensor has.
    Smoothed,
    /// The steps of the signal are as large as its features.
    Quantised,
    /// Accelerations are mostly noise.
    Noisy,
    /// A speed that no road vehicle reaches.
    TooFast,
    /// The time is a time of day instead of seconds.
    TimeUnit,
    /// Gap and speeds contradict each other in a way that no constant explains.
    Inconsistent,
}

impl FindingKind {
    /// Effect of a fault of this kind on calibrated parameters.
    pub fn effect(self) -> &'static str {
        match self {
            FindingKind::SpeedScale => "t_h, v_0 and d_0 compensate for a false drift",
            FindingKind::GapOffset => "d_0 is off by the same amount",
            FindingKind::ClockOffset => "a_max, a_min and delays compensate for it",
            FindingKind::Exchanged | FindingKind::Unit | FindingKind::TooFast | FindingKind::TimeUnit => {
                "all parameters are meaningless"
            }
            FindingKind::Dropout => "a_max and a_min follow values that never occurred",
            FindingKind::Spike => "t_h, a_max and d_0 follow values that never occurred",
            FindingKind::Resampled => "a_max, a_min and delays reproduce the sampling steps",
            FindingKind::Smoothed => "fast reactions are cut off, and lags look longer",
            FindingKind::Quantised => "a_max, a_min and scores with the acceleration follow the steps of the sensor",
            FindingKind::Noisy => {
                "a score with the acceleration, such as nrmse-sva, judges the sensor and not the model"
            }
            FindingKind::Inconsistent => "t_h, d_0 and a_max follow impossible motion",
        }
    }
}

impl FindingKind {
    /// How to correct or avoid a fault of this kind, for the documentation.
    pub fn remedy(self) -> &'static str {
        match self {
            FindingKind::SpeedScale | FindingKind::ClockOffset => "`--correct`, where the data tell which signal it is",
            FindingKind::GapOffset | FindingKind::Dropout => "`--correct`",
            FindingKind::Exchanged => "`--correct` in a file of two cars, else `--columns`",
            FindingKind::Unit | FindingKind::TooFast | FindingKind::TimeUnit => "`--columns` with the unit",
            FindingKind::Spike => "`--correct`, or `--reconcile speeds` for a gap",
            FindingKind::Resampled => "`--correct`, where values are held",
            FindingKind::Smoothed => "none: take the data before the filter",
            FindingKind::Quantised => "`--smooth`",
            FindingKind::Noisy => "`--gof nrmse-s`, `--smooth`, `--resample`",
            FindingKind::Inconsistent => "`--from` and `--to`, which leave a jump out",
        }
    }

    /// Number of 1,000 sound drives in which a fault of this kind is found: measured by `tests/input/false_alarms.rs` with
    /// LEADLAG_FULL=1.
    pub fn false_alarms(self) -> f64 {
        match self {
            FindingKind::SpeedScale | FindingKind::ClockOffset | FindingKind::Resampled => 0.34,
            _ => 0.0,
        }
    }
}

/// Whose signal it is, as written in result files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Who {
    /// The car ahead.
    Leader,
    /// The car behind.
    Follower,
    /// One of the two; the data do not show which.
    #[strum(serialize = "leader or follower")]
    Either,
    /// Both alike.
    Both,
}

impl Serialize for Who {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.into_str())
    }
}

/// An option that corrects or avoids a fault: its id, which each front end spells in its own way, and its value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Remedy {
    /// The option, such as `correct` or `to`.
    pub option: Opt,
    /// Its value, if it has one and the data show it.
    pub value: Option<String>,
}

impl Remedy {
    /// An option without a value.
    pub(super) fn of(option: Opt) -> Remedy {
        Remedy { option, value: None }
    }

    /// The id of the option and its value, in files alike whatever the front end.
    pub fn named(&self) -> String {
        let value = self.value.as_ref().map_or(String::new(), |value| format!(" {value}"));
        self.option.id() + &value
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.option)?;
        self.value.as_ref().map_or(Ok(()), |value| write!(f, " {value}"))
    }
}

/// One fault of the data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    #[serde(rename = "name")]
    pub kind: FindingKind,
    /// The car of the signal.
    pub car: Who,
    /// `speed`, `gap` or `time`.
    pub signal: &'static str,
    /// Its size, in `unit`: measured minus true for offsets, factor minus 1 for scales, lateness for clocks.
    pub value: f64,
    /// SI unit, `-` if dimensionless.
    pub unit: &'static str,
    /// 95 % interval of the size, if any.
    pub interval: Option<[f64; 2]>,
    /// Affected stretches of the file's time \[s\]; empty: the whole file.
    #[serde(rename = "when_s")]
    pub when: Vec<[f64; 2]>,
    /// Line of the file at which it begins, counted from 1; none if it affects the whole file.
    pub line: Option<u64>,
    /// Whether it changes the calibration, so that every command has to report it.
    pub matters: bool,
    /// Remedies; empty if there is none.
    pub remedies: Vec<Remedy>,
    /// The correction, if it was requested.
    pub correction: Option<String>,
    /// In one sentence, for people.
    pub sentence: String,
}

impl Finding {
    /// A fault of the whole file that does not matter and has no remedy, by default.
    pub(super) fn new(kind: FindingKind, car: Who, signal: &'static str, value: f64, unit: &'static str) -> Finding {
        let (interval, when, remedies) = (None, Vec::new(), Vec::new());
        let (line, matters, correction, sentence) = (None, false, None, String::new());
        Finding { kind, car, signal, value, unit, interval, when, line, matters, remedies, correction, sentence }
    }

    /// The sentence with the effect of the fault on parameters, and with the remedy or the correction.
    pub fn message(&self) -> String {
        let effect = if self.matters { format!("; {}", self.kind.effect()) } else { String::new() };
        match &self.correction {
            Some(correction) => format!("{}; {correction}", self.sentence),
            None if self.remedies.is_empty() => format!("{}{effect}", self.sentence),
            None => format!("{}{effect}; {}", self.sentence, self.help()),
        }
    }

    fn help(&self) -> String {
        let is_window = |remedy: &Remedy| [FROM, TO].contains(&remedy.option);
        let listed: Vec<String> = self.remedies.iter().map(ToString::to_string).collect();
        if self.remedies.iter().any(is_window) {
            return format!("{} is the longest stretch without", listed.join(" "));
        }
        let verb = if listed.len() > 1 { "help" } else { "helps" };
        format!("{} {verb}", listed.join(" or "))
    }
}

/// 95 % of a normal distribution lie within this many standard errors.
pub(super) const Z_95: f64 = 1.959_964;

/// The interval of an estimate with a standard error.
pub(super) fn interval(value: f64, error: f64) -> Option<[f64; 2]> {
    error.is_finite().then_some([value - Z_95 * error, value + Z_95 * error])
}
