//! `leadlag study run`.

use super::super::demo::quoted;
use super::super::{evaluator, interrupt, progress};
use crate::api::error::refuse;
use crate::evaluator::AdapterChoice;
use crate::select::Kind;
use crate::study::folder::Folder;
use crate::study::{Assignment, Event, Progress, RunSettings, Shard, Summary, Task, chosen, run as run_tasks};
use anyhow::bail;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A stopped run ends within a second: calibrations that take longer are given up.
const PATIENCE: Duration = Duration::from_millis(700);

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the study
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The I-th of N shares of the tasks
    #[arg(long, value_name = "I/N", conflicts_with = "task")]
    shard: Option<Shard>,
    /// One task, by its id or the beginning of it; may be given several times
    #[arg(long, value_name = "ID")]
    task: Vec<String>,
    /// Skip tasks that other runs are working on instead of waiting
    #[arg(long)]
    no_wait: bool,
    /// Folder of the data, if it has moved since the plan
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Number of simultaneous calibrations; does not change results [default: 8 per thread, 512 on a GPU]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    batch: Option<u16>,
    /// The adapter, for plans that compute on a GPU [default: the best one]
    #[arg(long, value_name = "INDEX|PCI|NAME")]
    gpu: Option<String>,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let started = Instant::now();
    interrupt::watch();
    let folder = Folder::open(&args.folder)?;
    let (study, tasks) = folder.study(args.data.as_deref())?;
    let chosen = choose(args, &tasks)?;
    if args.gpu.is_some() && !matches!(study.plan.calibration.evaluator, Kind::Gpu | Kind::Auto) {
        refuse!("--gpu: this plan computes on the CPU; it needs `evaluator = \"gpu\"` or \"auto\" in the plan");
    }
    let progress = Arc::new(Progress::default());
    let again = again(args);
    give_up_in_time(Arc::clone(&progress), chosen.len(), again.clone());
    let settings = RunSettings {
        in_flight: args.batch.map(usize::from),
        wait: !args.no_wait,
        adapter: args.gpu.clone().map_or(AdapterChoice::Best, AdapterChoice::Named),
        warn: evaluator::warn,
    };
    let mut bar = Bar::new(chosen.len(), study.plan.calibration.stop.max_evaluations);
    let mut tell = |event: Event| bar.tell(event, &progress);
    let assignment = Assignment { folder: &folder, study: &study, tasks: &tasks, chosen: &chosen };
    let summary = run_tasks(assignment, &settings, &progress, &interrupt::asked, &mut tell);
    bar.finish();
    let summary = match summary {
        Ok(summary) => summary,
        Err(error) => {
            let done = progress.done.load(Ordering::SeqCst);
            eprintln!("{done} of {} tasks are done and kept; after a correction: {again}", chosen.len());
            return Err(error.into());
        }
    };
    if summary.left > 0 && interrupt::asked() {
        bail!("{}", interrupted(&progress, chosen.len(), &again));
    }
    report(&summary, &progress, started.elapsed());
    // The last process to end may not be the one with the last task.
    let is_whole = tasks.iter().all(|task| folder.part(&task.id).is_file());
    eprintln!("continue with: leadlag study {} {}", if is_whole { "merge" } else { "status" }, shown(args));
    Ok(())
}

/// The folder, quoted for a shell.
fn shown(args: &Args) -> String {
    quoted(&args.folder.display().to_string())
}

/// The command that continues the same tasks.
fn again(args: &Args) -> String {
    let mut command = format!("leadlag study run {}", shown(args));
    let flags = [
        ("--shard", args.shard.map(|shard| shard.to_string())),
        ("--data", args.data.as_ref().map(|folder| folder.display().to_string())),
        ("--batch", args.batch.map(|batch| batch.to_string())),
        ("--gpu", args.gpu.clone()),
    ];
    let tasks = args.task.iter().map(|id| ("--task", Some(id.clone())));
    for (flag, value) in flags.into_iter().chain(tasks) {
        command += &value.map_or(String::new(), |value| format!(" {flag} {}", quoted(&value)));
    }
    command + if args.no_wait { " --no-wait" } else { "" }
}

/// Indices of the requested tasks, in their order.
fn choose(args: &Args, tasks: &[Task]) -> anyhow::Result<Vec<usize>> {
    if let Some(shard) = &args.shard {
        return Ok(shard.of(tasks));
    }
    if args.task.iter().any(String::is_empty) {
        refuse!("--task: expected an id, found nothing");
    }
    Ok(if args.task.is_empty() { (0..tasks.len()).collect() } else { chosen(&args.task, tasks)? })
}

/// Summary, to stderr.
fn report(summary: &Summary, progress: &Progress, elapsed: Duration) {
    let seconds = elapsed.as_secs_f64();
    let Summary { tasks, before, computed, failed, by_others, left } = *summary;
    let evaluations = progress.evaluations.load(Ordering::SeqCst) as f64;
    let rates = if computed > 0 {
        format!(", {:.2} tasks/s, {:.0} simulations/s", computed as f64 / seconds, evaluations / seconds)
    } else {
        String::new()
    };
    eprintln!(
        "{tasks} tasks: {before} were done, {computed} computed ({failed} without a feasible candidate), {by_others} by other runs;\n\
         {seconds:.1} s{rates}"
    );
    if left > 0 {
        eprintln!("{left} are running elsewhere; this run does not wait for them");
    }
}

fn interrupted(progress: &Progress, tasks: usize, again: &str) -> String {
    let of = |counter: &AtomicU64| counter.load(Ordering::SeqCst);
    let (done, computed) = (of(&progress.done), of(&progress.computed));
    format!(
        "interrupted: {done} of {tasks} tasks are done and kept, {computed} of them computed now; continue with: {again}"
    )
}

/// Ends the program a moment after Ctrl-C if the tasks under way do not end. All finished results are on the disk.
fn give_up_in_time(progress: Arc<Progress>, tasks: usize, again: String) {
    // Without a spare thread the program ends with the present calibrations.
    let _ = std::thread::Builder::new().spawn(move || {
        while !interrupt::asked() {
            std::thread::sleep(Duration::from_millis(20));
        }
        std::thread::sleep(PATIENCE);
        // An error, so `--quiet` does not silence it; a closed output does not change the status.
        let _ = writeln!(std::io::stderr(), "error: {}", interrupted(&progress, tasks, &again));
        std::process::exit(1);
    });
}

/// The bar of a run.
pub struct Bar {
    bar: progress::Bar,
    tasks: usize,
    /// Expected time of a calibration; measured times replace it after the first ones.
    max_evaluations: u64,
}

impl Bar {
    pub fn new(tasks: usize, max_evaluations: u64) -> Bar {
        let template = "{bar:24} {human_pos}/{human_len} tasks  {msg}";
        Bar { bar: progress::Bar::new(template, Some(tasks as u64), Duration::ZERO), tasks, max_evaluations }
    }

    pub fn finish(&self) {
        self.bar.finish();
    }

    pub fn tell(&mut self, event: Event, progress: &Progress) {
        let done = progress.done.load(Ordering::SeqCst);
        if let Event::Variant(name) = event {
            self.bar.bar.set_prefix(name.to_owned());
        }
        let message = match event {
            Event::Waiting(count) => format!("waiting for another run on this folder, which works on {count}"),
            Event::Variant(_) | Event::Tick => self.pace(progress),
        };
        self.bar.show(done, message, |bar| format!("{done}/{} tasks, {}", self.tasks, bar.message()));
    }

    /// Speed, remaining tasks and failures.
    fn pace(&self, progress: &Progress) -> String {
        let of = |counter: &AtomicU64| counter.load(Ordering::SeqCst);
        let (done, computed, failed) = (of(&progress.done), of(&progress.computed), of(&progress.failed));
        let seconds = self.bar.bar.elapsed().as_secs_f64();
        let (evaluations, finished) = (of(&progress.evaluations) as f64, of(&progress.finished) as f64);
        let left = (self.tasks as u64).saturating_sub(done) as f64;
        let per_task = if computed > 0 { finished / computed as f64 } else { self.max_evaluations as f64 };
        // Tasks under way are partly done.
        let work = (left * per_task - (evaluations - finished)).max(0.0);
        let pace = if evaluations > 0.0 {
            let eta = indicatif::HumanDuration(Duration::from_secs_f64((work / evaluations * seconds).min(1e9)));
            format!("{:.2}/s, {eta:#} left", computed as f64 / seconds)
        } else {
            "starting".to_owned()
        };
        let speed = evaluations / seconds;
        let failures = if failed > 0 { format!(", {failed} infeasible") } else { String::new() };
        format!("{pace}, {speed:.0} simulations/s{failures}  {}", self.bar.bar.prefix())
    }
}
