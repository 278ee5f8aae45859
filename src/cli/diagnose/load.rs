//! From files to drives: checked, corrected if asked for, prepared, cut.

use super::super::Usage;
use super::super::data::{Loaded as Picked, only_follower};
use super::super::evaluator::warn;
use super::Args;
use crate::catalog::Variant;
use crate::diagnose::Drive;
use crate::diagnose::data::{check, correct};
use crate::diagnose::hold_back::{drives_apart, hold_back};
use crate::diagnose::outcome::{DataEntry, FindingEntry};
use crate::diagnose::road::{lap, on_the_road_of};
use crate::trajectory::{Note, Recording, Trajectory};
use std::path::Path;

/// What is diagnosed.
pub struct Loaded {
    pub train: Vec<Drive>,
    /// The same drives whole: `train`, unless their ends are held back.
    pub whole: Vec<Drive>,
    pub holdout: Vec<Drive>,
    pub data: Vec<DataEntry>,
    pub findings: Vec<FindingEntry>,
    pub held_back: String,
    /// Window of every file to train on whose end is held back \[s\]; empty if files of their own are.
    pub trained: Vec<[f64; 2]>,
    /// Length of a lap \[m\], where the track is closed or its grade repeats.
    pub lap: Option<f64>,
}

pub fn load(args: &Args, variant: Variant) -> anyhow::Result<Loaded> {
    let mut loaded = Loaded {
        train: Vec::new(),
        whole: Vec::new(),
        holdout: Vec::new(),
        data: Vec::new(),
        findings: Vec::new(),
        held_back: "Held back: the files marked so. No model is calibrated on them; they decide whether a cause carries over, and the gain \
                    is measured on them.".to_owned(),
        trained: Vec::new(),
        lap: None,
    };
    for file in args.trained_on() {
        for picked in all(args, variant, file, "train", &mut loaded)? {
            if args.data_only {
                continue;
            }
            // First, for what is too short as a whole needs no word of its parts.
            let whole = drives(&picked)?;
            if args.holdout.is_empty() {
                let [beginning, _] = hold_back(&picked.trajectory);
                let [train, holdout] = drives_apart(&picked.trajectory, picked.vehicle())?;
                loaded.trained.extend(beginning.t.first().zip(beginning.t.last()).map(|(from, to)| [*from, *to]));
                loaded.train.extend(train);
                loaded.holdout.extend(holdout);
            } else {
                loaded.train.extend(whole.iter().cloned());
            }
            loaded.whole.extend(whole);
        }
    }
    for file in &args.holdout {
        let read = loaded.data.len();
        let picked = all(args, variant, file, "holdout", &mut loaded)?;
        let (trained, held) = loaded.data.split_at(read);
        let both = |held: &&DataEntry| {
            let same = |entry: &DataEntry| {
                entry.sha256 == held.sha256 && entry.follower == held.follower && entry.trajectory == held.trajectory
            };
            trained.iter().find(|entry| entry.role == "train" && same(entry))
        };
        if let Some(trained) = held.iter().find_map(|held| both(&held)) {
            let (held, trained) = (file.display(), &trained.path);
            return Err(Usage(format!(
                "--holdout {held}: it is trained on, as {trained}; take it out of one of the two"
            ))
            .into());
        }
        for picked in picked.iter().filter(|_| !args.data_only) {
            loaded.holdout.extend(drives(picked)?);
        }
    }
    if let Some((first, others)) = loaded.train.split_first_mut() {
        for drives in [others, &mut loaded.holdout, &mut loaded.whole] {
            for (moved, drive) in on_the_road_of(first, drives).into_iter().zip(drives.iter()) {
                let Trajectory { follower, id, .. } = &drive.trajectory;
                let own = |entry: &&mut DataEntry| {
                    entry.path == drive.file() && entry.follower == *follower && entry.trajectory == *id
                };
                loaded.data.iter_mut().filter(own).for_each(|entry| entry.moved_m = entry.moved_m.or(moved));
            }
        }
        loaded.lap = lap(&loaded.train);
    }
    if args.holdout.is_empty() {
        loaded.held_back =
            "No file was held back by --holdout, so the last third of every file is. No model is calibrated on it; it decides \
             whether a cause carries over, and the gain is measured on it."
                .to_owned();
    }
    Ok(loaded)
}

fn drives(picked: &Picked) -> anyhow::Result<Vec<Drive>> {
    let (drives, _) = Drive::of(&picked.trajectory, picked.vehicle())?;
    Ok(drives)
}

/// One file: the findings of every trajectory that is asked for go to `loaded`, the trajectories come back.
fn all(args: &Args, variant: Variant, file: &Path, role: &str, loaded: &mut Loaded) -> anyhow::Result<Vec<Picked>> {
    let (mut recording, follower) = args.prepare.read(file, args.follower.as_deref())?;
    let follower = follower.map_or_else(|| only_follower(&recording), Ok)?;
    let ids = args.prepare.ids(&recording);
    let ids = if ids.is_empty() { vec![None] } else { ids.iter().map(|id| Some(id.as_str())).collect() };
    let mut picked = Vec::new();
    for id in ids {
        picked.push(one(args, variant, &mut recording, (follower, id), role, loaded)?);
    }
    Ok(picked)
}

fn one(
    args: &Args,
    variant: Variant,
    recording: &mut Recording,
    (follower, id): (usize, Option<&str>),
    role: &str,
    loaded: &mut Loaded,
) -> anyhow::Result<Picked> {
    let pick = |recording: &Recording| args.prepare.pick_one(recording, Some(follower), &variant, id);
    let platoon = recording.platoons.iter().position(|p| id.is_none() || p.id.as_deref() == id).unwrap_or(0);
    let soundness = match check(recording, platoon, follower) {
        Ok(soundness) => soundness,
        Err(no_link) => {
            // What is missing, and which followers there are instead, is what its preparation says.
            pick(recording)?;
            return Err(no_link.into());
        }
    };
    let corrections: Vec<Option<String>> = if args.correct {
        correct(recording, platoon, follower, &soundness.findings).into_iter().map(Some).collect()
    } else {
        vec![None; soundness.findings.len()]
    };
    let picked = pick(recording)?;
    // Causes read the grade, whatever the base model does.
    picked.start_assumed().filter(|_| !args.data_only).iter().for_each(|text| warn(text));
    let path = recording.source.path.clone();
    let findings = soundness.findings.iter().zip(corrections);
    loaded.findings.extend(findings.map(|(finding, done)| FindingEntry::new(&path, finding, done)));
    let trajectory = &picked.trajectory;
    let mut entry = DataEntry {
        path,
        sha256: trajectory.source.sha256.clone(),
        follower,
        name: trajectory.name.clone(),
        trajectory: trajectory.id.clone(),
        role: role.to_owned(),
        window_s: [trajectory.t[0], trajectory.t[trajectory.len() - 1]],
        samples: trajectory.len(),
        gap_rate_rms_mps: None,
        unseen: Vec::new(),
        units: trajectory.notes.iter().find(|n| matches!(n, Note::UnitsContradict { .. })).map(ToString::to_string),
        moved_m: None,
    };
    entry.take(&soundness);
    loaded.data.push(entry);
    Ok(picked)
}
