//! Folders of results change as a whole: killed at any moment, a calibration, a merge and a synthetic drive leave the old files or the new
//! ones.
//!
//! `LEADLAG_KILLS=200` sets the number of kills; by default a few.

use crate::common::program::{leadlag, ok, scratch, stderr, text};
use crate::common::sample;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

type Files = BTreeMap<String, Vec<u8>>;

/// For each command, number of kills that must hit while a folder is being changed.
fn kills() -> usize {
    std::env::var("LEADLAG_KILLS").map_or_else(|_| sample::times(12), |kills| kills.parse().expect("a number"))
}

/// The files of a folder that readers see, except for those with times and the command.
fn visible(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).expect("it is there").flatten();
    let files = entries.filter(|entry| {
        entry.path().is_file() && entry.file_name() != "timing.json" && entry.file_name() != "run.json"
    });
    // A file may disappear during the listing.
    files.filter_map(|file| Some((file.file_name().into_string().ok()?, fs::read(file.path()).ok()?))).collect()
}

fn is_part_of(found: &Files, whole: &Files) -> bool {
    found.iter().all(|(name, content)| whole.get(name) == Some(content))
}

/// Moments at which to kill, spread evenly over the time that a change takes.
struct Moments(u64);

impl Moments {
    fn next(&mut self, below: Duration) -> Duration {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        below.mul_f64((self.0 >> 40) as f64 / (1_u64 << 24) as f64)
    }
}

/// Starts a command and waits until it begins to change the folder; `None` if it ended before the change was detected.
fn begun(command: &[&str], folder: &Path) -> Option<std::process::Child> {
    let new = folder.join(".leadlag-new");
    // Files left by the previous one would count as a start.
    let _ = fs::remove_dir_all(&new);
    let mut child = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    let child = child.args(command).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = child.spawn().expect("the program starts");
    while !new.exists() {
        if child.try_wait().expect("it can be asked").is_some() {
            return None;
        }
        sleep(Duration::from_micros(100));
    }
    Some(child)
}

/// Changes a folder with two commands in turn, killing each; `read` is a command that reads the folder.
fn kill(folder: &Path, commands: [&[&str]; 2], read: &[&str]) {
    let results = commands.map(|command| {
        ok(command);
        visible(folder)
    });
    assert_ne!(results[0], results[1], "two results");
    let mut child = begun(commands[0], folder).expect("it takes a while");
    let began = Instant::now();
    child.wait().expect("it ends");
    let whole = began.elapsed();
    let (mut hits, mut turn, mut moments) = (0, 0, Moments(1));
    let mut seen = [0; 3];
    while hits < kills() {
        turn += 1;
        assert!(turn < 20 * kills(), "the change is hardly ever seen");
        let Some(mut child) = begun(commands[turn % 2], folder) else { continue };
        sleep(moments.next(whole));
        child.kill().expect("SIGKILL can be sent");
        hits += usize::from(child.wait().expect("it ends").code().is_none());
        let found = visible(folder);
        let parts = [0, 1].map(|k| is_part_of(&found, &results[k]));
        assert!(parts[0] || parts[1], "after {hits} kills: files of two results: {:?}", found.keys());
        let output = leadlag(read);
        assert!(output.status.success(), "after {hits} kills: {}", stderr(&output));
        let found = visible(folder);
        let whole = results.iter().position(|result| *result == found);
        assert!(whole.is_some(), "after {hits} kills: no whole result: {:?}", found.keys());
        seen[whole.unwrap_or(2)] += 1;
    }
    eprintln!("{hits} kills while the folder was changed in {whole:?}; then the results were there {seen:?} times");
    for command in commands {
        ok(command);
        let left: Vec<PathBuf> = fs::read_dir(folder).expect("it is there").flatten().map(|e| e.path()).collect();
        assert!(left.iter().all(|path| !path.to_string_lossy().contains(".leadlag-")), "{left:?}");
    }
}

#[test]
fn a_killed_calibration_leaves_the_old_result_or_the_new_one() {
    let (data, folder) = (platoons_of("calibrations"), scratch("killed", "calibrated"));
    let files: Vec<String> =
        ["one", "two"].iter().map(|name| data.join(name).join("platoon.csv").display().to_string()).collect();
    let command = |seed: &'static str| -> Vec<String> {
        let fixed =
            ["calibrate", &files[0], &files[1], "--follower", "1", "--joint", "--model", "l-cth", "--seed", seed];
        let further = ["--max-evaluations", "300", "--no-intervals", "--optimizer", "ga", "--out", text(&folder)];
        fixed.iter().chain(&further).map(|&word| word.to_owned()).collect()
    };
    let [one, two] = ["1", "2"].map(command);
    let [one, two] = [&one, &two].map(|words| words.iter().map(String::as_str).collect::<Vec<_>>());
    let page = scratch("killed", "page").join("page.html");
    kill(&folder, [&one, &two], &["report", text(&folder), "--out", text(&page)]);
}

/// Two synthetic platoons.
fn platoons_of(name: &str) -> PathBuf {
    let folder = scratch("killed", name);
    for (name, seed) in [("one", "1"), ("two", "2")] {
        ok(&["synth", "--out", text(&folder.join(name)), "--seed", seed, "--duration", "60"]);
    }
    folder
}

#[test]
fn a_killed_merge_leaves_the_old_tables_or_the_new_ones() {
    let (data, study) = (platoons_of("studied"), scratch("killed", "study"));
    let plan = format!(
        "schema_version = 1\n[data]\nfolder = {:?}\n[[platoon]]\nname = \"S1\"\nfile = \"one/platoon.csv\"\nfollowers = [1, 2]\n\
         [calibration]\nvariants = [\"idm\", \"l-cth\"]\nreplicates = 4\nseed = 1\noptimizer = \"ga\"\nmax_evaluations = 200\n",
        text(&data)
    );
    let file = scratch("killed", "plan").join("plan.toml");
    fs::write(&file, plan).expect("it can be written");
    ok(&["study", "plan", text(&file), "--out", text(&study)]);
    ok(&["study", "run", text(&study)]);
    // Other tables: half the parts are elsewhere.
    let (parts, further) = (study.join("parts"), scratch("killed", "further"));
    let mut names: Vec<_> =
        fs::read_dir(&parts).expect("it was run").flatten().map(|entry| entry.file_name()).collect();
    names.sort();
    for name in names.iter().take(names.len() / 2) {
        fs::rename(parts.join(name), further.join(name)).expect("the same disk");
    }
    let all = ["study", "merge", text(&study), "--parts", text(&further)];
    let half = ["study", "merge", text(&study), "--partial"];
    kill(&study.join("merged"), [&all, &half], &["study", "status", text(&study)]);
}

/// The next one completes or replaces an unfinished change.
#[test]
fn a_killed_synth_leaves_the_old_drive_or_the_new_one() {
    let folder = scratch("killed", "synth");
    let command = |seed: &'static str| ["synth", "--out", text(&folder), "--seed", seed, "--duration", "60"];
    let with_pairs = [&command("2")[..], &["--pairs"]].concat();
    kill(&folder, [&command("1"), &with_pairs], &command("1"));
}
