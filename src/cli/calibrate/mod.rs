//! `leadlag calibrate`: from measured files to calibrated parameters.

mod flags;
mod fleet;
pub mod progress;
mod warnings;
mod write;

pub use flags::Args;

use super::bounds::origin;
use super::data::Loaded;
use super::evaluator::{BY_FLAGS, transcribed, warn};
use super::{Usage, folder, interrupt, is_usage, output};
use crate::calibrate::{Calibration, SearchSpace, apart, best, bound_times, calibrate};
use crate::catalog::Variant;
use crate::evaluator::{Case, Evaluator};
use crate::identify::identify;
use crate::lanes::LanesPrecision;
use crate::optimize::GaSettings;
use crate::reference::{Reference, Trace};
use crate::report::text;
use crate::rescore;
use crate::result::ResultFile;
use crate::result::assemble::Calibrated;
use crate::select::Work;
use crate::trajectory::Trajectory;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub fn run(args: &Args) -> anyhow::Result<()> {
    let models = args.extended()?;
    models.iter().try_for_each(|model| transcribed(args.evaluator.selection()?.kind, model, BY_FLAGS))?;
    if args.all {
        return fleet::run(args, &models);
    }
    let model = models[0];
    args.gof()?;
    let (mut loaded, mut unusable) = (Vec::new(), Vec::new());
    for file in &args.files {
        match load(args, file, &model) {
            Ok(trajectories) => loaded.extend(trajectories),
            // Of files that are calibrated one by one, one that cannot be used does not cost the others.
            Err(error) if args.files.len() > 1 && !args.joint => unusable.push(error),
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
    // Before the work: a folder that is refused must not cost a calibration.
    let together = args.joint || (loaded.len() == 1 && unusable.is_empty());
    let folders = if together { vec![args.out.clone()] } else { folders(&args.out, &loaded) };
    if !together {
        folder::refuse(&args.out, folder::RESULT, "each")?;
    }
    let is_own = |name: &str| {
        let numbered =
            [("simulation", "csv"), ("plot", "svg")].iter().any(|(stem, ending)| folder::is_of(name, stem, ending));
        numbered || [folder::RESULT, "timing.json"].contains(&name)
    };
    folders.iter().try_for_each(|folder| {
        folder::refuse(folder, folder::DIAGNOSIS, "calibrated")?;
        folder::spare(folder, &args.files, is_own)?;
        anyhow::Ok(())
    })?;
    let overrides = args.overrides(model)?;
    warnings::of(&args.data, &model, args.convention, &overrides, &loaded.iter().collect::<Vec<_>>())
        .iter()
        .for_each(|text| warn(text));
    interrupt::watch();
    if together {
        let result = one(args, &loaded, &args.out)?;
        return if args.json { output::print(&result.to_json()) } else { Ok(()) };
    }
    let mut results = Vec::new();
    for (trajectory, folder) in loaded.iter().zip(&folders) {
        results.push(one(args, std::slice::from_ref(trajectory), folder)?);
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
        "interrupted: not calibrated: {}; the same command with these files and another --out does the rest",
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

/// The trajectories of one file: the one that is chosen, or each that is asked for, or with --joint every one of a table.
fn load(args: &Args, file: &Path, model: &Variant) -> anyhow::Result<Vec<Loaded>> {
    let (recording, follower) = args.data.read(file, args.follower.as_deref())?;
    args.data.pick_all(&recording, follower, model, args.joint)
}

/// One folder per calibration, `STEM_followerN` in `out`; numbered in the order of the files where two would be the same.
fn folders(out: &Path, loaded: &[Loaded]) -> Vec<PathBuf> {
    let mut names: Vec<String> = Vec::new();
    for Loaded { trajectory, id, .. } in loaded {
        let stem = Path::new(&trajectory.source.path).file_stem().unwrap_or_default();
        let mut name = format!("{}_follower{}", stem.to_string_lossy(), trajectory.follower);
        if let Some(id) = id.as_ref().filter(|_| is_one_of_several(trajectory, loaded)) {
            name += &format!("_trajectory{}", folder::part(id));
        }
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|n| !names.contains(n));
        names.push(free.expect("one of endlessly many numbers is free"));
    }
    names.iter().map(|name| out.join(name)).collect()
}

/// True if other trajectories of the same file are calibrated, too.
fn is_one_of_several(trajectory: &Trajectory, loaded: &[Loaded]) -> bool {
    loaded.iter().filter(|other| other.trajectory.source.path == trajectory.source.path).count() > 1
}

/// One calibration, of one trajectory or of several together, with its files.
fn one(args: &Args, loaded: &[Loaded], folder: &Path) -> anyhow::Result<ResultFile> {
    let (space, reference) = prepare(args, loaded)?;
    let settings = args.settings()?;
    let mut evaluator = evaluator(args, &reference, &settings)?;
    // Before the work: a folder that cannot be written must not cost a calibration.
    output::make_folder(folder)?;
    let started = Instant::now();
    let apart = apart(reference.cases(), &space, settings.seed)?.map(|apart| {
        let labels: Vec<&str> = loaded.iter().map(|l| l.trajectory.label.as_str()).collect();
        apart.told(&space, &labels)
    });
    if let Some(apart) = &apart {
        warn(&format!("--joint: {apart}; without --joint each gets parameters of its own"));
    }
    let mut result = search(evaluator.as_mut(), &reference, loaded, &space, args, &settings)?;
    result.drivers = apart;
    let written = write::files(folder, &result, &reference, loaded, started.elapsed());
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
    // Of several calibrations it has to be told which folder is whose.
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
    let parameters = result.calibrated_variant()?.parameters;
    for (case, one) in reference.cases().iter().zip(loaded) {
        let mut trace = Trace::default();
        rescore::outcome(case, &parameters, &mut trace)?;
        let measured = [case.s.to_vec(), case.v_f.to_vec()];
        let lines = [("measured", measured), ("simulated", [trace.s, trace.v])];
        super::plot::print(&one.trajectory.label, &one.trajectory.t, &lines)?;
    }
    Ok(())
}

/// The search space and the cases. Road loads of a joint calibration are bounded by one vehicle, so there must be one.
fn prepare(args: &Args, loaded: &[Loaded]) -> anyhow::Result<(SearchSpace, Reference)> {
    let model = args.extended()?[0];
    let vehicle = loaded[0].vehicle();
    if let Some(other) = loaded.iter().find(|l| l.vehicle().map(|v| &v.slug) != vehicle.map(|v| &v.slug))
        && model.needs_vehicle()
    {
        let name = |v: Option<&crate::vehicle::Vehicle>| v.map_or("unknown".to_owned(), |v| v.slug.clone());
        let (one, two) = (name(vehicle), name(other.vehicle()));
        let message = format!("--joint: variant {model} needs one vehicle, found {one} and {two}; give --vehicle");
        return Err(Usage(message).into());
    }
    let mut overrides = args.overrides(model)?;
    let ends = |of: fn(&[f64]) -> Option<&f64>| loaded.iter().filter_map(move |l| of(&l.trajectory.t)).copied();
    let window =
        [ends(<[f64]>::first).fold(f64::INFINITY, f64::min), ends(<[f64]>::last).fold(f64::NEG_INFINITY, f64::max)];
    bound_times(&model, window, &mut overrides);
    let space = SearchSpace::new(&model, vehicle, args.convention, &overrides)?;
    let mut cases = Vec::new();
    for l in loaded {
        let case = Case::new(&l.trajectory, model, l.vehicle(), args.convention, space.tau_p_upper())?;
        cases.push(case.with_extension_delay(space.extension_delay_upper())?);
    }
    Ok((space, Reference::new(cases, args.gof()?)))
}

/// The evaluator that simulates the candidates; the reference scores what it finds again.
fn evaluator(args: &Args, reference: &Reference, settings: &Calibration) -> anyhow::Result<Box<dyn Evaluator>> {
    let cases = reference.cases().to_vec();
    let generation = GaSettings::default().population_size * settings.replicates as usize;
    let work = Work { candidates: generation * cases.len(), precision: LanesPrecision::Plain };
    Ok(args.evaluator.selection()?.build(cases, args.gof()?, work, warn)?)
}

fn search(
    evaluator: &mut dyn Evaluator,
    reference: &Reference,
    loaded: &[Loaded],
    space: &SearchSpace,
    args: &Args,
    settings: &Calibration,
) -> anyhow::Result<ResultFile> {
    let mut bar = progress::Bar::new(settings);
    let replicates = calibrate(evaluator, space, settings, &mut |p| bar.update(p))?;
    bar.finish();
    let Some(winner) = best(&replicates).filter(|winner| winner.score.is_finite()) else {
        let message = "no replicate found a candidate that passes in f64; those that pass in f32 lie on the edge \
                       of a crash; try --optimizer auto, --precision compensated or another --seed";
        return Err(anyhow::anyhow!(message));
    };
    let wanted = !args.search.no_intervals && !space.free().is_empty() && !interrupt::asked();
    let knowledge = if wanted { Some(identify(evaluator, space, &winner.candidate)?) } else { None };
    let trajectories: Vec<_> = loaded.iter().map(|l| &l.trajectory).collect();
    let calibrated = Calibrated {
        evaluator,
        reference,
        trajectories: &trajectories,
        vehicle: loaded[0].vehicle.as_ref().map(|(v, from)| (v, from.as_str())),
        space,
        bounds_from: origin(&args.bounds, loaded.iter().map(|l| l.trajectory.name.as_str())),
        gof: args.gof()?,
        settings,
        replicates,
        knowledge,
    };
    Ok(calibrated.into_result())
}
