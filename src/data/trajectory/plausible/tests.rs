//! Made-up drives with one thing wrong, and none.

use super::*;

/// Two minutes behind a car that swings about 20 m/s, with the noise of usual sensors; `dt` in s.
fn drive(dt: f64) -> [Vec<f64>; 4] {
    // Numbers of a fixed sequence between -1 and 1.
    let noise = |i: usize, k: f64| ((i as f64 * 12.9898 + k).sin() * 43_758.545).fract();
    let t: Vec<f64> = (0..(120.0 / dt) as usize).map(|i| i as f64 * dt).collect();
    let v_l = t.iter().enumerate().map(|(i, t)| 20.0 + 3.0 * (0.2 * t).sin() + 0.05 * noise(i, 1.0)).collect();
    let v_f = t.iter().enumerate().map(|(i, t)| 20.0 + 3.0 * (0.2 * (t - 1.5)).sin() + 0.05 * noise(i, 2.0)).collect();
    let gap = t.iter().enumerate().map(|(i, t)| {
        let way = |t: f64| -15.0 * (0.2 * t).cos();
        30.0 + way(*t) - way(t - 1.5) + 0.1 * noise(i, 3.0)
    });
    let gap = gap.collect();
    [t, v_l, v_f, gap]
}

fn said([t, v_l, v_f, gap]: &[Vec<f64>; 4]) -> Vec<String> {
    of_signals(&Signals { t, v_l, v_f, gap, called: "spacing_m" }, false)
}

#[test]
fn nothing_is_said_of_a_sound_drive() {
    for dt in [0.04, 0.1, 0.5, 1.0] {
        assert_eq!(said(&drive(dt)), Vec::<String>::new(), "{dt}");
        // A gap of steps of 0.1 m, and one that is renewed once in a second.
        let mut coarse = drive(dt);
        coarse[3].iter_mut().for_each(|gap| *gap = (*gap * 10.0).round() / 10.0);
        assert_eq!(said(&coarse), Vec::<String>::new(), "{dt}, coarse");
    }
    let mut held = drive(0.1);
    let gap = held[3].clone();
    held[3] = (0..gap.len()).map(|i| gap[i / 10 * 10]).collect();
    assert_eq!(said(&held), Vec::<String>::new(), "renewed once in a second");
}

#[test]
fn a_jump_is_named_with_time_size_and_window() {
    for (dt, to) in [(0.1, "--to 69.9"), (1.0, "--to 69 ")] {
        let mut cut_in = drive(dt);
        let [t, .., gap] = &mut cut_in;
        t.iter().zip(gap).filter(|(t, _)| **t >= 70.0 - 1e-9).for_each(|(_, gap)| *gap -= 15.0);
        let found = said(&cut_in);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with("spacing_m: jumps down by 15."), "{found:?}");
        assert!(found[0].contains(" at 70.0 s") && found[0].contains(to), "{found:?}");
    }
    // The sensor takes a second to settle, and has nothing to tell meanwhile.
    for lost in [false, true] {
        let mut slow = drive(0.1);
        let [t, .., gap] = &mut slow;
        for (t, gap) in t.iter().zip(gap) {
            *gap -= 12.0 * (t - 40.0).clamp(0.0, 0.8) / 0.8;
            if lost && (40.0..40.8).contains(t) {
                *gap = f64::NAN;
            }
        }
        let found = said(&slow);
        assert!(found.len() == 1 && found[0].contains("down by 1"), "{lost}: {found:?}");
        assert!(found[0].contains("--from 4"), "{found:?}");
    }
}

#[test]
fn a_value_that_is_held_is_named() {
    let mut no_target = drive(0.1);
    no_target[3][300..420].fill(25.5);
    let found = said(&no_target);
    assert!(
        found.iter().any(|s| s.contains("spacing_m: stays at 25.5 m to the last digit from 30.0 to 41.9 s")),
        "{found:?}"
    );
    let mut hangs = drive(0.1);
    let at = hangs[2][500];
    hangs[2][500..580].fill(at);
    let found = said(&hangs);
    assert!(found.iter().any(|s| s.starts_with("the speed of the follower: stays at ")), "{found:?}");
}

#[test]
fn a_ratio_is_tested_by_its_error() {
    for (factor, expected) in [(1.609_344, "kilometres per mile"), (1.097_28, "km/h per ft/s"), (1.0 / 1.2, "")] {
        let mut scaled = drive(0.1);
        scaled[1].iter_mut().for_each(|v| *v /= factor);
        scaled[2].iter_mut().for_each(|v| *v /= factor);
        let found = said(&scaled);
        assert!(found.len() == 1 && found[0].contains(&format!("changes {factor:.2}")), "{factor}: {found:?}");
        assert!(found[0].contains(expected), "{found:?}");
    }
}

#[test]
fn a_speed_that_nobody_drives_is_named() {
    let mut feet = drive(0.1);
    for signal in &mut feet[1..] {
        signal.iter_mut().for_each(|y| *y /= 0.3048);
    }
    let found = said(&feet);
    assert!(found.iter().any(|s| s.starts_with("the speed of the follower is up to 7")), "{found:?}");
}

#[test]
fn accelerations_that_are_mostly_noise_are_told() {
    // Positions that err by 5 cm at 25 Hz, differentiated once.
    let noise = |i: usize| 0.05 * ((i as f64 * 12.9898).sin() * 43_758.545).fract();
    let v = |dt: f64, noise: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..2000).map(|i| 20.0 + 3.0 * (0.2 * dt * i as f64).sin() + (noise(i + 1) - noise(i)) / dt).collect()
    };
    let found = of_acceleration(&v(0.04, &noise), 0.04).expect("noise");
    assert!(found.contains("is noise to 9") || found.contains("is noise to 100 %"), "{found}");
    assert_eq!(of_acceleration(&v(0.04, &|_| 0.0), 0.04), None);
    assert_eq!(of_acceleration(&v(1.0, &|i| 0.1 * noise(i)), 1.0), None);
}

#[test]
fn a_clock_is_told_from_seconds() {
    let clock = |i: u32| {
        let s = 53_910.0 + f64::from(i) * 0.5;
        (s / 3600.0).floor() * 1e4 + (s / 60.0).floor() % 60.0 * 100.0 + s % 60.0
    };
    let t: Vec<f64> = (0..600).map(clock).collect();
    let found = of_time(&t).expect("a clock");
    assert!(found.contains("145859.5 is followed by 145900") && found.contains("5 times"), "{found}");
    let seconds: Vec<f64> = (0..6000).map(|i| f64::from(i) * 0.1).collect();
    assert_eq!(of_time(&seconds), None);
    // A pause of a minute is no clock.
    let pause: Vec<f64> = (0..600).map(|i| f64::from(i) * 0.1 + if i < 300 { 0.0 } else { 60.0 }).collect();
    assert_eq!(of_time(&pause), None);
}
