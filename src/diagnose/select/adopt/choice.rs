//! Which of those tried in a round is adopted, and what becomes of the others.

use super::{State, identifiability};
use crate::diagnose::judge::decide::{Evidence, is_hopeful, margin, proxy};
use crate::diagnose::judge::fate::{Fate, Objection};
use crate::diagnose::judge::gate::gate;
use crate::diagnose::outcome::Tried;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, Transferred};
use crate::diagnose::search::screen::ScreenedCause;
use crate::diagnose::search::search_budget::SearchBudget;

/// A cause that gains enough where it was not fitted.
#[derive(Debug, Clone, Copy)]
struct Gaining {
    /// Position among those tried.
    i: usize,
    /// Its evidence \[nats\].
    counts: f64,
    /// True if a calibration makes up for most of it.
    absorbed: bool,
}

/// Those that nothing objects to, and those that another calibration makes up for; the likeliest first.
#[derive(Debug, Default)]
struct Standing {
    sound: Vec<Gaining>,
    made_up_for: Vec<Gaining>,
}

impl State {
    /// Position of the cause to adopt, and notes on all others.
    pub(super) fn choose(
        &mut self,
        setting: &Context<'_>,
        round: usize,
        tried: &[ScreenedCause],
        held: &[Option<CrossValidated>],
        spending: &SearchBudget,
    ) -> Result<Option<usize>, DiagnoseError> {
        self.stopped.clear();
        let first = self.ladder.len();
        let gaining = self.noted(setting, round, tried, held, spending.short_list);
        let standing = self.asked(setting, tried, &gaining, first)?;
        Ok(self.chosen(tried, &standing, first))
    }

    /// Notes everything tried in the ladder; those that gain enough where they were not fitted, the likeliest first.
    fn noted(
        &mut self,
        setting: &Context<'_>,
        round: usize,
        tried: &[ScreenedCause],
        held: &[Option<CrossValidated>],
        short_list: usize,
    ) -> Vec<Gaining> {
        let mut gaining = Vec::new();
        for (i, (cause, candidate)) in tried.iter().enumerate() {
            let gain = candidate.fit.log_likelihood - self.current.fit.log_likelihood;
            let mut row = Tried {
                round,
                name: cause.name.clone(),
                gain,
                evidence: f64::NAN,
                folds: [f64::NAN; 2],
                threshold: self.need,
                fate: Fate::unjudged(is_hopeful(gain, self.need), short_list),
            };
            if let Some(held) = &held[i] {
                let evidence = Evidence::of(setting, candidate, cause, held, &self.current, &self.held);
                let counts = evidence.counts();
                (row.evidence, row.folds) = (counts, evidence.folds);
                // Of those without an objection the fate is decided later.
                match evidence.objection(self.need) {
                    Some(objection) => row.fate = Fate::Stopped(objection),
                    None => {
                        let absorbed =
                            cause.family() == "absorbed" && identifiability(candidate, cause).0 < POLICY.absorbed;
                        gaining.push(Gaining { i, counts, absorbed });
                    }
                }
            }
            self.ladder.push(row);
        }
        gaining.sort_by(|a, b| b.counts.total_cmp(&a.counts));
        gaining
    }

    /// True if the evidence of one cause is behind that of a likelier one by more than could be chance.
    fn is_behind(&self, best: &Gaining, other: &Gaining) -> bool {
        best.counts - other.counts > margin(self.inflation, best.counts)
    }

    /// Asks sign, bounds and hold-out about those that gain, as far as it matters; `first` is the first row of the round.
    fn asked(
        &mut self,
        setting: &Context<'_>,
        tried: &[ScreenedCause],
        gaining: &[Gaining],
        first: usize,
    ) -> Result<Standing, DiagnoseError> {
        let mut standing = Standing::default();
        let mut stopped = Vec::new();
        // The present model on the hold-out, which all are compared with.
        let mut alone: Option<Transferred> = None;
        for this in gaining {
            let (cause, candidate) = &tried[this.i];
            let behind = |best: &&Gaining| self.is_behind(best, this);
            // Behind one that stands, only what is as likely matters.
            if standing.sound.first().is_some_and(|best| behind(&best)) {
                self.ladder[first + this.i].fate = Fate::LessLikely;
                continue;
            }
            // What cannot be told from another calibration is no name; what is less likely than that is none either.
            if let Some(best) = standing.made_up_for.first().filter(behind) {
                let other = tried[best.i].0.name.clone();
                self.ladder[first + this.i].fate = Fate::LessLikelyThanAbsorbed { other };
                continue;
            }
            let objection = match proxy(candidate, cause) {
                Some(objection) => Some(objection),
                None if this.absorbed => {
                    standing.made_up_for.push(*this);
                    Some(Objection::Absorbed { by: identifiability(candidate, cause).1 })
                }
                None => {
                    if alone.is_none() && !setting.question.holdout.is_empty() {
                        alone = Some(self.current.transfer(setting, None)?);
                    }
                    gate(setting, candidate, cause, &self.current, alone.as_ref())?
                }
            };
            match objection {
                Some(objection) => {
                    self.ladder[first + this.i].fate = Fate::Stopped(objection.clone());
                    stopped.push((*cause, this.counts, self.need, objection));
                }
                None => standing.sound.push(*this),
            }
        }
        self.stopped = stopped;
        Ok(standing)
    }

    /// Of those as likely as the likeliest sound one, the simplest; and notes on all others that stand.
    fn chosen(&mut self, tried: &[ScreenedCause], standing: &Standing, first: usize) -> Option<usize> {
        let Standing { sound, made_up_for } = standing;
        let best = sound.first()?;
        let as_likely = |other: &Gaining| !self.is_behind(best, other);
        let simple = |other: &Gaining| tried[other.i].0.parameters.len();
        let mut close: Vec<Gaining> = sound.iter().copied().filter(as_likely).collect();
        let fewest = close.iter().map(simple).min()?;
        let chosen = *close.iter().find(|other| simple(other) == fewest)?;
        // More parameters that gain nothing over fewer contain the simpler cause and are no rival.
        close.retain(|other| {
            simple(other) == fewest || other.counts > chosen.counts + 0.5 * margin(self.inflation, chosen.counts)
        });
        // What is as likely although a calibration has most of its effect is no name by itself, but leaves doubt in one.
        close.extend(made_up_for.iter().copied().filter(as_likely));
        let adopted = || tried[chosen.i].0.name.clone();
        let fates = sound.iter().map(|other| match as_likely(other) {
            true => (other.i, Fate::NoBetter { adopted: adopted() }),
            false => (other.i, Fate::LessLikely),
        });
        let mut fates: Vec<(usize, Fate)> = fates.collect();
        fates.extend(close.iter().map(|other| (other.i, Fate::AsLikely { adopted: adopted() })));
        fates.push((chosen.i, Fate::Adopted));
        for (i, fate) in fates {
            self.ladder[first + i].fate = fate;
        }
        Some(chosen.i)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{row, search};
    use super::*;
    use crate::diagnose::made_up::{self, candidate, cause};

    /// One that is as likely and simpler comes before the likeliest; what a calibration makes up for is a rival, what is further behind
    /// is not.
    #[test]
    fn the_simplest_of_the_likely_ones_is_adopted() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let names = ["asym_lag", "actuation_lag", "dead_zone", "range_scale", "sensor_lowpass"];
        let tried: Vec<ScreenedCause> = names.iter().map(|name| (cause(name), candidate(&drives, &[name]))).collect();
        let ladder = names.iter().map(|name| row(1, name, 90.0, Fate::Screened)).collect();
        let mut search = search(candidate(&drives, &[]), ladder);
        let gaining = |i: usize, counts: f64| Gaining { i, counts, absorbed: i == 3 };
        let standing = Standing {
            sound: vec![gaining(0, 100.0), gaining(1, 98.0), gaining(4, 97.0), gaining(2, 80.0)],
            made_up_for: vec![gaining(3, 95.0)],
        };
        assert_eq!(search.chosen(&tried, &standing, 0), Some(1));
        let adopted = || "actuation_lag".to_owned();
        let fates: Vec<Fate> = search.ladder.iter().map(|row| row.fate.clone()).collect();
        let known = [
            Fate::NoBetter { adopted: adopted() },
            Fate::Adopted,
            Fate::LessLikely,
            Fate::AsLikely { adopted: adopted() },
            Fate::AsLikely { adopted: adopted() },
        ];
        assert_eq!(fates, known);
        // With half a margin more, the likeliest is a rival although it has one parameter more.
        let standing = Standing { sound: vec![gaining(0, 103.0), gaining(1, 98.0)], made_up_for: Vec::new() };
        assert_eq!(search.chosen(&tried, &standing, 0), Some(1));
        assert_eq!(search.ladder[0].fate, Fate::AsLikely { adopted: adopted() });
        assert_eq!(search.chosen(&tried, &Standing::default(), 0), None);
    }
}
