//! `leadlag evaluate`: scores of parameter vectors in rows.

use super::evaluator::EvaluatorArgs;
use super::progress::Bar;
use super::simulate::beside;
use super::{evaluator, fleet_row, interrupt, output};
use crate::api::bounds::read_bounds;
use crate::api::loading::{column_map, read_grade};
use crate::api::reading::columns_help;
use crate::api::values::one_of;
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluate::{DataLayout, Library, Settings, TableError, evaluate_table};
use crate::evaluator::Case;
use crate::lanes::LanesPrecision;
use crate::score::GoodnessOfFit;
use crate::select::Work;
use crate::symbols::Symbol;
use crate::trajectory::Preparation;
use crate::vehicle;
use anyhow::{Context, bail};
use indicatif::HumanDuration;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Table with the columns model_id (or variant), platoon, follower_position and the parameters by name; or the folder of a fleet
    #[arg(value_name = "CASES.csv|FLEET")]
    cases: PathBuf,
    /// Folder of the platoon files, or one file for all rows [default for a fleet: the files it names]
    #[arg(long, value_name = "DIR|FILE")]
    data: Option<PathBuf>,
    #[arg(long, value_name = "NAME|FILE.toml", help = columns_help())]
    columns: Option<String>,
    /// Which copy of the AstaZero platoons is searched in DIR
    #[arg(long, default_value = "processed", value_parser = one_of(&[
        ("processed", DataLayout::Processed, "astazero_c2art, as the paper's authors processed them"),
        ("rebuilt", DataLayout::Rebuilt, "astazero_rebuilt, unfiltered speeds and measured gaps"),
    ]))]
    layout: DataLayout,
    /// paper or authors, with single rows changed behind a comma: authors,road_load=si [default: that of the fleet, else paper]
    #[arg(long)]
    convention: Option<Convention>,
    #[command(flatten)]
    evaluator: EvaluatorArgs,
    /// Bounds, as of calibrate, whose upper bound of tau_p fixes the scored window of variants with delay
    /// [default: those of the fleet, else 0.8 s, Table 3]
    #[arg(long, value_name = "acc|human|FILE.toml")]
    bounds: Vec<String>,
    /// Grade table for files that have none beside them, or `level`
    #[arg(long, value_name = "FILE|level")]
    grade: Option<String>,
    /// Smooth as the paper's authors did: two Savitzky-Golay passes, 51 points, cubic
    #[arg(long)]
    smooth: bool,
    /// Correct faults of the data where possible
    #[arg(long)]
    correct: bool,
    /// Show all changes to the data, not only the first ten
    #[arg(long)]
    verbose: bool,
    /// The follower: a built-in vehicle or FILE#NAME [default: that of the fleet, else by its name in the file]
    #[arg(long, value_name = "NAME|FILE#NAME")]
    vehicle: Option<String>,
    /// Add a column with NRMSE(s,v,a) in f64
    #[arg(long)]
    rescore: bool,
    /// Write the table here [default: stdout]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Changes to the data that are shown by default; those of many drives would hide errors.
const NOTES: usize = 10;

/// Given rows deserve all digits, and `lanes` in f64 is fast; the number of rows is unknown.
const WORK: Work = Work { candidates: 1, precision: LanesPrecision::F64 };

pub fn run(args: &Args) -> anyhow::Result<()> {
    let selection = args.evaluator.selection()?;
    // Any with a perception delay.
    let any: Variant = "idm+delay".parse()?;
    let overrides = read_bounds(&args.bounds, &any)?;
    let fleet = fleet_row::folder_of(&args.cases);
    let (cases, of_fleet) = match &fleet {
        Some(folder) => (folder.join(fleet_row::TABLE), Some(fleet_row::file_of(folder)?)),
        None => (args.cases.clone(), None),
    };
    let own = of_fleet.as_ref().map(|file| file.convention.parse()).transpose()?;
    let convention = args.convention.or(own).unwrap_or(Convention::PAPER);
    let name = Symbol::tau_p.name();
    // All models of a fleet have the same bounds.
    let own = of_fleet.iter().flat_map(|file| file.bounds.values()).find_map(|bounds| bounds.get(name)).copied();
    let table = Case::bounds(Symbol::tau_p, None, convention).context("Table 3 bounds tau_p")?;
    let [_, tau_p_upper] = overrides.get(name).copied().or(own).unwrap_or(table);
    let settings = Settings { convention, tau_p_upper, rescore: args.rescore };
    let grade = args.grade.as_deref().map(read_grade).transpose()?;
    let preparation = Preparation { grade, smooth: args.smooth, correct: args.correct, ..Preparation::default() };
    // Other data may have other columns.
    let own = of_fleet.as_ref().filter(|_| args.data.is_none()).and_then(|file| file.columns.as_deref());
    let columns = args.columns.as_deref().or(own).map(column_map).transpose()?;
    let mut library = Library::open(args.data.as_deref(), args.layout, columns, preparation)?;
    let known = of_fleet.as_ref().and_then(|file| file.vehicle.as_deref().map(|from| beside(from, &cases)));
    if let Some(vehicle) = args.vehicle.clone().or(known) {
        // Only some rows may need its curve.
        let whole = vehicle::find_for(&vehicle, true);
        library.vehicle = Some(whole.or_else(|_| vehicle::find_for(&vehicle, false))?);
    }
    library.treatment = of_fleet.as_ref().and_then(|file| file.treatment.clone());
    for (file, one) in of_fleet.iter().flat_map(|file| file.overview.iter().map(move |one| (file, one))) {
        // A row of another model says that it is unknown.
        if let Ok((variant, delay_upper)) = fleet_row::model(file, &one.model) {
            library.models.insert(one.model.clone(), (variant, delay_upper));
        }
    }
    let shown = cases.display().to_string();
    let input = File::open(&cases).with_context(|| format!("{shown}: cannot open the cases"))?;
    // Replaces the old file when complete, because it may be the file that is being read.
    let mut written = args.out.as_deref().map(output::begin_file).transpose()?;
    let output: Box<dyn Write + '_> = match &mut written {
        Some(file) => Box::new(BufWriter::new(file)),
        None => Box::new(BufWriter::new(output::table())),
    };

    interrupt::watch();
    let mut bar = Bar::new("{spinner} {human_pos} rows, {rate}, {elapsed}", None, Duration::ZERO);
    let mut progress = |rows| {
        bar.show(rows, String::new(), |bar| format!("{rows} rows, {:#}", HumanDuration(bar.elapsed())));
        !interrupt::asked()
    };
    let mut used: Vec<String> = Vec::new();
    let mut build = |cases| {
        let evaluator = selection.build(cases, GoodnessOfFit::NRMSE_SVA, WORK, evaluator::warn)?;
        let on = evaluator.adapter().map_or(String::new(), |adapter| format!(" on {adapter}"));
        let name = format!("{} ({}){on}", evaluator.name(), evaluator.precision());
        if !used.contains(&name) {
            used.push(name);
        }
        Ok(evaluator)
    };
    let input = BufReader::new(crate::text::bounded::Lines::new(input));
    let result = evaluate_table(input, &shown, output, &mut library, &settings, &mut build, &mut progress);
    bar.finish();
    for source in &library.sources {
        eprintln!("used {} sha256 {}", source.path, source.sha256);
    }
    let (notes, most) = (&library.notes, if args.verbose { usize::MAX } else { NOTES });
    notes.iter().take(most).for_each(|note| eprintln!("{note}"));
    if notes.len() > most {
        eprintln!("{} more lines about the data: --verbose", notes.len() - most);
    }
    library.faults.iter().for_each(|fault| evaluator::warn(fault));
    // The rows of an interrupted run are complete and worth keeping.
    if let (Some(file), Some(out)) = (written, &args.out)
        && matches!(result, Ok(_) | Err(TableError::Interrupted(_)))
    {
        output::finish_file(file, out)?;
    }
    let summary = match result {
        Err(TableError::Write(e)) => return Err(output::write_error(e, args.out.as_deref())),
        other => other?,
    };
    eprintln!(
        "{} rows: {} simulated to the end, {} ended early, {} invalid; evaluator {}, convention {}",
        summary.rows,
        summary.rows - summary.failed - summary.invalid,
        summary.failed,
        summary.invalid,
        if used.is_empty() { "none".to_owned() } else { used.join(", ") },
        convention
    );
    if summary.with_unused > 0 {
        let names: Vec<&str> = summary.unused.iter().copied().collect();
        evaluator::warn(&format!(
            "{shown}: {} of {} rows give parameters that their variant lacks; leadlag ignores them: {}",
            summary.with_unused,
            summary.rows,
            names.join(", ")
        ));
    }
    let Some((row, reason)) = summary.first_invalid else { return Ok(()) };
    let first = format!("the first of the invalid rows is row {row}: {reason}");
    if summary.invalid == summary.rows {
        // A misspelt column or a wrong folder: no row could be simulated.
        bail!("{shown}: no row could be simulated; {first}");
    }
    eprintln!("{first}");
    Ok(())
}
