//! Diagnoses one case and judges it by its truth.

use super::plan::DiagnosisTask;
use super::synthetic::planted;
use crate::batch::{Entry, Journal, JournalError};
use crate::catalog::Variant;
use crate::diagnose::describe::free::{free, nrmse_of};
use crate::diagnose::judge::oracle::{Known, known};
use crate::diagnose::{DiagnoseError, Inference, PROGRAM, Question, Verdict, infer};
use crate::extension::Extension;
use crate::race::{Policy, Request, Unit, race, rounds};
use crate::symbols::Parameters;
use crate::synthetic::Controller;
use crate::wgsl::{extension_named, library};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

/// The verdict on a case whose drives could not be made.
const FAILED: &str = "failed";
/// The verdict on a case whose diagnosis ended in an error.
const UNDIAGNOSED: &str = "undiagnosed";

/// Outcome of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisOutcome {
    pub program: String,
    /// The case.
    pub task: DiagnosisTask,
    /// Planted parameters, as `cause.parameter`.
    pub truth: BTreeMap<String, f64>,
    /// The verdict; `failed` if the drives could not be made, `undiagnosed` if the diagnosis ended in an error.
    pub verdict: String,
    pub reason: String,
    /// Adopted causes; they are names only if the verdict says so.
    pub adopted: Vec<String>,
    /// Causes that could replace them.
    pub confounded_with: Vec<String>,
    /// Causes reported as untestable.
    pub not_testable: Vec<String>,
    /// Estimates as `cause.parameter`: value and standard error.
    pub estimates: BTreeMap<String, [f64; 2]>,
    /// Simulated candidates, over one drive each.
    pub simulations: u64,
    /// CPU time \[s\].
    pub cpu_s: f64,
    /// A cause that was tried: gain on all training data, held out, threshold \[nats\], and why it was adopted or not.
    #[serde(default)]
    pub tried: Vec<(usize, String, [Option<f64>; 3], String)>,
    /// Inflation, missing acceleration \[m/s²\] and its time constant \[s\] of the base.
    #[serde(default)]
    pub base: [f64; 3],
    /// NRMSE(s,v,a) of free simulations of the hold-out, if an effect was named: base and extended model as the likelihood fits them to the
    /// training drives, and the truth.
    #[serde(default)]
    pub gain: Option<[f64; 3]>,
    /// Evidence for the truth, fitted from the planted values, in cases with one or two effects. Older journals lack it for effects that
    /// were named right.
    #[serde(default)]
    pub known: Option<Known>,
    /// Why `known` is missing; `None` if it is present, or was not requested.
    #[serde(default)]
    pub unknown: Option<String>,
    /// Causes that the race recommends from the training drives; empty if it recommends none, `None` if a journal lacks the entry.
    #[serde(default)]
    pub recommended: Option<Vec<String>>,
    /// Models that pass the test of the race at one horizon at least, with their p-values.
    #[serde(default)]
    pub passing: Vec<(Vec<String>, f64)>,
}

impl Entry for DiagnosisOutcome {
    type Key = DiagnosisTask;

    fn key(&self) -> &DiagnosisTask {
        &self.task
    }
}

impl DiagnosisOutcome {
    /// The journal of finished cases in a file, without those of another program or state of the diagnosis.
    ///
    /// # Errors
    /// As [`Journal::open`].
    pub fn journal(path: &Path) -> Result<Journal<Self>, JournalError> {
        let is_own = |outcome: &Self| outcome.program == *PROGRAM;
        Journal::open(path, None, &|line| Ok(serde_json::from_slice(line).ok().filter(is_own)))
    }

    /// Evidence of the likeliest cause in the first round, as a share of its threshold; 0 if no cause gained enough to be judged. A cause
    /// above the threshold that failed another check does not count, because no threshold would have rejected it.
    #[must_use]
    pub fn nearest(&self) -> f64 {
        let first = self.tried.iter().filter(|(round, ..)| *round == 1);
        let share = |(_, name, [_, evidence, need], _): &(usize, String, [Option<f64>; 3], String)| {
            let share = (*evidence)? / (*need)?;
            (share <= 1.0 || self.adopted.contains(name)).then_some(share)
        };
        first.filter_map(share).fold(0.0, f64::max)
    }

    /// A failed case; the results found so far are filled in.
    #[must_use]
    pub(super) fn failed(task: DiagnosisTask) -> DiagnosisOutcome {
        DiagnosisOutcome {
            program: PROGRAM.clone(),
            task,
            truth: BTreeMap::new(),
            verdict: FAILED.to_owned(),
            reason: String::new(),
            adopted: Vec::new(),
            confounded_with: Vec::new(),
            not_testable: Vec::new(),
            estimates: BTreeMap::new(),
            simulations: 0,
            cpu_s: 0.0,
            tried: Vec::new(),
            base: [0.0; 3],
            gain: None,
            known: None,
            unknown: None,
            recommended: None,
            passing: Vec::new(),
        }
    }

    /// True if the diagnosis ran, with any verdict.
    #[must_use]
    pub fn is_diagnosed(&self) -> bool {
        ![FAILED, UNDIAGNOSED].contains(&self.verdict.as_str())
    }

    /// True if the race recommends a cause of the family of each planted effect.
    #[must_use]
    pub fn is_recommended(&self) -> bool {
        let has = |truth: &String| self.recommended.iter().flatten().any(|name| family_of(name) == family_of(truth));
        !self.task.causes.is_empty() && self.task.causes.iter().all(has)
    }

    /// Gain of the extended model on the hold-out, as a share of the gain of the truth; `None` if nothing can be gained.
    #[must_use]
    pub fn share_of_gain(&self) -> Option<f64> {
        let [base, extended, truth] = self.gain?;
        (base > truth).then(|| (base - extended) / (base - truth))
    }

    /// True if every estimate of a planted parameter is within 10 % or three standard errors of it; `None` without any, for example if a
    /// relative of the cause was named.
    #[must_use]
    pub fn is_close(&self) -> Option<bool> {
        let planted = self.estimates.iter().filter_map(|(name, found)| Some((found, self.truth.get(name)?)));
        let close: Vec<bool> = planted
            .map(|([value, error], truth)| (value - truth).abs() <= (0.1 * truth.abs()).max(3.0 * error))
            .collect();
        (!close.is_empty()).then(|| close.iter().all(|close| *close))
    }

    /// True if the data show the planted effect: the truth, fitted from the planted values, gains more than the threshold on the training
    /// data, each of several causes beside the others. False if that fit failed. A case whose journal lacks the entry counts as shown.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        let gains = |known: &Known| {
            let whole = known.log_likelihoods[1] - known.log_likelihoods[0];
            known.parts.iter().chain([&whole]).all(|gain| *gain > known.threshold)
        };
        self.unknown.is_none() && self.known.as_ref().is_none_or(gains)
    }
}

/// How the benchmark counts a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Judgement {
    /// The truth, first and alone or first of a set; no name for a drive without an effect or with an absorbed one; `unexplained` for an
    /// effect outside the library or another law (or `bad_base`, if the car cannot have the law).
    Right,
    /// The truth of one effect is in the named set.
    InSet,
    /// One of two effects is named, and no unplanted one.
    Half,
    /// Nothing is named, although an effect is missing; or the diagnosis ended in an error.
    Silent,
    /// Another cause is named.
    Wrong,
    /// The drives could not be made.
    Failed,
}

fn family_of(name: &str) -> &str {
    extension_named(name).map_or(name, Extension::family)
}

/// Judges an outcome: wrong if any name is not planted. In gusts, the phase family counts as one name. Drag and a headway that depends
/// on speed always do, because they are the same in steady state.
#[must_use]
pub fn judge(outcome: &DiagnosisOutcome) -> Judgement {
    let named = ["named", "ambiguous"].contains(&outcome.verdict.as_str());
    match outcome.verdict.as_str() {
        FAILED => return Judgement::Failed,
        UNDIAGNOSED => return Judgement::Silent,
        _ => (),
    }
    let task = &outcome.task;
    let same = |name: &String, truth: &String| {
        let class = family_of(truth);
        let classed = class == "drag_or_headway" || (task.gusts_mps2 > 0.0 && class == "phase");
        name == truth || (classed && family_of(name) == class)
    };
    match task.kind.as_str() {
        "none" | "coloured" | "absorbed" if !named => Judgement::Right,
        "outside" | "family" if !named => match (outcome.verdict.as_str(), task.kind.as_str()) {
            ("unexplained", _) | ("bad_base", "family") => Judgement::Right,
            _ => Judgement::Silent,
        },
        "absorbed" if outcome.adopted.iter().all(|name| task.causes.contains(name)) => Judgement::Right,
        // Reported as one of several causes that cannot be distinguished, the planted one among them.
        "absorbed" if outcome.confounded_with.iter().any(|name| task.causes.contains(name)) => Judgement::InSet,
        "none" | "coloured" | "absorbed" | "outside" | "family" => Judgement::Wrong,
        _ if !named => Judgement::Silent,
        _ => {
            let hit = |name: &String| task.causes.iter().any(|truth| same(name, truth));
            let found = task.causes.iter().filter(|truth| outcome.adopted.iter().any(|name| same(name, truth))).count();
            let missed = outcome.adopted.iter().filter(|name| !hit(name)).count();
            // Reported as one of several causes that cannot be distinguished, the planted one among them.
            let in_set =
                task.causes.len() == 1 && outcome.adopted.len() == 1 && outcome.confounded_with.iter().any(hit);
            if missed == 0 && found == task.causes.len() {
                Judgement::Right
            } else if missed == 0 {
                Judgement::Half
            } else if in_set {
                Judgement::InSet
            } else {
                Judgement::Wrong
            }
        }
    }
}

/// Makes the drives of a case, diagnoses them, and runs the race for its recommendation.
#[must_use]
pub fn diagnose_task(task: &DiagnosisTask) -> DiagnosisOutcome {
    diagnosed(task, true)
}

/// The same without the race, which takes longer than the rest.
#[must_use]
pub fn infer_task(task: &DiagnosisTask) -> DiagnosisOutcome {
    diagnosed(task, false)
}

fn diagnosed(task: &DiagnosisTask, recommends: bool) -> DiagnosisOutcome {
    let mut outcome = DiagnosisOutcome::failed(task.clone());
    let drives = match planted(task) {
        Ok(drives) => drives,
        Err(error) => {
            outcome.reason = error.to_string();
            return outcome;
        }
    };
    for effect in &drives.effects {
        for (parameter, value) in effect.kind().parameters().iter().zip(effect.values()) {
            outcome.truth.insert(format!("{}.{}", effect.kind(), parameter.name), *value);
        }
    }
    // For the kind `family`, the right answer is the law of the next base in the list.
    let base = match (task.kind.as_str(), task.base.as_str()) {
        ("family", "idm") => "l-cth",
        ("family", "l-cth" | "l-idm") => "gipps",
        ("family", _) => "idm",
        (_, base) => base,
    };
    let variant: Variant = base.parse().expect("tasks name existing bases");
    let effort = task.effort.parse().unwrap_or_default();
    let causes: Vec<&'static Extension> = library().iter().copied().filter(|e| e.cause.is_some()).collect();
    let bounds = crate::calibrate::Overrides::new();
    let (train, holdout) = (&drives.train[..], &drives.holdout[..]);
    let question =
        Question { train, holdout, base: variant, effort, seed: task.seed, causes: &causes, bounds: &bounds };
    let clock = cpu_time::ProcessTime::now();
    let inference = infer(&question, &mut |_| ControlFlow::Continue(()));
    let found = inference.as_ref().map_or(&[][..], Inference::named);
    let likely: Vec<&'static Extension> = found.iter().map(|adopted| adopted.extension).collect();
    let request = Request {
        drives: train,
        unit: Unit::Recording,
        base: variant,
        causes: &causes,
        named: &likely,
        sensor_noise: inference.as_ref().ok().and_then(Inference::sensor_noise),
        bounds: &bounds,
        seed: task.seed,
        rounds: rounds(effort),
    };
    let answer = recommends.then(|| race(&request, &Policy::DEFAULT, &mut |_| ControlFlow::Continue(())));
    outcome.cpu_s = clock.elapsed().as_secs_f64();
    fill(&mut outcome, &inference);
    if let Some(Ok(answer)) = answer {
        let passing = answer.tried.trials.iter().filter(|trial| trial.passes);
        outcome.passing = passing.map(|trial| (trial.causes.clone(), trial.probability)).collect();
        outcome.recommended = Some(answer.recommended().iter().map(|cause| cause.name.clone()).collect());
        if let Some(named) = answer.named.filter(|_| likely.is_empty()) {
            outcome.adopted = named.causes.iter().map(|cause| cause.name.clone()).collect();
            outcome.confounded_with = named.rivals.iter().map(|rival| rival.cause.name.clone()).collect();
            outcome.verdict = if named.rivals.is_empty() { "named" } else { "ambiguous" }.to_owned();
        }
    }
    if ["one", "pair"].contains(&task.kind.as_str()) {
        let mut values = law(&drives.controller);
        let mut planted = Vec::new();
        for effect in &drives.effects {
            planted.extend(extension_named(effect.kind().into_str()));
            let names = effect.kind().parameters().iter().map(|parameter| parameter.name.to_owned());
            values.extend(names.zip(effect.values().iter().copied()));
        }
        if let (Ok(inference), Judgement::Right) = (&inference, judge(&outcome)) {
            outcome.gain = gains(&question, inference, &planted, &values);
        }
        // Also for right names: whether the data show an effect must not depend on the answer.
        (outcome.known, outcome.unknown) = match known(&question, &planted, &values) {
            Ok(Some(known)) => (Some(known), None),
            Ok(None) => (None, Some("neither the base nor the truth can be fitted to the drives".to_owned())),
            Err(error) => (None, Some(error.to_string())),
        };
    }
    outcome
}

/// See [`DiagnosisOutcome::gain`]; `None` if a simulation ends early.
fn gains(
    question: &Question<'_>,
    inference: &Inference,
    planted: &[&'static Extension],
    values: &[(String, f64)],
) -> Option<[f64; 3]> {
    let (base, extended) = (&inference.base, &inference.extended);
    let variant = planted.iter().try_fold(question.base, |variant, cause| variant.with(cause)).ok()?;
    let mut parameters = Parameters::NONE;
    for symbol in variant.parameters() {
        parameters.set(symbol, values.iter().find(|(name, _)| name == symbol.name())?.1);
    }
    let models = [
        ([base.variant, extended.variant], &base.parameters),
        ([extended.variant, variant], &extended.parameters),
        ([variant, extended.variant], &parameters),
    ];
    let error = |(compared, parameters): ([Variant; 2], &Parameters)| {
        nrmse_of(&free(question.holdout, compared, parameters, &inference.adopted, question.bounds).ok()?)
    };
    let [base, extended, truth] = models.map(error);
    Some([base?, extended?, truth?])
}

/// The planted parameters of the law, by their names in the catalogue.
fn law(controller: &Controller) -> Vec<(String, f64)> {
    let written = serde_json::to_value(controller).expect("names and numbers");
    let fields = written.as_object().into_iter().flatten();
    fields.filter_map(|(name, value)| Some((name.clone(), value.as_f64()?))).collect()
}

/// Fills in the answer of a diagnosis, or why there is none.
fn fill(outcome: &mut DiagnosisOutcome, inference: &Result<Inference, DiagnoseError>) {
    let inference = match inference {
        Ok(inference) => inference,
        Err(error) => {
            outcome.verdict = UNDIAGNOSED.to_owned();
            outcome.reason = error.to_string();
            return;
        }
    };
    outcome.verdict = inference.verdict.into_str().to_owned();
    outcome.reason.clone_from(&inference.reason);
    outcome.simulations = inference.simulations;
    let finite = |x: f64| x.is_finite().then_some(x);
    let tried = inference.ladder.iter();
    outcome.tried = tried
        .map(|row| {
            let nats = [row.gain, row.evidence, row.threshold].map(finite);
            (row.round, row.name.clone(), nats, row.fate.to_string())
        })
        .collect();
    let base = &inference.base;
    outcome.base = [base.inflation, base.noise.sigma_d, base.noise.tau_d];
    outcome.not_testable = inference.not_testable.iter().map(|cause| cause.name.clone()).collect();
    if matches!(inference.verdict, Verdict::Named | Verdict::Ambiguous) {
        let name = |cause: &crate::diagnose::Adopted| cause.extension.name.clone();
        outcome.adopted = inference.adopted.iter().map(name).collect();
        outcome.confounded_with = inference.confounded_with.iter().map(name).collect();
        for cause in &inference.adopted {
            for p in cause.parameters.iter().filter(|p| p.error.is_finite()) {
                outcome.estimates.insert(format!("{}.{}", cause.extension.name, p.name), [p.value, p.error]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(kind: &str, causes: &[&str], adopted: &[&str], confounded_with: &[&str]) -> DiagnosisOutcome {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let task = DiagnosisTask {
            kind: kind.to_owned(),
            base: "idm".to_owned(),
            causes: names(causes),
            rms_mps: 0.1,
            gusts_mps2: 0.0,
            duration_s: 900.0,
            seed: 1,
            effort: "quick".to_owned(),
        };
        let verdict = if adopted.is_empty() { "nothing" } else { "named" }.to_owned();
        let (adopted, confounded_with) = (names(adopted), names(confounded_with));
        DiagnosisOutcome { verdict, adopted, confounded_with, ..DiagnosisOutcome::failed(task) }
    }

    #[test]
    fn a_name_that_was_not_planted_is_wrong_whatever_stands_beside_it() {
        let pair =
            |adopted: &[&str], others: &[&str]| judge(&outcome("pair", &["grade", "dead_zone"], adopted, others));
        assert_eq!(pair(&["dead_zone", "grade"], &[]), Judgement::Right);
        assert_eq!(pair(&["grade"], &[]), Judgement::Half);
        assert_eq!(pair(&["grade"], &["dead_zone"]), Judgement::Half);
        assert_eq!(pair(&["grade", "periodic"], &[]), Judgement::Wrong);
        assert_eq!(pair(&["grade", "periodic"], &["dead_zone"]), Judgement::Wrong);
        assert_eq!(pair(&[], &[]), Judgement::Silent);
        let one = |adopted: &[&str], others: &[&str]| judge(&outcome("one", &["grade"], adopted, others));
        assert_eq!(one(&["grade"], &["periodic"]), Judgement::Right);
        assert_eq!(one(&["periodic"], &["grade"]), Judgement::InSet);
        assert_eq!(one(&["periodic"], &[]), Judgement::Wrong);
        assert_eq!(one(&["grade", "periodic"], &[]), Judgement::Wrong);
    }

    #[test]
    fn a_diagnosis_that_ends_in_an_error_is_a_miss() {
        for kind in ["one", "none", "outside"] {
            let mut case = outcome(kind, &["grade"], &["grade"], &[]);
            fill(&mut case, &Err(DiagnoseError::NoData));
            assert_eq!((judge(&case), case.is_diagnosed()), (Judgement::Silent, false), "{kind}");
            assert!(case.reason.contains("no drive to train on"), "{}", case.reason);
        }
        let failed = DiagnosisOutcome::failed(outcome("one", &["grade"], &[], &[]).task);
        assert_eq!((judge(&failed), failed.is_diagnosed()), (Judgement::Failed, false));
    }

    #[test]
    fn what_cannot_be_known_is_not_shown() {
        let old = outcome("one", &["grade"], &["grade"], &[]);
        let json = serde_json::to_value(&old).expect("finite numbers");
        let mut line = json.as_object().expect("an object").clone();
        line.remove("unknown").expect("written");
        line.remove("known").expect("written");
        assert_eq!(serde_json::from_value::<DiagnosisOutcome>(line.into()).expect("an old line"), old);
        assert!(old.is_shown(), "as it was counted when it was written");
        let unknown = DiagnosisOutcome { unknown: Some("the base cannot be driven".to_owned()), ..old };
        assert!(!unknown.is_shown());
    }
}
