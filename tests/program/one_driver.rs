//! Drives of different drivers that are given as one car are detected, and drives of one are not.

use crate::common::program::{edited, leadlag, ok, scratch, stderr, stdout, succeeds, text};
use leadlag::internal::optimize::{normal, stream};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A pair file of an IDM driver with this time gap [s], noise and a separate leader.
fn file(folder: &Path, name: &str, t_h: f64, seed: u64) -> PathBuf {
    let mut rng = stream(seed, 0, 0, 0);
    let mut table = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    let (mut v_l, mut v, mut s, mut lasting) = (15.0, 15.0, 2.5 + t_h * 15.0 + 4.0, 0.0);
    for k in 0..2400 {
        let t = k as f64 * 0.1;
        let [seen_l, seen, gap] = [v_l, v, s].map(|x| x + 0.03 * normal(&mut rng));
        writeln!(table, "{t:.1},{seen_l:.3},{:.3},{gap:.3}", seen.max(0.0)).expect("a String takes all");
        lasting = 0.93 * lasting + 0.04 * normal(&mut rng);
        let wanted = 2.5 + (t_h * v + v * (v - v_l) / (2.0 * 1.4_f64.sqrt() * 1.5_f64.sqrt())).max(0.0);
        let a = 1.4 * (1.0 - (v / 33.0).powi(4) - (wanted / s).powi(2)) + lasting;
        let ahead = 15.0 + 6.0 * (t / 11.0 + seed as f64).sin() + 3.0 * (t / 4.7).cos();
        let next_l = v_l + 0.1 * (ahead - v_l).clamp(-2.0, 1.5);
        let next = (v + 0.1 * a).max(0.0);
        s += 0.05 * (v_l + next_l - v - next);
        (v_l, v) = (next_l, next);
    }
    let path = folder.join(name);
    std::fs::write(&path, table).expect("room");
    path
}

#[test]
fn a_joint_calibration_says_so() {
    let folder = scratch("one_driver", "joint");
    let close = file(&folder, "close.csv", 1.0, 1);
    let [same, far] = [file(&folder, "same.csv", 1.0, 2), file(&folder, "far.csv", 1.5, 3)];
    for (other, is_one) in [(&same, true), (&far, false)] {
        let out = folder.join(if is_one { "one" } else { "two" });
        let given = ["calibrate", text(&close), text(other), "--joint", "--model", "idm", "--bounds", "human"];
        let output =
            leadlag(&[&given[..], &["--max-evaluations", "6000", "--no-intervals", "--out", text(&out)]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let (said, result) =
            (stderr(&output) + &stdout(&output), std::fs::read_to_string(out.join("result.json")).expect("written"));
        assert_eq!(!said.contains("hardly have one driver"), is_one, "{said}");
        assert_eq!(!result.contains("hardly have one driver"), is_one);
        if !is_one {
            assert!(stdout(&output).contains("\n\nNOT ONE DRIVER"), "{}", stdout(&output));
            assert!(result.contains("t_h is about 1.") && result.contains("s in far follower 1"), "{result}");
        }
    }
}

/// Two drives with noisy speeds.
fn noisy(folder: &Path) -> [PathBuf; 2] {
    let mut rng = stream(9, 0, 0, 0);
    ["a.csv", "b.csv"].map(|name| {
        let path = file(folder, name, 1.0, 7);
        let read = std::fs::read_to_string(&path).expect("written");
        let noisy = edited(&read, |_, fields| {
            let speed: f64 = fields[2].parse().expect("a number");
            fields[2] = format!("{:.3}", (speed + 0.1 * normal(&mut rng)).max(0.0));
        });
        std::fs::write(&path, noisy).expect("room");
        path
    })
}

/// A fault that several drives have is one paragraph, with the number of drives and the first one.
#[test]
fn a_fault_of_several_drives_is_told_once() {
    let folder = scratch("one_driver", "noisy");
    let noisy = noisy(&folder);
    let given =
        ["calibrate", text(&noisy[0]), text(&noisy[1]), "--joint", "--model", "idm", "--max-evaluations", "300"];
    let said = stdout(&leadlag(&[&given[..], &["--no-intervals", "--out", text(&folder.join("fit"))]].concat()));
    assert_eq!(said.matches("DATA NOISY").count(), 1, "{said}");
    assert!(
        said.replace("\n  ", " ").contains(&format!("DATA NOISY on 2 of 2 drives, here {}: ", text(&noisy[0]))),
        "{said}"
    );
}

/// The text of a fleet counts the pairs that have the same fault and does not list them.
#[test]
fn a_fault_of_all_pairs_of_a_fleet_is_told_once() {
    let folder = scratch("one_driver", "noisy_fleet");
    let files = noisy(&folder);
    let out = folder.join("fleet");
    let given = ["calibrate", text(&files[0]), text(&files[1]), "--all", "--model", "idm", "--no-intervals"];
    let said = stdout(&leadlag(&[&given[..], &["--max-evaluations", "300", "--out", text(&out)]].concat()));
    let told =
        "2 pairs with doubtful data, in column findings of the table: all (noisy); leadlag inspect has the remedies";
    assert!(said.replace("\n    ", " ").contains(told), "{said}");
}

/// Noise of the acceleration does not change a score of spacings: no verb warns of it, and no pair is doubtful.
#[test]
fn noise_of_a_signal_that_is_not_compared_is_no_fault() {
    let folder = scratch("one_driver", "not_compared");
    let files = noisy(&folder);
    let run = |kind: &str, gof: &str| {
        let out = folder.join(format!("{kind}_{gof}"));
        let given = ["calibrate", text(&files[0]), text(&files[1]), kind, "--model", "idm", "--bounds", "human"];
        let more = ["--gof", gof, "--max-evaluations", "300", "--no-intervals", "--out", text(&out)];
        let output = leadlag(&[&given[..], &more].concat());
        let page = out.with_extension("html");
        ok(&["report", text(&out), "-o", text(&page)]);
        // Behind the text comes the result itself, with every finding.
        let page = std::fs::read_to_string(page).expect("written");
        let (page, _) = page.split_once("<script").expect("there are charts");
        (stderr(&output) + &stdout(&output) + page).to_lowercase()
    };
    for kind in ["--all", "--joint"] {
        for (gof, is_told) in [("nrmse-sva", true), ("rmse-a", true), ("rmse-s", false), ("u-sv", false)] {
            let said = run(kind, gof);
            assert_eq!(said.contains("noisy"), is_told, "{kind} {gof}: {said}");
            // A fleet names it in one line.
            let is_told = is_told && kind == "--joint";
            assert_eq!(said.contains("the acceleration of the follower"), is_told, "{kind} {gof}: {said}");
        }
    }
    assert!(ok(&["inspect", text(&files[0])]).contains("the acceleration of the follower"));
}

/// One drive of another driver among several is reported, too.
#[test]
fn one_among_many_is_told() {
    let folder = scratch("one_driver", "many");
    let mut files: Vec<PathBuf> = (10..14).map(|seed| file(&folder, &format!("same{seed}.csv"), 1.0, seed)).collect();
    files.push(file(&folder, "far.csv", 1.5, 14));
    let said = |files: &[PathBuf]| {
        let out = folder.join(files.len().to_string());
        let given: Vec<&str> = ["calibrate"].into_iter().chain(files.iter().map(|file| text(file))).collect();
        let more = ["--joint", "--model", "idm", "--bounds", "human", "--max-evaluations", "2000", "--no-intervals"];
        let output = succeeds(&[&given[..], &more, &["--out", text(&out)]].concat());
        (stderr(&output) + &stdout(&output)).contains("hardly have one driver")
    };
    assert!(said(&files) && !said(&files[..4]));
}

#[test]
fn a_diagnosis_says_so_before_all_else() {
    let folder = scratch("one_driver", "diagnosis");
    let close = file(&folder, "close.csv", 1.0, 4);
    let [same, far] = [file(&folder, "same.csv", 1.0, 5), file(&folder, "far.csv", 1.5, 6)];
    for (other, flag, is_one) in [(&same, "--data", true), (&far, "--data", false), (&far, "--holdout", false)] {
        let both = format!("{},{}", text(&close), text(other));
        let given = match flag {
            "--data" => vec!["diagnose", "--data", &both],
            _ => vec!["diagnose", text(&close), "--holdout", text(other)],
        };
        let more = ["--base", "idm", "--effort", "quick", "--exit-code", "--json"];
        let output = leadlag(&[&given[..], &more].concat());
        let said = stdout(&output);
        assert_eq!(!said.contains("different_drivers"), is_one, "{flag}: {said}");
        assert_eq!(output.status.code() != Some(7), is_one, "{flag}: {}", stderr(&output));
    }
    // The same driver by its errors, and two by the data.
    let [acc, human] = [(&close, "ACC"), (&same, "Human")].map(|(path, driver)| {
        let table = std::fs::read_to_string(path).expect("written");
        let named: String = table
            .lines()
            .enumerate()
            .fold(String::new(), |all, (i, line)| all + line + "," + if i == 0 { "driver" } else { driver } + "\n");
        let path = folder.join(format!("{driver}.csv"));
        std::fs::write(&path, named).expect("room");
        path
    });
    let said = ok(&["diagnose", text(&acc), text(&human), "--base", "idm", "--effort", "quick"]);
    let flat = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(flat.contains("DIFFERENT_DRIVERS: the data name 2 drivers, such as ACC in "), "{said}");
    assert!(said.lines().all(|line| line.chars().count() <= 80 || line.contains('/')), "{said}");
}
