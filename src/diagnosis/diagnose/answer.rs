//! The verdict in words, from what the search found and what remains unexplained. The first line that applies decides.

use crate::diagnose::describe::specification::Leftovers;
use crate::diagnose::judge::decision::Rejection;
use crate::diagnose::likelihood::model::PHASE;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::outcome::{LeftOver, Tried, Verdict};
use crate::diagnose::policy::POLICY;
use crate::diagnose::search::fitted_model::FittedModel;
use crate::diagnose::select::adopt::State;
use crate::extension::Extension;
use std::iter;

/// Everything that the verdict depends on.
pub struct Answer<'a> {
    /// The state of the search at its end.
    pub state: &'a State,
    /// What the present model leaves unexplained.
    pub left: &'a Leftovers,
    /// Other base models without causes, the likeliest first.
    pub others: &'a [FittedModel],
    /// Why the base cannot be trusted; `None` if nothing contradicts it.
    pub contradicted: Option<String>,
    /// Missing acceleration of the base without causes \[m/s²\].
    pub sigma_at_start: f64,
}

/// Result of a line that applies: the reason, and the structure left over that it reports.
pub type Reason = (String, Option<LeftOver>);
/// A line of the table: verdict, condition in words, and the function that checks the condition and writes the reason.
pub type Line = (Verdict, &'static str, fn(&Answer<'_>) -> Option<Reason>);

/// The verdicts. The first line that applies decides.
pub const VERDICTS: [Line; 12] = [
    (Verdict::Unexplained, "causes are found, but another law without causes is likelier", another_law_instead),
    (Verdict::BadBase, "the data contradict parameters of the base, or its calibrations do not agree", contradicted),
    (
        Verdict::Unexplained,
        "causes are found, but a dependence on place, speed, gap or command has more than half of their evidence",
        proxies,
    ),
    (
        Verdict::Unexplained,
        "causes are found, but bursts and more than half of the missing acceleration remain",
        proxies_of_instants,
    ),
    (Verdict::Ambiguous, "causes and rivals are found", rivals),
    (Verdict::Named, "causes are found", named),
    (Verdict::Unexplained, "no cause passes, but another law is likelier", another_law),
    (Verdict::Unexplained, "no cause passes, but a dependence or bursts remain", left_over),
    (
        Verdict::NotTestable,
        "no cause passes, but one that a calibration absorbs gains far more than its threshold",
        absorbed,
    ),
    (
        Verdict::Unexplained,
        "no cause passes, but one that gains far more than its threshold fails another check",
        spoken_against,
    ),
    (Verdict::Unexplained, "no cause passes, but a large and slow acceleration is missing", far_off),
    (Verdict::NotTestable, "no cause passes, and a calibration absorbs the closest one", perhaps_absorbed),
];

impl Answer<'_> {
    /// The first line that applies, or that nothing is found; with the structure left over that it reports.
    pub fn verdict(&self) -> (Verdict, String, Vec<LeftOver>) {
        let first = VERDICTS.iter().find_map(|(verdict, _, line)| line(self).map(|said| (*verdict, said)));
        let (verdict, (reason, left)) = first.unwrap_or_else(|| (Verdict::Nothing, (self.nothing(), None)));
        (verdict, reason, left.into_iter().collect())
    }

    fn causes(&self) -> Option<&[&'static Extension]> {
        let causes = self.state.current.causes.as_slice();
        (!causes.is_empty()).then_some(causes)
    }

    fn without_causes(&self) -> Option<&State> {
        self.state.current.causes.is_empty().then_some(self.state)
    }

    fn names(&self) -> String {
        self.state.current.causes.iter().map(|cause| cause.name.clone()).collect::<Vec<_>>().join(", then ")
    }

    /// Margin by which another law has to lead or trail the causes \[nats\]. If both models are right, one leads by a small share of the
    /// evidence of the causes: Gipps' spacing, for example, is a headway that depends on speed.
    fn alike(&self) -> f64 {
        POLICY.other_law.max(POLICY.alike * self.state.explained())
    }

    /// The likeliest other base without causes, if it leads the present model by more than `margin` \[nats\]: its name in the paper, and
    /// its lead.
    fn other_law(&self, margin: f64) -> Option<(&'static str, LeftOver)> {
        let other = self.others.first()?;
        let ahead = other.fit.log_likelihood - self.state.current.fit.log_likelihood;
        let (kind, place) = ("family".to_owned(), other.variant.base.name.to_owned());
        (ahead > margin).then_some((other.variant.base.paper, LeftOver { kind, place, size: ahead, evidence: ahead }))
    }

    /// The likeliest cause that a check rejected although it gains far more than its threshold.
    fn stopped(&self) -> Option<(&'static Extension, String, &Rejection, f64)> {
        let strong = |(_, evidence, need, _): &&(_, f64, f64, _)| *evidence > POLICY.stopped * need;
        let (cause, evidence, need, objection) = self.without_causes()?.stopped.iter().find(strong)?;
        Some((cause, format!("{} gains {evidence:.0} nats ({need:.0} needed), but", cause.name), objection, *evidence))
    }

    /// The row of the ladder with the most evidence.
    fn closest(&self) -> Option<&Tried> {
        let judged = self.state.ladder.iter().filter(|row| row.evidence.is_finite());
        judged.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    fn nothing(&self) -> String {
        let closest = self.closest().map_or(String::new(), |row| {
            format!("; the closest was {} with {:.1} nats ({:.1} needed)", row.name, row.evidence, row.threshold)
        });
        format!("no cause passes{closest}")
    }
}

fn contradicted(answer: &Answer<'_>) -> Option<Reason> {
    Some((answer.contradicted.clone()?, None))
}

fn another_law_instead(answer: &Answer<'_>) -> Option<Reason> {
    answer.causes()?;
    let (law, left) = answer.other_law(answer.alike())?;
    let reason = format!(
        "{law} without causes is likelier by {:.0} nats than the base with {}: the car follows another law, and the causes only \
         imitate it",
        left.evidence,
        answer.names()
    );
    Some((reason, Some(left)))
}

fn proxies(answer: &Answer<'_>) -> Option<Reason> {
    answer.causes()?;
    let total = answer.state.explained();
    let term = answer.left.strongest().filter(|term| term.evidence > POLICY.left_share * total)?;
    let reason = format!(
        "a dependence on {} remains ({:.0} nats, compared with {total:.0} for {}), so these causes only imitate it",
        term.place,
        term.evidence,
        answer.names()
    );
    Some((reason, None))
}

fn proxies_of_instants(answer: &Answer<'_>) -> Option<Reason> {
    answer.causes()?;
    let sigma = answer.state.current.fit.point.noise.sigma_d;
    let proxies = answer.left.bursts() && sigma > POLICY.left_share * answer.sigma_at_start;
    let reason = format!(
        "bursts remain that no model follows, and so does more than half of the missing acceleration ({sigma:.3} m/s²): {} may be \
         proxies",
        answer.names()
    );
    proxies.then_some((reason, None))
}

fn rivals(answer: &Answer<'_>) -> Option<Reason> {
    let causes = answer.causes()?;
    let first = answer.state.rivals().next()?;
    let either = |cause: &&'static Extension| {
        let rivals = answer.state.rivals().filter(|rival| rival.of == *cause).map(|rival| rival.cause);
        let mut names: Vec<&str> = iter::once(*cause).chain(rivals).map(|cause| cause.name.as_str()).collect();
        names.dedup();
        names.join(" or ")
    };
    let reason = format!(
        "{}: these data do not distinguish them. Drives that would: {}{}",
        causes.iter().map(either).collect::<Vec<_>>().join(", then "),
        experiment(first.of, first.cause),
        in_gusts(causes, &answer.state.current.fit.point.noise)
    );
    Some((reason, None))
}

fn named(answer: &Answer<'_>) -> Option<Reason> {
    let causes = answer.causes()?;
    let needed: Vec<String> = answer.state.evidence.iter().map(|(_, need)| format!("{need:.0}")).collect();
    let also = answer.other_law(-answer.alike()).map_or(String::new(), |(law, _)| {
        format!("; {law} without causes is as likely, so the car may follow that law instead")
    });
    let reason = format!(
        "{}: {:.0} nats held out, {} needed{also}{}",
        answer.names(),
        answer.state.explained(),
        needed.join(" and "),
        in_gusts(causes, &answer.state.current.fit.point.noise)
    );
    Some((reason, None))
}

fn another_law(answer: &Answer<'_>) -> Option<Reason> {
    let state = answer.without_causes()?;
    // Of two equally good laws, one leads by chance, so a law must also exceed the threshold of a cause.
    let (law, left) = answer.other_law(state.need.max(POLICY.other_law))?;
    let term = answer.left.strongest().map_or(0.0, |term| term.evidence);
    let reason = format!(
        "no cause of the library passes, but {law} is likelier by {:.0} nats: the car follows another law than the base",
        left.evidence
    );
    (left.evidence > term).then_some((reason, Some(left)))
}

fn left_over(answer: &Answer<'_>) -> Option<Reason> {
    answer.without_causes()?;
    let what = match answer.left.strongest() {
        Some(term) => format!("a dependence on {} remains ({:.0} nats)", term.place, term.evidence),
        None if answer.left.bursts() => "bursts remain that no model follows".to_owned(),
        None => return None,
    };
    Some((format!("no cause of the library passes, but {what}"), None))
}

fn absorbed(answer: &Answer<'_>) -> Option<Reason> {
    let (_, gains, objection, _) = answer.stopped()?;
    let told = matches!(objection, Rejection::Absorbed { .. });
    told.then(|| (format!("{gains} {objection}: these data do not show whether it is missing"), None))
}

fn spoken_against(answer: &Answer<'_>) -> Option<Reason> {
    let (cause, gains, objection, size) = answer.stopped()?;
    let left = LeftOver { kind: "proxy".to_owned(), place: cause.name.clone(), size, evidence: size };
    Some((format!("{gains} it is not the cause: {objection}"), Some(left)))
}

fn far_off(answer: &Answer<'_>) -> Option<Reason> {
    let noise = answer.without_causes()?.current.fit.point.noise;
    let reason = format!(
        "no cause of the library passes, but the model lacks an acceleration of {:.2} m/s² (root mean square) with a \
         time constant of {:.0} s: too large and too slow for gusts",
        noise.sigma_d, noise.tau_d
    );
    noise.is_lost().then_some((reason, None))
}

fn perhaps_absorbed(answer: &Answer<'_>) -> Option<Reason> {
    let state = answer.without_causes()?;
    let row = answer.closest().filter(|row| row.evidence > POLICY.judged * row.threshold)?;
    let absorbed = state.not_testable.iter().find(|absorbed| absorbed.name == row.name)?;
    let by = absorbed.absorbed_by.join(", ");
    Some((format!("{} might be missing, but a calibration absorbs it in {by}", absorbed.name), None))
}

/// A drive that would distinguish a cause from its rival, from the file of either.
pub fn experiment<'a>(cause: &'a Extension, rival: &'a Extension) -> &'a str {
    let own = |of: &'a Extension| of.cause.as_ref().and_then(|cause| cause.experiment.as_deref());
    own(cause)
        .or_else(|| own(rival))
        .unwrap_or("drives in which the leader stops, accelerates hard, and holds several speeds for minutes")
}

/// A caveat for a member of the phase family that is named in gusts: there the observer's states differ from what the car perceived late.
fn in_gusts(causes: &[&Extension], noise: &Noise) -> String {
    if noise.sigma_d <= POLICY.calm || causes.iter().all(|cause| cause.family() != PHASE) {
        return String::new();
    }
    format!(
        "; in gusts ({:.2} m/s² with a time constant of {:.1} s) a delay, a lag, a filter and an offset of time are hard to \
         distinguish",
        noise.sigma_d, noise.tau_d
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::made_up::{self, candidate, cause, search};
    use crate::diagnose::select::adopt::Rival;

    #[test]
    fn gusts_leave_doubt_in_a_delay_and_in_nothing_else() {
        let [delay, grade] = ["perception_delay", "grade"].map(cause);
        let gusts = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 0.02 };
        let calm = Noise { sigma_d: 0.004, ..gusts };
        assert!(in_gusts(&[grade, delay], &gusts).contains("0.05 m/s² with a time constant of 2.0 s"));
        assert_eq!([in_gusts(&[grade], &gusts), in_gusts(&[delay], &calm)], ["", ""]);
    }

    /// If the rival of a cause, or a relative of it, was found in a later round, it is no longer a rival.
    #[test]
    fn a_rival_of_one_of_several_causes_leaves_doubt() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let mut search = search(candidate(&drives, &["periodic", "actuation_lag"]), Vec::new());
        let rival = |of: &str, name: &str| {
            let candidate = candidate(&drives, &["periodic", name]);
            Rival { of: cause(of), cause: cause(name), candidate, evidence: 45.0, need: 20.0 }
        };
        search.rivals = vec![rival("periodic", "asym_lag"), rival("actuation_lag", "time_offset")];
        let said = |search: &State| {
            let left = Leftovers::default();
            let answer = Answer { state: search, left: &left, others: &[], contradicted: None, sigma_at_start: 0.05 };
            let (verdict, reason, _) = answer.verdict();
            (verdict, reason)
        };
        let (verdict, reason) = said(&search);
        assert_eq!(verdict, Verdict::Ambiguous);
        assert!(
            reason.starts_with("periodic, then actuation_lag or time_offset: these data do not distinguish"),
            "{reason}"
        );
        search.rivals.pop();
        assert_eq!(said(&search).0, Verdict::Named);
    }
}
