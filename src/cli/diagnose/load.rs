//! From files to drives: checked, corrected if asked for, prepared, cut.

use super::super::Usage;
use super::super::data::{Loaded as Picked, only_follower};
use super::super::evaluator::warn;
use super::Args;
use leadlag::catalog::Variant;
use leadlag::diagnose::Drive;
use leadlag::diagnose::data::{check, correct};
use leadlag::diagnose::hold_back::hold_back;
use leadlag::diagnose::outcome::{DataEntry, FindingEntry};
use leadlag::diagnose::road::{lap, on_the_road_of};
use leadlag::trajectory::{Note, Trajectory};
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
        let picked = one(args, variant, file, "train", &mut loaded)?;
        if args.data_only {
            continue;
        }
        if args.holdout.is_empty() {
            let [beginning, end] = hold_back(&picked.trajectory);
            loaded.trained.extend(beginning.t.first().zip(beginning.t.last()).map(|(from, to)| [*from, *to]));
            loaded.train.extend(drives(&beginning, &picked)?);
            loaded.holdout.extend(drives(&end, &picked)?);
        } else {
            loaded.train.extend(drives(&picked.trajectory, &picked)?);
        }
        loaded.whole.extend(drives(&picked.trajectory, &picked)?);
    }
    for file in &args.holdout {
        let picked = one(args, variant, file, "holdout", &mut loaded)?;
        let (last, before) = loaded.data.split_last().expect("it was just read");
        let same = |entry: &&DataEntry| {
            entry.sha256 == last.sha256 && entry.follower == last.follower && entry.role == "train"
        };
        if let Some(trained) = before.iter().find(same) {
            let (held, trained) = (file.display(), &trained.path);
            return Err(Usage(format!(
                "--holdout {held}: it is trained on, as {trained}; take it out of one of the two"
            ))
            .into());
        }
        if !args.data_only {
            loaded.holdout.extend(drives(&picked.trajectory, &picked)?);
        }
    }
    if let Some((first, others)) = loaded.train.split_first_mut() {
        for drives in [others, &mut loaded.holdout, &mut loaded.whole] {
            for (moved, drive) in on_the_road_of(first, drives).into_iter().zip(drives.iter()) {
                let own =
                    |entry: &&mut DataEntry| entry.path == drive.file() && entry.follower == drive.trajectory.follower;
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

fn drives(trajectory: &Trajectory, picked: &Picked) -> anyhow::Result<Vec<Drive>> {
    let (drives, _) = Drive::of(trajectory, picked.vehicle())?;
    Ok(drives)
}

/// One file: its findings go to `loaded`, its trajectory comes back.
fn one(args: &Args, variant: Variant, file: &Path, role: &str, loaded: &mut Loaded) -> anyhow::Result<Picked> {
    let (mut recording, follower) = args.prepare.read(file, args.follower.as_deref())?;
    let follower = follower.map_or_else(|| only_follower(&recording), Ok)?;
    let wanted = args.prepare.trajectory.as_deref();
    let platoon = recording.platoons.iter().position(|p| wanted.is_none() || p.id.as_deref() == wanted).unwrap_or(0);
    let soundness = match check(&recording, platoon, follower) {
        Ok(soundness) => soundness,
        Err(no_link) => {
            // What is missing, and which followers there are instead, is what its preparation says.
            args.prepare.pick(&recording, Some(follower), &variant)?;
            return Err(no_link.into());
        }
    };
    let corrections: Vec<Option<String>> = if args.correct {
        correct(&mut recording, platoon, follower, &soundness.findings).into_iter().map(Some).collect()
    } else {
        vec![None; soundness.findings.len()]
    };
    let picked = args.prepare.pick(&recording, Some(follower), &variant)?;
    // Causes read the grade, whatever the base model does.
    picked.start_assumed().filter(|_| !args.data_only).iter().for_each(|text| warn(text));
    let path = file.display().to_string();
    let findings = soundness.findings.iter().zip(corrections);
    loaded.findings.extend(findings.map(|(finding, done)| FindingEntry::new(&path, finding, done)));
    let trajectory = &picked.trajectory;
    let mut entry = DataEntry {
        path,
        sha256: trajectory.source.sha256.clone(),
        follower,
        name: trajectory.name.clone(),
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
