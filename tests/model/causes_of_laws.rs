//! Every cause on every law: it runs, or the message names the parameter that the law lacks.

use crate::common::extended::{case, spread};
use leadlag::internal::catalog::Variant;
use leadlag::internal::evaluator::{Evaluator, Job};
use leadlag::internal::extension::Extension;
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::wgsl::{laws, library, read_extension};
use rayon::prelude::*;

/// Samples of a run: longer than any cause delays.
const SAMPLES: usize = 40;

/// A law of the user's own without any parameter of the paper.
const BARE: &str = "struct Parameters {
    /// gain for the speed difference [1/s], 0.1 to 1
    gain: f32,
}
fn bare_law(own: Parameters, x: Perceived) -> f32 {
    return own.gain * (x.v_l - x.v_f);
}
";

/// One with some of them, which has a state, and which reads them from the model.
const HALF: &str = "struct Parameters {
    v_0: f32,
    d_0: f32,
    /// gain for the gap [1/s], 0.1 to 1
    gain: f32,
}
struct State {
    /// acceleration before [m/s2], starts at a_f
    last: f32,
}
struct Done { a: f32, state: State }
fn half_law(p: Params, own: Parameters, state: State, w: World, x: Perceived) -> Done {
    let wanted = clamp(own.gain * (x.s - p.d_0), 0.0, own.v_0);
    let a = 0.5 * (wanted - x.v_f) + 0.5 * state.last;
    return Done(a, State(a));
}
fn half_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + v / own.gain;
}
";

/// A law that commands a speed, and has all members that causes change.
const WHOLE: &str = "struct Parameters {
    d_0: f32,
    t_h: f32,
}
fn whole_law(own: Parameters, w: World, x: Perceived, v: f32) -> f32 {
    return (min((x.s - own.d_0) / own.t_h, x.v_l + 1.0) - v) / (10.0 * w.dt);
}
";

/// The built-in laws, and three user laws.
fn all_laws() -> Vec<&'static Extension> {
    let own = [("bare", BARE), ("half", HALF), ("whole", WHOLE)];
    let own = own.map(|(name, text)| read_extension(&format!("{name}.wgsl"), text).expect("valid"));
    laws().iter().copied().chain(own).collect()
}

#[test]
fn every_cause_runs_on_every_law_or_says_what_the_law_lacks() {
    let pairs: Vec<(&'static Extension, &'static Extension)> =
        all_laws().into_iter().flat_map(|law| library().iter().map(move |cause| (law, *cause))).collect();
    let refused: Vec<(&str, &str, String)> = pairs
        .par_iter()
        .filter_map(|(law, cause)| Some((law.name.as_str(), cause.name.as_str(), refusal(law, cause)?)))
        .collect();
    // Two causes change a parameter that some laws lack, and one law itself looks back.
    let lacking = |cause: &str, parameter: &str| -> Vec<&str> {
        let of = |(law, name, why): &(&'static str, &'static str, String)| {
            let expected = format!(
                "extension {cause}: it uses {parameter}, and {law} has no {parameter}; take a model that has one"
            );
            (*name == cause && *why == expected).then_some(*law)
        };
        refused.iter().filter_map(of).collect()
    };
    assert_eq!(lacking("headway_mode_change", "t_h"), ["ovm", "fvdm", "newell", "w99", "bare", "half"]);
    assert_eq!(lacking("speed_dep_headway", "d_0"), ["ovm", "fvdm", "bare"]);
    let others: Vec<&str> = refused.iter().filter(|(.., why)| !why.contains("has no")).map(|(law, ..)| *law).collect();
    assert_eq!((refused.len(), others), (10, vec!["newell"]), "{refused:?}");
}

/// Validates the text of a law with a cause and runs it; returns the reason if the law cannot have the cause.
fn refusal(law: &'static Extension, cause: &'static Extension) -> Option<String> {
    let what = format!("{} on {}", cause.name, law.name);
    let variant = match Variant::of_law(law).with(cause) {
        Ok(variant) => variant,
        Err(conflict) => return Some(conflict.to_string()),
    };
    let population = spread(variant, 2);
    let jobs = [Job { case: 0, population: &population }];
    let lanes = Lanes::new(vec![case(variant).part(0..SAMPLES)], GoodnessOfFit::default(), LanesPrecision::Plain);
    let outcomes = lanes.unwrap_or_else(|error| panic!("{what}: {error}")).outcomes(&jobs);
    let outcomes = outcomes.unwrap_or_else(|error| panic!("{what}: {error}"));
    assert!(outcomes.iter().any(|outcome| outcome.result.is_ok()), "{what}: no run came to its end");
    None
}

/// The requirements of an extension are read from its text, and those of a law, too: nothing is listed by hand.
#[test]
fn what_a_cause_needs_follows_from_its_text() {
    for (body, expected) in [
        ("return p;", &[][..]),
        ("var q = p; q.t_h = 2.0; return q;", &["t_h"]),
        ("var q = p; q.a_max = q.a_max + helper(p); return q;", &["d_0", "a_max"]),
    ] {
        let text =
            format!("fn helper(p: Params) -> f32 {{ return p.d_0; }}\nfn x_policy(p: Params) -> Params {{ {body} }}\n");
        // A function that nothing calls is compiled, too.
        let text = if body.contains("helper") { text } else { text.replace("return p.d_0", "return 1.0") };
        let read = read_extension("x.wgsl", &text).expect("valid");
        let mut names: Vec<&str> = read.model_parameters.iter().map(|symbol| symbol.name()).collect();
        names.sort_unstable_by_key(|name| expected.iter().position(|known| known == name));
        assert_eq!(names, expected, "{body}");
    }
}
