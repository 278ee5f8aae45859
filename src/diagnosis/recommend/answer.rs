//! The answer as it stands in `diagnosis.json`, together with what the likelihood says.

use super::race::Entry;
use super::{Answer, Policy, Winner};
use crate::closed_loop::{DriveLoss, Horizon, Losses};
use crate::diagnose::Verdict;
use crate::extension::Extension;
use crate::judge::mean;
use crate::result::diagnosis::recommended::{ClosedLoopGain, Collisions, PerDrive, Recommended, RecommendedCause, Why};
use crate::result::diagnosis::{Outcome, ParameterEntry};

/// Standard errors to either side of an estimate that make up 95 %.
const TWO_SIDED: f64 = 1.96;

/// Puts the answer of the closed loop into a diagnosis: the verdict becomes `helps` where the likelihood names nothing and an extension
/// passes, and a base that could not be trusted becomes a note.
pub fn combine(outcome: &mut Outcome, answer: &Answer) {
    let named: Vec<String> =
        outcome.causes.iter().chain(&outcome.confounded_with).map(|cause| cause.family.clone()).collect();
    outcome.base_notes = notes(answer);
    if outcome.verdict == Verdict::BadBase {
        outcome.base_notes.insert(0, std::mem::take(&mut outcome.reason));
        outcome.verdict = Verdict::Unexplained;
        outcome.reason = "the base model is not one to find causes on; see what is said of it".to_owned();
    }
    let helps = answer.recommended.as_ref().map(|w| w.causes.clone()).or_else(|| answer.helps.first().cloned());
    if let Some(causes) = helps.filter(|_| !matches!(outcome.verdict, Verdict::Named | Verdict::Ambiguous)) {
        let names: Vec<&str> = causes.iter().map(|cause| cause.name.as_str()).collect();
        let but =
            if answer.recommended.is_some() { "" } else { ", but it does not meet all that a recommendation needs" };
        outcome.verdict = Verdict::Helps;
        outcome.reason = format!(
            "with {} the model follows drives better that it was not fitted to{but}; the likelihood names no cause ({})",
            names.join(" and "),
            outcome.reason
        );
    }
    outcome.recommended = answer.recommended.as_ref().and_then(|winner| recommended(answer, winner, &named));
    outcome.base_laws.clone_from(&answer.laws);
    outcome.closed_loop = answer.tried.clone();
    outcome.simulations += answer.simulations;
}

fn recommended(answer: &Answer, winner: &Winner, named: &[String]) -> Option<Recommended> {
    let (_, base) = answer.base.as_ref()?;
    let ([base, _], [own, _]) = (base, &winner.entries);
    let (before, after) = (base.held.roots(), own.held.roots());
    let differences: Vec<f64> = before.iter().zip(&after).map(|(a, b)| a - b).collect();
    let interval = answer.resamples[Horizon::Drive as usize].interval(&differences, 0.95);
    let confirmed = winner.causes.iter().all(|cause| named.iter().any(|name| name == cause.family()));
    Some(Recommended {
        causes: winner.causes.iter().map(|cause| entry(winner, cause)).collect(),
        why: if confirmed { Why::Confirmed } else { Why::Helps },
        horizon_s: winner.horizon.seconds(),
        gain: ClosedLoopGain {
            measure: "nrmse_sva_10s".to_owned(),
            base: mean(&before),
            extended: mean(&after),
            interval,
        },
        per_drive: per_drive(answer, &base.held, &own.held),
        confidence_set: winner.set.clone(),
        collisions: Collisions { base: base.held.failures(), extended: own.held.failures() },
    })
}

/// A cause with its parameters over whole drives, for which gain and collisions are told, and the intervals of a jackknife over the folds (Tukey 1958).
fn entry(winner: &Winner, cause: &'static Extension) -> RecommendedCause {
    let fitted = &winner.entries[Horizon::Drive as usize];
    let model = &winner.model.model;
    let parameter = |k: usize| {
        let (symbol, axis) = (model.symbols[k], &model.axes[k]);
        let value = fitted.whole.values[k];
        let half = TWO_SIDED * jackknife(fitted, k);
        ParameterEntry {
            name: symbol.name().to_owned(),
            value,
            unit: symbol.unit().to_owned(),
            interval: Some([(value - half).max(axis.lower), (value + half).min(axis.upper)]),
            at_bound: axis.at_bound(value),
        }
    };
    RecommendedCause {
        name: cause.name.clone(),
        meaning: cause.in_short().to_owned(),
        parameters: model.positions(cause).into_iter().map(parameter).collect(),
    }
}

/// Standard error of a parameter from the fits that left one fold out.
fn jackknife(entry: &Entry, k: usize) -> f64 {
    let values: Vec<f64> = entry.folds.iter().map(|fold| fold[k]).collect();
    let (centre, count) = (mean(&values), values.len() as f64);
    ((count - 1.0) / count * values.iter().map(|v| (v - centre).powi(2)).sum::<f64>()).sqrt()
}

/// NRMSE(s,v,a) by file, over the parts that were left out.
fn per_drive(answer: &Answer, base: &Losses, own: &Losses) -> Vec<PerDrive> {
    let drives = &answer.course.parts.drives;
    let mut paths: Vec<&str> = Vec::new();
    for drive in drives {
        if !paths.contains(&drive.file()) {
            paths.push(drive.file());
        }
    }
    let of = |losses: &Losses, path: &str| {
        let mine = |(drive, loss): (&crate::diagnose::Drive, &Option<DriveLoss>)| {
            if drive.file() == path { loss.clone() } else { None }
        };
        Losses { drives: drives.iter().zip(&losses.drives).map(mine).collect() }.nrmse()
    };
    paths
        .iter()
        .map(|path| PerDrive { path: (*path).to_owned(), base: of(base, path), extended: of(own, path) })
        .collect()
}

/// What is remarkable about the base: parameters that the data press against a bound, and runs that do not come through.
fn notes(answer: &Answer) -> Vec<String> {
    let mut notes = Vec::new();
    let Some((model, entries)) = &answer.base else {
        return notes;
    };
    let (model, values) = (&model.model, &entries[0].whole.values);
    for ((symbol, axis), value) in model.symbols.iter().zip(&model.axes).zip(values) {
        if axis.at_bound(*value) {
            notes.push(format!("{} lies on a bound of the search, {value:.4} {}", symbol.name(), symbol.unit()));
        }
    }
    let failures = entries[0].held.failures();
    if failures > 0 {
        notes.push(format!(
            "it runs into the car ahead, or cannot go on, {failures} times on drives that it was not fitted to"
        ));
    }
    if let Some(best) = answer.laws.first().filter(|law| law.gain >= Policy::DEFAULT.least_gain) {
        notes.push(format!(
            "{} has {:.0} % less error on drives that it was not fitted to",
            best.name,
            100.0 * best.gain
        ));
    }
    notes
}
