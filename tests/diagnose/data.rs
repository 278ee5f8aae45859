//! The check of the data: silent on clean drives, and planted faults are found, named and sized.

use crate::common;
use leadlag::internal::diagnose::data::{Finding, FindingKind, Link, Who, check, correct};
use leadlag::internal::synthetic::{self, Noise, Profile, Scenario};
use leadlag::internal::trajectory::{Recording, import, prepare};

const SENSOR: Noise = Noise { speed_mps: 0.02, gap_m: 0.02 };

/// A synthetic platoon, imported as any file.
fn drive(seed: u64, noise: Noise, profile: Profile) -> Recording {
    let scenario = Scenario { seed, noise, profile, ..Scenario::default() };
    let synthetic = synthetic::run(&scenario).expect("the default platoon drives");
    let mut file = Vec::new();
    synthetic::write_openacc(&synthetic, &mut file).expect("memory takes all");
    import::read_bytes(&file, "synthetic.csv", None).expect("what we wrote can be read")
}

/// The clean drives into which faults are planted.
fn clean() -> Vec<Recording> {
    vec![drive(101, SENSOR, Profile::Cruise), drive(102, Noise::default(), Profile::Cruise)]
}

fn findings(recording: &Recording, follower: usize) -> Vec<Finding> {
    check(recording, 0, follower).expect("the follower is there").findings
}

/// The finding of a kind; a failure shows all findings.
fn the(found: &[Finding], kind: FindingKind) -> &Finding {
    let Some(finding) = found.iter().find(|f| f.kind == kind) else {
        let all: Vec<&str> = found.iter().map(|f| f.sentence.as_str()).collect();
        panic!("{} was not found, but: {all:#?}", kind.into_str())
    };
    finding
}

/// Within 10 % of the planted size, or 3 standard errors.
fn sized(finding: &Finding, planted: f64) {
    let error = finding.interval.map_or(0.0, |[low, high]| (high - low) / 3.92);
    let off = (finding.value - planted).abs();
    assert!(off <= (0.1 * planted.abs()).max(3.0 * error), "planted {planted}, found {finding:?}");
}

/// The value of a signal at `t - late`, by straight lines.
fn delayed(t: &[f64], y: &[f64], late: f64) -> Vec<f64> {
    t.iter()
        .map(|t_i| {
            let at = (t_i - late - t[0]) / (t[1] - t[0]);
            let i = (at.floor().max(0.0) as usize).min(y.len() - 2);
            y[i] + (y[i + 1] - y[i]) * (at - i as f64).clamp(0.0, 1.0)
        })
        .collect()
}

/// Every n-th sample kept; in between held, or joined by straight lines.
fn thinned(y: &[f64], n: usize, lines: bool) -> Vec<f64> {
    (0..y.len())
        .map(|i| {
            let (a, share) = (i / n * n, (i % n) as f64 / n as f64);
            let b = (a + n).min(y.len() - 1);
            let exact = if lines { y[a] + (y[b] - y[a]) * share } else { y[a] };
            (exact * 1e6).round() / 1e6
        })
        .collect()
}

fn averaged(y: &[f64], half: usize) -> Vec<f64> {
    let mean = |i: usize| {
        let near = &y[i.saturating_sub(half)..(i + half + 1).min(y.len())];
        near.iter().sum::<f64>() / near.len() as f64
    };
    (0..y.len()).map(mean).collect()
}

#[test]
fn clean_drives_are_clean() {
    let (mut found, mut links) = (Vec::new(), 0);
    for seed in 1..=6 {
        for noise in [SENSOR, Noise::default()] {
            for profile in [Profile::Cruise, Profile::StopAndGo, Profile::Restless] {
                let recording = drive(seed, noise, profile.clone());
                for follower in 1..=4 {
                    links += 1;
                    for finding in findings(&recording, follower) {
                        found.push(format!("{seed} {profile:?} {noise:?} {follower}: {}", finding.sentence));
                    }
                }
            }
        }
    }
    assert!(found.is_empty(), "{} findings in {links} clean links:\n{}", found.len(), found.join("\n"));
}

#[test]
fn a_speed_scale_is_found_and_the_car_named() {
    for mut recording in clean() {
        let before = recording.clone();
        for (planted, car) in [(0.02, Who::Leader), (-0.01, Who::Follower)] {
            recording.platoons[0].cars = before.platoons[0].cars.clone();
            let number = if car == Who::Leader { 1 } else { 2 };
            recording.platoons[0].cars[number - 1].v.iter_mut().for_each(|v| *v *= 1.0 + planted);
            let found = findings(&recording, 1);
            let finding = the(&found, FindingKind::SpeedScale);
            assert_eq!((finding.car, found.len()), (car, 1), "{found:?}");
            sized(finding, planted);
        }
        // Too small to show in the changes of the gap, but plain in the drift.
        recording.platoons[0].cars = before.platoons[0].cars.clone();
        recording.platoons[0].cars[0].v.iter_mut().for_each(|v| *v *= 1.0005);
        let found = findings(&recording, 1);
        sized(the(&found, FindingKind::SpeedScale), 0.0005);
    }
}

/// One pair in each of fifty drives, with a small or large scale on the leader, the follower or both.
#[test]
fn the_interval_of_a_scale_holds_the_planted_one() {
    const DRIVES: usize = 50;
    const SCALES: [f64; 7] = [-0.4, -0.2, -0.05, 0.05, 0.1, 0.2, 0.5];
    let drives: Vec<Recording> = (0..DRIVES).map(|k| drive(200 + k as u64, SENSOR, Profile::Cruise)).collect();
    for (who, cars) in [(Who::Leader, &[0][..]), (Who::Follower, &[1]), (Who::Both, &[0, 1])] {
        let (mut covered, mut named, mut off) = (0, 0, 0.0);
        for (k, drive) in drives.iter().enumerate() {
            let (mut recording, follower, scale) = (drive.clone(), k % 4 + 1, SCALES[k % SCALES.len()]);
            for car in cars {
                recording.platoons[0].cars[follower - 1 + car].v.iter_mut().for_each(|v| *v *= 1.0 + scale);
            }
            let found = findings(&recording, follower);
            let Some(finding) = found.iter().find(|f| f.kind == FindingKind::SpeedScale) else { continue };
            // If the faulty car is unknown, the value is the reading of the car ahead relative to the other one.
            let planted = match (finding.car, who) {
                (Who::Either, Who::Follower) => (1.0 + scale).recip() - 1.0,
                _ => scale,
            };
            let [low, high] = finding.interval.expect("scales have intervals");
            covered += usize::from((low..=high).contains(&planted));
            named += usize::from(finding.car == who);
            off += (finding.value - planted) / (1.0 + planted) / DRIVES as f64;
        }
        let said = format!("{who:?}: {covered} covered and {named} named of {DRIVES}, {off:+.5} off on average");
        println!("{said}");
        assert!(covered >= DRIVES * 9 / 10 && named >= DRIVES * 9 / 10, "{said}");
        assert!(off.abs() < 0.003, "{said}");
    }
}

#[test]
fn a_late_clock_is_found_and_the_signal_named() {
    for mut recording in clean() {
        let before = recording.platoons[0].cars.clone();
        for late in [0.12, 0.7] {
            for (car, signal) in [(Who::Leader, "speed"), (Who::Follower, "speed"), (Who::Follower, "gap")] {
                let platoon = &mut recording.platoons[0];
                platoon.cars = before.clone();
                let t = platoon.t.clone();
                match (car, signal) {
                    (Who::Leader, _) => platoon.cars[0].v = delayed(&t, &before[0].v, late),
                    (_, "speed") => platoon.cars[1].v = delayed(&t, &before[1].v, late),
                    _ => platoon.cars[1].gap = before[1].gap.as_ref().map(|gap| delayed(&t, gap, late)),
                }
                let found = findings(&recording, 1);
                let finding = the(&found, FindingKind::ClockOffset);
                assert_eq!((finding.car, finding.signal), (car, signal), "late by {late} s: {found:?}");
                sized(finding, late);
            }
        }
    }
}

#[test]
fn an_offset_of_the_gap_needs_positions() {
    let scenario = Scenario { seed: 103, noise: SENSOR, ..Scenario::default() };
    let synthetic = synthetic::run(&scenario).expect("the default platoon drives");
    let mut recording = drive(103, SENSOR, Profile::Cruise);
    assert!(check(&recording, 0, 1).expect("there").unseen.iter().any(|line| line.contains("positions of both cars")));
    for (car, x) in recording.platoons[0].cars.iter_mut().zip(&synthetic.x) {
        car.x = Some(x.clone());
    }
    recording.platoons[0].cars[0].length = Some(scenario.lead.length);
    assert!(findings(&recording, 1).is_empty());
    let gap = recording.platoons[0].cars[1].gap.clone().expect("a gap");
    for planted in [0.3, -1.5] {
        recording.platoons[0].cars[1].gap = Some(gap.iter().map(|gap| gap + planted).collect());
        sized(the(&findings(&recording, 1), FindingKind::GapOffset), planted);
    }
}

#[test]
fn drop_outs_are_found() {
    for mut recording in clean() {
        let before = recording.platoons[0].cars.clone();
        // Seconds in which the follower of these drives is under way.
        let start = (1000..before[1].v.len()).find(|&i| (i..i + 400).all(|k| before[1].v[k] > 3.0)).expect("it drives");
        for samples in [12_usize, 60] {
            for kind in ["held", "line", "missing", "zero"] {
                let v = &mut recording.platoons[0].cars[1].v;
                v.clone_from(&before[1].v);
                let (a, b) = (v[start - 1], v[start + samples]);
                for (k, value) in v[start..start + samples].iter_mut().enumerate() {
                    let share = (k + 1) as f64 / (samples + 1) as f64;
                    *value = match kind {
                        "held" => a,
                        "line" => ((a + (b - a) * share) * 1e6).round() / 1e6,
                        "missing" => f64::NAN,
                        _ => 0.0,
                    };
                }
                let found = findings(&recording, 1);
                let finding = the(&found, FindingKind::Dropout);
                assert_eq!(
                    (finding.car, finding.signal, found.len()),
                    (Who::Follower, "speed", 1),
                    "{kind}: {found:?}"
                );
                let planted = samples as f64 * 0.1;
                assert!((finding.value - planted).abs() <= (0.1 * planted).max(0.101), "{kind} {planted}: {finding:?}");
                assert!((finding.when[0][0] - start as f64 * 0.1).abs() < 0.15, "{kind}: {finding:?}");
            }
        }
    }
}

#[test]
fn a_lower_rate_is_found() {
    for mut recording in clean() {
        let v = recording.platoons[0].cars[0].v.clone();
        for (n, lines) in [(2, false), (2, true), (5, false), (5, true)] {
            recording.platoons[0].cars[0].v = thinned(&v, n, lines);
            let found = findings(&recording, 1);
            let finding = the(&found, FindingKind::Resampled);
            assert_eq!(finding.car, Who::Leader);
            sized(finding, 10.0 / n as f64);
            let others: Vec<_> = found.iter().filter(|f| f.kind != FindingKind::Resampled).collect();
            // A held value is late by half of its hold time; any other reported delay must be that one.
            assert!(others.iter().all(|f| !lines && f.kind == FindingKind::ClockOffset), "{n} {lines}: {others:?}");
        }
    }
}

#[test]
fn smoothing_is_found() {
    for mut recording in clean() {
        let v = recording.platoons[0].cars[1].v.clone();
        for half in [2, 10] {
            recording.platoons[0].cars[1].v = averaged(&v, half);
            let found = findings(&recording, 1);
            assert_eq!(the(&found, FindingKind::Smoothed).car, Who::Follower);
            assert_eq!(found.len(), 1, "{found:?}");
        }
    }
}

#[test]
fn jumps_of_the_gap_are_found() {
    for mut recording in clean() {
        let gap = recording.platoons[0].cars[1].gap.clone().expect("a gap");
        for planted in [2.5, -8.0] {
            let jumped = gap.iter().enumerate().map(|(i, gap)| gap + if i >= 3000 { planted } else { 0.0 });
            recording.platoons[0].cars[1].gap = Some(jumped.collect());
            let found = findings(&recording, 1);
            let finding = the(&found, FindingKind::Inconsistent);
            assert_eq!(found.len(), 1, "{found:?}");
            sized(finding, planted);
            assert!((finding.when[0][1] - 300.0).abs() < 0.05, "{finding:?}");
        }
    }
}

#[test]
fn corrections_are_made_on_request_and_then_nothing_is_left() {
    let mut recording = drive(104, Noise::default(), Profile::Cruise);
    let before = recording.clone();
    let t = recording.platoons[0].t.clone();
    let cars = &mut recording.platoons[0].cars;
    cars[0].v.iter_mut().for_each(|v| *v *= 1.02);
    cars[1].v = delayed(&t, &cars[1].v, 0.4);
    let mut found = findings(&recording, 1);
    assert_eq!(found.len(), 2, "{found:?}");
    let link = Link::of(&recording, &recording.platoons[0], 1, [None; 2]).expect("a link");
    correct(&mut recording.platoons[0], 1, &link, &mut found);
    assert!(found.iter().all(|finding| finding.correction.is_some()), "{found:?}");
    let left = findings(&recording, 1);
    assert!(left.iter().all(|f| f.kind == FindingKind::Smoothed), "{left:?}");
    let rms = |a: &[f64], b: &[f64]| {
        let squares: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).filter(|d| d.is_finite()).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    for car in [0, 1] {
        let off = rms(&recording.platoons[0].cars[car].v, &before.platoons[0].cars[car].v);
        assert!(off < 0.01, "car {car}: {off} m/s from the truth");
    }
    prepare(&recording, 1, &Default::default()).expect("corrected data can be prepared");
}

#[test]
fn the_real_files_say_what_is_known_of_them() {
    let Some(shared) = common::shared("the_real_files_say_what_is_known_of_them") else { return };
    let read = |file: &str| import::read(&shared.join("data").join(file), None).expect("a shared file");
    // Data README, Section 3.2: smoothed twice over 51 points, and consistent to rounding.
    let processed = findings(&read("astazero_c2art/ASta_040719_platoon8.csv"), 1);
    assert!(processed.len() == 3 && processed.iter().all(|f| f.kind == FindingKind::Smoothed), "{processed:?}");
    // The Tesla's Doppler speed is slightly low in every platoon, whichever car is beside it.
    for (file, follower) in [("platoon7", 1), ("platoon8", 1), ("platoon9", 1)] {
        let found = findings(&read(&format!("astazero_rebuilt/ASta_040719_{file}.csv")), follower);
        let scale = the(&found, FindingKind::SpeedScale);
        assert!((2e-4..6e-4).contains(&scale.value), "{file}: {scale:?}");
    }
    // Section 6: the Doppler speed of car 1 is late by about 0.7 s.
    let late = findings(&read("raw_openacc/Vicolungo/JRC-VC_260219_part3.csv"), 1);
    let late = the(&late, FindingKind::ClockOffset);
    assert!(late.car == Who::Leader && (0.4..0.8).contains(&late.value), "{late:?}");
}
