//! Running tasks: variant by variant, several at a time, which are written when all of them are finished.

use super::StudyError;
use super::claim::Claim;
use super::compute::Round;
use super::folder::{Folder, write_whole};
use super::log::{Log, Progress};
use super::part::Part;
use super::task::{Study, Task};
use crate::batch::in_batches;
use crate::catalog::Variant;
use crate::evaluator::{AdapterChoice, Case, EvaluateError, Evaluator};
use crate::lanes::LanesPrecision;
use crate::optimize::GaSettings;
use crate::score::GoodnessOfFit;
use crate::select::{Kind, Selection, Work};
use crate::text::bounded::{self, RESULT_MAX};
use crate::whole::TEMPORARY;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Number of calibrations under way per CPU thread: as many as replicates are usual, which share blocks, and few enough that a power failure
/// costs little.
const PER_THREAD: usize = 10;
/// Largest number of calibrations under way on a device: each holds a file open.
const ON_A_DEVICE: usize = 512;
/// First interval at which a run checks whether tasks of another run are finished; it doubles each time.
const LOOK_AGAIN: Duration = Duration::from_millis(200);
/// Longest interval; a check reads all awaited parts, possibly over a network.
const SELDOM: Duration = Duration::from_secs(10);
/// How often a waiting process checks whether to stop.
const NAP: Duration = Duration::from_millis(100);

/// Settings of a run.
#[derive(Debug, Clone, Copy)]
pub struct Assignment<'a> {
    /// The folder of the study.
    pub folder: &'a Folder,
    /// The plan with its data.
    pub study: &'a Study,
    /// All tasks of the study.
    pub tasks: &'a [Task],
    /// Indices of the tasks to do.
    pub chosen: &'a [usize],
}

/// How tasks are run.
#[derive(Debug, Clone)]
pub struct RunSettings {
    /// Number of calibrations under way at a time; `None`: as suits the evaluator.
    pub in_flight: Option<usize>,
    /// Whether to wait for tasks that other runs work on, and to take over abandoned ones.
    pub wait: bool,
    /// The device, for plans that compute on one.
    pub adapter: AdapterChoice,
    /// Receiver of the evaluator's warnings.
    pub warn: fn(&str),
}

/// Messages to the user during a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event<'a> {
    /// Tasks of a variant start.
    Variant(&'a str),
    /// The remaining tasks belong to another run.
    Waiting(usize),
    /// Nothing new; time to show the progress.
    Tick,
}

/// Result of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// The requested tasks.
    pub tasks: usize,
    /// Tasks that were finished before it started.
    pub before: usize,
    /// Those that it computed.
    pub computed: usize,
    /// Of these, calibrations without a result.
    pub failed: usize,
    /// Those that other runs computed meanwhile.
    pub by_others: usize,
    /// The remaining ones, because the run was interrupted or did not wait.
    pub left: usize,
}

/// Data shared by the threads of a run.
struct Shared<'a> {
    folder: &'a Folder,
    tasks: &'a [Task],
    progress: &'a Progress,
    interrupted: &'a (dyn Fn() -> bool + Sync),
    by_others: AtomicU64,
}

/// Runs the chosen tasks, except those with complete parts. Tasks that another run works on are left to it, and awaited, unless the settings say
/// otherwise. `interrupted` ends the run early and keeps finished tasks. `tell` is called from this thread. Fails when a part cannot be written or
/// the evaluator fails; finished parts are kept.
pub fn run(
    assignment: Assignment,
    settings: &RunSettings,
    progress: &Progress,
    interrupted: &(dyn Fn() -> bool + Sync),
    tell: &mut dyn FnMut(Event),
) -> Result<Summary, StudyError> {
    let Assignment { folder, study, tasks, chosen } = assignment;
    folder.make()?;
    folder.sweep();
    sweep_parts(folder);
    if !Claim::work(folder) {
        let claims = folder.claims();
        (settings.warn)(&format!(
            "{}: files cannot be locked here, so several runs on this folder compute the same tasks; `--shard I/N` gives each its own",
            claims.display()
        ));
    }
    let mut log = Log::new(folder, progress);
    let shared = Shared { folder, tasks, progress, interrupted, by_others: AtomicU64::new(0) };
    // Reports progress: thousands of parts take a while. An early stop returns the inventory so far, read or not.
    let is_left = |&i: &usize| {
        let id = &tasks[i].id;
        let done = if interrupted() { folder.part(id).is_file() } else { is_done(folder, id) };
        progress.done.fetch_add(u64::from(done), Ordering::SeqCst);
        !done
    };
    let mut left: Vec<usize> = chosen.iter().copied().filter(is_left).collect();
    let before = chosen.len() - left.len();
    let mut patience = LOOK_AGAIN;
    while !left.is_empty() && !interrupted() {
        let waiting = left.len();
        let mut deferred = Vec::new();
        for group in left.chunk_by(|&a, &b| (&tasks[a].variant, &tasks[a].gof) == (&tasks[b].variant, &tasks[b].gof)) {
            if interrupted() {
                deferred.extend(group);
                continue;
            }
            deferred.extend(round(study, group, settings, &shared, &mut log, tell).inspect_err(|_| log.write())?);
        }
        left = deferred;
        if left.len() < waiting {
            patience = LOOK_AGAIN;
        } else if !settings.wait {
            break;
        } else {
            wait(patience, &shared, &mut || tell(Event::Waiting(waiting)));
            patience = (2 * patience).min(SELDOM);
        }
    }
    log.write();
    let (computed, by_others) = (progress.computed.load(Ordering::SeqCst), shared.by_others.load(Ordering::SeqCst));
    Ok(Summary {
        tasks: chosen.len(),
        before,
        computed: computed as usize,
        failed: progress.failed.load(Ordering::SeqCst) as usize,
        by_others: by_others as usize,
        left: chosen.len() - before - (computed + by_others) as usize,
    })
}

/// Waits this long, or until the run must stop.
fn wait(time: Duration, shared: &Shared, tell: &mut dyn FnMut()) {
    let began = Instant::now();
    while began.elapsed() < time && !(shared.interrupted)() {
        tell();
        std::thread::sleep(NAP);
    }
}

/// Removes files in `parts/` that killed processes left unfinished. A process that still writes holds the claim of its task.
fn sweep_parts(folder: &Folder) {
    for path in std::fs::read_dir(folder.parts()).into_iter().flatten().flatten().map(|entry| entry.path()) {
        let id = path.file_name().and_then(|name| name.to_str()?.split('.').next());
        let claim =
            id.filter(|_| path.extension().is_some_and(|e| e == TEMPORARY)).and_then(|id| Claim::take(folder, id));
        if let Some(claim) = claim.filter(Claim::is_locked) {
            let _ = std::fs::remove_file(&path);
            claim.finish();
        }
    }
}

/// True if the task has a complete part.
fn is_done(folder: &Folder, id: &str) -> bool {
    let part = bounded::read(&folder.part(id), RESULT_MAX).ok().and_then(|bytes| Part::decode(&bytes));
    part.is_some_and(|part| part.id == id)
}

/// Tasks of one variant and goodness of fit.
struct Queue<'a> {
    shared: &'a Shared<'a>,
    open: Mutex<VecDeque<usize>>,
    /// Those that other runs work on, and interrupted ones.
    left: Mutex<Vec<usize>>,
}

impl Queue<'_> {
    /// Claims tasks, besides those already claimed, until there are this many.
    fn take(&self, mut claimed: Vec<(usize, Claim)>, count: usize) -> Vec<(usize, Claim)> {
        let Shared { folder, tasks, progress, by_others, .. } = self.shared;
        let next = || self.open.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        while claimed.len() < count && !(self.shared.interrupted)() {
            let Some(i) = next() else { break };
            match Claim::take(folder, &tasks[i].id) {
                None => self.leave(i),
                // Since the first check, another run has finished it.
                Some(claim) if is_done(folder, &tasks[i].id) => {
                    by_others.fetch_add(1, Ordering::SeqCst);
                    progress.done.fetch_add(1, Ordering::SeqCst);
                    claim.finish();
                }
                Some(claim) => claimed.push((i, claim)),
            }
        }
        claimed
    }

    fn leave(&self, i: usize) {
        self.left.lock().unwrap_or_else(PoisonError::into_inner).push(i);
    }
}

/// The tasks of one variant and goodness of fit; returns those that are left to others, or by an interruption.
fn round(
    study: &Study,
    group: &[usize],
    settings: &RunSettings,
    shared: &Shared,
    log: &mut Log,
    tell: &mut dyn FnMut(Event),
) -> Result<Vec<usize>, StudyError> {
    let (open, left) = (Mutex::new(group.iter().copied().collect()), Mutex::new(Vec::new()));
    let queue = Queue { shared, open, left };
    // Without a task to start with, no evaluator is needed.
    let first = queue.take(Vec::new(), 1);
    if !first.is_empty() {
        compute(study, group.len(), first, settings, &queue, log, tell)?;
    }
    let mut left = queue.left.into_inner().unwrap_or_else(PoisonError::into_inner);
    left.extend(queue.open.into_inner().unwrap_or_else(PoisonError::into_inner));
    left.sort_unstable();
    Ok(left)
}

/// Computes those tasks of a queue, of originally `count`, that this run can claim; the first ones are claimed.
fn compute(
    study: &Study,
    count: usize,
    first: Vec<(usize, Claim)>,
    settings: &RunSettings,
    queue: &Queue,
    log: &mut Log,
    tell: &mut dyn FnMut(Event),
) -> Result<(), StudyError> {
    let task = &queue.shared.tasks[first[0].0];
    let plan = &study.plan.calibration;
    let named = |variant: &&Variant| variant.name() == task.variant;
    let variant = *plan.variants.iter().find(named).expect("a task is of a variant of the plan");
    let gof: GoodnessOfFit = task.gof.parse().expect("the name of a goodness of fit of the plan");
    tell(Event::Variant(&task.variant));
    let cases = (0..study.drives.len()).map(|i| study.case(i, &variant)).collect::<Result<Vec<_>, _>>()?;
    let most = settings.in_flight.unwrap_or(ON_A_DEVICE).min(count);
    let work = Work { candidates: most * GaSettings::default().population_size, precision: LanesPrecision::Plain };
    let mut selection =
        Selection { kind: plan.evaluator, precision: plan.precision, adapter: settings.adapter.clone() };
    let chosen = selection.build(cases.clone(), gof, work, settings.warn)?;
    log.evaluator = format!("{} ({})", chosen.name(), chosen.precision());
    let is_device = chosen.overlaps();
    drop(chosen);
    // The choice is made and its warnings are given.
    if selection.kind == Kind::Auto && !is_device {
        selection = Selection { kind: Kind::Lanes, adapter: AdapterChoice::Best, ..selection };
    }

    // A device needs all tasks under way at a time; on the CPU, each thread has some. Each task holds a file open, and some systems allow
    // only 1024 per process.
    let threads = rayon::current_num_threads();
    let suitable = if is_device { ON_A_DEVICE } else { (PER_THREAD * threads).min(ON_A_DEVICE) };
    let under_way = settings.in_flight.unwrap_or(suitable).clamp(1, count);
    let workers = if is_device { 1 } else { threads.min(under_way) };
    let (first, round) = (Mutex::new(first), Round { study, variant, gof, cases });
    let build = |cases| selection.build(cases, gof, work, settings.warn);
    let next = || {
        let first = std::mem::take(&mut *first.lock().unwrap_or_else(PoisonError::into_inner));
        Some(queue.take(first, under_way / workers)).filter(|claimed| !claimed.is_empty())
    };
    let work = |claimed: Vec<_>, stop: &Stop| together(&round, &claimed, queue, &build, stop);
    in_batches(workers, queue.shared.interrupted, &next, &work, &mut || {
        log.renew();
        tell(Event::Tick);
    })
}

/// Whether to stop.
type Stop<'a> = dyn Fn() -> bool + Sync + 'a;
/// Makes the evaluator of some cases.
type Build<'a> = dyn Fn(Vec<Case>) -> Result<Box<dyn Evaluator>, EvaluateError> + Sync + 'a;

/// Computes and writes claimed tasks.
fn together(
    round: &Round,
    claimed: &[(usize, Claim)],
    queue: &Queue,
    build: &Build,
    stop: &Stop,
) -> Result<(), StudyError> {
    let Shared { folder, tasks, progress, .. } = queue.shared;
    let own: Vec<&Task> = claimed.iter().map(|(i, _)| &tasks[*i]).collect();
    let mut drives: Vec<usize> = own.iter().map(|task| round.study.drive_of(task)).collect();
    drives.dedup();
    let mut evaluator = build(drives.iter().map(|&drive| round.cases[drive].clone()).collect())?;
    let count = |evaluations: u64| {
        progress.evaluations.fetch_add(evaluations, Ordering::SeqCst);
        if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    round.compute(&own, evaluator.as_mut(), &drives, &count, &|k, part| {
        let (i, claim) = &claimed[k];
        let Some(part) = part else {
            queue.leave(*i);
            return Ok(());
        };
        write_whole(&folder.part(&part.id), &part.encode())?;
        progress.finished.fetch_add(part.calibration.evaluations, Ordering::SeqCst);
        progress.computed.fetch_add(1, Ordering::SeqCst);
        progress.failed.fetch_add(u64::from(!part.calibration.success), Ordering::SeqCst);
        progress.done.fetch_add(1, Ordering::SeqCst);
        claim.finish();
        Ok(())
    })
}
