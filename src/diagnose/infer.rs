//! From a question to an answer: base, rounds, repair, what is left, verdict.

use super::adopt::{PHASE, ROUNDS, Rival, Search, family};
use super::base::{Calibrated, calibrate_base, contradiction};
use super::bootstrap::{SURROGATES, threshold};
use super::candidate::{Candidate, LEAD, Setting};
use super::decide::{is_calm, margin_of_relatives};
use super::experiment::experiment;
use super::family::others;
use super::fate::Objection;
use super::held_sizes::is_lost;
use super::model::Model;
use super::observer::Noise;
use super::screen::Spending;
use super::specification::{Leftovers, leftovers};
use super::verdict::{
    Adopted, DiagnoseError, Effort, Estimate, Fitted, Inference, LeftOver, Progress, Question, Verdict,
};
use crate::extension::Extension;
use crate::wgsl::extension_named;
use std::ops::ControlFlow;
use std::time::Instant;

/// By how much another base without causes has to be likelier than this one with them \[nats\], at least.
const OTHER_FAMILY: f64 = 10.0;
/// Share of the causes' evidence above which what is left speaks against their names.
const LEFT_SHARE: f64 = 0.5;

/// Share of a thorough diagnosis that its bootstrap takes, as the bar shows it.
const BOOTSTRAP: f64 = 0.7;
/// Replicates of the base whose likelihoods are further apart than this \[nats\] have not found it.
const APART: f64 = 100.0;

/// Names what a base model lacks on some drives.
///
/// # Errors
/// [`DiagnoseError`]: no data, a model that cannot be run on them, or [`DiagnoseError::Stopped`] when `progress` breaks.
pub fn infer(
    question: &Question<'_>,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Inference, DiagnoseError> {
    if question.train.is_empty() {
        return Err(DiagnoseError::NoData);
    }
    let bootstrapped = question.effort == Effort::Thorough;
    let mut show = |done: f64, stage: &str| match progress(Progress { done, stage: stage.to_owned() }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(DiagnoseError::Stopped),
    };
    let mut setting = Setting::new(question, extension_named(LEAD));
    let spending = Spending::of(question.effort);
    let further = spending.further();
    show(0.0, "calibrating the base model")?;
    let base = calibrate_base(&setting, question.base, &spending)?
        .ok_or_else(|| DiagnoseError::NoBase { variant: question.base.name() })?;
    let Calibrated { candidate, replicates } = base;
    let agrees = replicates.len() > 1 && replicates[0] - replicates[1] < APART;
    let noise_at_start = candidate.fit.point.noise;
    if bootstrapped {
        let begun = Instant::now();
        let mut first = None;
        let told = &mut |done: usize| {
            // Those of an earlier run took no time in this one.
            let before = *first.get_or_insert(done);
            let left = begun.elapsed().as_secs_f64() * (SURROGATES - done) as f64 / (done - before).max(1) as f64;
            let left = if done > before { format!(", {:.0} min left", (left / 60.0).ceil()) } else { String::new() };
            let stage = format!("bootstrap: {done} of {SURROGATES} drives without a cause{left}");
            show(BOOTSTRAP * (0.05 + 0.95 * done as f64 / SURROGATES as f64), &stage)
        };
        setting.least = threshold(question, &candidate, told)?;
    }
    let from = if bootstrapped { BOOTSTRAP } else { 0.0 };
    let mut tell = |done: f64, stage: &str| show(from + (1.0 - from) * done, stage);
    let mut search = Search::begin(&setting, candidate)?;
    tell(0.1, "round 1: trying every cause")?;
    let before = setting.simulated();
    let tried = search.fit_all(&setting, &spending)?;
    // The base is the best fit without causes: what its causes were compared with.
    let base = snapshot(&search.current, &setting, search.inflation)?;
    let goes_on = search.decide(&setting, 1, tried, &spending)?;
    search.last_round = setting.simulated() - before;
    if goes_on {
        rounds(&mut search, &setting, &spending, &mut |share, stage| tell(0.1 + 0.65 * share, stage))?;
    }
    tell(0.75, "dropping what is not needed any more")?;
    pruned(&mut search, &setting, &spending, &mut |share, stage| tell(0.76 + 0.04 * share, stage))?;
    tell(0.8, "looking for what is left")?;
    let mut left = leftovers(&setting, &search.current, search.need, search.inflation)?;
    tell(0.85, "comparing with other base models")?;
    let others = others(&setting, &spending)?;
    let lacking = left.strongest().is_some() || ahead(&others, &search.current) > search.need.max(OTHER_FAMILY);
    // A base goes to its bounds for what it lacks, too.
    let puzzled = lacking && search.current.causes.is_empty() || contradiction(&setting, &search.current).is_some();
    tell(0.9, "trying causes that hide each other")?;
    if search.pair_up(&setting, &further, puzzled)? {
        search.swap(&setting, &spending)?;
        rounds(&mut search, &setting, &spending, &mut |share, stage| tell(0.9 + 0.08 * share, stage))?;
        pruned(&mut search, &setting, &spending, &mut |_, stage| tell(0.98, stage))?;
        left = leftovers(&setting, &search.current, search.need, search.inflation)?;
    }
    let extended = snapshot(&search.current, &setting, search.inflation)?;
    let lost = !agrees && search.current.causes.is_empty();
    let contradicted = contradiction(&setting, &search.current).or_else(|| lost.then(|| disagreement(&replicates)));
    let answer =
        Answer { search: &search, left: &left, others: &others, contradicted, sigma_at_start: noise_at_start.sigma_d };
    let (verdict, mut reason, mut left_over) = answer.verdict();
    if search.cut_short && verdict != Verdict::BadBase {
        reason.push_str(&format!("; {}", cut_short(question.effort)));
    }
    left_over.extend(left.list.iter().cloned());
    let named = matches!(verdict, Verdict::Named | Verdict::Ambiguous);
    let adopted: Vec<Adopted> = search
        .current
        .causes
        .iter()
        .zip(&search.evidence)
        .map(|(cause, (evidence, need))| adopted(&setting, &search.current, cause, *evidence, *need, search.inflation))
        .collect();
    let rival = |r: &Rival| adopted_rival(&setting, r, search.inflation);
    // One that was found as well, in a later round, is no rival any more, nor is its kin.
    let kin = |cause: &&Extension, rival: &Rival| *cause != rival.of && family(cause) == family(rival.cause);
    let found = |rival: &Rival| search.current.causes.iter().any(|cause| kin(cause, rival));
    let rivals = search.rivals.iter().filter(|rival| named && !found(rival));
    let confounded_with = rivals.map(rival).collect();
    tell(1.0, "done")?;
    Ok(Inference {
        base,
        extended,
        verdict,
        reason,
        adopted,
        confounded_with,
        not_testable: search.not_testable.clone(),
        untried: search.untried.clone(),
        left_over,
        ladder: search.ladder.clone(),
        simulations: setting.simulated(),
        complete: !search.cut_short,
        bootstrapped: setting.least,
    })
}

/// Rounds as long as something is adopted and not too much was simulated; `tell` takes the share of them that is done.
fn rounds(
    search: &mut Search,
    setting: &Setting<'_>,
    spending: &Spending,
    tell: &mut dyn FnMut(f64, &str) -> Result<(), DiagnoseError>,
) -> Result<(), DiagnoseError> {
    let share = |round: usize| (round - 1) as f64 / ROUNDS as f64;
    let last = search.ladder.last().map_or(0, |row| row.round);
    for round in last + 1..=ROUNDS {
        let before = setting.simulated();
        search.cut_short = search.has_enough(before, spending);
        if search.cut_short {
            break;
        }
        tell(share(round), &format!("round {round}: trying every cause"))?;
        let tried = search.fit_all(setting, &spending.further())?;
        let goes_on = search.decide(setting, round, tried, spending)?;
        search.last_round = setting.simulated() - before;
        if !goes_on {
            break;
        }
        tell(share(round) + 0.5 / ROUNDS as f64, "putting right what was adopted before")?;
        search.swap(setting, spending)?;
    }
    Ok(())
}

/// Drops what is not needed any more; where one was no name any more, its place is free for another.
fn pruned(
    search: &mut Search,
    setting: &Setting<'_>,
    spending: &Spending,
    tell: &mut dyn FnMut(f64, &str) -> Result<(), DiagnoseError>,
) -> Result<(), DiagnoseError> {
    if search.prune(setting, spending)? {
        rounds(search, setting, spending, tell)?;
        search.prune(setting, spending)?;
    }
    search.end_trial(setting)
}

/// By how much the likeliest other base without causes is likelier than a model \[nats\].
fn ahead(others: &[Candidate], model: &Candidate) -> f64 {
    others.first().map_or(f64::NEG_INFINITY, |other| other.fit.log_likelihood - model.fit.log_likelihood)
}

fn disagreement(replicates: &[f64]) -> String {
    if replicates.len() < 2 {
        return "only one calibration of the base came to an end, so nothing confirms it; give longer data or tighter bounds"
            .to_owned();
    }
    let spread = replicates.first().zip(replicates.last()).map_or(0.0, |(a, b)| a - b);
    format!(
        "{} calibrations of the base from different starts do not agree: their log-likelihoods spread over {spread:.0} nats; give \
         longer data or tighter bounds",
        replicates.len()
    )
}

fn adopted_rival(setting: &Setting<'_>, rival: &Rival, inflation: f64) -> Adopted {
    adopted(setting, &rival.candidate, rival.cause, rival.evidence, rival.need, inflation)
}

fn adopted(
    setting: &Setting<'_>,
    candidate: &Candidate,
    cause: &'static Extension,
    evidence: f64,
    threshold: f64,
    inflation: f64,
) -> Adopted {
    let event = candidate.model.events.iter().find(|event| event.extension == cause);
    Adopted {
        extension: cause,
        family: family(cause).to_owned(),
        parameters: candidate.model.positions(cause).into_iter().map(|k| estimate(candidate, k, inflation)).collect(),
        evidence,
        threshold,
        recording: event.and_then(|event| setting.question.train.get(event.drive)).map(super::drive::Drive::recording),
    }
}

fn estimate(candidate: &Candidate, k: usize, inflation: f64) -> Estimate {
    let (symbol, axis, value) = (candidate.model.symbols[k], candidate.model.axes[k], candidate.fit.point.values[k]);
    let error = candidate.fit.errors[k] * inflation.sqrt();
    Estimate {
        name: symbol.name().to_owned(),
        unit: symbol.unit().to_owned(),
        value,
        error,
        interval: [(value - 2.0 * error).max(axis.lower), (value + 2.0 * error).min(axis.upper)],
    }
}

/// The fit as others see it.
fn snapshot(candidate: &Candidate, setting: &Setting<'_>, inflation: f64) -> Result<Fitted, DiagnoseError> {
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

/// That more may be missing, where the search ended before it found nothing more.
fn cut_short(effort: Effort) -> String {
    let next = if effort == Effort::Quick { Effort::Normal } else { Effort::Thorough };
    format!(
        "whether more is missing was not asked any more: `--effort {}` has simulated enough, `--effort {}` goes on",
        effort.name(),
        next.name()
    )
}

/// What to add where a member of the phase family is named although gusts are left: the observer's states are not what the car saw late.
fn in_gusts(causes: &[&Extension], noise: &Noise) -> String {
    if is_calm(noise) || causes.iter().all(|cause| family(cause) != PHASE) {
        return String::new();
    }
    format!(
        "; in gusts ({:.2} m/s² for {:.1} s at a time) a delay, a lag, a filter and an offset of time are easily taken for one another",
        noise.sigma_d, noise.tau_d
    )
}

/// Everything a verdict follows from.
struct Answer<'a> {
    search: &'a Search,
    left: &'a Leftovers,
    others: &'a [Candidate],
    contradicted: Option<String>,
    sigma_at_start: f64,
}

impl Answer<'_> {
    /// The first line that applies; further left-overs with it.
    fn verdict(&self) -> (Verdict, String, Vec<LeftOver>) {
        let search = self.search;
        let causes = &search.current.causes;
        let names = || causes.iter().map(|cause| cause.name.clone()).collect::<Vec<_>>().join(", then ");
        let plain = |verdict, reason| (verdict, reason, Vec::new());
        if let Some(reason) = &self.contradicted {
            return plain(Verdict::BadBase, reason.clone());
        }
        let total = search.explained();
        if causes.is_empty() {
            return self.without_causes();
        }
        // Of two models that both have it right, one is ahead by a little of what the causes explain: Gipps' spacing is a headway that
        // depends on speed.
        let alike = margin_of_relatives(OTHER_FAMILY, total);
        if let Some((law, left)) = self.other_law(alike) {
            let reason = format!(
                "{law} without any cause is likelier by {:.0} nats than the base with {}: the car follows another law, and the causes \
                 only imitate it",
                left.evidence,
                names()
            );
            return (Verdict::Unexplained, reason, vec![left]);
        }
        if let Some(term) = self.left.strongest()
            && term.evidence > LEFT_SHARE * total
        {
            let reason = format!(
                "something that repeats with {} is left ({:.0} nats, against {total:.0} for {}), so these causes are proxies for it",
                term.place,
                term.evidence,
                names()
            );
            return plain(Verdict::Unexplained, reason);
        }
        let sigma = search.current.fit.point.noise.sigma_d;
        if self.left.bursts() && sigma > 0.5 * self.sigma_at_start {
            let reason = format!(
                "single instants that no model follows are left, and the missing acceleration is as large as before ({sigma:.3} m/s²): \
                 {} may be proxies",
                names()
            );
            return plain(Verdict::Unexplained, reason);
        }
        if let ([cause], [_, ..]) = (causes.as_slice(), search.rivals.as_slice()) {
            let mut rivals: Vec<String> = search.rivals.iter().map(|rival| rival.cause.name.clone()).collect();
            rivals.dedup();
            let reason = format!(
                "{} or {}: these data cannot tell them apart. What would: {}{}",
                cause.name,
                rivals.join(" or "),
                experiment(cause, search.rivals[0].cause),
                in_gusts(causes, &search.current.fit.point.noise)
            );
            return plain(Verdict::Ambiguous, reason);
        }
        let needed: Vec<String> = search.evidence.iter().map(|(_, need)| format!("{need:.0}")).collect();
        let also = self.other_law(-alike).map_or(String::new(), |(law, _)| {
            format!("; {law} without any cause is as likely, so it may be the law that differs")
        });
        let gusts = in_gusts(causes, &search.current.fit.point.noise);
        let reason = format!("{}: {total:.0} nats held out, {} needed{also}{gusts}", names(), needed.join(" and "));
        plain(Verdict::Named, reason)
    }

    /// Another base without causes that is likelier than the present model by more than so many nats: its name in the paper, and by
    /// how much.
    fn other_law(&self, margin: f64) -> Option<(&'static str, LeftOver)> {
        let other = self.others.first()?;
        let ahead = ahead(self.others, &self.search.current);
        let (kind, place) = ("family".to_owned(), other.variant.base.name.to_owned());
        (ahead > margin).then_some((other.variant.base.paper, LeftOver { kind, place, size: ahead, evidence: ahead }))
    }

    fn without_causes(&self) -> (Verdict, String, Vec<LeftOver>) {
        let search = self.search;
        let term = self.left.strongest().map_or(0.0, |term| term.evidence);
        // Of two laws that are alike on these data one is ahead by chance: what a cause needs, a law needs too.
        if let Some((law, left)) = self.other_law(search.need.max(OTHER_FAMILY))
            && left.evidence > term
        {
            let reason = format!(
                "no cause of the library passes, but {law} is likelier by {:.0} nats: the car follows another law than the base",
                left.evidence
            );
            return (Verdict::Unexplained, reason, vec![left]);
        }
        if let Some(term) = self.left.strongest() {
            let reason = format!(
                "no cause of the library passes, but something that repeats with {} is left ({:.0} nats)",
                term.place, term.evidence
            );
            return (Verdict::Unexplained, reason, Vec::new());
        }
        if self.left.bursts() {
            let reason =
                "no cause of the library passes, but single instants that no model follows are left".to_owned();
            return (Verdict::Unexplained, reason, Vec::new());
        }
        let strong = search.stopped.iter().find(|(_, evidence, need, _)| evidence > &(2.0 * need));
        if let Some((cause, evidence, need, objection)) = strong
            && matches!(objection, Objection::Absorbed { .. })
        {
            let reason = format!(
                "{} gains {evidence:.0} nats ({need:.0} needed), but {objection}: these data do not tell whether it is missing",
                cause.name
            );
            return (Verdict::NotTestable, reason, Vec::new());
        }
        if let Some((cause, evidence, need, objection)) = strong {
            let left =
                LeftOver { kind: "proxy".to_owned(), place: cause.name.clone(), size: *evidence, evidence: *evidence };
            let reason = format!(
                "{} gains {evidence:.0} nats ({need:.0} needed), but it is not the cause: {objection}",
                cause.name
            );
            return (Verdict::Unexplained, reason, vec![left]);
        }
        let noise = search.current.fit.point.noise;
        if is_lost(&noise) {
            let reason = format!(
                "no cause of the library passes, but the follower is accelerated by {:.2} m/s² (root mean square) for {:.0} s at a \
                 time in a way that the model does not have: too much and too slow for gusts",
                noise.sigma_d, noise.tau_d
            );
            return (Verdict::Unexplained, reason, Vec::new());
        }
        let best = search
            .ladder
            .iter()
            .filter(|row| row.evidence.is_finite())
            .max_by(|a, b| a.evidence.total_cmp(&b.evidence));
        if let Some(row) = best
            && let Some(absorbed) = search.not_testable.iter().find(|absorbed| absorbed.name == row.name)
            && row.evidence > 0.5 * row.threshold
        {
            let reason = format!(
                "{} might be missing, but a calibration absorbs it in {}",
                absorbed.name,
                absorbed.absorbed_by.join(", ")
            );
            return (Verdict::NotTestable, reason, Vec::new());
        }
        let closest = best.map_or(String::new(), |row| {
            format!("; the closest was {} with {:.1} nats ({:.1} needed)", row.name, row.evidence, row.threshold)
        });
        (Verdict::Nothing, format!("no cause passes{closest}"), Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gusts_leave_doubt_in_a_delay_and_in_nothing_else() {
        let [delay, grade] = ["perception_delay", "grade"].map(|name| extension_named(name).expect("in the library"));
        let gusts = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 0.02 };
        let calm = Noise { sigma_d: 0.004, ..gusts };
        assert!(in_gusts(&[grade, delay], &gusts).contains("0.05 m/s² for 2.0 s"));
        assert_eq!([in_gusts(&[grade], &gusts), in_gusts(&[delay], &calm)], ["", ""]);
    }
}
