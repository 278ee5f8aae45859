//! Whether the hold-out objects to a cause.

use super::fate::Objection;
use crate::diagnose::likelihood::streams;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, FittedModel, Transferred};
use crate::extension::Extension;
use crate::optimize::stream;
use crate::symbols::SearchKind;
use rand::RngExt;

/// Bootstraps of the hold-out.
const DRAWS: u64 = 200;

/// Share of block bootstraps of the hold-out in which a candidate beats another; 1 without a hold-out. With it, what the cause
/// changes there \[nats\]. Draws in which it changes next to nothing, for it acts in a few blocks only that are not among them, have
/// no vote. `alone` is how `current` does on the whole hold-out without knowing of the candidate, where that is known already.
///
/// # Errors
/// As [`FittedModel::transfer`].
pub fn transfers(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &Extension,
    current: &FittedModel,
    alone: Option<&Transferred>,
) -> Result<(f64, f64), DiagnoseError> {
    if setting.question.holdout.is_empty() {
        return Ok((1.0, 0.0));
    }
    let mine = match alone {
        Some(alone) => candidate.transfer(setting, Some(alone))?,
        None => candidate.transfer(setting, Some(&current.transfer(setting, None)?))?,
    };
    let theirs = current.transfer(setting, Some(&mine))?;
    let scores = mine.scores(setting)?.into_iter().flatten().zip(theirs.scores(setting)?.into_iter().flatten());
    let gains: Vec<f64> = scores.map(|(a, b)| a - b).collect();
    let changes = mine.changed_by(setting, cause)?;
    let changed: f64 = changes.iter().sum();
    let vote = |draw: u64| {
        let mut rng = stream(setting.question.seed, streams::HOLDOUT, 0, draw);
        let drawn: Vec<usize> = (0..gains.len()).map(|_| rng.random_range(0..gains.len())).collect();
        let sum = |of: &[f64]| drawn.iter().map(|k| of[*k]).sum::<f64>();
        (sum(&changes) >= POLICY.shown.min(changed)).then(|| sum(&gains) > 0.0)
    };
    let votes: Vec<bool> = (0..DRAWS).filter_map(vote).collect();
    let better = votes.iter().filter(|better| **better).count();
    Ok((if votes.is_empty() { 1.0 } else { better as f64 / votes.len() as f64 }, changed))
}

/// The objection of the hold-out, if any; events need not recur there, nor must it reach what a cause changes. `alone` as in
/// [`transfers`].
///
/// # Errors
/// As [`transfers`].
pub fn gate(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &Extension,
    current: &FittedModel,
    alone: Option<&Transferred>,
) -> Result<Option<Objection>, DiagnoseError> {
    if !need_recur(cause) {
        return Ok(None);
    }
    let (share, changed) = transfers(setting, candidate, cause, current, alone)?;
    Ok((share < POLICY.transfers && changed >= POLICY.shown).then_some(Objection::NoTransfer { share }))
}

/// False for an event.
fn need_recur(cause: &Extension) -> bool {
    !matches!(cause.search(), SearchKind::Event | SearchKind::Stretch)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;

    /// What a drag changes there can be said; of an event the hold-out says nothing.
    #[test]
    fn an_event_need_not_recur() {
        let (train, holdout) = ([made_up::drive("made_up.csv", 0.0)], [made_up::drive("held.csv", 0.0)]);
        let bounds = Overrides::new();
        let question = made_up::question(&train, &holdout, &bounds);
        let setting = Context::new(&question, None);
        let current = made_up::candidate(&train, &[]);
        let objects = |name: &str| {
            let candidate = made_up::candidate(&train, &[name]);
            gate(&setting, &candidate, made_up::cause(name), &current, None).expect("it runs").is_some()
        };
        assert_eq!(["aero_drag", "set_speed_change"].map(objects), [true, false]);
    }
}
