//! Eqs. 15 and 16: the perception delay, and the sample from which a candidate is simulated and scored.

use super::bench::{NONE, Sample, case, close, run, steady, trajectory, variant, vehicle};
use crate::common::tolerance::CONTINUOUS;
use leadlag::internal::convention::{Convention, Delay};
use leadlag::internal::evaluator::Case;
use leadlag::internal::reference::{Reference, Trace};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::symbols::Parameters;
use leadlag::internal::vehicle::Mfc;

/// Time step of the authors' program: difference of the first two times of its files in floating point \[s\].
const DT_RAW: f64 = 0.100_000_000_000_000_09;

const P: Parameters = Parameters { k_s: 0.1, k_v: 0.5, k_0: 10.0, v_0: 1000.0, d_0: 2.0, t_h: 1.5, ..NONE };

/// a_cmd = 0.5*(v_l - v_f) - 0.1*(2 + 1.5*v_f - s) of delayed signals that change from sample to sample.
const SAMPLES: [Sample; 13] = [
    [30.0, 20.0, 18.0],
    [31.0, 21.0, 22.0],
    [33.0, 19.0, 25.0],
    [30.0, 20.0, 21.0],
    [32.0, 22.0, 20.0],
    [34.0, 20.0, 24.0],
    [31.0, 21.0, 22.0],
    [35.0, 23.0, 19.0],
    [30.0, 20.0, 23.0],
    [36.0, 22.0, 20.0],
    [37.0, 20.0, 20.0],
    [30.0, 20.0, 20.0],
    [30.0, 20.0, 20.0],
];

fn delayed(tau_p: f64) -> Trace {
    let (run, trace) = run(&case("l-cth+delay", &trajectory(&SAMPLES), Convention::PAPER), &Parameters { tau_p, ..P });
    assert_eq!((run.first, run.failure), (9, None), "tau_p = {tau_p} s");
    close("delay", "samples", 0, run.delay_steps, tau_p * 10.0);
    trace
}

#[test]
fn eq_16_fractional_delay_of_measured_signals() {
    // The first simulated sample is 9; it perceives sample 8 - tau_p/dt.
    // tau_p = 0.25: 5.5: s = (34 + 31)/2 = 32.5, v_f = 20.5, v_l = 23: 0.5*2.5 - 0.1*(2 + 30.75 - 32.5) = 1.25 - 0.025
    // then 6.5: s = 33, v_f = 22, v_l = 20.5: 0.5*(-1.5) - 0.1*(35 - 33) = -0.95
    let trace = delayed(0.25);
    close("tau_p = 0.25 s: a_f", "m/s²", 9, trace.a[9], 1.225);
    close("tau_p = 0.25 s: v_f", "m/s", 9, trace.v[9], 20.1225);
    close("tau_p = 0.25 s: a_f", "m/s²", 10, trace.a[10], -0.95);
    // tau_p = 0.23: 5.7: s = 34 - 0.7*3 = 31.9, v_f = 20.7, v_l = 24 - 0.7*2 = 22.6: 0.5*1.9 - 0.1*(33.05 - 31.9)
    close("tau_p = 0.23 s: a_f", "m/s²", 9, delayed(0.23).a[9], 0.835);
    // tau_p = 0.8: sample 0: 0.5*(-2) - 0.1*(32 - 30)
    close("tau_p = 0.8 s: a_f", "m/s²", 9, delayed(0.8).a[9], -1.2);
    // before sample 9 everything is measured
    for (i, [s, v_f, _]) in SAMPLES.into_iter().enumerate().take(9) {
        close("measured s", "m", i, delayed(0.25).s[i], s);
        assert_eq!(delayed(0.25).v[i], v_f, "measured v_f at step {i}, m/s");
    }
}

#[test]
fn eq_16_fractional_delay_of_simulated_signals() {
    // tau_p = 0.1. Step 9 perceives 7: 0.5*(19 - 23) - 0.1*(36.5 - 35) = -2.15, v[9] = 20 - 0.215 = 19.785.
    // Step 11 perceives 9, simulated: x[9] - x[8] = (20 + 19.785)/2*0.1 = 1.98925, measured: 2.1, so
    // s[9] = 36 + 2.1 - 1.98925 = 36.11075: 0.5*(20 - 19.785) - 0.1*(2 + 29.6775 - 36.11075) = 0.1075 + 0.443325
    let trace = delayed(0.1);
    close("tau_p = 0.1 s: a_f", "m/s²", 9, trace.a[9], -2.15);
    close("tau_p = 0.1 s: s", "m", 9, trace.s[9], 36.11075);
    close("tau_p = 0.1 s: a_f", "m/s²", 11, trace.a[11], 0.550825);
    // tau_p = 0.15. Step 9 perceives 6.5: -0.95 (above), v[9] = 19.905, s[9] = 38.1 - 1.99525 = 36.10475.
    // Step 11 perceives 8.5, half measured: s = 33.052375, v_f = 19.9525, v_l = 21.5:
    // 0.5*1.5475 - 0.1*(2 + 29.92875 - 33.052375) = 0.77375 + 0.1123625
    let trace = delayed(0.15);
    close("tau_p = 0.15 s: a_f", "m/s²", 9, trace.a[9], -0.95);
    close("tau_p = 0.15 s: a_f", "m/s²", 11, trace.a[11], 0.8861125);
}

#[test]
fn whole_sample_delay_of_the_authors() {
    let mut data = trajectory(&SAMPLES);
    data.dt_raw = DT_RAW;
    let case = case("l-cth+delay", &data, Convention::AUTHORS);
    // 0.3/0.10000000000000009 = 2.9999999999999973: D = 2; the step is slightly above 0.1 s, so k tenths give k - 1
    for (tau_p, d) in
        [(0.1, 0), (0.2, 1), (0.3, 2), (0.4, 3), (0.5, 4), (0.6, 5), (0.7, 6), (0.8, 7), (0.35, 3), (0.29, 2)]
    {
        let (run, trace) = run(&case, &Parameters { tau_p, ..P });
        assert_eq!(
            (run.delay_steps, run.first),
            (f64::from(d), d as usize + 1),
            "D and first sample, tau_p = {tau_p} s"
        );
        // the first simulated sample perceives 0: -1.2 (above); the next one 1: 0.5*(22 - 21) - 0.1*(2 + 31.5 - 31) = 0.25
        // For D = 0 sample 1 is simulated: v = 20 - 0.12 = 19.88, s = 31 + 2.05 - 1.994 = 31.056, v_l = 22:
        // 0.5*2.12 - 0.1*(2 + 29.82 - 31.056) = 1.06 - 0.0764
        close(&format!("tau_p = {tau_p} s: a_f"), "m/s²", run.first, trace.a[run.first], -1.2);
        let next = if d == 0 { 0.9836 } else { 0.25 };
        close(&format!("tau_p = {tau_p} s: a_f"), "m/s²", run.first + 1, trace.a[run.first + 1], next);
    }
    // with the nominal step 0.8/0.1 is 8 samples
    let convention = Convention { delay: Delay::Floor, ..Convention::PAPER };
    let (run, _) = run(&super::bench::case("l-cth+delay", &data, convention), &Parameters { tau_p: 0.8, ..P });
    assert_eq!((run.delay_steps, run.first), (8.0, 9), "D and first sample with the nominal step");
}

#[test]
fn eq_15_no_delay_starts_at_sample_1() {
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let (run, trace) = run(&case("l-cth", &trajectory(&SAMPLES), convention), &P);
        assert_eq!((run.first, run.delay_steps), (1, 0.0), "{convention}");
        close("a_f", "m/s²", 1, trace.a[1], -1.2);
    }
}

#[test]
fn every_candidate_of_the_paper_convention_starts_at_the_same_sample() {
    let first = |dt: f64, upper: f64, tau_p: f64| {
        let mut data = steady([30.0, 20.0, 20.0]);
        data.dt = dt;
        let case = Case::new(&data, variant("l-cth+delay"), None, Convention::PAPER, upper).expect("complete");
        case.first_sample(tau_p)
    };
    for tau_p in [0.1, 0.123, 0.3, 0.799_999, 0.8] {
        assert_eq!(first(0.1, 0.8, tau_p), 9, "ceil(0.8/0.1) + 1, tau_p = {tau_p} s");
    }
    assert_eq!(first(0.1, 0.75, 0.2), 9, "ceil(7.5) + 1");
    // quotients that floating point moves off the whole number
    assert_eq!(first(0.1, 0.3, 0.2), 4, "0.3/0.1 = 2.9999999999999996");
    assert_eq!(first(0.02, 0.14, 0.1), 8, "0.14/0.02 = 7.000000000000001");
}

#[test]
fn eq_4_takes_the_undelayed_speed() {
    // Perceived (sample 5.5) s = 20, v_f = 10, v_l = 12: v_cmd = -2 + sqrt(132) (see the controllers); now (sample 8) v_f = 11:
    // a_cmd = (9.489125293076057 - 11)/0.8
    let p = Parameters { theta: 0.6, v_0: 40.0, d_0: 2.0, t_h: 0.8, a_max: 2.0, a_min: -2.0, a_hat_min: -4.0, ..NONE };
    let mut samples = [[20.0, 10.0, 12.0]; 13];
    samples[8][1] = 11.0;
    let (_, trace) =
        run(&case("gipps+delay", &trajectory(&samples), Convention::PAPER), &Parameters { tau_p: 0.25, ..p });
    close("a_f", "m/s²", 9, trace.a[9], -1.88859338365492835);
}

#[test]
fn eqs_10_and_14_take_the_undelayed_state() {
    // Now (sample 8): v_f = 25, a_f = (25 - 20)/0.1 = 50. Perceived: v_f = 20, s = 30, v_l = 22: a_cmd = 0.8 (see the controllers).
    // R = 4: a = (4*50 + 0.8)/5 = 40.16; a_ap(25) = 3 on a curve from 8 at 0 to 0 at 40 m/s (a_ap(20) = 4).
    let p = Parameters { v_0: 30.0, k_0: 0.2, tau_a: 0.4, tau_p: 0.25, ..P };
    let mut samples = [[30.0, 20.0, 22.0]; 13];
    samples[8][1] = 25.0;
    let data = trajectory(&samples);
    let (_, trace) = run(&case("l-cth+delay+linear", &data, Convention::PAPER), &p);
    close("a_f", "m/s²", 9, trace.a[9], 40.16);
    let mut car = vehicle();
    car.mfc = Some(Mfc { v: vec![0.0, 40.0], a_ap: vec![8.0, 0.0], a_dp: vec![-8.0, 0.0], source: None });
    let case =
        Case::new(&data, variant("l-cth+delay+linear+mfc"), Some(&car), Convention::PAPER, 0.8).expect("complete");
    let (_, trace) = run(&case, &p);
    close("a_f cut", "m/s²", 9, trace.a[9], 3.0);
}

#[test]
fn the_score_is_continuous_in_tau_p() {
    let case = case("l-cth+delay", &trajectory(&SAMPLES), Convention::PAPER);
    let score = |tau_p: f64| {
        let outcome = Reference::outcome(&case, &Parameters { tau_p, ..P }, &mut Trace::default());
        GoodnessOfFit::NRMSE_SVA.of(&outcome.result.expect("no failure"))
    };
    for tau_p in [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.799_999_999] {
        let (below, at, above) = (score(tau_p - 1e-9), score(tau_p), score(tau_p + 1e-9));
        assert!(
            (below - at).abs() < CONTINUOUS && (above - at).abs() < CONTINUOUS,
            "NRMSE(s,v,a) around tau_p = {tau_p} s: {below:?}, {at:?}, {above:?}"
        );
    }
}

/// Samples 1 to 3 at 0.1 s: the clock continues, and the signals are those of the samples.
#[test]
fn a_piece_of_a_case_keeps_its_times() {
    let mut data = trajectory(&SAMPLES);
    data.t.iter_mut().for_each(|t| *t += 10.0);
    let begin = data.t[0];
    let case = Case::new(&data, variant("l-cth"), None, Convention::PAPER, 0.0).expect("complete");
    let piece = Case { earliest: 3, ..case }.part(1..4);
    assert_eq!((piece.s.len(), piece.s[1], piece.v_f[0], piece.earliest), (3, 33.0, 21.0, 2));
    assert!((piece.t_0 - begin - 0.1).abs() < 1e-12, "{} and {begin}", piece.t_0);
}
