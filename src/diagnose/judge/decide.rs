//! When a cause counts as found.

use super::fate::{Objection, Size};
use crate::diagnose::likelihood::fit::{Predictor, least_random};
use crate::diagnose::likelihood::model::{PHASE, is_rugged, is_stepped};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, FittedModel, is_local};
use crate::evaluator::Case;
use crate::extension::{Extension, Stage};
use crate::symbols::SearchKind;

/// Probability of a false name in data without a cause, for which the threshold is made.
const ALPHA: f64 = 0.01;
/// While the missing acceleration is larger than this \[m/s²\] and shorter than this \[s\] thresholds are raised: strong gusts feed
/// back through the law and make false lags.
const GUSTS: (f64, f64) = (0.1, 3.0);
/// By this factor.
const GUSTS_FACTOR: f64 = 2.5;
/// A missing acceleration at most so many times the least that a model may have is the scheme's own. Thresholds are raised there,
/// too: the error of a scheme is not random, so it repeats in the other fold, and what imitates it gains there.
const SCHEME_ONLY: f64 = 1.05;
/// By this factor.
const SCHEME_FACTOR: f64 = 2.5;
/// A missing acceleration that is no scheme's error, but shorter than this \[s\], even where the likeliest cause is part of the model,
/// is noise of sensors that lasts from sample to sample, which the observer has no place for. It is fed through the law, and what makes
/// that weaker gains: a dead zone, an answer to the car two ahead. (Gusts of 2 s were seen as 1.8 to 3.7 s, such noise as 0.15 to 1.6 s.)
const LASTING_S: f64 = 1.7;
/// By this factor: without an effect 2.3 times the threshold was reached in 36 drives.
const LASTING_FACTOR: f64 = 2.5;
/// And every cause after the first has to gain this share of what those before it explain, on top: none of them is exactly what the
/// car does, and what is left of each repeats as well. (Behind 100 effects 29 nats were left at most, of 1447; less than 1 %
/// where more was explained.)
const LEFT_BY_OTHERS: f64 = 0.01;
/// The same where steps of the command are among them, between two of which a car goes to and fro in finer steps than the model: 3 to 10 %
/// were left of 2400 to 4100 nats. (What had 10 % was an answer too small to be a name there, [`ANSWERED`].)
const LEFT_BY_STEPS: f64 = 0.07;
/// Gain on all training data, less the charge for its times, that a cause local by nature needs instead of both folds and many
/// blocks \[nats\]. (Where there was none it gained 7 at most in the cases looked at, whatever else was missing.)
const LOCAL: f64 = 60.0;
/// With so many times the need, a fold that loses less than this share of what the other one gains says nothing: a limit that was
/// reached once or twice may have been reached in the other one only. (Without an effect 0.6 of the need was the most in 120 drives.)
const CERTAIN: f64 = 2.0;
/// See there.
const SILENT: f64 = 0.1;
/// Missing acceleration that a complete model leaves without gusts, at most \[m/s²\].
const CALM: f64 = 0.02;
/// See [`margin`].
const CLOSE: f64 = 6.0;
/// Resolution of a searched time \[s\], for the charge of having searched it.
const RESOLUTION_S: f64 = 5.0;
/// A car that reacts in finer steps than the model looks ahead of it by this much \[s\], beyond what the nuisance lead takes.
const SCHEME_S: f64 = 0.06;
/// A length of what is seen that is less than so many times the noise of the measured spacing is no name: a law that is fed a noisy spacing
/// answers small errors as weakly as one with a dead zone, and Gipps' law has no gain of its own to take that up. (Where none was planted such
/// zones had up to 2.2 times the noise, planted ones ten times and more.)
const BLURRED: f64 = 3.0;
/// A car that goes faster than a set speed by this \[m/s\] is not held by it ...
const FASTER: f64 = 0.5;
/// ... once it had the time to slow down to it \[s\]: the command does so with a time constant of 2 s.
const SLOWED_S: f64 = 8.0;
/// Share of the rest of a stretch in which it may be faster: when a stretch began is known to some seconds only. (Stretches that were
/// named in a measured drive of which the driver had the first half minute: 57 to 78 %.)
const OUTRUN: f64 = 0.25;
/// Share of what it needs that a cause has to gain to be judged: smaller evidence is not seen.
pub(crate) const JUDGED: f64 = 0.5;
/// Identifiability below which a cause is absorbed by the calibration.
pub const ABSORBED: f64 = 0.02;

/// True for a gain on all training data that is worth a cross-fit.
#[must_use]
pub fn is_hopeful(gain: f64, need: f64) -> bool {
    gain > JUDGED * need
}

/// What a cause has to gain \[nats\]: 2 ln(K / alpha) for K causes, or what a bootstrap found, inflated by the correlation of the
/// innovations. More where these are known not to be all that is random: in gusts, in noise of sensors that lasts, where nothing but the scheme's
/// own error is left; and beside causes that leave so much of themselves, `residue`. `noise` is that of the present model, `left` what the
/// likeliest cause leaves of it.
#[must_use]
pub fn need(setting: &Context<'_>, inflation: f64, noise: &Noise, left: &Noise, residue: f64) -> f64 {
    let causes = setting.question.causes.len().max(1) as f64;
    let analytic = setting.least.unwrap_or_else(|| 2.0 * (causes / ALPHA).ln()) * inflation;
    // Surrogates have the same gusts.
    let gusts = noise.sigma_d > GUSTS.0 && noise.tau_d < GUSTS.1 && setting.least.is_none();
    let scheme = noise.sigma_d < SCHEME_ONLY * least_random(noise.tau_d);
    let short = |noise: &Noise| noise.tau_d < LASTING_S && noise.sigma_d >= SCHEME_ONLY * least_random(noise.tau_d);
    let lasting = short(noise) && short(left);
    let factors = [(gusts, GUSTS_FACTOR), (scheme, SCHEME_FACTOR), (lasting, LASTING_FACTOR)];
    let factor = factors.iter().filter(|(holds, _)| *holds).map(|(_, factor)| *factor).fold(1.0, f64::max);
    analytic * factor + residue
}

/// What causes that explain `explained` nats may leave of themselves \[nats\], which is no sign of a further one.
#[must_use]
pub fn residue(causes: &[&Extension], explained: f64) -> f64 {
    let share = if causes.iter().any(|cause| is_rugged(cause)) { LEFT_BY_STEPS } else { LEFT_BY_OTHERS };
    share * explained
}

/// Difference of evidence below which two causes are not told apart \[nats\]: odds of several hundred, inflated. Where gusts remain
/// the observer's states are not what the car saw, which favours one member of a family over another by more.
#[must_use]
pub fn margin(inflation: f64, noise: Noise, need: f64) -> f64 {
    if is_calm(&noise) { CLOSE * inflation } else { need }
}

/// True if a model leaves no gusts.
#[must_use]
pub fn is_calm(noise: &Noise) -> bool {
    noise.sigma_d <= CALM
}

/// Share of the evidence within which relatives are not told apart: steps of a tenth of a second change each of them a little, in
/// proportion to what it does.
const ALIKE: f64 = 0.04;

/// The same between members of one family, of which the best has so much evidence \[nats\].
#[must_use]
pub fn margin_of_relatives(margin: f64, evidence: f64) -> f64 {
    margin.max(ALIKE * evidence)
}

/// How well a cause explains what a model lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Gain on all training data \[nats\].
    pub gain: f64,
    /// Gain held out, sum of both folds, less the charge for searched times \[nats\].
    pub held: f64,
    /// The same per fold, without the charge.
    pub folds: [f64; 2],
    /// Without the two best blocks.
    pub trimmed: f64,
    /// For a cause that acts in one stretch only: the gain on all training data, less the charge \[nats\]. Where the stretch lies in one
    /// fold, the other one has nothing to fit it on.
    pub local: Option<f64>,
}

impl Evidence {
    /// Of a candidate over another one that lacks the cause.
    #[must_use]
    pub fn of(
        setting: &Context<'_>,
        candidate: &FittedModel,
        cause: &Extension,
        held: &CrossValidated,
        current: &FittedModel,
        current_held: &CrossValidated,
    ) -> Evidence {
        let (folds, mut blocks) = held.gain(current_held);
        let times = cause.parameters.iter().filter(|symbol| symbol.is_time()).count();
        let span: f64 = setting.question.train.iter().map(|d| d.samples() as f64 * d.dt()).sum();
        let charge = times as f64 * (span / RESOLUTION_S).max(1.0).ln();
        blocks.sort_by(|a, b| b.total_cmp(a));
        let trimmed = blocks.iter().skip(2).sum();
        let gain = candidate.fit.log_likelihood - current.fit.log_likelihood;
        let local = is_local(cause).then_some(gain - charge);
        Evidence { gain, held: folds[0] + folds[1] - charge, folds, trimmed, local }
    }

    /// What counts when evidence is compared: where the base fails on the other fold the held-out gain explodes, so not more than
    /// the gain on all data. Of what acts in one stretch only, the latter.
    #[must_use]
    pub fn counts(&self) -> f64 {
        self.local.unwrap_or_else(|| self.held.min(self.gain))
    }

    /// Why it does not pass; `None` if it does.
    #[must_use]
    pub fn objection(&self, need: f64) -> Option<Objection> {
        let evidence = self.counts();
        if evidence <= need {
            return Some(Objection::Weak { evidence, need });
        }
        if self.local.is_some() {
            return (evidence <= LOCAL).then_some(Objection::WeakEvent { evidence, need: LOCAL });
        }
        let [weaker, stronger] = [self.folds[0].min(self.folds[1]), self.folds[0].max(self.folds[1])];
        let silent = evidence > CERTAIN * need && weaker > -SILENT * stronger;
        if weaker <= 0.0 && !silent {
            return Some(Objection::OneFold);
        }
        (self.trimmed <= need / 2.0).then_some(Objection::FewBlocks { without: self.trimmed })
    }
}

/// Why an estimate is a proxy and not a name; `None` if it can be one.
#[must_use]
pub fn proxy(candidate: &FittedModel, cause: &Extension) -> Option<Objection> {
    let positions = candidate.model.positions(cause);
    let idle = |k: usize| {
        let axis = candidate.model.axes[k];
        let coordinate = |value: f64| axis.coordinate(value);
        let neutral = candidate.model.symbols[k].neutral();
        neutral.is_none_or(|neutral| (coordinate(candidate.fit.point.values[k]) - coordinate(neutral)).abs() < 1e-3)
    };
    // As a whole it does nothing, so what gains is something else that was fitted again.
    let all_idle = positions.iter().all(|&k| idle(k));
    for &k in &positions {
        let (symbol, axis, value) =
            (candidate.model.symbols[k], candidate.model.axes[k], candidate.fit.point.values[k]);
        if symbol.neutral().is_none() {
            continue;
        }
        let size = || Size { name: symbol.name().to_owned(), value, unit: symbol.unit().to_owned() };
        if is_scheme(cause, value) || makes_up_for_steps(candidate, cause) {
            return Some(Objection::Scheme(size()));
        }
        let noise = candidate.fit.point.noise.r_s;
        if symbol.unit() == "m" && changes_what_is_seen(cause) && value.abs() < BLURRED * noise {
            return Some(Objection::Blurred { size: size(), noise });
        }
        if cause.cause.as_ref().is_some_and(|traits| traits.positive) && value < 0.0 {
            return Some(Objection::WrongSign(size()));
        }
        if axis.at_bound(value) && (all_idle || !idle(k)) {
            return Some(Objection::OnBound(size()));
        }
        if let Some(share) = outrun(candidate, cause).filter(|share| *share > OUTRUN) {
            return Some(Objection::Outrun { size: size(), share });
        }
    }
    None
}

fn changes_what_is_seen(cause: &Extension) -> bool {
    cause.stages.iter().any(|function| function.stage == Stage::Perception)
}

/// The largest share of a stretch of a lower set speed, drive by drive, in which the car goes faster; `None` for other causes, and where
/// no drive has it for longer than it takes to slow down.
fn outrun(candidate: &FittedModel, cause: &Extension) -> Option<f64> {
    if cause.search() != SearchKind::Stretch || cause.parameters.iter().all(|size| size.unit() != "m/s") {
        return None;
    }
    let values: Vec<f64> =
        candidate.model.positions(cause).into_iter().map(|k| candidate.fit.point.values[k]).collect();
    let [v_lim, t_1, duration] = values[..] else { return None };
    let share = |case: &Case| {
        let sample = |t: f64| (((t - case.t_0) / case.dt).ceil().max(0.0) as usize).min(case.v_f.len());
        let (from, to) = (sample(t_1 + SLOWED_S), sample(t_1 + duration));
        let faster = case.v_f[from..to.max(from)].iter().filter(|v| **v > v_lim + FASTER).count();
        (to > from).then(|| faster as f64 / (to - from) as f64)
    };
    candidate.model.acts_on(cause).filter_map(share).max_by(f64::total_cmp)
}

/// A step of the command is smoothed over so many samples at most by what stands for the finer step of a real car.
const SMOOTHED: f64 = 2.0;
/// And an answer to a car ahead that does is at most this: a share of its acceleration, or per second of a speed difference.
const ANSWERED: f64 = 0.05;

/// True for what does nothing but make up for the finer step of a real car whose command comes in steps. Where a command stays between
/// two of them, a real car goes to and fro between them in finer steps than the model's, which in the model looks smoothed over a sample
/// or two, and sooner.
fn makes_up_for_steps(candidate: &FittedModel, cause: &Extension) -> bool {
    let FittedModel { model, fit, .. } = candidate;
    let steps = (0..model.symbols.len()).filter(|&k| is_stepped(model.symbols[k]) && !model.symbols[k].is_time());
    let step = steps.map(|k| fit.point.values[k]).fold(0.0, f64::max);
    let seconds = model.drives().iter().map(|(_, dt)| SMOOTHED * dt).fold(f64::INFINITY, f64::min);
    let values: Vec<f64> = model.positions(cause).into_iter().map(|k| fit.point.values[k]).collect();
    is_of_a_step(cause, &values, step, seconds)
}

/// The same by values, beside steps of the command of this size \[m/s²\], of which one may be smoothed over so many seconds.
fn is_of_a_step(cause: &Extension, values: &[f64], step: f64, seconds: f64) -> bool {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let limits_the_jerk = cause.search() == SearchKind::Limit && cause.parameters.iter().all(|p| p.unit() == "m/s3");
    step > 0.0
        && match cause.family() {
            _ if limits_the_jerk => step <= least * seconds,
            PHASE => largest <= seconds,
            "anticipation" => largest <= ANSWERED,
            _ => false,
        }
}

/// True for clocks that differ by what stands for the finer step of a real car, which is nothing that a model lacks.
fn is_scheme(cause: &Extension, value: f64) -> bool {
    cause.needs.look_back.is_some() && (-SCHEME_S..0.0).contains(&value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::{Effort, Question};

    const CALM: Noise = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 1e-3 };

    #[test]
    fn beside_steps_of_the_command_what_makes_up_for_a_sample_is_no_name() {
        let named = |name| crate::wgsl::extension_named(name).expect("in the library");
        let said = |cause, values: &[f64]| is_of_a_step(named(cause), values, 0.3, 0.2);
        assert!(said("jerk_limit", &[1.6]) && !said("jerk_limit", &[1.4]));
        assert!(said("asym_lag", &[0.1, 0.19]) && !said("asym_lag", &[0.1, 0.21]));
        assert!(said("leader_accel_ff", &[0.02]) && !said("leader_accel_ff", &[0.1]));
        assert!(said("multi_anticipation", &[0.01]) && !said("dead_zone", &[0.01]));
        assert!(!is_of_a_step(named("leader_accel_ff"), &[0.02], 0.0, 0.2), "without steps it is what it is");
    }

    /// One cause: 2 ln 100 = 9.2103 nats, times the inflation.
    #[test]
    fn thresholds_rise_where_more_is_random_than_assumed() {
        let causes = [crate::wgsl::extension_named("grade").expect("in the library")];
        let bounds = Overrides::new();
        let base = "idm".parse().expect("a base");
        let question = Question {
            train: &[],
            holdout: &[],
            base,
            effort: Effort::Quick,
            seed: 1,
            causes: &causes,
            bounds: &bounds,
            kept: None,
        };
        let setting = Context::new(&question, None);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-3, "{found}, {expected}");
        near(need(&setting, 2.0, &CALM, &CALM, 0.0), 18.4207);
        let gusts = Noise { sigma_d: 0.2, ..CALM };
        near(need(&setting, 1.0, &gusts, &CALM, 0.0), 2.5 * 9.2103);
        // At the floor: 0.01 / sqrt(2 * 2) = 0.005.
        near(need(&setting, 1.0, &Noise { sigma_d: 0.005, ..CALM }, &CALM, 0.0), 2.5 * 9.2103);
        // What others leave comes on top, and is not multiplied.
        near(need(&setting, 1.0, &CALM, &CALM, 14.0), 9.2103 + 14.0);
        near(need(&setting, 1.0, &gusts, &CALM, 14.0), 2.5 * 9.2103 + 14.0);
        let [steps, lag] =
            ["quantised_accel", "actuation_lag"].map(|name| crate::wgsl::extension_named(name).expect("there"));
        near(residue(&[lag], 200.0), 2.0);
        near(residue(&[lag, steps], 200.0), 14.0);
        let lasts = Noise { tau_d: 1.0, ..CALM };
        near(need(&setting, 1.0, &lasts, &lasts, 0.0), 2.5 * 9.2103);
        // It is explained by a cause.
        near(need(&setting, 1.0, &lasts, &CALM, 0.0), 9.2103);
        // Surrogates have the gusts already.
        let bootstrapped = Context { least: Some(7.0), ..setting };
        near(need(&bootstrapped, 1.0, &gusts, &CALM, 0.0), 7.0);
        assert_eq!((margin_of_relatives(10.0, 100.0), margin_of_relatives(10.0, 1000.0)), (10.0, 40.0));
    }
}
