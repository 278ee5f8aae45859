//! `leadlag diagnose`: errors of the data and the simulation, their causes, and the gain of an extended model.

mod again;
mod bar;
mod load;
pub mod write;

use super::evaluator::warn;
use super::{Exit, Usage, folder, interrupt, output};
use crate::api::bounds::read_bounds;
use crate::api::diagnosis::{Asked, built_in};
use crate::api::error::refuse;
use crate::api::fleet::{Pairs, files};
use crate::api::model::{known, model};
use crate::api::reading::Reading;
use crate::api::values::one_of;
use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::describe::Diagnosis;
use crate::diagnose::describe::free::Free;
use crate::diagnose::{Drive, Effort};
use crate::extension::Extension;
use crate::report::diagnosis::text;
use crate::result::diagnosis::{Outcome, has_bad_data};
use crate::text::spelling::did_you_mean;
use crate::wgsl::read_extension;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(override_usage = "leadlag diagnose [OPTIONS] --base <NAME|ID> <FILE>...
       leadlag diagnose [OPTIONS] --base <NAME|ID> --data <FILE,...>
       leadlag diagnose [OPTIONS] --all --base <NAME|ID> <FILE|FOLDER>...
       leadlag diagnose [OPTIONS] --data-only <FILE>...")]
#[command(after_help = "Examples:
  leadlag diagnose A.csv B.csv --holdout C.csv --base l-cth --out diagnosis
  leadlag diagnose platoon.csv --follower 2 --data-only
  leadlag diagnose --data A.csv,B.csv --base idm --causes mine.wgsl --json
  leadlag diagnose pairs.csv --all --base idm --out fleet

Exit codes with --exit-code: 0 named, 3 nothing, 4 ambiguous, 5 unexplained, 6 not testable, 7 bad data.")]
pub struct Args {
    /// Measured files to train on
    #[arg(value_name = "FILE", required_unless_present = "data")]
    pub files: Vec<PathBuf>,
    /// The same, separated by commas
    #[arg(long, value_name = "FILE,...", value_delimiter = ',')]
    pub data: Vec<PathBuf>,
    /// Measured files held back to test whether a cause carries over and what it gains [default: the last third of every file]
    #[arg(long, value_name = "FILE,...", value_delimiter = ',')]
    pub holdout: Vec<PathBuf>,
    /// Position of the follower (1 is directly behind the platoon leader); with --columns, a vehicle id [default: the only one]
    #[arg(long, value_name = "N")]
    pub follower: Option<String>,
    /// Base model: idm, gipps, l-cth, l-idm, l-gipps, any variant by id or name, or a file with your own law
    #[arg(long, visible_alias = "model", value_name = "MODEL", value_parser = known, required_unless_present = "data_only")]
    pub base: Option<String>,
    /// Diagnose a fleet: one law for every pair of every file or folder, judged on drivers left out of its fits. Drives may be short
    #[arg(long, conflicts_with_all = ["holdout", "data_only", "plot"])]
    pub all: bool,
    /// Only check the data
    #[arg(long)]
    pub data_only: bool,
    /// Search effort
    #[arg(long, default_value = "normal", value_parser = one_of(&[
        ("quick", Effort::Quick, "About 10 s of CPU per drive of 15 minutes"),
        ("normal", Effort::Normal, "Twice that"),
        ("thorough", Effort::Thorough, "No time limit"),
    ]))]
    pub effort: Effort,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1, value_parser = crate::api::values::seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// A cause of your own, as a WGSL part; may be given several times
    #[arg(long, value_name = "FILE.wgsl", conflicts_with = "data_only")]
    pub causes: Vec<PathBuf>,
    /// acc, human or a TOML file whose bounds replace those of the diagnosis, such as v_0 = [25, 40]; may be given several times
    #[arg(long, value_name = "acc|human|FILE.toml", conflicts_with = "data_only")]
    pub bounds: Vec<String>,
    /// Folder for diagnosis.json, the missing acceleration, the extended model and the pictures
    #[arg(short, long, value_name = "DIR", conflicts_with = "data_only")]
    pub out: Option<PathBuf>,
    /// Print diagnosis.json instead of text
    #[arg(long)]
    pub json: bool,
    /// Plot spacing and speed of the base and the extended model as text
    #[arg(long, conflicts_with_all = ["json", "data_only"])]
    pub plot: bool,
    /// Return the verdict as exit code
    #[arg(long)]
    pub exit_code: bool,
    #[command(flatten)]
    pub prepare: Reading,
}

impl Args {
    fn asked<'a>(&self, base: Variant, causes: &'a [&'static Extension], bounds: &'a Overrides) -> Asked<'a> {
        Asked { base, effort: self.effort, seed: self.seed, causes, bounds }
    }

    /// The training files, by either option.
    pub fn trained_on(&self) -> impl Iterator<Item = &PathBuf> {
        self.data.iter().chain(&self.files)
    }
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let causes = causes(args)?;
    // The data check needs no variant; the check of the preparation only lists the required signals.
    let variant = args.base.as_deref().map_or_else(|| Ok(Variant::from_id(1)?), model)?;
    if args.all {
        return of_fleet(args, variant, &causes);
    }
    let mut loaded = load::load(args, variant)?;
    if args.data_only {
        let faulty = has_bad_data(&loaded.data, &loaded.findings);
        if args.json {
            let version = crate::result::diagnosis::SCHEMA_VERSION;
            let (findings, data) = (&loaded.findings, &loaded.data);
            let report = serde_json::json!({"schema_version": version, "data_findings": findings, "data": data});
            output::print_json(&report)?;
        } else {
            output::print(&text::data(&loaded.data, &loaded.findings))?;
        }
        return if args.exit_code && faulty { Err(Exit(7).into()) } else { Ok(()) };
    }
    let bounds = read_bounds(&args.bounds, &variant)?;
    begin(args)?;
    let asked = args.asked(variant, &causes, &bounds);
    let mut bar = bar::Bar::new();
    let found = asked.answer(&mut loaded, &mut |progress| bar.update(&progress));
    bar.finish();
    let diagnosis = found?;
    if let Some(out) = &args.out {
        write::files(out, &diagnosis, &loaded.train, &loaded.holdout)?;
    }
    let outcome = &diagnosis.outcome;
    if args.json {
        output::print(&outcome.to_json())?;
    } else {
        let again = again::command(args, outcome, &loaded.trained);
        output::print(&text::diagnosis(outcome, again.as_ref()))?;
    }
    if args.plot {
        plot(&diagnosis, &loaded.train, &loaded.holdout)?;
    }
    if let Some(out) = &args.out {
        eprintln!("files in {}", out.display());
    }
    code(args, outcome)
}

/// A fleet: every pair of every file.
fn of_fleet(args: &Args, variant: Variant, causes: &[&'static Extension]) -> anyhow::Result<()> {
    let bounds = read_bounds(&args.bounds, &variant)?;
    begin(args)?;
    let inputs: Vec<&PathBuf> = args.trained_on().collect();
    let needing = Some(&variant).filter(|variant| variant.needs_vehicle());
    let follower = args.follower.as_deref();
    let pairs = Pairs::of_files(&args.prepare, &files(&inputs)?, follower, needing, &interrupt::asked)?;
    pairs.besides().iter().for_each(|text| warn(text));
    let mut bar = bar::Bar::new();
    let found = args.asked(variant, causes, &bounds).of_fleet(&pairs, &mut |progress| bar.update(&progress));
    bar.finish();
    let outcome = found?;
    if let Some(out) = &args.out {
        write::of_fleet(out, &outcome)?;
    }
    if args.json {
        output::print(&outcome.to_json())?;
    } else {
        let again = again::command(args, &outcome, &[]);
        output::print(&text::diagnosis(&outcome, again.as_ref()))?;
    }
    if let Some(out) = &args.out {
        eprintln!("files in {}", out.display());
    }
    let unreadable = &pairs.unreadable;
    anyhow::ensure!(unreadable.is_empty(), "{}\nnot read: {} of the files", unreadable.join("\n"), unreadable.len());
    code(args, &outcome)
}

/// Prepares the folder before the work: a refused or unwritable one must not cost a diagnosis.
fn begin(args: &Args) -> anyhow::Result<()> {
    interrupt::watch_saying("a diagnosis keeps nothing");
    let Some(out) = &args.out else { return Ok(()) };
    folder::refuse(out, folder::RESULT, "diagnosis")?;
    folder::refuse(out, folder::FLEET, "diagnosis")?;
    folder::spare(out, args.trained_on().chain(&args.holdout), |name| {
        let own = [("simulation", "csv"), ("simulation", "svg"), ("missing_acceleration", "csv")];
        own.iter().any(|(stem, ending)| folder::is_of(name, stem, ending))
    })?;
    output::make_folder(out)
}

/// The verdict as exit code, on request.
fn code(args: &Args, outcome: &Outcome) -> anyhow::Result<()> {
    let code = if outcome.has_bad_data() { 7 } else { outcome.verdict.exit_code() };
    if args.exit_code && code != 0 { Err(Exit(code).into()) } else { Ok(()) }
}

/// Text charts of the free simulations, drive by drive.
fn plot(diagnosis: &Diagnosis, train: &[Drive], holdout: &[Drive]) -> anyhow::Result<()> {
    for (i, drive) in train.iter().chain(holdout).enumerate() {
        let trajectory = &drive.trajectory;
        let mut lines = vec![("measured", [trajectory.s.clone(), trajectory.v_f.clone()])];
        let extended = diagnosis.extended.as_ref().and_then(|e| e.runs.get(i));
        for (name, run) in [("base", diagnosis.base.runs.get(i)), ("extended", extended)] {
            let signal = |run: &Free, k: usize| [vec![f64::NAN; run.first], run.simulated[k].clone()].concat();
            lines.extend(run.map(|run| (name, [signal(run, 0), signal(run, 1)])));
        }
        let role = if i < train.len() { "trained on" } else { "held back" };
        super::plot::print(&format!("{} ({role})", drive.label()), &trajectory.t, &lines)?;
    }
    Ok(())
}

/// The built-in causes, and the user's own.
fn causes(args: &Args) -> anyhow::Result<Vec<&'static Extension>> {
    let mut causes = built_in();
    for path in &args.causes {
        let given = path.to_string_lossy();
        if !path.exists() && path.extension().is_none() {
            let names = causes.iter().map(|cause| cause.name.as_str());
            let message = match causes.iter().find(|cause| cause.name == given) {
                Some(_) => format!("--causes {given}: is built in and tried anyway; --causes is for your own files"),
                None => format!(
                    "--causes {given}: expected a file that ends in .wgsl, and there is no such file{}; leadlag tries built-in causes anyway (`leadlag list causes`)",
                    did_you_mean(&given, names)
                ),
            };
            return Err(Usage(message).into());
        }
        let text = crate::text::bounded::read_to_string(path, crate::text::bounded::TEXT_MAX)
            .map_err(|e| anyhow::Error::new(e).context(format!("{}: cannot read the cause", path.display())))?;
        let own = read_extension(&path.display().to_string(), &text)?;
        if causes.iter().any(|known| known.name == own.name) {
            refuse!("--causes {}: a cause {} exists already", path.display(), own.name);
        }
        own.warnings.iter().for_each(|text| warn(text));
        causes.push(own);
    }
    Ok(causes)
}
