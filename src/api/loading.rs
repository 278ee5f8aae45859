//! From files, or tables in memory, to trajectories with vehicle and grade, as the options of [`Reading`] say.

use super::error::{Usage, refuse};
use super::reading::Reading;
use crate::catalog::{Constraint, Variant};
use crate::text::option::{COLUMNS, CORRECT, FOLLOWER, FROM, LEAD_START, MAX_GAP, SEGMENT, TO, TRAJECTORY, VEHICLE};
use crate::text::shown::{NAMED, counted};
use crate::text::spelling::did_you_mean;
use crate::trajectory::import::{ColumnMap, MapError, read_mapped, read_mapped_from};
use crate::trajectory::{
    Car, ChosenBy, Finding, Grade, Note, Platoon, Preparation, Recording, Stretch, Trajectory, import, prepare,
    prepare_platoon,
};
use crate::vehicle::{self, Vehicle};
use anyhow::Context;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Source of a recording.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Input<'a> {
    /// A file.
    File(&'a Path),
    /// The text of a table, under a name for messages.
    Text(&'a [u8], &'a str),
}

impl Input<'_> {
    pub(super) fn shown(&self) -> String {
        match self {
            Input::File(path) => path.display().to_string(),
            Input::Text(_, name) => (*name).to_owned(),
        }
    }
}

/// A trajectory with its vehicle.
#[derive(Debug, Clone)]
pub(crate) struct Loaded {
    pub trajectory: Trajectory,
    /// The vehicle, and the value of `--vehicle` that gives it again.
    pub vehicle: Option<(Vehicle, String)>,
    /// The same drive with its faults corrected, or uncorrected if they were corrected: for comparison, if that makes a difference.
    pub twin: Option<Trajectory>,
}

/// A pair of a file, usable or not.
pub(crate) struct Found {
    pub id: Option<String>,
    pub follower: usize,
    pub name: String,
    pub drive: anyhow::Result<Loaded>,
    /// Number of shorter pieces of the same drive, which are left out.
    pub pieces: usize,
}

/// Warning that pieces of drives are left out, as many as each pair has; `None` without any.
pub(crate) fn cut_off(pieces: impl Iterator<Item = usize>) -> Option<String> {
    let [pairs, pieces] = pieces.fold([0, 0], |[pairs, all], of| [pairs + usize::from(of > 0), all + of]);
    (pieces > 0).then(|| {
        let (pieces, of) = (counted(pieces, "piece"), counted(pairs, "drive"));
        format!(
            "{pieces} of {of} left out: long gaps cut a drive into pieces, of which only the longest is used; a longer {MAX_GAP} \
             interpolates more"
        )
    })
}

impl Loaded {
    pub(crate) fn vehicle(&self) -> Option<&Vehicle> {
        self.vehicle.as_ref().map(|(vehicle, _)| vehicle)
    }
}

/// Warning that the start of a drive on its grade table is unknown, if it matters.
pub(crate) fn start_assumed(trajectory: &Trajectory) -> Option<String> {
    let Trajectory { source, grade, notes, .. } = trajectory;
    let grade = grade.as_ref().filter(|grade| grade.sin.windows(2).any(|pair| pair[0] != pair[1]))?;
    let assumed = |note: &Note| match note {
        Note::StartAssumed { position_m } => Some(*position_m),
        _ => None,
    };
    let position = notes.iter().find_map(assumed)?;
    let table = grade.source.as_ref().map_or("its grade table", |table| table.path.as_str());
    Some(format!(
        "{}: it has no positions, so the preceding vehicle is assumed to start at {position} m of {table}; \
             otherwise the slopes belong to another place: give the start with {LEAD_START} M",
        source.path
    ))
}

impl Reading {
    /// Reads a recording without preparation.
    pub(crate) fn open(&self, input: Input<'_>) -> anyhow::Result<Recording> {
        let map = self.columns.as_deref().map(column_map).transpose()?;
        let map = map.map(|map| map.with_lead_length(self.lead_length_m));
        Ok(match (input, &map) {
            (Input::File(path), None) => import::read(path, self.layout)?,
            (Input::File(path), Some(map)) => read_mapped(path, map)?,
            (Input::Text(text, name), None) => import::read_bytes(text, name, self.layout)?,
            (Input::Text(text, name), Some(map)) => read_mapped_from(text, name, map)?,
        })
    }

    /// Reads a recording and selects a follower: the number in a platoon, or the id of a vehicle in a table
    /// with a column map, of which only the pairs of that vehicle are kept.
    #[cfg(feature = "cli")]
    pub(crate) fn read(&self, input: Input<'_>, follower: Option<&str>) -> anyhow::Result<(Recording, Option<usize>)> {
        let mut recording = self.open(input)?;
        let number = self.chosen(&mut recording, follower)?;
        Ok((recording, number))
    }

    /// Selects the follower; pairs of other followers are removed.
    pub(super) fn chosen(&self, recording: &mut Recording, follower: Option<&str>) -> anyhow::Result<Option<usize>> {
        if recording.is_of_numbered_cars() {
            return follower.map(|text| numbered(recording, text)).transpose();
        }
        match follower {
            Some(id) if recording.keep_follower(id) => {}
            Some(id) => {
                let names = recording.platoons.iter().filter_map(|platoon| platoon.cars.last());
                let near = did_you_mean(id, names.map(|car| car.name.as_str()));
                refuse!(
                    "{FOLLOWER} {id}: not a follower in {}{near}; {}",
                    recording.source.path,
                    longest_pairs(recording)
                );
            }
            None if self.trajectory.is_none() && has_several_followers(recording) => {
                refuse!("{FOLLOWER} is needed: {}", longest_pairs(recording));
            }
            None => {}
        }
        Ok(Some(1))
    }

    /// Every pair of a file, or every requested one, and notes on the rest of the file; `vehicle`: whether the follower's car must be known. If
    /// long gaps cut a pair into segments, the longest one; one of another driver is a pair that cannot be used.
    pub(crate) fn pairs(
        &self,
        input: Input<'_>,
        follower: Option<&str>,
        vehicle: Option<&Variant>,
    ) -> anyhow::Result<(Vec<Found>, Vec<String>)> {
        let (mut recording, mut number) = (self.open(input)?, None);
        if let Some(text) = follower
            && !recording.keep_follower(text)
        {
            number = Some(numbered(&mut recording, text)?);
        }
        let (ids, preparation) = (self.ids(&recording), self.preparation()?);
        if let Some(id) = ids.iter().find(|id| recording.platoons.iter().all(|platoon| platoon.id.as_ref() != Some(id)))
        {
            let shown = input.shown();
            refuse!("{TRAJECTORY} {id}: {shown} has no trajectory of this id");
        }
        let is_wanted = |platoon: &&Platoon| ids.is_empty() || platoon.id.as_ref().is_some_and(|id| ids.contains(id));
        let mut asked = Vec::new();
        for platoon in recording.platoons.iter().filter(is_wanted) {
            let followers = followers(platoon).filter(|(follower, _)| number.is_none_or(|n| *follower == n));
            asked.extend(followers.map(|(follower, car)| (platoon, follower, &car.name)));
        }
        let pair = |(platoon, follower, name): (&Platoon, usize, &String)| {
            let found = |name, drive| Found { id: platoon.id.clone(), follower, name, drive, pieces: 0 };
            let (drives, pieces) = match self.longest_of(&recording, platoon, follower, &preparation) {
                Ok(found) => found,
                Err(error) => return vec![found(name.clone(), Err(error))],
            };
            // The drive is that of who drives it longest; of equally long ones, of the first.
            let longest = (0..drives.len()).rev().max_by_key(|&k| drives[k].len()).unwrap_or(0);
            let by = drives.get(longest).and_then(Trajectory::driver).unwrap_or_default().to_owned();
            let of = |(k, trajectory): (usize, Trajectory)| match trajectory.driver() {
                _ if k == longest => Found { pieces, ..found(name.clone(), self.with_vehicle(trajectory, vehicle)) },
                driver => {
                    let driver = driver.unwrap_or("an unnamed driver");
                    found(format!("{name} ({driver})"), Err(another_driver(&trajectory, driver, &by)))
                }
            };
            drives.into_iter().enumerate().map(of).collect()
        };
        let pairs: Vec<Vec<Found>> = asked.into_par_iter().map(pair).collect();
        let left_out = recording.platoons.iter().flat_map(|platoon| &platoon.notes).filter(|note| note.leaves_out());
        let left_out = left_out.map(|note| format!("{}: {note}", recording.source.path)).collect();
        Ok((pairs.into_iter().flatten().collect(), left_out))
    }

    /// The longest segment of each driver of a follower, in the order in which they drive, and the number of the other segments.
    fn longest_of(
        &self,
        recording: &Recording,
        platoon: &Platoon,
        follower: usize,
        preparation: &Preparation,
    ) -> anyhow::Result<(Vec<Trajectory>, usize)> {
        let mut longest: Vec<Trajectory> = Vec::new();
        let segments = prepare_platoon(recording, platoon, follower, preparation)?;
        let count = segments.len();
        for segment in segments {
            match longest.iter_mut().find(|one| one.driver() == segment.driver()) {
                Some(one) if one.len() >= segment.len() => {}
                Some(one) => *one = segment,
                None => longest.push(segment),
            }
        }
        let others = count - longest.len();
        Ok((longest, others))
    }

    /// A trajectory with the car of a variant that needs it.
    fn with_vehicle(&self, trajectory: Trajectory, vehicle: Option<&Variant>) -> anyhow::Result<Loaded> {
        let wanted = vehicle.map(|variant| (variant, self.find_vehicle(&trajectory, variant)));
        let vehicle = match wanted {
            None => None,
            Some((_, Ok(Some(found)))) => Some(found),
            Some((variant, Ok(None))) => {
                anyhow::bail!("variant {variant} needs the vehicle, but no vehicle has the name `{}`", trajectory.name)
            }
            Some((_, Err(error))) => return Err(error),
        };
        Ok(Loaded { trajectory, vehicle, twin: None })
    }

    /// The drives of a file for one parameter set: those of the chosen follower, or of every follower.
    #[cfg(feature = "cli")]
    pub(crate) fn joint(
        &self,
        input: Input<'_>,
        follower: Option<&str>,
        variant: &Variant,
        warn: &mut dyn FnMut(String),
    ) -> anyhow::Result<Vec<Loaded>> {
        let recording = self.open(input)?;
        let numbers: BTreeSet<usize> =
            recording.platoons.iter().flat_map(followers).map(|(follower, _)| follower).collect();
        let is_numbered = recording.is_of_numbered_cars();
        let has_several = if is_numbered { numbers.len() > 1 } else { has_several_followers(&recording) };
        if follower.is_some() || self.trajectory.is_some() || self.segment.is_some() || !has_several {
            let (recording, follower) = self.read(input, follower)?;
            return self.pick_all(&recording, follower, variant, true, warn);
        }
        let shown = input.shown();
        if is_numbered {
            let mut all = Vec::new();
            for follower in numbers {
                let own = self.pick_all(&recording, Some(follower), variant, true, warn);
                all.push((format!("follower {follower}"), of_one(own)?));
            }
            return Ok(usable(&shown, "pairs", all, warn)?.into_iter().flatten().collect());
        }
        let vehicle = (variant.needs_vehicle() || self.vehicle.is_some()).then_some(variant);
        let (found, left_out) = self.pairs(input, None, vehicle)?;
        left_out.into_iter().for_each(&mut *warn);
        let cut = cut_off(found.iter().map(|one| one.pieces));
        cut.into_iter().for_each(|text| warn(format!("{shown}: {text}")));
        usable(&shown, "pairs", found.into_iter().map(|one| (one.name, one.drive)).collect(), warn)
    }

    /// Every requested trajectory, in that order; with `all` every usable one of the file, if none is requested.
    #[cfg(feature = "cli")]
    pub(crate) fn pick_all(
        &self,
        recording: &Recording,
        follower: Option<usize>,
        variant: &Variant,
        all: bool,
        warn: &mut dyn FnMut(String),
    ) -> anyhow::Result<Vec<Loaded>> {
        let ids = self.ids(recording);
        if !ids.is_empty() {
            return ids.iter().map(|id| self.pick_one(recording, follower, variant, Some(id), warn)).collect();
        }
        if !all || recording.platoons.len() < 2 {
            return Ok(vec![self.pick_one(recording, follower, variant, None, warn)?]);
        }
        let (mut all, mut said) = (Vec::new(), Vec::new());
        for id in recording.platoons.iter().filter_map(|platoon| platoon.id.as_deref()) {
            let own = self.pick_one(recording, follower, variant, Some(id), &mut |text| said.push((id, text)));
            all.push((id.to_owned(), of_one(own)?));
        }
        let path = &recording.source.path;
        let more = said.len().saturating_sub(WARNED);
        said.into_iter().take(WARNED).for_each(|(id, text)| warn(format!("trajectory {id}: {text}")));
        if more > 0 {
            warn(format!("{path}: {more} more such warnings on other trajectories"));
        }
        let picked = usable(path, "trajectories", all, warn)?;
        let names: BTreeSet<&str> = picked.iter().map(|loaded| loaded.trajectory.name.as_str()).collect();
        // Groups may be drives of one vehicle.
        if let (Some(one), Some(another)) = (names.iter().next(), names.iter().nth(1))
            && recording.chosen_by != ChosenBy::Group
        {
            warn(format!(
                "{path}: the trajectories belong to {} vehicles, such as {one} and {another}; {FOLLOWER} NAME selects one",
                names.len()
            ));
        }
        Ok(picked)
    }

    /// The requested ids: one of the file, or several between commas.
    pub(crate) fn ids(&self, recording: &Recording) -> Vec<String> {
        let Some(given) = &self.trajectory else { return Vec::new() };
        if recording.platoons.iter().any(|platoon| platoon.id.as_ref() == Some(given)) {
            return vec![given.clone()];
        }
        given.split(',').map(|id| id.trim().to_owned()).collect()
    }

    /// One follower of the trajectory of an id, prepared for a variant; without an id of the longest one, without a number the only one.
    pub(crate) fn pick_one(
        &self,
        recording: &Recording,
        follower: Option<usize>,
        variant: &Variant,
        id: Option<&str>,
        warn: &mut dyn FnMut(String),
    ) -> anyhow::Result<Loaded> {
        let trajectory = self.trajectory_of(recording, follower, id, warn)?;
        let vehicle = self.vehicle_for(&trajectory, variant)?;
        let twin = self.twin(recording, &trajectory);
        Ok(Loaded { trajectory, vehicle, twin })
    }

    /// A drive with a fault that matters and can be corrected: corrected, or uncorrected if this one is corrected.
    pub(super) fn twin(&self, recording: &Recording, of: &Trajectory) -> Option<Trajectory> {
        let mends = |finding: &Finding| finding.remedies.iter().any(|remedy| remedy.option == CORRECT);
        of.findings().find(|finding| finding.matters && mends(finding))?;
        let (from, to) = (of.t.first().copied(), of.t.last().copied());
        let other = Reading { correct: !self.correct, from, to, segment: None, ..self.clone() };
        other.trajectory_of(recording, Some(of.follower), of.id.as_deref(), &mut |_| {}).ok()
    }

    /// One follower of the trajectory with an id, by default the longest one; without a number the only follower.
    pub(crate) fn trajectory_of(
        &self,
        recording: &Recording,
        follower: Option<usize>,
        id: Option<&str>,
        warn: &mut dyn FnMut(String),
    ) -> anyhow::Result<Trajectory> {
        let follower = follower.map_or_else(|| only_follower(recording), Ok)?;
        let preparation = Preparation { trajectory_id: id.map(str::to_owned), ..self.preparation()? };
        self.choose(prepare(recording, follower, &preparation)?, warn)
    }

    /// The follower's car, if it is requested or the variant needs it.
    pub(crate) fn vehicle_for(
        &self,
        trajectory: &Trajectory,
        variant: &Variant,
    ) -> anyhow::Result<Option<(Vehicle, String)>> {
        // An unrelated table beside the data must not stop a variant that needs no vehicle.
        let wanted = self.vehicle.is_some() || variant.needs_vehicle();
        let vehicle = if wanted { self.find_vehicle(trajectory, variant)? } else { None };
        if vehicle.is_none() && variant.needs_vehicle() {
            let Trajectory { source, name, follower, .. } = trajectory;
            refuse!(
                "{}: variant {variant} needs the vehicle of follower {follower}, but no vehicle has the name `{name}`; give {VEHICLE} \
                 NAME or FILE#NAME (`leadlag list vehicles`)",
                source.path
            );
        }
        Ok(vehicle)
    }

    fn preparation(&self) -> anyhow::Result<Preparation> {
        let grade = self.grade.as_deref().map(read_grade).transpose()?;
        Ok(Preparation {
            from: self.from,
            to: self.to,
            max_gap_s: self.max_gap_s,
            smooth: self.smooth,
            resample: self.resample_s,
            correct: self.correct,
            reconcile: self.reconcile,
            trajectory_id: None,
            grade,
            lead_length: self.lead_length_m,
            lead_start_m: self.lead_start_m,
        })
    }

    /// The requested segment, otherwise the longest, with a note.
    fn choose(&self, mut segments: Vec<Trajectory>, warn: &mut dyn FnMut(String)) -> anyhow::Result<Trajectory> {
        let stretches = Stretch::of_trajectories(&segments);
        let count = segments.len();
        let first = segments.first().context("no segment is long enough")?;
        let (path, listed) = (&first.source.path, Stretch::listed(&stretches));
        let index = match self.segment {
            Some(k) if (1..=count).contains(&(k as usize)) => k as usize - 1,
            Some(k) => {
                let are =
                    if count == 1 { "there is 1 segment".to_owned() } else { format!("there are {count} segments") };
                refuse!("{SEGMENT} {k}: {path}: {are}: {listed}");
            }
            None => {
                let (longest, _) = Stretch::longest(&stretches);
                longest[0].number - 1
            }
        };
        for pair in segments.windows(2) {
            let ([Some(one), Some(other)], [before, after]) =
                ([pair[0].driver(), pair[1].driver()], [&pair[0].t[pair[0].len() - 1], &pair[1].t[0]])
            else {
                continue;
            };
            if one != other {
                warn(format!(
                    "{path}: {one} drives until {before:.1} s and {other} after, as the file says: two drivers, each a separate segment; \
                     {TO} {before:.3} or {FROM} {after:.3} selects one of them"
                ));
            }
        }
        if count > 1 && self.segment.is_none() {
            let ids: Vec<&str> = segments.iter().filter_map(|segment| segment.id.as_deref()).collect();
            let are_whole = ids.len() == count && ids.windows(2).all(|pair| pair[0] != pair[1]);
            warn(match segments[index].id.as_deref().filter(|_| are_whole) {
                Some(longest) => format!(
                    "{path}: {count} trajectories ({}), of which only the longest, {longest}, is used; {TRAJECTORY} chooses others: several \
                     for a diagnosis or a joint calibration, or one",
                    first_few(&ids)
                ),
                None => format!(
                    "{path}: {count} segments, of which only the longest, number {}, is used; the longest are {listed}; \
                     {SEGMENT} or {TRAJECTORY} choose another, a longer {MAX_GAP} interpolates more",
                    index + 1
                ),
            });
        }
        let chosen = segments.swap_remove(index);
        chosen
            .faults_of(|kind| self.measure.is_none_or(|gof| gof.minds(kind)))
            .for_each(|fault| warn(format!("{}: {fault}", chosen.source.path)));
        Ok(chosen)
    }

    /// The follower's car, if known.
    pub(super) fn vehicle_of(&self, trajectory: &Trajectory) -> anyhow::Result<Option<Vehicle>> {
        let any = Variant::from_id(1)?;
        Ok(self.find_vehicle(trajectory, &any)?.map(|(vehicle, _)| vehicle))
    }

    /// The vehicle: the given one, otherwise by its name in a table beside the data, otherwise by its name in the built-in table.
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

/// Number of ids that a message names.
const IDS_NAMED: usize = 10;

fn first_few(ids: &[&str]) -> String {
    let named = ids[..IDS_NAMED.min(ids.len())].join(",");
    if ids.len() > IDS_NAMED { named + ",..." } else { named }
}

/// Followers with the car ahead of each, by number. The car ahead of the leader of a pair file is numbered 0.
fn followers(platoon: &Platoon) -> impl Iterator<Item = (usize, &Car)> {
    let pairs = platoon.cars.windows(2).filter(|two| two[1].number == two[0].number + 1);
    pairs.map(|two| (two[1].number.saturating_sub(1), &two[1])).filter(|(follower, _)| *follower > 0)
}

/// True if the user has to name the follower. Groups are drives: of several, the longest is taken.
fn has_several_followers(recording: &Recording) -> bool {
    if recording.chosen_by == ChosenBy::Group {
        return false;
    }
    let mut names = recording.platoons.iter().filter_map(|platoon| platoon.cars.last().map(|car| &car.name));
    let first = names.next();
    names.any(|name| Some(name) != first)
}

/// A drive, or an error that concerns it only; other errors end the command.
#[cfg(feature = "cli")]
fn of_one<T>(drive: anyhow::Result<T>) -> anyhow::Result<anyhow::Result<T>> {
    use crate::trajectory::PrepareError::{self, EmptyWindow, Faulty, Short, TooShort};
    let is_its =
        |error: &PrepareError| matches!(error, TooShort { .. } | Short { .. } | EmptyWindow { .. } | Faulty { .. });
    match drive {
        Err(error) if !error.downcast_ref().is_some_and(is_its) => Err(error),
        drive => Ok(drive),
    }
}

/// The drives of a file that can be used, with a warning about the others; an error if none can.
#[cfg(feature = "cli")]
fn usable<T>(
    path: &str,
    what: &str,
    all: Vec<(String, anyhow::Result<T>)>,
    warn: &mut dyn FnMut(String),
) -> anyhow::Result<Vec<T>> {
    let (count, mut good, mut first) = (all.len(), Vec::new(), None);
    for (name, one) in all {
        match one {
            Ok(one) => good.push(one),
            Err(error) => first = first.or(Some((name, error))),
        }
    }
    match first {
        Some((_, error)) if good.is_empty() => return Err(error),
        Some((name, error)) => {
            let lost = count - good.len();
            warn(format!("{path}: {lost} of {count} {what} cannot be used; the first of them is {name}: {error:#}"));
        }
        None => {}
    }
    Ok(good)
}

/// Why a piece of a drive is not calibrated with the rest.
fn another_driver(piece: &Trajectory, driver: &str, by: &str) -> anyhow::Error {
    let [from, to] = [piece.t[0], piece.t[piece.len() - 1]];
    anyhow::anyhow!(
        "{}: {driver} drives from {from:.1} to {to:.1} s, as the file says, and the longer piece by {by} is the pair of this drive; \
         {FROM} {from:.3} {TO} {to:.3} calibrates this one",
        piece.source.path
    )
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
    names.truncate(NAMED);
    refuse!(
        "{FOLLOWER}: expected a number, 1 right behind the platoon leader, or the name of a car that follows, found `{given}`; \
         {} has {}{near}; ids of vehicles need {COLUMNS}",
        recording.source.path,
        names.join(", ")
    );
}

/// The column map of a flag. A missing file is a failure; any other error in it is wrong usage.
pub(crate) fn column_map(given: &str) -> anyhow::Result<ColumnMap> {
    ColumnMap::find(given).map_err(|error| match error {
        MapError::Open { .. } => error.into(),
        error => Usage(format!("{COLUMNS}: {error}")).into(),
    })
}

/// Warnings on single trajectories that a joint calibration of a table repeats; hundreds would hide the others.
const WARNED: usize = 3;

fn longest_pairs(recording: &Recording) -> String {
    let name = |platoon: &Platoon| {
        let duration = platoon.t.last().unwrap_or(&0.0) - platoon.t.first().unwrap_or(&0.0);
        let follower = platoon.cars.last().map_or("", |car| car.name.as_str());
        format!("{follower} ({duration:.1} s)")
    };
    let named: Vec<String> = recording.platoons.iter().take(NAMED).map(name).collect();
    let path = &recording.source.path;
    format!(
        "it has {} pairs, first {}; `leadlag inspect {path} --columns ...` lists more",
        recording.platoons.len(),
        named.join(", ")
    )
}

/// A grade table, or `level`.
pub(crate) fn read_grade(text: &str) -> anyhow::Result<Grade> {
    if text == "level" {
        return Ok(Grade::level());
    }
    Ok(Grade::read_csv(Path::new(text))?)
}

/// The follower of a file that has only one.
pub(crate) fn only_follower(recording: &Recording) -> anyhow::Result<usize> {
    let mut cars = recording.platoons[0].cars.iter().filter(|c| c.number > 1);
    let followers: Vec<String> = cars.by_ref().map(|c| format!("{} = {}", c.number - 1, c.name)).collect();
    if followers.len() == 1 {
        return Ok(1);
    }
    let path = &recording.source.path;
    refuse!("{FOLLOWER} is needed: {path} has the followers {}", followers.join(", "));
}
