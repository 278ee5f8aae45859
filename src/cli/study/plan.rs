//! `leadlag study plan`.

use super::super::evaluator::warn;
use super::super::output;
use crate::api::study::planned;
use crate::study::folder::Folder;
use crate::study::plan::Validation;
use crate::study::{Study, Task};
use crate::text::shown::{NAMED, counted, first};
use crate::trajectory::is_nameless;
use std::collections::{BTreeSet, HashSet};
use std::io::IsTerminal;
use std::path::PathBuf;
use textwrap::fill;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The plan: data x variants x goodness-of-fit functions x replicates x validation
    #[arg(value_name = "PLAN.toml")]
    plan: PathBuf,
    /// Folder of the study [default: the name of the plan, in this folder]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Folder of the data, instead of that of the plan
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// List the tasks even if stdout is a terminal; they are always listed into a file or another program
    #[arg(long)]
    tasks: bool,
    /// List the trajectories: their files with checksums, and changes to the data
    #[arg(short, long)]
    verbose: bool,
}

/// Columns of a line.
const WIDTH: usize = 80;

fn lines_within(indent: usize) -> textwrap::Options<'static> {
    let indent = &"        "[..indent];
    textwrap::Options::new(WIDTH).initial_indent(indent).subsequent_indent(indent).break_words(false)
}

/// The files in use, their vehicles, and changes to the data.
fn used(study: &Study) -> String {
    let mut text = String::new();
    let mut platoon = "";
    for entry in study.drives.iter().map(|drive| &drive.entry) {
        if platoon != entry.platoon {
            platoon = &entry.platoon;
            text += &format!("{platoon} uses {}\n  sha256 {}\n", entry.file, entry.sha256);
        }
        text += &format!("  follower {}, {}\n", entry.follower, entry.vehicle);
        entry.notes.iter().for_each(|note| text += &format!("{}\n", fill(note, lines_within(4))));
    }
    text
}

/// The most important facts about the data, and a reference to the rest.
fn in_short(study: &Study) -> String {
    let files: BTreeSet<&str> = study.drives.iter().map(|drive| drive.entry.file.as_str()).collect();
    let prepared = study.drives.iter().filter(|drive| !drive.entry.notes.is_empty()).count();
    let (count, of) = (counted(study.drives.len(), "trajectory"), counted(files.len(), "file"));
    let text = format!("{count} of {of}; changes to {prepared} of them: --verbose, or study.json");
    let mut text = format!("{}\n", fill(&text, lines_within(0)));
    if let Some(first) = study.left_out.first() {
        let (count, whole) = (study.left_out.len(), study.left_out.len() + study.drives.len());
        let said =
            format!("left out: {count} of {whole} trajectories; the first is {}: {}", first.platoon, first.reason);
        text += &format!("{}\n", fill(&said, lines_within(0)));
    }
    for extend in &study.plan.calibration.extend {
        text += &format!("every variant is extended by {}\n", extend.extension.name);
    }
    text
}

/// Cars that count as one because their files name neither.
fn taken_for_one(study: &Study) -> Option<String> {
    let tried = (0..study.drives.len()).filter(|&i| !study.validated_on(i).is_empty());
    let names: BTreeSet<&str> =
        tried.map(|i| study.drives[i].entry.vehicle.as_str()).filter(|v| is_nameless(v)).collect();
    let note = format!(
        "the files do not name the cars: those called {} in several platoons count as one car, and a calibration on one is \
         validated on the others. If they are different cars, name them by `vehicle` in [[platoon]], or set validation.on = \"none\"",
        Vec::from_iter(names.iter().copied()).join(", ")
    );
    (!names.is_empty()).then_some(note)
}

/// Why nothing is validated, if the plan asks for validation.
fn not_validated(study: &Study) -> Option<String> {
    if study.plan.validation == Validation::None || study.drives.len() < 2 || study.validation_runs() > 0 {
        return None;
    }
    let names: BTreeSet<&str> = study.drives.iter().map(|drive| drive.entry.vehicle.as_str()).collect();
    Some(format!(
        "nothing is validated: no two platoons have a follower of the same name; the followers are {}. If they are the same driver, give the name \
         by `vehicle` in [[platoon]], or map the id as `group`",
        first(&Vec::from_iter(names), NAMED)
    ))
}

/// Trajectories whose validation uses measurements of their own calibration.
fn same_data(study: &Study) -> Option<String> {
    let pairs = (0..study.drives.len()).flat_map(|i| study.validated_on(i).into_iter().map(move |k| [i, k]));
    let shared = pairs.map(|pair| pair.map(|i| &study.drives[i])).find_map(|[own, other]| {
        let (a, b) = (&own.trajectory, &other.trajectory);
        let is_apart = a.t[a.len() - 1] < b.t[0] || b.t[b.len() - 1] < a.t[0];
        let place = |t: &f64| b.t.binary_search_by(|u| u.total_cmp(t)).ok();
        let mut common = (0..if is_apart { 0 } else { a.len() }).filter_map(|i| Some((i, place(&a.t[i])?)));
        // Other cars of a file drive at the same time; their first samples differ.
        let same =
            |count: usize, (i, k): (usize, usize)| ((a.s[i], a.v_f[i]) == (b.s[k], b.v_f[k])).then_some(count + 1);
        let count = common.try_fold(0, same)?;
        // Adjacent windows share one sample or more.
        (10 * count > a.len().min(b.len())).then_some((&own.entry, &other.entry, count))
    });
    let (own, other, count) = shared?;
    Some(format!(
        "{} and {} share {count} of {} and {} samples ({}): the calibration on one is partly validated on itself",
        own.label(),
        other.label(),
        own.samples,
        other.samples,
        other.file,
    ))
}

/// The tasks, one per line: id, platoon, follower, variant, goodness of fit, replicate.
fn lines(tasks: &[Task]) -> String {
    let line = |task: &Task| {
        let Task { id, platoon, follower, variant, gof, replicate, .. } = task;
        format!("{id}\t{platoon}\t{follower}\t{variant}\t{gof}\t{replicate}\n")
    };
    tasks.iter().map(line).collect()
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let (study, content, kept) = planned(&args.plan, args.data.as_deref())?;
    if kept {
        eprintln!(
            "the plan of a study: its name, its extensions and, without --data, the folder of its data are those of the study"
        );
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(&study.plan.name));
    if args.verbose {
        used(&study).lines().for_each(|line| eprintln!("{line}"));
    }
    in_short(&study).lines().for_each(|line| eprintln!("{line}"));
    [taken_for_one(&study), same_data(&study), not_validated(&study)].iter().flatten().for_each(|note| warn(note));
    for drive in &study.drives {
        let minds = |kind| study.plan.calibration.gofs.iter().any(|gof| gof.minds(kind));
        drive.trajectory.faults_of(minds).for_each(|fault| warn(&format!("{}: {fault}", drive.entry.label())));
    }
    let tasks = study.tasks();
    let before = Folder::open(&out).and_then(|folder| folder.tasks()).unwrap_or_default();
    Folder::create(&out, &content, &study)?;
    // Thousands of lines are for another program; a terminal shows their number.
    if args.tasks || !std::io::stdout().is_terminal() {
        output::print(&lines(&tasks))?;
    }
    let product = format!(
        "{} = {} x {} x {} x {}; {} of the winners",
        counted(tasks.len(), "task"),
        counted(study.drives.len(), "trajectory"),
        counted(study.plan.calibration.variants.len(), "variant"),
        counted(study.plan.calibration.gofs.len(), "goodness-of-fit function"),
        counted(study.plan.calibration.replicates, "replicate"),
        counted(study.validation_runs(), "validation run"),
    );
    eprintln!("{}:\n{}", out.display(), fill(&product, lines_within(2)));
    let planned: HashSet<&str> = tasks.iter().map(|task| task.id.as_str()).collect();
    let gone = before.iter().filter(|task| !planned.contains(task.id.as_str())).count();
    if gone > 0 {
        let before = before.len();
        eprintln!("{gone} of the {before} tasks planned here before are not in this plan;\ntheir parts stay, unused");
    }
    eprintln!("continue with: leadlag study run {}", out.display());
    Ok(())
}
