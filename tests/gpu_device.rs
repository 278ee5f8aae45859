//! Evaluators share a device; one that is lost is replaced for all of them. In a separate program, because its device is lost for
//! the whole process.

mod common;

use common::gpu::{case, gpu, population, scores, skipped, variant};
use leadlag::internal::convention::Convention;
use leadlag::internal::gpu::{Gpu, Limits};
use leadlag::internal::wgsl::Precision;

#[test]
fn a_shared_device_that_is_lost_is_replaced_for_all() {
    if skipped("a_shared_device_that_is_lost_is_replaced_for_all") {
        return;
    }
    let evaluator =
        |name, limits| gpu(vec![case(variant(name), Convention::PAPER, 300, 0.0)], Precision::Plain, limits);
    let run = |gpu: &mut Gpu, name| scores(gpu, &population(variant(name), Convention::PAPER, 50, 1));
    let mut idm = evaluator("idm", Limits::NONE);
    let mut gipps = evaluator("gipps+delay", Limits::NONE);
    let mut alone = evaluator("idm", Limits { chunk: Some(100), ..Limits::NONE });
    assert!(idm.shares_device_with(&gipps), "evaluators that ask for no less than there is share");
    assert!(!idm.shares_device_with(&alone), "one that asks for less has its own");
    let expected = [run(&mut idm, "idm"), run(&mut gipps, "gipps+delay")];

    idm.destroy_device();
    // Each evaluator detects the loss without a message from the other, and both end on the same new one.
    assert!(run(&mut gipps, "gipps+delay") == expected[1] && run(&mut idm, "idm") == expected[0]);
    assert!(idm.shares_device_with(&gipps));
    assert!(run(&mut alone, "idm") == expected[0], "what happened to the others is nothing to it");
    assert!(evaluator("l-cth", Limits::NONE).shares_device_with(&idm), "a later one gets the new one, too");
}
