//! One case: diagnosed, and judged by its truth.

use super::plan::DiagnosisTask;
use super::plant::planted;
use crate::catalog::Variant;
use crate::diagnose::free::free;
use crate::diagnose::gain::{GainSettings, gain, nrmse_of};
use crate::diagnose::known::{Known, known};
use crate::diagnose::{Effort, Inference, PROGRAM, Question, Verdict, family, infer};
use crate::extension::Extension;
use crate::plant::Controller;
use crate::symbols::Parameters;
use crate::wgsl::{extension_named, library};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// What a case came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisOutcome {
    /// The program.
    pub program: String,
    /// The case.
    pub task: DiagnosisTask,
    /// Planted parameters, as `cause.parameter`.
    pub truth: BTreeMap<String, f64>,
    /// The verdict; `failed` if the case could not be made or diagnosed.
    pub verdict: String,
    /// Why.
    pub reason: String,
    /// Adopted causes; names only where the verdict names them.
    pub adopted: Vec<String>,
    /// Causes that could be in their place.
    pub confounded_with: Vec<String>,
    /// Causes said to be untestable.
    pub not_testable: Vec<String>,
    /// Estimates as `cause.parameter`: value and standard error.
    pub estimates: BTreeMap<String, [f64; 2]>,
    /// Simulated candidates, over one drive each.
    pub simulations: u64,
    /// CPU time \[s\].
    pub cpu_s: f64,
    /// What was tried: cause, gain on all training data, held out, threshold \[nats\], and why it was adopted or not.
    #[serde(default)]
    pub tried: Vec<(usize, String, [Option<f64>; 3], String)>,
    /// Inflation, missing acceleration \[m/s²\] and its time constant \[s\] of the base.
    #[serde(default)]
    pub base: [f64; 3],
    /// Of a named effect, NRMSE(s,v,a) of free simulations of the hold-out: base and extended model, both calibrated on the training
    /// drives, and the truth.
    #[serde(default)]
    pub gain: Option<[f64; 3]>,
    /// Of a case that was not named right: the evidence for the truth, had the search found it.
    #[serde(default)]
    pub known: Option<Known>,
}

impl DiagnosisOutcome {
    /// How near the likeliest cause came to a name: its evidence as a share of what it needed, in the first round; 0 where none gained
    /// enough to be judged.
    #[must_use]
    pub fn nearest(&self) -> f64 {
        let first = self.tried.iter().filter(|(round, ..)| *round == 1);
        let share =
            |(_, _, [_, evidence, need], _): &(usize, String, [Option<f64>; 3], String)| Some((*evidence)? / (*need)?);
        first.filter_map(share).fold(0.0, f64::max)
    }

    /// Of a case that came to nothing; what is found is filled in.
    #[must_use]
    pub(super) fn failed(task: DiagnosisTask) -> DiagnosisOutcome {
        DiagnosisOutcome {
            program: PROGRAM.clone(),
            task,
            truth: BTreeMap::new(),
            verdict: "failed".to_owned(),
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
        }
    }

    /// What the extended model gains on the hold-out, as a share of what the truth gains; `None` where nothing can be gained.
    #[must_use]
    pub fn share_of_gain(&self) -> Option<f64> {
        let [base, extended, truth] = self.gain?;
        (base > truth).then(|| (base - extended) / (base - truth))
    }

    /// True if every estimate of a planted parameter is within 10 % or three standard errors of it; `None` if there is none, as where a
    /// relative of the cause was named.
    #[must_use]
    pub fn is_close(&self) -> Option<bool> {
        let planted = self.estimates.iter().filter_map(|(name, found)| Some((found, self.truth.get(name)?)));
        let close: Vec<bool> = planted
            .map(|([value, error], truth)| (value - truth).abs() <= (0.1 * truth.abs()).max(3.0 * error))
            .collect();
        (!close.is_empty()).then(|| close.iter().all(|close| *close))
    }

    /// True if the data show what was planted: it was named right, or the truth, fitted from its own values, gains more than the
    /// threshold on the training data; of several causes each beside the others.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        let gains = |known: &Known| {
            let whole = known.log_likelihoods[1] - known.log_likelihoods[0];
            known.parts.iter().chain([&whole]).all(|gain| *gain > known.threshold)
        };
        self.known.as_ref().is_none_or(gains)
    }
}

/// How a case is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Judgement {
    /// The truth, first and alone or first of a set; for a drive without an effect, or with an absorbed one: silence; for an effect outside
    /// the library or another law: `unexplained` (or, for a law that cannot be the car's at all, `bad_base`).
    Right,
    /// The truth is in the named set.
    InSet,
    /// Nothing is named, and something is missing.
    Silent,
    /// Something else is named.
    Wrong,
    /// The case could not be made.
    Failed,
}

fn family_of(name: &str) -> &str {
    extension_named(name).map_or(name, family)
}

/// Judges an outcome: wrong as soon as a name is given that is not planted. The phase family counts as one name in gusts, and
/// drag and a headway that depends on speed, which are the same in steady state, always.
#[must_use]
pub fn judge(outcome: &DiagnosisOutcome) -> Judgement {
    let named = ["named", "ambiguous"].contains(&outcome.verdict.as_str());
    if outcome.verdict == "failed" {
        return Judgement::Failed;
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
        // Said to be one of several that cannot be told apart, the planted one among them.
        "absorbed" if outcome.confounded_with.iter().any(|name| task.causes.contains(name)) => Judgement::InSet,
        "none" | "coloured" | "absorbed" | "outside" | "family" => Judgement::Wrong,
        _ if !named => Judgement::Silent,
        _ => {
            let hit = |name: &String| task.causes.iter().any(|truth| same(name, truth));
            let found = task.causes.iter().filter(|truth| outcome.adopted.iter().any(|name| same(name, truth))).count();
            let missed = outcome.adopted.iter().filter(|name| !hit(name)).count();
            let in_set = task
                .causes
                .iter()
                .all(|truth| outcome.adopted.iter().chain(&outcome.confounded_with).any(|name| same(name, truth)));
            if missed == 0 && found == task.causes.len() {
                Judgement::Right
            } else if in_set && outcome.adopted.len() <= task.causes.len() || missed == 0 {
                Judgement::InSet
            } else {
                Judgement::Wrong
            }
        }
    }
}

/// Makes the drives of a case and diagnoses them.
#[must_use]
pub fn diagnose_task(task: &DiagnosisTask) -> DiagnosisOutcome {
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
    // Another family: the law of the neighbour in the list is blamed.
    let base = match (task.kind.as_str(), task.base.as_str()) {
        ("family", "idm") => "l-cth",
        ("family", "l-cth") => "gipps",
        ("family", _) => "idm",
        (_, base) => base,
    };
    let variant: Variant = base.parse().expect("tasks name bases that there are");
    let effort = match task.effort.as_str() {
        "quick" => Effort::Quick,
        "thorough" => Effort::Thorough,
        _ => Effort::Normal,
    };
    let causes: Vec<&'static Extension> = library().iter().copied().filter(|e| e.cause.is_some()).collect();
    let bounds = crate::calibrate::Overrides::new();
    let (train, holdout) = (&drives.train[..], &drives.holdout[..]);
    let question = Question {
        train,
        holdout,
        base: variant,
        effort,
        seed: task.seed,
        causes: &causes,
        bounds: &bounds,
        kept: None,
    };
    let clock = cpu_time::ProcessTime::now();
    let inference = match infer(&question, &mut |_| ControlFlow::Continue(())) {
        Ok(inference) => inference,
        Err(error) => {
            outcome.reason = error.to_string();
            return outcome;
        }
    };
    fill(&mut outcome, &inference);
    outcome.cpu_s = clock.elapsed().as_secs_f64();
    if ["one", "pair"].contains(&task.kind.as_str()) {
        let mut values = law(&drives.controller);
        let mut planted = Vec::new();
        for effect in &drives.effects {
            planted.extend(extension_named(effect.kind().name()));
            let names = effect.kind().parameters().iter().map(|parameter| parameter.name.to_owned());
            values.extend(names.zip(effect.values().iter().copied()));
        }
        if judge(&outcome) == Judgement::Right {
            outcome.gain = gains(&question, &inference, &planted, &values);
        } else {
            outcome.known = known(&question, &planted, &values).ok().flatten();
        }
    }
    outcome
}

/// See [`DiagnosisOutcome::gain`]; `None` where a simulation breaks off.
fn gains(
    question: &Question<'_>,
    inference: &Inference,
    planted: &[&'static Extension],
    values: &[(String, f64)],
) -> Option<[f64; 3]> {
    let settings = GainSettings::of(question.effort, question.seed);
    let models = [&inference.base, &inference.extended];
    let found = gain(question, models, &inference.adopted, &settings, &mut |_| ControlFlow::Continue(())).ok()?;
    let variant = planted.iter().try_fold(question.base, |variant, cause| variant.with(cause)).ok()?;
    let mut parameters = Parameters::NONE;
    for symbol in variant.parameters() {
        parameters.set(symbol, values.iter().find(|(name, _)| name == symbol.name())?.1);
    }
    let truth = free(question.holdout, variant, &parameters, &inference.adopted).ok()?;
    Some([found.base?, found.extended?, nrmse_of(question.holdout, &truth)?])
}

/// The planted parameters of the law, by their names in the catalogue.
fn law(controller: &Controller) -> Vec<(String, f64)> {
    let named = match *controller {
        Controller::Idm { v_0, t_h, d_0, a_max, a_min, delta } => {
            vec![("v_0", v_0), ("t_h", t_h), ("d_0", d_0), ("a_max", a_max), ("a_min", a_min), ("delta", delta)]
        }
        Controller::Gipps { v_0, t_h, d_0, a_max, a_min, a_hat_min, theta } => vec![
            ("v_0", v_0),
            ("t_h", t_h),
            ("d_0", d_0),
            ("a_max", a_max),
            ("a_min", a_min),
            ("a_hat_min", a_hat_min),
            ("theta", theta),
        ],
        Controller::Linear { v_0, t_h, d_0, k_s, k_v, k_0 } => {
            vec![("v_0", v_0), ("t_h", t_h), ("d_0", d_0), ("k_s", k_s), ("k_v", k_v), ("k_0", k_0)]
        }
    };
    named.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

fn fill(outcome: &mut DiagnosisOutcome, inference: &Inference) {
    outcome.verdict = inference.verdict.name().to_owned();
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
