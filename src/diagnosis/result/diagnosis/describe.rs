//! The whole of a diagnosis: the cause, and beside it what the error looks like and what the cause is worth.

use super::recommended::ClosedLoopEntry;
use super::{CauseEntry, DriveEntry, HeldBackEntry, LeftOverEntry, NotTriedEntry, Outcome, RungEntry, SCHEMA_VERSION};
use crate::calibrate::CalibrateError;
use crate::convention::Convention;
use crate::diagnose::describe::covariates::Covariates;
use crate::diagnose::describe::error_breakdown::{Errors, budget};
use crate::diagnose::describe::formula::formula;
use crate::diagnose::describe::free::{BrokenOffEntry, Free, free};
use crate::diagnose::describe::gain::{Gain, GainError, GainSettings, gain, nrmse_of};
use crate::diagnose::describe::missing::{Missing, Profiles, profiles};
use crate::diagnose::drive::Drive;
use crate::diagnose::infer;
use crate::diagnose::likelihood::observer::{Noise, design};
use crate::diagnose::{Adopted, Fitted, Inference, POLICY, Progress, Question, Verdict};
use std::ops::ControlFlow;

/// Share of the work after which the cause is known.
const INFERRED: f64 = 0.75;

/// The missing acceleration of a drive under a model, with what surrounds it.
#[derive(Debug, Clone)]
pub struct Series {
    /// What surrounds the samples.
    pub scene: Covariates,
    /// d \[m/s²\]; NaN before the first simulated sample, and where there is none.
    pub d: Vec<f64>,
    /// Standard deviation of d \[m/s²\].
    pub error: f64,
    /// Gap minus d_0 + t_h v \[m\], where the model has both.
    pub gap_error: Option<Vec<f64>>,
}

/// A model's part in a diagnosis.
#[derive(Debug, Clone)]
pub struct Described {
    /// Missing accelerations on the training drives, then on the hold-out drives.
    pub series: Vec<Series>,
    /// Free simulations of the same drives, with the parameters of the fit.
    pub runs: Vec<Free>,
}

/// Everything that a diagnosis made.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The result, but for what the caller knows about files.
    pub outcome: Outcome,
    /// The cause, with both models.
    pub inference: Inference,
    /// The base model.
    pub base: Described,
    /// The extended one, if a cause was adopted.
    pub extended: Option<Described>,
}

/// Diagnoses. `lap` is the length of a closed track \[m\].
///
/// # Errors
/// [`GainError`], which holds all that an inference may fail with.
pub fn describe(
    question: &Question<'_>,
    lap: Option<f64>,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Diagnosis, GainError> {
    let inference = infer(question, &mut |p| progress(Progress { done: INFERRED * p.done, stage: p.stage }))?;
    let adopted = &inference.adopted;
    let base = described(question, &inference.base, &[], lap)?;
    let extended =
        if adopted.is_empty() { None } else { Some(described(question, &inference.extended, adopted, lap)?) };
    let settings = GainSettings::of(question.effort, question.seed);
    // A gain belongs to a name: what is adopted without one is a proxy.
    let named = matches!(inference.verdict, Verdict::Named | Verdict::Ambiguous);
    let (measured, gain_error) = if adopted.is_empty() || !named || question.holdout.is_empty() {
        (None, None)
    } else {
        let whole = 2.0 * settings.max_evaluations as f64;
        let (mut before, mut last) = (0, 0);
        let mut tell = |p: crate::calibrate::Progress| {
            // The second calibration counts on from the first.
            before += if p.evaluations < last { last } else { 0 };
            last = p.evaluations;
            let done = INFERRED + (1.0 - INFERRED) * (before + last) as f64 / whole;
            progress(Progress { done: done.min(1.0), stage: "measuring the gain".to_owned() })
        };
        let models = [&inference.base, &inference.extended];
        settled(gain(question, models, adopted, &settings, &mut tell))?
    };
    let trained = question.train.len();
    let errors: Vec<Errors> = base.runs[..trained]
        .iter()
        .zip(&base.series)
        .filter(|(run, _)| run.complete)
        .map(|(run, series)| Errors {
            scene: &series.scene,
            first: run.first,
            values: [&run.errors[0], &run.errors[1], &run.errors[2]],
        })
        .collect();
    let broken_off = broken_off(question, &base);
    let missing = sorted(&base.series[..trained]);
    let missing_left = extended.as_ref().and_then(|e| sorted(&e.series[..trained]));
    let left = extended.as_ref().unwrap_or(&base);
    let formula = formula(&missing_of(&left.series[..trained]));
    let mut left_over: Vec<LeftOverEntry> = inference
        .left_over
        .iter()
        .map(|l| LeftOverEntry { kind: l.kind.clone(), r#where: l.place.clone(), size: l.size, formula: None })
        .collect();
    if let Some(profiles) = missing_left.as_ref().or(missing.as_ref()) {
        left_over.push(LeftOverEntry {
            kind: "missing_acceleration".to_owned(),
            r#where: format!("m/s2 root mean square; most of it at {}", worst_minutes(&left.series[..trained])),
            size: profiles.rms,
            formula: formula.as_ref().map(|f| f.equation()),
        });
    }
    let entries = |causes: &[Adopted]| causes.iter().map(CauseEntry::from).collect();
    let outcome = Outcome {
        schema_version: SCHEMA_VERSION,
        verdict: inference.verdict,
        reason: inference.reason.clone(),
        causes: if named { entries(&inference.adopted) } else { Vec::new() },
        confounded_with: if named { entries(&inference.confounded_with) } else { Vec::new() },
        not_testable: inference.not_testable.clone(),
        data_findings: Vec::new(),
        gain: measured,
        gain_error,
        base_held_back: held_back(question, &base.runs[trained..]),
        recommended: None,
        base_laws: Vec::new(),
        base_notes: Vec::new(),
        left_over,
        simulations: inference.simulations,
        complete: inference.complete,
        not_tried: inference.untried.iter().map(|(cause, why)| NotTriedEntry::new(&cause.name, why)).collect(),
        program: concat!("leadlag ", env!("CARGO_PKG_VERSION")).to_owned(),
        evaluator: "lanes".to_owned(),
        precision: "f64".to_owned(),
        adapter: None,
        convention: Convention::PAPER.to_string(),
        seed: question.seed,
        effort: question.effort.into_str().to_owned(),
        data: Vec::new(),
        drives: drives(question),
        held_back: String::new(),
        base: Some((&inference.base).into()),
        extended: (!adopted.is_empty()).then(|| (&inference.extended).into()),
        budget: budget(&errors),
        broken_off,
        missing,
        missing_left,
        formula,
        ladder: inference.ladder.iter().map(RungEntry::from).collect(),
        closed_loop: ClosedLoopEntry::default(),
        policy: serde_json::to_value(POLICY).unwrap_or_default(),
    };
    Ok(Diagnosis { outcome, inference, base, extended })
}

/// A gain, or why there is none: a cause that was found stays found.
fn settled(measured: Result<Gain, GainError>) -> Result<(Option<Gain>, Option<String>), GainError> {
    match measured {
        Ok(gain) => Ok((Some(gain), None)),
        Err(GainError::Calibrate(CalibrateError::Interrupted)) => Err(crate::diagnose::DiagnoseError::Stopped.into()),
        Err(error) => Ok((None, Some(format!("the gain could not be measured: {error}")))),
    }
}

fn drives(question: &Question<'_>) -> Vec<DriveEntry> {
    let entry =
        |role: &'static str| move |drive: &Drive| DriveEntry { label: drive.label().to_owned(), role: role.to_owned() };
    question.train.iter().map(entry("train")).chain(question.holdout.iter().map(entry("holdout"))).collect()
}

/// The training drives to whose end a model does not come.
fn broken_off(question: &Question<'_>, model: &Described) -> Vec<BrokenOffEntry> {
    let entry = |(drive, run): (&Drive, &Free)| {
        let [s, ..] = &run.simulated;
        // The sample that ends a run is its last one.
        let last = (run.first + s.len()).saturating_sub(1).min(drive.trajectory.len() - 1);
        let crash = s.last().is_some_and(|s| *s <= 0.0);
        BrokenOffEntry { label: drive.label().to_owned(), time_s: drive.trajectory.t[last], crash }
    };
    question.train.iter().zip(&model.runs).filter(|(_, run)| !run.complete).map(entry).collect()
}

/// The base model on the drives that it was not fitted to.
fn held_back(question: &Question<'_>, runs: &[Free]) -> Vec<HeldBackEntry> {
    let entry = |(drive, run): (&Drive, &Free)| {
        let rms = |errors: &Vec<f64>| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        let [s, v, a] = &run.errors;
        HeldBackEntry {
            label: drive.label().to_owned(),
            rms: run.complete.then(|| [rms(s), rms(v), rms(a)]),
            nrmse_sva: nrmse_of(std::slice::from_ref(drive), std::slice::from_ref(run)),
        }
    };
    question.holdout.iter().zip(runs).map(entry).collect()
}

/// Where the missing acceleration is largest: drives and times, with their shares of its square.
fn worst_minutes(series: &[Series]) -> String {
    const MINUTE: f64 = 60.0;
    let mut minutes: Vec<(f64, String)> = Vec::new();
    for one in series {
        let scene = &one.scene;
        let samples = ((MINUTE / scene.dt).round() as usize).max(1);
        for (k, d) in one.d.chunks(samples).enumerate() {
            let square = d.iter().filter(|d| d.is_finite()).map(|d| d * d).sum();
            let from = scene.t[k * samples];
            let of = if series.len() > 1 { format!(" of {}", scene.label) } else { String::new() };
            minutes.push((square, format!("{from:.0} to {:.0} s{of}", from + d.len() as f64 * scene.dt)));
        }
    }
    let all: f64 = minutes.iter().map(|(square, _)| square).sum();
    minutes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let share = |(square, at): &(f64, String)| format!("{at} ({:.0} %)", 100.0 * square / all.max(1e-300));
    minutes.iter().take(3).map(share).collect::<Vec<_>>().join(", ")
}

fn described(
    question: &Question<'_>,
    model: &Fitted,
    adopted: &[Adopted],
    lap: Option<f64>,
) -> Result<Described, GainError> {
    let drives: Vec<&Drive> = question.train.iter().chain(question.holdout).collect();
    let one = |(drive, innovations): (&&Drive, &crate::evaluator::Innovations)| {
        let scene = Covariates::of(drive, lap);
        let mut d: Vec<f64> = innovations.state.iter().map(|state| state[2]).collect();
        d[..innovations.first.min(scene.len())].fill(f64::NAN);
        let (d_0, t_h) = (model.parameters.d_0, model.parameters.t_h);
        let wanted = (d_0 + t_h).is_finite();
        let gap_error = wanted.then(|| scene.s.iter().zip(&scene.v).map(|(s, v)| s - d_0 - t_h * v).collect());
        Series { error: deviation(&model.noise, scene.dt), scene, d, gap_error }
    };
    let series = drives.iter().zip(&model.innovations).map(one).collect();
    Ok(Described { series, runs: free(drives, [model.variant; 2], &model.parameters, adopted, question.bounds)? })
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
    fn a_gain_that_fails_leaves_the_cause() {
        let (gain, why) = settled(Err(crate::diagnose::DiagnoseError::NoData.into())).expect("no error");
        assert_eq!(gain, None);
        assert!(why.is_some_and(|why| why.starts_with("the gain could not be measured: no drive")));
        assert!(settled(Err(CalibrateError::Interrupted.into())).is_err());
    }
}
