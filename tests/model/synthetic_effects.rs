//! The effects of the synthetic truth act as described, with the requested strength.

use leadlag::internal::synthetic::{
    self, Base, Effect, EffectKind, Gusts, Noise, Profile, Scenario, Synthetic, SyntheticError,
};
use strum::VariantArray;

fn scenario(base: Base, profile: Profile, duration_s: f64) -> Scenario {
    let mut scenario = Scenario { noise: Noise::NONE, profile, duration_s, ..Scenario::default() };
    scenario.followers.truncate(1);
    scenario.followers[0] = synthetic::drawn(base, 1, 1);
    scenario
}

fn with(scenario: &Scenario, effects: &[&str]) -> Synthetic {
    let mut scenario = scenario.clone();
    let car = scenario.followers.last_mut().expect("there is a follower");
    car.effects = effects.iter().map(|text| text.parse().expect("an effect")).collect();
    synthetic::run(&scenario).unwrap_or_else(|e| panic!("{effects:?}: {e}"))
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64).sqrt()
}

/// Highest and lowest true acceleration of the last car.
fn extremes(drive: &Synthetic) -> (f64, f64) {
    let a = drive.a.last().expect("cars");
    a.iter().fold((f64::NEG_INFINITY, f64::INFINITY), |(high, low), a| (high.max(*a), low.min(*a)))
}

#[test]
fn every_effect_changes_every_base() {
    for base in Base::VARIANTS.iter().copied() {
        let mut scenario = scenario(base, Profile::Restless, 150.0);
        // Two cars ahead, for the effect that reads the second one.
        let first = synthetic::drawn(Base::LCth, 7, 2);
        scenario.followers.insert(0, first);
        let plain = with(&scenario, &[]);
        for kind in EffectKind::VARIANTS {
            let text = match kind {
                EffectKind::HeadwayModeChange => "headway_mode_change:t0=60".to_owned(),
                EffectKind::SetSpeedChange => "set_speed_change:t1=60".to_owned(),
                // At medium size it crashes behind a car that brakes twice as hard.
                EffectKind::DecelCap => "decel_cap:bcap=1.3".to_owned(),
                kind => kind.to_string(),
            };
            let changed = rms(&with(&scenario, &[&text]).v[2], &plain.v[2]);
            assert!(changed > 3e-3, "{kind} changes {base:?} by {changed} m/s only");
        }
    }
}

#[test]
fn as_strong_as_asked_for() {
    for (base, name) in [
        (Base::Idm, "grade"),
        (Base::Idm, "accel_cap"),
        (Base::LCth, "actuation_lag"),
        (Base::LCth, "periodic:f=0.05"),
        (Base::Gipps, "dead_zone"),
        (Base::Gipps, "aero_drag:cD=-1e-4"),
    ] {
        let mut asked = scenario(base, Profile::Restless, 120.0);
        let plain = synthetic::run(&asked).expect("drives");
        asked.followers[0].effects = vec![name.parse().expect("an effect")];
        for wanted in [0.03, 0.10] {
            let found = synthetic::at_amplitude(&asked, 1, wanted).unwrap_or_else(|e| panic!("{name}: {e}"));
            let effect = &found.followers[0].effects[0];
            let size = rms(&synthetic::run(&found).expect("drives").v[1], &plain.v[1]);
            assert!((size / wanted - 1.0).abs() < 0.02, "{name}: {size} m/s, wanted {wanted}, by {effect:?}");
            assert_eq!(effect.values()[0] < 0.0, name.contains("=-"), "the sign is kept: {effect:?}");
        }
    }
    let mut asked = scenario(Base::Idm, Profile::Cruise, 60.0);
    asked.followers[0].effects = vec![Effect::medium(EffectKind::QuantisedAccel)];
    let error = synthetic::at_amplitude(&asked, 1, 50.0).expect_err("no car is changed by 50 m/s");
    assert!(matches!(error, SyntheticError::Weak { car: 2, .. }), "{error}");
}

#[test]
fn delays_and_lags_are_those_of_the_base_models() {
    let plain = scenario(Base::LCth, Profile::Restless, 120.0);
    let mut slow = plain.clone();
    (slow.followers[0].tau_p, slow.followers[0].tau_a) = (0.25, 0.4);
    let known = synthetic::run(&slow).expect("drives");
    assert_eq!(with(&plain, &["perception_delay:tp=0.25", "actuation_lag:ta=0.4"]).x, known.x);
    assert_eq!(with(&plain, &["perception_delay:tp=0.25", "asym_lag:ta=0.4,tb=0.4"]).x, known.x);
    // With a lag only for braking it brakes later and harder.
    assert!(rms(&with(&plain, &["asym_lag:ta=0,tb=0.8"]).v[1], &with(&plain, &[]).v[1]) > 0.02);
}

#[test]
fn what_is_absorbed_by_calibration() {
    // Under a constant headway a scaled spacing acts like other gains, and a bias like another standstill spacing.
    let scenario = scenario(Base::LCth, Profile::Restless, 120.0);
    let mut biased = scenario.clone();
    let synthetic::Controller::Linear { d_0, .. } = &mut biased.followers[0].controller else { unreachable!("linear") };
    *d_0 -= 0.5;
    let known = synthetic::run(&biased).expect("drives");
    let found = with(&scenario, &["range_bias:b=0.5"]);
    assert!(rms(&found.v[1], &known.v[1]) < 1e-9);
}

#[test]
fn limits_hold() {
    let scenario = scenario(Base::Idm, Profile::Restless, 200.0);
    let (high, low) = extremes(&with(&scenario, &[]));
    assert!(high > 0.9 && low < -1.4, "the drive is lively: {low} to {high} m/s²");
    assert!(extremes(&with(&scenario, &["accel_cap:acap=0.5"])).0 <= 0.5 + 1e-12);
    assert!(extremes(&with(&scenario, &["decel_cap:bcap=1.3"])).1 >= -1.3 - 1e-12);
    let limited = with(&scenario, &["power_cap:P=8"]);
    // Speeds that count as 0.1 m/s are slower than that.
    assert!(limited.a[1].iter().zip(&limited.v[1]).all(|(a, v)| a * v.max(0.1) <= 8.0 + 1e-9));
    let jerk = with(&scenario, &["jerk_limit:J=0.6"]);
    let changes = jerk.a[1].windows(2).zip(&jerk.v[1]).filter(|(_, v)| **v > 0.5);
    assert!(changes.into_iter().all(|(a, _)| (a[1] - a[0]).abs() <= 0.06 + 0.006 + 1e-9));
    let quantised = with(&scenario, &["quantised_accel:qz=0.25"]);
    let steps = quantised.a[1].iter().zip(&quantised.v[1]).filter(|(_, v)| **v > 0.5);
    assert!(steps.into_iter().all(|(a, _)| ((a / 0.25).round() * 0.25 - a).abs() < 1e-9));
}

/// Command of the linear law to the first follower at each sample, from its true spacing and speeds.
fn commands(drive: &Synthetic) -> Vec<f64> {
    let synthetic::Controller::Linear { v_0, t_h, d_0, k_s, k_v, k_0 } = drive.truth.scenario.followers[0].controller
    else {
        unreachable!("linear")
    };
    let (v_l, v, gap) = (&drive.v[0], &drive.v[1], &drive.gap[0]);
    let command = |k: usize| (k_v * (v_l[k] - v[k]) + k_s * (gap[k] - d_0 - t_h * v[k])).min(k_0 * (v_0 - v[k]));
    (0..v.len()).map(command).collect()
}

#[test]
fn forces_follow_road_and_speed() {
    let scenario = scenario(Base::LCth, Profile::Cruise, 150.0);
    type Force = fn(&Synthetic, usize) -> f64;
    let forces: [(&str, Force); 4] = [
        ("aero_drag:cD=0.001", |drive, k| -0.001 * drive.v[1][k].powi(2)),
        ("const_decel:c0=0.1", |_, _| -0.1),
        ("grade:gg=0.8", |drive, k| -0.8 * 9.80665 * drive.sin_grade[1][k]),
        ("periodic:As=0.1,Ac=-0.05,f=0.2", |drive, k| {
            let angle = std::f64::consts::TAU * 0.2 * drive.t[k];
            0.1 * angle.sin() - 0.05 * angle.cos()
        }),
    ];
    for (name, force) in forces {
        let drive = with(&scenario, &[name]);
        let moving = || (0..drive.t.len()).filter(|k| drive.v[1][*k] > 0.1);
        assert!(moving().count() > 1000);
        let command = commands(&drive);
        for k in moving() {
            let (found, expected) = (drive.a[1][k] - command[k], force(&drive, k));
            assert!((found - expected).abs() < 1e-9, "{name}, sample {k}: {found}, expected {expected} m/s²");
        }
    }
}

#[test]
fn events_begin_and_end() {
    let scenario = scenario(Base::LCth, Profile::Cruise, 300.0);
    let plain = with(&scenario, &[]);
    let slower = with(&scenario, &["set_speed_change:vlim=9,t1=100,dur=50"]);
    let wider = with(&scenario, &["headway_mode_change:r=0.4,t0=150"]);
    for (k, t) in plain.t.iter().enumerate() {
        if *t < 100.0 {
            assert_eq!(slower.v[1][k], plain.v[1][k]);
        }
        if (115.0..150.0).contains(t) {
            assert!(slower.v[1][k] < 9.01, "{t} s");
        }
        if *t < 150.0 {
            assert_eq!(wider.v[1][k], plain.v[1][k]);
        }
    }
    let share = wider.gap[0][2900] / plain.gap[0][2900];
    assert!((1.2..1.45).contains(&share), "the gap grows with the headway: {share}");
}

#[test]
fn who_sees_what_lies_ahead() {
    let scenario = scenario(Base::LCth, Profile::Restless, 100.0);
    let error = synthetic::run(&Scenario {
        followers: vec![synthetic::CarTruth {
            effects: vec![Effect::medium(EffectKind::MultiAnticipation)],
            ..scenario.followers[0].clone()
        }],
        ..scenario.clone()
    });
    assert_eq!(error.expect_err("one car ahead"), SyntheticError::NobodyAhead { car: 2 });
    // The car ahead is seen earlier and followed more closely.
    let [early, now, late] = [&["time_offset:to=-0.5"][..], &[], &["time_offset:to=0.5"]].map(|e| with(&scenario, e));
    let apart = |drive: &Synthetic| rms(&drive.v[1], &drive.v[0]);
    assert!(apart(&early) < apart(&now) && apart(&now) < apart(&late));
}

#[test]
fn gusts_have_the_size_and_the_time_asked_for() {
    let mut windy = scenario(Base::LCth, Profile::Cruise, 2000.0);
    windy.road = synthetic::Road::Level;
    windy.followers[0].gusts = Some(Gusts { sigma_mps2: 0.05, time_constant_s: 0.5 });
    let gusty = synthetic::run(&windy).expect("drives");
    assert_eq!(gusty.x, synthetic::run(&windy).expect("drives").x, "the same seed blows the same wind");
    let command = commands(&gusty);
    let moving = (0..gusty.t.len()).filter(|k| gusty.v[1][*k] > 5.0);
    let gust: Vec<f64> = moving.map(|k| gusty.a[1][k] - command[k]).collect();
    let size = rms(&gust, &vec![0.0; gust.len()]);
    // Some two thousand independent values.
    assert!((0.0465..0.0535).contains(&size), "{size} m/s²");
    let lag = 5;
    let together: f64 = gust.windows(lag + 1).map(|w| w[0] * w[lag]).sum::<f64>() / (gust.len() - lag) as f64;
    let expected = (-1.0_f64).exp();
    assert!((together / (size * size) - expected).abs() < 0.08, "{}", together / (size * size));
}

#[test]
fn a_recorded_leader_is_met_at_its_samples() {
    let v: Vec<f64> =
        (0..400).map(|i| 12.0 + 4.0 * (f64::from(i) / 30.0).sin() - 12.0 / (1.0 + f64::from(i))).collect();
    let recorded = scenario(Base::Idm, Profile::Recorded { dt: 0.1, v: v.clone() }, 39.9);
    let drive = synthetic::run(&recorded).expect("drives");
    assert_eq!(drive.t.len(), v.len());
    assert!(drive.v[0].iter().zip(&v).all(|(found, v)| (found - v).abs() < 1e-9));
    // The displacement is the integral of the speed.
    let way: f64 = v.windows(2).map(|w| 0.05 * (w[0] + w[1])).sum();
    assert!((drive.x[0][399] - way).abs() < 0.3, "{} m, {way} m by trapezoids", drive.x[0][399]);
    let truth = serde_json::to_string(&drive.truth).expect("finite");
    assert_eq!(serde_json::from_str::<synthetic::Truth>(&truth).expect("as written"), drive.truth);
}
