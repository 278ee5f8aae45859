//! Eqs. 9 to 11: from the commanded to the actual acceleration.

use super::bench::{NONE, case, close, run, trajectory};
use leadlag::internal::convention::Convention;
use leadlag::internal::symbols::Parameters;
use leadlag::internal::trajectory::Grade;

/// a_cmd = 0.8 in the state s = 30, v_f = 20, v_l = 22 (see the controllers); R = tau_a/dt = 4.
const P: Parameters = Parameters {
    k_s: 0.1,
    k_v: 0.5,
    k_0: 0.2,
    v_0: 30.0,
    d_0: 2.0,
    t_h: 1.5,
    tau_a: 0.4,
    m_load: 250.0,
    f_0: 150.0,
    f_1: 2.0,
    f_2: 0.4,
    ..NONE
};

/// First simulated acceleration; a_f = (20.5 - 20)/0.1 = 5 at sample 0, forward and backward.
fn first_acceleration(name: &str, sin_grade: f64, p: &Parameters, convention: Convention) -> f64 {
    let mut data = trajectory(&[[30.0, 20.0, 22.0], [30.0, 20.5, 22.0], [30.0, 20.5, 22.0]]);
    data.grade = Some(Grade { x: vec![0.0], sin: vec![sin_grade], period: None, source: None });
    run(&case(name, &data, convention), p).1.a[1]
}

#[test]
fn eq_9_none() {
    close("l-cth: a_f", "m/s²", 1, first_acceleration("l-cth", 0.28, &P, Convention::PAPER), 0.8);
}

#[test]
fn eq_10_linear() {
    // implicit Euler: tau_a*(a - 5)/0.1 + a = 0.8, a = (4*5 + 0.8)/(1 + 4); check: 0.4*(4.16 - 5)/0.1 + 4.16 = 0.8
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let a = first_acceleration("l-cth+linear", 0.28, &P, convention);
        close("l-cth+linear: a_f", "m/s²", 1, a, 4.16);
    }
    // no lag: the command
    let a = first_acceleration("l-cth+linear", 0.28, &Parameters { tau_a: 0.0, ..P }, Convention::PAPER);
    close("l-cth+linear, tau_a = 0: a_f", "m/s²", 1, a, 0.8);
}

#[test]
fn eq_11_nonlinear() {
    // m_f = 1500 + 250 = 1750. sin = 0.28, cos = 0.96 (7, 24, 25).
    // F_r/m_f = (150*0.96 + 2*20 + 0.4*20^2)/1750 + 9.80665*0.28 = 344/1750 + 2.745862 = 2.9424334285714286
    // a_t before: 1.05*5 + 2.9424334285714286 = 8.1924334285714286 (4th line of Eq. 11)
    // a_t: (4*8.1924334285714286 + 0.8)/5 = 6.7139467428571429 (1st line, implicit Euler)
    // a_f = (6.7139467428571429 - 2.9424334285714286)/1.05
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let a = first_acceleration("l-cth+nonlinear", 0.28, &P, convention);
        close("uphill: a_f", "m/s²", 1, a, 3.591917442176870748);
    }
    // level: F_r/m_f = 350/1750 = 0.2; 1.05*5 + 0.2 = 5.45; (21.8 + 0.8)/5 = 4.52; a_f = 4.32/1.05
    let a = first_acceleration("l-cth+nonlinear", 0.0, &P, Convention::PAPER);
    close("level: a_f", "m/s²", 1, a, 4.114285714285714286);
    // downhill: 344/1750 - 2.745862 = -2.5492905714285714; 2.7007094285714286; 2.3205675428571429; 4.8698581142857143/1.05
    let a = first_acceleration("l-cth+nonlinear", -0.28, &P, Convention::PAPER);
    close("downhill: a_f", "m/s²", 1, a, 4.637960108843537415);
}

#[test]
fn eq_11_standstill_and_no_loads() {
    // v = 0: only f_0 (cos = 0.96) and the grade: 144/1750 + 2.745862 = 2.8281477142857143; a_f = 0 before; a_cmd = 0.3
    // (s = 5, d_0 = 2, k_s = 0.1): a_t = (4*2.8281477142857143 + 0.3)/5; a_f = (a_t - 2.8281477142857143)/1.05
    //     = (0.3 - 2.8281477142857143)/5/1.05 = -0.48155194557823129: v stays at 0, a_f = 0.
    let mut data = trajectory(&[[5.0, 0.0, 0.0]; 3]);
    data.grade = Some(Grade { x: vec![0.0], sin: vec![0.28], period: None, source: None });
    let (_, trace) = run(&case("l-cth+nonlinear", &data, Convention::PAPER), &P);
    assert_eq!((trace.v[1], trace.a[1], trace.x[1]), (0.0, 0.0, 100.0), "v_f, a_f, x_f at step 1");
    // The same from 1 m/s, where nothing is cut: F_r/m_f = (144 + 2 + 0.4)/1750 + 2.745862 = 2.8295191428571429,
    // s = 6.5, v_l = 1: s_des = 3.5, a_cmd = 0.3: a_f = (0.3 - 2.8295191428571429)/5/1.05
    data = trajectory(&[[6.5, 1.0, 1.0]; 3]);
    data.grade = Some(Grade { x: vec![0.0], sin: vec![0.28], period: None, source: None });
    let (_, trace) = run(&case("l-cth+nonlinear", &data, Convention::PAPER), &P);
    close("slow uphill: a_f", "m/s²", 1, trace.a[1], -0.4818131700680272109);
    // no loads on a level road: Eq. 10 with the command over phi: (4*5*1.05 + 0.8)/5/1.05 = 21.8/5.25
    let p = Parameters { f_0: 0.0, f_1: 0.0, f_2: 0.0, ..P };
    let a = first_acceleration("l-cth+nonlinear", 0.0, &p, Convention::PAPER);
    close("no loads: a_f", "m/s²", 1, a, 4.152380952380952381);
}
