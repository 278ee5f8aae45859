//! Runs that end early: why, and at which step.

use super::bench::{LEN_L, NONE, X_0, case, close, run, steady, trajectory};
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Failure, FailureKind};
use leadlag::internal::symbols::Parameters;

/// No gains: the speed stays.
const COAST: Parameters = Parameters { k_s: 0.0, k_v: 0.0, k_0: 0.0, v_0: 30.0, d_0: 2.0, t_h: 1.5, ..NONE };

fn fails(kind: FailureKind, step: usize) -> Option<Failure> {
    Some(Failure { kind, step })
}

#[test]
fn a_crash_is_a_spacing_of_zero_or_less() {
    // 20 m/s is 2 m a step towards a standing vehicle.
    for (s, step) in [(3.0, 2), (4.0, 2), (4.005, 3), (5.9, 3), (6.1, 4)] {
        let mut data = steady([s, 20.0, 0.0]);
        data.x_l.fill(X_0 + LEN_L + s);
        for convention in [Convention::PAPER, Convention::AUTHORS] {
            let (run, trace) = run(&case("l-cth", &data, convention), &COAST);
            assert_eq!(run.failure, fails(FailureKind::Crash, step), "{convention}, s = {s} m at step 0");
            assert_eq!(trace.s.len(), step + 1, "the trace ends at the crash");
            close("s", "m", step, trace.s[step], s - 2.0 * step as f64);
        }
    }
}

#[test]
fn a_crash_among_the_measured_samples_counts() {
    let mut samples = [[30.0, 20.0, 20.0]; 13];
    samples[3][0] = 0.0;
    let p = Parameters { tau_p: 0.5, ..COAST };
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let (run, _) = run(&case("l-cth+delay", &trajectory(&samples), convention), &p);
        assert_eq!(run.failure, fails(FailureKind::Crash, 3), "{convention}");
    }
}

const GIPPS: Parameters =
    Parameters { theta: 0.6, v_0: 40.0, d_0: 2.0, t_h: 0.8, a_max: 2.0, a_min: -2.0, a_hat_min: -4.0, ..NONE };

#[test]
fn eq_5_a_negative_radicand_is_infeasible() {
    // radicand = 4 + 2*(2*(s - 2) - 16) at v_f = 20, v_l = 0: 0 at s = 9
    for (s, failure) in [(5.0, fails(FailureKind::Radicand, 1)), (8.999, fails(FailureKind::Radicand, 1))] {
        let (run, _) = run(&case("gipps", &steady([s, 20.0, 0.0]), Convention::PAPER), &GIPPS);
        assert_eq!(run.failure, failure, "s = {s} m");
    }
    // At s = 9.001 the step is feasible: v_cmd = -2 + sqrt(0.004), a_cmd = (-2 + 0.063245553203367587 - 20)/0.8
    let (run, trace) = run(&case("gipps", &steady([9.001, 20.0, 0.0]), Convention::PAPER), &GIPPS);
    assert_ne!(run.failure.map(|f| f.step), Some(1), "s = 9.001 m");
    close("a_f", "m/s²", 1, trace.a[1], -27.420943058495790516);
    // Even the authors' shifted start does not hide it in the loop: the second simulated step fails after the first one.
    // Step 1 from s' = 9: v_cmd = -2, v = 20 - 2.75 = 17.25. Then v_l jumps to 0 and the car ahead stands 5 m before it.
    let mut data = steady([5.0, 20.0, 0.0]);
    data.x_l[1] = X_0 - 4.0 + 1.8625 + LEN_L + 5.0;
    let (run, _) = super::bench::run(&case("gipps", &data, Convention::AUTHORS), &GIPPS);
    assert_eq!(run.failure, fails(FailureKind::Radicand, 2), "4 + 2*(6 - 13.8) < 0 at step 2");
}

/// A pair from position 0 with a preceding vehicle of no length: the spacing is exactly the number given.
fn exact(s: f64, v_f: f64, p: &Parameters) -> (leadlag::internal::reference::Run, leadlag::internal::reference::Trace) {
    let mut data = trajectory(&[[s, v_f, 0.0]; 3]);
    data.x_f.fill(0.0);
    data.x_l.fill(s);
    data.len_l = 0.0;
    run(&case("gipps", &data, Convention::PAPER), p)
}

#[test]
fn the_radicand_may_be_negative_by_rounding() {
    // a_min = -1, h = 0.5: 0.25 + (2*(s - d_0) - 0.5*v_f) with t_h = 0.5, theta = 0.25, v_f = 4.5: radicand = 2*(s - 2)
    let p = Parameters { a_min: -1.0, t_h: 0.5, theta: 0.25, ..GIPPS };
    for (radicand, feasible) in [(0.0, true), (-0.995e-10, true), (-1.005e-10, false), (-1e-9, false)] {
        let s = 3.0 + radicand / 2.0;
        let (run, trace) = exact(s, 4.5, &p);
        // 0.25 + 2*1 - 2.25 = 0 at s = 3
        let failed = run.failure == fails(FailureKind::Radicand, 1);
        assert_eq!(failed, !feasible, "radicand {radicand:e}: {:?}", run.failure);
        // v_cmd = -1*0.5 + sqrt(0): a_cmd = (-0.5 - 4.5)/0.5
        close(&format!("radicand {radicand:e}: a_f"), "m/s²", 1, trace.a[1], -10.0);
    }
    // Exactly at the limit, -1e-10: feasible. t_h = 2^-60, theta = 0, v = 0: the radicand is 2*(s - d_0), as h^2 < 1e-36.
    let p = Parameters { t_h: 0.5_f64.powi(60), theta: 0.0, d_0: 1e-10, ..p };
    let (run, _) = exact(0.5e-10, 0.0, &p);
    assert_eq!(run.failure, None, "radicand -1e-10");
}

#[test]
fn of_a_radicand_and_a_crash_at_one_step_the_radicand_is_named() {
    // s = 0.1, v_f = 20, v_l = 0: a_cmd = -27.5, v = 17.25, x = 101.8625 > 100.1
    let mut data = steady([0.1, 20.0, 0.0]);
    data.x_l.fill(X_0 + LEN_L + 0.1);
    let (run, trace) = run(&case("gipps", &data, Convention::PAPER), &GIPPS);
    assert_eq!(run.failure, fails(FailureKind::Radicand, 1));
    close("s", "m", 1, trace.s[1], -1.7625);
}

#[test]
fn what_is_not_finite_is_a_failure_of_its_own() {
    let data = steady([30.0, 20.0, 22.0]);
    // 1e308*2*... overflows: +inf, -inf, NaN
    for (p, what) in [
        (Parameters { k_v: 1e308, k_0: f64::MAX, v_0: 1e300, ..COAST }, "+inf"),
        (Parameters { k_v: -1e308, ..COAST }, "-inf"),
        (Parameters { k_v: f64::NAN, k_0: f64::NAN, ..COAST }, "NaN"),
    ] {
        for name in ["l-cth", "l-cth+linear", "l-cth+nonlinear"] {
            let p = Parameters { tau_a: 0.4, m_load: 250.0, f_0: 0.0, f_1: 0.0, f_2: 0.0, ..p };
            let (run, trace) = run(&case(name, &data, Convention::PAPER), &p);
            assert_eq!(run.failure, fails(FailureKind::NotFinite, 1), "{name}, a_cmd = {what}");
            assert!(trace.v.iter().all(|v| v.is_finite()), "{name}, a_cmd = {what}: nothing but finite samples");
        }
    }
}

#[test]
fn a_parameter_that_is_not_a_number_fails_before_a_minimum_can_hide_it() {
    // Eq. 4: the minimum of a free speed and a safe speed that is NaN would be the free speed.
    let data = steady([30.0, 20.0, 22.0]);
    for p in [Parameters { theta: f64::NAN, ..GIPPS }, Parameters { v_0: f64::INFINITY, ..GIPPS }] {
        let (run, trace) = run(&case("gipps", &data, Convention::PAPER), &p);
        assert_eq!((run.failure, trace.v.len()), (fails(FailureKind::NotFinite, 1), 1), "{p:?}");
    }
}

#[test]
fn cuts_are_counted_up_to_the_failure() {
    // -8 m/s² is cut to -7 at every step: v = 19.3, 18.6: x = 101.965, 103.86; s = 3 - 1.965 = 1.035, -0.86: crash at step 2.
    let mut data = steady([3.0, 20.0, 4.0]);
    data.x_l.fill(X_0 + LEN_L + 3.0);
    let p = Parameters { k_v: 0.5, k_0: 1.0, ..COAST };
    let (run, trace) = run(&case("l-cth+constant", &data, Convention::PAPER), &p);
    assert_eq!((run.failure, run.n_cut_acc, run.n_cut_dec), (fails(FailureKind::Crash, 2), 0, 2));
    close("s", "m", 2, trace.s[2], -0.86);
}
