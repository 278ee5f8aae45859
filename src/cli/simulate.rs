//! `leadlag simulate`: a calibrated variant on a trajectory, or a platoon in which each simulated car leads the next.

use super::change::Change;
use super::evaluator::warn;
use super::folder::result_file;
use super::{fleet_row, folder, output};
use crate::api::error::refuse;
use crate::api::loading::{Input, Loaded, start_assumed};
use crate::api::reading::Reading;
use crate::evaluator::{Case, Outcome};
use crate::reference::Trace;
use crate::report::text::wrapped;
use crate::report::{plot, simulation};
use crate::rescore;
use crate::result::{ResultFile, VehicleEntry, diagnosis};
use crate::score::{GoodnessOfFit, Measures, Signal};
use crate::simulate::{Ahead, CalibratedVariant, far_above_in, follow};
use crate::trajectory::{Recording, Treatment};
use anyhow::Context;
use serde_json::json;
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measured file
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Folder that calibrate wrote with --out, or the result.json in it; or that of a diagnosis, for its recommended model; with --platoon one for all followers, or one per
    /// follower in order. Of a folder of calibrate --all, or its parameters.csv, the row of the driver that --follower or --trajectory names
    #[arg(long, required = true, value_name = "RESULT")]
    result: Vec<PathBuf>,
    /// Position of the follower (1 is directly behind the platoon leader); with --columns, a vehicle id [default: the only one]
    #[arg(long, value_name = "N|ID", conflicts_with = "platoon", allow_negative_numbers = true)]
    follower: Option<String>,
    /// Simulate all followers, each behind the simulated car ahead
    #[arg(long, conflicts_with = "columns")]
    platoon: bool,
    /// Folder for simulation.csv and plot.svg (named by follower with --platoon, by id with several of --trajectory); not that of a
    /// calibration or diagnosis
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Draw spacing and speed as text
    #[arg(long, conflicts_with = "json")]
    plot: bool,
    #[command(flatten)]
    data: Reading,
}

/// A calibrated variant with the vehicle and data of its file.
struct Calibrated {
    path: PathBuf,
    vehicle: Option<VehicleEntry>,
    /// The value of `--vehicle` of the calibration.
    vehicle_from: Option<String>,
    treatment: Option<Treatment>,
    variant: CalibratedVariant,
}

/// One simulated follower.
struct Simulated {
    loaded: Loaded,
    /// True if the car ahead is simulated.
    follows: bool,
    case: Case,
    trace: Trace,
    outcome: Outcome,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(out) = &args.out {
        // Its simulation.csv is that of the calibrated drive.
        let own = args.file.file_stem().unwrap_or_default().to_string_lossy();
        folder::refuse(out, folder::RESULT, &own)?;
        folder::refuse(out, folder::DIAGNOSIS, &own)?;
        folder::spare(out, [&args.file], |name| {
            let several = ["simulation_follower", "simulation_trajectory"];
            folder::is_of(name, "simulation", "csv") || several.iter().any(|start| name.starts_with(start))
        })?;
    }
    let reading = &args.data;
    let (recording, follower) = reading.read(Input::File(&args.file), args.follower.as_deref())?;
    let followers = if args.platoon { followers(&recording) } else { vec![follower] };
    let ids = reading.ids(&recording);
    let driver = args.follower.as_deref().or(args.data.trajectory.as_deref());
    // Each driver of a fleet has a separate row.
    let drivers = match (ids.as_slice(), args.result.as_slice()) {
        ([_, _, ..], [fleet]) if fleet_row::folder_of(fleet).is_some() => {
            ids.iter().map(|id| (fleet, Some(id.as_str()))).collect()
        }
        (_, results) => results.iter().map(|path| (path, driver)).collect::<Vec<_>>(),
    };
    let calibrated =
        drivers.into_iter().map(|(path, driver)| read(args, path, driver)).collect::<anyhow::Result<Vec<_>>>()?;
    let runs: Vec<(Option<usize>, Option<&str>)> = match (args.platoon, ids.as_slice()) {
        (true, [_, _, ..]) => {
            refuse!("--platoon simulates one trajectory; expected one id in --trajectory");
        }
        (_, []) => followers.iter().map(|follower| (*follower, None)).collect(),
        (_, ids) => followers.iter().flat_map(|f| ids.iter().map(|id| (*f, Some(id.as_str())))).collect(),
    };
    if args.result.len() != 1 && args.result.len() != followers.len() {
        let one_each = match (args.platoon, followers.len()) {
            (false, _) => "one, because only one follower is simulated; --platoon simulates all".to_owned(),
            (true, 1) => format!("one, because {} has 1 follower", args.file.display()),
            (true, n) => format!("one for all, or one for each of the {n} followers of {}", args.file.display()),
        };
        refuse!("--result is given {} times; expected {one_each}", args.result.len());
    }
    let mut done: Vec<Simulated> = Vec::new();
    for (i, run) in runs.into_iter().enumerate() {
        let model = &calibrated[i.min(calibrated.len() - 1)];
        let loaded = load(args, model, &recording, run)?;
        let parameters = &model.variant.parameters;
        let mut case = model.variant.case(&loaded.trajectory, loaded.vehicle())?;
        // Behind the simulated car ahead, if it was simulated.
        let number = loaded.trajectory.follower;
        let ahead = done.last().filter(|car| car.loaded.trajectory.follower + 1 == number);
        let follows = ahead.is_some();
        if let Some(ahead) = ahead {
            if ahead.outcome.result.is_err() {
                eprintln!("warning: the platoon ends here because the simulation of the car ahead ended early");
                break;
            }
            let leads = Ahead { case: &ahead.case, t: &ahead.loaded.trajectory.t, trace: &ahead.trace };
            case = follow(&case, &loaded.trajectory.t, leads)?;
        }
        case.check(parameters)?;
        far_above_in(&case, parameters).iter().for_each(|text| warn(text));
        let mut trace = Trace::default();
        let outcome = rescore::outcome(&case, parameters, &mut trace)?;
        done.push(Simulated { loaded, follows, case, trace, outcome });
    }
    write(args, &done)?;
    if args.json {
        return output::print_json(&json(&done));
    }
    output::print(&text(&done))?;
    for Simulated { loaded, case, trace, .. } in done.iter().filter(|_| args.plot) {
        let measured = [case.s.to_vec(), case.v_f.to_vec()];
        let lines = [("measured", measured), ("simulated", [trace.s.clone(), trace.v.clone()])];
        super::plot::print(&case.label, &loaded.trajectory.t, &lines)?;
    }
    Ok(())
}

/// The calibrated model; for a fleet, of one driver.
fn read(args: &Args, given: &Path, driver: Option<&str>) -> anyhow::Result<Calibrated> {
    if let Some(folder) = fleet_row::folder_of(given) {
        if args.platoon {
            refuse!(
                "--platoon: {} is a fleet; expected the result of one calibration, or one for each follower",
                given.display()
            );
        }
        let (file, variant) = fleet_row::of_driver(&folder, driver, &args.file)?;
        let (path, vehicle_from, treatment) = (folder.join(folder::FLEET), file.vehicle, file.treatment);
        return Ok(Calibrated { path, vehicle: None, vehicle_from, treatment, variant });
    }
    if let Some(path) = folder::diagnosis_file(given) {
        let outcome: diagnosis::Outcome = folder::read(&path, "a diagnosis")?;
        let variant =
            outcome.recommended_model().with_context(|| format!("{}: cannot be simulated", path.display()))?;
        let Some(variant) = variant else {
            refuse!("--result {}: this diagnosis recommends no model", given.display());
        };
        return Ok(Calibrated { path, vehicle: None, vehicle_from: None, treatment: None, variant });
    }
    let path = result_file(given)?;
    let file = ResultFile::read(&path)?;
    let variant = file.calibrated_variant().with_context(|| format!("{}: cannot be simulated", path.display()))?;
    let treatment = file.data.into_iter().next().map(|data| data.treatment);
    let vehicle_from = file.vehicle.as_ref().map(|vehicle| vehicle.from.clone());
    Ok(Calibrated { path, vehicle: file.vehicle, vehicle_from, treatment, variant })
}

/// The followers whose car ahead is in the file, too.
fn followers(recording: &Recording) -> Vec<Option<usize>> {
    let cars = &recording.platoons[0].cars;
    let pairs = cars.windows(2).filter(|pair| pair[0].number > 0 && pair[1].number == pair[0].number + 1);
    pairs.map(|pair| Some(pair[0].number)).collect()
}

/// The follower with the vehicle that was calibrated, unless the flags name another one. Prints differences from the
/// calibration.
fn load(
    args: &Args,
    model: &Calibrated,
    recording: &Recording,
    (follower, id): (Option<usize>, Option<&str>),
) -> anyhow::Result<Loaded> {
    let mut reading = args.data.clone();
    let entry = model.vehicle.as_ref().filter(|_| reading.vehicle.is_none());
    reading.vehicle = reading.vehicle.or(model.vehicle_from.as_deref().map(|from| beside(from, &model.path)));
    let variant = &model.variant.variant;
    let loaded = reading.pick_one(recording, follower, variant, id, &mut |text| warn(&text))?;
    start_assumed(&loaded.trajectory).filter(|_| variant.needs_position()).iter().for_each(|text| warn(text));
    let path = model.path.display();
    if let (Some(then), Some(now)) = (entry, loaded.vehicle())
        && (then.m_0, then.phi_f) != (now.m_0, now.phi_f)
    {
        eprintln!(
            "warning: {path} was calibrated with m_0 = {} kg, phi_f = {}; {} now has {} kg, {}",
            then.m_0, then.phi_f, now.slug, now.m_0, now.phi_f
        );
    }
    let now = Treatment::of(&loaded.trajectory);
    if let Some(told) = model.treatment.as_ref().and_then(|then| then.differs(&now)) {
        eprintln!("warning: {path} was {told}");
    }
    Ok(loaded)
}

/// A vehicle file that exists relative to the folder of the result file, but not relative to the current one.
pub fn beside(vehicle: &str, result: &Path) -> String {
    let Some((table, name)) = vehicle.rsplit_once('#') else { return vehicle.to_owned() };
    let there = result.parent().unwrap_or(Path::new(".")).join(table);
    if !Path::new(table).exists() && there.exists() {
        format!("{}#{name}", there.display())
    } else {
        vehicle.to_owned()
    }
}

fn write(args: &Args, done: &[Simulated]) -> anyhow::Result<()> {
    let Some(folder) = &args.out else { return Ok(()) };
    let mut change = Change::begin(folder)?;
    for one in done {
        let trajectory = &one.loaded.trajectory;
        let suffix = match (args.platoon, &trajectory.id) {
            (true, _) => format!("_follower{}", trajectory.follower),
            (false, Some(id)) if done.len() > 1 => format!("_trajectory{}", folder::part(id)),
            (false, _) => String::new(),
        };
        let mut csv = Vec::new();
        simulation::write_csv(&mut csv, &trajectory.t, &one.case, &one.trace)?;
        change.write(&format!("simulation{suffix}.csv"), &csv)?;
        let title = format!("{}, {}: variant {}", one.case.label, trajectory.name, one.case.variant);
        let ahead = if one.follows { "preceding vehicle (simulated)" } else { plot::AHEAD };
        let svg = plot::draw(&title, ahead, &trajectory.t, &one.case, &one.trace, &one.outcome)?;
        change.write(&format!("plot{suffix}.svg"), svg.as_bytes())?;
    }
    change.finish(Vec::new()).map(drop)
}

fn text(done: &[Simulated]) -> String {
    let mut text = String::new();
    for one in done {
        let trajectory = &one.loaded.trajectory;
        let Case { label, variant, convention, .. } = &one.case;
        let line = format!("{label}, {}: variant {variant}, convention {convention}", trajectory.name);
        text += &wrapped(0, 2, &line);
        text += &wrapped(2, 4, &format!("{} sha256 {}", trajectory.source.path, &trajectory.source.sha256[..16]));
        for note in trajectory.preparation() {
            text += &wrapped(2, 4, &note.to_string());
        }
        let _ = match one.outcome.result {
            Ok(m) => {
                let nrmse = |signal| number(m.signal(signal).nrmse);
                let (s, v, a) = (nrmse(Signal::Spacing), nrmse(Signal::Speed), nrmse(Signal::Acceleration));
                let sum = number(GoodnessOfFit::NRMSE_SVA.of(&m));
                writeln!(
                    text,
                    "  NRMSE(s,v,a) {sum} = s {s} + v {v} + a {a}\n  evaluator {} (f64)",
                    rescore::evaluator(variant)
                )
            }
            Err(failure) => {
                let t = trajectory.t.get(failure.step).copied().unwrap_or(f64::NAN);
                let kind = failure.kind;
                writeln!(text, "  ended early at sample {} ({t:.1} s): {kind}", failure.step)
            }
        };
    }
    text
}

/// A measure, or a note that it is undefined (for a signal that is zero throughout).
fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:.6}") } else { "undefined".to_owned() }
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
            "path": source.path, "sha256": source.sha256, "follower": s.loaded.trajectory.follower, "trajectory": s.loaded.trajectory.id,
            "variant": s.case.variant.name(), "convention": s.case.convention.to_string(),
            "preparation": s.loaded.trajectory.preparation().map(ToString::to_string).collect::<Vec<_>>(),
            "findings": s.loaded.trajectory.findings().collect::<Vec<_>>(), "success": failure.is_none(),
            "fail_reason": failure.map(|f| f.kind.into_str()), "fail_step": failure.map(|f| f.step),
            "score": measures, "evaluator": rescore::evaluator(&s.case.variant), "precision": "f64",
        })
    };
    json!({"schema_version": 1, "runs": done.iter().map(one).collect::<Vec<_>>()})
}
