//! Delays, lags, phases, stretches and responses to the cars ahead mean the same here as in a car that is simulated in steps of 0.01 s: a
//! fit finds the planted ones.
//!
//! Synthetic drives share no code with the evaluators. Its car has an effect of a known size. The same law with that effect, simulated in steps
//! of 0.1 s with the law reading half a step ahead (an acceleration that holds for a step is late by as much), must be closest to it at
//! the planted value.

use leadlag::internal::calibrate::Overrides;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::diagnose::Drive;
use leadlag::internal::evaluator::{Case, Evaluator, Job, Population};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::Reference;
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::synthetic::{self, CarTruth, Controller, Noise, Profile, Scenario};
use leadlag::internal::trajectory::{Preparation, Trajectory, import, prepare};
use leadlag::internal::wgsl::extension_named;

/// Largest error of a time that is found \[s\]; a scheme that is off by half a step has 0.05.
const MOST: f64 = 0.012;

const LAW: [(&str, f64); 6] = [("k_s", 0.1), ("k_v", 0.6), ("k_0", 0.3), ("v_0", 34.0), ("t_h", 1.4), ("d_0", 3.0)];

/// A drive behind a restless leader, without noise; `effect` may be empty.
fn drive(effect: &str, cars_between: usize) -> Trajectory {
    let value = |name: &str| LAW.iter().find(|(n, _)| *n == name).expect("a parameter of the law").1;
    let controller = Controller::Linear {
        v_0: value("v_0"),
        t_h: value("t_h"),
        d_0: value("d_0"),
        k_s: value("k_s"),
        k_v: value("k_v"),
        k_0: value("k_0"),
    };
    let mut car = CarTruth { controller, ..synthetic::drawn(synthetic::Base::LCth, 1, 1) };
    car.effects = effect.split_whitespace().map(|effect| effect.parse().expect("an effect")).collect();
    let mut followers = vec![synthetic::drawn(synthetic::Base::Idm, 7, 1); cars_between];
    followers.push(car);
    let scenario = Scenario {
        noise: Noise::NONE,
        profile: Profile::Restless,
        duration_s: 300.0,
        followers,
        ..Scenario::default()
    };
    let mut file = Vec::new();
    synthetic::write_pair(&synthetic::run(&scenario).expect("it can be driven"), 1 + cars_between, &mut file)
        .expect("memory");
    let recording = import::read_bytes(&file, "pair.csv", None).expect("what was just written");
    prepare(&recording, 1, &Preparation::default()).expect("a good drive").remove(0)
}

/// Difference of the best time from the planted one \[s\]; `parameters` are those of the effect delayed by that time.
fn error_of(effect: &str, planted: &str, parameters: &dyn Fn(f64) -> Vec<(&'static str, f64)>) -> f64 {
    let base: Variant = "l-cth".parse().expect("a variant");
    let with = |variant: Variant, name: &str| variant.with(extension_named(name).expect("built in")).expect("it fits");
    let variant = with(with(base, effect), "lead");
    let case =
        Case::new(&drive(planted, 0), variant, None, Convention::PAPER, 0.8).expect("all that the variant needs");
    let shifts: Vec<f64> = (-6..=6).map(|k| 0.01 * f64::from(k)).collect();
    let mut population = Population::new(&variant.parameters());
    for shift in &shifts {
        let own = parameters(*shift);
        let value = |name: &str| match name {
            "lead_h" => 0.05,
            name => LAW.iter().chain(&own).find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name} has no value")).1,
        };
        population.push(&variant.parameters().iter().map(|symbol| value(symbol.name())).collect::<Vec<_>>());
    }
    let mut reference = Reference::new(vec![case], GoodnessOfFit::NRMSE_SVA);
    let outcomes = reference.outcomes(&[Job { case: 0, population: &population }]).expect("it runs");
    let scores: Vec<f64> =
        outcomes.iter().map(|o| GoodnessOfFit::NRMSE_SVA.of(o.result.as_ref().expect("no crash"))).collect();
    let best = (0..scores.len()).min_by(|a, b| scores[*a].total_cmp(&scores[*b])).expect("candidates");
    println!("{effect}: {:+.2} s, scores {scores:.5?}", shifts[best]);
    shifts[best]
}

fn found(effect: &str, planted: &str, parameters: &dyn Fn(f64) -> Vec<(&'static str, f64)>) {
    let error = error_of(effect, planted, parameters);
    assert!(error.abs() < MOST, "{effect} is found {error:+.2} s late");
}

#[test]
fn delays() {
    found("perception_delay", "perception_delay:tp=0.4", &|shift| vec![("tp", 0.4 + shift)]);
    found("time_offset", "time_offset:to=0.3", &|shift| vec![("to", 0.3 + shift)]);
}

#[test]
fn lags() {
    found("actuation_lag", "actuation_lag:ta=0.5", &|shift| vec![("ta", 0.5 + shift)]);
    found("sensor_lowpass", "sensor_lowpass:tf=0.4", &|shift| vec![("tf", 0.4 + shift)]);
    found("asym_lag", "asym_lag:ta=0.7,tb=0.3", &|shift| vec![("ta", 0.7 + shift), ("tb", 0.3 + shift)]);
}

#[test]
fn phases() {
    let f = 0.3;
    found("periodic", "periodic:f=0.3,As=0.3,Ac=0.0", &|shift| {
        let angle = std::f64::consts::TAU * f * shift;
        vec![("As", 0.3 * angle.cos()), ("Ac", -0.3 * angle.sin()), ("f", f)]
    });
}

/// Ends of a stretch lie between two samples. (On whole samples any time within a tenth of a second is as good.)
#[test]
fn stretches() {
    let planted = "set_speed_change:vlim=18,t1=60.03,dur=8.02";
    found("set_speed_change", planted, &|shift| vec![("vlim", 18.0), ("t1", 60.03 + shift), ("dur", 8.02)]);
    found("set_speed_change", planted, &|shift| vec![("vlim", 18.0), ("t1", 60.03), ("dur", 8.02 + shift)]);
}

/// NRMSE(s,v,a) of the law with an effect of the size that is planted, as a diagnosis simulates it.
fn left(effect: &str, planted: &str, size: f64) -> f64 {
    let base: Variant = "l-cth".parse().expect("a variant");
    let with = |variant: Variant, name: &str| variant.with(extension_named(name).expect("built in")).expect("it fits");
    let variant = with(with(base, effect), "lead");
    let (drives, _) = Drive::of(&drive(planted, 1), None).expect("a drive without jumps");
    let case = drives[0].case(variant, &Overrides::default()).expect("all that the variant needs");
    let value = |name: &str| match name {
        "lead_h" => 0.05,
        "k2" | "ka" => size,
        name => LAW.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name} has no value")).1,
    };
    let mut population = Population::new(&variant.parameters());
    population.push(&variant.parameters().iter().map(|symbol| value(symbol.name())).collect::<Vec<_>>());
    let mut reference = Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA);
    let job = [Job { case: 0, population: &population }];
    let outcomes = reference.outcomes(&job).expect("it runs");
    let left = GoodnessOfFit::NRMSE_SVA.of(outcomes[0].result.as_ref().expect("no crash"));
    let mut lanes = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64).expect("a valid text");
    let same = lanes.outcomes(&job).expect("it runs");
    let same = GoodnessOfFit::NRMSE_SVA.of(same[0].result.as_ref().expect("no crash"));
    assert!((left - same).abs() < 1e-9 * left, "{effect}: {left:e} by the reference, {same:e} by lanes");
    left
}

/// The signals of the cars ahead are also read half a step ahead, and accelerations are not smoothed twice: with the planted size, the
/// remaining error is hardly larger than for a car without the effect. (Otherwise it would be ten and six times as large.)
#[test]
fn answers_to_the_cars_ahead() {
    let quiet = left("multi_anticipation", "", 0.0);
    for (effect, planted, size) in
        [("multi_anticipation", "multi_anticipation:k2=0.1", 0.1), ("leader_accel_ff", "leader_accel_ff:ka=0.2", 0.2)]
    {
        let left = left(effect, planted, size);
        println!("{effect}: {left:.6}, without effect {quiet:.6}");
        assert!(left < 2.0 * quiet, "{effect}: NRMSE {left:.6}, {quiet:.6} without an effect");
    }
}
