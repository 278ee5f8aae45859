//! Breakdown of the error of a free simulation by driving regime.

use super::covariates::Covariates;
use std::collections::BTreeMap;

/// Largest speed of a standing car \[m/s\].
const STANDING: f64 = 0.5;
/// Smallest acceleration or deceleration that counts as accelerating or braking \[m/s²\].
const HARD: f64 = 0.3;
/// Smallest speed difference that counts as opening or closing in \[m/s\].
const CHANGING: f64 = 0.5;

/// The driving regime: the first that applies, in the order of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Regime {
    /// Speed below 0.5 m/s.
    Standstill,
    /// Acceleration above 0.3 m/s².
    Accelerating,
    /// Deceleration above 0.3 m/s².
    Braking,
    /// The gap closes by more than 0.5 m/s.
    #[strum(serialize = "closing in")]
    ClosingIn,
    /// The gap opens by more than 0.5 m/s.
    Opening,
    /// The rest.
    Cruising,
}

impl Regime {
    /// The regime of a sample.
    #[must_use]
    pub fn of(scene: &Covariates, i: usize) -> Regime {
        let (a, dv) = (scene.a[i], scene.dv[i]);
        match () {
            () if scene.v[i] < STANDING => Regime::Standstill,
            () if a > HARD => Regime::Accelerating,
            () if a < -HARD => Regime::Braking,
            () if dv < -CHANGING => Regime::ClosingIn,
            () if dv > CHANGING => Regime::Opening,
            () => Regime::Cruising,
        }
    }
}

/// A free simulation of a drive: simulated minus measured spacing, speed and acceleration, from sample `first` on.
#[derive(Debug, Clone, Copy)]
pub struct Errors<'a> {
    /// The quantities at each sample.
    pub scene: &'a Covariates,
    /// First compared sample.
    pub first: usize,
    /// Errors of s \[m\], v \[m/s\], a \[m/s²\], one per sample from `first` on; NaN where they do not count.
    pub values: [&'a [f64]; 3],
}

/// The error while the car does one thing.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Share {
    /// What it is doing.
    pub name: String,
    /// Share of the time.
    pub time: f64,
    /// Share of the sum of squared errors of s, v, a.
    pub error: [f64; 3],
}

/// The error of a free simulation.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Budget {
    /// Root mean square of s \[m\], v \[m/s\], a \[m/s²\].
    pub rms: [f64; 3],
    /// Mean error of s \[m\], v \[m/s\], a \[m/s²\].
    pub bias: [f64; 3],
    /// The regimes, in the order of [`Regime`]; the shares add up to one.
    pub regime: Vec<Share>,
}

/// The budget of several drives together; `None` without samples.
#[must_use]
pub fn budget(runs: &[Errors]) -> Option<Budget> {
    let mut of: BTreeMap<Regime, (f64, [f64; 3])> = BTreeMap::new();
    let (mut sums, mut squares, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    for run in runs {
        for i in (0..run.values[0].len()).filter(|&i| run.values.iter().all(|values| !values[i].is_nan())) {
            let (time, own) = of.entry(Regime::of(run.scene, run.first + i)).or_default();
            *time += 1.0;
            count += 1.0;
            for (k, values) in run.values.iter().enumerate() {
                let square = values[i].powi(2);
                own[k] += square;
                squares[k] += square;
                sums[k] += values[i];
            }
        }
    }
    let share = |k: usize, sum: f64| if squares[k] > 0.0 { sum / squares[k] } else { 0.0 };
    let entry = |(regime, (time, own)): (Regime, (f64, [f64; 3]))| Share {
        name: regime.into_str().to_owned(),
        time: time / count,
        error: std::array::from_fn(|k| share(k, own[k])),
    };
    (count > 0.0).then(|| Budget {
        rms: squares.map(|sum| (sum / count).sqrt()),
        bias: sums.map(|sum| sum / count),
        regime: of.into_iter().map(entry).collect(),
    })
}

impl Budget {
    /// Of the regimes, the one in which a signal's share of the error most exceeds the share of the time.
    #[must_use]
    pub fn worst_regime(&self, signal: usize) -> Option<&Share> {
        let excess = |share: &Share| share.error[signal] - share.time;
        self.regime.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)))
    }
}
