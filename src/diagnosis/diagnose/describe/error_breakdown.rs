//! Breakdown of the error of a free simulation: by signal, regime, frequency, speed, place and time.

use super::covariates::Covariates;
use crate::diagnose::data::fourier;

/// Largest speed of a standing car \[m/s\].
const STANDING: f64 = 0.5;
/// Smallest acceleration or deceleration that counts as accelerating or braking \[m/s²\].
const HARD: f64 = 0.3;
/// Smallest speed difference that counts as opening or closing in \[m/s\].
const CHANGING: f64 = 0.5;
/// Edges between the frequency bands \[Hz\].
const BANDS: [f64; 3] = [0.01, 0.05, 0.2];
/// Width of the classes of speed \[m/s\].
const SPEED_CLASS: f64 = 5.0;
const PLACE_CLASS: f64 = 250.0;
const TIME_CLASS: f64 = 60.0;

/// What the car is doing: the first that applies, in the order of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
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
    /// Errors of s \[m\], v \[m/s\], a \[m/s²\], one per sample from `first` on.
    pub values: [&'a [f64]; 3],
}

/// One class of a breakdown.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Share {
    /// Name of the class.
    pub name: String,
    /// Share of the time; `None` for frequencies.
    pub time: Option<f64>,
    /// Share of the sum of squared errors of s, v, a.
    pub error: [f64; 3],
}

/// The error of a free simulation, broken down in each way. The shares of each breakdown sum to one.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Budget {
    /// Root mean square of s \[m\], v \[m/s\], a \[m/s²\].
    pub rms: [f64; 3],
    /// Mean error of s \[m\], v \[m/s\], a \[m/s²\].
    pub bias: [f64; 3],
    /// By what the car is doing.
    pub regime: Vec<Share>,
    /// By frequency.
    pub frequency: Vec<Share>,
    /// By speed.
    pub speed: Vec<Share>,
    /// By place on the road; empty if it is unknown.
    pub place: Vec<Share>,
    /// By time, separately for each drive.
    pub time: Vec<Share>,
}

/// The budget of several drives together; `None` without samples.
#[must_use]
pub fn budget(runs: &[Errors]) -> Option<Budget> {
    let count: usize = runs.iter().map(|run| run.values[0].len()).sum();
    if count == 0 {
        return None;
    }
    let over = |signal: usize, f: &dyn Fn(f64) -> f64| {
        runs.iter().flat_map(|run| run.values[signal]).map(|e| f(*e)).sum::<f64>() / count as f64
    };
    let by = |class: &ClassOf| divide(runs, class);
    let classes = |value: f64, width: f64, unit: &str| {
        let k = (value.max(0.0) / width).floor();
        (k as usize, format!("{} to {} {unit}", k * width, (k + 1.0) * width))
    };
    let mut place = by(&|run, i| run.scene.place.as_ref().map(|x| classes(x[i], PLACE_CLASS, "m")));
    if runs.iter().any(|run| run.scene.place.is_none()) {
        place.clear();
    }
    let many = 1_000_000;
    Some(Budget {
        rms: [0, 1, 2].map(|k| over(k, &|e| e * e).sqrt()),
        bias: [0, 1, 2].map(|k| over(k, &|e| e)),
        regime: by(&|run, i| {
            let regime = Regime::of(run.scene, i);
            Some((regime as usize, regime.into_str().to_owned()))
        }),
        frequency: frequencies(runs),
        speed: by(&|run, i| Some(classes(run.scene.v[i], SPEED_CLASS, "m/s"))),
        place,
        time: by(&|run, i| {
            let number = runs.iter().position(|other| std::ptr::eq(other.scene, run.scene)).unwrap_or(0);
            // A sample on the edge of two classes belongs to the time before it.
            let since = run.scene.t[i] - run.scene.t[0] - 0.5 * run.scene.dt;
            let (k, _) = classes(since, TIME_CLASS, "s");
            let from = run.scene.t[0] + k as f64 * TIME_CLASS;
            let of = if runs.len() > 1 { format!(" of {}", run.scene.label) } else { String::new() };
            Some((number * many + k, format!("{from:.0} to {:.0} s{of}", from + TIME_CLASS)))
        }),
    })
}

/// Number and name of the class of a sample.
type ClassOf<'a> = dyn Fn(&Errors, usize) -> Option<(usize, String)> + 'a;

/// Shares of the classes that occur, in the order of their numbers.
fn divide(runs: &[Errors], class: &ClassOf) -> Vec<Share> {
    let mut classes = std::collections::BTreeMap::new();
    let (mut all, mut count) = ([0.0; 3], 0.0);
    for run in runs {
        for k in 0..run.values[0].len() {
            let Some((number, name)) = class(run, run.first + k) else { continue };
            let entry = classes.entry(number).or_insert_with(|| (name, 0.0, [0.0; 3]));
            entry.1 += 1.0;
            count += 1.0;
            for (signal, values) in run.values.iter().enumerate() {
                let square = values[k].powi(2);
                entry.2[signal] += square;
                all[signal] += square;
            }
        }
    }
    let share = |sum: f64, all: f64| if all > 0.0 { sum / all } else { 0.0 };
    classes
        .into_values()
        .map(|(name, n, sums)| Share { name, time: Some(n / count), error: [0, 1, 2].map(|k| share(sums[k], all[k])) })
        .collect()
}

/// Shares of the periodogram, summed over the drives; the mean belongs to the lowest band.
fn frequencies(runs: &[Errors]) -> Vec<Share> {
    let mut sums = [[0.0; 3]; BANDS.len() + 1];
    for run in runs {
        for (signal, values) in run.values.iter().enumerate() {
            let power = fourier::power(values);
            let cells = 2 * (power.len().max(2) - 1);
            for (k, p) in power.iter().enumerate() {
                let f = k as f64 / (cells as f64 * run.scene.dt);
                let band = BANDS.iter().position(|edge| f < *edge).unwrap_or(BANDS.len());
                // Every frequency but the lowest and the highest counts twice; Parseval's sum is `cells` times the squares.
                let twice = if k == 0 || k + 1 == power.len() { 1.0 } else { 2.0 };
                sums[band][signal] += twice * p / cells as f64;
            }
        }
    }
    let all = [0, 1, 2].map(|signal| sums.iter().map(|band| band[signal]).sum::<f64>());
    let name = |band: usize| match band {
        0 => format!("below {} Hz", BANDS[0]),
        band if band == BANDS.len() => format!("above {} Hz", BANDS[BANDS.len() - 1]),
        band => format!("{} to {} Hz", BANDS[band - 1], BANDS[band]),
    };
    let share = |band: usize, k: usize| if all[k] > 0.0 { sums[band][k] / all[k] } else { 0.0 };
    (0..sums.len())
        .map(|band| Share { name: name(band), time: None, error: [0, 1, 2].map(|k| share(band, k)) })
        .collect()
}

impl Budget {
    /// Of the regimes, the one in which a signal's share of the error most exceeds the share of the time.
    #[must_use]
    pub fn worst_regime(&self, signal: usize) -> Option<&Share> {
        let excess = |share: &Share| share.error[signal] - share.time.unwrap_or(0.0);
        self.regime.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)))
    }
}
