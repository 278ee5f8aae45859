//! `leadlag calibrate --all`: every pair of a data set, one table of parameters.

use super::super::change::Change;
use super::super::evaluator::warn;
use super::super::{folder, interrupt, output, progress};
use super::{Args, folders, write as write_one};
use crate::api::Calibration;
use crate::api::bounds::origin;
use crate::api::error::refuse;
use crate::api::fleet::{HeldBack, Pairs, files, settings};
use crate::api::loading::Loaded;
use crate::api::reading::Reading;
use crate::api::warnings;
use crate::catalog::Variant;
use crate::evaluator::Evaluator;
use crate::fleet::{self, Comparison, Held, Model, Pair, Row, Settings, driver};
use crate::report::fleet::{FleetFile, text};
use crate::report::{csv, parquet};
use crate::text::shown::NAMED;
use crate::trajectory::Trajectory;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const JOURNAL: &str = "journal.jsonl";
const TABLES: [&str; 3] = ["parameters.csv", "parameters.parquet", "fits.csv"];

pub fn run(args: &Args, models: &[Variant]) -> anyhow::Result<()> {
    let started = Instant::now();
    let calibrations = models.iter().map(|model| args.calibration(*model)).collect::<anyhow::Result<Vec<_>>>()?;
    let settings = settings(&calibrations, args.gofs.clone())?;
    folder::refuse(&args.out, folder::RESULT, "fleet")?;
    folder::refuse(&args.out, folder::DIAGNOSIS, "fleet")?;
    interrupt::watch_saying("finished calibrations are kept; repeat the command to resume");
    let inputs = files(&args.files)?;
    folder::spare(&args.out, &inputs, |name| {
        [TABLES.as_slice(), &[folder::FLEET, folder::RUN, JOURNAL]].concat().contains(&name)
    })?;
    let (found, holdout) = read(args, &settings, &inputs)?;
    found.check()?;
    let Pairs { pairs, unreadable, .. } = found;
    output::make_folder(&args.out)?;
    let journal = settings.journal(&args.out.join(JOURNAL), &pairs)?;
    let whole = settings.places(pairs.len()).count();
    let mut bar = Bar::new(whole, journal.count());
    let rows = fleet::run(&pairs, &settings, journal, &interrupt::asked, &mut |done| bar.tell(done), warn)?;
    bar.finish();
    let done = rows.iter().flatten().count();
    anyhow::ensure!(
        done == whole,
        "interrupted: {done} of {whole} calibrations are kept; repeat the command to resume"
    );
    let rows: Vec<Row> = rows.into_iter().flatten().collect();
    let names = pairs
        .iter()
        .map(|pair| (pair.name.as_str(), pair.drive.as_ref().ok().and_then(|drive| drive.trajectory.driver())));
    let comparison = fleet::compare(&pairs, &settings, &rows)?;
    let file = FleetFile::of(&pairs, &settings, &rows, &comparison, holdout, origin(&args.bounds, names));
    let Reading { columns, vehicle, .. } = args.data.clone();
    let file = FleetFile { columns, vehicle, ..file };
    write(&args.out, &file, &pairs, &settings, &rows, &comparison)?;
    output::print(&if args.json { file.to_json() } else { text(&file) })?;
    let seconds = started.elapsed().as_secs_f64();
    if args.each {
        each(args, &calibrations, &settings, &pairs, &rows)?;
    }
    eprintln!("{seconds:.1} s, {:.0} pairs/s; files in {}", whole as f64 / seconds, args.out.display());
    anyhow::ensure!(unreadable.is_empty(), "{}\nnot read: {} of the files", unreadable.join("\n"), unreadable.len());
    anyhow::ensure!(file.calibrated() > 0, "no pair could be calibrated; parameters.csv has the reasons");
    Ok(())
}

/// The pairs of all files, and a description of the held-back data; warns about doubtful values.
fn read(args: &Args, settings: &Settings, files: &[PathBuf]) -> anyhow::Result<(Pairs, Option<String>)> {
    let reading = &args.data;
    let needing = settings.models.iter().map(|model| &model.variant).find(|variant| variant.needs_vehicle());
    let of_files =
        |files: &[PathBuf]| Pairs::of_files(reading, files, args.follower.as_deref(), needing, &interrupt::asked);
    let mut pairs = of_files(files)?;
    pairs.besides().iter().chain(&pairs.doubtful()).for_each(|text| warn(text));
    let held = match HeldBack::of(&args.holdout, files)? {
        None => None,
        Some(HeldBack::Share(share)) => {
            Some((Held::Share(share), format!("the last {} % of each drive", 100.0 * share)))
        }
        Some(HeldBack::Files(held)) => {
            let held = of_files(&held)?;
            held.check().map_err(|error| anyhow::anyhow!("--holdout: {error:#}"))?;
            Some((Held::Pairs(held.pairs), format!("the drives of {}", args.holdout.join(", "))))
        }
    };
    let holdout = match held {
        None => None,
        Some((held, told)) => {
            let (usable, without) = (pairs.pairs.iter().filter(|pair| pair.drive.is_ok()).count(), pairs.hold(held));
            if usable > 0 && without == usable {
                let ids: Vec<&str> = pairs.pairs.iter().filter_map(driver).take(NAMED).collect();
                refuse!(
                    "--holdout: {told} belong to none of the calibrated drivers, {}; drivers are matched by the name of the car, or \
                     else the id of the trajectory",
                    if ids.is_empty() { "nameless".to_owned() } else { ids.join(", ") }
                );
            }
            if without > 0 {
                warn(&format!(
                    "--holdout: {without} of {usable} pairs have no data held back and do not compare models"
                ));
            }
            Some(told)
        }
    };
    let usable = pairs.pairs.iter().filter_map(|pair| pair.drive.as_ref().ok());
    let trajectories: Vec<&Trajectory> = usable.map(|drive| &drive.trajectory).collect();
    for Model { variant, overrides } in &settings.models {
        let said = warnings::of(reading, variant, args.convention, overrides, &trajectories);
        said.iter().for_each(|text| warn(text));
    }
    Ok((pairs, holdout))
}

fn write(
    folder: &Path,
    file: &FleetFile,
    pairs: &[Pair],
    settings: &Settings,
    rows: &[Row],
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let table = fleet::table(pairs, settings, rows, comparison);
    output::warn_of_formula(&folder.join(TABLES[0]), &table);
    let mut change = Change::begin(folder)?;
    change.write(TABLES[0], &csv::write(&table))?;
    change.write(TABLES[1], &parquet::write(&table, &[("program", &file.program)]))?;
    change.write(TABLES[2], &csv::write(&fleet::fits(pairs, settings, rows)?))?;
    change.write(folder::FLEET, file.to_json().as_bytes())?;
    folder::finish(change, folder, Vec::new())
}

/// The files of every calibration with a result, like those of a single pair. Another calibration finds the same bits.
fn each(
    args: &Args,
    calibrations: &[Calibration],
    settings: &Settings,
    pairs: &[Pair],
    rows: &[Row],
) -> anyhow::Result<()> {
    let reading = &args.data;
    let needing = settings.models.iter().map(|model| &model.variant).find(|variant| variant.needs_vehicle());
    let load = |pair: &Pair| -> anyhow::Result<Option<Loaded>> {
        let Ok(drive) = &pair.drive else { return Ok(None) };
        let trajectory = drive.trajectory.clone();
        let vehicle = needing.map(|variant| reading.vehicle_for(&trajectory, variant)).transpose()?.flatten();
        Ok(Some(Loaded { trajectory, vehicle, twin: None }))
    };
    let found: Vec<&Row> = rows.iter().filter(|row| row.found.is_ok()).collect();
    let mut places: Vec<usize> = found.iter().map(|row| row.place.pair).collect();
    places.dedup();
    let loaded: Vec<Loaded> =
        places.iter().filter_map(|&k| load(&pairs[k]).transpose()).collect::<anyhow::Result<_>>()?;
    let folders = folders(&args.out.join("each"), &loaded);
    let mut bar = Bar::new(found.len(), 0);
    for (done, row) in found.into_iter().enumerate() {
        anyhow::ensure!(
            !interrupt::asked(),
            "interrupted: {done} of the calibrations have a folder in {}/each",
            args.out.display()
        );
        let at = places.iter().position(|&pair| pair == row.place.pair).expect("every row's pair is listed");
        let mut calibration = calibrations[row.place.model].clone();
        calibration.gof = settings.measures[row.place.measure];
        let mut folder = folders[at].clone();
        if settings.models.len() > 1 {
            // The names of two models may differ in a + only.
            folder.push(calibration.model());
        }
        if settings.measures.len() > 1 {
            folder.push(folder::part(&calibration.gof.to_string()));
        }
        let one = std::slice::from_ref(&loaded[at]);
        let prepared = calibration.prepare(one)?;
        calibration.search.stop.max_evaluations = settings.most_evaluations(&prepared.space);
        let mut evaluator = calibration.build(&prepared.reference)?;
        let result = calibration.search(evaluator.as_mut(), &prepared, one, &mut |_| ControlFlow::Continue(()))?;
        output::make_folder(&folder)?;
        write_one::files(&folder, &result, prepared.reference.cases(), one, None)?;
        bar.tell(done + 1);
    }
    bar.finish();
    Ok(())
}

/// Pairs per second and time left.
struct Bar {
    bar: progress::Bar,
    whole: usize,
    /// Rows of the present run.
    before: usize,
    started: Instant,
}

impl Bar {
    fn new(whole: usize, before: usize) -> Bar {
        let template = "{bar:20} {human_pos}/{human_len} calibrations, {per_sec}, {eta} left";
        let bar = progress::Bar::new(template, Some(whole as u64), Duration::ZERO);
        if before > 0 {
            eprintln!("{before} of {whole} calibrations were finished before");
            bar.bar.set_position(before as u64);
            bar.bar.reset_eta();
        }
        Bar { bar, whole, before, started: Instant::now() }
    }

    fn tell(&mut self, done: usize) {
        let rate = (done - self.before) as f64 / self.started.elapsed().as_secs_f64();
        self.bar.show(done as u64, String::new(), |_| {
            let left = (self.whole - done) as f64 / rate;
            format!("{done}/{} calibrations, {rate:.0}/s, {left:.0} s left", self.whole)
        });
    }

    fn finish(&self) {
        self.bar.finish();
    }
}
