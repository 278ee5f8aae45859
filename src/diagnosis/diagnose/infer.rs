//! The whole inference: base, rounds, removal of superfluous causes, unexplained structure, other laws, verdict.

use crate::diagnose::answer::Answer;
use crate::diagnose::describe::specification::leftovers;
use crate::diagnose::likelihood::model::{LEAD, Model, is_lead};
use crate::diagnose::outcome::{Adopted, Estimate, Fitted, Inference, Verdict};
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::{DiagnoseError, Effort, Progress, Question};
use crate::diagnose::search::base::{Calibrated, calibrate_base, contradiction};
use crate::diagnose::search::fitted_model::{Context, FittedModel};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::diagnose::select::adopt::{ROUNDS, Rival, State};
use crate::diagnose::select::other_laws::others;
use crate::diagnose::watching::Watching;
use crate::extension::Extension;
use crate::wgsl::extension_named;
use std::ops::ControlFlow;

/// Names what a base model lacks on some drives.
///
/// # Errors [`DiagnoseError`]: no data, a model that cannot run on them, or [`DiagnoseError::Stopped`] when `progress` breaks.
pub fn infer(
    question: &Question<'_>,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Inference, DiagnoseError> {
    infer_with(question, &SearchBudget::of(question.effort), progress)
}

/// The same with an explicit budget instead of that of the effort.
///
/// # Errors
/// As [`infer`].
pub fn infer_with(
    question: &Question<'_>,
    spending: &SearchBudget,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Inference, DiagnoseError> {
    if question.train.is_empty() {
        return Err(DiagnoseError::NoData);
    }
    let watching = Watching::new(progress);
    let tell = |done: f64, stage: &str| watching.show(done, stage);
    let go_on = || watching.go_on();
    let setting = Context { go_on: &go_on, ..Context::new(question, extension_named(LEAD)) };
    tell(0.0, "calibrating the base model")?;
    let base = calibrate_base(&setting, question.base, spending)?
        .ok_or_else(|| DiagnoseError::NoBase { variant: question.base.name() })?;
    let Calibrated { candidate, replicates } = base;
    let agrees = replicates.len() > 1 && replicates[0] - replicates[1] < POLICY.bases_agree;
    let noise_at_start = candidate.fit.point.noise;
    let mut state = State::begin(&setting, candidate)?;
    tell(0.1, "round 1: trying every cause")?;
    let tried = state.fit_all(&setting, spending)?;
    let judged = state.judge(&setting, 1, tried, spending)?;
    // The base is now the best fit without causes, with which its causes were compared.
    let base = snapshot(&state.current, &setting, state.inflation)?;
    if state.adopt(judged) {
        rounds(&mut state, &setting, spending, &mut |share, stage| tell(0.1 + 0.65 * share, stage))?;
    }
    tell(0.75, "removing superfluous causes")?;
    state.prune(&setting, spending)?;
    tell(0.85, "testing what remains")?;
    let left = leftovers(&setting, &state.current, state.need, state.inflation)?;
    tell(0.9, "comparing other base models")?;
    let others = others(&setting, spending)?;
    let extended = snapshot(&state.current, &setting, state.inflation)?;
    let lost = !agrees && state.current.causes.is_empty();
    let contradicted = contradiction(&setting, &state.current).or_else(|| lost.then(|| disagreement(&replicates)));
    let answer =
        Answer { state: &state, left: &left, others: &others, contradicted, sigma_at_start: noise_at_start.sigma_d };
    let (verdict, mut reason, mut left_over) = answer.verdict();
    if state.cut_short {
        reason.push_str(&format!("; {}", cut_short(question.effort)));
    }
    left_over.extend(left.list.iter().cloned());
    let named = matches!(verdict, Verdict::Named | Verdict::Ambiguous);
    let rival = |r: &Rival| Adopted {
        instead_of: Some(r.of),
        ..adopted(&setting, &r.candidate, r.cause, r.evidence, r.need, state.inflation)
    };
    let confounded_with = state.rivals().filter(|_| named).map(rival).collect();
    let adopted: Vec<Adopted> = state
        .current
        .causes
        .iter()
        .zip(&state.evidence)
        .map(|(cause, (evidence, need))| adopted(&setting, &state.current, cause, *evidence, *need, state.inflation))
        .collect();
    tell(1.0, "done")?;
    Ok(Inference {
        base,
        extended,
        verdict,
        reason,
        adopted,
        confounded_with,
        not_testable: state.not_testable.clone(),
        untried: state.untried.clone(),
        left_over,
        ladder: state.ladder.clone(),
        simulations: setting.simulated(),
        complete: !state.cut_short,
    })
}

/// Rounds until one adopts nothing or the simulation limit is reached; `tell` receives the finished share of them.
fn rounds(
    state: &mut State,
    setting: &Context<'_>,
    spending: &SearchBudget,
    tell: &mut dyn FnMut(f64, &str) -> Result<(), DiagnoseError>,
) -> Result<(), DiagnoseError> {
    let share = |round: usize| (round - 1) as f64 / ROUNDS as f64;
    for round in 2..=ROUNDS {
        state.cut_short = state.has_enough(setting.simulated(), spending);
        if state.cut_short {
            break;
        }
        tell(share(round), &format!("round {round}: trying every cause"))?;
        let tried = state.fit_all(setting, &spending.further())?;
        let judged = state.judge(setting, round, tried, spending)?;
        if !state.adopt(judged) {
            break;
        }
    }
    Ok(())
}

fn disagreement(replicates: &[f64]) -> String {
    if replicates.len() < 2 {
        return "only one calibration of the base succeeded, so nothing confirms it; give longer data or tighter bounds"
            .to_owned();
    }
    let spread = replicates.first().zip(replicates.last()).map_or(0.0, |(a, b)| a - b);
    format!(
        "{} calibrations of the base from different starts do not agree: their log-likelihoods spread over {spread:.0} nats; give \
         longer data or tighter bounds",
        replicates.len()
    )
}

fn adopted(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &'static Extension,
    evidence: f64,
    threshold: f64,
    inflation: f64,
) -> Adopted {
    let event = candidate.model.events.iter().find(|event| event.extension == cause);
    Adopted {
        extension: cause,
        instead_of: None,
        family: cause.family().to_owned(),
        parameters: candidate.model.positions(cause).into_iter().map(|k| estimate(candidate, k, inflation)).collect(),
        evidence,
        threshold,
        recording: event
            .and_then(|event| setting.question.train.get(event.drive))
            .map(crate::diagnose::drive::Drive::recording),
    }
}

fn estimate(candidate: &FittedModel, k: usize, inflation: f64) -> Estimate {
    let (symbol, axis, value) = (candidate.model.symbols[k], candidate.model.axes[k], candidate.fit.point.values[k]);
    let error = candidate.fit.errors[k] * inflation.sqrt();
    Estimate {
        name: symbol.name().to_owned(),
        unit: symbol.unit().to_owned(),
        value,
        error,
        interval: [(value - 2.0 * error).max(axis.lower), (value + 2.0 * error).min(axis.upper)],
        at_bound: axis.at_bound(value) && !is_lead(symbol),
    }
}

/// The public form of a fit.
fn snapshot(candidate: &FittedModel, setting: &Context<'_>, inflation: f64) -> Result<Fitted, DiagnoseError> {
    let point = candidate.fit.point.clone();
    let mut innovations = candidate.model.innovations(&point.values, &point.noise)?;
    if !setting.question.holdout.is_empty() {
        let model: Model = setting.held_out(candidate.variant, &candidate.model.events)?;
        innovations.append(&mut model.innovations(&point.values, &point.noise)?);
    }
    Ok(Fitted {
        variant: candidate.variant,
        parameters: candidate.model.parameters(&point.values),
        estimates: (0..candidate.model.symbols.len()).map(|k| estimate(candidate, k, inflation)).collect(),
        noise: point.noise,
        log_likelihood: candidate.fit.log_likelihood,
        inflation,
        innovations,
    })
}

/// The message that more may be missing, if the search ended early.
fn cut_short(effort: Effort) -> String {
    let next = if effort == Effort::Quick { Effort::Normal } else { Effort::Thorough };
    format!(
        "the search for further causes stopped at the simulation limit of `--effort {}`; `--effort {}` continues it",
        effort.into_str(),
        next.into_str()
    )
}
