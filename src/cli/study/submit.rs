//! `leadlag study submit`: files with which a scheduler computes a study.

use super::super::demo::quoted;
use super::super::output;
use super::status::complain;
use crate::api::error::refuse;
use crate::api::values::{real, whole};
use crate::study::folder::{Folder, StudyFile, write_whole};
use crate::study::{inventory, locks, past_runs};
use crate::text::shown::counted;
use anyhow::Context;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Candidate-steps per core and second without a measurement: a slow core, with a variant that has delay and dynamics.
const STEPS_PER_S: f64 = 20e6;
/// The limit of a job is this multiple of the expected time, plus some minutes to start: cores and tasks differ.
const SLACK: f64 = 3.0;
const BEGINNING_MIN: f64 = 10.0;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the study, which all nodes must see under the same name
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Write the scripts of SLURM: a job array and a job that merges
    #[arg(long, required = true)]
    slurm: bool,
    /// Cores of each job of the array
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = whole(1_u16, 1024))]
    cpus: u16,
    /// Target time of a job; the number of jobs follows from it
    #[arg(long, value_name = "MIN", default_value_t = 30, value_parser = whole(1_u16, 10_000))]
    minutes: u16,
    /// Largest number of jobs of the array; the cluster also has a limit (MaxArraySize)
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = whole(1_u16, 60_000))]
    most: u16,
    /// CPU seconds that a task takes [default: as measured in earlier runs]
    #[arg(long, value_name = "S", value_parser = real([0.001, 1e7], "s"))]
    task_seconds: Option<f64>,
    /// A further option of sbatch, such as --partition=short; may be given several times
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Program that the jobs call
    #[arg(long, value_name = "PROGRAM", default_value = "leadlag")]
    program: String,
    /// Folder of the data, if it has moved since the study was planned
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder for the scripts and the output of the jobs [default: slurm, in the study's folder]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Settings of the scripts.
struct Job<'a> {
    args: &'a Args,
    name: String,
    folder: PathBuf,
    out: PathBuf,
    jobs: usize,
    limit_min: u64,
    /// Whether runs can detect each other.
    locks: bool,
    why: String,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let folder = Folder::open(&args.folder)?;
    let (tasks, study) = (folder.tasks()?, folder.study_file()?);
    let inventory = inventory::look(&folder, &tasks, &[])?;
    complain(&inventory)?;
    let open = inventory.missing.len();
    if open == 0 {
        let (all, shown) = (counted(tasks.len(), "task"), quoted(&args.folder.display().to_string()));
        eprintln!("all {all} are done; continue with: leadlag study merge {shown}");
        return Ok(());
    }
    let (seconds, source) = per_task(args, &folder, &study)?;
    let work = open as f64 * seconds;
    let one = f64::from(args.minutes) * 60.0 * f64::from(args.cpus);
    let jobs = ((work / one).ceil().max(1.0) as usize).min(usize::from(args.most)).min(open);
    // One core at a time computes a task.
    let takes_s = (work / jobs as f64 / f64::from(args.cpus)).max(seconds);
    folder.make()?;
    let absolute =
        |path: &Path| std::path::absolute(path).with_context(|| format!("{}: no such folder", path.display()));
    let job = Job {
        args,
        name: study
            .name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' })
            .collect(),
        folder: absolute(&args.folder)?,
        out: absolute(args.out.as_deref().unwrap_or(&args.folder.join("slurm")))?,
        jobs,
        limit_min: (SLACK * takes_s / 60.0 + BEGINNING_MIN).ceil() as u64,
        locks: locks(&folder),
        why: format!("{open} of {} open, {seconds:.3} CPU s each: {source}", counted(tasks.len(), "task")),
    };
    // Each option of sbatch is a line of the scripts.
    let out = job.out.display().to_string();
    if let Some(broken) = args.sbatch.iter().chain([&out]).find(|text| text.contains(['\n', '\r'])) {
        refuse!(
            "{broken:?} has a line end, which an #SBATCH line cannot contain; expected a name without one, such as --out DIR of another folder"
        );
    }
    std::fs::create_dir_all(&job.out).with_context(|| format!("{}: cannot make the folder", job.out.display()))?;
    let [array, merge] = ["array.sh", "merge.sh"].map(|name| job.out.join(name));
    write_whole(&array, job.array().as_bytes())?;
    write_whole(&merge, job.merge().as_bytes())?;
    eprintln!("{}", job.why);
    let (jobs, cores) = (counted(job.jobs, "job"), counted(args.cpus, "core"));
    eprintln!("{jobs} of {cores}, {:.0} min expected, {} min allowed", (takes_s / 60.0).ceil(), job.limit_min);
    if !job.locks {
        eprintln!("files cannot be locked in this folder: each job computes only its own share");
    }
    eprintln!("nothing was submitted; to submit:");
    let [array, merge] = [&array, &merge].map(|path| quoted(&path.display().to_string()));
    output::print(&format!("array=$(sbatch --parsable {array})\nsbatch --dependency=afterany:${{array%;*}} {merge}\n"))
}

/// CPU seconds of a task, and the source of this number.
fn per_task(args: &Args, folder: &Folder, study: &StudyFile) -> anyhow::Result<(f64, String)> {
    let past = past_runs(folder);
    if let Some(seconds) = args.task_seconds {
        return Ok((seconds, "as given by --task-seconds".to_owned()));
    }
    if past.tasks > 0 && past.cpu_s > 0.0 {
        let (tasks, runs) = (counted(past.tasks, "task"), counted(past.runs, "run"));
        return Ok((past.cpu_s / past.tasks as f64, format!("measured, {tasks} in {runs}")));
    }
    let samples: usize = study.drives.iter().map(|drive| drive.samples).sum();
    let mean = samples as f64 / study.drives.len().max(1) as f64;
    let seconds = study.max_evaluations as f64 * mean / STEPS_PER_S;
    let shown = quoted(&args.folder.display().to_string());
    let first = folder.tasks()?.first().map_or(String::new(), |task| task.id.clone());
    eprintln!("no time was measured yet; run one task first to measure its time:");
    eprintln!("  leadlag study run {shown} --task {first}");
    let rate = STEPS_PER_S / 1e6;
    let max = study.max_evaluations;
    Ok((seconds, format!("assumed, {max} simulations of {mean:.0} samples at {rate:.0} million candidate-steps/s")))
}

impl Job<'_> {
    /// The common first lines of both scripts.
    fn head(&self, name: &str, log: &str, lines: &[String]) -> String {
        let mut text = format!("#!/bin/sh\n# Written by leadlag study submit. {}.\n", self.why);
        // SLURM interprets characters after a percent sign.
        let out = self.out.display().to_string().replace('%', "%%");
        let own = [
            format!("--job-name={name}"),
            format!("--output=\"{out}/{log}\""),
            "--open-mode=append".to_owned(),
            "--requeue".to_owned(),
        ];
        for line in own.iter().chain(lines).chain(&self.args.sbatch) {
            let _ = writeln!(text, "#SBATCH {line}");
        }
        text + "\n"
    }

    /// One command of the program on the study's folder.
    fn command(&self, verb: &str, flags: &str) -> String {
        let (program, folder) = (quoted(&self.args.program), quoted(&self.folder.display().to_string()));
        format!("{program} study {verb} {folder}{flags}")
    }

    /// The script of the array.
    fn array(&self) -> String {
        let lines = [
            format!("--array=1-{}", self.jobs),
            format!("--cpus-per-task={}", self.args.cpus),
            format!("--time={}", self.limit_min),
        ];
        let mut text = self.head(&self.name, "%A_%a.log", &lines);
        let data = self.args.data.as_ref().map_or(String::new(), |data| {
            let data = std::path::absolute(data).unwrap_or_else(|_| data.clone());
            format!(" --data {}", quoted(&data.display().to_string()))
        });
        text += ": \"${SLURM_ARRAY_TASK_ID:?this script is for sbatch}\"\n";
        text += "cores=\"${SLURM_CPUS_PER_TASK:-1}\"\n";
        let rest = format!(" --no-wait --threads \"$cores\"{data}");
        let shard = format!(" --shard \"$SLURM_ARRAY_TASK_ID/{}\"{rest}", self.jobs);
        if self.locks && self.jobs > 1 {
            text += "# Its own share first; then the tasks that cancelled or slower jobs have left.\n";
            let _ = writeln!(text, "{} || exit", self.command("run", &shard));
            let _ = writeln!(text, "exec {}", self.command("run", &rest));
        } else {
            let _ = writeln!(text, "exec {}", self.command("run", &shard));
        }
        text
    }

    /// The script of the job that merges.
    fn merge(&self) -> String {
        let lines = ["--cpus-per-task=1".to_owned(), "--time=30".to_owned()];
        let head = self.head(&format!("{}-merge", self.name), "%j-merge.log", &lines);
        let text = "# It names missing tasks, if any, and fails: then submit again.\n";
        format!("{head}{text}exec {}\n", self.command("merge", ""))
    }
}
