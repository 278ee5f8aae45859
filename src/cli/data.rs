//! From file names and flags to trajectories with vehicle and grade.

use super::Usage;
use super::change::settle;
use super::number::{finite, real, whole};
use crate::catalog::{Constraint, Variant};
use crate::near::did_you_mean;
use crate::trajectory::import::{ColumnMap, MapError, read_mapped};
use crate::trajectory::{
    Grade, Layout, Note, Platoon, Preparation, PrepareError, Reconcile, Recording, Stretch, Trajectory, import,
    plausible, prepare, prepare_platoon,
};
use crate::vehicle::{self, Vehicle};
use anyhow::Context;
use clap::ValueEnum;
use std::path::{Path, PathBuf};

/// How measured files are read and prepared.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Data")]
pub struct DataArgs {
    /// Layout: openacc, astazero-rebuilt, astazero-processed, ultra-av, pair [default: by the header]
    #[arg(long)]
    pub layout: Option<Layout>,
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout", help = columns_help())]
    pub columns: Option<String>,
    /// Trajectory id, in files that hold several, or several ids with commas between them
    #[arg(long, value_name = "ID")]
    pub trajectory: Option<String>,
    /// Segment between long gaps, from 1, as `leadlag inspect` lists them [default: the longest]
    #[arg(long, value_name = "K", value_parser = whole(1, u32::MAX), allow_negative_numbers = true)]
    pub segment: Option<u32>,
    /// First time to use, in the file's own seconds
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Last time to use, in the file's own seconds
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    pub to: Option<f64>,
    /// Missing samples are interpolated over at most this many seconds; longer gaps split the file
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = real(Preparation::MAX_GAP_S, "s"),
          allow_negative_numbers = true)]
    pub max_gap: f64,
    /// Smooth as the paper's authors did: two Savitzky-Golay passes, 51 points, cubic
    #[arg(long)]
    pub smooth: bool,
    /// Resample to this time step, in seconds
    #[arg(long, value_name = "DT", value_parser = real(Preparation::RESAMPLE_S, "s"), allow_negative_numbers = true)]
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
    #[arg(long, value_name = "M", value_parser = real(Preparation::LEAD_LENGTH_M, "m"), allow_negative_numbers = true)]
    pub lead_length: Option<f64>,
    /// Position of the preceding vehicle on the grade table at the first row of the file, in m
    #[arg(long, value_name = "M", value_parser = real(Preparation::LEAD_START_M, "m"), allow_negative_numbers = true)]
    pub lead_start: Option<f64>,
}

/// What --columns takes.
pub fn columns_help() -> String {
    let shipped: Vec<&str> = ColumnMap::shipped().iter().map(|(name, _)| *name).collect();
    let shipped = shipped.join(", ");
    format!("Column map of a table of another layout: {shipped} (`leadlag list columns`), or a file of one's own")
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
    /// Which trajectory of its file it is, if that was asked for.
    pub id: Option<String>,
}

/// A pair that a file has, usable or not.
pub struct Found {
    pub id: Option<String>,
    pub follower: usize,
    pub name: String,
    pub drive: anyhow::Result<Loaded>,
    /// What is implausible in it.
    pub doubts: Vec<String>,
}

/// What is implausible in a trajectory, as its notes and its signals tell.
fn doubts(trajectory: &Trajectory, layout: Layout) -> Vec<String> {
    let is_bad = |note: &&Note| matches!(note, Note::UnitsContradict { .. } | Note::GapContradicts { .. });
    let notes = trajectory.notes.iter().filter(is_bad).map(ToString::to_string);
    notes.chain(plausible::of_trajectory(trajectory, layout)).collect()
}

impl Loaded {
    pub fn vehicle(&self) -> Option<&Vehicle> {
        self.vehicle.as_ref().map(|(vehicle, _)| vehicle)
    }

    /// That nobody says where on its grade table the drive begins, if it makes a difference.
    pub fn start_assumed(&self) -> Option<String> {
        let Trajectory { source, grade, notes, .. } = &self.trajectory;
        let grade = grade.as_ref().filter(|grade| grade.sin.windows(2).any(|pair| pair[0] != pair[1]))?;
        let assumed = |note: &Note| match note {
            Note::StartAssumed { position_m } => Some(*position_m),
            _ => None,
        };
        let position = notes.iter().find_map(assumed)?;
        let table = grade.source.as_ref().map_or("its grade table", |table| table.path.as_str());
        Some(format!(
            "{}: it has no positions, so the preceding vehicle is assumed to start at {position} m of {table}; if it does \
             not, the slopes are those of another place: --lead-start M tells where it starts",
            source.path
        ))
    }
}

impl DataArgs {
    /// Reads a file, and says which of its followers is meant: the number in a platoon, or the id of a vehicle in a table
    /// with a column map, of which only the pairs of that vehicle are kept.
    pub fn read(&self, path: &Path, follower: Option<&str>) -> anyhow::Result<(Recording, Option<usize>)> {
        let Some(map) = self.columns.as_deref().map(column_map).transpose()? else {
            let mut recording = import::read(path, self.layout)?;
            let number = follower.map(|text| numbered(&mut recording, text)).transpose()?;
            return Ok((recording, number));
        };
        let mut recording = read_mapped(path, &map.with_lead_length(self.lead_length))?;
        if recording.is_of_numbered_cars() {
            let number = follower.map(|text| numbered(&mut recording, text)).transpose()?;
            return Ok((recording, number));
        }
        match follower {
            Some(id) if recording.keep_follower(id) => {}
            Some(id) => {
                let message =
                    format!("--follower {id}: not a follower in {}; {}", path.display(), longest_pairs(&recording));
                return Err(Usage(message).into());
            }
            None if self.trajectory.is_none() && has_several_followers(&recording) => {
                let message = format!("--follower is needed: {}", longest_pairs(&recording));
                return Err(Usage(message).into());
            }
            None => {}
        }
        Ok((recording, Some(1)))
    }

    /// Every pair of a file, or every one that is asked for; `vehicle`: whether the follower's car has to be known. Of a pair that long gaps cut
    /// into segments, the longest one.
    pub fn pairs(&self, path: &Path, follower: Option<&str>, vehicle: Option<&Variant>) -> anyhow::Result<Vec<Found>> {
        let (mut recording, mut number) = match self.columns.as_deref().map(column_map).transpose()? {
            None => (import::read(path, self.layout)?, None),
            Some(map) => (read_mapped(path, &map.with_lead_length(self.lead_length))?, None),
        };
        if let Some(text) = follower
            && (self.columns.is_none() || recording.is_of_numbered_cars() || !recording.keep_follower(text))
        {
            number = Some(numbered(&mut recording, text)?);
        }
        let (ids, preparation) = (self.ids(&recording), self.preparation()?);
        if let Some(id) = ids.iter().find(|id| recording.platoons.iter().all(|platoon| platoon.id.as_ref() != Some(id)))
        {
            let shown = path.display();
            return Err(Usage(format!("--trajectory {id}: {shown} has no trajectory of this id")).into());
        }
        let is_wanted = |platoon: &&Platoon| ids.is_empty() || platoon.id.as_ref().is_some_and(|id| ids.contains(id));
        let mut pairs = Vec::new();
        for platoon in recording.platoons.iter().filter(is_wanted) {
            let followers = platoon.cars.windows(2).filter(|two| two[1].number == two[0].number + 1);
            for car in followers.map(|two| &two[1]).filter(|car| number.is_none_or(|n| car.number == n + 1)) {
                // The car ahead of the leader of a pair file is numbered 0.
                let Some(follower) = car.number.checked_sub(1).filter(|follower| *follower > 0) else { continue };
                let drive = self.drive_of(&recording, platoon, follower, &preparation, vehicle);
                let doubts =
                    drive.as_ref().map_or_else(|_| Vec::new(), |one| doubts(&one.trajectory, recording.layout));
                pairs.push(Found { id: platoon.id.clone(), follower, name: car.name.clone(), drive, doubts });
            }
        }
        Ok(pairs)
    }

    /// The longest segment of a follower, with his car.
    fn drive_of(
        &self,
        recording: &Recording,
        platoon: &Platoon,
        follower: usize,
        preparation: &Preparation,
        vehicle: Option<&Variant>,
    ) -> anyhow::Result<Loaded> {
        let segments = prepare_platoon(recording, platoon, follower, preparation)?;
        let longest = segments.into_iter().rev().max_by_key(Trajectory::len).context("no segment is long enough")?;
        let wanted = vehicle.map(|variant| (variant, self.find_vehicle(&longest, variant)));
        let vehicle = match wanted {
            None => None,
            Some((_, Ok(Some(found)))) => Some(found),
            Some((variant, Ok(None))) => {
                anyhow::bail!("variant {variant} needs the vehicle, and none is called `{}`", longest.name)
            }
            Some((_, Err(error))) => return Err(error),
        };
        Ok(Loaded { trajectory: longest, vehicle, id: platoon.id.clone() })
    }

    /// Every trajectory that is asked for, in that order; with `all` every one of the file that can be used, where none is.
    pub fn pick_all(
        &self,
        recording: &Recording,
        follower: Option<usize>,
        variant: &Variant,
        all: bool,
    ) -> anyhow::Result<Vec<Loaded>> {
        let ids = self.ids(recording);
        if !ids.is_empty() {
            return ids.iter().map(|id| self.pick_one(recording, follower, variant, Some(id))).collect();
        }
        if !all || recording.platoons.len() < 2 {
            return Ok(vec![self.pick_one(recording, follower, variant, None)?]);
        }
        let (mut picked, mut left_out) = (Vec::new(), Vec::new());
        for id in recording.platoons.iter().filter_map(|platoon| platoon.id.as_deref()) {
            match self.pick_one(recording, follower, variant, Some(id)) {
                Ok(loaded) => picked.push(loaded),
                Err(error) if is_of_one(&error) => left_out.push((id, error)),
                Err(error) => return Err(error),
            }
        }
        let path = &recording.source.path;
        match left_out.into_iter().next() {
            Some((_, error)) if picked.is_empty() => return Err(error),
            Some((id, error)) => eprintln!(
                "warning: {path}: {} of {} trajectories cannot be used; the first of them is {id}: {error}",
                recording.platoons.len() - picked.len(),
                recording.platoons.len()
            ),
            None => {}
        }
        let mut names: Vec<&str> = picked.iter().map(|loaded| loaded.trajectory.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        if let [one, another, ..] = names.as_slice() {
            eprintln!(
                "warning: {path}: the trajectories are those of {} vehicles, such as {one} and {another}, which get the same \
                 parameters; --follower NAME takes those of one",
                names.len()
            );
        }
        Ok(picked)
    }

    /// The ids that are asked for: one of the file as it stands, or several between commas.
    pub fn ids(&self, recording: &Recording) -> Vec<String> {
        let Some(given) = &self.trajectory else { return Vec::new() };
        if recording.platoons.iter().any(|platoon| platoon.id.as_ref() == Some(given)) {
            return vec![given.clone()];
        }
        given.split(',').map(|id| id.trim().to_owned()).collect()
    }

    /// One follower of the trajectory of an id, prepared for a variant; without an id of the longest one, without a number the only one.
    pub fn pick_one(
        &self,
        recording: &Recording,
        follower: Option<usize>,
        variant: &Variant,
        id: Option<&str>,
    ) -> anyhow::Result<Loaded> {
        let follower = follower.map_or_else(|| only_follower(recording), Ok)?;
        let preparation = Preparation { trajectory_id: id.map(str::to_owned), ..self.preparation()? };
        let trajectory = self.choose(prepare(recording, follower, &preparation)?)?;
        let platoon = recording.platoons.iter().find(|platoon| id.is_none() || platoon.id.as_deref() == id);
        let said = platoon.and_then(|platoon| plausible::of_time(&platoon.t)).into_iter();
        for warning in said.chain(plausible::of_trajectory(&trajectory, recording.layout)) {
            eprintln!("warning: {}: {warning}", recording.source.path);
        }
        // A table that lies beside the data by chance must not get in the way of a variant that needs no vehicle.
        let wanted = self.vehicle.is_some() || variant.needs_vehicle();
        let vehicle = if wanted { self.find_vehicle(&trajectory, variant)? } else { None };
        if vehicle.is_none() && variant.needs_vehicle() {
            let Trajectory { source, name, .. } = &trajectory;
            let message = format!(
                "{}: variant {variant} needs the vehicle of follower {follower}, and none is called `{name}`; give --vehicle \
                 NAME or FILE#NAME (`leadlag list vehicles`)",
                source.path
            );
            return Err(Usage(message).into());
        }
        Ok(Loaded { trajectory, vehicle, id: id.map(str::to_owned) })
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
            trajectory_id: None,
            grade,
            lead_length: self.lead_length,
            lead_start_m: self.lead_start,
        })
    }

    /// The segment asked for, else the longest, which is said.
    fn choose(&self, mut segments: Vec<Trajectory>) -> anyhow::Result<Trajectory> {
        let stretches = Stretch::of_trajectories(&segments);
        let count = segments.len();
        let first = segments.first().context("no segment is long enough")?;
        let (path, listed) = (&first.source.path, Stretch::listed(&stretches));
        let index = match self.segment {
            Some(k) if k as usize <= count => k as usize - 1,
            Some(k) => {
                let are =
                    if count == 1 { "there is 1 segment".to_owned() } else { format!("there are {count} segments") };
                return Err(Usage(format!("--segment {k}: {path}: {are}: {listed}")).into());
            }
            None => {
                let (longest, _) = Stretch::longest(&stretches);
                longest[0].number - 1
            }
        };
        if count > 1 && self.segment.is_none() {
            eprintln!(
                "warning: {path}: {count} segments, of which only the longest, number {}, is used; the longest are {listed}; \
                 --segment or --trajectory choose another, a longer --max-gap interpolates more",
                index + 1
            );
        }
        let chosen = segments.swap_remove(index);
        let is_bad = |note: &&Note| matches!(note, Note::UnitsContradict { .. } | Note::GapContradicts { .. });
        for note in chosen.notes.iter().filter(is_bad) {
            eprintln!("warning: {}: {note}", chosen.source.path);
        }
        Ok(chosen)
    }

    /// The vehicle: as told, else by its name in a table beside the data, else by its name in the built-in table.
    fn find_vehicle(&self, trajectory: &Trajectory, variant: &Variant) -> anyhow::Result<Option<(Vehicle, String)>> {
        let needs_curve = variant.constraint == Constraint::Mfc;
        if let Some(text) = &self.vehicle {
            return Ok(Some((vehicle::find_for(text, needs_curve)?, text.clone())));
        }
        let folder = Path::new(&trajectory.source.path).parent().unwrap_or(Path::new("."));
        let tables: [PathBuf; 2] = ["vehicles", "../vehicles"].map(|f| folder.join(f).join("vehicles.csv"));
        if let Some(table) = tables.iter().find(|t| t.exists())
            && let Some(vehicle) = vehicle::find_in(table, &trajectory.name, needs_curve)?
        {
            let from = format!("{}#{}", table.display(), vehicle.slug);
            return Ok(Some((vehicle, from)));
        }
        Ok(Vehicle::called(&trajectory.name).map(|v| (v.clone(), v.slug)))
    }
}

/// True if it has to be said which follower is meant.
fn has_several_followers(recording: &Recording) -> bool {
    let mut names = recording.platoons.iter().filter_map(|platoon| platoon.cars.last().map(|car| &car.name));
    let first = names.next();
    names.any(|name| Some(name) != first)
}

/// True if an error is that of one trajectory, and says nothing of the others.
fn is_of_one(error: &anyhow::Error) -> bool {
    let of_one = |error: &PrepareError| {
        matches!(
            error,
            PrepareError::TooShort { .. }
                | PrepareError::Short { .. }
                | PrepareError::EmptyWindow { .. }
                | PrepareError::Faulty { .. }
        )
    };
    error.downcast_ref().is_some_and(of_one)
}

/// The follower of a name or number. Of a name, only the platoons in which that car follows are kept.
fn numbered(recording: &mut Recording, given: &str) -> anyhow::Result<usize> {
    if let Ok(number) = given.parse() {
        return Ok(number);
    }
    if let Some(number) = recording.keep_car(given) {
        return Ok(number);
    }
    let mut names: Vec<&str> = Vec::new();
    for car in recording.platoons.iter().flat_map(|platoon| &platoon.cars).filter(|car| car.number > 1) {
        if !names.contains(&car.name.as_str()) {
            names.push(&car.name);
        }
    }
    let near = did_you_mean(given, names.iter().copied());
    names.truncate(PAIRS_NAMED);
    let message = format!(
        "--follower: expected a number, 1 right behind the platoon leader, or the name of a car that follows, found `{given}`; \
         {} has {}{near}; ids of vehicles go with --columns",
        recording.source.path,
        names.join(", ")
    );
    Err(Usage(message).into())
}

/// The column map of a flag. That its file is not there is a failure; what else is wrong with it is usage.
pub fn column_map(given: &str) -> anyhow::Result<ColumnMap> {
    ColumnMap::find(given).map_err(|error| match error {
        MapError::Open { .. } => error.into(),
        error => Usage(format!("--columns: {error}")).into(),
    })
}

/// The result of a calibration by its file, or by the folder that `calibrate` wrote it to.
pub fn result_file(given: &Path) -> anyhow::Result<PathBuf> {
    let file = if given.is_dir() { given.join("result.json") } else { given.to_owned() };
    file.parent().map_or(Ok(()), settle)?;
    Ok(file)
}

/// Some pairs of a mapped table are named in messages.
const PAIRS_NAMED: usize = 5;

fn longest_pairs(recording: &Recording) -> String {
    let name = |platoon: &crate::trajectory::Platoon| {
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
