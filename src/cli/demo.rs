//! `leadlag demo`: the main job on data that the program makes itself, by the very commands that a user would type.

use super::{Cli, output};
use anyhow::Context;
use clap::Parser;
use leadlag::plant::{Controller, Truth};
use leadlag::report::result::ResultFile;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for everything that the demo makes
    #[arg(long, value_name = "DIR", default_value = "leadlag-demo")]
    out: PathBuf,
    /// The one seed of all random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// The first follower of the synthetic platoon is an IDM with a delay and a lag: this variant can be it exactly.
const VARIANT: &str = "idm+delay+linear";

pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = args.out.display().to_string();
    let (seed, platoon) = (args.seed.to_string(), format!("{folder}/platoon.csv"));
    let result = format!("{folder}/follower1");
    let commands: [(&str, Vec<&str>); 3] = [
        ("A synthetic platoon of five cars, with sensor noise:", vec!["synth", "--out", &folder, "--seed", &seed]),
        ("What the file contains:", vec!["inspect", &platoon]),
        (
            "Calibrate a variant against the first follower:",
            vec![
                "calibrate",
                &platoon,
                "--follower",
                "1",
                "--model",
                VARIANT,
                "--seed",
                &seed,
                "--max-evaluations",
                "30000",
                "--out",
                &result,
            ],
        ),
    ];
    for (what, words) in commands {
        output::print(&format!("\n== {what}\n$ leadlag {}\n", words.join(" ")))?;
        let cli = Cli::try_parse_from(std::iter::once("leadlag").chain(words)).context("a command of the demo")?;
        super::run(cli)?;
    }
    output::print(&comparison(args)?)
}

/// The calibrated parameters beside those that the platoon was made with.
fn comparison(args: &Args) -> anyhow::Result<String> {
    let truth_path = args.out.join("truth.json");
    let truth: Truth = serde_json::from_str(&std::fs::read_to_string(&truth_path)?)?;
    let found = ResultFile::read(&args.out.join("follower1").join("result.json"))?;
    let car = truth.scenario.followers.first().context("the synthetic platoon has followers")?;
    let mut text = "\n== What was found, beside what the car was made of:\n".to_owned();
    let mut known = vec![("tau_p", car.tau_p), ("tau_a", car.tau_a)];
    if let Controller::Idm { delta, v_0, d_0, t_h, a_max, a_min } = car.controller {
        let idm = [("delta", delta), ("v_0", v_0), ("d_0", d_0), ("t_h", t_h), ("a_max", a_max), ("a_min", a_min)];
        known.splice(0..0, idm);
    }
    writeln!(text, "{:<10}{:>10}{:>10}  unit", "parameter", "found", "truth")?;
    for (name, value) in known {
        let (x, unit) = (found.parameters.get(name), found.units.get(name));
        let (x, unit) = (x.copied().unwrap_or(f64::NAN), unit.map_or("", String::as_str));
        writeln!(text, "{name:<10}{x:>10.4}{value:>10.4}  {unit}")?;
    }
    let folder = args.out.join("follower1");
    writeln!(text, "\nLook at {}. With your own data:", folder.join("plot.svg").display())?;
    writeln!(text, "$ leadlag inspect FILE.csv")?;
    writeln!(text, "$ leadlag calibrate FILE.csv --follower 1 --model gipps+delay --out result")?;
    writeln!(text, "$ leadlag simulate OTHER.csv --follower 1 --result result/result.json --out check")?;
    Ok(text)
}
