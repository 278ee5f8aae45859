//! `leadlag study plan`.

use super::super::output;
use leadlag::study::folder::Folder;
use leadlag::study::{Plan, Study, StudyError};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The plan: data x variants x goodness-of-fit functions x replicates x validation
    #[arg(value_name = "PLAN.toml")]
    plan: PathBuf,
    /// Folder of the study [default: the name of the plan, in this folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Folder of the data, instead of the one that the plan names
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut plan = Plan::read(&args.plan).map_err(StudyError::from)?;
    if let Some(folder) = &args.data {
        plan.data.folder.clone_from(folder);
    }
    let content = std::fs::read_to_string(&args.plan)?;
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(&plan.name));
    let study = Study::open(plan)?;
    for drive in &study.drives {
        let entry = &drive.entry;
        eprintln!("used {} sha256 {} ({}, {})", entry.file, entry.sha256, entry.label(), entry.vehicle);
        entry.notes.iter().for_each(|note| eprintln!("  {note}"));
    }
    let tasks = study.tasks();
    let before = Folder::open(&out).and_then(|folder| folder.tasks()).unwrap_or_default();
    Folder::create(&out, &content, &study)?;
    let mut lines = String::new();
    for task in &tasks {
        let (id, platoon, follower, replicate) = (&task.id, &task.platoon, task.follower, task.replicate);
        writeln!(lines, "{id}\t{platoon}\t{follower}\t{}\t{}\t{replicate}", task.variant, task.gof)?;
    }
    output::print(&lines)?;
    let validated = (0..study.drives.len()).map(|i| study.validated_on(i).len()).sum::<usize>();
    let cells = study.plan.calibration.variants.len() * study.plan.calibration.gofs.len();
    eprintln!(
        "{}: {} tasks = {} trajectories x {} variants x {} goodness-of-fit functions x {} replicates; {} validation runs of the winners",
        out.display(),
        tasks.len(),
        study.drives.len(),
        study.plan.calibration.variants.len(),
        study.plan.calibration.gofs.len(),
        study.plan.calibration.replicates,
        validated * cells,
    );
    let gone = before.iter().filter(|task| !tasks.contains(task)).count();
    if gone > 0 {
        eprintln!(
            "{gone} of the {} tasks planned here before are not in this plan; their parts stay, unused",
            before.len()
        );
    }
    eprintln!("go on with: leadlag study run {}", out.display());
    Ok(())
}
