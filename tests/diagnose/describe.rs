//! The description of an error: its breakdown and its profiles, on synthetic series with a known answer.

use leadlag::internal::diagnose::describe::covariates::Covariates;
use leadlag::internal::diagnose::describe::error_breakdown::{Errors, Regime, Share, budget};
use leadlag::internal::diagnose::describe::missing::{Class, Missing, Profile, Profiles, profiles};
use leadlag::internal::report::diagnosis::pictures;
use leadlag::internal::report::diagnosis::text::{Again, diagnosis};
use leadlag::internal::report::html;
use leadlag::internal::result::diagnosis::Outcome;
use leadlag::internal::wgsl::extension_named;

const DT: f64 = 0.1;

/// Numbers in -1..1 that look random.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A drive of 900 s on a lap of 2 km: the speed oscillates slowly, and the grade repeats with the position.
fn scene(seed: u64) -> Covariates {
    let mut random = noise(seed);
    let phase = 3.0 * random();
    let count = 9000;
    let t: Vec<f64> = (0..count).map(|i| f64::from(i) * DT).collect();
    let v: Vec<f64> = t.iter().map(|t| 15.0 + 8.0 * (0.05 * t + phase).sin() + 3.0 * (0.31 * t).sin()).collect();
    let a: Vec<f64> = t.iter().map(|t| 0.4 * (0.05 * t + phase).cos() + 0.93 * (0.31 * t).cos()).collect();
    let mut x = 100.0 * phase;
    let place: Vec<f64> = v
        .iter()
        .map(|v| {
            x += v * DT;
            x.rem_euclid(2000.0)
        })
        .collect();
    Covariates {
        label: format!("drive {seed}"),
        s: t.iter().map(|t| 20.0 + 6.0 * (0.083 * t + phase).sin()).collect(),
        dv: t.iter().map(|t| 0.9 * (0.21 * t).sin()).collect(),
        a_l: t.iter().map(|t| 0.5 * (0.17 * t + 1.0).sin()).collect(),
        sin_grade: Some(place.iter().map(|x| 0.03 * (x * std::f64::consts::TAU / 1000.0).sin()).collect()),
        place: Some(place),
        dt: DT,
        t,
        v,
        a,
    }
}

#[test]
fn a_budget_puts_the_error_where_it_is() {
    let scene = scene(1);
    let count = scene.len();
    // The spacing errs everywhere, the speed while braking, the acceleration nowhere.
    let s: Vec<f64> = scene.t.iter().map(|t| (std::f64::consts::TAU * 0.03 * t).sin()).collect();
    let braking = |i: &usize| Regime::of(&scene, *i) == Regime::Braking;
    let v: Vec<f64> = (0..count).map(|i| f64::from(u8::from(braking(&i)))).collect();
    let (a, first) = (vec![0.0; count], 9);
    let errors = Errors { scene: &scene, first, values: [&s[first..], &v[first..], &a[first..]] };
    let budget = budget(&[errors]).expect("there are samples");
    let sum = |of: &dyn Fn(&Share) -> f64| budget.regime.iter().map(of).sum::<f64>();
    let sums = [sum(&|share| share.time), sum(&|share| share.error[0]), sum(&|share| share.error[1])];
    assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 1e-9) && sum(&|share| share.error[2]) == 0.0, "{budget:?}");
    assert!((budget.rms[0] - 0.5_f64.sqrt()).abs() < 0.01 && budget.bias[0].abs() < 0.01);
    let worst = budget.worst_regime(1).expect("a regime");
    let time = (first..count).filter(braking).count() as f64 / (count - first) as f64;
    assert!(worst.name == "braking" && (worst.error[1] - 1.0).abs() < 1e-12, "{worst:?}");
    assert!((worst.time - time).abs() < 1e-12 && (budget.bias[1] - time).abs() < 1e-12, "{worst:?}");
    assert_eq!(self::budget(&[]), None);
}

/// d = -0.3 g sin(grade) + noise that is correlated over seconds.
fn graded(scene: &Covariates, seed: u64) -> Vec<f64> {
    let (mut random, mut slow) = (noise(seed), 0.0);
    let grade = scene.sin_grade.as_ref().expect("a road");
    grade
        .iter()
        .map(|sin| {
            slow = 0.95 * slow + 0.02 * random();
            -0.3 * 9.81 * sin + slow
        })
        .collect()
}

#[test]
fn the_missing_acceleration_follows_the_grade_and_the_place() {
    let scenes = [scene(2), scene(3)];
    let d: Vec<Vec<f64>> = scenes.iter().zip(7..).map(|(scene, seed)| graded(scene, seed)).collect();
    let missing: Vec<Missing> = scenes.iter().zip(&d).map(|(scene, d)| Missing { scene, d, gap_error: None }).collect();
    let found = profiles(&missing).expect("there is d");
    let profile = |name: &str| found.profiles.iter().find(|p| p.name == name).expect("a profile");
    let grade = profile("sine of the grade");
    assert!(grade.explained > 0.5 && grade.chi2 > 20.0, "{grade:?}");
    for class in &grade.classes {
        let truth = -0.3 * 9.81 * class.at;
        assert!((class.mean - truth).abs() < 4.0 * class.error + 0.005, "{class:?}, expected {truth}");
    }
    assert!(found.repeats_by_place.expect("two drives on one lap") > 0.8);
    assert!(profile("acceleration of the car ahead").explained < 0.05);
}

/// Slow errors of unrelated drives: their profiles by place often resemble each other by chance, of several drives more often than of two.
#[test]
fn what_is_slow_does_not_repeat_by_place() {
    for (drives, sets) in [(2, 200), (5, 300)] {
        let repeats = |set: &u64| {
            let scenes: Vec<Covariates> = (0..drives).map(|k| scene(7919 * set + 104_729 * k)).collect();
            let (mut random, mut slow) = (noise(15_485_863 * set + 17), 0.0);
            let mut next = |i: usize| {
                slow = 0.995 * slow + 0.02 * random();
                // One lap, so that nothing is averaged.
                if i < 1200 { slow } else { f64::NAN }
            };
            let d: Vec<Vec<f64>> = scenes.iter().map(|scene| (0..scene.len()).map(&mut next).collect()).collect();
            let missing: Vec<Missing> =
                scenes.iter().zip(&d).map(|(scene, d)| Missing { scene, d, gap_error: None }).collect();
            let found = profiles(&missing).expect("there is d");
            let chance = found.repeats_by_chance.expect("drives on one lap");
            assert!(chance > 0.1 / drives as f64, "set {set} of {drives}: {chance}");
            found.repeats().is_some()
        };
        let repeating = (1..=sets).filter(repeats).count() as u64;
        assert!(100 * repeating <= sets, "{repeating} of {sets} sets of {drives} drives");
    }
}

#[test]
fn noise_depends_on_nothing() {
    for seed in 1..=8 {
        let scenes = [scene(seed), scene(seed + 20)];
        let d: Vec<Vec<f64>> = scenes
            .iter()
            .map(|scene| {
                let (mut random, mut slow) = (noise(seed + 50), 0.0);
                scene
                    .t
                    .iter()
                    .map(|_| {
                        slow = 0.95 * slow + 0.02 * random();
                        slow
                    })
                    .collect()
            })
            .collect();
        let missing: Vec<Missing> =
            scenes.iter().zip(&d).map(|(scene, d)| Missing { scene, d, gap_error: None }).collect();
        let found = profiles(&missing).expect("there is d");
        for profile in &found.profiles {
            assert!(profile.chi2 < 4.0, "seed {seed}: {profile:?}");
        }
    }
}

#[test]
fn parameters_at_bounds_what_is_held_back_and_the_way_on_are_told() {
    let parameter = |name: &str, value: f64, interval: Option<[f64; 2]>| serde_json::json!({"name": name, "value": value, "unit": "m/s", "interval": interval});
    let model = |variant: &str, at_bound: bool| {
        let mut v_0 = parameter("v_0", 60.0, None);
        v_0["at_bound"] = at_bound.into();
        serde_json::json!({"variant": variant, "extensions": [], "sigma_d_mps2": 0.1, "tau_d_s": 1.0, "noise_gap_m": 0.02,
            "noise_speed_mps": 0.02, "log_likelihood": 0.0,
            "parameters": [v_0, parameter("d_0", 2.0, Some([1.9, 2.1]))]})
    };
    let data = |path: &str, role: &str| {
        serde_json::json!({"path": path, "sha256": "", "follower": 1, "name": "", "role": role, "window_s": [0.0, 120.0],
            "samples": 1201, "gap_rate_rms_mps": null, "unseen": []})
    };
    let cause = serde_json::json!({"name": "grade", "family": "grade", "parameters": [], "evidence": 50.0, "threshold": 20.0,
        "threshold_kind": "analytic"});
    let outcome: Outcome = serde_json::from_value(serde_json::json!({
        "schema_version": 1, "verdict": "named", "reason": "", "causes": [cause], "confounded_with": [], "not_testable": [],
        "data_findings": [], "gain": null, "left_over": [], "simulations": 0, "seed": 1, "effort": "quick",
        "data": [data("a.csv", "train"), data("b.csv", "holdout")], "drives": [], "held_back": "", "base": model("idm", true),
        "extended": model("idm+grade", false), "budget": null, "missing": null, "missing_left": null, "ladder": []
    }))
    .expect("an outcome");
    let words =
        ["leadlag", "calibrate", "a.csv", "b.csv", "--joint", "--extend grade", "--grade a/long/way/to/Slope.csv"];
    let words: Vec<String> = words.iter().chain(&["--lead-start 12.5", "--out out"]).map(|w| (*w).to_owned()).collect();
    let said = diagnosis(&outcome, Some(&Again { words, on: "on the training data".to_owned() }));
    assert!(said.contains("a.csv follower 1, 0.0 to 120.0 s\n"), "{said}");
    assert!(said.contains("b.csv follower 1, 0.0 to 120.0 s, held back\n"), "{said}");
    assert_eq!(said.matches("No contradictions were found.").count(), 1, "{said}");
    // Without errors to describe, the section has no title.
    assert!(!said.contains("2. What is wrong") && said.contains("\n3. What explains it?\n"), "{said}");
    let rows: Vec<&str> = said.lines().filter(|line| line.starts_with("  v_0 ")).collect();
    let row = "  v_0  m/s  60.0000*                 60.0000";
    assert!(rows == [row] && said.contains("  * at its bound\n"), "{said}");
    assert!(said.lines().all(|line| line.chars().count() <= 80), "{said}");
    let typed = "To calibrate it on the training data:\n  leadlag calibrate a.csv b.csv --joint --extend grade \\\n    \
                 --grade a/long/way/to/Slope.csv --lead-start 12.5 --out out\n";
    let (_, rest) = said.split_once("To calibrate").expect("a way on");
    assert!(format!("To calibrate{rest}").starts_with(typed), "{rest}");
    // Of many files, those with faults come first.
    let fault = serde_json::json!({"name": "inconsistent", "car": "both", "signal": "gap", "value": 62.0, "unit": "m", "interval": null,
        "file": "9.csv", "when_s": [], "sentence": "the gap jumps", "correction": null});
    let many = Outcome {
        data: (0..10).map(|k| serde_json::from_value(data(&format!("{k}.csv"), "train")).expect("an entry")).collect(),
        data_findings: vec![serde_json::from_value(fault).expect("a finding")],
        ..outcome.clone()
    };
    let said = diagnosis(&many, None);
    assert!(said.contains("9.csv follower") && said.contains("INCONSISTENT: the gap jumps"), "{said}");
    assert!(said.contains("Files not listed: 2, with faults: 0\n") && !said.contains("8.csv follower"), "{said}");
    assert!(!said.contains("To calibrate"), "{said}");
}

/// A diagnosis of IDM with delay and no name, with these fields replaced.
fn outcome(fields: serde_json::Value) -> Outcome {
    let parameter =
        serde_json::json!({"name": "v_0", "value": 60.0, "unit": "m/s", "interval": null, "at_bound": true});
    let mut whole = serde_json::json!({
        "schema_version": 1, "verdict": "nothing", "reason": "no cause passes", "causes": [], "confounded_with": [], "not_testable": [],
        "data_findings": [], "gain": null, "left_over": [], "simulations": 0, "seed": 1, "effort": "quick", "data": [{
            "path": "a.csv", "sha256": "", "follower": 1, "name": "", "role": "train", "window_s": [0.0, 120.0], "samples": 1201,
            "gap_rate_rms_mps": 0.0, "unseen": []
        }],
        "drives": [], "held_back": "", "base": {
            "variant": "idm+delay", "extensions": [], "sigma_d_mps2": 0.1, "tau_d_s": 1.0, "noise_gap_m": 0.02, "noise_speed_mps": 0.02,
            "log_likelihood": 0.0, "parameters": [parameter]
        },
        "extended": null, "budget": null, "missing": null, "missing_left": null, "ladder": []
    });
    fields.as_object().expect("fields").iter().for_each(|(key, value)| whole[key] = value.clone());
    serde_json::from_value(whole).expect("an outcome")
}

/// The same on one line, as text and as a page.
fn said(outcome: &Outcome) -> [String; 2] {
    let flat = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
    [diagnosis(outcome, None), html::diagnosis(outcome, Vec::new(), None)].map(flat)
}

/// Signals with the same fault share a line; a fault in another stretch has its own.
#[test]
fn signals_with_the_same_fault_share_a_line() {
    let fault = |car: &str, when: serde_json::Value| {
        serde_json::json!({"name": "smoothed", "car": car, "signal": "speed", "value": 0.004, "unit": "m/s", "interval": null, "file": "a.csv",
            "when_s": when, "matters": true, "sentence": format!("the speed of the {car}: smoothed"), "correction": null})
    };
    let whole = serde_json::json!([]);
    let findings =
        [fault("leader", whole.clone()), fault("follower", whole), fault("follower", serde_json::json!([[3.0, 9.0]]))];
    let [text, _] = said(&outcome(serde_json::json!({ "data_findings": findings })));
    assert!(text.contains("SMOOTHED: the speed of the leader: smoothed; also speed of follower (0.004 m/s) SMOOTHED: the speed of the follower"), "{text}");
}

#[test]
fn a_base_that_crashes_and_a_likelier_one_are_told_in_text_and_page() {
    let outcome = outcome(serde_json::json!({
        "verdict": "unexplained", "broken_off": [{"label": "a.csv follower 1", "time_s": 2.9, "crash": true}],
        "left_over": [{"kind": "family", "where": "l-idm", "size": 356.3}]
    }));
    let [text, page] = said(&outcome);
    let crash = "a.csv follower 1: the base model collides with the car ahead at t = 2.9 s (all errors end there)";
    let (_, second) = text.split_once("2. What is wrong, and where?").expect("section 2");
    assert!(second.contains(crash) && page.matches(crash).count() == 1, "{text}");
    let next = "Next: the same command with --base l-idm+delay";
    assert!(text.contains(next) && page.contains(next), "{text}");
    // The page marks the same values at their bound as the terminal.
    assert!(text.contains("at its bound") && page.contains("<td>at its bound</td>"), "{text}");
    // Without a crash, no message about one and no key.
    let [_, page] = said(&self::outcome(serde_json::json!({})));
    assert!(!page.contains("collides with the car ahead") && !page.contains("broken_off"));
}

/// The verdict comes first and whole drives second, in the terminal and on the page alike.
#[test]
fn the_verdict_and_whole_drives_agree_in_what_comes_first() {
    let cause = |name: &str| {
        let meaning = extension_named(name).expect("in the library").in_short();
        serde_json::json!([{"name": name, "meaning": meaning, "family": name, "parameters": [], "evidence": 51.0,
            "threshold": 16.0, "threshold_kind": "analytic"}])
    };
    let changed = |extended: f64, interval: [f64; 2]| serde_json::json!({"measure": "nrmse_sva_10s", "base": 1.0, "extended": extended, "interval": interval});
    let (gain, loss) = (changed(0.93, [0.01, 0.13]), changed(1.02, [-0.05, 0.001]));
    let tested = serde_json::json!({"bins": 120, "parts": [4, 4], "policy": {}, "trials": []});
    let mut untested = tested.clone();
    untested["not_testable"] = "the drives have 32 bins".into();
    let mut colliding = tested.clone();
    colliding["trials"] = serde_json::json!([{"causes": ["dead_zone"], "gain": 0.1, "horizons": [], "standard_errors": 5.0, "probability": 0.001,
        "in_set": true, "passes": false, "checks": [{"name": "collisions on left-out drives", "value": 1.0, "limit": 0.0, "met": false}]}]);
    let recommended = serde_json::json!({
        "causes": [{"name": "dead_zone", "meaning": "", "parameters": []}], "why": "confirmed",
        "parameters": {}, "safe": true, "safe_reason": "", "per_drive": [],
        "gain": {"measure": "nrmse_sva_10s", "base": 1.0, "extended": 0.9, "interval": [0.05, 0.15]},
        "confidence_set": [], "collisions": {"base": 0, "extended": 0}
    });
    let mut other = recommended.clone();
    other["causes"][0]["name"] = "grade".into();
    let mut helpful = recommended.clone();
    helpful["why"] = "helps".into();
    helpful["causes"]
        .as_array_mut()
        .expect("a list")
        .push(serde_json::json!({"name": "grade", "meaning": "", "parameters": []}));
    let named = "idm+delay lacks dead_zone (small errors of the gap are not corrected).";
    let once = "idm+delay lacks headway_mode_change (another gap setting was chosen).";
    let falls = "With it, the error on unseen drives falls by 7 % [1, 13].";
    let rises = "With it, the error on unseen drives rises by 2 % [0, 5].";
    for (name, closed_loop, gain, recommended, sentences) in [
        ("dead_zone", &tested, Some(gain), None, [named, "Do not use it yet.", falls]),
        ("dead_zone", &tested, Some(loss), None, [named, "Do not use it yet.", rises]),
        ("dead_zone", &untested, None, None, [named, "Whole drives could not test it: the drives have 32 bins.", ""]),
        (
            "headway_mode_change",
            &tested,
            None,
            None,
            [once, "Whole drives cannot test an effect that occurs only once: do not use it for other drives.", ""],
        ),
        (
            "dead_zone",
            &tested,
            None,
            Some(recommended),
            [named, "Recommended: idm+delay with dead_zone; the error on unseen drives falls by", ""],
        ),
        (
            "dead_zone",
            &colliding,
            None,
            Some(other),
            [
                named,
                "Do not use it yet, because a check fails (collisions on left-out drives: 1, limit 0).",
                "Recommended: idm+delay with grade; the error on unseen drives falls by",
            ],
        ),
        (
            "dead_zone",
            &tested,
            None,
            Some(helpful),
            [
                named,
                "Not named, but supported by whole drives: grade.",
                "Recommended: idm+delay with dead_zone and grade; the error on unseen drives falls by",
            ],
        ),
    ] {
        let outcome = outcome(serde_json::json!({
            "verdict": "named", "causes": cause(name), "gain": gain, "closed_loop": closed_loop, "recommended": recommended
        }));
        let [text, page] = said(&outcome);
        let plain = page.replace("<strong>", "").replace("</strong>", "");
        assert!(text.starts_with(format!("In short {}", sentences.join(" ")).trim_end()), "{text}");
        assert_eq!(
            text.contains("the error on unseen drives"),
            outcome.gain.is_some() || outcome.recommended.is_some(),
            "{text}"
        );
        assert!(sentences.iter().all(|sentence| plain.contains(sentence)), "{plain}");
        assert!(!text.contains("as well as any") && !page.contains("as well as any"), "{text}");
    }
}

/// Drives in which nothing can be tested say why at once, and only once more beside the verdict.
#[test]
fn the_reason_why_nothing_can_be_tested_comes_first() {
    let why = "hardly any reaction; check which car is ahead";
    let closed_loop = serde_json::json!({"bins": 90, "parts": [4, 4], "policy": {}, "trials": [], "not_testable": why});
    let [text, page] = said(&outcome(serde_json::json!({
        "verdict": "not_testable", "reason": why, "closed_loop": closed_loop, "causes": []
    })));
    assert!(
        text.starts_with(&format!("In short These data do not show what idm+delay lacks: {why}. 1. Are")),
        "{text}"
    );
    // What follows the page is the result, as JSON.
    let page = page.split("<script").next().expect("text");
    assert_eq!([text.matches(why).count(), page.matches(why).count()], [2, 2], "{text}");
}

/// A rival is listed beside the cause that it could replace; if a file does not name that cause, beside the first.
#[test]
fn a_rival_stands_beside_its_own_cause() {
    let cause = |name: &str, instead_of: Option<&str>| {
        serde_json::json!({"name": name, "family": name, "parameters": [], "evidence": 51.0, "threshold": 16.0,
            "threshold_kind": "analytic", "instead_of": instead_of})
    };
    for (instead_of, said_as, place) in [
        (
            Some("dead_zone"),
            "lacks grade, and either dead_zone or periodic (these data do not distinguish them).",
            "dead_zone",
        ),
        (None, "lacks either grade or periodic (these data do not distinguish them), and dead_zone.", "grade"),
    ] {
        let [text, page] = said(&outcome(serde_json::json!({
            "verdict": "ambiguous", "causes": [cause("grade", None), cause("dead_zone", None)],
            "confounded_with": [cause("periodic", instead_of)]
        })));
        assert!(text.contains(said_as) && page.contains(said_as), "{text}");
        assert!(text.contains(&format!("as good as {place}: periodic")), "{text}");
        assert_eq!(page.matches("As good as").count(), 1, "{page}");
        assert!(page.contains(&format!("As good as {place}")), "{page}");
    }
}

/// Without a name, the text says which gain the drives could have shown, and how much driving would decide.
#[test]
fn without_a_name_the_text_says_what_the_drives_could_have_shown() {
    let power =
        |minutes: Option<f64>| serde_json::json!({"gain": 0.062, "causes": ["dead_zone", "grade"], "minutes": minutes});
    let tested = serde_json::json!({"bins": 120, "parts": [4, 4], "policy": {}, "trials": []});
    let found = |minutes| said(&outcome(serde_json::json!({ "power": power(minutes), "closed_loop": tested })));
    let first = "These drives show a gain of 6 % at 15 s with a probability of 80 %, smaller ones less often.";
    let then = "About 35 more minutes of such driving would decide on dead_zone with grade.";
    // Ten times the given driving time is not useful advice.
    for (minutes, is_told) in [(Some(35.2), true), (None, false), (Some(900.0), false)] {
        for words in found(minutes) {
            assert!(words.contains(first) && words.contains(then) == is_told, "{words}");
        }
    }
}

/// The score of the base on an unseen drive is printed with or without a cause.
#[test]
fn the_base_on_what_is_held_back_is_always_told() {
    let entry = |label: &str, rms: Option<[f64; 3]>| {
        serde_json::json!({"label": label, "rms": rms, "nrmse_sva": rms.map(|_| 0.75),
        "recommended": rms.map(|rms| serde_json::json!({"rms": rms.map(|x| 0.5 * x), "nrmse_sva": 0.375}))})
    };
    let drives = [entry("b.csv follower 1", Some([5.25, 0.75, 0.5])), entry("c.csv follower 1", None)];
    let [text, page] = said(&outcome(serde_json::json!({ "base_held_back": drives })));
    assert!(text.contains("b.csv follower 1 5.250 2.625 0.750 0.375 0.500 0.250 0.750 0.375"), "{text}");
    assert!(text.contains("c.csv follower 1 NaN NaN") && text.contains("NaN: the simulation ends early."), "{text}");
    assert!(page.contains("Errors on data left out of the fits") && page.contains(">5.25<"), "{page}");
    assert!(page.contains("<td>recommended</td>") && page.contains(">2.625<"), "{page}");
    let [text, page] = said(&outcome(serde_json::json!({})));
    assert!(!text.contains("left out of the fits") && !page.contains("left out of the fits"));
}

/// If no cause is found, the text lists the causes that were not tried and the unexplained acceleration.
#[test]
fn nothing_found_says_what_was_not_tried_and_what_is_left() {
    let untried = serde_json::json!([{"name": "grade", "reason": "needs the road grade", "needs": "the road grade", "remedy": "give --grade FILE"}]);
    let first = "No cause was found that idm+delay lacks. An acceleration of 0.10 m/s² with a time constant of 1 s \
                 remains unexplained. \
                 Not tried: grade (needs the road grade).";
    let [text, page] = said(&outcome(serde_json::json!({ "not_tried": untried })));
    assert!(text.starts_with(&format!("In short {first}")) && page.contains(first), "{text}");
    let road = serde_json::json!([{"kind": "road", "where": "the place on the road, most at 1160 m", "size": 0.25}]);
    let [text, page] = said(&outcome(serde_json::json!({ "not_tried": untried, "left_over": road })));
    let place = "It depends on the place on the road, as on slopes: give the grade of the road (--grade).";
    assert!(text.split("1. Are").next().is_some_and(|short| short.contains(place)) && page.contains(place), "{text}");
}

#[test]
fn data_that_contradict_themselves_come_before_the_verdict() {
    let mut data = serde_json::to_value(&outcome(serde_json::json!({})).data).expect("data");
    data[0]["units"] = "the gap changes 0.278 times as much as the speeds say".into();
    let finding = |unit: &str| {
        serde_json::json!([{"name": "inconsistent", "car": "both", "signal": "gap", "value": 62.0, "unit": unit, "interval": null,
            "file": "a.csv", "when_s": [], "sentence": "the gap jumps", "correction": null}])
    };
    for (fields, first) in [
        (serde_json::json!({ "data": data }), Some("The units of the data contradict each other (section 1)")),
        (
            serde_json::json!({ "data_findings": finding("m/s") }),
            Some("Gap and speeds contradict each other (section 1)"),
        ),
        (serde_json::json!({ "data_findings": finding("m") }), None),
        (
            serde_json::json!({ "data_findings": finding("m"), "verdict": "bad_base" }),
            Some("no base model can follow them: correct the data first (section 1)"),
        ),
    ] {
        let outcome = outcome(fields);
        let [text, page] = said(&outcome);
        let Some(first) = first else {
            assert!(text.contains("no cause passes") && !text.contains("DATA FIRST"), "{text}");
            let (_, lead) = page.split_once("<p class=\"verdict").expect("a verdict");
            assert!(
                lead.split("</p>").next().is_some_and(|lead| lead.contains("No cause was found that idm+delay lacks."))
            );
            continue;
        };
        let (before, verdict) = text.split_once("Tentative verdict: ").expect("a verdict that is not relied on");
        assert!(
            before.contains("THE DATA FIRST. ") && before.contains(first) && verdict.contains("no cause passes"),
            "{text}"
        );
        let (_, lead) = page.split_once("<p class=\"verdict").expect("a verdict");
        assert!(lead.contains(first) && lead.find(first) < lead.find("no cause passes"), "{first}");
        let units = outcome.data[0].units.is_some();
        assert_eq!(text.contains("UNITS: the gap changes 0.278 times"), units, "{text}");
        assert_eq!(outcome.has_bad_data(), first.contains("contradict each other"));
    }
}

#[test]
fn only_neighbouring_classes_are_joined_by_a_line() {
    let class =
        |number: usize| Class { number: Some(number), at: number as f64, mean: 0.1, error: 0.01, seconds: 10.0 };
    let drawn = |numbers: &[usize]| {
        let classes = numbers.iter().map(|number| class(*number)).collect();
        let profile = Profile { name: "place".to_owned(), unit: "m".to_owned(), classes, explained: 0.5, chi2: 9.0 };
        let svg = pictures::missing(
            "",
            &Profiles { rms: 0.1, profiles: vec![profile], repeats_by_place: None, repeats_by_chance: None },
            None,
        );
        (svg.matches("<polyline").count(), svg.matches("<circle").count())
    };
    let (whole, split) = (drawn(&[0, 1, 2, 3]), drawn(&[0, 1, 5, 6, 9]));
    assert_eq!((whole.0, split.0), (1, 2), "a line for each stretch of neighbours, none for a class without stretches");
    assert_eq!(split.1 - whole.1, 1, "a point for each class");
    // The profiles number the classes of a lap, a part of which was never driven.
    let mut gap = scene(3);
    let d: Vec<f64> = gap
        .place
        .as_ref()
        .expect("a lap")
        .iter()
        .map(|x| if (600.0..900.0).contains(x) { f64::NAN } else { 0.1 })
        .collect();
    gap.label = "a gap".to_owned();
    let found = profiles(&[Missing { scene: &gap, d: &d, gap_error: None }]).expect("classes");
    let place = found.profiles.iter().find(|profile| profile.name == "place").expect("known");
    let numbers: Vec<usize> = place.classes.iter().map(|class| class.number.expect("numbered")).collect();
    assert!(numbers.windows(2).any(|pair| pair == [9, 15]), "{numbers:?}");
}
