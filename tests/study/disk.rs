//! A full disk: an error that reports it, no incomplete file, and the same bytes once there is room.
//!
//! On every system: a limit on the size of files, which makes every write of a part fail. Where the test may mount a file system (root on
//! Linux): a real one of 48 KiB that fills up during the run; elsewhere that part is skipped by name.

#![cfg(unix)]

use super::common::{expected, files, leadlag, merged, ok, part_names, same, scratch, small, stderr, text};
use leadlag::internal::study::folder::write_whole;
use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn a_limit_on_file_sizes_stops_the_run_and_leaves_nothing_half_written() {
    let study = small("limit");
    // 1 block is 512 or 1024 bytes, less than any part. Without the signal, the write fails as on a full disk.
    let script = "trap '' XFSZ; ulimit -f 1; exec \"$0\" study run \"$1\"";
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_leadlag"), text(&study)])
        .output()
        .expect("a shell is there");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains(": cannot write the file\n  because: "), "{said}");
    assert!(said.contains("0 of 24 tasks are done and kept; after a correction: leadlag study run"), "{said}");
    assert_eq!(files(&study.join("parts")).len(), 0, "nothing is left of what could not be written");
    ok(&["study", "run", text(&study)]);
    same(&merged(&study, &[]), expected(), "after the limit");
}

/// A mounted file system that goes away with the value.
struct Mounted<'a>(&'a Path);

impl Drop for Mounted<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0).status();
    }
}

fn mount(folder: &Path, size: &str) -> bool {
    let options = format!("size={size}");
    let mut mount = Command::new("mount");
    mount.args(["-t", "tmpfs", "-o", &options, "tmpfs"]).arg(folder);
    mount.output().is_ok_and(|output| output.status.success())
}

#[test]
fn a_disk_that_fills_up_stops_the_run_and_keeps_what_is_done() {
    let study = small("full");
    let parts = study.join("parts");
    if !mount(&parts, "48k") {
        eprintln!("SKIPPED a_disk_that_fills_up_stops_the_run_and_keeps_what_is_done: no permission to mount");
        return;
    }
    let mounted = Mounted(&parts);
    let output = leadlag(&["study", "run", text(&study), "--batch", "3"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert!(said.contains("No space left on device"), "{said}");
    let done = part_names(&study);
    assert!(!done.is_empty() && done.len() < 24, "{} parts fit", done.len());
    let kept = files(&parts);
    assert!(kept.keys().all(|name| name.ends_with(".json")), "{:?}", kept.keys());
    let saved = scratch("full_saved");
    kept.iter().for_each(|(name, bytes)| fs::write(saved.join(name), bytes).unwrap());
    drop(mounted);
    kept.iter().for_each(|(name, bytes)| fs::write(parts.join(name), bytes).unwrap());
    let output = leadlag(&["study", "run", text(&study)]);
    let before = format!("24 tasks: {} were done", done.len());
    assert!(stderr(&output).contains(&before), "{}", stderr(&output));
    same(&merged(&study, &[]), expected(), "after the full disk");
}

#[test]
fn a_file_that_is_read_while_it_is_written_is_the_old_or_the_new_one() {
    let path = scratch("whole").join("file");
    let contents = [b'a', b'b'].map(|byte| vec![byte; 2_000_000]);
    write_whole(&path, &contents[0]).unwrap();
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| (0..40).for_each(|i| write_whole(&path, &contents[i % 2]).unwrap()));
        while !writer.is_finished() {
            let found = fs::read(&path).expect("it is there at any moment");
            assert!(contents.contains(&found), "{} bytes, not those of one writing", found.len());
        }
    });
    assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "nothing else is left");
}
