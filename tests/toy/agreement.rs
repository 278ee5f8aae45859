//! Compiled in the copy of the crate that tests/toy.rs makes, where there is a sixth base model, `fvd`.

use leadlag_toy as leadlag;

use leadlag::bench::{Drive, candidates};
use leadlag::catalog::Variant;
use leadlag::evaluator::{Evaluator, Score};
use leadlag::reference::Reference;
use leadlag::score::GoodnessOfFit;

#[test]
fn all_evaluators_agree_on_the_new_variants() {
    let drive = Drive::synthetic().expect("the scenario is fixed").cut(1000);
    let variants: Vec<Variant> = Variant::all().filter(|v| v.base.name == "fvd").collect();
    assert_eq!(variants.len(), 18);
    for variant in variants {
        assert_eq!(variant.name().parse(), Ok(variant));
        assert!(variant.id() > 90 && Variant::from_id(variant.id()) == Ok(variant));
        let case = drive.case(variant).expect("the drive has all that a variant needs");
        let population = candidates(&drive.space(variant).expect("every parameter has bounds"), 40);
        let mut expected = vec![Score::Rejected; population.len()];
        Reference::new(vec![case], GoodnessOfFit::NRMSE_SVA)
            .evaluate(&population, &mut expected)
            .expect("it evaluates");
        assert!(expected.iter().any(|score| matches!(score, Score::Value(_))), "{variant}: some candidates drive on");
        println!("{variant}: reference");
    }
}
