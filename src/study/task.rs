//! Tasks: one calibration each, named by a hash of all inputs of its result.

use super::drive::{self, Drive, DriveEntry, LeftOut};
use super::plan::{Plan, Validation, overrides_for};
use super::{PROGRAM, SCHEMA_VERSION, StudyError, sha256};
use crate::calibrate::{BoundsError, Overrides, SearchSpace, bound_times};
use crate::catalog::Variant;
use crate::evaluator::{Case, CaseError, Supply};
use crate::extension::Extension;
use crate::lanes::LanesPrecision;
use crate::score::GoodnessOfFit;
use crate::text::shown::NAMED;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::collections::HashMap;
use std::str::FromStr;

/// One calibration, with the validation runs of its result: a line of `tasks.jsonl`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Task {
    /// Hash of data, variant, goodness of fit, settings, seed, replicate, validation, version and state of the search; 32 hexadecimal digits.
    pub id: String,
    /// Name of the platoon.
    pub platoon: String,
    /// 1 = right behind the platoon leader.
    pub follower: usize,
    /// Id of Table 1.
    pub model_id: u32,
    /// Name of the variant.
    pub variant: String,
    /// The measure to minimise.
    pub gof: String,
    /// The replicate, from 0.
    pub replicate: u64,
}

/// All inputs of a task's result; the id is a hash of its JSON.
#[derive(Serialize)]
struct Content<'a> {
    schema_version: u32,
    program: &'a str,
    platoon: &'a str,
    follower: usize,
    vehicle: &'a str,
    sha256: &'a str,
    data: &'a str,
    variant: String,
    /// Name and checksum of the text; left out without extensions, so that older ids stay valid.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    extensions: Vec<(&'a str, String)>,
    gof: String,
    convention: String,
    optimizer: &'a str,
    seed: u64,
    replicate: u64,
    max_evaluations: u64,
    max_stall: u64,
    bounds: Overrides,
    evaluator: &'a str,
    precision: &'a str,
    /// Platoon, follower, checksum of the file and fingerprint of each drive that it is validated on.
    validation: Vec<(&'a str, usize, &'a str, &'a str)>,
}

/// Largest number of validation runs of a study: each is a row of a table, together a gigabyte of memory. The paper has 10 000.
const VALIDATION_RUNS_MAX: u64 = 5_000_000;

/// A plan with its data: the source of tasks.
#[derive(Debug)]
pub struct Study {
    pub plan: Plan,
    /// The trajectories.
    pub drives: Vec<Drive>,
    /// Trajectories left out of entries for several.
    pub left_out: Vec<LeftOut>,
    /// Place of each drive by platoon and follower, and places of the drives of each vehicle.
    places: HashMap<(String, usize), usize>,
    by_vehicle: HashMap<String, Vec<usize>>,
    /// One case per drive, whose signals the cases of all variants share.
    bases: Vec<Case>,
}

impl Study {
    /// Reads the data of a plan and checks that every variant can be calibrated on every trajectory. Fails for missing or broken data, or a variant
    /// without its data.
    pub fn open(plan: Plan) -> Result<Study, StudyError> {
        let (drives, left_out) = drive::read(&plan.data)?;
        let any = Variant::from_id(1).expect("variant 1 exists");
        let bases = drives.iter().map(|drive| {
            let case = Case::new(&drive.trajectory, any, drive.vehicle.as_ref(), plan.calibration.convention, 0.0)?;
            Ok(Case { label: drive.entry.label().as_str().into(), ..case })
        });
        let bases = bases.collect::<Result<_, StudyError>>()?;
        let entries = || drives.iter().map(|drive| &drive.entry).enumerate();
        let places = entries().map(|(i, entry)| ((entry.platoon.clone(), entry.follower), i)).collect();
        let mut by_vehicle: HashMap<String, Vec<usize>> = HashMap::new();
        entries().for_each(|(i, entry)| by_vehicle.entry(entry.vehicle.clone()).or_default().push(i));
        let study = Study { plan, drives, left_out, places, by_vehicle, bases };
        let runs = study.validation_runs();
        if runs > VALIDATION_RUNS_MAX {
            let drives = study.drives.len();
            return Err(StudyError::TooManyValidations { runs, most: VALIDATION_RUNS_MAX, drives });
        }
        for variant in &study.plan.calibration.variants {
            for drive in 0..study.drives.len() {
                study.case(drive, variant)?;
            }
        }
        Ok(study)
    }

    /// A drive that lacks what a variant needs, with the remedy in a plan.
    fn missing(&self, index: usize, variant: &Variant, what: &'static str, supply: Supply) -> StudyError {
        let remedy = match supply {
            Supply::Vehicle => {
                "name it in the plan: `vehicle` of the platoon, or `data.vehicles`, a table in which the names of the file occur"
            }
            Supply::Curve => "`data.vehicles` must be a table with an `mfc` file, or mfc_SLUG.csv beside it",
            Supply::Grade => "give the platoon a `grade` in the plan: a table, or \"level\"",
            Supply::Platoon => {
                "use a follower further back in the platoon, or give the column lead2_... of a pair file"
            }
        };
        StudyError::Missing { drive: self.drives[index].entry.label(), variant: variant.name(), what, remedy }
    }

    /// Search ranges of a variant on drive `index`.
    pub(super) fn space(&self, index: usize, variant: &Variant) -> Result<SearchSpace, StudyError> {
        let (settings, drive) = (&self.plan.calibration, &self.drives[index]);
        let mut bounds = overrides_for(variant, &settings.bounds);
        bound_times(variant, drive.entry.window_s, &mut bounds);
        SearchSpace::new(variant, drive.vehicle.as_ref(), settings.convention, &bounds).map_err(|source| match source {
            BoundsError::Vehicle(_) => self.missing(index, variant, "the follower's vehicle", Supply::Vehicle),
            source => StudyError::Bounds { variant: variant.name(), source },
        })
    }

    /// Drive `index` for the runs of a variant.
    pub(super) fn case(&self, index: usize, variant: &Variant) -> Result<Case, StudyError> {
        let space = self.space(index, variant)?;
        let (tau_p_upper, extension_delay_upper) = (space.tau_p_upper(), space.extension_delay_upper());
        let case = Case { tau_p_upper, extension_delay_upper, ..self.bases[index].clone() };
        case.for_variant(*variant).map_err(|error| match error {
            CaseError::Missing { what, remedy, .. } => self.missing(index, variant, what, remedy),
            error => error.into(),
        })
    }

    /// Index of the drive that a task calibrates on.
    pub(super) fn drive_of(&self, task: &Task) -> usize {
        *self.places.get(&(task.platoon.clone(), task.follower)).expect("a task of this study has a drive of it")
    }

    /// The validation runs of all winners, without listing them: they grow with the square of the trajectories of a vehicle.
    pub fn validation_runs(&self) -> u64 {
        let mut together: HashMap<(&str, &str), u64> = HashMap::new();
        for DriveEntry { platoon, vehicle, .. } in self.drives.iter().map(|drive| &drive.entry) {
            *together.entry((platoon.as_str(), vehicle.as_str())).or_default() += 1;
        }
        let square = |count: u64| count * count;
        let all: u64 = self.by_vehicle.values().map(|drives| square(drives.len() as u64)).sum();
        let own: u64 = together.into_values().map(square).sum();
        let settings = &self.plan.calibration;
        match self.plan.validation {
            Validation::None => 0,
            Validation::SameVehicle => (all - own) * (settings.variants.len() * settings.gofs.len()) as u64,
        }
    }

    /// The drives that a calibration on drive `index` is validated on.
    pub fn validated_on(&self, index: usize) -> Vec<usize> {
        let own = &self.drives[index].entry;
        match self.plan.validation {
            Validation::None => Vec::new(),
            Validation::SameVehicle => {
                let same = self.by_vehicle.get(&own.vehicle).into_iter().flatten().copied();
                same.filter(|&i| self.drives[i].entry.platoon != own.platoon).collect()
            }
        }
    }

    /// Every task, in the order of all tables: goodness of fit, variant, trajectory, replicate.
    pub fn tasks(&self) -> Vec<Task> {
        let settings = &self.plan.calibration;
        let validated: Vec<Vec<usize>> = (0..self.drives.len()).map(|i| self.validated_on(i)).collect();
        let mut tasks = Vec::new();
        for gof in &settings.gofs {
            for variant in &settings.variants {
                for (own, on) in validated.iter().enumerate() {
                    for replicate in 0..settings.replicates {
                        tasks.push(self.task(gof, variant, own, on, replicate));
                    }
                }
            }
        }
        tasks
    }

    /// `own`: the drive it calibrates on; `on`: those it is validated on.
    fn task(&self, gof: &GoodnessOfFit, variant: &Variant, own: usize, on: &[usize], replicate: u64) -> Task {
        let (settings, drive) = (&self.plan.calibration, &self.drives[own].entry);
        let validation = on.iter().map(|&i| {
            let other = &self.drives[i].entry;
            (other.platoon.as_str(), other.follower, other.sha256.as_str(), other.fingerprint.as_str())
        });
        let extensions = variant.extensions.list().iter();
        let content = Content {
            schema_version: SCHEMA_VERSION,
            program: &PROGRAM,
            platoon: &drive.platoon,
            follower: drive.follower,
            vehicle: &drive.vehicle,
            sha256: &drive.sha256,
            data: &drive.fingerprint,
            variant: variant.name(),
            extensions: extensions.map(|e| (e.name.as_str(), sha256(e.text.as_bytes()))).collect(),
            gof: gof.to_string(),
            convention: settings.convention.to_string(),
            optimizer: settings.optimizer.runs(),
            seed: settings.seed,
            replicate,
            max_evaluations: settings.stop.max_evaluations,
            max_stall: settings.stop.max_stall,
            bounds: overrides_for(variant, &settings.bounds),
            evaluator: settings.evaluator.into_str(),
            precision: settings.precision.unwrap_or(LanesPrecision::Plain).into_str(),
            validation: validation.collect(),
        };
        let json = serde_json::to_vec(&content).expect("names and finite numbers are valid JSON");
        let mut id = sha256(&json);
        // 128 of 256 bits: 25,200 tasks do not collide by chance.
        id.truncate(32);
        Task {
            id,
            platoon: drive.platoon.clone(),
            follower: drive.follower,
            model_id: variant.id(),
            variant: content.variant,
            gof: content.gof,
            replicate,
        }
    }
}

/// The variant that a name means, of Table 1 or of one of the laws; extensions come last in a name and are left out.
pub fn without_extensions(name: &str, laws: &[&'static Extension]) -> Option<Variant> {
    let parsed = Variant::named(name, laws).ok();
    parsed.or_else(|| without_extensions(name.rsplit_once('+')?.0, laws))
}

/// One of several shares of the tasks of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// From 1 to `count`.
    number: usize,
    count: usize,
}

/// An invalid share.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected I/N with I from 1 to N, such as 2/5, found `{0}`")]
pub struct NotAShard(String);

impl Shard {
    /// Share `number`, counted from 1, of `count`. Fails unless `number` is one of 1 to `count`.
    pub fn new(number: usize, count: usize) -> Result<Shard, NotAShard> {
        let is_one = (1..=count).contains(&number);
        is_one.then_some(Shard { number, count }).ok_or_else(|| NotAShard(format!("{number}/{count}")))
    }

    /// Indices of its tasks: shares differ by at most one task. Each is a range of the tasks, so that one process batches whole variants,
    /// in an order of the variants unrelated to Table 1, because the cost of a task follows a pattern there.
    pub fn of(self, tasks: &[Task]) -> Vec<usize> {
        let mut order: Vec<(String, usize)> = (0..tasks.len())
            .map(|i| (sha256(format!("{} {}", tasks[i].gof, tasks[i].variant).as_bytes()), i))
            .collect();
        order.sort_unstable();
        let edge = |number: usize| number * tasks.len() / self.count;
        let mut share: Vec<usize> = order[edge(self.number - 1)..edge(self.number)].iter().map(|(_, i)| *i).collect();
        share.sort_unstable();
        share
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

impl FromStr for Shard {
    type Err = NotAShard;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let none = || NotAShard(text.to_owned());
        let (number, count) = text.split_once('/').ok_or_else(none)?;
        let whole = |text: &str| text.trim().parse().map_err(|_| none());
        let (number, count) = (whole(number)?, whole(count)?);
        Shard::new(number, count).map_err(|_| none())
    }
}

/// Indices of tasks by their ids or beginnings of these, each once, in the order of the tasks. Fails for a text that is not the beginning of exactly
/// one id.
pub fn chosen(ids: &[String], tasks: &[Task]) -> Result<Vec<usize>, StudyError> {
    let named = |id: &String| {
        let found: Vec<usize> = (0..tasks.len()).filter(|&i| tasks[i].id.starts_with(id)).collect();
        if let [one] = found[..] {
            return Ok(one);
        }
        let first = found.iter().take(NAMED).map(|&i| tasks[i].id.clone()).collect();
        Err(StudyError::NoTask { id: id.clone(), found: found.len(), first })
    };
    let chosen: BTreeSet<usize> = ids.iter().map(named).collect::<Result<_, _>>()?;
    Ok(chosen.into_iter().collect())
}
