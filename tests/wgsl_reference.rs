//! The two transcriptions of the paper agree: the WGSL text in f64 and the reference.

mod common;

use common::cars;
use common::tolerance::{WHOLE_RUN, WHOLE_RUN_SENSITIVE};
use leadlag::catalog::Variant;
use leadlag::convention::Convention;
use leadlag::evaluator::{Evaluator, Job, Outcome};
use leadlag::lanes::{Lanes, LanesPrecision};
use leadlag::reference::Reference;
use leadlag::score::GoodnessOfFit;
use leadlag::trajectory::Trajectory;

/// Largest relative difference of the measures; 0 for runs that failed alike, `None` if they ended differently.
fn difference(ours: &Outcome, reference: &Outcome) -> Option<f64> {
    match (&ours.result, &reference.result) {
        (Ok(ours), Ok(reference)) => {
            let pairs = ours.values().into_iter().zip(reference.values());
            Some(
                pairs
                    .map(|(a, b)| if a.to_bits() == b.to_bits() { 0.0 } else { ((a - b) / b).abs() })
                    .fold(0.0, f64::max),
            )
        }
        (Err(ours), Err(reference)) => (ours == reference).then_some(0.0),
        _ => None,
    }
}

/// Both evaluators on all variants; returns how many of the runs were compared, and how many were only close.
fn compare(trajectory: &Trajectory, convention: Convention, count: usize) -> (usize, usize) {
    let (mut compared, mut sensitive) = (0, 0);
    let mut wrong = Vec::new();
    for variant in Variant::all() {
        let case = cars::case(trajectory, variant, convention);
        let population = cars::population(variant, convention, count, u64::from(variant.id()));
        let jobs = [Job { case: 0, population: &population }];
        let gof = GoodnessOfFit::NRMSE_SVA;
        let ours =
            Lanes::new(vec![case.clone()], gof, LanesPrecision::F64).expect("every variant runs").outcomes(&jobs);
        let reference = Reference::new(vec![case], gof).outcomes(&jobs).expect("the reference runs");
        for (i, (ours, reference)) in ours.expect("delays are within bounds").iter().zip(&reference).enumerate() {
            compared += 1;
            let values = population.values(i);
            if ours.delay_steps != reference.delay_steps {
                wrong.push(format!("{variant} {values:?}: delay {} not {}", ours.delay_steps, reference.delay_steps));
            }
            match difference(ours, reference) {
                Some(d) if d <= WHOLE_RUN => {
                    let cuts = |o: &Outcome| (o.n_cut_acc, o.n_cut_dec);
                    if cuts(ours) != cuts(reference) {
                        sensitive += 1;
                    }
                }
                Some(d) if d <= WHOLE_RUN_SENSITIVE => sensitive += 1,
                d => wrong.push(format!("{variant} {values:?}: {d:?}: {ours:?} not {reference:?}")),
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {compared} runs:\n{}", wrong.len(), wrong[..wrong.len().min(5)].join("\n"));
    (compared, sensitive)
}

#[test]
fn whole_runs_of_every_variant() {
    let trajectory = cars::drive(200.0);
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let (compared, sensitive) = compare(&trajectory, convention, 24);
        println!("{compared} runs, {sensitive} of them sensitive");
        assert!(sensitive * 50 <= compared, "{sensitive} of {compared} runs differ by more than {WHOLE_RUN:e}");
    }
}

#[test]
fn whole_runs_on_measured_data() {
    let Some(shared) = common::shared("whole_runs_on_measured_data") else { return };
    let trajectory = cars::measured(&shared);
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let (compared, sensitive) = compare(&trajectory, convention, 4);
        println!("{compared} runs, {sensitive} of them sensitive");
        assert!(sensitive * 50 <= compared, "{sensitive} of {compared} runs differ by more than {WHOLE_RUN:e}");
    }
}
