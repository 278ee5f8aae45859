//! Compiled in the copy of the crates that tests/toy.rs makes, where there are a further law, `fvd_linear`, a further cause,
//! `linear_drag`, and a further measure, `range`.

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../common/cars.rs"]
mod cars;

use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Evaluator, Score};
use leadlag::internal::gpu::{AdapterChoice, Gpu};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::Reference;
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::synthetic::{self, Effect, Noise, Scenario};
use leadlag::internal::wgsl::{Precision, extension_named};

/// Relative difference of scores over 1,000 samples. Not smaller: a run amplifies the last bit of the same operations in f64 in another
/// order, and f32 has 24 bits.
const CLOSE: [(&str, f64); 3] = [("f64", 1e-9), ("plain", 1e-4), ("compensated", 1e-4)];

#[test]
fn all_evaluators_agree_on_the_new_variants() {
    let drive = cars::drive(99.9);
    assert_eq!(drive.len(), 1000);
    // With each combination of parts that IDM has in Table 1.
    let laws = Variant::all().filter(|v| v.base.name == "idm").map(|idm| {
        let name = idm.name().replacen("idm", "fvd_linear", 1);
        let variant: Variant = name.parse().expect("the law is built in");
        assert_eq!((variant.name(), variant.id()), (name, 0));
        variant
    });
    let drag = extension_named("linear_drag").expect("the cause is built in");
    let extended = ["idm", "gipps", "l-cth"].map(|base| base.parse::<Variant>().expect("a base").with(drag));
    let extended = extended.map(|variant| variant.expect("they go together"));
    let gofs = ["nrmse-sva", "range-sva"].map(|name| name.parse::<GoodnessOfFit>().expect("the measure is built in"));
    for (k, variant) in laws.chain(extended).enumerate() {
        let gof = gofs[k % 2];
        let case = cars::case(&drive, variant, Convention::PAPER);
        let population = cars::spread(variant, Convention::PAPER, 40, 1, 0.0);
        let mut evaluators: Vec<Box<dyn Evaluator>> = Vec::new();
        for precision in [LanesPrecision::F64, LanesPrecision::Plain, LanesPrecision::Compensated] {
            evaluators
                .push(Box::new(Lanes::new(vec![case.clone()], gof, precision).expect("the shader can be compiled")));
        }
        if std::env::var_os("LEADLAG_NO_GPU").is_none() {
            let gpu = Gpu::new(vec![case.clone()], gof, Precision::Plain, &AdapterChoice::Best);
            evaluators.push(Box::new(gpu.expect("an adapter, or LEADLAG_NO_GPU=1")));
        }
        let expected = scores(&mut Reference::new(vec![case], gof), &population);
        assert!(expected.iter().any(|score| matches!(score, Score::Value(_))), "{variant}: some candidates drive on");
        for evaluator in &mut evaluators {
            let found = scores(evaluator.as_mut(), &population);
            let (name, precision) = (evaluator.name(), evaluator.precision());
            let (_, close) = CLOSE.into_iter().find(|(name, _)| *name == precision).expect("every precision is there");
            let disagree: Vec<_> = expected
                .iter()
                .zip(&found)
                .filter(|pair| match pair {
                    (Score::Value(a), Score::Value(b)) => (a - b).abs() > close * a,
                    (a, b) => a != b,
                })
                .collect();
            // A few candidates from the whole box are so unstable that no f32 program follows the f64 one.
            let allowed = if precision == "f64" { 0 } else { found.len() / 10 };
            assert!(
                disagree.len() <= allowed,
                "{variant}: {name} {precision} disagrees with the reference on {} of {} candidates: {disagree:?}",
                disagree.len(),
                found.len()
            );
        }
        let names: Vec<String> = evaluators.iter().map(|e| format!("{} {}", e.name(), e.precision())).collect();
        println!("{variant}: reference = {}", names.join(" = "));
    }
}

fn scores(evaluator: &mut dyn Evaluator, population: &leadlag::internal::evaluator::Population) -> Vec<Score> {
    let mut scores = vec![Score::Rejected; population.len()];
    evaluator.evaluate(population, &mut scores).expect("it evaluates");
    scores
}

/// With the cause, the synthetic car drives slower.
#[test]
fn the_plant_has_the_new_cause() {
    let last = |effects: Vec<Effect>| {
        let mut scenario = Scenario { noise: Noise::NONE, duration_s: 120.0, ..Scenario::default() };
        scenario.followers.truncate(1);
        scenario.followers[0].effects = effects;
        *synthetic::run(&scenario).expect("it drives").gap[0].last().expect("samples")
    };
    let drag = "linear_drag:c1=0.02".parse().expect("a known effect");
    assert!(last(vec![drag]) > last(Vec::new()) + 0.1);
}
