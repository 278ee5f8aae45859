//! Eqs. 12 to 14: bounds on the acceleration, and the count of cuts.

use super::bench::{NONE, X_0, case, close, run, trajectory};
use leadlag::internal::convention::Convention;
use leadlag::internal::symbols::Parameters;

/// a_cmd = min(10*(s - 32), 50) at v_f = 20.
const P: Parameters = Parameters { k_s: 10.0, k_v: 0.0, k_0: 5.0, v_0: 30.0, d_0: 2.0, t_h: 1.5, ..NONE };

/// One step from spacing `s`, then a second one from the desired spacing at the speed `v_1` that the first should reach, so that
/// every cut is of the first step. Returns a_f after it, and the cuts.
fn step_from(name: &str, s: f64, v_1: f64) -> (f64, [u32; 2]) {
    let mut data = trajectory(&[[s, 20.0, 20.0]; 3]);
    data.x_l[1] = X_0 + (20.0 + v_1) / 2.0 * 0.1 + 5.0 + (2.0 + 1.5 * v_1);
    let (run, trace) = run(&case(name, &data, Convention::PAPER), &P);
    assert_eq!(run.failure, None, "{name}, s = {s} m");
    close(&format!("{name}, s = {s} m: a_f"), "m/s²", 2, trace.a[2], 0.0);
    (trace.a[1], [run.n_cut_acc, run.n_cut_dec])
}

#[test]
fn eq_12_none() {
    // s = 27: -50, v = 15; s = 35: min(30, 50), v = 23
    for (s, a) in [(27.0, -50.0), (35.0, 30.0)] {
        let (found, cuts) = step_from("l-cth", s, 20.0 + 0.1 * a);
        close("l-cth: a_f", "m/s²", 1, found, a);
        assert_eq!(cuts, [0, 0], "cuts at s = {s} m");
    }
}

#[test]
fn eq_13_constant() {
    // spacing -> command -> acceleration: -7 and 5 m/s² (Section 2.2.2)
    for (s, a, cuts) in [
        (31.2, -7.0, [0, 1]),  // -8
        (31.29, -7.0, [0, 1]), // -7.1
        (31.31, -6.9, [0, 0]),
        (32.0, 0.0, [0, 0]),
        (32.49, 4.9, [0, 0]),
        (32.51, 5.0, [1, 0]), // 5.1
        (33.0, 5.0, [1, 0]),  // 10
    ] {
        let (found, found_cuts) = step_from("l-cth+constant", s, 20.0 + 0.1 * a);
        close(&format!("l-cth+constant, s = {s} m: a_f"), "m/s²", 1, found, a);
        assert_eq!(found_cuts, cuts, "cuts at the upper and lower bound, s = {s} m");
    }
}

#[test]
fn cuts_are_counted_step_by_step() {
    // s_des is never reached: every one of the 4 simulated steps is cut at -7 m/s² (20 m/s lasts for 2.8 s).
    let mut data = trajectory(&[[1.0, 20.0, 20.0]; 5]);
    data.x_l.fill(200.0);
    let p = Parameters { d_0: 200.0, ..P };
    let (run, trace) = run(&case("l-cth+constant", &data, Convention::PAPER), &p);
    assert_eq!((run.failure, run.n_cut_acc, run.n_cut_dec), (None, 0, 4));
    // 20 - 4*0.7 = 17.2
    close("v_f", "m/s", 4, trace.v[4], 17.2);
}
