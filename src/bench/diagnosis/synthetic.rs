//! The drives of a case.

use super::super::BenchError;
use super::plan::DiagnosisTask;
use crate::diagnose::Drive;
use crate::optimize::stream;
use crate::synthetic::{
    self, Base, CarTruth, Controller, Effect, EffectKind, Gusts, Profile, Scenario, Synthetic, SyntheticError,
};
use crate::trajectory::{Preparation, import, prepare};
use rand::RngExt;

/// Drives whose truth is known: two to train on, one held out.
#[derive(Debug, Clone)]
pub struct Planted {
    /// Drives to train on.
    pub train: Vec<Drive>,
    /// Drives held out.
    pub holdout: Vec<Drive>,
    /// The planted effects with their sizes.
    pub effects: Vec<Effect>,
    /// The planted base.
    pub controller: Controller,
}

/// Sensor noise \[m/s, m\].
const NOISE: synthetic::Noise = synthetic::Noise { speed_mps: 0.02, gap_m: 0.02 };
/// Time constant of the gusts \[s\].
const GUST_S: f64 = 2.0;
/// Coloured noise: correlation from sample to sample, and size \[m/s, m\].
const COLOUR: (f64, f64) = (0.9, 0.02);
/// Largest number of draws until one is drivable and has the requested change.
const DRAWS: u64 = 12;
/// Drives of a case; the last is held out.
const DRIVES: u64 = 3;

/// Generates the drives of a case.
///
/// # Errors
/// [`BenchError::Synthetic`] if no draw is drivable and has the requested change.
pub fn planted(task: &DiagnosisTask) -> Result<Planted, BenchError> {
    let mut last = None;
    for draw in 0..DRAWS {
        match drawn(task, draw) {
            Err(BenchError::Synthetic(error @ (SyntheticError::Weak { .. } | SyntheticError::Collision { .. }))) => {
                last = Some(BenchError::Synthetic(error));
            }
            other => return other,
        }
    }
    Err(last.expect("every draw failed"))
}

fn drawn(task: &DiagnosisTask, draw: u64) -> Result<Planted, BenchError> {
    let mut rng = stream(task.seed, draw, 0, 0);
    let base: Base = task.base.parse().expect("tasks name existing bases");
    let mut car = synthetic::drawn(base, rng.random(), 2);
    if task.gusts_mps2 > 0.0 {
        car.gusts = Some(Gusts { sigma_mps2: task.gusts_mps2, time_constant_s: GUST_S });
    }
    let ahead = synthetic::drawn(Base::LCth, rng.random(), 1);
    let seeds: [u64; DRIVES as usize] = std::array::from_fn(|_| rng.random());
    let profiles: [Profile; DRIVES as usize] = std::array::from_fn(|_| match rng.random_range(0..4) {
        0 => Profile::StopAndGo,
        1 => Profile::Cruise,
        _ => Profile::Restless,
    });
    let scenario = |k: usize, car: &CarTruth| Scenario {
        seed: seeds[k],
        // Every drive needs the same road, because otherwise no effect could repeat on it.
        road_seed: Some(seeds[0]),
        duration_s: task.duration_s,
        noise: NOISE,
        profile: profiles[k].clone(),
        followers: vec![ahead.clone(), car.clone()],
        ..Scenario::default()
    };
    if task.kind == "outside" {
        // The grade acts on the car but is not in the data.
        car.effects = vec![Effect::medium(EffectKind::Grade)];
    } else {
        car.effects = task
            .causes
            .iter()
            .map(|name| {
                let kind: EffectKind = name.parse().expect("tasks name existing effects");
                let effect = Effect::medium(kind);
                let set = |effect: Effect, name: &str, value: f64| effect.with(name, value).expect("within its range");
                let at = task.duration_s * rng.random_range(0.3..0.6);
                match kind {
                    EffectKind::HeadwayModeChange => set(effect, "t0", at),
                    EffectKind::SetSpeedChange => set(set(effect, "t1", at), "dur", rng.random_range(30.0..60.0)),
                    EffectKind::Periodic => set(effect, "f", rng.random_range(0.03..0.5)),
                    _ => effect,
                }
            })
            .collect();
    }
    if !car.effects.is_empty() {
        car = synthetic::at_amplitude(&scenario(0, &car), 2, task.rms_mps)?.followers.swap_remove(1);
    }
    let mut drives = Vec::new();
    for (k, seed) in seeds.iter().enumerate() {
        let mut drive = synthetic::run(&scenario(k, &car))?;
        if task.kind == "coloured" {
            colour(&mut drive, *seed);
        }
        drives.push(measured(&drive, k, task.kind == "outside")?);
    }
    let holdout = drives.split_off(DRIVES as usize - 1);
    Ok(Planted { train: drives, holdout, effects: car.effects, controller: car.controller })
}

/// Adds first-order autoregressive noise to all measured signals.
fn colour(drive: &mut Synthetic, seed: u64) {
    let signals = drive.v.iter_mut().chain(drive.gap.iter_mut());
    for (i, signal) in signals.enumerate() {
        let mut rng = stream(seed, 1, 0, i as u64);
        let (kept, size) = COLOUR;
        let new = size * (1.0 - kept * kept).sqrt();
        let mut last = 0.0;
        for y in signal {
            // Sum of twelve uniform numbers: nearly normal.
            let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            last = kept * last + new * normal;
            *y = (*y + last).max(0.0);
        }
    }
}

/// The drive as users have it: a pair file, read again.
fn measured(drive: &Synthetic, number: usize, without_grade: bool) -> Result<Drive, BenchError> {
    let mut file = Vec::new();
    synthetic::write_pair(drive, 2, &mut file).expect("a Vec takes all, and there is a follower 2");
    let recording = import::read_bytes(&file, &format!("drive{}.csv", number + 1), None)?;
    let mut trajectory = prepare(&recording, 1, &Preparation::default())?.remove(0);
    if without_grade {
        trajectory.grade = None;
    }
    let (mut drives, _) = Drive::of(&trajectory, None).expect("a synthetic gap does not jump, and lasts long enough");
    Ok(drives.remove(0))
}
