//! The tables: MFC curves by speed (Eq. 14), road grade by position.

use super::bench::{NONE, close, run, trajectory, variant, vehicle};
use leadlag::internal::convention::{Convention, GradeLookup, MfcLookup};
use leadlag::internal::evaluator::Case;
use leadlag::internal::symbols::Parameters;
use leadlag::internal::trajectory::Grade;
use leadlag::internal::vehicle::Mfc;

/// Nodes with a kink at each.
fn curve() -> Mfc {
    Mfc {
        v: vec![5.0, 10.0, 20.0, 30.0, 40.0],
        a_ap: vec![4.5, 4.0, 2.0, 1.0, 0.75],
        a_dp: vec![-5.0, -5.5, -6.5, -8.5, -9.0],
        source: None,
    }
}

/// a_f after one step that commands ±30 m/s² at speed `v`: the bound at that speed. `v_l` is 60 m/s off and k_v = 1/2.
fn bounds(v: f64, mfc: MfcLookup) -> [f64; 2] {
    let p = Parameters { k_s: 0.0, k_v: 0.5, k_0: 1.0, v_0: 1000.0, d_0: 2.0, t_h: 1.5, ..NONE };
    let mut car = vehicle();
    car.mfc = Some(curve());
    [60.0, -60.0].map(|dv| {
        let data = trajectory(&[[500.0, v, v + dv]; 3]);
        let convention = Convention { mfc, ..Convention::PAPER };
        let case = Case::new(&data, variant("l-cth+mfc"), Some(&car), convention, 0.8).expect("complete");
        let (run, trace) = run(&case, &p);
        assert_eq!(run.failure, None);
        let (above, below) = (run.n_cut_acc > 0, run.n_cut_dec > 0);
        assert_eq!((above, below), (dv > 0.0, dv < 0.0), "cuts above and below at v_f = {v} m/s, dv = {dv} m/s");
        trace.a[1]
    })
}

#[track_caller]
fn check(v: f64, rule: MfcLookup, a_ap: f64, a_dp: f64) {
    let found = bounds(v, rule);
    close(&format!("{rule:?}: a_ap({v} m/s)"), "m/s²", 1, found[0], a_ap);
    close(&format!("{rule:?}: a_dp({v} m/s)"), "m/s²", 1, found[1], a_dp);
}

#[test]
fn eq_14_linear() {
    check(12.0, MfcLookup::Linear, 3.6, -5.7); // 4 + (2 - 4)*0.2, -5.5 + (-1)*0.2
    check(25.0, MfcLookup::Linear, 1.5, -7.5); // midway
    check(20.0, MfcLookup::Linear, 2.0, -6.5); // at a node
    check(5.0, MfcLookup::Linear, 4.5, -5.0); // at the first node
    check(2.0, MfcLookup::Linear, 4.5, -5.0); // below: held
    check(40.0, MfcLookup::Linear, 0.75, -9.0); // at the last node
    check(45.0, MfcLookup::Linear, 0.75, -9.0); // beyond: held
    check(35.0, MfcLookup::Linear, 0.875, -8.75); // in the last cell
}

#[test]
fn eq_14_bisection_of_the_authors() {
    let rule = MfcLookup::Bisection;
    // n = 5, nodes 5 10 20 30 40. Middles visited, and the segment used: the one that starts at the last of them.
    // v = 25: 2 (20, too low, low = 3), 4 (40, too high, high = 4), 3 (30, too high, high = 3): segment 30..40, extrapolated
    //   down by half a cell: 1 - (0.75 - 1)/2 = 1.125, -8.5 + 0.5*0.5 = -8.25
    check(25.0, rule, 1.125, -8.25);
    // v = 12: 2 (20, high = 2), 1 (10, low = 2): segment 10..20, as it should be
    check(12.0, rule, 3.6, -5.7);
    // v = 8: 2 (high = 2), 1 (10, high = 1), 0 (5, low = 1): segment 5..10: 4.5 - 0.5*0.6, -5 - 0.5*0.6
    check(8.0, rule, 4.2, -5.3);
    // v = 2: 2, 1, 0 (5, high = 0): segment 5..10, extrapolated: 4.5 + 0.1*3, -5 + 0.1*3
    check(2.0, rule, 4.8, -4.7);
    // v = 20: 2 (equal, stop): the node itself; v = 30: 2 (low = 3), 4 (high = 4), 3 (equal, stop)
    check(20.0, rule, 2.0, -6.5);
    check(30.0, rule, 1.0, -8.5);
    // v = 35: 2 (low = 3), 4 (40, high = 4), 3 (30, low = 4): segment 30..40
    check(35.0, rule, 0.875, -8.75);
    // v = 45: 2 (low = 3), 4 (low = 5): the last node: its value
    check(45.0, rule, 0.75, -9.0);
    check(40.0, rule, 0.75, -9.0);
}

/// Sine of the grade at position `x`, from a run: no command, no loads, phi = 1, R = 4, a_f = 0 before. Then Eq. 11 is
/// a_t = g*sin before, 4/5*g*sin after, a_f = -g*sin/5.
fn sin_at(x: f64, grade: &Grade, rule: GradeLookup) -> f64 {
    let p = Parameters {
        k_s: 0.0,
        k_v: 0.0,
        k_0: 1.0,
        v_0: 30.0,
        d_0: 2.0,
        t_h: 1.5,
        tau_a: 0.4,
        m_load: 0.0,
        f_0: 0.0,
        f_1: 0.0,
        f_2: 0.0,
        ..NONE
    };
    let mut data = trajectory(&[[50.0, 20.0, 20.0]; 3]);
    for position in data.x_l.iter_mut().chain(&mut data.x_f) {
        *position += x - 100.0;
    }
    data.grade = Some(grade.clone());
    let car = leadlag::internal::vehicle::Vehicle { phi_f: 1.0, ..vehicle() };
    let convention = Convention { grade: rule, ..Convention::PAPER };
    let case = Case::new(&data, variant("l-cth+nonlinear"), Some(&car), convention, 0.8).expect("complete");
    run(&case, &p).1.a[1] * -5.0 / 9.80665
}

#[track_caller]
fn check_grade(x: f64, grade: &Grade, linear: f64, held: f64) {
    for (rule, expected) in [(GradeLookup::Linear, linear), (GradeLookup::Held, held)] {
        let what = format!("{rule:?}, {} nodes: sine of the grade at x = {x} m", grade.x.len());
        close(&what, "", 1, sin_at(x, grade, rule), expected);
    }
}

fn grade(nodes: usize, period: Option<f64>) -> Grade {
    let x = [0.0, 10.0, 20.0, 30.0, 40.0][..nodes].to_vec();
    let sin = [0.01, 0.02, 0.04, 0.08, 0.16][..nodes].to_vec();
    Grade { x, sin, period, source: None }
}

#[test]
fn grade_between_and_at_the_nodes() {
    let road = grade(5, None);
    check_grade(25.0, &road, 0.06, 0.06); // midway
    check_grade(22.0, &road, 0.048, 0.048);
    check_grade(10.0, &road, 0.02, 0.02);
    check_grade(30.0, &road, 0.08, 0.08);
    // the ends: `held` (the authors) keeps node 1 in the first cell and node n - 2 beyond it
    check_grade(5.0, &road, 0.015, 0.02);
    check_grade(9.9, &road, 0.0199, 0.02);
    check_grade(35.0, &road, 0.12, 0.08);
    check_grade(30.1, &road, 0.0808, 0.08);
    check_grade(-3.0, &road, 0.01, 0.02);
    check_grade(77.0, &road, 0.16, 0.08);
}

#[test]
fn grade_modulo_the_track() {
    let track = grade(5, Some(50.0));
    check_grade(75.0, &track, 0.06, 0.06);
    check_grade(21_825.0, &track, 0.06, 0.06); // 436*50 + 25
    check_grade(-25.0, &track, 0.06, 0.06);
    check_grade(55.0, &track, 0.015, 0.02);
    check_grade(85.0, &track, 0.12, 0.08);
}

#[test]
fn a_short_grade_table_has_no_inner_nodes_to_hold() {
    check_grade(5.0, &grade(3, None), 0.015, 0.015);
    check_grade(15.0, &grade(3, None), 0.03, 0.03);
    check_grade(5.0, &grade(4, None), 0.015, 0.02);
    check_grade(25.0, &grade(4, None), 0.06, 0.04);
}

#[test]
fn the_grade_is_looked_up_at_the_simulated_position() {
    // Measured: 40 m/s, sample 1 at 100 + 3 = 103 m (the mean of 20 and 40 over 0.1 s). Simulated: 20 m/s, then at 102 m.
    // sin rises from 0 at 102 m by 0.1 per metre: 0 as long as the simulated car is at or before 102 m.
    let mut data = trajectory(&[[50.0, 20.0, 20.0], [50.0, 40.0, 20.0], [50.0, 40.0, 20.0]]);
    data.grade = Some(Grade { x: vec![102.0, 103.0], sin: vec![0.0, 0.1], period: None, source: None });
    let p = Parameters {
        k_s: 0.0,
        k_v: 0.0,
        k_0: 1.0,
        v_0: 30.0,
        d_0: 2.0,
        t_h: 1.5,
        tau_a: 0.0,
        m_load: 0.0,
        f_0: 0.0,
        f_1: 0.0,
        f_2: 0.0,
        ..NONE
    };
    let case =
        Case::new(&data, variant("l-cth+nonlinear"), Some(&vehicle()), Convention::PAPER, 0.8).expect("complete");
    let (_, trace) = run(&case, &p);
    close("x_f", "m", 1, trace.x[1], 102.0);
    close("a_f", "m/s²", 2, trace.a[2], 0.0);
}
