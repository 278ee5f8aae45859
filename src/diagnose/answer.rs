//! The verdict: what the search found and what is left, in words. The first line that applies decides.

use crate::diagnose::describe::specification::Leftovers;
use crate::diagnose::judge::decide::{is_calm, margin_of_relatives};
use crate::diagnose::judge::fate::Objection;
use crate::diagnose::likelihood::model::PHASE;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::outcome::{LeftOver, Verdict};
use crate::diagnose::search::fitted_model::FittedModel;
use crate::diagnose::search::profile_grid::is_lost;
use crate::diagnose::select::adopt::Search;
use crate::extension::Extension;

/// By how much another base without causes has to be likelier than this one with them \[nats\], at least.
pub const OTHER_FAMILY: f64 = 10.0;
/// Share of the causes' evidence above which what is left speaks against their names.
const LEFT_SHARE: f64 = 0.5;

/// Everything a verdict follows from.
pub struct Answer<'a> {
    /// The search at its end.
    pub search: &'a Search,
    /// What the present model leaves.
    pub left: &'a Leftovers,
    /// Other base models without causes, the likeliest first.
    pub others: &'a [FittedModel],
    /// Why the base cannot be trusted, if it cannot.
    pub contradicted: Option<String>,
    /// Missing acceleration of the base without causes \[m/s²\].
    pub sigma_at_start: f64,
}

impl Answer<'_> {
    /// The first line that applies; further left-overs with it.
    pub fn verdict(&self) -> (Verdict, String, Vec<LeftOver>) {
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

/// By how much the likeliest other base without causes is likelier than a model \[nats\].
pub fn ahead(others: &[FittedModel], model: &FittedModel) -> f64 {
    others.first().map_or(f64::NEG_INFINITY, |other| other.fit.log_likelihood - model.fit.log_likelihood)
}

/// Which drive would tell a cause from its rival: what the file of either says.
fn experiment<'a>(cause: &'a Extension, rival: &'a Extension) -> &'a str {
    let own = |of: &'a Extension| of.cause.as_ref().and_then(|cause| cause.experiment.as_deref());
    own(cause)
        .or_else(|| own(rival))
        .unwrap_or("drives of another kind: a leader that stops, drives off fast, and keeps several speeds for minutes")
}

/// What to add where a member of the phase family is named although gusts are left: the observer's states are not what the car saw late.
fn in_gusts(causes: &[&Extension], noise: &Noise) -> String {
    if is_calm(noise) || causes.iter().all(|cause| cause.family() != PHASE) {
        return String::new();
    }
    format!(
        "; in gusts ({:.2} m/s² for {:.1} s at a time) a delay, a lag, a filter and an offset of time are easily taken for one another",
        noise.sigma_d, noise.tau_d
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::extension_named;

    #[test]
    fn gusts_leave_doubt_in_a_delay_and_in_nothing_else() {
        let [delay, grade] = ["perception_delay", "grade"].map(|name| extension_named(name).expect("in the library"));
        let gusts = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 0.02 };
        let calm = Noise { sigma_d: 0.004, ..gusts };
        assert!(in_gusts(&[grade, delay], &gusts).contains("0.05 m/s² for 2.0 s"));
        assert_eq!([in_gusts(&[grade], &gusts), in_gusts(&[delay], &calm)], ["", ""]);
    }
}
