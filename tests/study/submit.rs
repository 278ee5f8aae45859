//! Output of `study submit` for SLURM. The scripts are run here by a shell, with the variables that SLURM would set.

use super::common::{expected, fails, merged, number_before, ok, refused, same, small, stderr, succeeds, text};
use std::fs;
use std::path::Path;
use std::process::Command;

/// The scripts of the array and of the merge.
fn scripts(study: &Path) -> [String; 2] {
    ["array.sh", "merge.sh"].map(|name| fs::read_to_string(study.join("slurm").join(name)).expect("it was written"))
}

/// The options of sbatch that a script gives.
fn options(script: &str) -> Vec<&str> {
    script.lines().filter_map(|line| line.strip_prefix("#SBATCH ")).collect()
}

#[test]
fn the_scripts_say_what_slurm_needs() {
    let study = small("submit");
    let printed = ok(&["study", "submit", text(&study), "--slurm", "--task-seconds", "600", "--cpus", "2"]);
    let out = study.join("slurm");
    let shown = out.display();
    assert_eq!(
        printed,
        format!(
            "array=$(sbatch --parsable {shown}/array.sh)\n\
             sbatch --dependency=afterany:${{array%;*}} {shown}/merge.sh\n"
        )
    );
    let [array, merge] = scripts(&study);
    // 24 tasks of 600 s, on jobs of 2 cores that take 30 min: 4 jobs. The time limit is three times as much and 10 min.
    let name = "plan";
    let expected = [
        &format!("--job-name={name}"),
        &format!("--output=\"{shown}/%A_%a.log\""),
        "--open-mode=append",
        "--requeue",
        "--array=1-4",
        "--cpus-per-task=2",
        "--time=100",
    ];
    assert_eq!(options(&array), expected);
    assert!(array.starts_with("#!/bin/sh\n# Written by leadlag study submit. 24 of 24 tasks open"), "{array}");
    let folder = study.display();
    let body = format!(
        ": \"${{SLURM_ARRAY_TASK_ID:?this script is for sbatch}}\"\n\
         cores=\"${{SLURM_CPUS_PER_TASK:-1}}\"\n\
         # Its own share first; then the tasks that cancelled or slower jobs have left.\n\
         leadlag study run {folder} --shard \"$SLURM_ARRAY_TASK_ID/4\" --no-wait --threads \"$cores\" || exit\n\
         exec leadlag study run {folder} --no-wait --threads \"$cores\"\n"
    );
    assert!(array.ends_with(&body), "{array}");
    assert!(merge.ends_with(&format!("exec leadlag study merge {folder}\n")), "{merge}");
    assert!(options(&merge).contains(&"--job-name=plan-merge") && !merge.contains("--array"), "{merge}");
}

#[test]
fn the_number_of_jobs_follows_from_what_was_measured() {
    let study = small("submit_measured");
    let submit = |further: &[&str]| {
        let output = succeeds(&[&["study", "submit", text(&study), "--slurm"], further].concat());
        stderr(&output)
    };
    let said = submit(&[]);
    // 300 simulations of some 600 samples at 20 million steps per second.
    assert!(said.contains("24 of 24 tasks open"), "{said}");
    assert!(said.contains("assumed, 300 simulations of 601 samples at 20 million candidate-steps/s"), "{said}");
    assert!(said.contains(&format!("leadlag study run {} --task ", study.display())), "{said}");
    assert!(said.contains("1 job of 4 cores") && said.contains("nothing was submitted"), "{said}");
    let command = said.lines().find(|line| line.contains("--task")).expect("it names a task");
    let id = command.split_whitespace().last().expect("an id");
    ok(&["study", "run", text(&study), "--task", id]);
    let said = submit(&[]);
    assert!(said.contains("23 of 24 tasks open") && said.contains("measured, 1 task in 1 run"), "{said}");
    // Never more jobs than tasks or than the limit.
    submit(&["--task-seconds", "1e6"]);
    assert!(options(&scripts(&study)[0]).contains(&"--array=1-23"));
    submit(&["--task-seconds", "1e6", "--most", "7", "--sbatch", "--partition=short", "--sbatch", "--mem=2G"]);
    let [array, merge] = scripts(&study);
    assert!(options(&array).contains(&"--array=1-7"));
    for script in [&array, &merge] {
        assert!(options(script).ends_with(&["--partition=short", "--mem=2G"]), "{script}");
    }
    ok(&["study", "run", text(&study)]);
    let said = submit(&[]);
    assert!(said.contains("all 24 tasks are done; continue with: leadlag study merge"), "{said}");
}

#[test]
#[cfg(unix)]
fn the_jobs_in_any_order_merge_to_the_same_bytes() {
    let before = small("submit_run");
    // A name that a shell and SLURM would split.
    let study = before.with_file_name("it's 100% mine");
    let _ = fs::remove_dir_all(&study);
    fs::rename(&before, &study).unwrap();
    let out = study.with_file_name("scripts");
    let program = env!("CARGO_BIN_EXE_leadlag");
    let flags = ["--cpus", "1", "--task-seconds", "400", "--program", program, "--out", text(&out)];
    ok(&[&["study", "submit", text(&study), "--slurm"][..], &flags].concat());
    let array = fs::read_to_string(out.join("array.sh")).unwrap();
    assert!(options(&array).contains(&"--array=1-6"), "{array}");
    let shell = |script: &str, number: Option<u32>| {
        let mut command = Command::new("sh");
        command.arg(out.join(script)).envs(number.map(|number| ("SLURM_ARRAY_TASK_ID", number.to_string())));
        command.env("SLURM_CPUS_PER_TASK", "1").output().expect("there is a shell")
    };
    let lost = shell("array.sh", None);
    assert!(!lost.status.success() && stderr(&lost).contains("this script is for sbatch"), "{lost:?}");
    assert_eq!(shell("merge.sh", None).status.code(), Some(1), "nothing is computed yet");
    let first = stderr(&shell("array.sh", Some(4)));
    // The first job finds the tasks of all the others, too: no other job works on them.
    assert_eq!(number_before(&first, "computed"), 4, "{first}");
    assert!(first.contains("20 computed"), "{first}");
    for number in [6, 1, 2, 3, 5] {
        let done = shell("array.sh", Some(number));
        assert!(done.status.success(), "{}", stderr(&done));
    }
    let done = shell("merge.sh", None);
    assert!(done.status.success(), "{}", stderr(&done));
    same(&super::common::files(&study.join("merged")), expected(), "by the scripts");
    same(&merged(&study, &[]), expected(), "by hand");
}

#[test]
fn what_cannot_be_submitted_is_told() {
    let study = small("submit_wrong");
    refused(2, &["study", "submit", text(&study)]).says("--slurm");
    refused(2, &["study", "submit", text(&study), "--slurm", "--cpus", "0"])
        .says("expected a whole number from 1 to 1024");
    refused(2, &["study", "submit", text(&study), "--slurm", "--sbatch", "--mem=2G\n#SBATCH --x"])
        .says("has a line end, which an #SBATCH line cannot contain");
    let broken = study.join("two\nlines");
    refused(2, &["study", "submit", text(&study), "--slurm", "--out", text(&broken)])
        .says("has a line end, which an #SBATCH line cannot contain");
    assert!(!broken.exists());
    let (code, _) = fails(&["study", "submit", "nowhere", "--slurm"]);
    assert_eq!(code, 1);
    assert!(!study.join("slurm").exists());
}
