//! What a check of the data may find.

/// The kind of a fault, under the name that result files have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum FindingKind {
    /// One car's speed is a constant factor off.
    SpeedScale,
    /// The gap is a constant length off.
    GapOffset,
    /// Two signals do not share a clock.
    ClockOffset,
    /// Values are missing, held or filled in.
    Dropout,
    /// The signal was sampled at a lower rate than the file's.
    Resampled,
    /// The signal has less noise than a sensor has.
    Smoothed,
    /// Gap and speeds contradict each other in a way that no constant explains.
    Inconsistent,
}

/// Whose signal it is, as written in result files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Who {
    /// The car ahead.
    Leader,
    /// The car behind.
    Follower,
    /// One of the two; the data cannot tell which.
    #[strum(serialize = "leader or follower")]
    Either,
    /// Both alike.
    Both,
}

/// One fault of the data.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What it is.
    pub kind: FindingKind,
    /// Whose signal.
    pub car: Who,
    /// `speed` or `gap`.
    pub signal: &'static str,
    /// Its size, in `unit`: measured minus true for offsets, factor minus 1 for scales, lateness for clocks.
    pub value: f64,
    /// SI unit, `-` if dimensionless.
    pub unit: &'static str,
    /// 95 % interval of the size, where there is one.
    pub interval: Option<[f64; 2]>,
    /// Stretches of the file's time that are concerned \[s\]; empty: all of it.
    pub when: Vec<[f64; 2]>,
    /// In one sentence, for people.
    pub sentence: String,
}

/// 95 % of a normal distribution lie within this many standard errors.
pub(super) const Z_95: f64 = 1.959_964;

/// The interval of an estimate with a standard error.
pub(super) fn interval(value: f64, error: f64) -> Option<[f64; 2]> {
    error.is_finite().then_some([value - Z_95 * error, value + Z_95 * error])
}
