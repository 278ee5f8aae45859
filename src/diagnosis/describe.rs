//! The complete diagnosis: the cause, the breakdown of the error, and the models.

use crate::catalog::Variant;
use crate::diagnose::describe::covariates::Covariates;
use crate::diagnose::describe::error_breakdown::{Errors, budget};
use crate::diagnose::describe::free::{BrokenOffEntry, Free, free, nrmse_of};
use crate::diagnose::describe::missing::{Missing, Profiles, profiles};
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::observer::{Noise, design};
use crate::diagnose::{Adopted, DiagnoseError, Fitted, Inference, POLICY, Question};
use crate::evaluator::Innovations;
use crate::extension::Extension;
use crate::race::{Answer, Delivered, combine};
use crate::result::diagnosis::{
    CauseEntry, DriveEntry, ErrorsEntry, HeldBackEntry, LeftOverEntry, ModelEntry, NotTriedEntry, Outcome,
    ParameterEntry, RungEntry,
};
use crate::symbols::Parameters;

/// The missing acceleration of a drive under a model, with the quantities at each sample.
#[derive(Debug, Clone)]
pub struct Series {
    /// The quantities at each sample.
    pub scene: Covariates,
    /// d \[m/s²\]; NaN before the first simulated sample, where it is undefined, and in what the race omits.
    pub d: Vec<f64>,
    /// Standard deviation of d \[m/s²\].
    pub error: f64,
    /// Gap minus d_0 + t_h v \[m\], where the model has both.
    pub gap_error: Option<Vec<f64>>,
}

/// A model in a diagnosis.
#[derive(Debug, Clone)]
pub struct Described {
    /// Missing accelerations on the training drives, then on the hold-out drives.
    pub series: Vec<Series>,
    /// Free simulations of the same drives, with the parameters of the result.
    pub runs: Vec<Free>,
}

/// All results of a diagnosis.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The result without the caller's information on files.
    pub outcome: Outcome,
    /// The inference, with both models.
    pub inference: Inference,
    /// The base model.
    pub base: Described,
    /// The recommended model, otherwise the one with the named causes.
    pub extended: Option<Described>,
}

/// Describes the inference and the answer of the race. `lap` is the length of a closed track \[m\].
///
/// # Errors
/// As [`free`].
pub fn describe(
    question: &Question<'_>,
    inference: Inference,
    answer: &Answer,
    lap: Option<f64>,
) -> Result<Diagnosis, DiagnoseError> {
    let adopted = inference.named();
    let delivered = answer.extended();
    let base_model = Simulated::of(question.base, answer.base(), &inference.base);
    let extended_model = match (delivered, adopted.is_empty()) {
        (None, true) => None,
        (delivered, _) => Some(Simulated::of(question.base, delivered, &inference.extended)),
    };
    let compared = [base_model.variant, extended_model.as_ref().map_or(base_model.variant, |model| model.variant)];
    let base = Described {
        series: base_model.series(question, &inference.base, &inference.base.noise, answer, lap)?,
        runs: base_model.runs(question, compared, &[])?,
    };
    let extended = match &extended_model {
        Some(model) => Some(Described {
            series: model.series(question, &inference.extended, &inference.base.noise, answer, lap)?,
            runs: model.runs(question, [compared[1], compared[0]], adopted)?,
        }),
        None => None,
    };
    let trained = question.train.len();
    let complete = || base.runs[..trained].iter().zip(&base.series).filter(|(run, _)| run.complete);
    // Neither the errors nor the missing acceleration include what the race omits.
    let counted = |(run, series): (&Free, &Series)| {
        let counts = |(error, d): (&f64, &f64)| if d.is_nan() { f64::NAN } else { *error };
        run.errors.each_ref().map(|errors| errors.iter().zip(&series.d[run.first..]).map(counts).collect::<Vec<f64>>())
    };
    let values: Vec<[Vec<f64>; 3]> = complete().map(counted).collect();
    let errors: Vec<Errors> = complete()
        .zip(&values)
        .map(|((run, series), [s, v, a])| Errors { scene: &series.scene, first: run.first, values: [s, v, a] })
        .collect();
    let broken_off = broken_off(question, &base);
    let missing = sorted(&base.series[..trained]);
    let missing_left = extended.as_ref().and_then(|e| sorted(&e.series[..trained]));
    let left = extended.as_ref().unwrap_or(&base);
    let mut left_over: Vec<LeftOverEntry> = inference
        .left_over
        .iter()
        .map(|l| LeftOverEntry { kind: l.kind.clone(), r#where: l.place.clone(), size: l.size })
        .collect();
    if let Some(profiles) = missing_left.as_ref().or(missing.as_ref()) {
        left_over.push(LeftOverEntry {
            kind: "missing_acceleration".to_owned(),
            r#where: format!("m/s² rms, largest at {}", worst_minute(&left.series[..trained])),
            size: profiles.rms,
        });
    }
    let entries = |causes: &[Adopted]| causes.iter().map(CauseEntry::from).collect();
    let outcome = Outcome {
        verdict: inference.verdict,
        reason: inference.reason.clone(),
        causes: entries(adopted),
        confounded_with: if adopted.is_empty() { Vec::new() } else { entries(&inference.confounded_with) },
        not_testable: inference.not_testable.clone(),
        base_held_back: held_back(
            question,
            answer,
            &base.runs[trained..],
            extended.as_ref().map(|e| &e.runs[trained..]),
        ),
        left_over,
        simulations: inference.simulations,
        complete: inference.complete,
        not_tried: inference.untried.iter().map(|(cause, why)| NotTriedEntry::new(&cause.name, why)).collect(),
        drives: drives(question),
        base: Some(base_model.entry(&inference.base)),
        extended: extended_model.map(|model| model.entry(&inference.extended)),
        budget: budget(&errors),
        broken_off,
        missing,
        missing_left,
        ladder: inference.ladder.iter().map(RungEntry::from).collect(),
        policy: serde_json::to_value(POLICY).unwrap_or_default(),
        ..Outcome::new(question.effort, question.seed)
    };
    let mut found = Diagnosis { outcome, inference, base, extended };
    combine(&mut found.outcome, answer);
    Ok(found)
}

fn drives(question: &Question<'_>) -> Vec<DriveEntry> {
    let entry =
        |role: &'static str| move |drive: &Drive| DriveEntry { label: drive.label().to_owned(), role: role.to_owned() };
    question.train.iter().map(entry("train")).chain(question.holdout.iter().map(entry("holdout"))).collect()
}

/// The training drives on which a model ends early.
fn broken_off(question: &Question<'_>, model: &Described) -> Vec<BrokenOffEntry> {
    let entry = |(drive, run): (&Drive, &Free)| {
        let [s, ..] = &run.simulated;
        // The last sample of a run is the one that ends it.
        let last = (run.first + s.len()).saturating_sub(1).min(drive.trajectory.len() - 1);
        let crash = s.last().is_some_and(|s| *s <= 0.0);
        BrokenOffEntry { label: drive.label().to_owned(), time_s: drive.trajectory.t[last], crash }
    };
    question.train.iter().zip(&model.runs).filter(|(_, run)| !run.complete).map(entry).collect()
}

/// A model of the result, to be simulated.
struct Simulated {
    variant: Variant,
    parameters: Parameters,
    /// Parameters by the race; `None` for a model that only the likelihood fits.
    entries: Option<Vec<ParameterEntry>>,
}

impl Simulated {
    /// The model of the race, otherwise that of the likelihood.
    fn of(base: Variant, delivered: Option<Delivered>, fitted: &Fitted) -> Simulated {
        let extended =
            |causes: &[&'static Extension]| causes.iter().try_fold(base, |variant, cause| variant.with(cause));
        match delivered.and_then(|model| Some((extended(&model.causes).ok()?, model))) {
            Some((variant, model)) => Simulated { variant, parameters: model.parameters, entries: Some(model.entries) },
            None => Simulated { variant: fitted.variant, parameters: fitted.parameters, entries: None },
        }
    }

    fn runs(
        &self,
        question: &Question<'_>,
        compared: [Variant; 2],
        adopted: &[Adopted],
    ) -> Result<Vec<Free>, DiagnoseError> {
        let drives = question.train.iter().chain(question.holdout);
        free(drives, compared, &self.parameters, adopted, question.bounds)
    }

    /// The missing acceleration on the training drives, then on the held-back drives. Models of the race have the same observer, that of
    /// the base's noise.
    fn series(
        &self,
        question: &Question<'_>,
        fitted: &Fitted,
        of_base: &Noise,
        answer: &Answer,
        lap: Option<f64>,
    ) -> Result<Vec<Series>, DiagnoseError> {
        let drives = || question.train.iter().chain(question.holdout);
        let (noise, runs) = if self.entries.is_some() {
            let drives: Vec<Drive> = drives().cloned().collect();
            let model = Model::new(self.variant, &drives, question.bounds, &[])?;
            let values: Vec<f64> = model.symbols.iter().map(|symbol| self.parameters.get(*symbol)).collect();
            (of_base, &model.innovations(&values, of_base)?)
        } else {
            (&fitted.noise, &fitted.innovations)
        };
        let one = |(drive, run): (&Drive, &Innovations)| {
            let scene = Covariates::of(drive, lap);
            let mut d: Vec<f64> = run.state.iter().map(|state| state[2]).collect();
            d[..run.first.min(scene.len())].fill(f64::NAN);
            leave_out(&mut d, &scene.t, &answer.parts_of(drive));
            let (d_0, t_h) = (self.parameters.d_0, self.parameters.t_h);
            let wanted = (d_0 + t_h).is_finite();
            let gap_error = wanted.then(|| scene.s.iter().zip(&scene.v).map(|(s, v)| s - d_0 - t_h * v).collect());
            Series { error: deviation(noise, scene.dt), scene, d, gap_error }
        };
        Ok(drives().zip(runs).map(one).collect())
    }

    /// The entry, with the noise of the likelihood.
    fn entry(&self, fitted: &Fitted) -> ModelEntry {
        let own = ModelEntry::from(fitted);
        ModelEntry {
            variant: self.variant.name(),
            extensions: self.variant.causes().map(|e| e.name.clone()).collect(),
            parameters: self.entries.clone().unwrap_or(own.parameters),
            ..own
        }
    }
}

/// Sets d to NaN at times beyond these parts, if there are any.
fn leave_out(d: &mut [f64], t: &[f64], parts: &[[f64; 2]]) {
    let is_of_part = |t: &f64| parts.is_empty() || parts.iter().any(|[from, to]| (*from..=*to).contains(t));
    d.iter_mut().zip(t).filter(|(_, t)| !is_of_part(t)).for_each(|(d, _)| *d = f64::NAN);
}

/// The errors on data that the models were not fitted to: parts left out of the race, and held-back drives that it has not seen.
fn held_back(question: &Question<'_>, answer: &Answer, base: &[Free], extended: Option<&[Free]>) -> Vec<HeldBackEntry> {
    let mut all = answer.left_out();
    let is_seen = !all.is_empty();
    let errors = |run: &Free| {
        let rms = |errors: &Vec<f64>| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let nrmse_sva = nrmse_of(std::slice::from_ref(run))?;
        Some(ErrorsEntry { rms: run.errors.each_ref().map(rms), nrmse_sva })
    };
    for (i, drive) in
        question.holdout.iter().enumerate().filter(|(_, drive)| !is_seen || answer.parts_of(drive).is_empty())
    {
        let of_base = errors(&base[i]);
        let recommended = extended.filter(|_| !answer.recommended().is_empty()).and_then(|runs| errors(&runs[i]));
        all.push(HeldBackEntry {
            label: drive.label().to_owned(),
            rms: of_base.map(|errors| errors.rms),
            nrmse_sva: of_base.map(|errors| errors.nrmse_sva),
            recommended,
        });
    }
    all
}

/// The minute with the largest missing acceleration, with its share of the sum of squares.
fn worst_minute(series: &[Series]) -> String {
    const MINUTE: f64 = 60.0;
    let (mut all, mut worst) = (0.0, (0.0, String::new()));
    for one in series {
        let scene = &one.scene;
        let samples = ((MINUTE / scene.dt).round() as usize).max(1);
        for (k, d) in one.d.chunks(samples).enumerate() {
            let square: f64 = d.iter().filter(|d| d.is_finite()).map(|d| d * d).sum();
            all += square;
            if square <= worst.0 {
                continue;
            }
            let from = scene.t[k * samples];
            let of = if series.len() > 1 { format!(" of {}", scene.label) } else { String::new() };
            worst = (square, format!("{from:.0} to {:.0} s{of}", from + d.len() as f64 * scene.dt));
        }
    }
    let (square, at) = worst;
    format!("{at} ({:.0} %)", 100.0 * square / f64::max(all, 1e-300))
}

/// Standard deviation of d after a correction \[m/s²\]: its row of the steady state P = P⁻ - K S Kᵀ with P⁻ = φ² P + (1 - φ²) σ².
fn deviation(noise: &Noise, dt: f64) -> f64 {
    let designed = design(noise, dt);
    let [w_1, w_2, w_3] = designed.whitening;
    // S = (Wᵀ W)⁻¹ with W lower triangular, so K S Kᵀ = |K W⁻¹|².
    let (k_s, k_v) = (designed.gain[4], designed.gain[5]);
    let second = k_v / w_3;
    let first = (k_s - second * w_2) / w_1;
    let forgotten = 1.0 - designed.decay * designed.decay;
    let variance = noise.sigma_d.powi(2) - (first * first + second * second) / forgotten.max(1e-12);
    variance.clamp(0.0, noise.sigma_d.powi(2)).sqrt()
}

fn missing_of(series: &[Series]) -> Vec<Missing<'_>> {
    let one = |s| {
        let Series { scene, d, gap_error, .. }: &Series = s;
        Missing { scene, d, gap_error: gap_error.as_deref() }
    };
    series.iter().map(one).collect()
}

fn sorted(series: &[Series]) -> Option<Profiles> {
    profiles(&missing_of(series))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_race_omits_is_left_out() {
        let t = [0.0, 1.0, 2.0, 3.0, 4.0];
        let left = |parts: &[[f64; 2]]| {
            let mut d = [0.1; 5];
            leave_out(&mut d, &t, parts);
            d.map(f64::is_nan)
        };
        assert_eq!(left(&[[1.0, 2.0], [4.0, 9.0]]), [true, false, false, true, false]);
        assert_eq!(left(&[]), [false; 5]);
    }
}
