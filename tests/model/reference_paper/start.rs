//! The samples before the first simulated one: measured; Gipps' shifted start of the authors.

use super::bench::{NONE, case, close, run, steady, trajectory};
use leadlag::internal::convention::{Convention, Radicand};
use leadlag::internal::evaluator::{Failure, FailureKind};
use leadlag::internal::symbols::Parameters;

/// h = t_h/2 + theta = 0.4 + 0.6 = 1 s
const P: Parameters = Parameters {
    theta: 0.6,
    v_0: 40.0,
    d_0: 2.0,
    t_h: 0.8,
    a_max: 2.0,
    a_min: -2.0,
    a_hat_min: -4.0,
    tau_p: 0.25,
    k_s: 0.1,
    k_v: 0.5,
    k_0: 0.2,
    ..NONE
};

/// radicand = 4*1 + 2*(2*(5 - 2) - 0.8*20 - 4^2/(-4)) = 4 + 2*(6 - 16 + 4) = -8
const INFEASIBLE: [f64; 3] = [5.0, 20.0, 4.0];

#[test]
fn paper_starts_as_measured_and_the_loop_fails() {
    for (name, step) in [("gipps", 1), ("gipps+delay", 9)] {
        let (run, trace) = run(&case(name, &steady(INFEASIBLE), Convention::PAPER), &P);
        assert_eq!(run.failure, Some(Failure { kind: FailureKind::Radicand, step }), "{name}");
        assert_eq!(trace.x[0], 100.0, "{name}: x_f at step 0, m");
    }
}

/// At a step of 0.1 s, 0.25 s end within the third interval, and 0.3 s with it.
#[test]
fn a_history_is_measured() {
    let case = case("idm", &steady([30.0, 20.0, 20.0]), Convention::PAPER);
    assert_eq!(case.dt, 0.1);
    for (history, earliest) in [(None, 1), (Some(0.25), 4), (Some(0.3), 4), (Some(0.05), 2)] {
        let case = case.clone().with_history(history).expect("enough samples");
        assert_eq!(case.earliest, earliest, "{history:?} s");
    }
}

#[test]
fn authors_start_where_the_radicand_is_zero() {
    // 4 + 2*(2*S' - 16 + 4) = 0: S' = 5, so s' = d_0 + S' = 7: the start is 2 m further back.
    // The loop then has v_cmd = -2 + 0 and a_cmd = (-2 - 20)/0.8 = -27.5: v = 17.25.
    for (name, first) in [("gipps", 1), ("gipps+delay", 3)] {
        let data = steady(INFEASIBLE);
        let (run, trace) = run(&case(name, &data, Convention::AUTHORS), &P);
        assert_eq!(run.first, first, "{name}");
        assert_ne!(run.failure.map(|f| f.step), Some(first), "{name}: feasible after the shift, {run:?}");
        for i in 0..first {
            close(&format!("{name}: x_f"), "m", i, trace.x[i], data.x_f[i] - 2.0);
            close(&format!("{name}: s"), "m", i, trace.s[i], 7.0);
            assert_eq!((trace.v[i], trace.a[i]), (20.0, 0.0), "{name}: v_f and a_f at step {i} stay as measured");
        }
        close(&format!("{name}: a_f"), "m/s²", first, trace.a[first], -27.5);
        close(&format!("{name}: v_f"), "m/s", first, trace.v[first], 17.25);
    }
}

#[test]
fn authors_shift_with_other_parameters() {
    // Powers and products that differ from each other: a_min = -3, theta = 0.1: h = 0.5; a_hat_min = -5, v_f = 10, v_l = 5, d_0 = 1,
    // s = 1.5. radicand = 9*0.25 + 3*(2*0.5 - 8 + 5) = 2.25 - 6 = -3.75
    // S' = (a_min*h^2 + v_f*t_h + v_l^2/a_hat_min)/2 = (-0.75 + 8 - 5)/2 = 1.125: s' = 2.125
    let p = Parameters { a_min: -3.0, theta: 0.1, a_hat_min: -5.0, d_0: 1.0, ..P };
    let (_, trace) = run(&case("gipps", &steady([1.5, 10.0, 5.0]), Convention::AUTHORS), &p);
    close("s", "m", 0, trace.s[0], 2.125);
    close("x_f", "m", 0, trace.x[0], 99.375);
}

#[test]
fn authors_leave_a_feasible_start_alone() {
    // 4 + 2*(2*S - 12) = 0.004 at S = 5.001
    let (_, trace) = run(&case("gipps", &steady([7.001, 20.0, 4.0]), Convention::AUTHORS), &P);
    close("s", "m", 0, trace.s[0], 7.001);
    // -0.004 at S = 4.999: to S' = 5
    let (_, trace) = run(&case("gipps", &steady([6.999, 20.0, 4.0]), Convention::AUTHORS), &P);
    close("s", "m", 0, trace.s[0], 7.0);
}

#[test]
fn only_gipps_is_shifted_and_only_by_its_own_switch() {
    for base in ["idm", "l-cth", "l-idm", "l-gipps"] {
        let (_, trace) = run(&case(base, &steady(INFEASIBLE), Convention::AUTHORS), &Parameters { delta: 4.0, ..P });
        close(&format!("{base}: s"), "m", 0, trace.s[0], 5.0);
    }
    let switches = [
        (Convention { radicand: Radicand::Measured, ..Convention::AUTHORS }, 5.0),
        (Convention { radicand: Radicand::Shifted, ..Convention::PAPER }, 7.0),
    ];
    for (convention, s) in switches {
        let (_, trace) = run(&case("gipps", &steady(INFEASIBLE), convention), &P);
        close(&format!("{convention}: s"), "m", 0, trace.s[0], s);
    }
}

#[test]
fn the_start_copies_speed_and_acceleration() {
    let samples: Vec<_> = (0..13).map(|i| [30.0 + f64::from(i), 20.0 + 0.5 * f64::from(i % 3), 20.0]).collect();
    let data = trajectory(&samples);
    for (convention, a_0_to_3) in
        // speeds 20, 20.5, 21, 20, 20.5, ...: differences over 0.1 s
        [(Convention::PAPER, [5.0, 5.0, 5.0, -10.0]), (Convention::AUTHORS, [5.0, 5.0, -10.0, 5.0])]
    {
        let (run, trace) = run(&case("l-cth+delay", &data, convention), &Parameters { tau_p: 0.35, ..P });
        assert!(run.first >= 4, "{convention}: first simulated sample {}", run.first);
        for (i, a_0) in a_0_to_3.into_iter().enumerate() {
            assert_eq!((trace.v[i], trace.x[i]), (data.v_f[i], data.x_f[i]), "{convention}: v_f, x_f at step {i}");
            close(&format!("{convention}: a_f"), "m/s²", i, trace.a[i], a_0);
        }
    }
}
