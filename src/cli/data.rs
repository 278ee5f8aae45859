//! From file names and flags to trajectories with vehicle and grade.

use super::Usage;
use anyhow::Context;
use clap::ValueEnum;
use leadlag::catalog::Variant;
use leadlag::trajectory::import::{ColumnMap, read_mapped};
use leadlag::trajectory::{Grade, Layout, Note, Preparation, Reconcile, Recording, Trajectory, import, prepare};
use leadlag::vehicle::{self, Vehicle};
use std::path::{Path, PathBuf};

/// How measured files are read and prepared.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Data")]
pub struct DataArgs {
    /// Layout: openacc, astazero-rebuilt, astazero-processed, ultra-av, pair [default: by the header]
    #[arg(long)]
    pub layout: Option<Layout>,
    /// Column map of a table of another layout: ngsim, highd, sumo-fcd (`leadlag list columns`), or a file of one's own
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout", value_parser = ColumnMap::find)]
    pub columns: Option<ColumnMap>,
    /// Trajectory id, in files that hold several
    #[arg(long, value_name = "ID")]
    pub trajectory: Option<String>,
    /// Segment between long gaps, from 1 [default: the longest]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    pub segment: Option<u32>,
    /// First time to use, in the file's own seconds
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Last time to use, in the file's own seconds
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub to: Option<f64>,
    /// Missing samples are interpolated over at most this many seconds; longer gaps split the file
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub max_gap: f64,
    /// Smooth as the paper's authors did: two Savitzky-Golay passes, 51 points, cubic
    #[arg(long)]
    pub smooth: bool,
    /// Resample to this time step, in seconds
    #[arg(long, value_name = "DT")]
    pub resample: Option<f64>,
    /// What the spacing is anchored to where measured gap and speeds contradict each other
    #[arg(long, value_enum, default_value_t = ReconcileArg::Gap)]
    pub reconcile: ReconcileArg,
    /// The follower: a built-in vehicle or FILE#NAME [default: by its name in the file]
    #[arg(long, value_name = "NAME|FILE#NAME")]
    pub vehicle: Option<String>,
    /// Grade table: X,Y of a closed track, or position_m,sin_grade of an open road; or `level`
    #[arg(long, value_name = "FILE|level")]
    pub grade: Option<String>,
    /// Length of the preceding vehicle in m [default: from the file, else unknown]
    #[arg(long, value_name = "M")]
    pub lead_length: Option<f64>,
    /// Position of the preceding vehicle on the grade table at the first row of the file, in m
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub lead_start: Option<f64>,
}

/// What the spacing is anchored to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ReconcileArg {
    /// The measured gap; the position of the preceding vehicle follows from it
    Gap,
    /// The integrated speed difference, from the first gap on
    Speeds,
}

/// A trajectory with its vehicle.
#[derive(Debug, Clone)]
pub struct Loaded {
    pub trajectory: Trajectory,
    /// The vehicle and how `--vehicle` finds it again.
    pub vehicle: Option<(Vehicle, String)>,
}

impl Loaded {
    pub fn vehicle(&self) -> Option<&Vehicle> {
        self.vehicle.as_ref().map(|(vehicle, _)| vehicle)
    }
}

impl DataArgs {
    /// Reads a file, and says which of its followers is meant: the number in a platoon, or the id of a vehicle in a table
    /// with a column map, of which only the pairs of that vehicle are kept.
    pub fn read(&self, path: &Path, follower: Option<&str>) -> anyhow::Result<(Recording, Option<usize>)> {
        let Some(map) = &self.columns else {
            let number = follower.map(|text| {
                text.parse().map_err(|_| {
                    let message = format!(
                        "--follower: expected a number, 1 right behind the platoon leader, found `{text}`; ids of \
                         vehicles go with --columns"
                    );
                    Usage(message)
                })
            });
            return Ok((import::read(path, self.layout)?, number.transpose()?));
        };
        let mut recording = read_mapped(path, map)?;
        match follower {
            Some(id) if recording.keep_follower(id) => {}
            Some(id) => {
                let message =
                    format!("--follower {id}: not a follower in {}; {}", path.display(), longest_pairs(&recording));
                return Err(Usage(message).into());
            }
            None if self.trajectory.is_none() && recording.platoons.len() > 1 => {
                let message = format!("--follower is needed: {}", longest_pairs(&recording));
                return Err(Usage(message).into());
            }
            None => {}
        }
        Ok((recording, Some(1)))
    }

    /// One follower of a recording, prepared for a variant; without a number, the only one.
    pub fn pick(&self, recording: &Recording, follower: Option<usize>, variant: &Variant) -> anyhow::Result<Loaded> {
        let follower = follower.map_or_else(|| only_follower(recording), Ok)?;
        let trajectory = self.choose(prepare(recording, follower, &self.preparation()?)?)?;
        // A table that lies beside the data by chance must not get in the way of a variant that needs no vehicle.
        let wanted = self.vehicle.is_some() || variant.needs_vehicle();
        let vehicle = if wanted { self.find_vehicle(&trajectory)? } else { None };
        Ok(Loaded { trajectory, vehicle })
    }

    fn preparation(&self) -> anyhow::Result<Preparation> {
        let grade = self.grade.as_deref().map(read_grade).transpose()?;
        Ok(Preparation {
            from: self.from,
            to: self.to,
            max_gap_s: self.max_gap,
            smooth: self.smooth,
            resample: self.resample,
            reconcile: match self.reconcile {
                ReconcileArg::Gap => Reconcile::Gap,
                ReconcileArg::Speeds => Reconcile::Speeds,
            },
            trajectory_id: self.trajectory.clone(),
            grade,
            lead_length: self.lead_length,
            lead_start_m: self.lead_start,
        })
    }

    /// The segment asked for, else the longest, which is said.
    fn choose(&self, mut segments: Vec<Trajectory>) -> anyhow::Result<Trajectory> {
        let count = segments.len();
        let index = match self.segment {
            Some(k) if k as usize <= count => k as usize - 1,
            Some(k) => return Err(Usage(format!("--segment {k}: there are {count}")).into()),
            None => {
                let longest = (0..count).max_by_key(|&i| (segments[i].len(), count - i));
                longest.context("no segment is long enough")?
            }
        };
        if count > 1 && self.segment.is_none() {
            let (number, samples) = (index + 1, segments[index].len());
            eprintln!(
                "warning: {count} pieces; using the longest, number {number} ({samples} samples); \
                 --segment or --trajectory choose another"
            );
        }
        let chosen = segments.swap_remove(index);
        if let Some(note) = chosen.notes.iter().find(|note| matches!(note, Note::UnitsContradict { .. })) {
            eprintln!("warning: {}: {note}", chosen.source.path);
        }
        Ok(chosen)
    }

    /// The vehicle: as told, else by its name in a table beside the data, else by its name in the built-in table.
    fn find_vehicle(&self, trajectory: &Trajectory) -> anyhow::Result<Option<(Vehicle, String)>> {
        if let Some(text) = &self.vehicle {
            return Ok(Some((vehicle::find(text)?, text.clone())));
        }
        let folder = Path::new(&trajectory.source.path).parent().unwrap_or(Path::new("."));
        let tables: [PathBuf; 2] = ["vehicles", "../vehicles"].map(|f| folder.join(f).join("vehicles.csv"));
        if let Some(table) = tables.iter().find(|t| t.exists()) {
            let found = vehicle::read_table(table)?.into_iter().find(|v| v.is_called(&trajectory.name));
            if let Some(vehicle) = found {
                let from = format!("{}#{}", table.display(), vehicle.slug);
                return Ok(Some((vehicle, from)));
            }
        }
        Ok(Vehicle::called(&trajectory.name).map(|v| (v.clone(), v.slug)))
    }
}

/// Some pairs of a mapped table are named in messages.
const PAIRS_NAMED: usize = 5;

fn longest_pairs(recording: &Recording) -> String {
    let name = |platoon: &leadlag::trajectory::Platoon| {
        let duration = platoon.t.last().unwrap_or(&0.0) - platoon.t.first().unwrap_or(&0.0);
        let follower = platoon.cars.last().map_or("", |car| car.name.as_str());
        format!("{follower} ({duration:.1} s)")
    };
    let named: Vec<String> = recording.platoons.iter().take(PAIRS_NAMED).map(name).collect();
    let path = &recording.source.path;
    format!(
        "it has {} pairs, first {}; `leadlag inspect {path} --columns ...` lists more",
        recording.platoons.len(),
        named.join(", ")
    )
}

/// A grade table, or `level`.
pub fn read_grade(text: &str) -> anyhow::Result<Grade> {
    if text == "level" {
        return Ok(Grade::level());
    }
    Ok(Grade::read_csv(Path::new(text))?)
}

/// The follower of a file that has only one.
pub fn only_follower(recording: &Recording) -> anyhow::Result<usize> {
    let mut cars = recording.platoons[0].cars.iter().filter(|c| c.number > 1);
    let followers: Vec<String> = cars.by_ref().map(|c| format!("{} = {}", c.number - 1, c.name)).collect();
    if followers.len() == 1 {
        return Ok(1);
    }
    let path = &recording.source.path;
    Err(Usage(format!("--follower is needed: {path} has the followers {}", followers.join(", "))).into())
}
