//! `leadlag demo`: the whole workflow on synthetic data, by the same commands that a user would type.
//!
//! `synthetic` makes the files; from then on the demo reads only these, until the last lines reveal the hidden effect.

mod drive;
mod tell;

pub use tell::quoted;

use super::folder::read;
use super::{Cli, output};
use crate::api::extension::extend;
use crate::diagnose::Verdict;
use crate::diagnose::drive::TRAINED_ON;
use crate::result::ResultFile;
use crate::result::diagnosis::Outcome;
use anyhow::Context;
use clap::Parser;
use drive::Hidden;
use std::path::PathBuf;

/// Largest number of simulations of a calibration in the demo: about half of what the optimiser would use, and enough for six parameters.
const EVALUATIONS: &str = "12000";
/// The base model to examine. The car follows it, plus the hidden effect.
const BASE: &str = "idm";
/// The file has no positions: the platoon leader starts at the beginning of the road table, even if a window of time is cut out.
const ROAD: [&str; 2] = ["--lead-start", "0"];

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag demo
  leadlag demo --hide headway_mode_change --seed 7
  leadlag demo --hide none
  leadlag synth --list-effects      (what can be hidden)")]
pub struct Args {
    /// Folder for all files of the demo
    #[arg(short, long, value_name = "DIR", default_value = "leadlag-demo")]
    out: PathBuf,
    /// Effect of the car that the base model lacks (see `leadlag synth --list-effects`), or none
    #[arg(long, value_name = "CAUSE[:P=V,...]|none", default_value = "grade")]
    hide: Hidden,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1, value_parser = crate::api::values::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Length of the drive in s; a short one shows less
    #[arg(long, value_name = "S", default_value_t = 600.0, value_parser = duration)]
    duration: f64,
}

fn duration(text: &str) -> Result<f64, String> {
    let good = text.parse().ok().filter(|s: &f64| (120.0..=7200.0).contains(s));
    good.ok_or_else(|| format!("expected 120 to 7200 s, found `{text}`"))
}

/// Files and settings of the demo.
struct Demo {
    folder: PathBuf,
    seed: String,
    follower: String,
    /// Last second of the training data; the rest is held back.
    cut: String,
}

/// Results.
struct Found {
    outcome: Outcome,
    /// NRMSE(s,v,a) of calibrated models on the held-back data: base, then extended.
    held_back: [Option<f64>; 2],
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    output::make_folder(&args.out)?;
    let follower = args.hide.follower();
    drive::write(args, follower)?;
    output::print(&tell::beginning(args, follower))?;
    // As in `diagnose`: no model is calibrated on the last third of the drive.
    let demo = Demo {
        folder: args.out.clone(),
        seed: args.seed.to_string(),
        follower: follower.to_string(),
        cut: (TRAINED_ON * args.duration).round().to_string(),
    };
    let found = demo.analyse()?;
    let page = demo.report()?;
    output::print(&tell::ending(&found, args.hide.effect(args.duration).as_ref(), &page))
}

impl Demo {
    fn path(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Runs `leadlag WORDS`, prints the command, and returns its output, which is also kept in LOG.
    fn command(&self, words: &[&str], log: Option<&str>) -> anyhow::Result<String> {
        let log = log.map(|log| self.folder.join(log));
        output::print(&tell::command(words, log.as_deref()))?;
        let cli = Cli::try_parse_from(std::iter::once("leadlag").chain(words.iter().copied()))
            .context("a command of the demo")?;
        let text = output::captured(|| super::nested(cli))?;
        if let Some(log) = log {
            output::write_file(&log, text.as_bytes())?;
        }
        Ok(text)
    }

    /// Reads only the files of the drive.
    fn analyse(&self) -> anyhow::Result<Found> {
        let platoon = self.path("platoon.csv");
        self.command(&["inspect", &platoon], Some("inspect.txt"))?;

        tell::step("1. Calibrate the base model on the first two thirds of the drive")?;
        let base = self.calibrate("base", &[])?;
        tell::line(&tell::calibrated(&base))?;

        tell::step("2. Diagnose the model")?;
        let (slope, folder) = (self.path("Slope.csv"), self.path("diagnosis"));
        let words = ["diagnose", "--data", &platoon, "--follower", &self.follower, "--grade", &slope];
        let more = ["--base", BASE, "--effort", "quick", "--seed", &self.seed, "--out", &folder];
        self.command(&[&words[..], &ROAD, &more].concat(), Some("diagnosis.txt"))?;
        let outcome: Outcome = read(&self.folder.join("diagnosis").join("diagnosis.json"), "a diagnosis")?;
        tell::line(&tell::verdict(&outcome))?;

        let mut held_back = [None; 2];
        let named = outcome.verdict == Verdict::Named;
        let causes: Vec<String> =
            outcome.causes.iter().filter(|_| named).map(|c| self.path(&format!("diagnosis/{}.wgsl", c.name))).collect();
        if !causes.is_empty() {
            tell::step("3. Add the named cause and calibrate on the same two thirds")?;
            let extended = self.calibrate("extended", &causes)?;
            tell::line(&tell::calibrated(&extended))?;
            tell::step("4. Compare both models on the last third, which was held back")?;
            for (score, (model, causes)) in held_back.iter_mut().zip([("base", &[][..]), ("extended", &causes)]) {
                *score = self.simulate(model, causes)?;
                tell::line(&tell::held_back(model, *score))?;
            }
        }
        Ok(Found { outcome, held_back })
    }

    /// Options for the position of a model on the road, if it needs one.
    fn road<'a>(&self, slope: &'a str, causes: &[String]) -> anyhow::Result<Vec<&'a str>> {
        let model = extend(BASE.parse()?, causes)?;
        let wanted = model.needs_position();
        Ok(if wanted { [&["--grade", slope][..], &ROAD].concat() } else { Vec::new() })
    }

    fn calibrate(&self, name: &str, causes: &[String]) -> anyhow::Result<ResultFile> {
        let (platoon, slope, out) = (self.path("platoon.csv"), self.path("Slope.csv"), self.path(name));
        let mut words = vec!["calibrate", &platoon, "--follower", &self.follower, "--model", BASE];
        words.extend(self.road(&slope, causes)?);
        causes.iter().for_each(|cause| words.extend(["--extend", cause]));
        words.extend(["--to", &self.cut, "--seed", &self.seed, "--max-evaluations", EVALUATIONS, "--out", &out]);
        self.command(&words, Some(&format!("{name}.txt")))?;
        Ok(ResultFile::read(&self.folder.join(name).join("result.json"))?)
    }

    /// NRMSE(s,v,a) on the held-back data; none if the run ends early.
    fn simulate(&self, name: &str, causes: &[String]) -> anyhow::Result<Option<f64>> {
        let (platoon, slope) = (self.path("platoon.csv"), self.path("Slope.csv"));
        let (result, out) = (self.path(&format!("{name}/result.json")), self.path(&format!("{name}_held_back")));
        let words = ["simulate", &platoon, "--follower", &self.follower, "--from", &self.cut];
        let more = ["--result", &result, "--out", &out, "--json"];
        let text = self.command(
            &[&words[..], &self.road(&slope, causes)?, &more].concat(),
            Some(&format!("{name}_held_back.json")),
        )?;
        let json: serde_json::Value = serde_json::from_str(&text)?;
        Ok(json["runs"][0]["score"]["nrmse_sva"].as_f64())
    }

    /// Writes the report; returns its path.
    fn report(&self) -> anyhow::Result<String> {
        tell::step("5. Write everything as one HTML file")?;
        let (diagnosis, page) = (self.path("diagnosis"), self.path("report.html"));
        self.command(&["report", &diagnosis, "-o", &page], None)?;
        Ok(page)
    }
}
