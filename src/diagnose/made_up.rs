//! Drives for tests that fit nothing.

use super::drive::Drive;
use crate::trajectory::{Preparation, import, prepare};
use std::fmt::Write;

/// Two minutes of a follower that always keeps 3 m + 1.5 s v, in a file of this name whose clock begins there \[s\].
pub fn drive(name: &str, begin: f64) -> Drive {
    let mut file = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for i in 0..1200 {
        let t = 0.1 * f64::from(i);
        let (v, rate) = (15.0 + 8.0 * (0.1 * t).sin(), 0.8 * (0.1 * t).cos());
        writeln!(file, "{:.1},{},{v},{}", begin + t, v + 1.5 * rate, 3.0 + 1.5 * v).expect("memory");
    }
    let recording = import::read_bytes(file.as_bytes(), name, None).expect("a pair file");
    let trajectory = prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0);
    Drive::of(&trajectory, None).expect("no jump").0.remove(0)
}
