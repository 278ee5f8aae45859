//! `leadlag calibrate --all`: every pair of a data set, one table of parameters.

use super::super::change::Change;
use super::super::data::Loaded;
use super::super::evaluator::warn;
use super::super::lines::Lines;
use super::super::{Usage, folder, interrupt, output};
use super::{Args, warnings};
use crate::catalog::Variant;
use crate::cli::bounds::origin;
use crate::fleet::{self, Drive, Journal, Model, Pair, Row, Settings};
use crate::report::fleet::{FleetFile, text};
use crate::report::{csv, parquet};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

const JOURNAL: &str = "journal.jsonl";
const TABLES: [&str; 3] = ["parameters.csv", "parameters.parquet", "fits.csv"];

/// What a folder may hold of tables.
const ENDINGS: [&str; 4] = ["csv", "txt", "gz", "parquet"];

pub fn run(args: &Args, models: &[Variant]) -> anyhow::Result<()> {
    let started = Instant::now();
    let settings = Settings {
        models: models
            .iter()
            .map(|variant| Ok(Model { variant: *variant, overrides: args.overrides(*variant)? }))
            .collect::<anyhow::Result<_>>()?,
        measures: args.gofs.clone(),
        convention: args.convention,
        calibration: args.settings()?,
        max_evaluations: args.search.max_evaluations,
        intervals: !args.search.no_intervals,
        selection: args.evaluator.selection()?,
    };
    let twice = |k: &usize| settings.models[..*k].iter().any(|model| model.variant == settings.models[*k].variant);
    if let Some(k) = (0..models.len()).find(twice) {
        return Err(Usage(format!("--model {} is given twice", models[k])).into());
    }
    folder::refuse(&args.out, folder::RESULT, "fleet")?;
    folder::refuse(&args.out, folder::DIAGNOSIS, "fleet")?;
    interrupt::watch_saying("what was calibrated is kept; the same command goes on");
    let inputs = files(&args.files)?;
    folder::spare(&args.out, &inputs, |name| [TABLES.as_slice(), &[folder::FLEET, JOURNAL]].concat().contains(&name))?;
    let (pairs, unreadable) = read(args, &settings, &inputs)?;
    let usable = pairs.iter().filter(|pair| pair.drive.is_ok()).count();
    if usable == 0 {
        let first = pairs.iter().find_map(|pair| pair.drive.as_ref().err()).cloned();
        anyhow::bail!(
            "none of {} can be used{}",
            output::counted(pairs.len() as u64, "pair"),
            first.map_or(String::new(), |why| format!("; the first: {why}"))
        );
    }
    output::make_folder(&args.out)?;
    let journal = Journal::open(&args.out.join(JOURNAL), &settings.key(&pairs))?;
    let whole = settings.places(pairs.len()).count();
    let bar = Bar::new(whole, journal.known().len());
    let rows = fleet::run(&pairs, &settings, &journal, &interrupt::asked, &|done| bar.tell(done), warn)?;
    bar.finish();
    let done = rows.iter().flatten().count();
    anyhow::ensure!(done == whole, "interrupted: {done} of {whole} calibrations are kept; the same command goes on");
    let rows: Vec<Row> = rows.into_iter().flatten().collect();
    let names = pairs.iter().map(|pair| pair.name.as_str());
    let file = FleetFile::of(&pairs, &settings, &rows, origin(&args.bounds, names));
    write(&args.out, &file, &pairs, &settings, &rows)?;
    output::print(&if args.json { file.to_json() } else { text(&file) })?;
    let seconds = started.elapsed().as_secs_f64();
    eprintln!("{seconds:.1} s, {:.0} pairs/s; files in {}", whole as f64 / seconds, args.out.display());
    anyhow::ensure!(unreadable.is_empty(), "{}\nnot read: {} of the files", unreadable.join("\n"), unreadable.len());
    anyhow::ensure!(file.calibrated() > 0, "no pair could be calibrated; parameters.csv has the reasons");
    Ok(())
}

/// The pairs of all files, and what is wrong with files that cannot be read.
fn read(args: &Args, settings: &Settings, files: &[PathBuf]) -> anyhow::Result<(Vec<Pair>, Vec<String>)> {
    let needing = settings.models.iter().map(|model| &model.variant).find(|variant| variant.needs_vehicle());
    let (mut pairs, mut unreadable, mut doubts) = (Vec::new(), Vec::new(), Vec::new());
    for path in files {
        let file = path.display().to_string();
        let found = match args.data.pairs(path, args.follower.as_deref(), needing) {
            Ok(found) => found,
            Err(error) if files.len() == 1 => return Err(error),
            Err(error) => {
                unreadable.push(format!("{error:#}"));
                continue;
            }
        };
        for one in found {
            doubts.extend(one.doubts.first().map(|doubt| format!("{file}{}: {doubt}", named(one.id.as_deref()))));
            let drive = match one.drive {
                Ok(loaded) => Ok(loaded),
                Err(error) => Err(format!("{error:#}")),
            };
            pairs.push((file.clone(), one.id, one.follower, one.name, drive));
        }
        if interrupt::asked() {
            anyhow::bail!("interrupted while reading; nothing was calibrated");
        }
    }
    if let Some(first) = doubts.first() {
        warn(&format!("{} of {} pairs have implausible signals; the first: {first}", doubts.len(), pairs.len()));
    }
    let loaded: Vec<&Loaded> = pairs.iter().filter_map(|(.., drive)| drive.as_ref().ok()).collect();
    let said = settings
        .models
        .iter()
        .flat_map(|model| warnings::of(&args.data, &model.variant, args.convention, &model.overrides, &loaded));
    said.for_each(|text| warn(&text));
    let pair = |(file, trajectory, follower, name, drive): (String, _, _, _, Result<Loaded, String>)| {
        let drive = drive.map(|l| Drive { trajectory: l.trajectory, vehicle: l.vehicle.map(|(vehicle, _)| vehicle) });
        Pair { file, trajectory, follower, name, drive }
    };
    Ok((pairs.into_iter().map(pair).collect(), unreadable))
}

fn named(id: Option<&str>) -> String {
    id.map_or(String::new(), |id| format!(" trajectory {id}"))
}

/// The files, with the tables of folders in the order of their names.
fn files(given: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in given {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let shown = path.display();
        let entries = std::fs::read_dir(path).with_context(|| format!("{shown}: cannot list the folder"))?;
        let is_table = |path: &PathBuf| {
            let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
            path.is_file() && ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
        };
        let mut inside: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_table).collect();
        inside.sort();
        anyhow::ensure!(
            !inside.is_empty(),
            "{shown}: the folder has no tables ({})",
            ENDINGS.map(|e| format!(".{e}")).join(", ")
        );
        files.append(&mut inside);
    }
    Ok(files)
}

fn write(folder: &Path, file: &FleetFile, pairs: &[Pair], settings: &Settings, rows: &[Row]) -> anyhow::Result<()> {
    let table = fleet::table(pairs, settings, rows);
    let mut change = Change::begin(folder)?;
    change.write(TABLES[0], &csv::write(&table))?;
    change.write(TABLES[1], &parquet::write(&table, &[("program", &file.program)]))?;
    change.write(TABLES[2], &csv::write(&fleet::fits(pairs, settings, rows)?))?;
    change.write(folder::FLEET, file.to_json().as_bytes())?;
    folder::finish(change, folder, Vec::new())
}

/// Pairs per second and time left; where there is no terminal, a line a minute.
struct Bar {
    bar: ProgressBar,
    lines: Mutex<Lines>,
    whole: usize,
    /// Rows of the present run.
    before: usize,
    done: AtomicUsize,
    started: Instant,
}

impl Bar {
    fn new(whole: usize, before: usize) -> Bar {
        let style =
            ProgressStyle::with_template("{bar:20} {human_pos}/{human_len} calibrations, {per_sec}, {eta} left");
        let bar = output::heard(ProgressBar::new(whole as u64)).with_style(style.expect("the template is valid"));
        if before > 0 {
            eprintln!("{before} of {whole} calibrations are there already");
            bar.set_position(before as u64);
            bar.reset_eta();
        }
        let (lines, done) = (Mutex::new(Lines::new()), AtomicUsize::new(before));
        Bar { bar, lines, whole, before, done, started: Instant::now() }
    }

    fn tell(&self, done: usize) {
        let done = done.max(self.done.fetch_max(done, Ordering::Relaxed));
        self.bar.set_position(done as u64);
        let rate = (done - self.before) as f64 / self.started.elapsed().as_secs_f64();
        if let Ok(mut lines) = self.lines.lock() {
            lines.tell(|| {
                let left = (self.whole - done) as f64 / rate;
                format!("{done}/{} calibrations, {rate:.0}/s, {left:.0} s left", self.whole)
            });
        }
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
