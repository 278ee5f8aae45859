//! The command that calibrates the extended model of a diagnosis: on the training data, read and treated in the same way.

use super::super::demo::quoted;
use super::super::folder::RECOMMENDED_BOUNDS;
use super::Args;
use crate::api::reading::Reading;
use crate::report::diagnosis::text::Again;
use crate::result::diagnosis::{DataEntry, Outcome};
use crate::trajectory::{Preparation, Reconcile};
use crate::wgsl::extension_named;
use std::path::Path;

/// The command, if a cause is named; `trained` has the window of every file with a held-back end.
pub fn command(args: &Args, outcome: &Outcome, trained: &[[f64; 2]]) -> Option<Again> {
    let (causes, trained): (Vec<&str>, _) = match &outcome.recommended {
        // The recommended model was judged on whole files.
        Some(recommended) => (recommended.causes.iter().map(|cause| cause.name.as_str()).collect(), &[][..]),
        None => (outcome.causes.iter().map(|cause| cause.name.as_str()).collect(), trained),
    };
    let base = outcome.base.as_ref().filter(|_| !causes.is_empty())?;
    let files: Vec<String> = args.trained_on().map(|file| file.display().to_string()).collect();
    let mut words = vec!["leadlag".to_owned(), "calibrate".to_owned()];
    words.extend(files.iter().map(|file| quoted(file)));
    if files.len() > 1 || args.all {
        words.push("--joint".to_owned());
    }
    let mut flag = |name: &str, value: Option<String>| {
        words.extend(value.map(|value| format!("--{name} {value}").trim_end().to_owned()))
    };
    // With a column map a follower is an id, which differs from the number in the result.
    let number = outcome.data.first().filter(|_| args.prepare.columns.is_none()).and_then(DataEntry::follower);
    flag("follower", args.follower.as_deref().map(quoted).or(number.map(|number| number.to_string())));
    flag("model", Some(base.variant.clone()));
    for cause in causes {
        flag("extend", Some(extension(args, cause)));
    }
    let one_window = trained.first().filter(|first| trained.iter().all(|window| window == *first));
    data_flags(&args.prepare, one_window, &mut flag);
    match (&outcome.recommended, &args.out) {
        // With the bounds of the diagnosis, and the user's own.
        (Some(_), Some(out)) => flag("bounds", Some(path(&out.join(RECOMMENDED_BOUNDS)))),
        _ => args.bounds.iter().for_each(|given| flag("bounds", Some(quoted(given)))),
    }
    flag("seed", (args.seed != 1).then(|| args.seed.to_string()));
    flag("out", Some(args.out.as_ref().map_or("extended".to_owned(), |out| path(&out.join("extended")))));
    let on = match &outcome.recommended {
        Some(_) => "on whole files".to_owned(),
        None => on(trained, one_window),
    };
    Some(Again { words, on })
}

/// The data of the command, in words.
fn on(trained: &[[f64; 2]], one_window: Option<&[f64; 2]>) -> String {
    match (trained, one_window) {
        ([], _) => "on the training files".to_owned(),
        (_, Some([from, to])) => format!("on the training data, {from:.1} to {to:.1} s"),
        (_, None) => "on whole files, including the held-back data".to_owned(),
    }
}

/// Options for reading and treating the data that the user has set.
fn data_flags(data: &Reading, window: Option<&[f64; 2]>, flag: &mut impl FnMut(&str, Option<String>)) {
    let Reading {
        layout,
        columns,
        trajectory,
        segment,
        from,
        to,
        max_gap_s,
        smooth,
        resample_s,
        correct,
        reconcile,
        vehicle,
        grade,
        lead_length_m,
        lead_start_m,
        measure: _,
    } = data;
    flag("layout", layout.map(|layout| layout.to_string()));
    flag("columns", columns.as_deref().map(quoted));
    flag("trajectory", trajectory.as_deref().map(quoted));
    // The window lies within one segment, and its samples would have other numbers.
    flag("segment", segment.filter(|_| window.is_none()).map(|k| k.to_string()));
    flag("from", window.map(|[from, _]| *from).or(*from).map(time));
    flag("to", window.map(|[_, to]| *to).or(*to).map(time));
    flag("max-gap", (*max_gap_s != Preparation::default().max_gap_s).then(|| max_gap_s.to_string()));
    if *smooth {
        flag("smooth", Some(String::new()));
    }
    if *correct {
        flag("correct", Some(String::new()));
    }
    flag("resample", resample_s.map(|step| step.to_string()));
    flag("reconcile", (*reconcile == Reconcile::Speeds).then(|| "speeds".to_owned()));
    flag("vehicle", vehicle.as_deref().map(quoted));
    flag("grade", grade.as_deref().map(quoted));
    flag("lead-length", lead_length_m.map(|length| length.to_string()));
    flag("lead-start", lead_start_m.map(|position| position.to_string()));
}

/// A built-in cause by its name, a user's by its file.
fn extension(args: &Args, name: &str) -> String {
    let file = args.causes.iter().find(|file| file.file_stem().is_some_and(|stem| stem == name));
    match file {
        Some(file) if extension_named(name).is_none() => path(file),
        _ => name.to_owned(),
    }
}

fn path(path: &Path) -> String {
    quoted(&path.display().to_string())
}

/// A time as in files: within the tolerance of the grid, without rounding errors of sums of 0.1.
fn time(seconds: f64) -> String {
    let text = format!("{seconds:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    /// The command after a diagnosis of an IDM by these words, in which `grade` was named.
    fn after(words: &[&str], trained: &[[f64; 2]]) -> (String, String) {
        after_by(words, trained, 2)
    }

    fn after_by(words: &[&str], trained: &[[f64; 2]], follower: usize) -> (String, String) {
        let Line { args } = Line::try_parse_from([&["diagnose"][..], words].concat()).expect("good words");
        let data = serde_json::json!({"path": "a.csv", "sha256": "", "follower": follower, "name": "", "role": "train",
            "window_s": [0.0, 120.0], "samples": 1201, "gap_rate_rms_mps": null, "unseen": []});
        let base = serde_json::json!({"variant": "idm", "extensions": [], "parameters": [], "sigma_d_mps2": 0.0, "tau_d_s": 0.0,
            "noise_gap_m": 0.0, "noise_speed_mps": 0.0, "log_likelihood": 0.0});
        let cause = serde_json::json!({"name": "grade", "family": "grade", "parameters": [], "evidence": 50.0, "threshold": 20.0,
            "threshold_kind": "analytic"});
        let outcome: Outcome = serde_json::from_value(serde_json::json!({
            "schema_version": 1, "verdict": "named", "reason": "", "causes": [cause], "confounded_with": [], "not_testable": [],
            "data_findings": [], "gain": null, "left_over": [], "simulations": 0, "seed": 1, "effort": "quick", "data": [data],
            "drives": [], "held_back": "", "base": base, "extended": base, "budget": null, "missing": null,
            "missing_left": null, "ladder": []
        }))
        .expect("an outcome");
        let again = command(&args, &outcome, trained).expect("something is named");
        (again.words.join(" "), again.on)
    }

    #[test]
    fn every_option_of_the_data_is_repeated() {
        let (typed, on) = after(&["a.csv", "--base", "idm"], &[[0.0, 266.6]]);
        let rest = "--model idm --extend grade --from 0 --to 266.6 --out extended";
        assert_eq!(typed, format!("leadlag calibrate a.csv --follower 2 {rest}"));
        assert_eq!(on, "on the training data, 0.0 to 266.6 s");

        let data =
            "--trajectory 7 --max-gap 2 --smooth --correct --resample 0.1 --reconcile speeds --vehicle bmw_x5 --grade";
        let more = "--lead-length 4.5 --lead-start -20 --bounds wide.toml --seed 3";
        let line = format!("--base idm --data a.csv,b.csv --columns ngsim --follower 24 {data} level {more} --out d");
        let words: Vec<&str> = line.split(' ').chain(["--from", "5", "--to", "90"]).collect();
        let held = [&words[..], &["--segment", "2", "--holdout", "c.csv"]].concat();
        let start = "leadlag calibrate a.csv b.csv --joint --follower 24 --model idm --extend grade --columns ngsim --trajectory 7";
        let rest = data.strip_prefix("--trajectory 7 ").expect("its first words");
        let expected = format!("{start} --segment 2 --from 5 --to 90 {rest} level {more} --out d/extended");
        assert_eq!(after(&held, &[]), (expected, "on the training files".to_owned()));

        // If the ends differ, the files share no window.
        let (typed, on) = after(&words, &[[5.0, 60.0], [5.0, 61.0]]);
        assert!(typed.contains("--from 5 --to 90") && on.starts_with("on whole files"), "{typed} {on}");
        let (typed, _) = after(&[&words[..], &["--segment", "2"]].concat(), &[[5.0, 61.0], [5.0, 61.0]]);
        assert!(typed.contains("--from 5 --to 61") && !typed.contains("--segment"), "{typed}");
    }

    /// A file of a fleet stands for all its followers.
    #[test]
    fn a_fleet_has_no_follower() {
        let (typed, _) = after_by(&["a.csv", "--all", "--base", "idm"], &[], 0);
        assert_eq!(typed, "leadlag calibrate a.csv --joint --model idm --extend grade --out extended");
    }

    #[test]
    fn times_are_written_as_files_write_them() {
        assert_eq!([0.0, 0.1 + 0.2, 120.0, -0.1].map(time), ["0", "0.3", "120", "-0.1"]);
    }
}
