//! Scores with derivatives on a GPU.

use crate::common::gpu::{case, gpu, job, population, skipped, variant};
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Differences, EvaluateError, Evaluator};
use leadlag::internal::gpu::Limits;
use leadlag::internal::wgsl::Precision;

const PAPER: Convention = Convention::PAPER;

/// Groups in several parts, and stretches cut by short submissions, give the bits of one part.
#[test]
fn derivatives_do_not_depend_on_parts_or_submissions() {
    if skipped("derivatives_do_not_depend_on_parts_or_submissions") {
        return;
    }
    for name in ["idm", "gipps+delay"] {
        let variant = variant(name);
        let population = population(variant, PAPER, 120, 8);
        let group = |k: usize| Differences { first: 6 * k, steps: vec![1e-2; 2 + k % 4] };
        let groups: Vec<Differences> = (0..20).map(group).collect();
        let bits = |limits| {
            let mut gpu = gpu(vec![case(variant, PAPER, 400, 0.5)], Precision::Plain, limits);
            let mut slopes = gpu.slopes(&job(0, &population), &groups).unwrap().expect("a GPU has slopes");
            // Other groups in the same buffers.
            gpu.slopes(&job(0, &population), &groups[10..]).unwrap();
            let again = gpu.slopes(&job(0, &population), &groups).unwrap().expect("a GPU has slopes");
            slopes.retain(|slopes| slopes.cost.is_finite());
            assert!(slopes.len() > 5, "{name}: {} complete groups", slopes.len());
            assert!(again.iter().filter(|slopes| slopes.cost.is_finite()).eq(&slopes), "{name}");
            format!("{slopes:?}")
        };
        let expected = bits(Limits::NONE);
        assert!(bits(Limits { chunk: Some(37), ..Limits::NONE }) == expected, "{name}: short submissions");
        assert!(bits(Limits { binding: 1 << 15, ..Limits::NONE }) == expected, "{name}: several parts");
        let mut lost =
            gpu(vec![case(variant, PAPER, 400, 0.5)], Precision::Plain, Limits { chunk: Some(90), ..Limits::NONE });
        lost.destroy_device();
        let mut slopes = lost.slopes(&job(0, &population), &groups).unwrap().expect("a GPU has slopes");
        slopes.retain(|slopes| slopes.cost.is_finite());
        assert!(format!("{slopes:?}") == expected, "{name}: a new device");
    }
    let mut small =
        gpu(vec![case(variant("idm"), PAPER, 60, 0.0)], Precision::Plain, Limits { binding: 1 << 12, ..Limits::NONE });
    let few = population(variant("idm"), PAPER, 9, 1);
    let error = small.slopes(&job(0, &few), &[Differences { first: 0, steps: vec![1.0; 8] }]).unwrap_err();
    assert!(matches!(error, EvaluateError::Memory { .. }), "{error}");
}

/// From the facade: in f32 they agree with those in f64.
#[test]
fn normal_equations_of_a_gpu_are_those_in_f64() {
    if skipped("normal_equations_of_a_gpu_are_those_in_f64") {
        return;
    }
    let drives = [(1, 40.0), (2, 60.0)]
        .map(|(seed, s)| leadlag::synthetic(seed, s).and_then(|made| made.follower(1)).expect("sound"));
    for (model, gof) in [("idm", "nrmse-sva"), ("gipps+delay+linear", "rmse-sv:1,0.5"), ("l-cth", "rmspe-sv")] {
        let calibration = || leadlag::Calibration::of(model).and_then(|one| one.minimise(gof)).expect("a measure");
        let on =
            |calibration: leadlag::Calibration| calibration.evaluate_on(&[&drives[0], &drives[1]]).expect("it can be");
        let mut gpu =
            on(calibration().evaluator("gpu").and_then(|one| one.precision("compensated")).expect("there is"));
        let mut exact = on(calibration().precision("f64").expect("there is"));
        let (lower, upper) = (gpu.lower(), gpu.upper());
        let p = lower.len();
        let at = |share: f64| -> Vec<f64> { lower.iter().zip(&upper).map(|(a, b)| a + share * (b - a)).collect() };
        let mut impossible = at(0.4);
        impossible[0] = f64::NAN;
        let whole = [at(0.3), at(0.5), impossible, at(1.0)].concat();
        let found = gpu.normal_equations(&whole).expect("a norm");
        let expected = exact.normal_equations(&whole).expect("a norm");
        assert!(expected.iter().any(|own| own.rtr.is_finite()), "{model}");
        for (i, (own, expected)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(own.rtr.is_finite(), expected.rtr.is_finite(), "{model}");
            if expected.rtr.is_infinite() {
                assert!(own.jtj.iter().chain(&own.jtr).all(|x| x.is_nan()), "{model}");
                continue;
            }
            assert!((own.rtr / expected.rtr - 1.0).abs() < 1e-5, "{model}: {} for {}", own.rtr, expected.rtr);
            let size = |a: usize| expected.jtj[a * p + a].sqrt();
            for a in 0..p {
                let off = (own.jtr[a] - expected.jtr[a]).abs();
                assert!(
                    off <= 0.01 * size(a) * expected.rtr.sqrt(),
                    "{model} {a}: {} for {}",
                    own.jtr[a],
                    expected.jtr[a]
                );
                // On an upper bound differences are taken downwards, across kinks.
                for b in (0..p).filter(|_| i < 3) {
                    let (own, expected) = (own.jtj[a * p + b], expected.jtj[a * p + b]);
                    assert!(
                        (own - expected).abs() <= 0.03 * size(a) * size(b),
                        "{model} {a} {b}: {own} for {expected}"
                    );
                }
            }
        }
    }
    // A difference that f32 cannot resolve: of a narrow range, and far beyond the bounds.
    let narrow = leadlag::Calibration::of("idm").and_then(|one| one.evaluator("gpu")).expect("there is");
    let mut narrow = narrow.bound("v_0", 33.0, 33.001).evaluate_on(&[&drives[0]]).expect("it can be");
    let mut far = narrow.lower();
    far[narrow.parameters().iter().position(|name| *name == "v_0").expect("it is free")] = 1e6;
    for own in narrow.normal_equations(&[narrow.lower(), far].concat()).expect("a norm") {
        let numbers = [own.jtj, own.jtr, vec![own.rtr]].concat();
        assert!(numbers.iter().all(|x| x.is_finite()), "{numbers:?}");
    }
    let theil =
        leadlag::Calibration::of("idm").and_then(|one| one.minimise("u-sva")).and_then(|one| one.evaluator("gpu"));
    let mut theil = theil.expect("a measure").evaluate_on(&[&drives[0]]).expect("it can be");
    let error = theil.normal_equations(&theil.lower()).expect_err("no norm of residuals");
    assert!(error.is_usage(), "{error}");
}
