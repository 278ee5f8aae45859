//! The synthetic truth: reproducible, physically sane, converged, and independent of the rest of the crate.

use leadlag::internal::synthetic::{self, Controller, Noise, Road, Scenario, Synthetic, SyntheticError};

/// A 10 Hz trapezoid misses an integral by dt²/12 times the change of the slope, summed over the bends of the
/// speed: largest where a car comes to rest within a sample, at most 0.1² / 8 * 7 m/s² there.
const GAP_FROM_SPEEDS: f64 = 0.01;

/// Halving the default step moves speeds by less than this \[m/s\], a tenth of the sensors' noise. Not less, because
/// min() in a controller and a car coming to rest break the smoothness that the fourth order needs.
const SPEED_CONVERGED: f64 = 3e-4;

/// The same for gaps \[m\]: a car that starts up to one step late keeps the distance lost for some seconds.
const GAP_CONVERGED: f64 = 1e-3;

fn drive(scenario: &Scenario) -> Synthetic {
    synthetic::run(scenario).expect("the scenario can be driven")
}

fn without_noise(seed: u64) -> Scenario {
    Scenario { seed, noise: Noise::NONE, ..Scenario::default() }
}

fn bytes(scenario: &Scenario) -> [Vec<u8>; 3] {
    let drive = drive(scenario);
    let mut files = [Vec::new(), Vec::new(), Vec::new()];
    synthetic::write_openacc(&drive, &mut files[0]).expect("writing into memory");
    synthetic::write_pair(&drive, 4, &mut files[1]).expect("writing into memory");
    synthetic::write_slope(&drive, &mut files[2]).expect("writing into memory");
    files
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)))
}

fn largest_difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()))
}

#[test]
fn same_seed_same_bytes() {
    let scenario = Scenario::default();
    let first = bytes(&scenario);
    assert_eq!(first, bytes(&scenario));
    let other = bytes(&Scenario { seed: 2, ..scenario });
    for (a, b) in first.iter().zip(&other) {
        assert_ne!(a, b);
    }
}

#[test]
fn drives_with_a_road_seed_in_common_go_over_the_same_hills() {
    let grade = |seed: u64, road_seed: Option<u64>| {
        drive(&Scenario { seed, road_seed, duration_s: 20.0, ..Scenario::default() }).grade
    };
    assert_eq!(grade(1, Some(7)), grade(2, Some(7)));
    assert_ne!(grade(1, None), grade(2, None));
    assert_eq!(grade(7, None), grade(2, Some(7)));
}

#[test]
fn noise_leaves_the_drive_alone() {
    let noisy = drive(&Scenario::default());
    let quiet = drive(&without_noise(1));
    assert_eq!(noisy.x, quiet.x);
    let off: Vec<f64> = noisy.gap[2].iter().zip(&quiet.gap[2]).map(|(a, b)| a - b).collect();
    let sd = (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt();
    // 6001 draws: the estimate is good to about 1 %.
    assert!((sd / 0.0005 - 1.0).abs() < 0.05, "gap noise {sd} m");
}

#[test]
fn drives_like_the_measured_platoons() {
    for seed in 1..=20 {
        let drive = drive(&Scenario { seed, ..Scenario::default() });
        assert_eq!((drive.v.len(), drive.gap.len(), drive.t.len()), (5, 4, 6001));
        for (car, v) in drive.v.iter().enumerate() {
            let (low, high) = extremes(v);
            assert!((0.0..0.01).contains(&low), "seed {seed} car {}: {low} m/s", car + 1);
            assert!((20.0..36.0).contains(&high), "seed {seed} car {}: {high} m/s", car + 1);
            let (brake, thrust) = extremes(&drive.a[car]);
            assert!(brake > -5.0 && thrust < 3.5, "seed {seed} car {}: {brake} to {thrust} m/s²", car + 1);
        }
        for (link, gap) in drive.gap.iter().enumerate() {
            let (low, high) = extremes(gap);
            assert!(low > 1.0 && high < 120.0, "seed {seed} link {}: {low} to {high} m", link + 1);
        }
        let (low, high) = extremes(&drive.grade.sin);
        assert!(low >= -0.03 && high <= 0.03 && high - low > 0.03);
        // One stop or near-stop during the drive, after the first 20 s.
        let (slowest, fastest) = extremes(&drive.v[0][200..]);
        assert!(slowest < 4.0 && fastest < 28.5, "seed {seed}: {slowest} to {fastest} m/s");
    }
}

#[test]
fn set_speed_has_bounded_acceleration_and_jerk() {
    let drive = drive(&Scenario::default());
    let segments = &drive.truth.set_speed;
    for pair in segments.windows(2) {
        let age = pair[1].t - pair[0].t;
        assert!(age >= 0.0);
        assert!(pair[0].a.abs() <= 1.8 && pair[0].jerk.abs() <= 1.2);
        let end = pair[0].v + (pair[0].a + pair[0].jerk * age / 2.0) * age;
        assert!((end - pair[1].v).abs() < 1e-9, "the set speed does not jump");
    }
}

#[test]
fn speeds_and_gaps_agree() {
    let drive = drive(&without_noise(3));
    for (link, gap) in drive.gap.iter().enumerate() {
        let (ahead, own) = (&drive.v[link], &drive.v[link + 1]);
        let mut s = gap[0];
        for i in 1..gap.len() {
            let dt = drive.t[i] - drive.t[i - 1];
            s += (ahead[i] - own[i] + ahead[i - 1] - own[i - 1]) / 2.0 * dt;
            assert!(
                (s - gap[i]).abs() < GAP_FROM_SPEEDS,
                "link {} at {} s: {s} m from speeds, {} m measured",
                link + 1,
                drive.t[i],
                gap[i]
            );
        }
    }
}

#[test]
fn a_finer_step_changes_little() {
    for seed in 1..=4 {
        let coarse = drive(&without_noise(seed));
        let fine = drive(&Scenario { dt: 0.005, ..without_noise(seed) });
        let dv = largest_difference(&coarse.v, &fine.v);
        let ds = largest_difference(&coarse.gap, &fine.gap);
        println!("seed {seed}: {dv:e} m/s, {ds:e} m");
        assert!(dv < SPEED_CONVERGED, "seed {seed}: speeds differ by {dv} m/s");
        assert!(ds < GAP_CONVERGED, "seed {seed}: gaps differ by {ds} m");
    }
}

/// On a level road the answer is known, whatever delay and lag: behind a platoon leader
/// at a constant speed the linear law settles at `d_0 + t_h * v`, IDM at `(d_0 + t_h * v) / sqrt(1 - (v/v_0)^delta)`.
#[test]
fn settles_at_the_equilibrium_gap() {
    let mut scenario = Scenario { road: Road::Level, noise: Noise::NONE, ..Scenario::default() };
    scenario.followers.truncate(2);
    let drive = drive(&scenario);
    let i = (0..drive.t.len())
        .find(|&i| drive.v[0][i] > 10.0 && (0..3).all(|car| drive.a[car][i].abs() < 1e-3))
        .expect("ten minutes hold a steady stretch");
    for (link, car) in drive.truth.scenario.followers.iter().enumerate() {
        let v = drive.v[link + 1][i];
        let expected = match &car.controller {
            Controller::Linear { t_h, d_0, .. } => d_0 + t_h * v,
            Controller::Idm { v_0, t_h, d_0, delta, .. } => (d_0 + t_h * v) / (1.0 - (v / v_0).powf(*delta)).sqrt(),
            other => unreachable!("the first two followers are IDM and linear, not {other:?}"),
        };
        let found = drive.gap[link][i];
        assert!((found - expected).abs() < 0.05, "{}: {found} m, expected {expected} m", car.name);
    }
}

#[test]
fn layouts_are_as_documented() {
    let drive = drive(&Scenario { duration_s: 12.0, ..Scenario::default() });
    let mut file = Vec::new();
    synthetic::write_openacc(&drive, &mut file).expect("writing into memory");
    let text = String::from_utf8(file).expect("ASCII");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 6 + 121);
    assert!(lines[0].starts_with("Date,"));
    assert!(lines[1].starts_with("Vehicle_order,Synthetic(A),"));
    assert_eq!(lines[2..5], ["Number_of_vehicles,5", "ACC,1", "Distance_setting,min"]);
    assert_eq!(lines[5], "Time,Speed1,Speed2,Speed3,Speed4,Speed5,IVS1,IVS2,IVS3,IVS4");
    assert!(lines[6].starts_with("0.0,") && lines[9].starts_with("0.3,"));
    assert!(lines[6..].iter().all(|line| line.split(',').count() == 10));

    let mut file = Vec::new();
    synthetic::write_pair(&drive, 1, &mut file).expect("writing into memory");
    let text = String::from_utf8(file).expect("ASCII");
    assert_eq!(text.lines().next(), Some("time_s,lead_speed_mps,speed_mps,spacing_m,sin_grade,lead_position_m"));
    let refused = synthetic::write_pair(&drive, 5, Vec::new()).expect_err("there are four followers");
    assert_eq!(refused.to_string(), "follower 5: expected 1 to 4, the followers of this platoon");
}

#[test]
fn truth_survives_json() {
    let drive = drive(&Scenario { duration_s: 12.0, ..Scenario::default() });
    let json = serde_json::to_string(&drive.truth).expect("finite numbers");
    let back: synthetic::Truth = serde_json::from_str(&json).expect("as written");
    assert_eq!(back, drive.truth);
}

#[test]
fn refuses_what_cannot_be_driven() {
    let mut scenario = Scenario::default();
    scenario.followers[1].tau_p = 0.004;
    let error = synthetic::run(&scenario).expect_err("a delay within one step");
    assert_eq!(error.to_string(), "tau_p (unless it is 0) of car 3: expected 0.01 to 10 s, found 0.004");
    scenario.followers[1].tau_p = 3.0;
    assert!(matches!(synthetic::run(&scenario), Err(SyntheticError::Collision { .. })));
    let too_late = "set_speed_change:t1=700".parse().expect("an effect");
    let mut late = Scenario::default();
    late.followers[0].effects.push(too_late);
    assert_eq!(
        synthetic::run(&late).expect_err("the drive ends at 600 s").to_string(),
        "set_speed_change of car 2 begins at 700 s, and the drive ends at 600 s; start it earlier, as in \
         set_speed_change:t1=240, or drive longer"
    );
    scenario.duration_s = f64::NAN;
    assert!(matches!(synthetic::run(&scenario), Err(SyntheticError::OutOfRange { .. })));
}

#[test]
fn knows_nobody() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/models/synthetic");
    let mut files = 0;
    for entry in std::fs::read_dir(&folder).expect("the folder is there") {
        let path = entry.expect("readable").path();
        let text = std::fs::read_to_string(&path).expect("text");
        files += 1;
        for (number, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.starts_with("//") {
                continue;
            }
            let foreign = ["crate::", "super::super", "leadlag::", "leadlag_", "include!", "#[path"];
            assert!(
                !foreign.iter().any(|word| line.contains(word)),
                "{}:{}: synthetic drives share no code: {line}",
                path.display(),
                number + 1
            );
        }
    }
    assert!(files > 5);
}
