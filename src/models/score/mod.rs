//! Goodness of fit: distance of a simulated follower from the measured one (paper, Section 4.1; Punzo et al., 2021).

mod measure;

pub use measure::{MEASURES, Measure, SignalMeasures};

use crate::text::spelling::did_you_mean;
use crate::trajectory::FindingKind;
use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;

/// A measure of performance: a signal that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Spacing \[m\].
    Spacing = 0,
    /// Speed \[m/s\].
    Speed = 1,
    /// Acceleration \[m/s²\].
    Acceleration = 2,
}

/// Measured magnitudes below this (m, m/s, m/s²) have no relative error: the authors' program replaces such speeds by this value, and the
/// paper's convention leaves such samples out of RMSPE.
pub const STANDSTILL: f64 = 0.001;

/// Sums of a run for one signal, over the scored samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sums {
    /// Σ (simulated - measured)².
    pub error2: f64,
    /// Σ (simulated - denominator)².
    pub error2_floored: f64,
    pub simulated2: f64,
    /// Σ ((simulated - measured) / denominator)², over the samples that have a relative error.
    pub relative2: f64,
}

/// Sums of a measured signal that the measures need, over the scored samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Scored samples.
    pub count: f64,
    /// Σ denominator².
    pub measured2: f64,
    /// Samples that have a relative error.
    pub relative_count: f64,
    /// Smallest denominator.
    pub lowest: f64,
    /// Largest denominator.
    pub highest: f64,
}

/// A measured value as a denominator. With `floored` (the authors' treatment of the measured speed) small values are
/// replaced by [`STANDSTILL`].
pub fn denominator(measured: f64, floored: bool) -> f64 {
    if floored && measured.abs() <= STANDSTILL { STANDSTILL } else { measured }
}

/// True if the sample has a relative error.
pub fn is_relative(measured: f64, floored: bool) -> bool {
    floored || measured.abs() > STANDSTILL
}

impl Measured {
    /// Of the scored samples of a measured signal.
    pub fn of(measured: &[f64], floored: bool) -> Measured {
        let mut m = Measured {
            count: measured.len() as f64,
            measured2: 0.0,
            relative_count: 0.0,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
        };
        for &obs in measured {
            let denominator = denominator(obs, floored);
            m.measured2 += denominator * denominator;
            m.lowest = f64::min(m.lowest, denominator);
            m.highest = f64::max(m.highest, denominator);
            m.relative_count += f64::from(u8::from(is_relative(obs, floored)));
        }
        m
    }

    /// Root mean square of the denominators.
    fn rms(&self) -> f64 {
        (self.measured2 / self.count).sqrt()
    }

    /// Largest minus smallest denominator.
    fn range(&self) -> f64 {
        self.highest - self.lowest
    }

    /// The measures of a run with these sums.
    pub fn measures(&self, sums: &Sums) -> SignalMeasures {
        SignalMeasures::by(|measure| {
            let (count, sum) = ((measure.count)(self), sums.of(measure.sums));
            let below = match measure.sums {
                Accumulation::Theil => (sums.simulated2 / count).sqrt() + self.rms(),
                _ => (measure.magnitude)(self),
            };
            (sum / count).sqrt() / below
        })
    }
}

impl Sums {
    fn of(&self, kind: Accumulation) -> f64 {
        match kind {
            Accumulation::Squared | Accumulation::Theil => self.error2,
            Accumulation::Relative => self.relative2,
            Accumulation::Floored => self.error2_floored,
        }
    }
}

impl SignalMeasures {
    /// Compares two signals, sample by sample. With `floored` (the authors' treatment of the measured speed) small measured values are replaced by
    /// [`STANDSTILL`] in every denominator, and in `rmse_n` altogether. Panics if the lengths differ or are zero.
    pub fn compare(simulated: &[f64], measured: &[f64], floored: bool) -> SignalMeasures {
        assert!(!measured.is_empty() && simulated.len() == measured.len(), "signals of one length, not empty");
        let mut sums = Sums::default();
        for (&sim, &obs) in simulated.iter().zip(measured) {
            let square = |kind: Accumulation| {
                let term = kind.term(sim, obs, floored);
                term * term
            };
            sums.error2 += square(Accumulation::Squared);
            sums.error2_floored += square(Accumulation::Floored);
            sums.simulated2 += sim * sim;
            sums.relative2 += square(Accumulation::Relative);
        }
        Measured::of(measured, floored).measures(&sums)
    }
}

/// All measures of one run: spacing, speed, acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures(pub [SignalMeasures; 3]);

impl Measures {
    /// The seventeen names of the authors' table, in its order.
    pub const NAMES: [&'static str; 17] = [
        "rmse_s",
        "rmse_v",
        "rmse_a",
        "rmspe_s",
        "rmspe_v",
        "nrmse_s",
        "nrmse_v",
        "nrmse_a",
        "nrmse_sv",
        "nrmse_sva",
        "u_s",
        "u_v",
        "u_a",
        "u_sv",
        "u_sva",
        "rmse_sn_vn",
        "rmse_sn_vn_an",
    ];

    /// The values of [`Measures::NAMES`], in that order.
    pub fn values(&self) -> [f64; 17] {
        static TABLE: LazyLock<[GoodnessOfFit; 17]> =
            LazyLock::new(|| Measures::NAMES.map(|name| name.parse().expect("a goodness of fit")));
        TABLE.map(|gof| gof.of(self))
    }

    /// The mean of several, as a joint calibration minimises it; `None` without any.
    pub fn mean(several: &[Measures]) -> Option<Measures> {
        let mean = |of: &dyn Fn(&Measures) -> f64| several.iter().map(of).sum::<f64>() / several.len() as f64;
        let signal = |i: usize| SignalMeasures::by(|measure| mean(&|m| (measure.value)(&m.0[i])));
        (!several.is_empty()).then(|| Measures([signal(0), signal(1), signal(2)]))
    }

    pub fn signal(&self, signal: Signal) -> &SignalMeasures {
        &self.0[signal as usize]
    }
}

/// Objective of a calibration: a weighted sum of one measure over spacing, speed and acceleration.
///
/// Written as `nrmse-sva`, `rmse-s`, `u-sv`, `rmspe-v`, `rmse-sn-vn`, ... (`_` and `-` are the same);
/// weights other than 1 follow a colon, one per signal named: `nrmse-sva:1,1,0.5`. With `pooled-` in front, the squares of several drives
/// are summed before the root and the division: `pooled-rmse-s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodnessOfFit {
    measure: &'static Measure,
    /// Weights of spacing, speed, acceleration; 0 for a signal that is not compared (β_0, β_1, β_2 of Eq. 18).
    weights: [f64; 3],
    /// True if the sums of several drives are pooled; else their values are averaged.
    pooled: bool,
}

/// Begins the name of a goodness of fit that pools drives.
pub const POOLED: &str = "pooled-";

/// Terms per sample that a goodness of fit needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Accumulation {
    /// Σ (simulated - measured)².
    Squared,
    /// Σ ((simulated - measured) / denominator)².
    Relative,
    /// Σ (simulated - measured)² and Σ simulated².
    Theil,
    /// Σ (simulated - denominator)².
    Floored,
}

impl Accumulation {
    /// What is squared and summed of a sample.
    pub fn term(self, simulated: f64, observed: f64, floored: bool) -> f64 {
        match self {
            Accumulation::Squared | Accumulation::Theil => simulated - observed,
            Accumulation::Floored => simulated - denominator(observed, floored),
            Accumulation::Relative if is_relative(observed, floored) => {
                (simulated - observed) / denominator(observed, floored)
            }
            Accumulation::Relative => 0.0,
        }
    }

    /// Derivative of [`Accumulation::term`] by the simulated value.
    pub fn slope(self, observed: f64, floored: bool) -> f64 {
        match self {
            Accumulation::Squared | Accumulation::Theil | Accumulation::Floored => 1.0,
            Accumulation::Relative if is_relative(observed, floored) => 1.0 / denominator(observed, floored),
            Accumulation::Relative => 0.0,
        }
    }
}

/// Coefficients of a goodness of fit in the sums of a run, one entry per signal: Σ_i `weight` √(sum `per_count`), each term divided by √(Σ
/// simulated² `per_count`) + `rms_measured` for [`Accumulation::Theil`]. Evaluators compute scores with it in their own precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Norm {
    /// One over the number of samples in the sum; 0 for a signal that is not compared.
    pub per_count: [f64; 3],
    /// Weight of the signal over the magnitude that normalises it.
    pub weight: [f64; 3],
    /// Root mean square of the measured signal.
    pub rms_measured: [f64; 3],
}

impl GoodnessOfFit {
    /// Terms to sum.
    pub fn accumulation(&self) -> Accumulation {
        self.measure.sums
    }

    /// The formula of the value in the sums, given the measured spacing, speed and acceleration.
    pub fn norm(&self, measured: &[Measured; 3]) -> Norm {
        // 1 and not 0 for a signal that is not compared, to avoid a division of 0 by 0.
        let mut norm = Norm { per_count: [0.0; 3], weight: [0.0; 3], rms_measured: [1.0; 3] };
        for (i, m) in measured.iter().enumerate().filter(|(i, _)| self.weights[*i] != 0.0) {
            norm.per_count[i] = 1.0 / (self.measure.count)(m);
            norm.weight[i] = self.weights[i] / (self.measure.magnitude)(m);
            norm.rms_measured[i] = m.rms();
        }
        norm
    }

    /// Whether faults of this kind change its value: noise of the acceleration does only if the acceleration is compared.
    pub fn minds(&self, kind: FindingKind) -> bool {
        kind != FindingKind::Noisy || self.weights[Signal::Acceleration as usize] != 0.0
    }

    /// NRMSE(s,v,a) with unit weights, the objective of the paper.
    pub const NRMSE_SVA: GoodnessOfFit =
        GoodnessOfFit { measure: measure::NRMSE, weights: [1.0, 1.0, 1.0], pooled: false };

    /// True if the sums of several drives are pooled.
    pub fn is_pooled(&self) -> bool {
        self.pooled
    }

    /// Weight of the squared value of a drive among the pooled ones, given its measured spacing, speed and acceleration; `None` if the values
    /// are averaged.
    pub fn weight(&self, measured: &[Measured; 3]) -> Option<f64> {
        let k = self.weights.iter().position(|weight| *weight != 0.0).filter(|_| self.pooled)?;
        Some((self.measure.count)(&measured[k]) * (self.measure.magnitude)(&measured[k]).powi(2))
    }

    /// The measure of a single signal, whose value on several drives follows from those on each; Theil's denominator depends on the run.
    fn can_be_pooled(&self) -> bool {
        self.weights.iter().filter(|weight| **weight != 0.0).count() == 1 && self.measure.sums != Accumulation::Theil
    }

    /// Its value.
    pub fn of(&self, measures: &Measures) -> f64 {
        let weighted = self.weights.iter().zip(&measures.0).filter(|(w, _)| **w != 0.0);
        weighted.map(|(w, m)| w * (self.measure.value)(m)).sum()
    }
}

impl Default for GoodnessOfFit {
    fn default() -> Self {
        Self::NRMSE_SVA
    }
}

/// A goodness of fit that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "goodness of fit `{found}`: expected KIND-SIGNALS[:WEIGHTS] with KIND one of {}, SIGNALS some of s, v, a in this order, and \
     one weight above 0 per signal, such as nrmse-sva or nrmse-sva:1,1,0.5; or {}; or pooled- and one of rmse, rmspe, nrmse with one \
     signal, such as pooled-rmse-s{near}",
    kinds().join(", "),
    names().filter(|(measure, ..)| !measure.mark.is_empty()).map(|(.., name)| name).collect::<Vec<_>>().join(", ")
)]
pub struct UnknownGoodnessOfFit {
    found: String,
    near: String,
}

/// Every goodness of fit with unit weights: its measure, its signals and its name.
pub fn names() -> impl Iterator<Item = (&'static Measure, &'static str, String)> {
    let of = |measure: &&'static Measure| {
        let measure = *measure;
        measure.signals.iter().map(move |signals| (measure, *signals, measure.of(signals)))
    };
    MEASURES.iter().flat_map(of)
}

/// The names that signals may follow.
fn kinds() -> Vec<&'static str> {
    MEASURES.iter().filter(|measure| measure.mark.is_empty()).map(|measure| measure.name).collect()
}

impl FromStr for GoodnessOfFit {
    type Err = UnknownGoodnessOfFit;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let normal = text.trim().to_ascii_lowercase().replace('_', "-");
        let error = || {
            let known: Vec<String> = Measures::NAMES.iter().map(|name| name.replace('_', "-")).collect();
            let near = did_you_mean(&normal, known.iter().map(String::as_str));
            UnknownGoodnessOfFit { found: text.to_owned(), near }
        };
        let single = normal.strip_prefix(POOLED);
        let plain = single.unwrap_or(&normal);
        let (name, weights) = match plain.split_once(':') {
            Some((name, weights)) => (name, Some(weights)),
            None => (plain, None),
        };
        let (measure, signals, _) = names().find(|(.., known)| known == name).ok_or_else(error)?;
        let mut given = weights.map(|w| w.split(','));
        let mut gof = GoodnessOfFit { measure, weights: [0.0; 3], pooled: single.is_some() };
        for signal in signals.chars() {
            let weight = match &mut given {
                None => 1.0,
                Some(list) => {
                    let weight: Option<f64> = list.next().and_then(|w| w.trim().parse().ok());
                    weight.filter(|w| w.is_finite() && *w > 0.0).ok_or_else(error)?
                }
            };
            let position = "sva".find(signal).expect("the signals of a measure");
            gof.weights[position] = weight;
        }
        if given.is_some_and(|mut rest| rest.next().is_some()) || gof.pooled && !gof.can_be_pooled() {
            return Err(error());
        }
        Ok(gof)
    }
}

impl fmt::Display for GoodnessOfFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let used: Vec<(char, f64)> = "sva".chars().zip(self.weights).filter(|(_, w)| *w != 0.0).collect();
        let signals: String = used.iter().map(|(c, _)| *c).collect();
        f.write_str(if self.pooled { POOLED } else { "" })?;
        f.write_str(&self.measure.of(&signals))?;
        if used.iter().any(|(_, w)| *w != 1.0) {
            let weights: Vec<String> = used.iter().map(|(_, w)| w.to_string()).collect();
            write!(f, ":{}", weights.join(","))?;
        }
        Ok(())
    }
}
