//! Selects the cause that a round adopts, and decides on the others.

use super::State;
use crate::diagnose::judge::Judgement;
use crate::diagnose::judge::decision::{Decision, Rejection};
use crate::diagnose::judge::evidence::{is_hopeful, margin};
use crate::diagnose::outcome::Tried;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, CrossValidated};
use crate::diagnose::search::screen::ScreenedCause;
use crate::diagnose::search::search_budget::SearchBudget;

/// A cause that gains enough on data that it was not fitted to.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// Position among those tried.
    i: usize,
    /// Its evidence \[nats\].
    counts: f64,
}

/// Causes that passed every check, and those that another calibration absorbs; the likeliest first.
#[derive(Debug, Default)]
struct Candidates {
    sound: Vec<Candidate>,
    absorbed: Vec<Candidate>,
}

impl State {
    /// Position of the cause to adopt; decides on all others.
    pub(super) fn choose(
        &mut self,
        setting: &Context<'_>,
        round: usize,
        tried: &[ScreenedCause],
        held: &[Option<CrossValidated>],
        spending: &SearchBudget,
    ) -> Result<Option<usize>, DiagnoseError> {
        let (mut rows, mut judgements) = (Vec::new(), Vec::new());
        for (i, ((cause, candidate), held)) in tried.iter().zip(held).enumerate() {
            let gain = candidate.fit.log_likelihood - self.current.fit.log_likelihood;
            let judge = |held| Judgement::of(setting, cause, (candidate, held), (&self.current, &self.held), self.need);
            let judgement = held.as_ref().map(judge);
            rows.push(Tried {
                round,
                name: cause.name.clone(),
                gain,
                evidence: judgement.as_ref().map_or(f64::NAN, |judgement| judgement.evidence.counts()),
                folds: judgement.as_ref().map_or([f64::NAN; 2], |judgement| judgement.evidence.folds),
                threshold: self.need,
                checks: Vec::new(),
                fate: Decision::unjudged(is_hopeful(gain, self.need), spending.short_list),
            });
            judgements.extend(judgement.map(|judgement| (i, judgement)));
        }
        judgements.sort_by(|(_, a), (_, b)| b.evidence.counts().total_cmp(&a.evidence.counts()));
        let mut candidates = Candidates::default();
        let mut stopped = Vec::new();
        // Scores of the present model on the hold-out, shared by all comparisons.
        let mut alone = None;
        for (i, mut judgement) in judgements {
            let this = Candidate { i, counts: judgement.evidence.counts() };
            let behind = |best: &&Candidate| self.is_behind(best, &this);
            // Once a cause has passed, only those that are as likely matter.
            let (ahead, absorbed) =
                (candidates.sound.first().filter(behind), candidates.absorbed.first().filter(behind));
            if ahead.or(absorbed).is_none() {
                judgement.ask_holdout(setting, &mut alone)?;
            }
            rows[i].checks.clone_from(&judgement.checks);
            match (judgement.objection, ahead, absorbed) {
                (Some(objection), ..) => {
                    if matches!(objection, Rejection::Absorbed { .. }) {
                        candidates.absorbed.push(this);
                    }
                    rows[i].fate = Decision::Stopped(objection.clone());
                    stopped.push((judgement.cause, this.counts, self.need, objection));
                }
                (None, Some(_), _) => rows[i].fate = Decision::LessLikely,
                // A cause that another calibration absorbs cannot be named, and neither can a less likely one.
                (None, None, Some(best)) => {
                    rows[i].fate = Decision::LessLikelyThanAbsorbed { other: tried[best.i].0.name.clone() };
                }
                (None, None, None) => candidates.sound.push(this),
            }
        }
        let chosen = self.chosen(tried, &candidates, &mut rows);
        self.stopped = stopped;
        self.ladder.append(&mut rows);
        Ok(chosen)
    }

    /// True if the evidence of one cause trails that of a likelier one by more than chance.
    fn is_behind(&self, best: &Candidate, other: &Candidate) -> bool {
        best.counts - other.counts > margin(self.inflation, best.counts)
    }

    /// Of the causes as likely as the likeliest sound one, the simplest; decides on all others that passed.
    fn chosen(&self, tried: &[ScreenedCause], candidates: &Candidates, rows: &mut [Tried]) -> Option<usize> {
        let Candidates { sound, absorbed } = candidates;
        let best = sound.first()?;
        let as_likely = |other: &Candidate| !self.is_behind(best, other);
        let simple = |other: &Candidate| tried[other.i].0.parameters.len();
        let mut close: Vec<Candidate> = sound.iter().copied().filter(as_likely).collect();
        let fewest = close.iter().map(simple).min()?;
        let chosen = *close.iter().find(|other| simple(other) == fewest)?;
        // A cause with more parameters and no more evidence contains the simpler cause and is not a rival.
        close.retain(|other| {
            simple(other) == fewest
                || other.counts > chosen.counts + POLICY.more_parameters * margin(self.inflation, chosen.counts)
        });
        // A cause that a calibration absorbs is not named, but is a rival if it is as likely.
        close.extend(absorbed.iter().copied().filter(as_likely));
        let adopted = || tried[chosen.i].0.name.clone();
        let fates = sound.iter().map(|other| match as_likely(other) {
            true => (other.i, Decision::NoBetter { adopted: adopted() }),
            false => (other.i, Decision::LessLikely),
        });
        let mut fates: Vec<(usize, Decision)> = fates.collect();
        fates.extend(close.iter().map(|other| (other.i, Decision::AsLikely { adopted: adopted() })));
        fates.push((chosen.i, Decision::Adopted));
        for (i, fate) in fates {
            rows[i].fate = fate;
        }
        Some(chosen.i)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::row;
    use super::*;
    use crate::diagnose::made_up::{self, candidate, cause, search};

    /// A simpler cause comes before the likeliest if it is as likely. A cause that a calibration absorbs is a rival; one that trails by
    /// more is not.
    #[test]
    fn the_simplest_of_the_likely_ones_is_adopted() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let names = ["asym_lag", "actuation_lag", "dead_zone", "range_scale", "sensor_lowpass"];
        let tried: Vec<ScreenedCause> = names.iter().map(|name| (cause(name), candidate(&drives, &[name]))).collect();
        let mut rows: Vec<Tried> = names.iter().map(|name| row(1, name, 90.0, Decision::Screened)).collect();
        let search = search(candidate(&drives, &[]), Vec::new());
        let candidate_of = |i: usize, counts: f64| Candidate { i, counts };
        let candidates = Candidates {
            sound: vec![candidate_of(0, 100.0), candidate_of(1, 98.0), candidate_of(4, 97.0), candidate_of(2, 80.0)],
            absorbed: vec![candidate_of(3, 95.0)],
        };
        assert_eq!(search.chosen(&tried, &candidates, &mut rows), Some(1));
        let adopted = || "actuation_lag".to_owned();
        let fates: Vec<Decision> = rows.iter().map(|row| row.fate.clone()).collect();
        let known = [
            Decision::NoBetter { adopted: adopted() },
            Decision::Adopted,
            Decision::LessLikely,
            Decision::AsLikely { adopted: adopted() },
            Decision::AsLikely { adopted: adopted() },
        ];
        assert_eq!(fates, known);
        // With half a margin more, the likeliest is a rival although it has one more parameter.
        let candidates =
            Candidates { sound: vec![candidate_of(0, 103.0), candidate_of(1, 98.0)], absorbed: Vec::new() };
        assert_eq!(search.chosen(&tried, &candidates, &mut rows), Some(1));
        assert_eq!(rows[0].fate, Decision::AsLikely { adopted: adopted() });
        assert_eq!(search.chosen(&tried, &Candidates::default(), &mut rows), None);
    }
}
