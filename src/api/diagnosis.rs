//! A diagnosis: errors of the data and of the simulation, their causes, and the gain of an extended model.

use super::bounds::{checked_single, read_bounds};
use super::drive::Drive;
use super::error::{Error, Usage, refuse};
use super::fleet::Pairs;
use super::loading::{Loaded as Picked, start_assumed};
use super::once::Samples;
use super::reading::Reading;
use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::describe::{Diagnosis as Described, describe};
use crate::diagnose::data::{FindingKind, check};
use crate::diagnose::drive::drivers::different_drivers;
use crate::diagnose::drive::road::{lap, on_the_road_of};
use crate::diagnose::drive::{drives_apart, hold_back};
use crate::diagnose::{Drive as Diagnosed, DriveError, Effort, Progress, Question, infer};
use crate::drivers::of_fleet;
use crate::extension::Extension;
use crate::fleet::Drive as OfFleet;
use crate::race::loss::SHORTEST_S;
use crate::race::{NotFollowed, Policy, Request, Unit, race, rounds};
use crate::result::diagnosis::{DataEntry, FindingEntry, Outcome};
use crate::text::option::{HOLDOUT, in_file};
use crate::text::spelling::any_of;
use crate::trajectory::{Recording, Trajectory};
use crate::wgsl::{library, read_extension};
use indexmap::IndexMap;
use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;
use strum::VariantNames;

/// A diagnosis to be made.
///
/// ```no_run
/// let drives = ["a.csv", "b.csv"].map(|file| leadlag::read(file)?.follower(1));
/// let [a, b] = drives.map(Result::unwrap);
/// let findings = leadlag::Diagnosis::of("l-cth")?.effort("quick")?.run(&[&a, &b], &[])?;
/// println!("{findings}");
/// # Ok::<(), leadlag::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Diagnosis {
    base: Variant,
    effort: Effort,
    seed: u64,
    causes: Vec<&'static Extension>,
    bounds: Vec<String>,
    /// Bounds of single parameters; they replace those of sets and files.
    single: Overrides,
    correct: bool,
}

/// Result of a diagnosis.
#[derive(Debug, Clone)]
pub struct Findings {
    found: Arc<Found>,
}

/// A diagnosis with what its files need.
#[derive(Debug)]
pub(crate) enum Found {
    /// Of one car: its models in detail, the training data, and the held-back data.
    OneCar(Box<Described>, [Vec<Diagnosed>; 2]),
    /// Of a fleet.
    Fleet(Box<Outcome>),
}

/// A follower of a recording, not yet read.
pub(crate) struct Source<'a> {
    pub(crate) recording: Recording,
    pub(crate) reading: &'a Reading,
    pub(crate) follower: usize,
    pub(crate) id: Option<String>,
}

/// A follower with checked data.
struct Examined {
    picked: Picked,
    entry: DataEntry,
    findings: Vec<FindingEntry>,
}

/// How drives are loaded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loading {
    pub(crate) variant: Variant,
    /// Check the data, and stop there.
    pub(crate) data_only: bool,
}

/// The drives of a diagnosis.
#[derive(Debug)]
pub(crate) struct Loaded {
    pub(crate) train: Vec<Diagnosed>,
    /// The same drives in full length; equal to `train` unless their ends are held back.
    pub(crate) whole: Vec<Diagnosed>,
    pub(crate) holdout: Vec<Diagnosed>,
    pub(crate) data: Vec<DataEntry>,
    pub(crate) findings: Vec<FindingEntry>,
    pub(crate) held_back: String,
    /// Window of every training drive whose end is held back \[s\]; empty with separate held-back drives.
    pub(crate) trained: Vec<[f64; 2]>,
    /// Length of a lap \[m\] if the track is closed or its grade repeats.
    pub(crate) lap: Option<f64>,
}

impl Loading {
    /// Loads drives to train on and held-back drives; without the latter, the last third of each drive is held back.
    pub(crate) fn load(
        self,
        train: Vec<Source<'_>>,
        holdout: Vec<Source<'_>>,
        warn: &mut dyn FnMut(String),
    ) -> anyhow::Result<Loaded> {
        let mut loaded = Loaded {
            train: Vec::new(),
            whole: Vec::new(),
            holdout: Vec::new(),
            data: Vec::new(),
            findings: Vec::new(),
            held_back: "No model is fitted to the files marked holdout; names are checked and gains measured on them."
                .to_owned(),
            trained: Vec::new(),
            lap: None,
        };
        let ends_held_back = holdout.is_empty();
        let (mut trained, mut held) = (Vec::new(), Vec::new());
        for source in train {
            let Examined { picked, entry, findings } = self.examine(source, "train", warn)?;
            let samples = Samples::of(&picked.trajectory);
            samples.differ_from(&trained)?;
            trained.push(samples);
            loaded.data.push(entry);
            loaded.findings.extend(findings);
            if self.data_only {
                continue;
            }
            // First, because a drive that is too short needs no message about its parts.
            let whole = drives(&picked)?;
            if ends_held_back {
                let [beginning, _] = hold_back(&picked.trajectory);
                let [train, holdout] = drives_apart(&picked.trajectory, picked.vehicle())?;
                loaded.trained.extend(beginning.t.first().zip(beginning.t.last()).map(|(from, to)| [*from, *to]));
                loaded.train.extend(train);
                loaded.holdout.extend(holdout);
            } else {
                loaded.train.extend(whole.iter().cloned());
            }
            loaded.whole.extend(whole);
        }
        for source in holdout {
            let Examined { picked, entry, findings } = self.examine(source, "holdout", warn)?;
            let samples = Samples::of(&picked.trajectory);
            if let Some(trained) = trained.iter().find(|other| other.overlap(&samples)) {
                let held = &entry.path;
                refuse!("{HOLDOUT} {held}: also given for training, as {trained}; remove one of them");
            }
            samples.differ_from(&held)?;
            held.push(samples);
            loaded.data.push(entry);
            loaded.findings.extend(findings);
            if !self.data_only {
                loaded.holdout.extend(drives(&picked)?);
            }
        }
        if let Some((first, others)) = loaded.train.split_first_mut() {
            for drives in [others, &mut loaded.holdout, &mut loaded.whole] {
                for (moved, drive) in on_the_road_of(first, drives).into_iter().zip(drives.iter()) {
                    let Trajectory { follower, id, .. } = &drive.trajectory;
                    let own = |entry: &&mut DataEntry| {
                        entry.path == drive.file() && entry.follower == *follower && entry.trajectory == *id
                    };
                    loaded.data.iter_mut().filter(own).for_each(|entry| entry.moved_m = entry.moved_m.or(moved));
                }
            }
            loaded.lap = lap(&loaded.train);
        }
        if ends_held_back {
            loaded.held_back = "Causes are tested on the last third of each file, gains on left-out parts.".to_owned();
        }
        Ok(loaded)
    }

    /// Checks one follower: the faults of its data, and those that remain after corrections.
    fn examine(self, source: Source<'_>, role: &str, warn: &mut dyn FnMut(String)) -> anyhow::Result<Examined> {
        let Source { recording, reading, follower, id } = source;
        let id = id.as_deref();
        let picked = reading.pick_one(&recording, Some(follower), &self.variant, id, warn)?;
        let platoon = recording.platoons.iter().position(|p| id.is_none() || p.id.as_deref() == id).unwrap_or(0);
        let soundness = check(&recording, platoon, follower)?;
        // Causes read the grade, whatever the base model does.
        start_assumed(&picked.trajectory).filter(|_| !self.data_only).into_iter().for_each(&mut *warn);
        let trajectory = &picked.trajectory;
        // Report a unit error first and only once, because it explains every wrong size.
        let is_unit = |kind| matches!(kind, FindingKind::Unit | FindingKind::Exchanged);
        let (units, others): (Vec<_>, Vec<_>) =
            trajectory.findings().partition(|finding| is_unit(finding.kind) && finding.correction.is_none());
        let findings = others.into_iter().map(|finding| FindingEntry::new(trajectory, finding)).collect();
        let units = units.first().map(|finding| in_file(|| finding.message()));
        let mut entry = DataEntry { units, ..DataEntry::of(trajectory, role) };
        entry.take(&soundness);
        Ok(Examined { picked, entry, findings })
    }
}

fn drives(picked: &Picked) -> anyhow::Result<Vec<Diagnosed>> {
    let (drives, _) = Diagnosed::of(&picked.trajectory, picked.vehicle())?;
    Ok(drives)
}

/// Progress \[0 to 1\] at the end of the likelihood.
const INFERRED: f64 = 0.3;

/// Requirements on loaded drives.
pub(crate) struct Asked<'a> {
    pub(crate) base: Variant,
    pub(crate) effort: Effort,
    pub(crate) seed: u64,
    pub(crate) causes: &'a [&'static Extension],
    pub(crate) bounds: &'a Overrides,
}

impl Asked<'_> {
    /// The answer of the likelihood and of the race, with the findings of the data; takes data and findings out of `loaded`.
    pub(crate) fn answer(
        &self,
        loaded: &mut Loaded,
        progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> anyhow::Result<Described> {
        let Asked { base, effort, seed, causes, bounds } = *self;
        let policy = Policy::DEFAULT;
        let question = Question { train: &loaded.train, holdout: &loaded.holdout, base, effort, seed, causes, bounds };
        let all: Vec<&Diagnosed> = if loaded.trained.is_empty() {
            loaded.whole.iter().chain(&loaded.holdout).collect()
        } else {
            loaded.whole.iter().collect()
        };
        let trained: Vec<&Trajectory> = loaded.train.iter().map(|drive| &drive.trajectory).collect();
        let different = match FindingEntry::different_names(&trained) {
            Some(named) => Some(named),
            None => different_drivers(&all, base, bounds, seed)?.map(FindingEntry::different),
        };
        let part = |p: Progress, [from, to]: [f64; 2]| Progress { done: from + (to - from) * p.done, ..p };
        let inference = infer(&question, &mut |p| progress(part(p, [0.0, INFERRED])))?;
        let named: Vec<&'static Extension> = inference.named().iter().map(|adopted| adopted.extension).collect();
        let request = Request {
            drives: &loaded.whole,
            unit: Unit::Recording,
            base,
            causes,
            named: &named,
            sensor_noise: inference.sensor_noise(),
            bounds,
            seed,
            rounds: rounds(effort),
        };
        let answer = race(&request, &policy, &mut |p| progress(part(p, [INFERRED, 1.0])))?;
        let mut found = describe(&question, inference, &answer, loaded.lap)?;
        found.outcome.data = std::mem::take(&mut loaded.data);
        found.outcome.data_findings = std::mem::take(&mut loaded.findings);
        found.outcome.data_findings.extend(different);
        found.outcome.data_findings.extend(answer.not_followed.iter().map(NotFollowed::finding));
        found.outcome.held_back = std::mem::take(&mut loaded.held_back);
        Ok(found)
    }
}

impl Asked<'_> {
    /// The answer for a fleet.
    pub(crate) fn of_fleet(
        &self,
        pairs: &Pairs,
        progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> anyhow::Result<Outcome> {
        let Asked { base, effort, seed, causes, bounds } = *self;
        let (mut drives, mut unusable, mut files) = (Vec::new(), Vec::new(), IndexMap::<&str, DataEntry>::new());
        for pair in &pairs.pairs {
            let cut = |drive: &OfFleet| Ok(Diagnosed::pieces(&drive.trajectory, drive.vehicle.as_ref(), SHORTEST_S)?.0);
            let pieces = pair.drive.as_ref().map_err(Clone::clone);
            match pieces.and_then(|drive| cut(drive).map_err(|error: DriveError| in_file(|| error.to_string()))) {
                Ok(pieces) => drives.extend(pieces),
                Err(why) => {
                    unusable.push([pair.place(), why]);
                    continue;
                }
            }
            let Ok(OfFleet { trajectory, .. }) = &pair.drive else { continue };
            let entry = || DataEntry::of(trajectory, "train");
            let of_file = || DataEntry { follower: 0, name: String::new(), trajectory: None, samples: 0, ..entry() };
            let entry = files.entry(&pair.file).or_insert_with(of_file);
            let DataEntry { window_s: [from, to], samples, .. } = entry;
            let own = [trajectory.t[0], trajectory.t[trajectory.len() - 1]];
            (*from, *to, *samples) = (from.min(own[0]), to.max(own[1]), *samples + trajectory.len());
        }
        if drives.is_empty() {
            return Err(pairs.none_usable(unusable.into_iter().next().map(|[place, why]| (place, why))));
        }
        let request = Request {
            drives: &drives,
            unit: Unit::Driver,
            base,
            causes,
            named: &[],
            sensor_noise: None,
            bounds,
            seed,
            rounds: rounds(effort),
        };
        let mut outcome = of_fleet(&request, effort, progress)?;
        outcome.data = files.into_values().collect();
        outcome.data_findings = findings(pairs);
        outcome.fleet.iter_mut().for_each(|fleet| fleet.unusable.append(&mut unusable));
        Ok(outcome)
    }
}

/// Faults of the drives: the first of each kind and file, with the number of drives.
fn findings(pairs: &Pairs) -> Vec<FindingEntry> {
    let mut all: IndexMap<(String, String), (FindingEntry, usize)> = IndexMap::new();
    for drive in pairs.pairs.iter().filter_map(|pair| pair.drive.as_ref().ok()) {
        let mut own = FindingEntry::of(&drive.trajectory);
        own.dedup_by(|a, b| a.name == b.name);
        for finding in own {
            let key = (finding.file.clone(), finding.name.clone());
            all.entry(key).or_insert_with(|| (finding, 0)).1 += 1;
        }
    }
    let told = |(mut finding, count): (FindingEntry, usize)| {
        finding.sentence = format!("in {count} of {} drives; the first: {}", pairs.len(), finding.sentence);
        finding.trajectory = None;
        finding
    };
    all.into_values().map(told).collect()
}

fn sources<'a>(drives: &[&'a Drive]) -> Vec<Source<'a>> {
    drives.iter().map(|drive| drive.source()).collect()
}

/// The causes of the library.
pub(crate) fn built_in() -> Vec<&'static Extension> {
    library().iter().copied().filter(|extension| extension.cause.is_some()).collect()
}

impl Diagnosis {
    /// A diagnosis of a model, given as to [`Calibration::of`](crate::Calibration::of).
    ///
    /// # Errors
    /// For an unknown model.
    pub fn of(base: &str) -> Result<Diagnosis, Error> {
        Ok(Diagnosis::of_variant(super::model::model(base)?))
    }

    pub(crate) fn of_variant(base: Variant) -> Diagnosis {
        let (effort, causes) = (Effort::Normal, built_in());
        Diagnosis { base, effort, seed: 1, causes, bounds: Vec::new(), single: Overrides::new(), correct: false }
    }

    /// Search effort: `quick` (about 12 s of CPU per drive of 15 minutes), `normal` (twice that, the default) or `thorough`.
    ///
    /// # Errors
    /// For an unknown effort.
    pub fn effort(mut self, name: &str) -> Result<Diagnosis, Error> {
        let message = || format!("effort `{name}`: expected {}", any_of(Effort::VARIANTS));
        self.effort = name.parse().map_err(|_| Usage(message()))?;
        Ok(self)
    }

    /// Seed of all random numbers; 1 by default.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Diagnosis {
        self.seed = seed;
        self
    }

    /// Adds your own cause by its WGSL text.
    ///
    /// # Errors
    /// When the text is faulty, or there is a cause of its name already.
    pub fn cause(mut self, name: &str, text: &str) -> Result<Diagnosis, Error> {
        let own = read_extension(name, text).map_err(anyhow::Error::from)?;
        if self.causes.iter().any(|known| known.name == own.name) {
            refuse!("a cause {} exists already", own.name);
        }
        self.causes.push(own);
        Ok(self)
    }

    /// Adds bounds that replace those of the diagnosis: `acc`, `human` or a TOML file.
    #[must_use]
    pub fn bounds(mut self, bounds: &str) -> Diagnosis {
        self.bounds.push(bounds.to_owned());
        self
    }

    /// Bounds of one parameter, in its unit.
    #[must_use]
    pub fn bound(mut self, parameter: &str, lower: f64, upper: f64) -> Diagnosis {
        self.single.insert(parameter.to_owned(), [lower, upper]);
        self
    }

    /// Whether faults of the data are corrected if possible; by default they are not.
    #[must_use]
    pub fn correct(mut self, wanted: bool) -> Diagnosis {
        self.correct = wanted;
        self
    }

    /// Runs the diagnosis. Without held-back drives, the last third of each drive is held back.
    ///
    /// # Errors
    /// For a drive that is too short, or lacks data of the model.
    pub fn run(&self, drives: &[&Drive], holdout: &[&Drive]) -> Result<Findings, Error> {
        self.run_on(drives, holdout, &mut |_| ControlFlow::Continue(()))
    }

    /// The same with `progress`; if it breaks, the diagnosis ends with an error.
    ///
    /// # Errors
    /// As [`Diagnosis::run`].
    pub fn run_on(
        &self,
        drives: &[&Drive],
        holdout: &[&Drive],
        progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<Findings, Error> {
        // Before the long computation.
        let bounds = self.all_bounds()?;
        let loading = Loading { variant: self.base, data_only: false };
        // Each drive knows how to read it; the diagnosis decides whether to correct it.
        let asked: Vec<Drive> = drives.iter().chain(holdout).map(|drive| drive.corrected(self.correct)).collect();
        let asked: Vec<&Drive> = asked.iter().collect();
        let (drives, holdout) = asked.split_at(drives.len());
        let mut loaded = loading.load(sources(drives), sources(holdout), &mut |_| {})?;
        let described = Box::new(self.asked(&bounds).answer(&mut loaded, progress)?);
        Ok(Findings { found: Arc::new(Found::OneCar(described, [loaded.train, loaded.holdout])) })
    }

    /// Diagnoses a fleet: one law for all drivers, judged on drivers that its fits leave out. A pair that cannot be used is listed with the
    /// reason.
    ///
    /// # Errors
    /// For invalid bounds, or without a usable pair.
    pub fn run_all(&self, pairs: &Pairs) -> Result<Findings, Error> {
        self.run_all_on(pairs, &mut |_| ControlFlow::Continue(()))
    }

    /// The same with `progress`; if it breaks, the diagnosis ends with an error.
    ///
    /// # Errors
    /// As [`Diagnosis::run_all`].
    pub fn run_all_on(
        &self,
        pairs: &Pairs,
        progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> Result<Findings, Error> {
        let bounds = self.all_bounds()?;
        let outcome = self.asked(&bounds).of_fleet(pairs, progress)?;
        Ok(Findings { found: Arc::new(Found::Fleet(Box::new(outcome))) })
    }

    fn asked<'a>(&'a self, bounds: &'a Overrides) -> Asked<'a> {
        let Diagnosis { base, effort, seed, ref causes, .. } = *self;
        Asked { base, effort, seed, causes, bounds }
    }

    /// The bounds of the model and of causes, which the diagnosis searches, too.
    fn all_bounds(&self) -> Result<Overrides, Error> {
        let mut bounds = read_bounds(&self.bounds, &self.base)?;
        let of_causes = self.causes.iter().flat_map(|cause| &cause.parameters).copied();
        let mut known = self.base.parameters();
        known.extend(of_causes.filter(|symbol| !self.base.parameters().contains(symbol)));
        bounds.extend(checked_single(&self.single, &self.base, &known)?);
        Ok(bounds)
    }
}

impl Findings {
    fn outcome(&self) -> &Outcome {
        match &*self.found {
            Found::OneCar(described, _) => &described.outcome,
            Found::Fleet(outcome) => outcome,
        }
    }

    /// All output.
    #[cfg(feature = "cli")]
    pub(crate) fn found(&self) -> &Found {
        &self.found
    }

    /// The answer in a word: `named`, `nothing`, `ambiguous`, `unexplained`, `not_testable`.
    #[must_use]
    pub fn verdict(&self) -> &'static str {
        self.outcome().verdict.into_str()
    }

    /// The reason, in a sentence.
    #[must_use]
    pub fn reason(&self) -> &str {
        &self.outcome().reason
    }

    /// The causes with which the model follows unseen drives better; empty if the base is as good.
    #[must_use]
    pub fn recommended(&self) -> Vec<&str> {
        let recommended = self.outcome().recommended.iter();
        recommended.flat_map(|recommended| &recommended.causes).map(|cause| cause.name.as_str()).collect()
    }

    /// The causes that the likelihood adopts, in the order of adoption.
    #[must_use]
    pub fn causes(&self) -> Vec<&str> {
        self.outcome().causes.iter().map(|cause| cause.name.as_str()).collect()
    }

    /// The text of `diagnosis.json`, the complete result.
    #[must_use]
    pub fn to_json(&self) -> String {
        self.outcome().to_json()
    }

    /// The whole answer in words, as the command line prints it.
    #[cfg(feature = "report")]
    #[must_use]
    pub fn text(&self) -> String {
        crate::report::diagnosis::text::diagnosis(self.outcome(), None)
    }
}

/// The verdict with its reason, and the recommended model.
impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {}", self.verdict(), self.reason())?;
        match self.recommended().as_slice() {
            [] => Ok(()),
            causes => writeln!(f, "recommended: {}", causes.join(", ")),
        }
    }
}
