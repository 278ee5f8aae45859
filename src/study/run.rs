//! Running tasks: variant by variant, many at a time, each written as soon as it is finished.

use super::StudyError;
use super::batch::{Line, Post};
use super::claim::Claim;
use super::compute::Round;
use super::folder::{Folder, write_whole};
use super::log::Log;
use super::part::Part;
use super::task::{Study, Task};
use crate::catalog::Variant;
use crate::evaluator::AdapterChoice;
use crate::evaluator::EvaluateError;
use crate::lanes::LanesPrecision;
use crate::optimize::GaSettings;
use crate::score::GoodnessOfFit;
use crate::select::{Selection, Work};
use crate::text::bounded::{self, RESULT_MAX};
use crate::whole::TEMPORARY;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Number of calibrations under way per CPU thread: enough for full blocks, and few enough that a power failure costs little.
const PER_THREAD: usize = 8;
/// Largest number of calibrations under way on a device: each holds a thread and an open file.
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

/// Progress of a run; may be read from any thread.
#[derive(Debug, Default)]
pub struct Progress {
    /// Finished tasks of this run, including earlier ones and those of other runs.
    pub done: AtomicU64,
    /// Tasks that this run computed.
    pub computed: AtomicU64,
    /// Of these, calibrations without a result.
    pub failed: AtomicU64,
    /// Simulated candidates.
    pub evaluations: AtomicU64,
    /// Those of tasks that this run computes.
    pub finished: AtomicU64,
    /// Simulated steps.
    pub steps: AtomicU64,
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
    /// The first error; ends the run.
    error: Mutex<Option<StudyError>>,
    stop: AtomicBool,
    by_others: AtomicU64,
}

impl Shared<'_> {
    fn fail(&self, error: StudyError) {
        let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(error);
        self.stop.store(true, Ordering::SeqCst);
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst) || (self.interrupted)()
    }
}

/// Runs the chosen tasks, except those with complete parts. Tasks that another run works on are left to it, and awaited, unless the
/// settings say otherwise. `interrupted` ends the run early and keeps finished tasks. `tell` is called from this thread.
///
/// # Errors
/// When a part cannot be written or the evaluator fails; finished parts are kept.
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
    let (error, by_others) = (Mutex::new(None), AtomicU64::new(0));
    let shared = Shared { folder, tasks, progress, interrupted, error, stop: AtomicBool::new(false), by_others };
    // Reports progress: thousands of parts take a while. An early stop returns the inventory so far, read or not.
    let is_left = |&i: &usize| {
        let id = &tasks[i].id;
        let done = if shared.stopped() { folder.part(id).is_file() } else { is_done(folder, id) };
        progress.done.fetch_add(u64::from(done), Ordering::SeqCst);
        !done
    };
    let mut left: Vec<usize> = chosen.iter().copied().filter(is_left).collect();
    let before = chosen.len() - left.len();
    let mut patience = LOOK_AGAIN;
    while !left.is_empty() && !shared.stopped() {
        let waiting = left.len();
        let mut deferred = Vec::new();
        for group in left.chunk_by(|&a, &b| (&tasks[a].variant, &tasks[a].gof) == (&tasks[b].variant, &tasks[b].gof)) {
            if shared.stopped() {
                deferred.extend(group);
                continue;
            }
            deferred.extend(round(study, group, settings, &shared, &mut log, tell)?);
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
    if let Some(error) = shared.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
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
    while began.elapsed() < time && !shared.stopped() {
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

/// The tasks of one variant and goodness of fit; returns those that are left to others, or by an interruption.
fn round(
    study: &Study,
    group: &[usize],
    settings: &RunSettings,
    shared: &Shared,
    log: &mut Log,
    tell: &mut dyn FnMut(Event),
) -> Result<Vec<usize>, StudyError> {
    let mut queue: VecDeque<(usize, Option<Claim>)> = group.iter().map(|&i| (i, None)).collect();
    // Without a task to start with, no evaluator is needed.
    let free = queue.iter_mut().find_map(|entry| {
        entry.1 = Claim::take(shared.folder, &shared.tasks[entry.0].id);
        entry.1.as_ref().map(|_| ())
    });
    if free.is_none() {
        let settled = |&i: &usize| {
            let done = is_done(shared.folder, &shared.tasks[i].id);
            shared.by_others.fetch_add(u64::from(done), Ordering::SeqCst);
            shared.progress.done.fetch_add(u64::from(done), Ordering::SeqCst);
            !done
        };
        return Ok(group.iter().copied().filter(settled).collect());
    }
    let task = &shared.tasks[group[0]];
    let named = |variant: &&Variant| variant.name() == task.variant;
    let variant = *study.plan.calibration.variants.iter().find(named).expect("a task is of a variant of the plan");
    let gof: GoodnessOfFit = task.gof.parse().expect("the name of a goodness of fit of the plan");
    tell(Event::Variant(&task.variant));
    let cases = (0..study.drives.len()).map(|i| study.case(i, &variant)).collect::<Result<Vec<_>, _>>()?;
    let plan = &study.plan.calibration;
    let selection = Selection { kind: plan.evaluator, precision: plan.precision, adapter: settings.adapter.clone() };
    let most = settings.in_flight.unwrap_or(ON_A_DEVICE).min(group.len());
    let work = Work { candidates: most * GaSettings::default().population_size, precision: LanesPrecision::Plain };
    let mut evaluator = selection.build(cases.clone(), gof, work, settings.warn)?;
    // Each holds a file open, and some systems allow only 1024 per process.
    let on_cpu = (PER_THREAD * rayon::current_num_threads()).min(ON_A_DEVICE);
    let threads = if evaluator.overlaps() { ON_A_DEVICE } else { on_cpu };
    let threads = settings.in_flight.unwrap_or(threads).clamp(1, group.len());
    log.evaluator = format!("{} ({})", evaluator.name(), evaluator.precision());

    let round = Round { study, variant, gof, cases };
    let (queue, deferred) = (Mutex::new(queue), Mutex::new(Vec::new()));
    let mut post = Post::new(evaluator.as_mut());
    let lines: Vec<Line> = (0..threads).map(|_| post.line()).collect();
    let served = std::thread::scope(|scope| {
        let mut at_work = 0;
        for line in lines {
            let thread = std::thread::Builder::new();
            let work = || worker(&round, line, &queue, &deferred, shared);
            // With fewer threads than requested it takes longer; the results are the same.
            match thread.spawn_scoped(scope, work) {
                Ok(_) => at_work += 1,
                Err(source) if at_work == 0 => shared.fail(StudyError::Threads { source }),
                Err(_) => {}
            }
        }
        post.serve(&mut || {
            log.renew();
            tell(Event::Tick);
        })
    });
    let mut left = deferred.into_inner().unwrap_or_else(PoisonError::into_inner);
    left.extend(queue.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().map(|(i, _)| i));
    left.sort_unstable();
    if let Err(error) = served {
        // An error of the threads means only that the post has closed.
        return Err(error.into());
    }
    Ok(left)
}

/// One thread: task after task until none remains.
fn worker(
    round: &Round,
    line: Line,
    queue: &Mutex<VecDeque<(usize, Option<Claim>)>>,
    deferred: &Mutex<Vec<usize>>,
    shared: &Shared,
) {
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
    let defer = |i| deferred.lock().unwrap_or_else(PoisonError::into_inner).push(i);
    while let Some((i, claim)) = next() {
        let task = &shared.tasks[i];
        let Some(claim) = claim.or_else(|| Claim::take(shared.folder, &task.id)) else {
            defer(i);
            continue;
        };
        if shared.stopped() {
            defer(i);
            return;
        }
        // Between the first check and the claim, another run may have finished it.
        if is_done(shared.folder, &task.id) {
            shared.by_others.fetch_add(1, Ordering::SeqCst);
            shared.progress.done.fetch_add(1, Ordering::SeqCst);
            claim.finish();
            continue;
        }
        match one(round, &line, task, shared) {
            Ok(true) => claim.finish(),
            Ok(false) => defer(i),
            Err(error) => {
                // A closed post is the consequence of an error that its owner reports.
                if !is_closed(&error) {
                    shared.fail(error);
                }
                return;
            }
        }
    }
}

fn is_closed(error: &StudyError) -> bool {
    use crate::calibrate::CalibrateError;
    let StudyError::Calibrate { source: CalibrateError::Evaluate(EvaluateError::Model(model)), .. } = error else {
        return false;
    };
    model.is::<super::batch::Closed>()
}

/// Computes and writes one task; false if it was interrupted.
fn one(round: &Round, line: &Line, task: &Task, shared: &Shared) -> Result<bool, StudyError> {
    let drive = round.study.drive_of(task);
    let samples = round.study.drives[drive].entry.samples as u64;
    let mut outpost = line.outpost(drive, round.cases[drive].clone());
    let progress = shared.progress;
    let part = round.compute(task, &mut outpost, &mut |evaluations| {
        progress.evaluations.fetch_add(evaluations, Ordering::SeqCst);
        progress.steps.fetch_add(evaluations * samples, Ordering::SeqCst);
        if shared.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    let Some(part) = part else { return Ok(false) };
    write_whole(&shared.folder.part(&task.id), &part.encode())?;
    progress.finished.fetch_add(part.calibration.evaluations, Ordering::SeqCst);
    progress.computed.fetch_add(1, Ordering::SeqCst);
    progress.failed.fetch_add(u64::from(!part.calibration.success), Ordering::SeqCst);
    progress.done.fetch_add(1, Ordering::SeqCst);
    Ok(true)
}
