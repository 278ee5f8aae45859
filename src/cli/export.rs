//! `leadlag export`: results for other programs.

use super::change::Change;
use super::fleet_row;
use super::folder::{finish, part, result_file, suffix};
use super::{Usage, output};
use crate::api::error::refuse;
use crate::api::fleet::are_implausible;
use crate::api::values::one_of;
use crate::report::text::wrapped;
use crate::result::ResultFile;
use crate::sumo::{self, Distribution, Drive, Export, Loss, Model, Motion, VehicleType};
use crate::trajectory::Source;
use anyhow::Context;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The vehicle type, and the mark of an export.
const TYPE: &str = "vtype.add.xml";
const LOSS: &str = "loss.json";
const FLEET: &str = super::folder::FLEET;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Write a vehicle type for SUMO, and run SUMO to measure the difference
    #[command(after_help = "Examples:
  leadlag export sumo fit
  leadlag export sumo fit --sumo /usr/share/sumo --json
  leadlag export sumo fit --no-run --out types")]
    Sumo(SumoArgs),
}

#[derive(Debug, clap::Args)]
struct SumoArgs {
    /// Folder that calibrate wrote with --out, or the result.json in it; for a fleet, all drivers with sound data become a
    /// vTypeDistribution
    #[arg(value_name = "RESULT")]
    result: PathBuf,
    /// Folder for vtype.add.xml, loss.json, comparison.csv and the files for SUMO [default: RESULT/sumo]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Model of SUMO [default: IDM for idm, ACC for l-cth and acc_milanes, KraussOrig1 for krauss, W99 for w99]
    #[arg(long, value_parser = one_of(&[
        ("idm", Model::Idm, "Intelligent driver model"),
        ("eidm", Model::Eidm, "Extended intelligent driver model: not the same equation"),
        ("acc", Model::Acc, "Adaptive cruise control after Milanes and Shladover"),
        ("krauss", Model::Krauss, "Krauss' model of 1998"),
        ("w99", Model::W99, "Wiedemann 99"),
    ]))]
    to: Option<Model>,
    /// The program sumo, or the folder it is installed in [default: SUMO_HOME, else on the path]
    #[arg(long, value_name = "PATH", conflicts_with = "no_run")]
    sumo: Option<PathBuf>,
    /// Only write the vehicle type; differences are listed but not measured
    #[arg(long)]
    no_run: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let Command::Sumo(args) = &args.command;
    let file = result_file(&args.result)?;
    if let Some(folder) = fleet_row::folder_of(&args.result).filter(|_| !file.is_file() || file.ends_with(FLEET)) {
        return fleet(args, &folder);
    }
    let result = ResultFile::read(&file)?;
    let mut vtype = sumo::export(&result.calibrated_variant()?, args.to).map_err(|error| Usage(error.to_string()))?;
    if let Some(data) = result.data.first() {
        vtype.mean_for(data.treatment.step_s);
    }
    let beside = file.parent().unwrap_or(Path::new("."));
    let folder = args.out.clone().unwrap_or_else(|| beside.join("sumo"));
    let measured = if args.no_run { None } else { Some(sumo::find(args.sumo.as_deref())?) };
    let mut change = Change::begin(&folder)?;
    let before = of_export(&folder);
    let place = folder.join(TYPE);
    let source = result.data.first().map_or("", |data| data.path.as_str());
    let about = format!("{}: variant {} calibrated on {source}", result.program, result.model());
    change.write(TYPE, vtype.to_xml("leadlag", &about).as_bytes())?;

    let mut losses = Vec::new();
    for (number, data) in result.data.iter().enumerate().take(if measured.is_some() { usize::MAX } else { 0 }) {
        let suffix = suffix(number, result.data.len());
        let drive =
            Drive::read(&beside.join(format!("simulation{suffix}.csv")), data.first_scored, data.treatment.step_s)?;
        let sumo = measured.as_ref().context("SUMO was found")?;
        let motion = sumo.follow(&vtype, &drive, &change.new_files(), &suffix)?;
        sumo::files(&suffix).iter().try_for_each(|name| change.take(name))?;
        change.write(&comparison(&suffix), &table(&drive, &motion)?)?;
        losses.push(sumo::compare(&drive, &motion));
    }
    let export = Export::new((&result, Source::of(&file)?.sha256), &vtype, &place, measured.as_ref(), losses);
    let written = serde_json::to_string_pretty(&export)? + "\n";
    change.write(LOSS, written.as_bytes())?;
    finish(change, &folder, before)?;
    if args.json {
        return output::print_json(&export);
    }
    output::print(&text(&result, &vtype, &export, &place))
}

/// The drivers of a fleet as types of one distribution; those with doubtful data are omitted and listed.
fn fleet(args: &SumoArgs, folder: &Path) -> anyhow::Result<()> {
    if args.sumo.is_some() {
        return Err(
            Usage("--sumo: leadlag runs SUMO behind the leader of one result, not for a fleet".to_owned()).into()
        );
    }
    let (doubtful, sound): (Vec<_>, Vec<_>) =
        fleet_row::of_all(folder)?.into_iter().partition(|(row, _)| are_implausible(&row.findings));
    let left_out: Vec<String> =
        doubtful.iter().map(|(row, _)| format!("{} ({})", row.label, row.findings.replace(' ', ", "))).collect();
    let Some((first, _)) = sound.first() else {
        let why = if left_out.is_empty() { "no driver has a result".to_owned() } else { left_out.join(", ") };
        refuse!("{}: expected a driver with sound data, found none: {why}", folder.display());
    };
    let (model, source) = (first.model.clone(), folder.display().to_string());
    let mut types = Vec::new();
    for (row, calibrated) in &sound {
        let mut vtype = sumo::export(calibrated, args.to).map_err(|error| Usage(error.to_string()))?;
        // Without the rounding error of a quotient.
        vtype.mean_for((row.step_s * 1e6).round() / 1e6);
        types.push((format!("leadlag_{}_{}", row.pair, part(&row.name)), vtype));
    }
    let of = Distribution { types };
    let out = args.out.clone().unwrap_or_else(|| folder.join("sumo"));
    let mut change = Change::begin(&out)?;
    let before = [of_export(&out), vec![LOSS.to_owned()]].concat();
    let about =
        format!("leadlag {}: {} drivers of {source}, variant {model}", env!("CARGO_PKG_VERSION"), of.types.len());
    change.write(TYPE, of.to_xml("leadlag", &about).as_bytes())?;
    finish(change, &out, before)?;
    let place = out.join(TYPE);
    if args.json {
        let entry = |(id, vtype): &(String, VehicleType)| {
            let attributes: BTreeMap<_, _> = vtype.attributes.iter().cloned().collect();
            serde_json::json!({"id": id, "attributes": attributes, "lost": vtype.lost, "added": vtype.added})
        };
        let types: Vec<_> = of.types.iter().map(entry).collect();
        return output::print_json(&serde_json::json!({
            "schema_version": 1, "file": place, "variant": model, "types": types, "left_out": left_out
        }));
    }
    let mut text =
        format!("{} drivers with {model} as vTypeDistribution leadlag of SUMO: {}\n", of.types.len(), place.display());
    for (what, sentence) in of.common() {
        text += &wrapped(2, 4, &format!("{what}: {sentence}"));
    }
    if !left_out.is_empty() {
        text +=
            &wrapped(2, 4, &format!("{} drivers left out for doubtful data: {}", left_out.len(), left_out.join(", ")));
    }
    output::print(
        &(text + "  the difference from leadlag was not measured: export the result of one driver for that\n"),
    )
}

fn comparison(suffix: &str) -> String {
    format!("comparison{suffix}.csv")
}

/// Writes the files of the drives of an export to a folder, if there is one.
fn of_export(folder: &Path) -> Vec<String> {
    let count = Export::read(&folder.join(LOSS)).ok().flatten().map_or(0, |export| export.loss.len());
    let of_drive = |number| {
        let suffix = suffix(number, count);
        sumo::files(&suffix).into_iter().chain([comparison(&suffix)])
    };
    (0..count).flat_map(of_drive).collect()
}

/// Both followers, sample by sample.
fn table(drive: &Drive, sumo: &Motion) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "time_s",
        "lead_speed_mps",
        "sim_spacing_m",
        "sim_speed_mps",
        "sim_accel_mps2",
        "sumo_spacing_m",
        "sumo_speed_mps",
        "sumo_accel_mps2",
    ])?;
    for (i, t) in drive.t.iter().enumerate() {
        let ours = &drive.simulated;
        let row = [*t, drive.v_l[i], ours.s[i], ours.v[i], ours.a[i], sumo.s[i], sumo.v[i], sumo.a[i]];
        writer.write_record(row.map(|x| x.to_string()))?;
    }
    Ok(writer.into_inner()?)
}

fn text(result: &ResultFile, vtype: &VehicleType, export: &Export, place: &Path) -> String {
    let mut text = format!("{} as {} of SUMO: {}\n", result.model(), vtype.model.into_str(), place.display());
    for (name, value) in &vtype.attributes {
        let _ = writeln!(text, "  {name:<28} {value}");
    }
    for (what, sentences) in [("not exported", &vtype.lost), ("besides", &vtype.added)] {
        for sentence in sentences {
            text += &wrapped(2, 4, &format!("{what}: {sentence}"));
        }
    }
    let Some(version) = &export.sumo else {
        text += "  the difference from leadlag was not measured (--no-run)\n";
        return text;
    };
    for (loss, data) in export.loss.iter().zip(&result.data) {
        let _ = writeln!(
            text,
            "\nSUMO {version} against leadlag behind the leader of {}, {} samples",
            data.path, loss.samples
        );
        let _ = writeln!(text, "  {:<16} {:>12} {:>12} {:>10}", "", "rms", "largest", "at [s]");
        let row = |name: &str, loss: &Loss| {
            format!("  {name:<16} {:>12.6} {:>12.6} {:>10.1}\n", loss.rms, loss.largest, loss.at_s)
        };
        text += &row("spacing [m]", &loss.spacing_m);
        text += &row("speed [m/s]", &loss.speed_mps);
        text += &row("accel. [m/s2]", &loss.accel_mps2);
        let _ = writeln!(
            text,
            "  NRMSE(s,v,a) against the measured car: leadlag {:.6}, SUMO {:.6}",
            loss.nrmse_sva, loss.sumo_nrmse_sva
        );
        if loss.collision {
            text += "  the follower in SUMO collided with its leader\n";
        }
    }
    text
}
