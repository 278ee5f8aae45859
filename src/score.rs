//! Goodness of fit: how far a simulated follower is from the measured one (paper, Section 4.1; Punzo et al., 2021).

use std::fmt;
use std::str::FromStr;

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

/// Measured magnitudes below this (m, m/s, m/s²) make no relative error: the authors' program replaces such speeds
/// by this value, the paper's convention leaves such samples out of RMSPE.
pub const STANDSTILL: f64 = 0.001;

/// The measures of one signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalMeasures {
    /// Root mean square error, in the signal's unit.
    pub rmse: f64,
    /// RMSE over the root mean square of the measured signal (Eq. 18).
    pub nrmse: f64,
    /// Root mean square of the relative error; NaN where no measured sample is above [`STANDSTILL`].
    pub rmspe: f64,
    /// Theil's inequality coefficient.
    pub u: f64,
    /// RMSE over the range (largest minus smallest) of the measured signal.
    pub rmse_n: f64,
}

impl SignalMeasures {
    /// Compares two signals, sample by sample. With `floored` (the authors' treatment of the measured speed) small
    /// measured values are replaced by [`STANDSTILL`] in every denominator, and in `rmse_n` altogether.
    ///
    /// # Panics
    /// If the lengths differ or are zero.
    #[must_use]
    pub fn compare(simulated: &[f64], measured: &[f64], floored: bool) -> SignalMeasures {
        assert!(!measured.is_empty() && simulated.len() == measured.len(), "signals of one length, not empty");
        let count = measured.len() as f64;
        let (mut error2, mut error2_floored, mut measured2, mut simulated2) = (0.0, 0.0, 0.0, 0.0);
        let (mut relative2, mut relative_count) = (0.0, 0.0);
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for (&sim, &obs) in simulated.iter().zip(measured) {
            let small = obs.abs() <= STANDSTILL;
            let denominator = if floored && small { STANDSTILL } else { obs };
            let error = sim - obs;
            error2 += error * error;
            let error_floored = sim - denominator;
            error2_floored += error_floored * error_floored;
            measured2 += denominator * denominator;
            simulated2 += sim * sim;
            lowest = f64::min(lowest, denominator);
            highest = f64::max(highest, denominator);
            if floored || !small {
                let relative = error / denominator;
                relative2 += relative * relative;
                relative_count += 1.0;
            }
        }
        let rmse = (error2 / count).sqrt();
        let rms_measured = (measured2 / count).sqrt();
        let rms_simulated = (simulated2 / count).sqrt();
        SignalMeasures {
            rmse,
            nrmse: rmse / rms_measured,
            rmspe: (relative2 / relative_count).sqrt(),
            u: rmse / (rms_simulated + rms_measured),
            rmse_n: (error2_floored / count).sqrt() / (highest - lowest),
        }
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
    #[must_use]
    pub fn values(&self) -> [f64; 17] {
        let [s, v, a] = &self.0;
        [
            s.rmse,
            v.rmse,
            a.rmse,
            s.rmspe,
            v.rmspe,
            s.nrmse,
            v.nrmse,
            a.nrmse,
            s.nrmse + v.nrmse,
            s.nrmse + v.nrmse + a.nrmse,
            s.u,
            v.u,
            a.u,
            s.u + v.u,
            s.u + v.u + a.u,
            s.rmse_n + v.rmse_n,
            s.rmse_n + v.rmse_n + a.rmse_n,
        ]
    }

    /// The mean of several, as a joint calibration minimises it; `None` of none.
    #[must_use]
    pub fn mean(several: &[Measures]) -> Option<Measures> {
        let count = several.len() as f64;
        let mean = |of: &dyn Fn(&Measures) -> f64| several.iter().map(of).sum::<f64>() / count;
        let signal = |i: usize| SignalMeasures {
            rmse: mean(&|m| m.0[i].rmse),
            nrmse: mean(&|m| m.0[i].nrmse),
            rmspe: mean(&|m| m.0[i].rmspe),
            u: mean(&|m| m.0[i].u),
            rmse_n: mean(&|m| m.0[i].rmse_n),
        };
        (!several.is_empty()).then(|| Measures([signal(0), signal(1), signal(2)]))
    }

    /// The measures of one signal.
    #[must_use]
    pub fn signal(&self, signal: Signal) -> &SignalMeasures {
        &self.0[signal as usize]
    }
}

/// The family of a goodness-of-fit function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Rmse,
    Nrmse,
    Rmspe,
    TheilU,
    RmseN,
}

/// What a calibration minimises: a weighted sum of one measure over spacing, speed and acceleration.
///
/// Written as `nrmse-sva`, `rmse-s`, `u-sv`, `rmspe-v`, `rmse-sn-vn`, ... (`_` and `-` are the same);
/// weights other than 1 follow a colon, one per signal named: `nrmse-sva:1,1,0.5`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GoodnessOfFit {
    kind: Kind,
    /// Weights of spacing, speed, acceleration; 0 for a signal that is not compared (β_0, β_1, β_2 of Eq. 18).
    weights: [f64; 3],
}

impl GoodnessOfFit {
    /// NRMSE(s,v,a) with unit weights, the objective of the paper.
    pub const NRMSE_SVA: GoodnessOfFit = GoodnessOfFit { kind: Kind::Nrmse, weights: [1.0, 1.0, 1.0] };

    /// Its value.
    #[must_use]
    pub fn of(&self, measures: &Measures) -> f64 {
        let value = |m: &SignalMeasures| match self.kind {
            Kind::Rmse => m.rmse,
            Kind::Nrmse => m.nrmse,
            Kind::Rmspe => m.rmspe,
            Kind::TheilU => m.u,
            Kind::RmseN => m.rmse_n,
        };
        let weighted = self.weights.iter().zip(&measures.0).filter(|(w, _)| **w != 0.0);
        weighted.map(|(w, m)| w * value(m)).sum()
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
    "goodness of fit `{found}`: expected KIND-SIGNALS[:WEIGHTS] with KIND one of rmse, nrmse, rmspe, u, SIGNALS some of \
     s, v, a in this order, and one weight above 0 per signal, such as nrmse-sva or nrmse-sva:1,1,0.5; \
     or rmse-sn-vn, rmse-sn-vn-an"
)]
pub struct UnknownGoodnessOfFit {
    found: String,
}

impl FromStr for GoodnessOfFit {
    type Err = UnknownGoodnessOfFit;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let error = || UnknownGoodnessOfFit { found: text.to_owned() };
        let normal = text.trim().to_ascii_lowercase().replace('_', "-");
        let (name, weights) = match normal.split_once(':') {
            Some((name, weights)) => (name, Some(weights)),
            None => (normal.as_str(), None),
        };
        let (kind, signals) = match name {
            "rmse-sn-vn" => (Kind::RmseN, "sv"),
            "rmse-sn-vn-an" => (Kind::RmseN, "sva"),
            _ => match name.split_once('-').ok_or_else(error)? {
                ("rmse", signals) => (Kind::Rmse, signals),
                ("nrmse", signals) => (Kind::Nrmse, signals),
                ("rmspe", signals) => (Kind::Rmspe, signals),
                ("u", signals) => (Kind::TheilU, signals),
                _ => return Err(error()),
            },
        };
        if !["s", "v", "a", "sv", "sa", "va", "sva"].contains(&signals) {
            return Err(error());
        }
        let mut given = weights.map(|w| w.split(','));
        let mut gof = GoodnessOfFit { kind, weights: [0.0; 3] };
        for signal in signals.chars() {
            let weight = match &mut given {
                None => 1.0,
                Some(list) => {
                    let weight: Option<f64> = list.next().and_then(|w| w.trim().parse().ok());
                    weight.filter(|w| w.is_finite() && *w > 0.0).ok_or_else(error)?
                }
            };
            let position = "sva".find(signal).expect("checked above");
            gof.weights[position] = weight;
        }
        if given.is_some_and(|mut rest| rest.next().is_some()) {
            return Err(error());
        }
        Ok(gof)
    }
}

impl fmt::Display for GoodnessOfFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let used: Vec<(char, f64)> = "sva".chars().zip(self.weights).filter(|(_, w)| *w != 0.0).collect();
        let signals: String = used.iter().map(|(c, _)| *c).collect();
        match self.kind {
            Kind::Rmse => write!(f, "rmse-{signals}")?,
            Kind::Nrmse => write!(f, "nrmse-{signals}")?,
            Kind::Rmspe => write!(f, "rmspe-{signals}")?,
            Kind::TheilU => write!(f, "u-{signals}")?,
            Kind::RmseN if signals == "sv" => write!(f, "rmse-sn-vn")?,
            Kind::RmseN => write!(f, "rmse-sn-vn-an")?,
        }
        if used.iter().any(|(_, w)| *w != 1.0) {
            let weights: Vec<String> = used.iter().map(|(_, w)| w.to_string()).collect();
            write!(f, ":{}", weights.join(","))?;
        }
        Ok(())
    }
}
