//! Scores of the f32 evaluators against f64: all ninety variants on the twelve measured followers, random candidates within
//! Table 3, the paper's convention.
//!
//! By default each variant runs on three followers in turn with 64 candidates each, on the GPU on one of the three; lanes, which
//! give the GPU's bits (`gpu_lanes.rs`), stand in on the other two. With `LEADLAG_FULL` set: all twelve followers, 256
//! candidates, all on the GPU. The f64 value is that of lanes in f64; the reference itself runs on 8 candidates of each pair of
//! variant and follower. Whatever exceeds a limit is listed in `target/tmp/scores/*.csv` and judged window by window.

mod common;
mod gpu_common;

#[path = "scores/calibrations.rs"]
mod calibrations;
#[path = "scores/condition.rs"]
mod condition;
#[path = "scores/report.rs"]
mod report;
#[path = "scores/window.rs"]
mod window;

use common::followers::{self, Follower};
use common::tolerance::{
    CONDITIONED, DISTANCE_TO_BOUNDARY, LARGEST_EXCEPTION, SAME_STATUS, SCORE_COMPENSATED, SCORE_PLAIN, WHOLE_RUN,
};
use gpu_common::{scores, skipped};
use leadlag::catalog::Variant;
use leadlag::convention::Convention;
use leadlag::evaluator::{Case, Population, Score};
use leadlag::gpu::{AdapterChoice, Gpu};
use leadlag::lanes::{Lanes, LanesPrecision};
use leadlag::reference::Reference;
use leadlag::score::GoodnessOfFit;
use leadlag::wgsl::Precision;
use rayon::prelude::*;
use report::Report;

const PAPER: Convention = Convention::PAPER;

/// Candidates of each variant and follower that the reference runs too.
const BY_REFERENCE: usize = 8;

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
    /// Condition number; infinite where a small change of the parameters changes how the run ends.
    condition: f64,
    exact: Score,
    /// Plain and compensated.
    found: [Score; 2],
    /// By the GPU, not by lanes.
    on_gpu: bool,
}

impl Judged {
    /// Relative error of a score, where there are two.
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
        Score::Failed(failure) => failure.kind.name(),
    }
}

/// A variant on a follower: every candidate in f64, plain and compensated; and how far the reference is from f64 lanes at most,
/// among well-conditioned candidates, with the number of pairs compared.
fn judge(
    followers: &[Follower],
    variant: Variant,
    number: usize,
    count: usize,
    on_gpu: bool,
) -> (Vec<Judged>, f64, usize) {
    let follower = &followers[number];
    let case = follower.case(variant, PAPER);
    let population = population(follower, variant, number, count);
    let (exact, conditions) = condition::scores_and_conditions(&case, &population);
    let found = PRECISIONS.map(|(on_device, in_lanes, _)| {
        let by_lanes = scores(&mut lanes(&case, in_lanes), &population);
        if !on_gpu {
            return by_lanes;
        }
        let gof = GoodnessOfFit::NRMSE_SVA;
        let mut gpu =
            Gpu::new(vec![case.clone()], gof, on_device, &AdapterChoice::Best).unwrap_or_else(|e| panic!("{e}"));
        scores(&mut gpu, &population)
    });
    let mut head = Population::new(population.symbols());
    (0..BY_REFERENCE.min(count)).for_each(|i| head.push(population.values(i)));
    let by_reference = scores(&mut Reference::new(vec![case], GoodnessOfFit::NRMSE_SVA), &head);
    let (mut farthest, mut compared) = (0.0_f64, 0);
    for (i, reference) in by_reference.iter().enumerate().filter(|(i, _)| conditions[*i] <= CONDITIONED) {
        let difference = match (reference, &exact[i]) {
            (Score::Value(a), Score::Value(b)) => ((a - b) / a).abs(),
            (a, b) if a == b => 0.0,
            _ => f64::INFINITY,
        };
        let label = &follower.trajectory.label;
        let what = format!("{variant}, {label}, candidate {i} {:?}", population.values(i));
        assert!(difference <= WHOLE_RUN, "{what}: reference {reference:?}, lanes in f64 {:?}", exact[i]);
        (farthest, compared) = (farthest.max(difference), compared + 1);
    }
    let judged = (0..count).map(|i| Judged {
        variant,
        follower: number,
        candidate: i,
        condition: conditions[i],
        exact: exact[i],
        found: [found[0][i], found[1][i]],
        on_gpu,
    });
    (judged.collect(), farthest, compared)
}

#[test]
fn scores_are_those_of_f64() {
    let name = "scores_are_those_of_f64";
    let Some(shared) = common::shared(name) else { return };
    let no_gpu = skipped(name);
    let followers = followers::all(&shared);
    let (count, per_variant) = if is_full() { (256, followers.len()) } else { (64, 3) };
    let mut tasks = Vec::new();
    for variant in Variant::all() {
        for turn in 0..per_variant {
            // Steps of 4 visit one follower number of each platoon; the first moves on with the variant.
            let number = if is_full() { turn } else { (variant.id() as usize + 4 * turn) % followers.len() };
            tasks.push((variant, number, !no_gpu && (is_full() || turn == 0)));
        }
    }
    let mut report = Report::new(&followers, count);
    let results: Vec<_> = tasks
        .into_par_iter()
        .map(|(variant, number, on_gpu)| judge(&followers, variant, number, count, on_gpu))
        .collect();
    let farthest = results.iter().map(|(_, farthest, _)| *farthest).fold(0.0, f64::max);
    let compared: usize = results.iter().map(|(_, _, compared)| compared).sum();
    let judged: Vec<Judged> = results.into_iter().flat_map(|(judged, ..)| judged).collect();
    let on_gpu = judged.iter().filter(|j| j.on_gpu).count();
    report.say(format!(
        "{} candidates of 90 variants, {on_gpu} of them on the GPU; the reference on {compared} well-conditioned ones: at most \
         {farthest:.1e} from lanes in f64",
        judged.len()
    ));
    let complete = judged.iter().filter(|j| matches!(j.exact, Score::Value(_))).count();
    let well = judged.iter().filter(|j| matches!(j.exact, Score::Value(_)) && j.condition <= CONDITIONED).count();
    let hopeless = judged.iter().filter(|j| matches!(j.exact, Score::Value(_)) && j.condition.is_infinite()).count();
    report.say(format!(
        "{complete} run to the end, {well} of them with K <= {CONDITIONED}; {hopeless} have no K, as a change by 3e-7 makes them fail"
    ));

    let mut problems = Vec::new();
    let medians = [0, 1].map(|precision| errors(&judged, precision, &mut report, &mut problems));
    if medians[1] >= 0.5 * medians[0] {
        problems.push(format!("compensated is not better: median errors {medians:?}"));
    }
    statuses(&judged, &followers, &mut report, &mut problems);
    ill_conditioned(&judged, &followers, &mut report, &mut problems);
    report.by_variant(&judged);
    report.finish();
    assert!(problems.is_empty(), "{} problems:\n{}", problems.len(), problems[..problems.len().min(30)].join("\n"));
}

/// Errors of the well-conditioned candidates in one precision; returns their median.
fn errors(judged: &[Judged], precision: usize, report: &mut Report, problems: &mut Vec<String>) -> f64 {
    let (_, in_lanes, limit) = PRECISIONS[precision];
    let name = in_lanes.name();
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

/// Judges candidates window by window, and lists them.
fn windows(list: &[&Judged], precision: usize, kind: &str, report: &mut Report, problems: &mut Vec<String>) {
    let judge = |j: &&Judged| {
        let population = j.population(report.followers, report.count);
        let case = report.followers[j.follower].case(j.variant, PAPER);
        let [in_f32, in_f64] = [PRECISIONS[precision].1, LanesPrecision::F64].map(|precision| lanes(&case, precision));
        window::largest(&case, &population.parameters(j.candidate), &in_f32, &in_f64)
    };
    let found: Vec<window::Largest> = list.par_iter().map(judge).collect();
    let (mut first_step, mut largest, mut count, mut unstable) = ([0.0_f64; 3], [0.0_f64; 3], 0, 0);
    for (j, found) in list.iter().zip(&found) {
        report.exception(j, precision, kind, found);
        for k in 0..3 {
            first_step[k] = first_step[k].max(found.first_step[k]);
            largest[k] = largest[k].max(found.difference[k]);
        }
        count += found.windows;
        unstable += found.unstable;
        if let Some(problem) = found.problem() {
            problems.push(format!("{} {}: {problem}", PRECISIONS[precision].1.name(), report.name(j)));
        }
    }
    report.say(format!(
        "{}: {} candidates judged in windows ({kind}): largest difference in the first step {}, in windows \
         {} (m, m/s, m/s2); {unstable} of {count} windows are unstable",
        PRECISIONS[precision].1.name(),
        list.len(),
        three(first_step),
        three(largest),
    ));
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
            if *distance > DISTANCE_TO_BOUNDARY {
                let what = report.name(j);
                let (f64_ending, f32_ending) = (ending(&j.exact), ending(&j.found[precision]));
                problems
                    .push(format!("{what}: {f64_ending} in f64, {f32_ending} {}: {distance:e} away", in_lanes.name()));
            }
        }
        let same = 1.0 - differ.len() as f64 / judged.len() as f64;
        report.say(format!(
            "{}: status equal on {:.3} % ({} exceptions, each flips in f64 when parameters change by at most {farthest:.0e}); \
             {steps} failures at another sample",
            in_lanes.name(),
            100.0 * same,
            differ.len()
        ));
        if same < SAME_STATUS {
            problems.push(format!("{}: status equal on {:.3} % only", in_lanes.name(), 100.0 * same));
        }
    }
}

/// One ill-conditioned candidate of every pair of variant and follower (of a sixth of them by default): whole runs mean nothing,
/// windows do.
fn ill_conditioned(judged: &[Judged], followers: &[Follower], report: &mut Report, problems: &mut Vec<String>) {
    let mut sample: Vec<&Judged> = Vec::new();
    for j in judged.iter().filter(|j| j.condition > CONDITIONED && matches!(j.exact, Score::Value(_))) {
        let last = sample.last().map(|last| (last.variant, last.follower));
        if last != Some((j.variant, j.follower)) && (is_full() || j.follower % 2 == 0 && j.variant.id() % 3 == 0) {
            sample.push(j);
        }
    }
    assert!(followers.len() == 12 && !sample.is_empty(), "some candidate is ill-conditioned");
    for precision in [0, 1] {
        windows(&sample, precision, "ill-conditioned", report, problems);
    }
}
