//! Scores of the f32 evaluators against the reference: all ninety variants on the twelve measured followers, random candidates
//! within Table 3, the paper's convention.
//!
//! By default each variant runs on three followers in turn with 64 candidates each, on the GPU and in f64 lanes; with `LEADLAG_FULL` set on
//! all twelve followers with 256 candidates each. Every run of the reference is restarted in f32 at one window of 50 samples. Runs that
//! exceed a limit, listed in `target/tmp/scores/*.csv`, are restarted at every window.

mod calibrations;
mod condition;
mod report;
mod window;

use crate::common;
use crate::common::cars::Random;
use crate::common::followers::{self, Follower};
use crate::common::gpu::{job, skipped};
use crate::common::tolerance::{
    CHAOTIC, CONDITIONED, CONDITIONED_IN_F64, DISTANCE_TO_BOUNDARY, LARGEST_EXCEPTION, SAME_IN_F64, SAME_STATUS,
    SCORE_COMPENSATED, SCORE_PLAIN, UNSTABLE_SHARE, WHOLE_RUN,
};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{BufferSet, Case, Evaluator, Population, Score};
use leadlag::internal::gpu::{AdapterChoice, Gpu};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::{Reference, Trace};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::wgsl::Precision;
use rayon::prelude::*;
use report::Report;
use window::Largest;

const PAPER: Convention = Convention::PAPER;

/// The precisions of f32, with the limit for 99 % of the well-conditioned candidates.
const PRECISIONS: [(Precision, LanesPrecision, f64); 2] = [
    (Precision::Plain, LanesPrecision::Plain, SCORE_PLAIN),
    (Precision::Compensated, LanesPrecision::Compensated, SCORE_COMPENSATED),
];

fn is_full() -> bool {
    std::env::var_os("LEADLAG_FULL").is_some()
}

fn lanes(case: &Case, precision: LanesPrecision) -> Lanes {
    Lanes::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA, precision).unwrap_or_else(|e| panic!("{e}"))
}

/// One candidate in all precisions.
struct Judged {
    variant: Variant,
    follower: usize,
    candidate: usize,
    /// Condition number; infinite if a small change of the parameters changes how the run ends.
    condition: f64,
    /// By the reference.
    exact: Score,
    /// Plain and compensated, by the GPU if there is one, else by lanes, which give the same bits (`gpu_lanes.rs`).
    found: [Score; 2],
}

impl Judged {
    /// Relative error of a score, if there are two.
    fn error(&self, precision: usize) -> Option<f64> {
        match (self.exact, self.found[precision]) {
            (Score::Value(exact), Score::Value(found)) => Some(((found - exact) / exact).abs()),
            _ => None,
        }
    }

    /// The candidates of a pair of variant and follower are always the same ones.
    fn population(&self, followers: &[Follower], count: usize) -> Population {
        population(&followers[self.follower], self.variant, self.follower, count)
    }
}

fn population(follower: &Follower, variant: Variant, number: usize, count: usize) -> Population {
    let seed = u64::from(variant.id()) * 100 + number as u64;
    follower.population(variant, PAPER, count, seed, 0.0)
}

/// How a run ended, without the sample.
fn ending(score: &Score) -> &'static str {
    match score {
        Score::Value(_) => "complete",
        Score::Rejected => "rejected",
        Score::Failed(failure) => failure.kind.into_str(),
    }
}

/// A variant on some followers.
struct OfVariant {
    judged: Vec<Judged>,
    /// One window of every candidate, plain and compensated.
    windows: [Largest; 2],
    /// Differences of lanes in f64 from the reference where K is at most [`CONDITIONED_IN_F64`], with the candidate in words.
    in_f64: Vec<(f64, String)>,
}

/// Scores of the candidates of each case, by one evaluator for all of them.
fn scores_of_cases(evaluator: &mut dyn Evaluator, populations: &[Population]) -> Vec<Vec<Score>> {
    let jobs: Vec<_> = populations.iter().enumerate().map(|(case, population)| job(case, population)).collect();
    let mut scores = vec![Score::Rejected; populations.iter().map(Population::len).sum()];
    evaluator.submit(BufferSet::A, &jobs).unwrap_or_else(|e| panic!("{e}"));
    evaluator.collect(BufferSet::A, &mut scores).unwrap_or_else(|e| panic!("{e}"));
    let mut rest = scores.as_slice();
    let take = |population: &Population| rest.split_off(..population.len()).expect("one score per candidate").to_vec();
    populations.iter().map(take).collect()
}

/// Runs a variant in every precision.
fn judge(followers: &[Follower], variant: Variant, numbers: &[usize], count: usize, on_gpu: bool) -> OfVariant {
    let cases: Vec<Case> = numbers.iter().map(|number| followers[*number].case(variant, PAPER)).collect();
    let populations: Vec<Population> =
        numbers.iter().map(|number| population(&followers[*number], variant, *number, count)).collect();
    let found = PRECISIONS.map(|(on_device, in_lanes, _)| {
        let (cases, gof) = (cases.clone(), GoodnessOfFit::NRMSE_SVA);
        let mut evaluator: Box<dyn Evaluator> = if on_gpu {
            Box::new(Gpu::new(cases, gof, on_device, &AdapterChoice::Best).unwrap_or_else(|e| panic!("{e}")))
        } else {
            Box::new(Lanes::new(cases, gof, in_lanes).unwrap_or_else(|e| panic!("{e}")))
        };
        scores_of_cases(evaluator.as_mut(), &populations)
    });
    let mut all = OfVariant { judged: Vec::new(), windows: Default::default(), in_f64: Vec::new() };
    for (k, (case, population)) in cases.iter().zip(&populations).enumerate() {
        let (in_f64, conditions) = condition::scores_and_conditions(case, population);
        let in_f32 = PRECISIONS.map(|(_, precision, _)| lanes(case, precision));
        let windows_in_f64 = lanes(case, LanesPrecision::F64);
        let mut random = Random(u64::from(variant.id()) * 1000 + numbers[k] as u64);
        let mut trace = Trace::default();
        for i in 0..count {
            let parameters = population.parameters(i);
            let outcome = Reference::outcome(case, &parameters, &mut trace);
            let exact = outcome.score(&GoodnessOfFit::NRMSE_SVA, PAPER.bounds);
            let label = &followers[numbers[k]].trajectory.label;
            let what = || format!("{variant}, {label}, candidate {i} {:?}", population.values(i));
            if conditions[i] <= CONDITIONED_IN_F64 {
                let difference = match (exact, in_f64[i]) {
                    (Score::Value(a), Score::Value(b)) => ((a - b) / a).abs(),
                    (a, b) if a == b => 0.0,
                    _ => f64::INFINITY,
                };
                all.in_f64.push((difference, format!("{}, K = {:.1}", what(), conditions[i])));
            }
            let place = random.next();
            for (precision, in_f32) in in_f32.iter().enumerate() {
                let run = window::Run::new(case, parameters, (&outcome, &trace), [in_f32, &windows_in_f64]);
                let found = run.one_window(place);
                if let Some(problem) = found.problem() {
                    panic!("{}, {}: {problem}", what(), PRECISIONS[precision].1.into_str());
                }
                all.windows[precision] = std::mem::take(&mut all.windows[precision]).and(found);
            }
            let (number, condition) = (numbers[k], conditions[i]);
            let found = [found[0][k][i], found[1][k][i]];
            all.judged.push(Judged { variant, follower: number, candidate: i, condition, exact, found });
        }
    }
    all
}

#[test]
fn scores_are_those_of_the_reference() {
    let name = "scores_are_those_of_the_reference";
    let Some(shared) = common::shared(name) else { return };
    let no_gpu = skipped(name);
    let followers = followers::all(&shared);
    let count = if is_full() { 256 } else { 64 };
    let of_variant = |id: u32| {
        let variant = Variant::from_id(id).expect("a variant of the paper");
        // Steps of 4 visit the same follower number of each platoon; the first number changes with the variant.
        let some = (0..3).map(|turn| (id as usize + 4 * turn) % followers.len()).collect();
        let numbers: Vec<usize> = if is_full() { (0..followers.len()).collect() } else { some };
        judge(&followers, variant, &numbers, count, !no_gpu)
    };
    let results: Vec<OfVariant> = (1..=90).into_par_iter().map(of_variant).collect();
    let mut report = Report::new(&followers, count);
    let mut problems = Vec::new();
    let (mut judged, mut windows) = (Vec::new(), [Largest::default(), Largest::default()]);
    let mut in_f64 = Vec::new();
    for of in results {
        in_f64.extend(of.in_f64);
        judged.extend(of.judged);
        for (sum, more) in windows.iter_mut().zip(of.windows) {
            *sum = std::mem::take(sum).and(more);
        }
    }
    let on = if no_gpu { "in lanes, without a GPU on purpose" } else { "on the GPU" };
    report.say(format!("{} candidates of 90 variants, f32 {on}", judged.len()));
    double_precision(in_f64, &mut report, &mut problems);
    let complete = judged.iter().filter(|j| matches!(j.exact, Score::Value(_))).count();
    let well = judged.iter().filter(|j| matches!(j.exact, Score::Value(_)) && j.condition <= CONDITIONED).count();
    let hopeless = judged.iter().filter(|j| matches!(j.exact, Score::Value(_)) && j.condition.is_infinite()).count();
    report.say(format!(
        "{complete} run to the end, {well} of them with K <= {CONDITIONED}; {hopeless} have no K, as a change by 3e-7 makes them fail"
    ));
    for (precision, found) in windows.iter().enumerate() {
        say_windows(precision, judged.len(), "one each", found, &mut report, &mut problems);
    }
    let medians = [0, 1].map(|precision| errors(&judged, precision, &mut report, &mut problems));
    if medians[1] >= 0.5 * medians[0] {
        problems.push(format!("compensated is not better: median errors {medians:?}"));
    }
    statuses(&judged, &followers, &mut report, &mut problems);
    report.by_variant(&judged);
    report.finish();
    assert!(problems.is_empty(), "{} problems:\n{}", problems.len(), problems[..problems.len().min(30)].join("\n"));
}

/// Lanes in f64 against the reference, whole runs.
fn double_precision(mut found: Vec<(f64, String)>, report: &mut Report, problems: &mut Vec<String>) {
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let exceptions = found.iter().take_while(|(difference, _)| *difference > WHOLE_RUN).count();
    let share = 1.0 - exceptions as f64 / found.len() as f64;
    report.say(format!(
        "lanes in f64 on {} candidates with K <= {CONDITIONED_IN_F64}: {:.3} % within {WHOLE_RUN:e} of the reference, {exceptions} \
         exceptions, median {:.1e}",
        found.len(),
        100.0 * share,
        found[found.len() / 2].0
    ));
    for (difference, what) in &found[..exceptions] {
        report.say(format!("  {difference:.1e}: {what}"));
    }
    if share < SAME_IN_F64 {
        problems.push(format!("lanes in f64: {:.3} % within {WHOLE_RUN:e}", 100.0 * share));
    }
}

/// Errors of the well-conditioned candidates in one precision; returns their median.
fn errors(judged: &[Judged], precision: usize, report: &mut Report, problems: &mut Vec<String>) -> f64 {
    let (_, in_lanes, limit) = PRECISIONS[precision];
    let name = in_lanes.into_str();
    let of = |j: &&Judged| j.condition <= CONDITIONED && j.error(precision).is_some();
    let well: Vec<&Judged> = judged.iter().filter(of).collect();
    let mut sorted: Vec<f64> = well.iter().filter_map(|j| j.error(precision)).collect();
    sorted.sort_by(f64::total_cmp);
    let quantile = |q: f64| sorted[((sorted.len() - 1) as f64 * q) as usize];
    let share = |limit: f64| sorted.iter().filter(|error| **error <= limit).count() as f64 / sorted.len() as f64;
    report.say(format!(
        "{name}: {} scores with K <= {CONDITIONED}: median {:.2e}, 99 % {:.2e}, 99.9 % {:.2e}, largest {:.2e}; {:.3} % within \
         {limit:e}, {:.3} % within {LARGEST_EXCEPTION:e}",
        sorted.len(),
        quantile(0.5),
        quantile(0.99),
        quantile(0.999),
        quantile(1.0),
        100.0 * share(limit),
        100.0 * share(LARGEST_EXCEPTION),
    ));
    if share(limit) < 0.99 {
        problems.push(format!("{name}: {:.3} % of the scores within {limit:e}", 100.0 * share(limit)));
    }
    if share(LARGEST_EXCEPTION) < 0.999 {
        problems.push(format!(
            "{name}: {:.3} % of the scores within {LARGEST_EXCEPTION:e}",
            100.0 * share(LARGEST_EXCEPTION)
        ));
    }
    let exceptions: Vec<&Judged> = well.into_iter().filter(|j| j.error(precision) > Some(limit)).collect();
    windows(&exceptions, precision, "exception", report, problems);
    quantile(0.5)
}

fn three(values: [f64; 3]) -> String {
    values.map(|value| format!("{value:.1e}")).join(" ")
}

/// Results of a candidate's run by the reference, with lanes that may restart it in a precision of f32 and in f64.
fn of_run<T>(
    j: &Judged,
    followers: &[Follower],
    count: usize,
    precision: usize,
    of: impl Fn(window::Run<'_>) -> T,
) -> T {
    let case = followers[j.follower].case(j.variant, PAPER);
    let [in_f32, in_f64] = [PRECISIONS[precision].1, LanesPrecision::F64].map(|precision| lanes(&case, precision));
    let (parameters, mut trace) = (j.population(followers, count).parameters(j.candidate), Trace::default());
    let outcome = Reference::outcome(&case, &parameters, &mut trace);
    of(window::Run::new(&case, parameters, (&outcome, &trace), [&in_f32, &in_f64]))
}

/// Judges candidates at every window, and lists them.
fn windows(list: &[&Judged], precision: usize, kind: &str, report: &mut Report, problems: &mut Vec<String>) {
    let judge = |j: &&Judged| of_run(j, report.followers, report.count, precision, |run| run.every_window());
    let found: Vec<Largest> = list.par_iter().map(judge).collect();
    let mut all = Largest::default();
    for (j, found) in list.iter().zip(found) {
        report.exception(j, precision, kind, &found);
        if let Some(problem) = found.problem() {
            problems.push(format!("{} {}: {problem}", PRECISIONS[precision].1.into_str(), report.name(j)));
        }
        all = all.and(found);
    }
    say_windows(precision, list.len(), kind, &all, report, problems);
}

fn say_windows(
    precision: usize,
    candidates: usize,
    kind: &str,
    found: &Largest,
    report: &mut Report,
    problems: &mut Vec<String>,
) {
    let name = PRECISIONS[precision].1.into_str();
    report.say(format!(
        "{name}: {candidates} candidates judged in windows ({kind}): largest difference in the first step {}, in windows {} (m, m/s, \
         m/s2); {} of {} windows are unstable",
        three(found.first_step),
        three(found.difference),
        found.unstable,
        found.windows
    ));
    if found.unstable as f64 > UNSTABLE_SHARE * found.windows as f64 {
        problems.push(format!("{name} ({kind}): {} of {} windows are unstable", found.unstable, found.windows));
    }
}

/// Candidates that end differently, with the distance to the boundary.
fn statuses(judged: &[Judged], followers: &[Follower], report: &mut Report, problems: &mut Vec<String>) {
    for (precision, (_, in_lanes, _)) in PRECISIONS.iter().enumerate() {
        let differ: Vec<&Judged> = judged.iter().filter(|j| ending(&j.exact) != ending(&j.found[precision])).collect();
        let step = |j: &&Judged| match (j.exact, j.found[precision]) {
            (Score::Failed(a), Score::Failed(b)) => a.kind == b.kind && a.step != b.step,
            _ => false,
        };
        let steps = judged.iter().filter(step).count();
        let distances: Vec<(f64, f64)> = differ
            .par_iter()
            .map(|j| {
                let population = j.population(followers, report.count);
                let case = followers[j.follower].case(j.variant, PAPER);
                let parameters = population.parameters(j.candidate);
                let distance = condition::distance(&case, population.symbols(), population.values(j.candidate));
                (distance, condition::smallest_spacing(&case, &parameters))
            })
            .collect();
        let farthest = distances.iter().map(|(distance, _)| *distance).fold(0.0, f64::max);
        for (j, (distance, spacing)) in differ.iter().zip(&distances) {
            report.status(j, precision, *distance, *spacing);
        }
        far_from_boundary(&differ, &distances, precision, followers, report, problems);
        let same = 1.0 - differ.len() as f64 / judged.len() as f64;
        report.say(format!(
            "{}: status equal on {:.3} % ({} exceptions, each flips in f64 when parameters change by at most {farthest:.0e}); \
             {steps} failures at another sample",
            in_lanes.into_str(),
            100.0 * same,
            differ.len()
        ));
        if same < SAME_STATUS {
            problems.push(format!("{}: status equal on {:.3} % only", in_lanes.into_str(), 100.0 * same));
        }
    }
}

/// Candidates that end differently in f32, but not in f64 with slightly changed parameters. They must be chaotic, so that f64 with another
/// order of rounding departs from the reference as well, and must pass the test of every window.
fn far_from_boundary(
    differ: &[&Judged],
    distances: &[(f64, f64)],
    precision: usize,
    followers: &[Follower],
    report: &mut Report,
    problems: &mut Vec<String>,
) {
    let name = PRECISIONS[precision].1.into_str();
    for (j, (distance, _)) in differ.iter().zip(distances).filter(|(_, (distance, _))| *distance > DISTANCE_TO_BOUNDARY)
    {
        windows(&[*j], precision, "status", report, problems);
        let departure = of_run(j, followers, report.count, precision, |run| run.departure());
        let (f64_ending, f32_ending) = (ending(&j.exact), ending(&j.found[precision]));
        let what = format!(
            "{}: {f64_ending} in f64, {f32_ending} {name}; f64 changes when parameters change by {distance:.0e}, and comes as far as \
             {departure:.1e} m from itself by rounding alone",
            report.name(j)
        );
        if departure < CHAOTIC {
            problems.push(what.clone());
        }
        report.say(format!("  {what}"));
    }
}
