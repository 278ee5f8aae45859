//! The same text on the GPU and on the CPU gives the same bits, for all ninety variants: status, cuts, every sum, every score.

mod common;
mod gpu_common;

use gpu_common::{case, gpu, job, population, scores, skipped, variant};
use leadlag::catalog::Variant;
use leadlag::convention::Convention;
use leadlag::evaluator::Observer;
use leadlag::gpu::Limits;
use leadlag::lanes::{Lanes, LanesPrecision};
use leadlag::score::GoodnessOfFit;
use leadlag::wgsl::Precision;

/// Candidates, of how many, whose raw sums or score differ; nothing may on a software adapter. Hardware may fuse products.
fn differences(variant: Variant, convention: Convention, precision: Precision) -> (usize, bool) {
    let case = case(variant, convention, 1000, 0.0);
    let population = population(variant, convention, 96, 7);
    let mut gpu = gpu(vec![case.clone()], precision, Limits::NONE);
    let lanes_precision = match precision {
        Precision::Plain => LanesPrecision::Plain,
        Precision::Compensated => LanesPrecision::Compensated,
    };
    let mut lanes = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, lanes_precision).unwrap_or_else(|e| panic!("{e}"));
    let jobs = [job(0, &population)];
    let (a, b) = (gpu.raw(&jobs).unwrap(), lanes.raw(&jobs).unwrap());
    let (x, y) = (scores(&mut gpu, &population), scores(&mut lanes, &population));
    let mut count = 0;
    for i in 0..population.len() {
        // Sums of a run that ended early mean nothing.
        let same = a[i].status == b[i].status && (a[i].status != 0 || format!("{:?}", a[i]) == format!("{:?}", b[i]));
        let same = same && format!("{:?}", x[i]) == format!("{:?}", y[i]);
        if !same {
            if count == 0 {
                println!(
                    "{variant}, {convention}, {precision:?}, candidate {i}:\n  gpu   {:?} {:?}\n  lanes {:?} {:?}",
                    a[i], x[i], b[i], y[i]
                );
            }
            count += 1;
        }
    }
    (count, gpu.is_hardware())
}

fn assert_equal(precision: Precision) {
    let authors = ["idm+delay", "gipps+linear", "gipps+delay+nonlinear+mfc", "l-cth+constant"].map(variant);
    let all = Variant::all().map(|v| (v, Convention::PAPER));
    let mut bad = Vec::new();
    for (variant, convention) in all.chain(authors.map(|v| (v, Convention::AUTHORS))) {
        let (count, is_hardware) = differences(variant, convention, precision);
        if count > 0 && !is_hardware {
            bad.push(format!("{variant} ({convention}): {count} of 96"));
        }
    }
    assert!(bad.is_empty(), "{} combinations differ:\n{}", bad.len(), bad.join("\n"));
}

#[test]
fn bits_are_equal_plain() {
    if !skipped("bits_are_equal_plain") {
        assert_equal(Precision::Plain);
    }
}

#[test]
fn bits_are_equal_compensated() {
    if !skipped("bits_are_equal_compensated") {
        assert_equal(Precision::Compensated);
    }
}

#[test]
fn observed_runs_are_equal() {
    if skipped("observed_runs_are_equal") {
        return;
    }
    for name in ["idm", "gipps+delay+linear+constant", "l-cth+nonlinear+mfc"] {
        let (variant, convention) = (variant(name), Convention::PAPER);
        let case = case(variant, convention, 1050, 0.0);
        let population = population(variant, convention, 96, 3);
        let mut gpu = gpu(vec![case.clone()], Precision::Plain, Limits::NONE);
        let mut lanes = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain).unwrap();
        let observer = Observer { gain: [0.2, 0.01, -0.05, 0.1], whitening: [0.9, 0.1, 1.1], block: 100 };
        let (a, b) = (gpu.observed(&job(0, &population), &observer), lanes.observed(&job(0, &population), &observer));
        for (i, (a, b)) in a.unwrap().iter().zip(b.unwrap()).enumerate() {
            assert_eq!(a.raw.status, b.raw.status, "{name}, candidate {i}");
            if a.raw.status == 0 && !gpu.is_hardware() {
                assert_eq!(*a, b, "{name}, candidate {i}");
            }
        }
    }
}
