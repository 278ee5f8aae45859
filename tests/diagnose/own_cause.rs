//! A user's causes in a diagnosis: one that acts is named, and an untestable one is reported.

use crate::common::made_up;
use leadlag::internal::calibrate::Overrides;
use leadlag::internal::diagnose::{Question, Verdict, infer};
use leadlag::internal::extension::Extension;
use leadlag::internal::wgsl::{extension_named, read_extension};
use serde_json::Value;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;

/// The effect of `dead_zone` of the library, under other names.
const BLIND_ZONE: &str = "//! Small errors of the gap are not seen.
struct Parameters {
    /// half width of the unseen range [m], 0 to 8, neutral 0
    width: f32,
}

fn blind_zone_perception(p: Params, own: Parameters, x: Perceived) -> Perceived {
    let error = x.s - equilibrium_spacing(p, x.v_f);
    return Perceived(x.s - clamp(error, -own.width, own.width), x.v_f, x.v_l);
}
";

/// NaN at every size, even at the neutral one.
const BROKEN: &str = "struct Parameters {
    /// size [-], 0 to 1, neutral 0
    q: f32,
}

fn broken_command(own: Parameters, a_cmd: f32) -> f32 {
    return a_cmd + sqrt(-own.q) + own.q / 0.0;
}
";

/// No start value for the speed is known.
const LATE: &str = "struct Parameters {
    /// share that is lost [-], 0 to 1, neutral 0
    share: f32,
    /// speed from which on [m/s], 0 to 40
    v_on: f32,
}

fn late_command(own: Parameters, x: Perceived, a_cmd: f32) -> f32 {
    return select(a_cmd, (1.0 - own.share) * a_cmd, x.v_f > own.v_on);
}
";

/// Has nothing that could be fitted.
const FIXED: &str = "fn fixed_command(a_cmd: f32) -> f32 {
    return 0.9 * a_cmd;
}
";

/// Text and JSON output of `leadlag diagnose` for a synthetic drive of 200 s with these causes of a user.
fn diagnosed(name: &str, effect: &[&str], causes: &[(&str, &str)]) -> (String, Value) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own_cause").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    let run = |arguments: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_leadlag"));
        let output = program.current_dir(&folder).args(arguments).output().expect("the program starts");
        assert!(output.status.success(), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let mut drive = vec!["synth", "--out", "drive", "--seed", "23", "--duration", "200", "--pairs", "--base", "l-cth"];
    drive.extend(effect);
    run(&drive);
    let mut arguments =
        vec!["diagnose", "--data", "drive/pair_follower1.csv", "--base", "l-cth", "--effort", "quick", "--out", "out"];
    for (file, text) in causes {
        fs::write(folder.join(file), text).expect("writable");
        arguments.extend(["--causes", file]);
    }
    let text = run(&arguments);
    let json = fs::read_to_string(folder.join("out/diagnosis.json")).expect("written");
    (text, serde_json::from_str(&json).expect("JSON"))
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array().expect("a list").iter().filter_map(|entry| entry["name"].as_str()).collect()
}

/// The data cannot distinguish two texts with the same effect, and the diagnosis reports that.
#[test]
fn a_copy_of_the_planted_cause_is_as_likely_as_it() {
    let (text, json) = diagnosed("copy", &["--effect", "dead_zone:w=1.3"], &[("blind_zone.wgsl", BLIND_ZONE)]);
    assert_eq!(json["verdict"].as_str(), Some("ambiguous"), "{text}");
    let mut both = [names(&json["causes"]), names(&json["confounded_with"])].concat();
    both.sort_unstable();
    assert_eq!(both, ["blind_zone", "dead_zone"], "{text}");
    for entry in [&json["causes"][0], &json["confounded_with"][0]] {
        let width = entry["parameters"][0]["value"].as_f64().expect("a number");
        assert!((width - 1.3).abs() < 0.02, "{entry}");
    }
    assert_eq!(json["confounded_with"][0]["instead_of"], json["causes"][0]["name"], "{text}");
    for entry in [&json["causes"][0], &json["confounded_with"][0]] {
        assert!(entry["meaning"].as_str().is_some_and(|meaning| !meaning.is_empty()), "{entry}");
    }
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for words in ["l-cth lacks either ", " (these data do not distinguish them)", "as good as "] {
        assert!(flat.contains(words), "{words}: {text}");
    }
}

/// Without the library's own cause in the race, only the user's explains the data.
#[test]
fn a_cause_of_ones_own_is_named() {
    let data = made_up::drives("dead_zone", "l-cth");
    let own = read_extension("blind_zone.wgsl", BLIND_ZONE).expect("valid");
    let broken = read_extension("broken.wgsl", BROKEN).expect("valid");
    let library = |name| extension_named(name).expect("in the library");
    let causes: Vec<&'static Extension> = vec![library("actuation_lag"), own, library("aero_drag"), broken];
    let bounds = Overrides::new();
    let question = made_up::question([&data.train, &data.holdout], "l-cth", &causes, &bounds);
    let found = infer(&question, &mut |_| ControlFlow::Continue(())).expect("a diagnosis");
    assert_eq!(found.verdict, Verdict::Named, "{}", found.reason);
    assert_eq!(found.adopted.iter().map(|cause| cause.extension).collect::<Vec<_>>(), [own], "{}", found.reason);
    // An untestable cause changes nothing for the others.
    let without: Vec<&'static Extension> = causes[..3].to_vec();
    let again = infer(&Question { causes: &without, ..question }, &mut |_| ControlFlow::Continue(()));
    let again = again.expect("a diagnosis");
    assert_eq!(found.extended.log_likelihood.to_bits(), again.extended.log_likelihood.to_bits());
    assert_eq!(found.untried.iter().map(|(cause, _)| *cause).collect::<Vec<_>>(), [broken]);
    assert!(again.untried.is_empty(), "{:?}", again.untried);
}

/// The name of a cause does not matter: the search treats a copy of a limit as it treats the limit of the library.
#[test]
fn a_copy_under_another_name_is_searched_in_the_same_way() {
    let data = made_up::drives("accel_cap", "l-cth");
    let original = extension_named("accel_cap").expect("in the library");
    let copy = read_extension("mine.wgsl", &original.text.replace("accel_cap", "mine")).expect("valid");
    let found = [original, copy].map(|cause| {
        let causes = [cause];
        let bounds = Overrides::new();
        let question = made_up::question([&data.train, &data.holdout], "l-cth", &causes, &bounds);
        infer(&question, &mut |_| ControlFlow::Continue(())).expect("a diagnosis")
    });
    assert_eq!(found[0].adopted.len(), 1, "{}", found[0].reason);
    assert_eq!(found[0].ladder.len(), found[1].ladder.len());
    let [original, copy] = found.map(|found| found.extended.log_likelihood.to_bits());
    assert_eq!(original, copy);
}

#[test]
fn what_could_not_be_tried_is_listed_with_its_reason() {
    let (text, json) =
        diagnosed("untried", &[], &[("broken.wgsl", BROKEN), ("late.wgsl", LATE), ("fixed.wgsl", FIXED)]);
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let listed = json["not_tried"].as_array().expect("a list");
    let expected = [
        ("broken", "gives no finite result at any size tried"),
        ("late", "the data give no start value for v_on"),
        ("fixed", "has no parameter to fit"),
        // A pair file of two cars has no car further ahead.
        ("multi_anticipation", "needs the speed of the car ahead of the preceding vehicle"),
    ];
    for (name, reason) in expected {
        let entry = listed.iter().find(|entry| entry["name"] == name).unwrap_or_else(|| panic!("{name}: {json}"));
        assert_eq!(entry["reason"].as_str(), Some(reason));
        assert!(entry["remedy"].as_str().is_some_and(|remedy| !remedy.is_empty()), "{entry}");
        assert!(flat.contains(&format!("{name} ({reason})")), "{text}");
        assert!(names(&json["ladder"]).iter().all(|tried| *tried != name), "{name} was tried");
    }
    assert!(names(&json["causes"]).is_empty(), "{text}");
}

/// A law without the parameter that a cause changes: the cause is left out, with a reason.
#[test]
fn a_cause_that_needs_what_the_law_lacks_is_not_tried() {
    let data = made_up::drives("accel_cap", "l-cth");
    let causes = made_up::causes(&["headway_mode_change", "accel_cap"]);
    let bounds = Overrides::new();
    let question = made_up::question([&data.train, &data.holdout], "ovm", &causes, &bounds);
    let found = infer(&question, &mut |_| ControlFlow::Continue(())).expect("a diagnosis");
    let [(cause, why)] = &found.untried[..] else { panic!("{:?}", found.untried) };
    assert_eq!((cause.name.as_str(), why.to_string().as_str()), ("headway_mode_change", "ovm has no t_h"));
    assert_eq!(why.remedy(), "diagnose a base model that has a parameter t_h");
    assert!(found.ladder.iter().any(|rung| rung.name == "accel_cap"), "the other one was tried");
}
