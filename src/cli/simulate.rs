//! `leadlag simulate`: a calibrated variant on a trajectory, or a platoon in which each simulated car leads the next.

use super::data::{DataArgs, Loaded};
use super::{Usage, output};
use anyhow::Context;
use leadlag::evaluator::{Case, Outcome};
use leadlag::reference::{Reference, Trace};
use leadlag::report::result::ResultFile;
use leadlag::report::{plot, simulation};
use leadlag::score::{Measures, Signal};
use leadlag::simulate::follow;
use serde_json::json;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measured file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// result.json of `leadlag calibrate`; with --platoon one for all followers, or one per follower in order
    #[arg(long, required = true, value_name = "RESULT.json")]
    result: Vec<PathBuf>,
    /// The follower: 1 is right behind the platoon leader [default: the only one]
    #[arg(long, value_name = "N", conflicts_with = "platoon")]
    follower: Option<usize>,
    /// Simulate all followers, each behind the simulated car ahead
    #[arg(long)]
    platoon: bool,
    /// Folder for simulation.csv and plot.svg (numbered by follower with --platoon)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    data: DataArgs,
}

/// One simulated follower.
struct Simulated {
    loaded: Loaded,
    case: Case,
    variant: String,
    trace: Trace,
    outcome: Outcome,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut calibrated = Vec::new();
    for path in &args.result {
        let file = ResultFile::read(path)?;
        let context = || format!("{}: cannot be simulated", path.display());
        calibrated.push((file.vehicle.clone(), file.calibrated_variant().with_context(context)?));
    }
    let recording = args.data.read(&args.file)?;
    let followers: Vec<Option<usize>> = if args.platoon {
        recording.platoons[0].cars.iter().filter(|c| c.number > 1).map(|c| Some(c.number - 1)).collect()
    } else {
        vec![args.follower]
    };
    if calibrated.len() != 1 && calibrated.len() != followers.len() {
        let message = format!("--result: {} given, expected 1 or {}", calibrated.len(), followers.len());
        return Err(Usage(message).into());
    }
    let mut done: Vec<Simulated> = Vec::new();
    for (i, follower) in followers.into_iter().enumerate() {
        let (vehicle, model) = &calibrated[i.min(calibrated.len() - 1)];
        let mut data = args.data.clone();
        // The car that was calibrated, unless the flags name another one.
        data.vehicle = data.vehicle.or(vehicle.as_ref().map(|v| v.from.clone()));
        let loaded = data.pick(&recording, follower)?;
        let mut case =
            Case::new(&loaded.trajectory, model.variant, loaded.vehicle(), model.convention, model.tau_p_upper)?;
        if let Some(ahead) = done.last() {
            if ahead.outcome.result.is_err() {
                eprintln!("warning: the platoon ends here, for the car ahead did not get to the end of its run");
                break;
            }
            case = follow(&case, &ahead.case, &ahead.trace)?;
        }
        case.check(&model.parameters)?;
        let mut trace = Trace::default();
        let outcome = Reference::outcome(&case, &model.parameters, &mut trace);
        done.push(Simulated { loaded, case, variant: model.variant.name(), trace, outcome });
    }
    write(args, &done)?;
    if args.json { output::print_json(&json(&done)) } else { output::print(&text(&done)) }
}

fn write(args: &Args, done: &[Simulated]) -> anyhow::Result<()> {
    let Some(folder) = &args.out else { return Ok(()) };
    output::make_folder(folder)?;
    for one in done {
        let trajectory = &one.loaded.trajectory;
        let suffix = if args.platoon { format!("_follower{}", trajectory.follower) } else { String::new() };
        let mut csv = Vec::new();
        simulation::write_csv(&mut csv, &trajectory.t, &one.case, &one.trace)?;
        output::write_file(&folder.join(format!("simulation{suffix}.csv")), &csv)?;
        let title = format!("{}, {}: variant {}", one.case.label, trajectory.name, one.variant);
        let svg = plot::draw(&title, &trajectory.t, &one.case, &one.trace, one.outcome.result.ok().as_ref())?;
        output::write_file(&folder.join(format!("plot{suffix}.svg")), svg.as_bytes())?;
    }
    Ok(())
}

fn text(done: &[Simulated]) -> String {
    let mut text = String::new();
    for one in done {
        let trajectory = &one.loaded.trajectory;
        let _ = writeln!(text, "{}, {}: variant {}", one.case.label, trajectory.name, one.variant);
        let _ = match one.outcome.result {
            Ok(m) => {
                let nrmse = |signal| m.signal(signal).nrmse;
                let (s, v, a) = (nrmse(Signal::Spacing), nrmse(Signal::Speed), nrmse(Signal::Acceleration));
                writeln!(text, "  NRMSE(s,v,a) {:.6} = s {s:.6} + v {v:.6} + a {a:.6}", s + v + a)
            }
            Err(failure) => {
                let t = trajectory.t.get(failure.step).copied().unwrap_or(f64::NAN);
                let kind = failure.kind.name();
                writeln!(text, "  ended early at sample {} ({t:.1} s): {kind}", failure.step)
            }
        };
    }
    text
}

fn json(done: &[Simulated]) -> serde_json::Value {
    let one = |s: &Simulated| {
        let measures: Option<serde_json::Map<String, serde_json::Value>> = s.outcome.result.ok().map(|m| {
            let values = m.values().map(|x| Some(x).filter(|x| x.is_finite()));
            Measures::NAMES.iter().zip(values).map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
        });
        let failure = s.outcome.result.err();
        let source = &s.loaded.trajectory.source;
        json!({
            "path": source.path, "sha256": source.sha256, "follower": s.loaded.trajectory.follower,
            "variant": s.variant, "success": failure.is_none(),
            "fail_reason": failure.map(|f| f.kind.name()), "fail_step": failure.map(|f| f.step),
            "score": measures, "evaluator": "reference", "precision": "f64",
        })
    };
    json!({"schema_version": 1, "runs": done.iter().map(one).collect::<Vec<_>>()})
}
