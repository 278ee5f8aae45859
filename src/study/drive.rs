//! The trajectories of a plan: read and prepared, with vehicle and fingerprint.

use super::error::DriveError;
use super::fingerprint;
use super::plan::{DataPlan, PlatoonPlan};
use super::several;
use crate::text::shown::NAMED;
use crate::trajectory::import::{ColumnMap, read_mapped};
use crate::trajectory::{Grade, Platoon, Preparation, Recording, Trajectory};
use crate::trajectory::{import, is_nameless, prepare, prepare_platoon};
use crate::vehicle::{Vehicle, VehicleError, read_table};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::path::Path;

/// One follower of one platoon, ready to be calibrated on.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Description in the study's files.
    pub entry: DriveEntry,
    pub trajectory: Trajectory,
    /// The vehicle, if known.
    pub vehicle: Option<Vehicle>,
}

/// A drive in the form of the study's files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveEntry {
    /// Name of the platoon in the plan.
    pub platoon: String,
    /// 1 = right behind the platoon leader.
    pub follower: usize,
    /// The follower's vehicle: its short name if known, otherwise its name in the file.
    pub vehicle: String,
    /// The file, as the plan names it.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// SHA-256 of all input of a simulation: the prepared signals, the grade, the vehicle.
    pub fingerprint: String,
    /// Number of samples.
    pub samples: usize,
    /// Time step \[s\].
    pub dt_s: f64,
    /// First and last time used \[s\], as in the file.
    pub window_s: [f64; 2],
    /// Changes to the data, one line each.
    pub notes: Vec<String>,
}

impl DriveEntry {
    /// `P3 follower 1`.
    pub fn label(&self) -> String {
        format!("{} follower {}", self.platoon, self.follower)
    }
}

/// The name of a missing file.
fn missing(path: &Path) -> Option<String> {
    (!path.exists()).then(|| path.display().to_string())
}

/// A trajectory of an entry for several, which cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    pub platoon: String,
    /// The fault.
    pub reason: String,
}

/// Reads every trajectory of a plan, in its order, and each file once if entries of one file follow each other. Also returns the trajectories left
/// out of entries for several.
pub fn read(data: &DataPlan) -> Result<(Vec<Drive>, Vec<LeftOut>), DriveError> {
    let vehicles = match &data.vehicles {
        Some(table) => read_table(&data.folder.join(table))?,
        None => Vehicle::built_in(),
    };
    let (mut drives, mut left_out) = (Vec::new(), Vec::new());
    let mut names: HashSet<String> = data.platoons.iter().map(|plan| plan.name.clone()).collect();
    // The last file read, and the settings of its reading.
    let mut last: Option<(PlatoonPlan, Recording)> = None;
    for entry in &data.platoons {
        let many = entry.all || entry.is_pattern;
        let before = (drives.len(), left_out.len());
        for file in several::files(&data.folder, entry)? {
            let plan = PlatoonPlan { file: file.clone(), ..entry.clone() };
            let is_same = |other: &PlatoonPlan| {
                (&other.file, &other.layout, &other.columns) == (&plan.file, &plan.layout, &plan.columns)
            };
            if !last.as_ref().is_some_and(|(other, _)| is_same(other)) {
                last = Some((plan.clone(), recording(data, &plan)?));
            }
            let recording = last.as_ref().map(|(_, recording)| recording).expect("read above");
            let own = if many { several::trajectories(entry, &file, recording, &mut names) } else { vec![plan] };
            for plan in &own {
                let cars = chosen(recording, plan).cars.iter();
                let all: Vec<usize> = cars.filter_map(|car| car.number.checked_sub(1)).filter(|f| *f > 0).collect();
                for &follower in plan.followers.as_ref().unwrap_or(&all) {
                    match one(data, plan, recording, follower, &vehicles, entry.all) {
                        Ok(mut drive) => {
                            // For many pairs it is unknown whether two followers without a name are the same.
                            if many && is_nameless(&drive.entry.vehicle) {
                                drive.entry.vehicle.clone_from(&plan.name);
                            }
                            drives.push(drive);
                        }
                        Err(DriveError::Prepare { source, .. }) if many => {
                            left_out.push(LeftOut { platoon: plan.name.clone(), reason: source.to_string() });
                        }
                        Err(error) => return Err(error),
                    }
                }
            }
        }
        if drives.len() == before.0 && many {
            let reason = left_out.get(before.1).map_or("no followers".to_owned(), |left: &LeftOut| left.reason.clone());
            let (platoon, count) = (entry.name.clone(), left_out.len() - before.1);
            return Err(DriveError::NoneUsable { platoon, count, reason });
        }
    }
    Ok((drives, left_out))
}

fn recording(data: &DataPlan, plan: &PlatoonPlan) -> Result<Recording, DriveError> {
    let (path, platoon) = (data.folder.join(&plan.file), || plan.name.clone());
    let unread = |source| DriveError::Import { platoon: platoon(), missing: missing(&path), source: Box::new(source) };
    let Some(given) = &plan.columns else {
        return import::read(&path, plan.layout).map_err(unread);
    };
    let own = data.folder.join(given);
    let map = if own.exists() { ColumnMap::find(&own.display().to_string()) } else { ColumnMap::find(given) };
    let mut map = map.map_err(|source| DriveError::Map { platoon: platoon(), source: Box::new(source) })?;
    // As named in the plan: the location of the folder is not part of a study.
    map.name.clone_from(given);
    read_mapped(&path, &map).map_err(unread)
}

/// The platoon named by the plan; if it names none, or one that preparation will not find, the first.
fn chosen<'a>(recording: &'a Recording, plan: &PlatoonPlan) -> &'a Platoon {
    let wanted = |platoon: &&Platoon| plan.trajectory.is_some() && platoon.id == plan.trajectory;
    recording.platoons.iter().find(wanted).unwrap_or(&recording.platoons[0])
}

fn one(
    data: &DataPlan,
    plan: &PlatoonPlan,
    recording: &Recording,
    follower: usize,
    vehicles: &[Vehicle],
    of_many: bool,
) -> Result<Drive, DriveError> {
    let platoon = || plan.name.clone();
    let grade = match plan.grade.as_deref() {
        None => None,
        Some("level") => Some(Grade::level()),
        Some(file) => {
            let path = data.folder.join(file);
            let unread =
                |source| DriveError::Import { platoon: platoon(), missing: missing(&path), source: Box::new(source) };
            Some(Grade::read_csv(&path).map_err(unread)?)
        }
    };
    let known = |name: &str| vehicles.iter().find(|v| v.is_called(name));
    let cars = chosen(recording, plan);
    let length = |number: usize| {
        cars.cars
            .iter()
            .find(|car| car.number == number)
            .and_then(|car| car.length.or_else(|| known(&car.name).and_then(|vehicle| vehicle.length)))
    };
    let start = plan.leader_start.map(|start| start - behind_leader(cars, follower, &length));
    let preparation = Preparation {
        from: plan.from,
        to: plan.to,
        smooth: plan.smooth,
        trajectory_id: plan.trajectory.clone(),
        grade,
        // Only if positions matter, which then refer to the front of the car ahead.
        lead_length: start.and_then(|_| length(follower)),
        lead_start_m: start,
        ..Preparation::default()
    };
    let prepared = match of_many {
        true => prepare_platoon(recording, cars, follower, &preparation),
        false => prepare(recording, follower, &preparation),
    };
    let mut segments =
        prepared.map_err(|source| DriveError::Prepare { platoon: platoon(), source: Box::new(source) })?;
    if segments.len() != 1 {
        let labels = segments.iter().take(NAMED).map(|segment| segment.label.clone()).collect();
        return Err(DriveError::Several { platoon: platoon(), follower, count: segments.len(), labels });
    }
    let trajectory = segments.swap_remove(0);
    let vehicle = match &plan.vehicle {
        Some(name) => Some(known(name).cloned().ok_or_else(|| VehicleError::Unknown {
            name: name.clone(),
            table: data.vehicles.as_ref().map_or("the built-in table".to_owned(), |t| t.display().to_string()),
            known: vehicles.iter().map(|v| v.slug.clone()).collect(),
        })?),
        None => known(&trajectory.name).cloned(),
    };
    let entry = DriveEntry {
        platoon: platoon(),
        follower,
        vehicle: vehicle.as_ref().map_or_else(|| trajectory.name.clone(), |v| v.slug.clone()),
        file: plan.file.display().to_string(),
        sha256: trajectory.source.sha256.clone(),
        fingerprint: fingerprint(&trajectory, vehicle.as_ref()),
        samples: trajectory.len(),
        dt_s: trajectory.dt,
        window_s: [trajectory.t[0], trajectory.t[trajectory.len() - 1]],
        notes: trajectory.notes.iter().map(ToString::to_string).collect(),
    };
    Ok(Drive { entry, trajectory, vehicle })
}

/// Distance of the car ahead of a follower behind the platoon leader at the first row \[m\]: gaps and lengths of the cars between.
fn behind_leader(platoon: &Platoon, follower: usize, length: &dyn Fn(usize) -> Option<f64>) -> f64 {
    let first_gap = |number: usize| {
        let car = platoon.cars.iter().find(|car| car.number == number)?;
        car.gap.as_ref()?.iter().copied().find(|gap| gap.is_finite())
    };
    (2..=follower).map(|number| first_gap(number).unwrap_or(0.0) + length(number - 1).unwrap_or(0.0)).sum()
}
