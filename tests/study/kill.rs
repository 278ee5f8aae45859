//! Killed at any moment, interrupted, started twice: only the tasks under way are lost.

use super::common::{
    command, data, expected, files, merged, number_before, ok, part_names, plan_by, plan_text, planned, refused, same,
    succeeds,
};
use super::common::{scratch, small, stderr, text};
use super::sample;
use leadlag::internal::study::claimed;
use leadlag::internal::study::folder::Folder;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// Number of kills that must hit a run at work, with each of two optimisers; a sample takes an eighth.
const KILLS: usize = 25;
/// Kills that must hit each of the short commands.
const SHORT_KILLS: usize = 3;

fn start(study: &Path, batch: &str) -> Child {
    let mut run = command(&["study", "run", text(study), "--batch", batch]);
    run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts")
}

/// Time at which each part was written: a finished part is never written again.
fn written(study: &Path) -> BTreeMap<String, SystemTime> {
    let time = |name: &String| fs::metadata(study.join("parts").join(name)).unwrap().modified().unwrap();
    part_names(study).into_iter().map(|name| (name.clone(), time(&name))).collect()
}

/// A small generator of waiting times; their randomness comes from the machine anyway.
struct Waits(u64);

impl Waits {
    fn next(&mut self, below: Duration) -> Duration {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        below.mul_f64((self.0 >> 40) as f64 / (1u64 << 24) as f64)
    }
}

#[test]
fn killed_again_and_again_the_merged_bytes_are_the_same() {
    kill_runs("ga", 1500);
}

#[test]
fn killed_again_and_again_with_the_default_optimiser_too() {
    kill_runs("auto", 600);
}

fn kill_runs(optimizer: &str, evaluations: u32) {
    // 120 tasks: more work than fits between the kills, so that nearly all of them hit.
    let plan = plan_by(optimizer, 10, evaluations);
    let calm = planned(&format!("kill_calm_{optimizer}"), &plan);
    let began = Instant::now();
    ok(&["study", "run", text(&calm), "--batch", "4"]);
    let whole = began.elapsed();
    let expected = merged(&calm, &[]);

    let study = planned(&format!("kill_{optimizer}"), &plan);
    let kills = sample::times(KILLS);
    let (mut hits, mut waits, mut before) = (0, Waits(1), written(&study));
    let mut middle = 0;
    while hits < kills {
        let mut run = start(&study, "4");
        sleep(waits.next(whole / 5));
        run.kill().expect("SIGKILL can be sent");
        let status = run.wait().expect("it ends");
        hits += usize::from(status.code().is_none());
        let after = written(&study);
        for (name, time) in &before {
            assert_eq!(after.get(name), Some(time), "{name} was done, and was touched again");
        }
        middle += usize::from(after.len() > before.len());
        before = after;
        // If the work is nearly finished before enough kills, part of it is removed.
        if before.len() > 100 {
            let some: Vec<String> = before.keys().take(60).cloned().collect();
            for name in some {
                fs::remove_file(study.join("parts").join(&name)).unwrap();
                before.remove(&name);
            }
        }
    }
    assert!(middle >= kills.div_ceil(5), "only {middle} of {hits} killed runs had finished a task");
    eprintln!(
        "{optimizer}: {hits} kills, {middle} of them after at least one task; an uninterrupted run takes {whole:?}"
    );
    ok(&["study", "run", text(&study)]);
    same(&merged(&study, &[]), &expected, "after the kills");
}

/// Kills a command, at a moment before its end, until this many kills have hit it. Its output is removed before each try, and examined
/// after it.
fn kill_command(arguments: &[&str], makes: &Path, look: &dyn Fn()) {
    let began = Instant::now();
    ok(arguments);
    let whole = began.elapsed();
    let (mut hits, mut waits) = (0, Waits(2));
    while hits < SHORT_KILLS {
        fs::remove_dir_all(makes).unwrap();
        fs::create_dir(makes).unwrap();
        let mut killed = command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        sleep(waits.next(whole));
        killed.kill().expect("SIGKILL can be sent");
        hits += usize::from(killed.wait().expect("it ends").code().is_none());
        look();
    }
    ok(arguments);
}

/// The files of a folder, without those that a killed process has left there under a temporary name.
fn whole_files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files(folder).into_iter().filter(|(name, _)| !name.ends_with(".tmp")).collect()
}

#[test]
fn a_killed_plan_and_a_killed_merge_do_no_harm() {
    let calm = small("kill_short_calm");
    let (planned, study) = (files(&calm), scratch("kill_short"));
    let plan = calm.join("plan.toml");
    kill_command(&["study", "plan", text(&plan), "--out", text(&study)], &study, &|| {
        for (name, bytes) in whole_files(&study) {
            assert!(planned[&name] == bytes, "{name} is there, but not whole");
        }
    });
    same(&whole_files(&study), &planned, "after killed plans");
    ok(&["study", "run", text(&study)]);
    let tables = study.join("merged");
    kill_command(&["study", "merge", text(&study)], &tables, &|| {
        for (name, bytes) in whole_files(&tables) {
            assert!(expected()[&name] == bytes, "{name} is there, but not whole");
        }
    });
    same(&whole_files(&tables), expected(), "after killed merges");
}

#[test]
fn runs_on_one_folder_share_the_work() {
    let plan = plan_text(6, 1000);
    let calm = planned("many_calm", &plan);
    ok(&["study", "run", text(&calm)]);
    let study = planned("many", &plan);
    let runs: Vec<Child> = (0..3).map(|_| start(&study, "4")).collect();
    let mut computed = 0;
    for run in runs {
        let output = run.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}", stderr(&output));
        computed += number_before(&stderr(&output), "computed");
    }
    assert_eq!(computed, 72, "every task is computed once");
    same(&merged(&study, &[]), &merged(&calm, &[]), "three runs at once");
    assert_eq!(fs::read_dir(study.join("claims")).unwrap().count(), 0, "no claim is left");
}

#[test]
fn what_a_killed_run_had_claimed_another_one_takes_over() {
    let plan = plan_text(4, 1500);
    let calm = planned("over_calm", &plan);
    ok(&["study", "run", text(&calm)]);
    let study = planned("over", &plan);
    let mut victim = start(&study, "16");
    sleep(Duration::from_millis(60));
    let heir = start(&study, "16");
    sleep(Duration::from_millis(60));
    victim.kill().expect("SIGKILL can be sent");
    victim.wait().expect("it ends");
    let output = heir.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{}", stderr(&output));
    same(&merged(&study, &[]), &merged(&calm, &[]), "after a run beside it was killed");
}

/// Waits until a run works on tasks, that is, until it holds claims.
#[cfg(unix)]
fn at_work(study: &Path) {
    let folder = Folder::open(study).expect("it was planned");
    let is_task = |entry: fs::DirEntry| entry.file_name().len() == 32;
    while !fs::read_dir(folder.claims()).unwrap().flatten().any(is_task) || claimed(&folder) == 0 {
        sleep(Duration::from_millis(1));
    }
}

/// Sends a signal to a run at work; returns its output, and asserts that it ends in time, as an interrupted one.
#[cfg(unix)]
fn signalled(run: Child, study: &Path, signal: &str, limit: Duration) -> String {
    at_work(study);
    let asked = Instant::now();
    let sent = Command::new("kill").args([signal, &run.id().to_string()]).status().expect("kill is there");
    assert!(sent.success());
    let output = run.wait_with_output().expect("it ends");
    let took = asked.elapsed();
    assert!(took < limit, "{signal}: {took:?}");
    assert_eq!(output.status.code(), Some(1), "{signal}: {}", stderr(&output));
    stderr(&output)
}

/// Ctrl-C, and the signal of schedulers at the end of a job's time.
#[cfg(unix)]
#[test]
fn ctrl_c_or_a_scheduler_ends_it_within_a_second_and_it_says_how_to_go_on() {
    let study = planned("ctrl_c", &plan_text(50, 100_000));
    for signal in ["-INT", "-TERM"] {
        let said = signalled(start(&study, "16"), &study, signal, Duration::from_secs(1));
        assert!(said.contains("interrupted: ") && said.contains(" of 600 tasks are done and kept"), "{said}");
        assert!(said.contains(&format!("continue with: leadlag study run {} --batch 16\n", study.display())), "{said}");
    }
    let mut run = command(&["study", "run", text(&study), "--shard", "2/3", "--data", text(data())]);
    let run = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let said = signalled(run, &study, "-TERM", Duration::from_secs(1));
    let (study, data) = (study.display(), data().display());
    assert!(said.contains(&format!("leadlag study run {study} --shard 2/3 --data {data}\n")), "{said}");
}

#[cfg(unix)]
#[test]
fn a_run_that_is_not_to_wait_leaves_tasks_to_the_one_that_works_on_them() {
    let study = planned("no_wait", &plan_text(2, 20_000));
    let mut other = start(&study, "16");
    // A stopped process keeps its claims.
    at_work(&study);
    let stopped = Command::new("kill").args(["-STOP", &other.id().to_string()]).status().expect("kill is there");
    assert!(stopped.success());
    let output = super::common::leadlag(&["study", "run", text(&study), "--no-wait", "--batch", "16"]);
    other.kill().expect("SIGKILL can be sent");
    other.wait().expect("it ends");
    assert!(output.status.success(), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(number_before(&said, "are") > 0 && said.contains("running elsewhere"), "{said}");
    assert!(said.contains(&format!("continue with: leadlag study status {}", study.display())), "{said}");
}

#[test]
fn planning_that_was_interrupted_over_another_plan_is_noticed_by_all() {
    let study = small("half_planned");
    ok(&["study", "run", text(&study)]);
    let other = planned("half_planned_other", &plan_text(3, 400));
    // They are written in this order; the list of tasks would be next.
    for name in ["plan.toml", "study.json"] {
        fs::copy(other.join(name), study.join(name)).unwrap();
    }
    for verb in ["run", "status", "merge", "report"] {
        refused(1, &["study", verb, text(&study)]).says("tasks.jsonl is not the list that study.json was written for");
    }
    ok(&["study", "plan", text(&study.join("plan.toml")), "--out", text(&study)]);
    assert!(ok(&["study", "status", text(&study)]).contains("0 of 36 tasks are done"));
}

/// Generations of 880 calibrations take the reference longer than a run waits after a request to stop.
#[cfg(unix)]
#[test]
fn a_quiet_run_that_is_given_up_still_says_so() {
    let plan = plan_text(220, 100_000).replace("[calibration]", "[calibration]\nevaluator = \"reference\"");
    let study = planned("ctrl_c_quiet", &plan);
    let mut run = command(&["-q", "study", "run", text(&study), "--batch", "1024", "--threads", "1"]);
    let run = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    // Abandoned after 0.7 s; a generation takes longer.
    let said = signalled(run, &study, "-INT", Duration::from_secs(2));
    assert!(said.starts_with("error: interrupted: 0 of 2640 tasks are done"), "{said}");
}

#[test]
fn a_second_run_has_nothing_to_do() {
    let study = small("again");
    ok(&["study", "run", text(&study)]);
    let before = written(&study);
    let output = succeeds(&["study", "run", text(&study)]);
    assert!(stderr(&output).contains("24 tasks: 24 were done, 0 computed"), "{}", stderr(&output));
    assert_eq!(written(&study), before);
}
