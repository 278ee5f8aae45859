//! Eq. 1: the ballistic scheme, step by step, and the behaviour at standstill.

use super::bench::{NONE, case, close, run, trajectory};
use leadlag::internal::convention::Convention;
use leadlag::internal::reference::{Trace, disturbed};
use leadlag::internal::symbols::Parameters;

const LINEAR: Parameters = Parameters { k_s: 0.1, k_v: 0.5, k_0: 0.2, v_0: 30.0, d_0: 2.0, t_h: 1.5, ..NONE };

#[test]
fn eq_1_two_steps() {
    // The measured follower keeps 20 m/s: x_f = 100, 102, 104; x_l = x_f + 5 + s = 135, 140, 145.
    let data = trajectory(&[[30.0, 20.0, 22.0], [33.0, 20.0, 21.0], [36.0, 20.0, 20.0]]);
    let (run, trace) = run(&case("l-cth", &data, Convention::PAPER), &LINEAR);
    assert_eq!((run.first, run.failure, run.n_cut_acc, run.n_cut_dec), (1, None, 0, 0));
    assert_eq!(run.delay_steps, 0.0);
    assert_eq!([trace.x.len(), trace.v.len(), trace.a.len(), trace.s.len()], [3; 4]);
    // sample 0: measured
    assert_eq!([trace.x[0], trace.v[0], trace.a[0], trace.s[0]], [100.0, 20.0, 0.0, 30.0]);
    // sample 1: a = 0.8 (Eqs. 6, 7), v = 20 + 0.08, x = 100 + (20 + 20.08)/2*0.1, s = 140 - 102.004 - 5
    close("a_f", "m/s²", 1, trace.a[1], 0.8);
    close("v_f", "m/s", 1, trace.v[1], 20.08);
    close("x_f", "m", 1, trace.x[1], 102.004);
    close("s", "m", 1, trace.s[1], 32.996);
    // sample 2: s_des = 2 + 1.5*20.08 = 32.12, ds = -0.876, dv = 0.92: a = 0.46 + 0.0876 = 0.5476
    // v = 20.08 + 0.05476, x = 102.004 + (20.08 + 20.13476)/2*0.1 = 102.004 + 2.010738, s = 145 - 104.014738 - 5
    close("a_f", "m/s²", 2, trace.a[2], 0.5476);
    close("v_f", "m/s", 2, trace.v[2], 20.13476);
    close("x_f", "m", 2, trace.x[2], 104.014738);
    close("s", "m", 2, trace.s[2], 35.985262);
}

#[test]
fn a_car_does_not_roll_backwards() {
    // k_v = 1, dv = -5: a_cmd = -5, v = max(0, 0.1 - 0.5) = 0: the car stops within the step, so the stored acceleration is
    // (0 - 0.1)/0.1 = -1, and x = 100 + 0.1/2*0.1 = 100.005.
    // Step 2, with tau_a = 0.4 (R = 4), starts from a = -1: v_l = 3, dv = 3: (4*(-1) + 3)/5 = -0.2: stays at 0.
    // Step 3 starts from the stored a = 0: (4*0 + 3)/5 = 0.6: v = 0.06.
    let p = Parameters { k_s: 0.0, k_v: 1.0, k_0: 10.0, tau_a: 0.4, ..LINEAR };
    let data = trajectory(&[[30.0, 0.1, -24.9], [30.0, 0.1, 3.0], [30.0, 0.1, 3.0], [30.0, 0.1, 3.0]]);
    // Step 1: (4*0 + (-25))/5 = -5.
    let (run, trace) = run(&case("l-cth+linear", &data, Convention::PAPER), &p);
    assert_eq!(run.failure, None);
    for (step, (a, v, x)) in [(-1.0, 0.0, 100.005), (0.0, 0.0, 100.005), (0.6, 0.06, 100.008)].into_iter().enumerate() {
        let step = step + 1;
        close("a_f", "m/s²", step, trace.a[step], a);
        close("v_f", "m/s", step, trace.v[step], v);
        close("x_f", "m", step, trace.x[step], x);
    }
}

#[test]
fn an_acceleration_from_outside_is_no_part_of_the_models_own() {
    // As in eq_1_two_steps, with 0.3 and then -0.2 m/s² from outside (a list that ends adds nothing more).
    let data = trajectory(&[[30.0, 20.0, 22.0], [33.0, 20.0, 21.0], [36.0, 20.0, 20.0], [36.0, 20.0, 20.0]]);
    let mut trace = Trace::default();
    let run = disturbed(&case("l-cth", &data, Convention::PAPER), &LINEAR, &[9.0, 0.3, -0.2], &mut trace);
    assert_eq!(run.failure, None);
    // sample 1: own a = 0.8, v = 20 + (0.8 + 0.3)*0.1, x = 100 + (20 + 20.11)/2*0.1, s = 140 - 102.0055 - 5
    close("a_f", "m/s²", 1, trace.a[1], 0.8);
    close("v_f", "m/s", 1, trace.v[1], 20.11);
    close("s", "m", 1, trace.s[1], 32.9945);
    // sample 2: s_des = 2 + 1.5*20.11 = 32.165, dv = 0.89: a = 0.445 + 0.1*0.8295 = 0.52795, v = 20.11 + (0.52795 - 0.2)*0.1
    close("a_f", "m/s²", 2, trace.a[2], 0.52795);
    close("v_f", "m/s", 2, trace.v[2], 20.142795);
    // sample 3: x = 102.0055 + 2.01263975 = 104.01813975, s = 145 - x - 5 = 35.98186025, s_des = 32.2141925, dv = -0.142795
    close("a_f", "m/s²", 3, trace.a[3], -0.0713975 + 0.376766775);
}
