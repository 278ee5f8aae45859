//! The flags of `leadlag calibrate`.

use super::super::evaluator::{EvaluatorArgs, warn};
use crate::api::Calibration;
use crate::api::error::refuse;
use crate::api::extension::extend;
use crate::api::model::{known, model};
use crate::api::reading::Reading;
use crate::api::values::{finite, seed, whole};
use crate::calibrate::{self, EVALUATIONS_MIN, OptimizerKind, REPLICATES_MAX, Stop};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::score::GoodnessOfFit;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measured files, calibrated one by one unless --joint is given; with --all also folders
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Position of the follower (1 is directly behind the platoon leader); with --columns, a vehicle id [default: the only one]
    #[arg(long, value_name = "N|ID", allow_negative_numbers = true)]
    pub follower: Option<String>,
    /// Variant by id (1 to 90) or name, such as gipps+delay+linear+mfc; a law of `leadlag list laws`, or your own law in a file, such as
    /// my_law.wgsl+delay; with --all several, each with a --model
    #[arg(long = "model", required = true, value_name = "MODEL", value_parser = known)]
    pub models: Vec<String>,
    /// Extension of the variant: a built-in cause (`leadlag list causes`) or your own file; may be
    /// given several times
    #[arg(long, value_name = "NAME|FILE.wgsl")]
    pub extend: Vec<String>,
    /// Folder for result.json, timing.json, simulation.csv and plot.svg; with --all for parameters.csv, parameters.parquet and fleet.json
    #[arg(short, long, value_name = "DIR")]
    pub out: PathBuf,
    /// One parameter set for all files, and for every pair of a file unless --follower selects one
    #[arg(long, group = "many")]
    pub joint: bool,
    /// Calibrate every leader-follower pair separately, into one table of parameters. Repeat the command to resume after an interruption
    #[arg(long, group = "many", conflicts_with_all = ["joint", "plot", "segment", "replicates"])]
    pub all: bool,
    /// With --all: also write result.json, simulation.csv and plot.svg of each pair, to folders in DIR/each; takes the time of the calibrations again
    // A flag that contradicts --all lifts the requirement, so each must contradict this one, too.
    #[arg(long, requires = "all", conflicts_with_all = ["joint", "plot", "segment", "replicates"])]
    pub each: bool,
    /// With --joint or --all: hold back this share at the end of each drive, or the drives in these files. They are scored but not used
    /// for calibration. With --all they are those of the same driver id, and decide between models; files may be given several times
    #[arg(long, value_name = "SHARE|FILE", requires = "many", allow_negative_numbers = true)]
    pub holdout: Vec<String>,
    /// Time at the start of each drive in which the car is the measured one; simulation and score begin after it, and delays are at most as
    /// long, so that all models are scored on the same samples
    #[arg(long, value_name = "S", conflicts_with = "all", value_parser = finite, allow_negative_numbers = true)]
    pub history: Option<f64>,
    /// With --joint: own values of the named parameters for each driver, near the middle of their distribution over the drivers; all others are
    /// common. Drivers who are held back get the middle
    #[arg(long, value_name = "NAME,...", requires = "joint", conflicts_with = "all", value_delimiter = ',')]
    pub own: Vec<String>,
    /// With --joint: leave each driver out of one of this many further calibrations, of one replicate, whose parameters are scored on that
    /// driver
    #[arg(long, value_name = "N", requires = "joint", conflicts_with_all = ["holdout", "all"], value_parser = whole(2, REPLICATES_MAX), allow_negative_numbers = true)]
    pub folds: Option<u64>,
    /// Measure to minimise: nrmse-sva, rmse-s, u-sv, ...; weights after a colon: nrmse-sva:1,1,0.5. With --all, several
    #[arg(long = "gof", default_value = "nrmse-sva")]
    pub gofs: Vec<GoodnessOfFit>,
    /// paper or authors, with single rows changed behind a comma: authors,road_load=si
    #[arg(long, default_value = "paper")]
    pub convention: Convention,
    /// acc (Table 3: cars with adaptive cruise control), human (wide, partly from papers), or a TOML file of bounds that replace
    /// those: v_0 = [25, 40]; may be given several times [default: acc]
    #[arg(long, value_name = "acc|human|FILE.toml")]
    pub bounds: Vec<String>,
    /// Fix a parameter, within its bounds in --bounds if it has some there; may be given several times
    #[arg(long, value_name = "NAME=VALUE", value_parser = fixed)]
    pub fix: Vec<(String, f64)>,
    /// Print result.json instead of text
    #[arg(long)]
    pub json: bool,
    /// Draw spacing and speed as text
    #[arg(long, conflicts_with = "json")]
    pub plot: bool,
    #[command(flatten)]
    pub search: SearchArgs,
    #[command(flatten)]
    pub evaluator: EvaluatorArgs,
    #[command(flatten)]
    pub data: Reading,
}

/// Fewer than four parents breed nothing new.
const POPULATION_MIN: u64 = 10;
/// The candidates of a larger population and their scores would take gigabytes.
const POPULATION_MAX: u64 = 1_000_000;

/// A calibration of this many simulations would take years.
const EVALUATIONS_MAX: u64 = 1_000_000_000_000;

/// Optimiser, seed, replicates and stopping rules.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Search")]
pub struct SearchArgs {
    /// auto (Gauss-Newton in f64 from many starts until the searches agree), lshade, cmaes, or ga (the paper's)
    #[arg(long, default_value = "auto")]
    pub optimizer: OptimizerKind,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Independent repetitions, 1 to 100000
    #[arg(long, value_name = "R", default_value_t = 1, value_parser = whole(1, REPLICATES_MAX),
          allow_negative_numbers = true)]
    pub replicates: u64,
    /// Candidates per generation of ga (default 100, as in the paper) or in the first generation of lshade; 10 to 1000000
    #[arg(long, value_name = "N", value_parser = whole(POPULATION_MIN, POPULATION_MAX), allow_negative_numbers = true)]
    pub population: Option<u64>,
    /// Limit of simulations per replicate, at least 100 [default: 300000; with --all 2000 per parameter]
    #[arg(long, value_name = "N", value_parser = whole(EVALUATIONS_MIN, EVALUATIONS_MAX), allow_negative_numbers = true)]
    pub max_evaluations: Option<u64>,
    /// Stop a replicate after this many generations without gain; at least 1
    #[arg(long, value_name = "N", default_value_t = Stop::default().max_stall,
          value_parser = whole(1, EVALUATIONS_MAX), allow_negative_numbers = true)]
    pub max_stall: u64,
    /// Stop a replicate after this many seconds; the result then depends on the machine
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub max_seconds: Option<Duration>,
    /// Stop a replicate at this score
    #[arg(long, value_name = "SCORE", value_parser = finite, allow_negative_numbers = true)]
    pub target: Option<f64>,
    /// Skip the confidence intervals of the parameters; saves several thousand simulations
    #[arg(long)]
    pub no_intervals: bool,
}

fn fixed(text: &str) -> Result<(String, f64), String> {
    let expected = || format!("expected NAME=VALUE such as tau_p=0.3, found `{text}`");
    let (name, value) = text.split_once('=').ok_or_else(expected)?;
    let value = finite(value).map_err(|_| expected())?;
    Ok((name.trim().to_owned(), value))
}

/// Longest time limit \[s\]: 30 years. A longer one is a mistake, and beyond 1.8e19 s it is no `Duration`.
const SECONDS_MAX: f64 = 1e9;

fn seconds(text: &str) -> Result<Duration, String> {
    let expected = || format!("expected a number of seconds of at least 0 and at most {SECONDS_MAX:e}, found `{text}`");
    let seconds = Some(finite(text)?).filter(|seconds| (0.0..=SECONDS_MAX).contains(seconds)).ok_or_else(expected)?;
    Ok(Duration::from_secs_f64(seconds))
}

impl Args {
    /// The variants with their extensions. Fails for several without --all, one twice, or an invalid extension.
    pub fn extended(&self) -> anyhow::Result<Vec<Variant>> {
        if let [_, another, ..] = self.models.as_slice()
            && !self.all
        {
            refuse!("--model {another}: one model is calibrated at a time, unless --all");
        }
        self.models.iter().map(|asked| extend(model(asked)?, &self.extend)).collect()
    }

    /// The measure to minimise, if there is one only.
    pub fn gof(&self) -> anyhow::Result<GoodnessOfFit> {
        match self.gofs.as_slice() {
            [gof] => Ok(*gof),
            all => refuse!("--gof {}: one measure is minimised at a time, unless --all", all[1]),
        }
    }

    /// The calibration by the flags, for one of the models. Fails if evaluator and precision contradict each other.
    pub fn calibration(&self, model: Variant) -> anyhow::Result<Calibration> {
        let mut calibration = Calibration::of_variant(model);
        calibration.bounds.clone_from(&self.bounds);
        calibration.fixed.clone_from(&self.fix);
        calibration.gof = self.gofs[0];
        calibration.convention = self.convention;
        calibration.search = self.settings()?;
        calibration.evaluations = self.search.max_evaluations;
        calibration.selection = self.evaluator.selection()?;
        calibration.intervals = !self.search.no_intervals;
        calibration.folds = self.folds;
        calibration.own.clone_from(&self.own);
        calibration.history_s = self.history;
        calibration.warn = warn;
        Ok(calibration)
    }

    /// Fails for an invalid population for the optimiser, or one that exceeds the limit of simulations.
    fn settings(&self) -> anyhow::Result<calibrate::Calibration> {
        let search = &self.search;
        let max_evaluations = search.max_evaluations.unwrap_or(Stop::default().max_evaluations);
        if let Some(size) = search.population {
            if !matches!(search.optimizer, OptimizerKind::Ga | OptimizerKind::Lshade) {
                refuse!(
                    "--population: auto and cmaes choose the size of a generation themselves; add --optimizer ga or lshade"
                );
            }
            if size > max_evaluations {
                refuse!(
                    "--population {size}: a generation has more candidates than --max-evaluations {max_evaluations} allows; raise that"
                );
            }
        }
        Ok(calibrate::Calibration {
            optimizer: search.optimizer,
            seed: search.seed,
            replicates: search.replicates,
            stop: Stop {
                max_evaluations,
                max_stall: search.max_stall,
                max_time: search.max_seconds,
                target: search.target,
            },
            population: search.population.map(|size| size as usize),
        })
    }
}
