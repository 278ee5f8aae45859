//! `leadlag calibrate`: from measured files to calibrated parameters.

mod flags;
mod fleet;
pub mod progress;
pub mod write;

pub use flags::Args;

use super::evaluator::warn;
use super::{folder, interrupt, is_usage, output};
use crate::api::calibration::{Calibration, Whole};
use crate::api::error::Usage;
use crate::api::fleet::{HeldBack, files};
use crate::api::loading::{Input, Loaded};
use crate::api::model::transcribed;
use crate::api::reading::Reading;
use crate::api::warnings;
use crate::catalog::Variant;
use crate::evaluator::Evaluator;
use crate::fleet::kept_and_held;
use crate::reference::{Reference, Trace};
use crate::report::text;
use crate::rescore;
use crate::result::ResultFile;
use crate::trajectory::Trajectory;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub fn run(args: &Args) -> anyhow::Result<()> {
    let models = args.extended()?;
    let by_flags = ["--evaluator reference", "--evaluator lanes --precision f64"];
    models.iter().try_for_each(|model| transcribed(args.evaluator.selection()?.kind, model, by_flags))?;
    if args.all {
        return fleet::run(args, &models);
    }
    let model = models[0];
    args.gof()?;
    let (mut loaded, mut unusable) = (Vec::new(), Vec::new());
    // A folder stands for its tables, if they are one calibration.
    let inputs = if args.joint { files(&args.files)? } else { args.files.clone() };
    for file in &inputs {
        match load(args, file, &model) {
            Ok(trajectories) => loaded.extend(trajectories),
            // If files are calibrated one by one, an unusable one does not stop the others.
            Err(error) if inputs.len() > 1 && !args.joint => unusable.push(error),
            Err(error) => return Err(error),
        }
    }
    let named =
        |unusable: &[anyhow::Error]| unusable.iter().map(|error| format!("{error:#}")).collect::<Vec<_>>().join("\n");
    let usage = unusable.iter().position(is_usage);
    if let Some(first) = usage.or((unusable.len() == 1).then_some(0)).filter(|_| loaded.is_empty()) {
        return Err(unusable.swap_remove(first));
    }
    anyhow::ensure!(!loaded.is_empty(), "{}", named(&unusable));
    let held = held_back(args, &inputs, &mut loaded, &model)?;
    // Before the work, so that a refused folder does not cost a calibration.
    let together = args.joint || (loaded.len() == 1 && unusable.is_empty());
    let folders = if together { vec![args.out.clone()] } else { folders(&args.out, &loaded) };
    if !together {
        folder::refuse(&args.out, folder::RESULT, "each")?;
    }
    let is_own = |name: &str| {
        let numbered =
            [("simulation", "csv"), ("plot", "svg")].iter().any(|(stem, ending)| folder::is_of(name, stem, ending));
        numbered || [folder::RESULT, folder::RUN, "timing.json"].contains(&name)
    };
    folders.iter().try_for_each(|folder| {
        folder::refuse(folder, folder::DIAGNOSIS, "calibrated")?;
        folder::refuse(folder, folder::FLEET, "calibrated")?;
        folder::spare(folder, &args.files, is_own)?;
        anyhow::Ok(())
    })?;
    let calibration = args.calibration(model)?;
    let trajectories: Vec<&Trajectory> = loaded.iter().map(|one| &one.trajectory).collect();
    warnings::of(&args.data, &model, args.convention, &calibration.overrides()?, &trajectories)
        .iter()
        .for_each(|text| warn(text));
    interrupt::watch();
    if together {
        let result = one(args, &calibration, &loaded, &held, &args.out)?;
        return if args.json { output::print(&result.to_json()) } else { Ok(()) };
    }
    let mut results = Vec::new();
    for (trajectory, folder) in loaded.iter().zip(&folders) {
        results.push(one(args, &calibration, std::slice::from_ref(trajectory), &[], folder)?);
        if interrupt::asked() {
            break;
        }
    }
    if args.json {
        output::print_json(&results)?;
    }
    let left: Vec<&str> = loaded[results.len()..].iter().map(|one| one.trajectory.source.path.as_str()).collect();
    anyhow::ensure!(
        left.is_empty(),
        "interrupted; not calibrated: {}; repeat the command with these files and another --out",
        left.join(", ")
    );
    anyhow::ensure!(
        unusable.is_empty(),
        "{}\nnot calibrated: {} of {} files",
        named(&unusable),
        unusable.len(),
        args.files.len()
    );
    Ok(())
}

/// The trajectories of one file: the chosen one, or each requested one, or with --joint every one.
fn load(args: &Args, file: &Path, model: &Variant) -> anyhow::Result<Vec<Loaded>> {
    let reading = Reading { measure: Some(args.gof()?), ..args.data.clone() };
    let follower = args.follower.as_deref();
    if args.joint {
        return reading.joint(Input::File(file), follower, model, &mut |text| warn(&text));
    }
    let (recording, follower) = reading.read(Input::File(file), follower)?;
    reading.pick_all(&recording, follower, model, false, &mut |text| warn(&text))
}

/// The drives that are held back: the ends of the loaded ones, which are cut off, or those of other files.
fn held_back(args: &Args, inputs: &[PathBuf], loaded: &mut [Loaded], model: &Variant) -> anyhow::Result<Vec<Loaded>> {
    let mut held = Vec::new();
    match HeldBack::of(&args.holdout, inputs)? {
        None => {}
        Some(HeldBack::Share(share)) => {
            for one in loaded {
                let [kept, end] = kept_and_held(&one.trajectory, share).map_err(Usage)?;
                one.trajectory = kept;
                one.twin = one.twin.take().and_then(|twin| kept_and_held(&twin, share).ok()).map(|[kept, _]| kept);
                held.push(Loaded { trajectory: end, vehicle: one.vehicle.clone(), twin: None });
            }
        }
        Some(HeldBack::Files(files)) => {
            for file in &files {
                held.extend(load(args, file, model)?);
            }
        }
    }
    Ok(held)
}

/// One folder per calibration, `STEM_followerN` in `out`; equal names are numbered in the order of the files.
fn folders(out: &Path, loaded: &[Loaded]) -> Vec<PathBuf> {
    let mut names: Vec<String> = Vec::new();
    for Loaded { trajectory, .. } in loaded {
        let stem = Path::new(&trajectory.source.path).file_stem().unwrap_or_default();
        let mut name = format!("{}_follower{}", stem.to_string_lossy(), trajectory.follower);
        if let Some(id) = trajectory.id.as_ref().filter(|_| is_one_of_several(trajectory, loaded)) {
            name += &format!("_trajectory{}", folder::part(id));
        }
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|n| !names.contains(n));
        names.push(free.expect("one of infinitely many numbers is free"));
    }
    names.iter().map(|name| out.join(name)).collect()
}

/// True if other trajectories of the same file are calibrated, too.
fn is_one_of_several(trajectory: &Trajectory, loaded: &[Loaded]) -> bool {
    loaded.iter().filter(|other| other.trajectory.source.path == trajectory.source.path).count() > 1
}

/// One calibration, of one trajectory or of several together, with its files.
fn one(
    args: &Args,
    calibration: &Calibration,
    loaded: &[Loaded],
    held: &[Loaded],
    folder: &Path,
) -> anyhow::Result<ResultFile> {
    let (started, mut bar) = (Instant::now(), progress::Bar::new(&calibration.search));
    let begin = |drivers: Option<&str>| {
        drivers
            .iter()
            .for_each(|apart| warn(&format!("--joint: {apart}; without --joint each gets its own parameters")));
        // Before the search, so that an unwritable folder does not cost one.
        output::make_folder(folder)
    };
    let found = calibration.on(loaded, held, begin, &mut |progress| bar.update(progress));
    bar.finish();
    let Whole { result, reference, lost } = found?;
    lost.iter().for_each(|text| warn(text));
    if calibration.folds.is_some() && result.held_back.is_none() && lost.is_none() {
        warn("--folds: interrupted; the result has no scores of left-out drivers");
    }
    let written = write::files(folder, &result, reference.cases(), loaded, Some(started.elapsed()));
    if !args.json {
        output::print(&text::calibration(&result))?;
    } else if written.is_err() {
        // A full disk must not cost the result.
        output::print(&result.to_json())?;
    }
    written?;
    if args.plot {
        plot(&result, &reference, loaded)?;
    }
    // With several calibrations the output must name the folder of each.
    let whose = match loaded {
        [one] if args.files.len() > 1 => {
            format!(" of {}, follower {},", one.trajectory.source.path, one.trajectory.follower)
        }
        _ => String::new(),
    };
    eprintln!("{:.1} s; files{whose} in {}", started.elapsed().as_secs_f64(), folder.display());
    Ok(result)
}

/// Text charts of the calibrated follower of each trajectory.
fn plot(result: &ResultFile, reference: &Reference, loaded: &[Loaded]) -> anyhow::Result<()> {
    for (k, (case, one)) in reference.cases().iter().zip(loaded).enumerate() {
        let mut trace = Trace::default();
        rescore::outcome(case, &result.parameters_on(k)?, &mut trace)?;
        let measured = [case.s.to_vec(), case.v_f.to_vec()];
        let lines = [("measured", measured), ("simulated", [trace.s, trace.v])];
        super::plot::print(&one.trajectory.label, &one.trajectory.t, &lines)?;
    }
    Ok(())
}
