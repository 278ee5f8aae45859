//! All steps on a file: reading, inspection, preparation in its variants. The fuzz targets call this, too.
#![allow(dead_code, reason = "each fuzz target calls some of it")]

use leadlag::internal::trajectory::import::{ColumnMap, Labels, read_mapped_from};
use leadlag::internal::trajectory::{Grade, Preparation, Reconcile, Recording, import, inspect, prepare};
use std::fmt::Display;

/// False if a file is refused with a message.
fn taken<T, E: Display>(read: Result<T, E>, check: impl FnOnce(T) -> bool) -> bool {
    match read {
        Ok(read) => check(read),
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// A file of measured trajectories.
pub fn run(bytes: &[u8], layout: Option<&str>) -> bool {
    let layout = layout.map(|name| name.parse().expect("a layout"));
    taken(import::read_bytes(bytes, "made_up.csv", layout), |recording| check(&recording))
}

/// A file that is read by its path.
pub fn file(path: &std::path::Path) -> bool {
    taken(import::read(path, None), |recording| check(&recording))
}

/// A table that a column map reads; the map by its text or, if it is built in, by its name.
pub fn mapped(map: &[u8], table: &[u8]) -> bool {
    let Ok(map) = std::str::from_utf8(map) else { return false };
    let map = ColumnMap::shipped().iter().find(|(name, _)| *name == map).map_or(map, |(_, text)| *text);
    let read = |map| taken(read_mapped_from(table, "made_up.csv", &map), |recording| check(&recording));
    taken(ColumnMap::parse(map, "made_up.toml"), read)
}

/// A grade profile.
pub fn grade(bytes: &[u8]) -> bool {
    taken(Grade::read_from(bytes, "made_up.csv"), |grade| {
        for x in [-1e9, -1.0, 0.0, 1e-300, 2.5, 5757.9, 1e12] {
            assert!(grade.at(x).abs() <= 0.5 + 1e-12, "{x}: {}", grade.at(x));
        }
        true
    })
}

/// A table of vehicle order and lengths.
pub fn labels(bytes: &[u8]) -> bool {
    taken(Labels::read_from(bytes, "made_up.csv"), |labels| {
        drop(labels.get("drive").map(<[_]>::to_vec));
        true
    })
}

/// No step may panic, and prepared data must be finite, of equal length and free of crashes.
fn check(recording: &Recording) -> bool {
    let _ = inspect(recording).to_string();
    let plain = Preparation::default();
    let speeds = Preparation { reconcile: Reconcile::Speeds, smooth: true, ..Preparation::default() };
    let resampled = Preparation {
        resample: Some(0.05),
        from: Some(0.5),
        max_gap_s: 0.3,
        lead_start_m: Some(10.0),
        lead_length: Some(4.0),
        ..Preparation::default()
    };
    for follower in 0..4 {
        for preparation in [&plain, &speeds, &resampled] {
            let Ok(trajectories) = prepare(recording, follower, preparation) else {
                continue;
            };
            for trajectory in trajectories {
                let n = trajectory.len();
                assert!(n >= 2);
                for signal in [&trajectory.x_l, &trajectory.v_l, &trajectory.x_f, &trajectory.v_f, &trajectory.s] {
                    assert!(signal.len() == n && signal.iter().all(|value| value.is_finite()));
                }
                assert!(trajectory.s.iter().all(|&s| s > 0.0));
                assert!(trajectory.v_f.iter().chain(&trajectory.v_l).all(|&v| v >= 0.0));
                for signal in [&trajectory.v_l2, &trajectory.s_l2].into_iter().flatten() {
                    assert!(signal.len() == n && signal.iter().all(|value| value.is_finite()));
                }
                let _ = trajectory.grade.map(|grade| grade.at(trajectory.x_f[n / 2]));
                for note in &trajectory.notes {
                    let _ = note.to_string();
                }
            }
        }
    }
    true
}
