//! Preparation before a run: bounds (Table 3) and measured accelerations.

use super::bench::{NONE, case, close, run, steady, trajectory};
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, CaseError, InvalidParameter};
use leadlag::internal::symbols::{Parameters, Symbol};
use leadlag::internal::vehicle::Vehicle;

/// Table 3: name, then lower and upper bounds of Tesla, BMW, Audi A6, Mercedes.
const ROAD_LOADS: [(Symbol, [[f64; 2]; 4]); 3] = [
    (Symbol::f_0, [[185.1, 226.3], [190.3, 232.6], [154.9, 189.4], [139.5, 170.4]]),
    (Symbol::f_1, [[0.0, 0.0], [-0.63, -0.52], [0.64, 0.78], [0.56, 0.69]]),
    (Symbol::f_2, [[0.025, 0.031], [0.042, 0.051], [0.026, 0.031], [0.027, 0.033]]),
];

/// The same in SI, f_1 times 3.6 and f_2 times 3.6^2 = 12.96: such as 0.025*12.96 = 0.324 for Tesla, -0.63*3.6 = -2.268 for BMW.
const ROAD_LOADS_SI: [(Symbol, [[f64; 2]; 4]); 3] = [
    (Symbol::f_0, [[185.1, 226.3], [190.3, 232.6], [154.9, 189.4], [139.5, 170.4]]),
    (Symbol::f_1, [[0.0, 0.0], [-2.268, -1.872], [2.304, 2.808], [2.016, 2.484]]),
    (Symbol::f_2, [[0.324, 0.40176], [0.54432, 0.66096], [0.33696, 0.40176], [0.34992, 0.42768]]),
];

#[test]
fn table_3_road_loads_printed_and_in_si() {
    for (convention, table) in [(Convention::AUTHORS, ROAD_LOADS), (Convention::PAPER, ROAD_LOADS_SI)] {
        for (symbol, bounds) in table {
            for (name, [lower, upper]) in ["Tesla", "BMW", "Audi A6", "Mercedes"].into_iter().zip(bounds) {
                let vehicle = Vehicle::called(name).expect("built in");
                let found = Case::bounds(symbol, Some(&vehicle), convention).expect("known for a vehicle");
                let what = format!("{convention}, {name}: {}", symbol.name());
                close(&format!("{what}, lower"), symbol.unit(), 0, found[0], lower);
                close(&format!("{what}, upper"), symbol.unit(), 0, found[1], upper);
            }
            assert_eq!(Case::bounds(symbol, None, convention), None, "{} without a vehicle", symbol.name());
        }
    }
}

#[test]
fn other_bounds_are_the_same_in_both_conventions() {
    for convention in [Convention::AUTHORS, Convention::PAPER] {
        assert_eq!(Case::bounds(Symbol::tau_p, None, convention), Some([0.1, 0.8]));
        assert_eq!(Case::bounds(Symbol::a_min, None, convention), Some([-5.0, -0.5]));
    }
}

#[test]
fn measured_accelerations() {
    // speeds 20, 20.5, 20.25, 21 over 0.1 s: differences 5, -2.5, 7.5.
    // Eq. 1 pairs a(t) with v(t) - v(t - dt): backward; the first sample has no neighbour and takes the next one's.
    // The authors: forward, 0 at the end.
    let data = trajectory(&[[30.0, 20.0, 20.0], [30.0, 20.5, 20.0], [30.0, 20.25, 20.0], [30.0, 21.0, 20.0]]);
    for (convention, expected) in
        [(Convention::PAPER, [5.0, 5.0, -2.5, 7.5]), (Convention::AUTHORS, [5.0, -2.5, 7.5, 0.0])]
    {
        let case = case("idm", &data, convention);
        for (i, expected) in expected.into_iter().enumerate() {
            close(&format!("{convention}: measured a_f"), "m/s²", i, case.a_f[i], expected);
        }
    }
}

#[test]
fn the_time_step_is_the_nominal_or_the_raw_one() {
    let mut data = trajectory(&[[30.0, 20.0, 22.0]; 4]);
    (data.dt, data.dt_raw) = (0.1, 0.125);
    // a_cmd = 0.8 (see the controllers): v = 20 + 0.8*dt
    let p = Parameters { k_s: 0.1, k_v: 0.5, k_0: 0.2, v_0: 30.0, d_0: 2.0, t_h: 1.5, ..NONE };
    for (convention, v) in [(Convention::PAPER, 20.08), (Convention::AUTHORS, 20.1)] {
        let (_, trace) = run(&case("l-cth", &data, convention), &p);
        close(&format!("{convention}: v_f"), "m/s", 1, trace.v[1], v);
    }
}

#[test]
fn what_a_variant_lacks_is_said() {
    let mut data = trajectory(&[[30.0, 20.0, 20.0]; 10]);
    let new = |name: &str, data: &_, vehicle: Option<&Vehicle>| {
        Case::new(data, super::bench::variant(name), vehicle, Convention::PAPER, 0.8).map(|case| case.variant.id())
    };
    let tesla = Vehicle::called("Tesla").expect("built in");
    let missing = |result: Result<u32, CaseError>| match result {
        Err(CaseError::Missing { what, .. }) => what,
        other => panic!("{other:?}"),
    };
    assert_eq!(missing(new("idm+nonlinear", &data, None)), "the follower's vehicle");
    assert_eq!(missing(new("idm+mfc", &data, None)), "the follower's vehicle");
    assert_eq!(missing(new("idm+mfc", &data, Some(&tesla))), "the vehicle's MFC curve");
    data.grade = None;
    assert_eq!(missing(new("idm+nonlinear", &data, Some(&tesla))), "the road grade");
    assert_eq!(new("idm+linear+constant", &data, None), Ok(5));
    // with delay the first simulated sample is 9, so 11 samples are needed
    let short = new("idm+delay", &data, None);
    assert!(matches!(short, Err(CaseError::TooShort { samples: 10, first: 9, .. })), "{short:?}");
}

#[test]
fn a_candidate_outside_of_the_equations_is_refused() {
    let data = steady([30.0, 20.0, 22.0]);
    let p = Parameters { k_s: 0.1, k_v: 0.5, k_0: 0.2, v_0: 30.0, d_0: 2.0, t_h: 1.5, tau_p: 0.3, ..NONE };
    let domain = |result| match result {
        Err(InvalidParameter::Domain { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    let paper = case("l-cth+delay", &data, Convention::PAPER);
    assert_eq!(paper.check(&p), Ok(()));
    assert_eq!(domain(paper.check(&Parameters { t_h: 0.0, ..p })), "t_h");
    assert_eq!(domain(paper.check(&Parameters { tau_p: -0.1, ..p })), "tau_p");
    assert_eq!(domain(paper.check(&Parameters { d_0: f64::INFINITY, ..p })), "d_0");
    assert_eq!(domain(paper.check(&NONE)), "k_s");
    // Up to the upper bound 0.8 s in both conventions: it limits the memory of a simulation.
    let refused = |case: &Case, tau_p: f64| match case.check(&Parameters { tau_p, ..p }) {
        Err(InvalidParameter::Delay { upper, .. }) => Some(upper),
        Ok(()) => None,
        other => panic!("{other:?}"),
    };
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let case = case("l-cth+delay", &data, convention);
        assert_eq!([0.8, 0.81].map(|tau_p| refused(&case, tau_p)), [None, Some(0.8)], "{convention}");
    }
    // Without a delay, tau_p is not read, whatever its value.
    assert_eq!(case("l-cth", &data, Convention::PAPER).check(&Parameters { tau_p: 9.0, ..p }), Ok(()));
}
