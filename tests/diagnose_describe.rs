//! The description of an error: its budget, its profiles, its formula, on made-up series whose answer is known.

use leadlag::diagnose::budget::{Errors, Regime, budget};
use leadlag::diagnose::formula::formula;
use leadlag::diagnose::missing::{Missing, profiles};
use leadlag::diagnose::scene::Scene;

const DT: f64 = 0.1;

/// Numbers in -1..1 that look random.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A drive of 900 s on a lap of 2 km: the speed swings slowly, the grade repeats with the place.
fn scene(seed: u64) -> Scene {
    let mut random = noise(seed);
    let phase = 3.0 * random();
    let count = 9000;
    let t: Vec<f64> = (0..count).map(|i| f64::from(i) * DT).collect();
    let v: Vec<f64> = t.iter().map(|t| 15.0 + 8.0 * (0.05 * t + phase).sin() + 3.0 * (0.31 * t).sin()).collect();
    let a: Vec<f64> = t.iter().map(|t| 0.4 * (0.05 * t + phase).cos() + 0.93 * (0.31 * t).cos()).collect();
    let mut x = 100.0 * phase;
    let place: Vec<f64> = v
        .iter()
        .map(|v| {
            x += v * DT;
            x.rem_euclid(2000.0)
        })
        .collect();
    Scene {
        label: format!("drive {seed}"),
        s: t.iter().map(|t| 20.0 + 6.0 * (0.083 * t + phase).sin()).collect(),
        dv: t.iter().map(|t| 0.9 * (0.21 * t).sin()).collect(),
        a_l: t.iter().map(|t| 0.5 * (0.17 * t + 1.0).sin()).collect(),
        sin_grade: Some(place.iter().map(|x| 0.03 * (x * std::f64::consts::TAU / 1000.0).sin()).collect()),
        place: Some(place),
        dt: DT,
        t,
        v,
        a,
    }
}

#[test]
fn a_budget_puts_the_error_where_it_is() {
    let scene = scene(1);
    let count = scene.len();
    // The spacing errs at 0.03 Hz, the speed while braking, the acceleration above 20 m/s.
    let s: Vec<f64> = scene.t.iter().map(|t| (std::f64::consts::TAU * 0.03 * t).sin()).collect();
    let braking = |i: &usize| Regime::of(&scene, *i) == Regime::Braking;
    let v: Vec<f64> = (0..count).map(|i| f64::from(u8::from(braking(&i)))).collect();
    let a: Vec<f64> = scene.v.iter().map(|v| f64::from(u8::from(*v >= 20.0))).collect();
    let first = 9;
    let errors = Errors { scene: &scene, first, values: [&s[first..], &v[first..], &a[first..]] };
    let budget = budget(&[errors]).expect("there are samples");
    for division in [&budget.regime, &budget.frequency, &budget.speed, &budget.place, &budget.time] {
        for signal in 0..3 {
            let sum: f64 = division.iter().map(|share| share.error[signal]).sum();
            assert!((sum - 1.0).abs() < 1e-9, "shares add up to {sum}: {division:?}");
        }
    }
    assert!((budget.rms[0] - 0.5_f64.sqrt()).abs() < 0.01 && budget.bias[0].abs() < 0.01);
    let band = budget.frequency.iter().find(|share| share.name == "0.01 to 0.05 Hz").expect("a band");
    assert!(band.error[0] > 0.97, "{:?}", budget.frequency);
    let worst = budget.worst_regime(1).expect("a regime");
    assert!(worst.name == "braking" && (worst.error[1] - 1.0).abs() < 1e-12, "{worst:?}");
    let fast: f64 =
        budget.speed.iter().filter(|s| s.name.starts_with("20") || s.name.starts_with("25")).map(|s| s.error[2]).sum();
    assert!((fast - 1.0).abs() < 1e-12, "{:?}", budget.speed);
}

/// d = -0.3 g sin(grade) + noise that is correlated over seconds.
fn graded(scene: &Scene, seed: u64) -> Vec<f64> {
    let (mut random, mut slow) = (noise(seed), 0.0);
    let grade = scene.sin_grade.as_ref().expect("a road");
    grade
        .iter()
        .map(|sin| {
            slow = 0.95 * slow + 0.02 * random();
            -0.3 * 9.81 * sin + slow
        })
        .collect()
}

#[test]
fn the_missing_acceleration_follows_the_grade_and_the_place() {
    let scenes = [scene(2), scene(3)];
    let d: Vec<Vec<f64>> = scenes.iter().zip(7..).map(|(scene, seed)| graded(scene, seed)).collect();
    let missing: Vec<Missing> = scenes.iter().zip(&d).map(|(scene, d)| Missing { scene, d, gap_error: None }).collect();
    let found = profiles(&missing).expect("there is d");
    let profile = |name: &str| found.profiles.iter().find(|p| p.name == name).expect("a profile");
    let grade = profile("sine of the grade");
    assert!(grade.explained > 0.5 && grade.chi2 > 20.0, "{grade:?}");
    for class in &grade.classes {
        let truth = -0.3 * 9.81 * class.at;
        assert!((class.mean - truth).abs() < 4.0 * class.error + 0.005, "{class:?}, expected {truth}");
    }
    assert!(found.repeats_by_place.expect("two drives on one lap") > 0.8);
    assert!(profile("acceleration of the car ahead").explained < 0.05);

    let formula = formula(&missing).expect("a term");
    assert_eq!(formula.terms.len(), 2, "{}", formula.equation());
    let term = &formula.terms[1];
    assert_eq!(term.name, "sin_grade");
    assert!((term.factor + 0.3 * 9.81).abs() < 4.0 * term.error, "{term:?}");
    assert!((formula.explained_held_out - formula.explained).abs() < 0.1);
}

#[test]
fn noise_has_no_formula() {
    for seed in 1..=8 {
        let scenes = [scene(seed), scene(seed + 20)];
        let d: Vec<Vec<f64>> = scenes
            .iter()
            .map(|scene| {
                let (mut random, mut slow) = (noise(seed + 50), 0.0);
                scene
                    .t
                    .iter()
                    .map(|_| {
                        slow = 0.95 * slow + 0.02 * random();
                        slow
                    })
                    .collect()
            })
            .collect();
        let missing: Vec<Missing> =
            scenes.iter().zip(&d).map(|(scene, d)| Missing { scene, d, gap_error: None }).collect();
        assert_eq!(formula(&missing), None, "seed {seed}");
        let found = profiles(&missing).expect("there is d");
        for profile in &found.profiles {
            assert!(profile.chi2 < 4.0, "seed {seed}: {profile:?}");
        }
    }
}
