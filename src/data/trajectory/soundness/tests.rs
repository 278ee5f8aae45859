//! Synthetic drives with one fault, and without any.

use super::*;

/// Numbers of a fixed sequence between -1 and 1 (splitmix64).
fn noise(i: usize) -> f64 {
    let mut z = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Two minutes behind a car that oscillates around 20 m/s, with the noise of usual sensors; `dt` in s.
fn drive(dt: f64) -> Link {
    let (count, quiet) = ((120.0 / dt) as usize, 0.02 * (dt / 0.1).min(1.0));
    // Sizes [m/s], frequencies [rad/s] and phases of the swings of both cars.
    let swings = [
        [(3.0, 0.2, 0.0), (1.5, 0.53, 1.0), (1.0, 0.09, 2.0), (0.6, 1.1, 0.5)],
        [(2.2, 0.2, -0.3), (0.6, 0.53, 0.2), (0.9, 0.09, 1.9), (0.1, 1.1, -1.0)],
    ];
    let sum = |car: usize, one: &dyn Fn((f64, f64, f64)) -> f64| swings[car].into_iter().map(one).sum::<f64>();
    let speed = |car: usize, i: usize| {
        20.0 + sum(car, &|(a, w, phase)| a * (w * i as f64 * dt + phase).sin()) + quiet * noise(3 * i + car)
    };
    let way = |car: usize, i: usize| sum(car, &|(a, w, phase)| -a / w * (w * i as f64 * dt + phase).cos());
    let [v_l, v_f] = [0, 1].map(|car| (0..count).map(|i| speed(car, i)).collect());
    let gap = (0..count).map(|i| 30.0 + way(0, i) - way(1, i) + 0.1 * noise(3 * i + 2));
    let (gap, called) = (gap.collect(), "spacing_m".to_owned());
    Link { t_0: 0.0, dt, v_l, v_f, gap, called, x_l: None, x_f: None, len_l: None, regular: true, alone: true }
}

/// Findings that matter in a link, in words.
fn messages(link: &Link) -> Vec<String> {
    check_link(link).findings.iter().filter(|finding| finding.matters).map(Finding::message).collect()
}

#[test]
fn nothing_is_said_of_a_sound_drive() {
    for dt in [0.04, 0.1, 0.5, 1.0] {
        assert_eq!(messages(&drive(dt)), Vec::<String>::new(), "{dt}");
        // A gap of steps of 0.1 m.
        let mut coarse = drive(dt);
        coarse.gap.iter_mut().for_each(|gap| *gap = (*gap * 10.0).round() / 10.0);
        assert_eq!(messages(&coarse), Vec::<String>::new(), "{dt}, coarse");
    }
}

#[test]
fn a_value_that_is_renewed_once_in_a_second_is_named_and_mended() {
    for k in 0..3 {
        let mut held = drive(0.1);
        let signal = [&mut held.v_l, &mut held.v_f, &mut held.gap].into_iter().nth(k).expect("three");
        let before = signal.clone();
        signal.iter_mut().enumerate().for_each(|(i, y)| *y = before[i / 10 * 10]);
        let found = messages(&held);
        assert!(found.iter().any(|s| s.contains("sampled at 1.000 Hz") && s.contains("--correct")), "{k}: {found:?}");
        assert!(found.len() == 1, "{k}: nothing else is wrong, least of all a unit: {found:?}");
    }
}

#[test]
fn a_jump_is_named_with_time_size_and_window() {
    for (dt, to) in [(0.1, "--to 69.9"), (1.0, "--to 69 ")] {
        let mut cut_in = drive(dt);
        let from = (70.0 / dt).round() as usize;
        cut_in.gap[from..].iter_mut().for_each(|gap| *gap -= 15.0);
        let found = messages(&cut_in);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("spacing_m: jumps down by 15.")
                || found[0].starts_with("spacing_m: jumps down by 14."),
            "{found:?}"
        );
        assert!(found[0].contains(" at 70.0 s") && found[0].contains(to), "{found:?}");
    }
    // The sensor takes a second to settle, and sends nothing meanwhile.
    for lost in [false, true] {
        let mut slow = drive(0.1);
        for (i, gap) in slow.gap.iter_mut().enumerate() {
            let t = i as f64 * 0.1;
            *gap -= 12.0 * (t - 40.0).clamp(0.0, 0.8) / 0.8;
            if lost && (40.0..40.8).contains(&t) {
                *gap = f64::NAN;
            }
        }
        let found = messages(&slow);
        assert!(found.len() == 1 && found[0].contains("down by 1"), "{lost}: {found:?}");
        assert!(found[0].contains("--from 4"), "{found:?}");
    }
}

#[test]
fn spikes_are_no_car_that_cut_in() {
    for (dt, width) in [(0.1, 1), (0.1, 3), (0.04, 2), (0.5, 1)] {
        for (signal, off) in [("gap", 12.0), ("gap", 225.0), ("gap", -20.0), ("speed", -15.0)] {
            let mut link = drive(dt);
            let at: Vec<usize> = (1..6).map(|k| (k as f64 * 19.3 / dt) as usize).collect();
            let values = if signal == "gap" { &mut link.gap } else { &mut link.v_f };
            at.iter().for_each(|&i| values[i..i + width].iter_mut().for_each(|y| *y += off));
            let found = messages(&link);
            assert!(found.len() == 1 && found[0].contains("spikes"), "{dt} {width} {signal} {off}: {found:?}");
            assert!(found[0].contains(&format!("{} of", 5 * width)) && found[0].contains("--correct"), "{found:?}");
        }
    }
}

#[test]
fn a_value_that_is_held_is_named() {
    for no_target in [25.5, 255.0, 327.67] {
        let mut link = drive(0.1);
        link.gap[300..420].fill(no_target);
        let found = messages(&link);
        let stays = format!("from 30.0 s on, at {no_target} m to the last digit");
        assert!(found.iter().any(|s| s.starts_with("spacing_m: ") && s.contains("s from 30.")), "{found:?}");
        assert!(found.iter().any(|s| s.contains(&stays) || s.contains(&stays.replace("30.0", "30.1"))), "{found:?}");
    }
    let mut hangs = drive(0.1);
    let at = hangs.v_f[500];
    hangs.v_f[500..580].fill(at);
    let found = messages(&hangs);
    assert!(found.iter().any(|s| s.starts_with("the speed of the follower: ")), "{found:?}");
}

#[test]
fn what_a_radar_says_without_a_target_is_one_fault() {
    for (k, value) in [(0, 0.0), (0, 81.91), (1, 0.0), (2, 200.0), (2, 255.0), (2, 327.67), (2, 5.0)] {
        let mut link = drive(0.1);
        let values = [&mut link.v_l, &mut link.v_f, &mut link.gap].into_iter().nth(k).expect("three");
        (1..6).for_each(|place| values[place * 190..place * 190 + 8].fill(value));
        let found = messages(&link);
        assert!(found.len() == 1 && found[0].contains("4.0 s in 5 pieces were not measured"), "{k} {value}: {found:?}");
    }
}

#[test]
fn a_speed_that_is_held_for_a_fifth_of_a_second_is_named() {
    let mut held = drive(0.1);
    let before = held.v_f.clone();
    held.v_f.iter_mut().enumerate().for_each(|(i, v)| *v = before[i / 2 * 2]);
    let found = messages(&held);
    assert!(found.len() == 1 && found[0].contains("sampled at 5.000 Hz"), "{found:?}");
}

#[test]
fn a_late_clock_is_one_fault() {
    for k in 0..3 {
        for late in [8, 15] {
            let mut link = drive(0.1);
            let whole = link.len();
            for (place, values) in [&mut link.v_l, &mut link.v_f, &mut link.gap].into_iter().enumerate() {
                *values = if place == k { values[..whole - late].to_vec() } else { values[late..].to_vec() };
            }
            let found = messages(&link);
            assert!(found.len() == 1 && found[0].contains(" s late against"), "{k} {late}: {found:?}");
        }
    }
}

#[test]
fn other_units_of_time_are_named() {
    for (dt, size, expected) in [
        (0.1, 60.0, "unit = \"min\""),
        (1.0, 60.0, "unit = \"min\""),
        (0.1, 3600.0, "unit = \"h\""),
        (1.0, 3600.0, "unit = \"h\""),
        (0.1, 86_400.0, "unit = \"day\""),
        (1.0, 86_400.0, "unit = \"day\""),
        (0.04, 0.04, "frame_rate = 25"),
        (0.1, 0.1, "frame_rate = 10"),
    ] {
        let seconds = drive(dt);
        let found = time::of_unit(&Link { dt: dt / size, ..seconds }).expect(expected);
        assert!(found.message().contains(expected), "{dt} {size}: {}", found.message());
    }
    for dt in [0.01, 0.04, 0.1, 0.5, 1.0] {
        assert_eq!(time::of_unit(&drive(dt)), None, "{dt}");
    }
}

#[test]
fn units_and_exchanged_speeds_are_named() {
    for (factor, expected) in [(1.609_344, "kilometres per mile"), (1.097_28, "km/h per ft/s"), (3.6, "km/h")] {
        let mut scaled = drive(0.1);
        for v in [&mut scaled.v_l, &mut scaled.v_f] {
            v.iter_mut().for_each(|v| *v *= factor);
        }
        let found = messages(&scaled);
        assert!(found.iter().any(|said| said.contains(expected)), "{factor}: {found:?}");
    }
    let mut exchanged = drive(0.1);
    std::mem::swap(&mut exchanged.v_l, &mut exchanged.v_f);
    let found = messages(&exchanged);
    assert!(found.len() == 1 && found[0].contains("swapped") && found[0].contains("--correct"), "{found:?}");
    let mut feet = drive(0.1);
    for signal in [&mut feet.v_l, &mut feet.v_f, &mut feet.gap] {
        signal.iter_mut().for_each(|y| *y /= 0.3048);
    }
    let found = messages(&feet);
    assert!(found.iter().any(|s| s.starts_with("the speed of the follower is up to 7")), "{found:?}");
}

#[test]
fn coarse_steps_of_a_speed_are_named() {
    let mut coarse = drive(0.1);
    coarse.v_f.iter_mut().for_each(|v| *v = ((*v * 3.6).round() / 3.6 * 1e3).round() / 1e3);
    let found = check_link(&coarse).findings;
    let found = found.iter().find(|finding| finding.kind == FindingKind::Quantised).expect("km/h without decimals");
    assert!(found.matters && (found.value - 1.0 / 3.6).abs() < 0.002, "{found:?}");
}

#[test]
fn accelerations_that_are_mostly_noise_are_reported() {
    // Positions that err by 5 cm at 25 Hz, differentiated once.
    let noise = |i: usize| 0.05 * noise(i);
    let link = |dt: f64, noise: &dyn Fn(usize) -> f64| Link {
        v_f: (0..2000).map(|i| 20.0 + 3.0 * (0.2 * dt * i as f64).sin() + (noise(i + 1) - noise(i)) / dt).collect(),
        ..drive(dt)
    };
    let found = noise::drowned(&link(0.04, &noise)).expect("noise").message();
    assert!(found.contains("is noise to 9") || found.contains("is noise to 100 %"), "{found}");
    assert_eq!(noise::drowned(&link(0.04, &|_| 0.0)), None);
    assert_eq!(noise::drowned(&link(1.0, &|i| 0.1 * noise(i))), None);
}

#[test]
fn a_clock_is_distinguished_from_seconds() {
    let clock = |i: u32| {
        let s = 53_910.0 + f64::from(i) * 0.5;
        (s / 3600.0).floor() * 1e4 + (s / 60.0).floor() % 60.0 * 100.0 + s % 60.0
    };
    let t: Vec<f64> = (0..600).map(clock).collect();
    let found = time::of_clock(&t).expect("a clock").message();
    assert!(found.contains("145859.5 is followed by 145900") && found.contains("5 full minutes"), "{found}");
    let seconds: Vec<f64> = (0..6000).map(|i| f64::from(i) * 0.1).collect();
    assert_eq!(time::of_clock(&seconds), None);
    // A pause of a minute does not mean a time of day.
    let pause: Vec<f64> = (0..600).map(|i| f64::from(i) * 0.1 + if i < 300 { 0.0 } else { 60.0 }).collect();
    assert_eq!(time::of_clock(&pause), None);
}

#[test]
fn what_never_changes_comes_to_an_end() {
    for dt in [0.1, 5.0] {
        let n = 2000;
        let link = Link { dt, v_l: vec![10.0; n], v_f: vec![10.0; n], gap: vec![20.0; n], ..drive(0.1) };
        let found = check_link(&link).findings;
        assert!(found.iter().all(|finding| finding.kind != FindingKind::SpeedScale), "{found:?}");
    }
}

/// Digits of a file repeat where a motion turns, regularly if it is a sine.
#[test]
fn a_smooth_motion_is_not_held() {
    let mut smooth = drive(0.1);
    let phase = |i: usize, car: usize| i as f64 / 30.0 - car as f64 / 3.0;
    let speed = |car: usize| (0..30_000).map(move |i| ((20.0 + phase(i, car).sin()) * 1e3).round() / 1e3).collect();
    (smooth.v_l, smooth.v_f) = (speed(0), speed(1));
    smooth.gap = (0..30_000).map(|i| 30.0 + 3.0 * (phase(i, 1).cos() - phase(i, 0).cos())).collect();
    let kinds: Vec<FindingKind> = check_link(&smooth).findings.iter().map(|finding| finding.kind).collect();
    assert!(!kinds.contains(&FindingKind::Resampled), "{kinds:?}");
}
