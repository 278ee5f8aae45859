//! Summary of the finished cases.

use super::super::Machine;
use super::judge::{DiagnosisOutcome, Judgement, judge};
use super::plan::{BASES, DiagnosisTask, MEDIUM};
use crate::batch::Journal;
use crate::statistics::upper_median;
use serde::Serialize;
use std::collections::BTreeMap;

/// The rows that count all bases.
const ALL_BASES: &str = "all bases";

/// Counts of one row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Cases that could be made.
    pub cases: usize,
    /// See [`Judgement`].
    pub right: usize,
    /// The truth in the set, right answers included.
    pub in_set: usize,
    /// One of two effects is named, and no other cause.
    pub half: usize,
    /// Cases without a name.
    pub silent: usize,
    /// Cases without a name in which the truth would have been named if the search had found it; the others lack evidence.
    pub not_found: usize,
    /// Wrong names and false alarms.
    pub wrong: usize,
}

/// A target of the benchmark, and the value reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bar {
    /// The counted quantity.
    pub what: String,
    /// Cases that count.
    pub cases: usize,
    /// Their number.
    pub count: usize,
    /// The target for the share: the minimum, or the maximum if `most`.
    pub target: f64,
    /// True if `target` is a maximum.
    pub most: bool,
    /// 95 % interval of the share (Wilson, J. Am. Stat. Assoc. 22, 1927, 209-212).
    pub interval: [f64; 2],
    /// True if the share meets the target; `None` without a case.
    pub met: Option<bool>,
}

impl Bar {
    fn new(what: String, cases: usize, count: usize, target: f64, most: bool) -> Bar {
        let share = count as f64 / cases as f64;
        let met = (cases > 0).then_some(if most { share <= target } else { share >= target });
        Bar { what, cases, count, target, most, interval: interval(cases, count), met }
    }
}

fn interval(cases: usize, count: usize) -> [f64; 2] {
    /// 95 % of a normal distribution.
    const Z: f64 = 1.959964;
    if cases == 0 {
        return [0.0, 1.0];
    }
    let (n, p) = (cases as f64, count as f64 / cases as f64);
    let middle = p + Z * Z / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    [middle - half, middle + half].map(|x| (x / (1.0 + Z * Z / n)).clamp(0.0, 1.0))
}

/// One row of the power table: number of single effects named right, by their size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Power {
    /// A base, all bases, or an effect.
    pub of: String,
    /// One entry per size, the smallest first.
    pub sizes: Vec<PowerAt>,
}

/// Number of effects of one size named right.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerAt {
    /// Change of the follower's speed \[m/s\], root mean square.
    pub rms_mps: f64,
    /// Cases that could be made.
    pub cases: usize,
    /// Those that are named right.
    pub right: usize,
    /// 95 % interval of the share.
    pub interval: [f64; 2],
}

/// Evidence of the likeliest cause of each drive without an effect, as a share of the threshold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Silence {
    /// A base, or all bases.
    pub of: String,
    /// Drives that could be made and diagnosed.
    pub cases: usize,
    /// Median over the drives.
    pub median: f64,
    /// Exceeded by one drive in twenty.
    pub one_in_twenty: f64,
    pub highest: f64,
}

/// Share of the possible gain that a named effect should bring.
pub const MOST_OF_IT: f64 = 0.8;

/// Gains of extended models on the hold-out, as shares of the gains of the truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gains {
    /// Median share.
    pub median: f64,
    /// Cases with at least [`MOST_OF_IT`].
    pub most: usize,
    /// All of them.
    pub cases: usize,
}

/// The summary of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiagnosisReport {
    /// Version of this layout.
    pub schema_version: u32,
    /// Number of cases, done or not.
    pub planned: usize,
    /// Counts by kind, base and size.
    pub tallies: BTreeMap<String, Tally>,
    /// Targets.
    pub bars: Vec<Bar>,
    /// Rate of first names, by planted cause.
    pub names: BTreeMap<String, BTreeMap<String, usize>>,
    /// Power: single effects named right, by size, on each base and on all.
    pub powers: Vec<Power>,
    /// The same for each effect.
    pub powers_by_effect: Vec<Power>,
    /// How close drives without an effect come to a name, on each base and on all.
    pub silence: Vec<Silence>,
    /// Medians over the cases: CPU time \[s\], simulated candidates.
    pub cost: [f64; 2],
    /// Cases that could not be made.
    pub failed: usize,
    /// Number of cases with one or two effects named right in which all estimated parameters are within 10 % or three standard errors of
    /// the planted ones; and the number of all such cases.
    pub close_estimates: [usize; 2],
    /// Gains of extended models; `None` if there is nothing to compare.
    pub gains: Option<Gains>,
    /// The machine that wrote the summary.
    pub machine: String,
    /// All finished cases.
    pub outcomes: Vec<DiagnosisOutcome>,
    /// How each of them counts, and whether the data show its effects.
    pub judged: Vec<(Judgement, bool)>,
}

impl DiagnosisReport {
    /// Summarises the cases in the journal; `planned` is the total number.
    #[must_use]
    pub fn new(tasks: &[DiagnosisTask], planned: usize, journal: &Journal<DiagnosisOutcome>) -> DiagnosisReport {
        let outcomes: Vec<DiagnosisOutcome> = tasks.iter().filter_map(|task| journal.get(task)).cloned().collect();
        let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
        let mut names: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for outcome in &outcomes {
            let task = &outcome.task;
            let size = if task.kind == "one" { format!(" {:.2} m/s", task.rms_mps) } else { String::new() };
            let judged = judge(outcome);
            for base in [task.base.as_str(), ALL_BASES] {
                let tally = tallies.entry(format!("{}{size}, {base}", task.in_words())).or_default();
                tally.cases += usize::from(judged != Judgement::Failed);
                tally.right += usize::from(judged == Judgement::Right);
                tally.in_set += usize::from(matches!(judged, Judgement::Right | Judgement::InSet));
                tally.half += usize::from(judged == Judgement::Half);
                tally.silent += usize::from(judged == Judgement::Silent);
                let passes = outcome.known.as_ref().is_some_and(|known| known.objection.is_empty());
                tally.not_found += usize::from(judged == Judgement::Silent && passes);
                tally.wrong += usize::from(judged == Judgement::Wrong);
            }
            let truth = task.planted();
            let said = match outcome.adopted.join(" + ") {
                said if said.is_empty() => outcome.verdict.clone(),
                said => said,
            };
            *names.entry(truth).or_default().entry(said).or_default() += 1;
        }
        let median = |of: &dyn Fn(&DiagnosisOutcome) -> f64| upper_median(outcomes.iter().map(of)).unwrap_or(0.0);
        let cost = [median(&|o| o.cpu_s), median(&|o| o.simulations as f64)];
        let bars = bars(&outcomes);
        let [powers, powers_by_effect] = powers(&outcomes);
        let judged: Vec<(Judgement, bool)> = outcomes.iter().map(|o| (judge(o), o.is_shown())).collect();
        DiagnosisReport {
            schema_version: 1,
            planned,
            tallies,
            bars,
            names,
            powers,
            powers_by_effect,
            silence: silence(&outcomes),
            cost,
            failed: judged.iter().filter(|(judged, _)| *judged == Judgement::Failed).count(),
            close_estimates: close_estimates(&outcomes),
            gains: gains(&outcomes),
            machine: Machine::here().to_string(),
            outcomes,
            judged,
        }
    }
}

/// See [`DiagnosisReport::gains`].
fn gains(outcomes: &[DiagnosisOutcome]) -> Option<Gains> {
    let shares: Vec<f64> = outcomes.iter().filter_map(DiagnosisOutcome::share_of_gain).collect();
    let median = upper_median(shares.iter().copied())?;
    let most = shares.iter().filter(|share| **share >= MOST_OF_IT).count();
    Some(Gains { median, most, cases: shares.len() })
}

/// See [`DiagnosisReport::close_estimates`].
fn close_estimates(outcomes: &[DiagnosisOutcome]) -> [usize; 2] {
    let right = outcomes.iter().filter(|o| judge(o) == Judgement::Right && !o.estimates.is_empty());
    let close: Vec<bool> = right.filter_map(DiagnosisOutcome::is_close).collect();
    [close.iter().filter(|close| **close).count(), close.len()]
}

/// Power of each base and of all, and of each effect.
fn powers(outcomes: &[DiagnosisOutcome]) -> [Vec<Power>; 2] {
    let made = |o: &&DiagnosisOutcome| o.task.kind == "one" && judge(o) != Judgement::Failed;
    let made: Vec<&DiagnosisOutcome> = outcomes.iter().filter(made).collect();
    let mut sizes: Vec<f64> = made.iter().map(|o| o.task.rms_mps).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.dedup();
    let row = |of: &str, is: &dyn Fn(&DiagnosisOutcome) -> bool| {
        let at = |&rms_mps: &f64| {
            let here: Vec<Judgement> =
                made.iter().filter(|o| o.task.rms_mps == rms_mps && is(o)).map(|o| judge(o)).collect();
            let right = here.iter().filter(|judged| **judged == Judgement::Right).count();
            PowerAt { rms_mps, cases: here.len(), right, interval: interval(here.len(), right) }
        };
        Power { of: of.to_owned(), sizes: sizes.iter().map(at).collect() }
    };
    let mut causes: Vec<&String> = made.iter().flat_map(|o| &o.task.causes).collect();
    causes.sort();
    causes.dedup();
    let mut rows: Vec<Power> = BASES.iter().map(|base| row(base, &|o| o.task.base == *base)).collect();
    rows.push(row(ALL_BASES, &|_| true));
    [rows, causes.into_iter().map(|cause| row(cause, &|o| o.task.causes.contains(cause))).collect()]
}

/// True if a drive has a name although no effect was planted.
fn has_no_effect(outcome: &DiagnosisOutcome) -> bool {
    ["none", "coloured"].contains(&outcome.task.kind.as_str())
}

/// Evidence without an effect, for each base and for all.
fn silence(outcomes: &[DiagnosisOutcome]) -> Vec<Silence> {
    let row = |of: &str, is: &dyn Fn(&DiagnosisOutcome) -> bool| {
        let here = outcomes.iter().filter(|o| has_no_effect(o) && o.is_diagnosed() && is(o));
        let mut shares: Vec<f64> = here.map(DiagnosisOutcome::nearest).collect();
        shares.sort_by(|a, b| b.total_cmp(a));
        let exceeded_by = |share: f64| shares.get((share * shares.len() as f64) as usize).copied().unwrap_or(0.0);
        Silence {
            of: of.to_owned(),
            cases: shares.len(),
            median: exceeded_by(0.5),
            one_in_twenty: exceeded_by(0.05),
            highest: exceeded_by(0.0),
        }
    };
    let mut rows: Vec<Silence> = BASES.iter().map(|base| row(base, &|o| o.task.base == *base)).collect();
    rows.push(row(ALL_BASES, &|_| true));
    rows.retain(|row| row.cases > 0);
    rows
}

/// The targets of the benchmark. An effect counts as shown by the data if the truth, fitted from the planted values, gains more than the
/// threshold; in gusts, some effects of medium size do not.
fn bars(outcomes: &[DiagnosisOutcome]) -> Vec<Bar> {
    let bar = |what: String, of: &dyn Fn(&DiagnosisOutcome) -> bool, is: &[Judgement], target: f64, most: bool| {
        let made = outcomes.iter().filter(|o| of(o)).map(judge).filter(|judged| *judged != Judgement::Failed);
        let judged: Vec<Judgement> = made.collect();
        let count = judged.iter().filter(|judged| is.contains(judged)).count();
        Bar::new(what, judged.len(), count, target, most)
    };
    let one = |o: &DiagnosisOutcome| o.task.kind == "one";
    let medium = |o: &DiagnosisOutcome| one(o) && o.task.rms_mps == MEDIUM;
    let (right, in_set) = ([Judgement::Right], [Judgement::Right, Judgement::InSet]);
    let mut bars = Vec::new();
    for base in BASES {
        let of = |o: &DiagnosisOutcome| medium(o) && o.task.base == base;
        let shown = |o: &DiagnosisOutcome| of(o) && o.is_shown();
        bars.push(bar(format!("{base}: right name first, medium, shown"), &shown, &right, 0.85, false));
        bars.push(bar(format!("{base}: right name first, medium, all"), &of, &right, 0.85, false));
    }
    let shown = |o: &DiagnosisOutcome| medium(o) && o.is_shown();
    bars.push(bar("true cause in the set, medium, shown".to_owned(), &shown, &in_set, 0.92, false));
    bars.push(bar("true cause in the set, medium, all".to_owned(), &medium, &in_set, 0.92, false));
    bars.push(bar("wrong name, one effect of any size".to_owned(), &one, &[Judgement::Wrong], 0.05, true));
    bars.push(bar("false alarm, no effect".to_owned(), &has_no_effect, &[Judgement::Wrong], 0.025, true));
    let counted = |what: &str,
                   of: &dyn Fn(&DiagnosisOutcome) -> bool,
                   is: &dyn Fn(&DiagnosisOutcome) -> bool,
                   target: f64,
                   most: bool| {
        let known: Vec<bool> = outcomes.iter().filter(|o| of(o) && o.recommended.is_some()).map(is).collect();
        let count = known.iter().filter(|is| **is).count();
        Bar::new(what.to_owned(), known.len(), count, target, most)
    };
    let any = |o: &DiagnosisOutcome| o.recommended.as_ref().is_some_and(|names| !names.is_empty());
    bars.push(counted("recommended, no effect", &has_no_effect, &any, 0.025, true));
    bars.push(counted("family recommended, medium, shown", &shown, &DiagnosisOutcome::is_recommended, 0.5, false));
    let pair = |o: &DiagnosisOutcome| o.task.kind == "pair";
    let shown = |o: &DiagnosisOutcome| pair(o) && o.is_shown();
    bars.push(bar("both of two effects found, shown".to_owned(), &shown, &right, 0.70, false));
    bars.push(bar("both of two effects found, all".to_owned(), &pair, &right, 0.70, false));
    let absorbed = |o: &DiagnosisOutcome| o.task.kind == "absorbed";
    bars.push(bar("absorbed effect named as another".to_owned(), &absorbed, &[Judgement::Wrong], 0.0, true));
    bars
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::judge::oracle::Known;

    /// An outcome with the gain of the truth, if the journal has it; a name needs 16 nats.
    fn outcome(kind: &str, causes: &[&str], adopted: &[&str], gain: Option<f64>) -> DiagnosisOutcome {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let task = DiagnosisTask {
            kind: kind.to_owned(),
            base: "idm".to_owned(),
            causes: names(causes),
            rms_mps: MEDIUM,
            gusts_mps2: 0.0,
            duration_s: 900.0,
            seed: 1,
            effort: "quick".to_owned(),
        };
        let known = gain.map(|gain| Known {
            log_likelihoods: [100.0, 100.0 + gain],
            evidence: gain,
            threshold: 16.0,
            folds: [0.5 * gain; 2],
            transfers: 1.0,
            noise: [0.05, 2.0],
            objection: String::new(),
            parts: if causes.len() > 1 { vec![gain, 10.0] } else { Vec::new() },
            estimates: Vec::new(),
        });
        let verdict = if adopted.is_empty() { "nothing" } else { "named" }.to_owned();
        DiagnosisOutcome { verdict, adopted: names(adopted), known, ..DiagnosisOutcome::failed(task) }
    }

    #[test]
    fn targets_are_counted_over_the_cases_that_they_are_about() {
        let outcomes = [
            outcome("one", &["grade"], &["grade"], None),
            outcome("one", &["grade"], &["grade"], None),
            outcome("one", &["dead_zone"], &[], Some(9.0)),
            outcome("one", &["power_cap"], &["accel_cap"], Some(90.0)),
            outcome("none", &[], &[], None),
            outcome("coloured", &[], &["periodic"], None),
            outcome("pair", &["grade", "jerk_limit"], &["jerk_limit", "grade"], None),
            // The second effect gains 10 of the 16 nats needed.
            outcome("pair", &["grade", "jerk_limit"], &["grade"], Some(90.0)),
            outcome("absorbed", &["range_scale"], &[], None),
            // Named right, though the truth gains less than it needs.
            outcome("one", &["periodic"], &["periodic"], Some(9.0)),
        ];
        // The planted effect and another one; in a drive without an effect, another one only.
        let mut outcomes = outcomes;
        outcomes[0].recommended = Some(vec!["grade".to_owned()]);
        outcomes[3].recommended = Some(vec!["dead_zone".to_owned()]);
        outcomes[4].recommended = Some(Vec::new());
        outcomes[5].recommended = Some(vec!["periodic".to_owned()]);
        let bars = bars(&outcomes);
        let of = |what: &str| {
            let bar = bars.iter().find(|bar| bar.what.starts_with(what)).expect("a target");
            (bar.count, bar.cases, bar.met)
        };
        assert_eq!(of("idm: right name first, medium, shown"), (2, 3, Some(false)));
        assert_eq!(of("idm: right name first, medium, all"), (3, 5, Some(false)));
        assert_eq!(of("gipps: right name first, medium, all"), (0, 0, None));
        assert_eq!(of("wrong name"), (1, 5, Some(false)));
        assert_eq!(of("false alarm"), (1, 2, Some(false)));
        assert_eq!(of("both of two effects found, shown"), (1, 1, Some(true)));
        assert_eq!(of("both of two effects found, all"), (1, 2, Some(false)));
        assert_eq!(of("absorbed"), (0, 1, Some(true)));
        assert_eq!(of("recommended, no effect"), (1, 2, Some(false)));
        assert_eq!(of("family recommended"), (1, 2, Some(true)));
        // Wilson's interval of 3 of 4: (0.75 + 0.48036 -+ 0.65328...) / 1.96073.
        let [low, high] = interval(4, 3);
        assert!((low - 0.3006).abs() < 1e-4 && (high - 0.9544).abs() < 1e-4, "{low} {high}");
        assert_eq!(interval(0, 0), [0.0, 1.0]);
    }

    /// A cause above the threshold without a name failed another check.
    #[test]
    fn what_was_stopped_did_not_come_near() {
        let tried = vec![(1, "periodic".to_owned(), [Some(24.0), Some(24.0), Some(16.0)], String::new())];
        let near = DiagnosisOutcome { tried, ..outcome("none", &[], &[], None) };
        assert_eq!(near.nearest(), 0.0);
        assert_eq!(DiagnosisOutcome { adopted: vec!["periodic".to_owned()], ..near }.nearest(), 1.5);
    }
}
