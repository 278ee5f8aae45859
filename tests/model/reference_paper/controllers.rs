//! Eqs. 2 to 8: commands of the five base models.

use super::bench::{NONE, commands};
use leadlag::internal::symbols::Parameters;

const IDM: Parameters = Parameters { delta: 4.0, v_0: 30.0, d_0: 2.0, t_h: 1.5, a_max: 1.2, a_min: -3.0, ..NONE };

#[test]
fn eqs_2_and_3_idm_closing_in() {
    // dv = 19 - 20 = -1
    // s_des = 2 + max(0, 1.5*20 - 20*(-1)/(2*sqrt(1.2*3))) = 2 + 30 + 20/3.7947331922020552 = 37.270462766947299
    // a_cmd = 1.2*(1 - (20/30)^4 - (37.270462766947299/40)^2) = 1.2*(1 - 0.19753086419753086 - 0.86817962178900307)
    commands("idm", [40.0, 20.0, 19.0], &IDM, -0.07885258318384071693);
}

#[test]
fn eq_3_idm_both_sides_of_the_maximum() {
    // 2*sqrt(1*4) = 4
    let p = Parameters { a_max: 1.0, a_min: -4.0, ..IDM };
    // dv = 5: s_des = 2 + max(0, 30 - 20*5/4 = 5) = 7;  a_cmd = 1 - 16/81 - 49/1600 = 1 - 0.19753086419753086 - 0.030625
    commands("idm", [40.0, 20.0, 25.0], &p, 0.7718441358024691358);
    // dv = 8: s_des = 2 + max(0, 30 - 20*8/4 = -10) = 2;  a_cmd = 1 - 16/81 - 4/1600
    commands("idm", [40.0, 20.0, 28.0], &p, 0.7999691358024691358);
}

#[test]
fn eq_2_idm_free_road() {
    // s = 1e8 m: (s_des/s)^2 < 1e-12;  v/v_0 = 1/2, delta = 1: a_cmd = 1.2/2
    commands("idm", [1e8, 15.0, 15.0], &Parameters { delta: 1.0, ..IDM }, 0.6);
    // at the desired speed the command ends
    commands("idm", [1e8, 30.0, 30.0], &IDM, 0.0);
    // above: 1.2*(1 - 1.1^4) = 1.2*(1 - 1.4641)
    commands("idm", [1e8, 33.0, 33.0], &IDM, -0.55692);
}

#[test]
fn eq_2_idm_standstill() {
    // v = 0: s_des = d_0;  s = 4: a_cmd = 1.2*(1 - 0 - (2/4)^2) = 0.9;  s = d_0: 0
    commands("idm", [4.0, 0.0, 0.0], &IDM, 0.9);
    commands("idm", [2.0, 0.0, 0.0], &IDM, 0.0);
}

#[test]
fn eq_2_idm_equilibrium() {
    // dv = 0, v = 15: s_des = 2 + 22.5;  s_e = 24.5/sqrt(1 - (15/30)^4) = 24.5/sqrt(15/16): a_cmd = 0
    commands("idm", [25.303491195221790317, 15.0, 15.0], &IDM, 0.0);
}

#[test]
fn eq_2_idm_fractional_exponent() {
    // v = 7.5: (7.5/30)^0.5 = 0.5;  s_des = 2 + 1.5*7.5 = 13.25;  s = 26.5: a_cmd = 1.2*(1 - 0.5 - 0.25)
    commands("idm", [26.5, 7.5, 7.5], &Parameters { delta: 0.5, ..IDM }, 0.3);
}

#[test]
fn eq_2_idm_takes_a_speed_below_zero_for_standstill() {
    // v = -0.001, delta = 1/2: the root of a negative number would be NaN; s_des = 2 + max(0, -0.0015): 1.2*(1 - 0 - (2/40)^2)
    commands("idm", [40.0, -0.001, -0.001], &Parameters { delta: 0.5, ..IDM }, 1.197);
}

/// h = t_h/2 + theta = 1 s
const GIPPS: Parameters =
    Parameters { theta: 0.6, v_0: 40.0, d_0: 2.0, t_h: 0.8, a_max: 2.0, a_min: -2.0, a_hat_min: -4.0, ..NONE };

#[test]
fn eqs_4_and_5_gipps_free_flow() {
    // free: 10 + 2.5*2*0.8*(1 - 10/40)*sqrt(0.025 + 10/40) = 10 + 3*sqrt(0.275)
    // safe: -2 + sqrt(4 + 2*(2*198 - 8 + 144/4)) = -2 + sqrt(852) = 27.2, larger
    // a_cmd = 3*0.52440442408507577/0.8
    commands("gipps", [200.0, 10.0, 12.0], &GIPPS, 1.9665165903190341506);
    // v = 0: 2.5*2*sqrt(0.025); safe: -2 + sqrt(4 + 2*36) = 6.7 > 0.8*0.79
    commands("gipps", [20.0, 0.0, 0.0], &GIPPS, 0.790569415042094833);
    // at the desired speed: 0; above it, v/v_0 = 1.1: 5*(-0.1)*sqrt(1.125) = -0.5*1.0606601717798213
    commands("gipps", [400.0, 40.0, 40.0], &GIPPS, 0.0);
    commands("gipps", [400.0, 44.0, 44.0], &GIPPS, -0.5303300858899106433);
}

#[test]
fn eqs_4_and_5_gipps_car_following() {
    // radicand = (-2)^2*1^2 - (-2)*(2*(20 - 2) - 0.8*10 - 12^2/(-4)) = 4 + 2*(36 - 8 + 36) = 132
    // v_cmd = min(10 + 1.57, -2 + 11.489125293076057) = 9.489125293076057;  a_cmd = (9.489125293076057 - 10)/0.8
    commands("gipps", [20.0, 10.0, 12.0], &GIPPS, -0.63859338365492835);
    // theta = 0.1: h = 0.5, radicand = 4*0.25 + 2*(28 - 8 + 0) = 41 with s = 16, v_l = 0: v_cmd = -1 + sqrt(41)
    // a_cmd = (-1 + 6.4031242374328487 - 10)/0.8
    commands("gipps", [16.0, 10.0, 0.0], &Parameters { theta: 0.1, ..GIPPS }, -5.7460947032089391);
}

#[test]
fn eq_5_gipps_equilibrium_and_standstill() {
    // Eq. 8 gives the equilibrium spacing: 2 + (0.8 + 0.6)*10 - 0.5*100*(1/(-2) - 1/(-4)) = 2 + 14 + 12.5 = 28.5
    // radicand = 4 + 2*(53 - 8 + 25) = 144: v_cmd = -2 + 12 = 10
    commands("gipps", [28.5, 10.0, 10.0], &GIPPS, 0.0);
    // v = v_l = 0, s = d_0: radicand = 4: v_cmd = -2 + 2 = 0
    commands("gipps", [2.0, 0.0, 0.0], &GIPPS, 0.0);
}

const LINEAR: Parameters = Parameters { k_s: 0.1, k_v: 0.5, k_0: 0.2, v_0: 30.0, d_0: 2.0, t_h: 1.5, ..NONE };

#[test]
fn eqs_6_and_7_linear_cth() {
    // s_des = 2 + 1.5*20 = 32, ds = 32 - 30 = 2, dv = 2: min(0.5*2 - 0.1*2 = 0.8, 0.2*(30 - 20) = 2)
    commands("l-cth", [30.0, 20.0, 22.0], &LINEAR, 0.8);
    // v_0 = 22: the set speed decides, 0.2*(22 - 20)
    commands("l-cth", [30.0, 20.0, 22.0], &Parameters { v_0: 22.0, ..LINEAR }, 0.4);
    // equilibrium: s = s_des, dv = 0
    commands("l-cth", [32.0, 20.0, 20.0], &LINEAR, 0.0);
    // free road: s = 1000: min(96.8, 2)
    commands("l-cth", [1000.0, 20.0, 20.0], &LINEAR, 2.0);
    // standstill: s = 5: ds = 2 - 5, -0.1*(-3)
    commands("l-cth", [5.0, 0.0, 0.0], &LINEAR, 0.3);
}

#[test]
fn eqs_3_and_6_linear_idm() {
    // s_des as for the IDM, 37.270462766947299: ds = -2.729537233052701, dv = -1: 0.5*(-1) - 0.1*(-2.729537233052701)
    let p = Parameters { a_max: 1.2, a_min: -3.0, ..LINEAR };
    commands("l-idm", [40.0, 20.0, 19.0], &p, -0.2270462766947298887);
    // the maximum is 0: s_des = 2, ds = 2 - 10 = -8, dv = 8: min(0.5*8 + 0.1*8 = 4.8, 0.5*(30 - 20) = 5)
    let p = Parameters { a_max: 1.0, a_min: -4.0, k_0: 0.5, ..LINEAR };
    commands("l-idm", [10.0, 20.0, 28.0], &p, 4.8);
}

#[test]
fn eqs_6_and_8_linear_gipps() {
    // s_des = 2 + (1.5 + 0.5)*20 - 0.5*20^2*(1/(-2) - 1/(-4)) = 2 + 40 - 200*(-0.25) = 92, ds = 92 - 30 = 62, dv = 2
    // a_cmd = 0.5*2 - 0.1*62
    let p = Parameters { theta: 0.5, a_min: -2.0, a_hat_min: -4.0, ..LINEAR };
    commands("l-gipps", [30.0, 20.0, 22.0], &p, -5.2);
    // equal decelerations: the quadratic term vanishes, s_des = 42: -0.1*(42 - 50)
    commands("l-gipps", [50.0, 20.0, 20.0], &Parameters { a_hat_min: -2.0, ..p }, 0.8);
    // the preceding vehicle is thought to brake less: s_des = 42 - 200*(-0.25 + 0.5) = -8: 0.5*2 - 0.1*(-8 - 7) = 2.5, k_0: 2
    let p = Parameters { a_min: -4.0, a_hat_min: -2.0, ..p };
    commands("l-gipps", [7.0, 20.0, 22.0], &p, 2.0);
    commands("l-gipps", [7.0, 20.0, 22.0], &Parameters { k_0: 0.3, ..p }, 2.5);
}
