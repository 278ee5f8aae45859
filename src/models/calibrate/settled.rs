//! The reported score of a replicate.

use super::search::fall_to;
use super::{CalibrateError, Replicate, SearchSpace};
use crate::evaluator::{Case, EvaluateError, Score};
use crate::rescore;
use crate::score::GoodnessOfFit;

/// Largest number of candidates of a replicate that the reference checks.
pub(super) const ASKED: usize = 300;

/// Share of the best score by which one of them may be worse.
const NEAR: f64 = 0.05;

/// Gives a replicate its score by the f64 reference. If the best candidate fails there, the next best that does not takes its place: an
/// optimum often lies on the edge of the feasible region, where the last bit of a sum decides. If a search ended before the exact
/// comparison with its rival, the rival takes its place if it is better.
pub(super) fn settled(
    cases: &[Case],
    gof: &GoodnessOfFit,
    space: &SearchSpace,
    mut replicate: Replicate,
    rival: Option<Vec<f64>>,
) -> Result<Replicate, CalibrateError> {
    let score = |candidate: &[f64]| -> Result<Option<f64>, EvaluateError> {
        let score = rescore::score(cases, gof, &space.parameters(candidate))?;
        Ok(match score {
            Score::Value(score) if score.is_finite() => Some(score),
            _ => None,
        })
    };
    replicate.near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let limit = replicate.score + NEAR * replicate.score.abs();
    let near = |(score, candidate): &&(f64, Vec<f64>)| *score <= limit && *candidate != replicate.candidate;
    let others = replicate.near.iter().filter(near).map(|(_, candidate)| candidate);
    let (mut found, mut asked) = (None, 0);
    for candidate in std::iter::once(&replicate.candidate).chain(others).take(ASKED) {
        asked += 1;
        if let Some(score) = score(candidate)? {
            found = Some((candidate.clone(), score));
            break;
        }
    }
    // The first was counted when the search scored it; the others are an additional search.
    replicate.evaluations += asked - 1;
    // The curve ends with the reported score: from the last gain on, or, for another candidate than the best one, from now on.
    let curve = &mut replicate.convergence;
    if let Some((_, score)) = &found {
        let last = curve.pop().filter(|_| asked == 1);
        fall_to(curve, last.map_or(replicate.evaluations, |(evaluations, _)| evaluations), *score);
    }
    if let Some(rival) = rival
        && let Some(score) = score(&rival)?
        && found.as_ref().is_none_or(|(_, best)| score < *best)
    {
        fall_to(curve, replicate.evaluations, score);
        found = Some((rival, score));
    }
    replicate.score = f64::INFINITY;
    if let Some((candidate, score)) = found {
        (replicate.candidate, replicate.score) = (candidate, score);
    }
    Ok(replicate)
}
