//! Cases in the form of the evaluators that run the WGSL text, and the evaluator that replaces a failed one.

use crate::common::{
    self,
    made_up::{self, Way},
};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::{Convention, GradeLookup};
use leadlag::internal::evaluator::{
    BufferSet, Case, Course, CourseError, Differences, EvaluateError, Evaluator, Fallback, Job, Outcome, Population,
    Pull, Score, Slopes, Splitting, Table, Timings,
};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::Reference;
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::symbols::Symbol;
use leadlag::internal::trajectory::{Grade, Preparation, Trajectory, import, integrate, prepare};
use proptest::prelude::*;
use std::fmt::Write;

fn value(table: &Table, x: f64) -> f64 {
    let k = table.cell_of(x);
    let (cell, node) = (table.curves[0][k], table.node[k]);
    let line = if x < node { cell.below } else { cell.above };
    if x == node { cell.at } else { line.c + line.m * (x - node) }
}

proptest! {
    #[test]
    fn a_table_is_the_curve_it_was_made_from(
        steps in prop::collection::vec((0.5_f64..20.0, -0.1_f64..0.1), 1..60),
        shares in prop::collection::vec(-0.1_f64..1.1, 50),
        even in any::<bool>(),
    ) {
        let mut x = vec![-3.0];
        for (step, _) in &steps[1..] {
            x.push(x[x.len() - 1] + if even { 2.5 } else { *step });
        }
        let sin = steps.iter().map(|(_, sin)| *sin).collect();
        let grade = Grade { x, sin, period: None, source: None };
        let table = Table::grade(&grade, GradeLookup::Linear).expect("a small table");
        let (from, to) = (grade.x[0], grade.x[grade.x.len() - 1]);
        for at in shares.iter().map(|share| from + share * (to - from)).chain(grade.x.iter().copied()) {
            let (found, expected) = (value(&table, at), grade.at(at));
            prop_assert!((found - expected).abs() < common::tolerance::TABLE, "{at}: {found} not {expected}");
        }
    }

    /// The sum of the rounded displacements must not drift away from the position.
    #[test]
    fn rounded_ways_add_up_to_the_position(v in prop::collection::vec(0.0_f64..40.0, 20..200)) {
        let case = behind(&v);
        let course = Course::new(&case).expect("no table is needed");
        let mut x = 0.0;
        for (i, dx) in course.dx_l_f32().iter().enumerate() {
            x += f64::from(*dx);
            let error = x - (case.x_l[i] - case.x_l[0]);
            prop_assert!(error.abs() <= 4.0 * f64::from(f32::EPSILON), "sample {i}: {error} m");
        }
    }
}

/// A car that follows a leader with these speeds at the same speed, 20 m behind.
fn behind(v: &[f64]) -> Case {
    let x_f = integrate(0.0, v, 0.1);
    let x_l = x_f.iter().map(|x| x + 25.0).collect();
    let trajectory = made_up::trajectory("made up", 0.1, Way { x: x_l, v: v.to_vec() }, Way { x: x_f, v: v.to_vec() });
    let trajectory = Trajectory { s: vec![20.0; v.len()], ..trajectory };
    Case::new(&trajectory, Variant::from_id(37).unwrap(), None, Convention::PAPER, 0.8).expect("long enough")
}

#[test]
fn nodes_that_touch_are_refused() {
    let grade = Grade { x: vec![0.0, 1e-9, 5000.0], sin: vec![0.0, 0.01, 0.0], period: None, source: None };
    let error = Table::grade(&grade, GradeLookup::Linear).unwrap_err();
    assert!(matches!(error, CourseError::Table { .. }));
    let message = error.to_string();
    assert!(message.starts_with("the grade table has nodes only 0.000000001 apart"), "{message}");
    assert!(message.ends_with("thin the table out, or use --evaluator reference"), "{message}");
}

#[test]
fn a_grade_recorded_by_a_creeping_car_fits_a_table() {
    // 20,000 samples: 5 km at 25 m/s, with a standstill approached millimetre by millimetre.
    let mut x = vec![0.0];
    for i in 0..20_000 {
        let speed = if (9_000..12_000).contains(&i) { 1e-4 } else { 25.0 };
        x.push(x[i] + speed * 0.1);
    }
    let sin = x.iter().map(|x| 0.02 * (x / 300.0_f64).sin()).collect();
    let grade = Grade { x, sin, period: None, source: None };
    let table = Table::grade(&grade, GradeLookup::Linear).expect("close nodes on a line are left out");
    for at in grade.x.iter().step_by(7) {
        let error = value(&table, *at) - grade.at(*at);
        assert!(error.abs() < common::tolerance::THINNED, "at {at} m: {error}");
    }
}

/// A car in a jam: millimetres from sample to sample again and again, and a grade with five digits.
#[test]
fn a_grade_column_of_stop_and_go_traffic_fits_a_table() {
    let speed = |i: u32| 6.0 * (1.0 - (f64::from(i) * std::f64::consts::TAU / 600.0).cos());
    let v: Vec<f64> = (0..16_700).map(speed).collect();
    let sin: Vec<f64> = integrate(0.0, &v, 0.1).iter().map(|x| 0.03 * (x / 200.0).sin()).collect();
    let mut file = "time_s,lead_speed_mps,speed_mps,spacing_m,sin_grade\n".to_owned();
    for (i, (v, sin)) in v.iter().zip(&sin).enumerate() {
        writeln!(file, "{:.1},{v:.4},{v:.4},20,{sin:.5}", i as f64 / 10.0).expect("a String takes all");
    }
    let recording = import::read_bytes(file.as_bytes(), "jam.csv", None).expect("a pair file");
    let trajectory = prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0);
    let grade = trajectory.grade.as_ref().expect("from the column");
    assert!(grade.x.windows(2).all(|pair| pair[0] < pair[1]));
    let table = Table::grade(grade, GradeLookup::Linear).expect("a table of some cells per metre");
    assert!(table.node.len() < 60_000, "{} cells for 10 km", table.node.len());
    // A quarter of a metre of this road.
    for (x, sin) in trajectory.x_f.iter().zip(&sin).step_by(7) {
        let error = value(&table, *x) - sin;
        assert!(error.abs() < 1e-4, "at {x} m: {error}");
    }
}

/// A device that works for some generations and then is lost.
struct Failing {
    inner: Reference,
    generations: u32,
    /// The adapter goes with it.
    gone: bool,
}

impl Evaluator for Failing {
    leadlag::internal::forward_evaluator!(inner: cases, gof, submit, outcomes);

    fn name(&self) -> &'static str {
        "gpu"
    }
    fn precision(&self) -> &'static str {
        "plain"
    }
    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        if scores.is_empty() {
            return Err(EvaluateError::Room { candidates: 5, scores: 0 });
        }
        if self.generations == 0 && self.gone {
            return Err(EvaluateError::Adapter { wanted: None, present: Vec::new() });
        }
        if self.generations == 0 {
            let (adapter, message) = ("a card".to_owned(), "device lost".to_owned());
            return Err(EvaluateError::Device { doing: "reading scores", adapter, message });
        }
        self.generations -= 1;
        self.inner.collect(set, scores)
    }
    fn timings(&self) -> Timings {
        Timings { transfer_s: 2.0, first_dispatch_s: 0.5 }
    }
}

#[test]
fn what_was_under_way_when_a_device_failed_is_not_lost() {
    let v: Vec<f64> = (0..300).map(|i| 20.0 + 5.0 * (f64::from(i) / 40.0).sin()).collect();
    let reference = Reference::new(vec![behind(&v)], GoodnessOfFit::NRMSE_SVA);
    let symbols = [Symbol::k_s, Symbol::k_v, Symbol::k_0, Symbol::v_0, Symbol::d_0, Symbol::t_h];
    let population = |k_s: f64| {
        let mut population = Population::new(&symbols);
        (0..5).for_each(|i| population.push(&[k_s + f64::from(i) / 10.0, 0.3, 1.0, 33.0, 2.0, 1.0]));
        population
    };
    let (one, two) = (population(0.1), population(0.6));
    let scored = |evaluator: &mut dyn Evaluator, warned: u32| {
        let mut scores = [Score::Rejected; 5];
        let mut all = Vec::new();
        for _ in 0..2 {
            evaluator.submit(BufferSet::A, &[Job { case: 0, population: &one }]).expect("it starts");
            evaluator.submit(BufferSet::B, &[Job { case: 0, population: &two }]).expect("it starts");
            for set in [BufferSet::A, BufferSet::B] {
                evaluator.collect(set, &mut scores).expect("the second evaluator steps in");
                all.extend(scores);
            }
        }
        assert_eq!(evaluator.name(), if warned > 0 { "reference" } else { "gpu" });
        all
    };
    let expected = scored(&mut Failing { inner: reference.clone(), generations: 4, gone: false }, 0);
    for generations in 0..4 {
        let failing = Box::new(Failing { inner: reference.clone(), generations, gone: false });
        let replace = Box::new(|error: &EvaluateError, cases| {
            assert_eq!(error.to_string(), "reading scores on a card: device lost");
            Ok(Box::new(Reference::new(cases, GoodnessOfFit::NRMSE_SVA)) as Box<dyn Evaluator>)
        });
        assert_eq!(scored(&mut Fallback::new(failing, replace), 1), expected, "lost after {generations} generations");
    }
    // Wrong use does not switch the evaluator, and does not use up the second one.
    let failing = Box::new(Failing { inner: reference, generations: 0, gone: true });
    let replace = |error: &EvaluateError, cases| {
        assert!(matches!(error, EvaluateError::Adapter { .. }), "{error}");
        Ok(Box::new(Reference::new(cases, GoodnessOfFit::NRMSE_SVA)) as Box<dyn Evaluator>)
    };
    let mut fallback = Fallback::new(failing, Box::new(replace));
    fallback.submit(BufferSet::A, &[Job { case: 0, population: &one }]).expect("it starts");
    assert!(matches!(fallback.collect(BufferSet::A, &mut []), Err(EvaluateError::Room { candidates: 5, scores: 0 })));
    assert_eq!(fallback.name(), "gpu");
    // A device that takes its adapter with it is also replaced.
    let mut scores = [Score::Rejected; 5];
    fallback.collect(BufferSet::A, &mut scores).expect("the second evaluator steps in");
    assert_eq!((fallback.name(), &scores[..]), ("reference", &expected[..5]));
    // The times of the first one are kept.
    assert_eq!(fallback.timings(), Timings { transfer_s: 2.0, first_dispatch_s: 0.5 });
}

/// A device with room for some candidates at once.
struct Small {
    inner: Reference,
    room: usize,
}

impl Small {
    fn check(&self, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let (adapter, message) = ("a card".to_owned(), "out of memory".to_owned());
        if Job::candidates(jobs) > self.room { Err(EvaluateError::Memory { adapter, message }) } else { Ok(()) }
    }
}

impl Evaluator for Small {
    leadlag::internal::forward_evaluator!(inner: cases, gof);

    fn name(&self) -> &'static str {
        "gpu"
    }
    fn precision(&self) -> &'static str {
        "plain"
    }
    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        self.check(jobs)?;
        self.inner.submit(set, jobs)
    }
    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        self.inner.collect(set, scores)
    }
    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        self.check(jobs)?;
        self.inner.outcomes(jobs)
    }
    /// Those of `lanes`.
    fn slopes(&mut self, job: &Job<'_>, groups: &[Differences]) -> Result<Option<Vec<Slopes>>, EvaluateError> {
        let (adapter, message) = ("a card".to_owned(), "out of memory".to_owned());
        if groups.iter().map(|group| group.group().len()).sum::<usize>() > self.room {
            return Err(EvaluateError::Memory { adapter, message });
        }
        let lanes = Lanes::new(self.cases().to_vec(), *self.gof(), LanesPrecision::F64)?;
        lanes.slopes(job, groups, Pull::NONE).map(Some)
    }
}

#[test]
fn groups_that_do_not_fit_into_the_memory_of_a_device_are_split() {
    let v: Vec<f64> = (0..60).map(|i| 20.0 + 5.0 * (f64::from(i) / 20.0).sin()).collect();
    let reference = Reference::new(vec![behind(&v)], GoodnessOfFit::NRMSE_SVA);
    let mut population =
        Population::new(&[Symbol::k_s, Symbol::k_v, Symbol::k_0, Symbol::v_0, Symbol::d_0, Symbol::t_h]);
    (0..60).for_each(|i| population.push(&[0.1 + f64::from(i) / 200.0, 0.3, 1.0, 33.0, 2.0, 1.0]));
    let job = Job { case: 0, population: &population };
    let groups: Vec<Differences> = (0..11).map(|k| Differences { first: 5 * k, steps: vec![0.1; 1 + k % 3] }).collect();
    let small = |room: usize| Box::new(Small { inner: reference.clone(), room });
    let expected = small(100).slopes(&job, &groups).expect("it runs");
    for room in [4, 5, 8, 31, 32, 100] {
        assert_eq!(Splitting::new(small(room)).slopes(&job, &groups).expect("in pieces"), expected, "room for {room}");
    }
    assert!(matches!(Splitting::new(small(3)).slopes(&job, &groups), Err(EvaluateError::Memory { .. })));
    // Without a device there are none.
    let spare = reference.clone();
    let replace = Box::new(move |_: &EvaluateError, _| Ok(Box::new(spare.clone()) as Box<dyn Evaluator>));
    let mut fallback = Fallback::new(small(3), replace);
    assert_eq!(fallback.slopes(&job, &groups).expect("the second evaluator runs"), None);
    assert_eq!(fallback.name(), "reference");
}

#[test]
fn what_does_not_fit_into_the_memory_of_a_device_is_halved() {
    let v: Vec<f64> = (0..200).map(|i| 20.0 + 5.0 * (f64::from(i) / 40.0).sin()).collect();
    let mut reference = Reference::new(vec![behind(&v), behind(&v[..150])], GoodnessOfFit::NRMSE_SVA);
    let symbols = [Symbol::k_s, Symbol::k_v, Symbol::k_0, Symbol::v_0, Symbol::d_0, Symbol::t_h];
    let population = |count: u32| {
        let mut population = Population::new(&symbols);
        (0..count).for_each(|i| population.push(&[0.1 + f64::from(i) / 40.0, 0.3, 1.0, 33.0, 2.0, 1.0]));
        population
    };
    let (one, two) = (population(13), population(8));
    let jobs = [Job { case: 0, population: &one }, Job { case: 1, population: &two }];
    let mut expected = [Score::Rejected; 21];
    reference.submit(BufferSet::A, &jobs).expect("it starts");
    reference.collect(BufferSet::A, &mut expected).expect("it computes");
    let outcomes = reference.outcomes(&jobs).expect("it computes");
    for room in [1, 2, 4, 5, 20, 21, 100] {
        let mut halves = Splitting::new(Box::new(Small { inner: reference.clone(), room }));
        for _ in 0..2 {
            // Both sets in flight.
            halves.submit(BufferSet::A, &jobs).expect("it starts");
            halves.submit(BufferSet::B, &jobs[1..]).expect("it starts");
            let mut scores = [Score::Rejected; 21];
            halves.collect(BufferSet::A, &mut scores).expect("in pieces");
            assert_eq!(scores, expected, "room for {room}");
            let mut scores = [Score::Rejected; 8];
            assert!(matches!(halves.collect(BufferSet::B, &mut scores[..3]), Err(EvaluateError::Room { .. })));
            halves.submit(BufferSet::B, &jobs[1..]).expect("it starts");
            halves.collect(BufferSet::B, &mut scores).expect("in pieces");
            assert_eq!(scores, expected[13..], "room for {room}");
            assert_eq!(halves.outcomes(&jobs).expect("in pieces"), outcomes, "room for {room}");
        }
    }
    let mut none = Splitting::new(Box::new(Small { inner: reference, room: 0 }));
    none.submit(BufferSet::A, &jobs).expect("it may be less");
    let error = none.collect(BufferSet::A, &mut [Score::Rejected; 21]).expect_err("no room at all").to_string();
    assert!(error.starts_with("a card does not have enough memory: out of memory; "), "{error}");
}
