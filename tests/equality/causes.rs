//! The causes in two forms: their WGSL text in f64, and the reference, which is transcribed by hand. tests/mutants.rs changes the reference
//! and expects this to fail.

use crate::common::extended::{BASES, WHOLE_RUN, WHOLE_RUN_PERIODIC, case, spread, with};
use leadlag::internal::catalog::Variant;
use leadlag::internal::evaluator::{Evaluator, Job, Population, Score};
use leadlag::internal::extension::Extension;
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::{Reference, knows};
use leadlag::internal::score::{GoodnessOfFit, Measures};
use leadlag::internal::wgsl::{extension_named, laws, library, read_extension};

#[test]
fn lanes_in_f64_equal_the_reference() {
    let pick = |names: &[&str]| -> Vec<&'static Extension> {
        names.iter().map(|name| extension_named(name).expect("built in")).collect()
    };
    let mut sets: Vec<Vec<&'static Extension>> =
        library().iter().filter(|e| e.cause.is_some() || e.name == "lead").map(|e| vec![*e]).collect();
    sets.push(pick(&["perception_delay", "time_offset", "lead", "multi_anticipation", "leader_accel_ff"]));
    sets.push(pick(&["speed_dep_headway", "sensor_lowpass", "integral_action", "jerk_limit", "grade"]));
    let mut compared = 0;
    for base in BASES {
        for set in &sets {
            let variant = with(base, set);
            assert!(knows(&variant), "{variant}");
            let most = if set[0].name == "periodic" { WHOLE_RUN_PERIODIC } else { WHOLE_RUN };
            compared += compare(variant, most, 12);
        }
    }
    assert!(compared > 1000, "{compared} runs came to their end");
}

/// Compares some candidates; returns the number that reached the end.
fn compare(variant: Variant, most: f64, candidates: usize) -> usize {
    let case = case(variant);
    let population = spread(variant, candidates);
    let jobs = [Job { case: 0, population: &population }];
    let lanes = Lanes::new(vec![case.clone()], GoodnessOfFit::default(), LanesPrecision::F64);
    let ours = lanes.expect("a valid text").outcomes(&jobs).expect("short delays");
    let mut reference = Reference::new(vec![case], GoodnessOfFit::default());
    let theirs = reference.outcomes(&jobs).expect("it runs");
    let mut compared = 0;
    for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        assert_eq!(a.result.map(|_| ()), b.result.map(|_| ()), "{variant}, candidate {i}");
        let (Ok(a), Ok(b)) = (&a.result, &b.result) else { continue };
        compared += 1;
        for ((a, b), name) in a.values().into_iter().zip(b.values()).zip(Measures::NAMES) {
            let near = (a - b).abs() <= most * b.abs() || (a.is_nan() && b.is_nan());
            assert!(near, "{variant}, candidate {i}, {name}: {a} not {b}; {:?}", population.values(i));
        }
    }
    compared
}

/// The texts of the laws, state by state.
#[test]
fn laws_equal_the_reference_point_by_point() {
    for judge in crate::common::laws::judges() {
        judge.verdict(&|_, _| None).expect("both transcriptions say the same");
    }
}

/// Each law alone, with a delay and a lag, and with causes that need its equilibrium and the road.
#[test]
fn laws_in_f64_equal_the_reference() {
    let causes = |names: &[&str]| -> Vec<&'static Extension> {
        names.iter().map(|name| extension_named(name).expect("built in")).collect()
    };
    let sets = [vec![], causes(&["perception_delay", "grade"]), causes(&["dead_zone", "leader_accel_ff"])];
    for law in laws() {
        let name = law.name.as_str();
        for base in [name.to_owned(), format!("{name}+delay+linear+constant")] {
            for set in &sets {
                let variant = with(&base, set);
                assert!(knows(&variant), "{variant}");
                let compared = compare(variant, WHOLE_RUN, 48);
                assert!(
                    compared >= 4,
                    "{variant}: {compared} of 48 runs came to their end; are its bounds those of cars?"
                );
            }
        }
    }
}

/// No examined candidate makes the reference panic.
#[test]
fn what_the_reference_cannot_simulate_is_an_error() {
    let text = "fn own_command(a_cmd: f32) -> f32 {\n    return 0.9 * a_cmd;\n}\n";
    let own = read_extension("own.wgsl", text).expect("valid");
    let case = case(with("idm", &[extension_named("grade").expect("built in"), own]));
    assert!(!knows(&case.variant));
    let population = spread(case.variant, 2);
    let jobs = [Job { case: 0, population: &population }];
    let mut reference = Reference::new(vec![case], GoodnessOfFit::default());
    let expected =
        "the reference has no second transcription of extension own, so it cannot simulate variant idm+grade+own";
    let mut scores = [Score::Rejected; 2];
    for error in [
        reference.outcomes(&jobs).map(|_| ()).expect_err("no transcription"),
        reference.evaluate(&population, &mut scores).expect_err("no transcription"),
    ] {
        assert!(error.to_string().starts_with(expected), "{error}");
    }
}

/// The check of parameters refuses a delay below 0; a run with one has no delay.
#[test]
fn a_negative_delay_counts_as_none() {
    let case = case(with("idm", &[extension_named("perception_delay").expect("built in")]));
    let mut population = Population::new(&case.variant.parameters());
    let mut values = spread(case.variant, 1).values(0).to_vec();
    for tp in [-0.2, 0.0] {
        *values.last_mut().expect("tp is the last") = tp;
        population.push(&values);
    }
    let jobs = [Job { case: 0, population: &population }];
    let theirs = Reference::new(vec![case.clone()], GoodnessOfFit::default()).outcomes(&jobs).expect("it runs");
    assert_eq!(theirs[0].delay_steps, 0.0);
    // As text, because NaN is not equal to itself.
    assert_eq!(format!("{:?}", theirs[0]), format!("{:?}", theirs[1]));
    let mut lanes = Lanes::new(vec![case], GoodnessOfFit::default(), LanesPrecision::F64).expect("a valid text");
    let ours = lanes.raw(&jobs).expect("short delays");
    assert_eq!(format!("{:?}", ours[0]), format!("{:?}", ours[1]));
}
