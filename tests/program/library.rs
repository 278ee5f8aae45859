//! The facade of the library returns the same bytes as the program.

use crate::common::program::{ok, scratch, text};
use leadlag::{Calibration, Diagnosis, Evaluator, Fit, Fleet, Pairs, Reading, Values, read, synthetic};
use std::fs;
use std::ops::ControlFlow;

#[test]
fn a_calibration() {
    let folder = scratch("library", "calibration");
    ok(&["synth", "--out", text(&folder), "--seed", "1", "--duration", "60", "--pairs"]);
    let file = folder.join("pair_follower1.csv");
    let out = folder.join("out");
    let words = ["--model", "gipps+delay", "--bounds", "human", "--fix", "theta=0.5", "--seed", "2"];
    ok(&[&["calibrate", text(&file)][..], &words, &["--max-evaluations", "2000", "--out", text(&out)]].concat());
    let told = fs::read_to_string(out.join("result.json")).expect("it was written");

    let drive = read(&file).expect("sound").follower(1).expect("there");
    let calibration = Calibration::of("gipps+delay").expect("a variant").bounds("human").fix("theta", 0.5);
    let calibration = calibration.seed(2).max_evaluations(2000);
    let fit = calibration.run(&drive).expect("feasible");
    assert_eq!(fit.to_json(), told);
    assert_eq!(Fit::read(out.join("result.json")).expect("sound").to_json(), told);
    let simulated = fit.simulate(&drive).expect("it can be");
    assert!((simulated.scores["nrmse_sva"] - fit.score()).abs() < 1e-12);
    assert_eq!(simulated.time.len(), drive.len());
    assert!(fit.to_string().contains("theta"), "{fit}");

    // The rest of the calibration is in the result, too.
    let again = Fit::from_json(&told).expect("sound").calibration().expect("known").max_evaluations(2000);
    assert_eq!(again.run(&drive).expect("feasible").parameters(), fit.parameters());

    let mut evaluator: Evaluator =
        calibration.precision("f64").expect("there is").evaluate_on(&[&drive]).expect("it can be");
    let names = evaluator.parameters();
    assert!(!names.contains(&"theta"), "{names:?}");
    let best: Vec<f64> = names.iter().map(|name| fit.parameters()[*name]).collect();
    let scores = evaluator.scores(&[best.clone(), evaluator.upper()].concat()).expect("they can be");
    assert!((scores[0] - fit.score()).abs() < 1e-9 && scores[1] >= scores[0], "{scores:?}");
    assert_eq!(evaluator.simulate(&best, 0).expect("it can be")[0][0], simulated.spacing);
    assert!(evaluator.scores(&best[1..]).expect_err("a value is missing").is_usage());

    // An interruption keeps the results so far.
    let mut calls = 0;
    let stopped = calibration_of("idm").run_on(&[&drive], &mut |_| {
        calls += 1;
        if calls > 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let stopped = stopped.expect("one generation");
    assert!(stopped.intervals().is_empty() && stopped.score().is_finite());
}

/// On two drives of unequal length, for a measure with weights, and with a convention that refuses candidates at a bound.
#[test]
fn residuals_and_normal_equations() {
    let drives = [(1, 40.0), (2, 60.0)].map(|(seed, s)| synthetic(seed, s).and_then(|m| m.follower(1)).expect("sound"));
    let drives = [&drives[0], &drives[1]];
    let samples: usize = drives.iter().map(|drive| drive.len()).sum();
    for (model, gof) in [("idm", "nrmse-sva"), ("gipps+delay+linear", "rmse-sv:1,0.5"), ("l-cth", "rmspe-sv")] {
        let calibration = calibration_of(model).minimise(gof).and_then(|one| one.precision("f64")).expect("a measure");
        let mut evaluator = calibration.evaluate_on(&drives).expect("it can be");
        let (lower, upper) = (evaluator.lower(), evaluator.upper());
        let p = lower.len();
        let at = |share: f64| -> Vec<f64> { lower.iter().zip(&upper).map(|(a, b)| a + share * (b - a)).collect() };
        let whole = [at(0.3), at(0.5)].concat();
        let scores = evaluator.scores(&whole).expect("they can be");
        let (residuals, equations) =
            (evaluator.residuals(&whole).expect("a norm"), evaluator.normal_equations(&whole).expect("a norm"));
        assert!(scores.iter().any(|score| score.is_finite()), "{model}: {scores:?}");
        for (i, score) in scores.into_iter().enumerate() {
            let own = &equations[i];
            assert_eq!(residuals[i].len(), 3 * samples);
            if score.is_infinite() {
                assert!(own.rtr.is_infinite() && own.jtj.iter().chain(&own.jtr).all(|x| x.is_nan()));
                assert!(residuals[i].iter().all(|r| r.is_infinite()));
                continue;
            }
            let square: f64 = residuals[i].iter().map(|r| r * r).sum();
            assert!((square / score - 1.0).abs() < 1e-12 && (own.rtr / score - 1.0).abs() < 1e-12, "{model} {score}");
            // Derivatives of the residuals themselves.
            let candidate = &whole[i * p..(i + 1) * p];
            let steps: Vec<f64> = (0..p).map(|j| 1e-5 * (upper[j] - lower[j])).collect();
            let moved = |j: usize, sign: f64| {
                let mut moved = candidate.to_vec();
                moved[j] += sign * steps[j];
                evaluator.residuals(&moved).expect("a norm").remove(0)
            };
            let derivative = |j: usize| -> Vec<f64> {
                moved(j, 1.0)
                    .iter()
                    .zip(moved(j, -1.0))
                    .map(|(above, below)| (above - below) / (2.0 * steps[j]))
                    .collect()
            };
            let jacobian: Vec<Vec<f64>> = (0..p).map(derivative).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            for a in 0..p {
                let size = dot(&jacobian[a], &jacobian[a]).sqrt();
                let off = (dot(&jacobian[a], &residuals[i]) - own.jtr[a]).abs();
                assert!(off <= 1e-3 * size * score.sqrt(), "{model} {a}: {off} of {size}");
                for b in 0..p {
                    let sizes = size * dot(&jacobian[b], &jacobian[b]).sqrt();
                    let off = (dot(&jacobian[a], &jacobian[b]) - own.jtj[a * p + b]).abs();
                    assert!(off <= 1e-3 * sizes, "{model} {a} {b}: {off} of {sizes}");
                }
            }
        }
    }
    let mut theil =
        calibration_of("idm").minimise("u-sva").expect("a measure").evaluate_on(&drives).expect("it can be");
    let error = theil.residuals(&theil.lower()).expect_err("no norm of residuals");
    assert!(error.is_usage() && error.to_string().starts_with("gof u-sva has no residuals"), "{error}");
    assert!(theil.normal_equations(&theil.lower()).is_err());
}

fn calibration_of(model: &str) -> Calibration {
    Calibration::of(model).expect("a variant")
}

/// A law that can be simulated for a few values of its parameter only, so that a short search finds none: a fold that fails does not cost
/// the calibration, whose replicates found some.
#[test]
fn a_fold_that_fails_leaves_the_calibration() {
    const NARROW: &str = "struct Parameters {
    /// a value that has to be right [-], 0 to 1
    right: f32,
    /// gain [1/s], 0.1 to 2
    gain: f32,
}
fn narrow_law(own: Parameters, x: Perceived) -> f32 {
    let a = own.gain * (x.v_l - x.v_f) + 0.1 * (x.s - 3.0 - 1.2 * x.v_f);
    return select(1.0e30, a, abs(own.right - 0.5) < 0.0005);
}
";
    let folder = scratch("library", "folds");
    let law = folder.join("narrow.wgsl");
    fs::write(&law, NARROW).expect("room");
    let drives = [1, 2].map(|seed| synthetic(seed, 60.0).and_then(|m| m.follower(1)).expect("sound"));
    let drives = [&drives[0], &drives[1]];
    let calibration = calibration_of(text(&law)).optimizer("lshade").expect("known").intervals(false);
    let calibration = calibration.max_evaluations(100).seed(3).folds(2);
    let run = |calibration: Calibration| calibration.run_on(&drives, &mut |_| ControlFlow::Continue(()));
    assert!(run(calibration.clone()).is_err());
    let fit = run(calibration.replicates(20)).expect("some replicate finds it");
    assert!(fit.score().is_finite() && !fit.to_json().contains("held_back"));
    let [told] = fit.warnings() else { panic!("{:?}", fit.warnings()) };
    assert!(told.starts_with("--folds: ") && told.ends_with("has no scores of left-out drivers"), "{told}");
}

#[test]
fn a_fleet() {
    let folder = scratch("library", "fleet");
    ok(&["synth", "--out", text(&folder), "--seed", "3", "--duration", "40", "--pairs"]);
    let file = folder.join("platoon.csv");
    ok(&["calibrate", text(&file), "--all", "--model", "idm", "--model", "gipps", "--out", text(&folder.join("out"))]);
    let pairs = Pairs::read(&Reading::default(), &[&file]).expect("sound");
    let table = Fleet::of(&["idm", "gipps"]).expect("variants").run(&pairs).expect("it can be");
    let csv = leadlag::internal::report::csv::write(&table);
    assert!(csv == fs::read(folder.join("out/parameters.csv")).expect("it was written"));
    assert!(matches!(table.columns[0].values, Values::Integer(_)));
    assert!(Fleet::of(&["idm", "idm"]).expect_err("twice").is_usage());
}

#[test]
fn a_diagnosis() {
    let drives = [1, 2].map(|seed| synthetic(seed, 120.0).and_then(|made| made.follower(1)).expect("sound"));
    let diagnosis = Diagnosis::of("l-cth").and_then(|one| one.effort("quick")).expect("known");
    let findings = diagnosis.run(&[&drives[0], &drives[1]], &[]).expect("long enough");
    assert!(findings.to_string().starts_with(findings.verdict()));
    assert!(findings.to_json().contains("\"verdict\""));
    let held_back_twice = diagnosis.run(&[&drives[0]], &[&drives[0]]).expect_err("it is trained on");
    assert!(held_back_twice.is_usage(), "{held_back_twice}");
}

#[test]
fn errors_say_what_to_do() {
    for (error, part) in [
        (Calibration::of("idn").expect_err("no variant"), "did you mean"),
        (calibration_of("idm").evaluator("cpu").expect_err("no evaluator"), "expected lanes, reference, gpu or auto"),
        (read("no_such.csv").expect_err("no file"), "no_such.csv"),
        (synthetic(1, 60.0).expect("sound").follower(2).expect_err("one follower"), "follower"),
    ] {
        assert!(error.to_string().contains(part), "{error}");
    }
}

/// Arguments that a caller may give and the command line cannot.
#[test]
fn settings_that_cannot_be_are_refused() {
    let drive = synthetic(1, 60.0).expect("it can be").follower(1).expect("there");
    let text = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned()
        + &(0..400).map(|k| format!("{:.1},20,20,30\n", f64::from(k) / 10.0)).collect::<String>();
    let mut reading = Reading::default();
    reading.segment = Some(0);
    let error = reading.text(text.as_bytes(), "steady").and_then(|read| read.follower(1)).expect_err("from 1 on");
    assert!(error.is_usage() && error.to_string().starts_with("--segment 0"), "{error}");

    for (name, ends) in [("zz", [1.0, 2.0]), ("v_0", [40.0, 20.0]), ("v_0", [f64::NAN, 40.0]), ("t_h", [0.0, 0.0])] {
        let [lower, upper] = ends;
        let calibration = Calibration::of("idm").expect("a variant").bound(name, lower, upper);
        let diagnosis = Diagnosis::of("idm").expect("a variant").bound(name, lower, upper);
        for error in [calibration.run(&drive).err(), diagnosis.run(&[&drive], &[]).err()] {
            let error = error.expect("bounds that cannot be");
            assert!(error.is_usage() && error.to_string().contains(name), "{error}");
        }
    }
    let fixed = Calibration::of("idm").expect("a variant").bound("v_0", 25.0, 40.0).fix("v_0", 50.0);
    assert!(fixed.run(&drive).expect_err("outside").to_string().contains("[25, 40]"));

    let mut evaluator = Calibration::of("idm").expect("a variant").evaluate_on(&[&drive]).expect("it can be");
    let middle: Vec<f64> = evaluator.lower().iter().zip(evaluator.upper()).map(|(a, b)| 0.5 * (a + b)).collect();
    let mut negative = middle.clone();
    negative[evaluator.parameters().iter().position(|name| *name == "t_h").expect("idm has one")] = -1.2;
    let alone = evaluator.scores(&middle).expect("they can be")[0];
    let candidates = [negative, middle].concat();
    assert_eq!(evaluator.scores(&candidates).expect("they can be"), [f64::INFINITY, alone]);
    let error = evaluator.simulate(&candidates, 0).expect_err("a negative headway").to_string();
    assert!(error.starts_with("candidate 0: t_h"), "{error}");
}
