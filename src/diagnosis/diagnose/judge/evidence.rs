//! The gain of a cause on data that it was not fitted to, and its threshold.

use super::Validated;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::policy::POLICY;
use crate::diagnose::search::fitted_model::{Context, is_local};
use crate::extension::Extension;

/// True if a gain on all training data is worth a cross-fit.
#[must_use]
pub fn is_hopeful(gain: f64, need: f64) -> bool {
    gain > POLICY.judged * need
}

/// The threshold of a cause \[nats\]: 2 ln(K / alpha) for K causes, inflated by the correlation of the innovations, and more in sensor
/// noise that lasts, before and after the likeliest cause; plus a share of the evidence of earlier causes \[nats\].
#[must_use]
pub fn need(setting: &Context<'_>, inflation: f64, noises: [&Noise; 2], explained: f64) -> f64 {
    let causes = setting.question.causes.len().max(1) as f64;
    let lasting = noises.iter().all(|noise| noise.tau_d < POLICY.lasting);
    let factor = if lasting { POLICY.lasting_factor } else { 1.0 };
    2.0 * (causes / POLICY.alpha).ln() * inflation * factor + POLICY.left_by_others * explained
}

/// Difference of evidence below which the data do not distinguish two causes \[nats\]; `evidence` is that of the better one.
#[must_use]
pub fn margin(inflation: f64, evidence: f64) -> f64 {
    (POLICY.close * inflation).max(POLICY.alike * evidence)
}

/// How well a cause explains what a model lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Gain on all training data \[nats\].
    pub gain: f64,
    /// Gain held out, sum of both folds, less the charge for searched times \[nats\].
    pub held: f64,
    /// The same for each fold, without the charge.
    pub folds: [f64; 2],
    /// For a cause that acts in one stretch only: the gain on all training data, less the charge \[nats\]. If the stretch lies in one fold,
    /// the other one has nothing to fit it to.
    pub local: Option<f64>,
}

impl Evidence {
    /// Evidence of a model with a cause over one without.
    #[must_use]
    pub fn of(setting: &Context<'_>, cause: &Extension, with: Validated<'_>, without: Validated<'_>) -> Evidence {
        let folds = with.1.gain(without.1).0;
        let times = cause.parameters.iter().filter(|symbol| symbol.is_time()).count();
        let span: f64 = setting.question.train.iter().map(|d| d.samples() as f64 * d.dt()).sum();
        let charge = times as f64 * (span / POLICY.time_resolution).max(1.0).ln();
        let gain = with.0.fit.log_likelihood - without.0.fit.log_likelihood;
        let local = is_local(cause).then_some(gain - charge);
        Evidence { gain, held: folds[0] + folds[1] - charge, folds, local }
    }

    /// The evidence for comparisons: the held-out gain, at most the gain on all data, because the held-out gain explodes if the base fails
    /// on the other fold. For a cause that acts in one stretch only, the gain on all data.
    #[must_use]
    pub fn counts(&self) -> f64 {
        self.local.unwrap_or_else(|| self.held.min(self.gain))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;

    /// One cause: 2 ln 100 = 9.2103 nats, times the inflation; the share of earlier causes is added and not multiplied.
    #[test]
    fn more_is_needed_in_lasting_noise_and_of_later_causes() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let causes = [made_up::cause("grade")];
        let bounds = Overrides::new();
        let question = crate::diagnose::Question { causes: &causes, ..made_up::question(&drives, &[], &bounds) };
        let setting = Context::new(&question, None);
        let gusts = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 1e-3 };
        let lasts = Noise { tau_d: 1.0, ..gusts };
        let near = |inflation: f64, noises: [&Noise; 2], explained: f64, expected: f64| {
            let found = need(&setting, inflation, noises, explained);
            assert!((found - expected).abs() < 1e-3, "{found}, {expected}");
        };
        near(2.0, [&gusts; 2], 0.0, 18.4207);
        near(1.0, [&gusts; 2], 250.0, 9.2103 + 20.0);
        near(1.0, [&lasts; 2], 250.0, 8.0 * 9.2103 + 20.0);
        // A cause explains it.
        near(1.0, [&lasts, &gusts], 0.0, 9.2103);
    }

    #[test]
    fn rivals_are_close_or_alike() {
        assert_eq!([margin(2.0, 100.0), margin(2.0, 1000.0)], [12.0, 40.0]);
    }
}
