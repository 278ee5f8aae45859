//! Axes: how parameters are scaled, and between which bounds.

use super::*;
use crate::diagnose::made_up;
use crate::evaluator::Evaluator;
use crate::wgsl::{extension_named, read_extension};

fn model(base: &str, causes: &[&'static Extension], bounds: &Overrides) -> Model {
    let base: Variant = base.parse().expect("a base");
    let variant = causes.iter().try_fold(base, |variant, cause| variant.with(cause)).expect("they go together");
    Model::new(variant, &[made_up::drive("made_up.csv", 0.0)], bounds, &[]).expect("a model")
}

fn axis_of(model: &Model, name: &str) -> Axis {
    let k = model.symbols.iter().position(|symbol| symbol.name() == name).expect("a parameter of the model");
    model.axes[k]
}

fn library(name: &str) -> &'static Extension {
    extension_named(name).expect("in the library")
}

#[test]
fn an_own_cause_may_call_its_parameters_what_it_likes() {
    let text = "struct Parameters {
    /// power of something [-], -1 to 1, neutral 0
    P: f32,
    /// a share [-], 0 to 1, neutral 0
    dur: f32,
    /// towards [-], -1 to 1, neutral 0
    to: f32,
}
fn own_names_command(own: Parameters, a_cmd: f32) -> f32 {
    return a_cmd + opaque(own.P * own.dur) + own.to;
}
";
    let own = read_extension("own_names.wgsl", text).expect("a valid extension");
    let own = model("l-cth", &[own], &Overrides::new());
    assert_eq!(axis_of(&own, "P"), Axis::linear(-1.0, 1.0));
    assert_eq!(axis_of(&own, "dur"), Axis::linear(0.0, 1.0));
    assert_eq!(axis_of(&own, "to"), Axis::linear(-1.0, 1.0));
    assert!(own.symbols.iter().all(|symbol| !is_stepped(*symbol)));
    let cap = model("l-cth", &[library("power_cap")], &Overrides::new());
    assert!(axis_of(&cap, "P").log);
}

#[test]
fn own_bounds_change_the_ends_of_an_axis_only() {
    let own = |name: &str, [lower, upper]: [f64; 2]| Overrides::from([(name.to_owned(), [lower, upper])]);
    let steps = |bounds: Overrides| axis_of(&model("idm", &[library("quantised_accel")], &bounds), "qz");
    assert_eq!(steps(own("qz", [0.0, 0.5])), Axis { step: 0.02, ..Axis::linear(0.0, 0.5) });
    assert_eq!(steps(own("qz", [0.2, 0.2])), Axis::linear(0.2, 0.2));
    let largest = |bounds: [f64; 2]| axis_of(&model("idm", &[], &own("a_max", bounds)), "a_max");
    assert_eq!(largest([0.5, 4.0]), Axis::log(0.5, 4.0));
    // Logarithmic scales need bounds of one sign.
    assert_eq!(largest([0.0, 4.0]), Axis::linear(0.0, 4.0));
    assert_eq!(axis_of(&model("idm", &[], &own("v_0", [20.0, 30.0])), "v_0"), Axis::linear(20.0, 30.0));
}

#[test]
fn the_lead_is_held_beside_every_delay() {
    let lead = library(LEAD);
    let held = |base: &str, causes: &[&'static Extension]| axis_of(&model(base, causes, &Overrides::new()), "lead_h");
    assert!(!held("idm", &[lead]).is_fixed() && !held("idm", &[lead, library("jerk_limit")]).is_fixed());
    for lag in ["actuation_lag", "asym_lag", "sensor_lowpass"] {
        assert!(held("idm", &[lead, library(lag)]).is_fixed(), "{lag}");
    }
    for (base, causes) in [
        ("idm+delay", vec![lead]),
        ("idm", vec![lead, library("perception_delay")]),
        ("idm", vec![lead, library("time_offset")]),
    ] {
        let axis = held(base, &causes);
        assert!(axis.is_fixed() && (axis.lower - 0.05).abs() < 1e-6, "{base}: {axis:?}");
    }
}

/// A model that perceives late and reads ahead reads a more recent past; extrapolation covers the part of the lead beyond the delay.
#[test]
fn a_delay_is_shortened_by_the_lead() {
    for (base, causes, delay) in
        [("idm", vec![library(LEAD), library("perception_delay")], "tp"), ("idm+delay", vec![library(LEAD)], "tau_p")]
    {
        let model = model(base, &causes, &Overrides::new());
        let place = |name: &str| model.symbols.iter().position(|s| s.name() == name).expect("a parameter");
        let (delay, lead) = (place(delay), place("lead_h"));
        for (of, at) in [([0.3, 0.05], [0.25, 0.0]), ([0.02, 0.05], [0.0, 0.03])] {
            let mut values: Vec<f64> = model.axes.iter().map(|axis| 0.5 * (axis.lower + axis.upper)).collect();
            [values[delay], values[lead]] = of;
            let (population, _) = model.population(0, &[values], &[]);
            let simulated = population.values(0);
            assert!(
                (simulated[delay] - at[0]).abs() < 1e-12 && (simulated[lead] - at[1]).abs() < 1e-12,
                "{base}: {of:?}"
            );
        }
    }
}

/// Otherwise a model that begins later would be likelier, because it has less of the initial transient to explain.
#[test]
fn all_models_begin_together() {
    let first = |base: &str, causes: &[&'static Extension]| {
        let model = model(base, causes, &Overrides::new());
        let drive = made_up::drive("made_up.csv", 0.0);
        let case = model.case(&drive).expect("long enough");
        let first = case.first_sample(case.longest_delay());
        assert_eq!(
            model.lanes.cases()[0].first_sample(case.longest_delay()),
            first,
            "what is fitted begins there, too"
        );
        first
    };
    let base = first("idm", &[]);
    assert_eq!([first("idm", &[library("perception_delay")]), first("idm+delay", &[]), 31], [base; 3]);
}
