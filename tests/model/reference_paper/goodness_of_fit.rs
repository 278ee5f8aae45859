//! Eq. 18 and the other goodness-of-fit functions, on three samples.

use super::bench::{close, steady, variant};
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::Case;
use leadlag::internal::score::{
    Accumulation, GoodnessOfFit, Measured, Measures, SignalMeasures, denominator, is_relative,
};
use leadlag::internal::trajectory::FindingKind;

/// Errors of spacing 1, -2, 2: squares sum to 9. Measured squares: 100 + 400 + 400 = 900, simulated: 121 + 324 + 484 = 929.
const SPACING: ([f64; 3], [f64; 3]) = ([11.0, 18.0, 22.0], [10.0, 20.0, 20.0]);
/// Errors of speed 0.3, 0.3, -0.4: 0.34. Measured: 0 + 9 + 16 = 25, simulated: 0.09 + 10.89 + 12.96 = 23.94.
const SPEED: ([f64; 3], [f64; 3]) = ([0.3, 3.3, 3.6], [0.0, 3.0, 4.0]);
/// Errors of acceleration 0.5, 0, -0.5: 0.5. Measured: 1 + 1 + 0.25 = 2.25, simulated: 2.25 + 1 + 0 = 3.25.
const ACCELERATION: ([f64; 3], [f64; 3]) = ([1.5, -1.0, 0.0], [1.0, -1.0, 0.5]);

fn measures(floored: bool) -> Measures {
    let compare =
        |(simulated, measured): ([f64; 3], [f64; 3]), floored| SignalMeasures::compare(&simulated, &measured, floored);
    Measures([compare(SPACING, false), compare(SPEED, floored), compare(ACCELERATION, false)])
}

/// The same value as computed by evaluators that finish scores themselves: sums over the samples and a norm.
fn finished(gof: &GoodnessOfFit, floored: bool) -> f64 {
    let signals = [(SPACING, false), (SPEED, floored), (ACCELERATION, false)];
    let norm = gof.norm(&signals.map(|((_, measured), floored)| Measured::of(&measured, floored)));
    let root_of_mean = |i: usize, term: &dyn Fn(f64, f64) -> f64| {
        let ((simulated, measured), _) = signals[i];
        let sum: f64 = simulated.iter().zip(&measured).map(|(sim, obs)| term(*sim, *obs)).sum();
        (sum * norm.per_count[i]).sqrt()
    };
    (0..3)
        .map(|i| {
            let floored = signals[i].1;
            let error = |sim: f64, obs: f64| match gof.accumulation() {
                Accumulation::Squared | Accumulation::Theil => (sim - obs).powi(2),
                Accumulation::Relative if is_relative(obs, floored) => {
                    ((sim - obs) / denominator(obs, floored)).powi(2)
                }
                Accumulation::Relative => 0.0,
                Accumulation::Floored => (sim - denominator(obs, floored)).powi(2),
            };
            let term = root_of_mean(i, &error) * norm.weight[i];
            match gof.accumulation() {
                Accumulation::Theil => term / (root_of_mean(i, &|sim, _| sim * sim) + norm.rms_measured[i]),
                _ => term,
            }
        })
        .sum()
}

#[track_caller]
fn check(floored: bool, expected: &[(&str, f64)]) {
    let found = measures(floored);
    for (name, value) in expected {
        let gof: GoodnessOfFit = name.parse().expect("a goodness of fit");
        close(&format!("{name}, floored {floored}"), "", 0, gof.of(&found), *value);
        close(&format!("{name}, floored {floored}, by its norm"), "", 0, finished(&gof, floored), *value);
    }
}

const PLAIN: [(&str, f64); 17] = [
    ("rmse_s", 1.732050807568877294),   // sqrt(9/3)
    ("rmse_v", 0.3366501646120692651),  // sqrt(0.34/3)
    ("rmse_a", 0.4082482904638630164),  // sqrt(0.5/3)
    ("rmspe_s", 0.1),                   // 1/10, -2/20, 2/20
    ("rmspe_v", 0.1),                   // 0.3/3, -0.4/4; the standing sample is left out
    ("nrmse_s", 0.1),                   // sqrt(9/900)
    ("nrmse_v", 0.1166190378969060094), // sqrt(0.34/25)
    ("nrmse_a", 0.4714045207910316829), // sqrt(0.5/2.25)
    ("nrmse_sv", 0.2166190378969060094),
    ("nrmse_sva", 0.6880235586879376923),
    ("u_s", 0.0496035836127249267), // sqrt(3)/(sqrt(929/3) + sqrt(300)) = 1.7320508/(17.5973483 + 17.3205081)
    ("u_v", 0.05894106104731366507), // sqrt(0.34)/(sqrt(23.94) + sqrt(25))
    ("u_a", 0.2140947066183749209), // sqrt(0.5)/(sqrt(3.25) + sqrt(2.25))
    ("u_sv", 0.10854464466003859177),
    ("u_sva", 0.32263935127841351267),
    ("rmse_sn_vn", 0.2573676219099050458), // sqrt(3)/(20 - 10) + sqrt(0.34/3)/(4 - 0)
    ("rmse_sn_vn_an", 0.4614917671418365773), // + sqrt(0.5/3)/(1 - (-1))
];

#[test]
fn eq_18_and_the_seventeen_measures() {
    check(false, &PLAIN);
    assert_eq!(Measures::NAMES.as_slice(), PLAIN.map(|(name, _)| name).as_slice(), "names, in order");
    for ((name, expected), found) in PLAIN.into_iter().zip(measures(false).values()) {
        close(name, "", 0, found, expected);
    }
}

#[test]
fn a_standing_sample_counts_as_a_millimetre_per_second_for_the_authors() {
    check(
        true,
        &[
            // unweighted errors
            ("rmse_v", 0.3366501646120692651),
            // sqrt(0.34/25.000001)
            ("nrmse_v", 0.1166190355645253215),
            // sqrt((0.3/0.001)^2 + 0.01 + 0.01)/3): sqrt(90000.02/3)
            ("rmspe_v", 173.2051000018956332),
            // sqrt(0.34)/(sqrt(23.94) + sqrt(25.000001))
            ("u_v", 0.05894106045151924416),
            // the floored speed in the error too: sqrt(3)/10 + sqrt((0.299^2 + 0.09 + 0.16)/3)/(4 - 0.001)
            ("rmse_sn_vn", 0.1732050807568877294 + 0.08410939852345410025),
            // spacing is not floored
            ("nrmse_s", 0.1),
        ],
    );
}

#[test]
fn rmspe_at_standstill() {
    // 0.001 m/s and less is standstill, 0.0011 is not: (0.0022/0.0011 - 1)^2 = 1
    let of = |measured: [f64; 2], floored| SignalMeasures::compare(&[0.0022, 0.5], &measured, floored).rmspe;
    close("rmspe", "", 0, of([0.0011, 0.001], false), 1.0);
    close("rmspe", "", 0, of([0.0011, -0.0005], false), 1.0);
    // floored: (0.5 - (-0.0005))/0.001 = 500.5: sqrt((1 + 500.5^2)/2) = sqrt(125250.625)
    close("rmspe floored", "", 0, of([0.0011, -0.0005], true), 353.9076503835428534);
    assert!(of([0.0, 0.0], false).is_nan(), "no sample to relate to");
    assert_eq!([0.001, -0.001, -0.0011].map(|v| denominator(v, true)), [0.001, 0.001, -0.0011]);
}

#[test]
fn slopes_are_the_derivatives_of_the_terms() {
    let kinds = [Accumulation::Squared, Accumulation::Relative, Accumulation::Theil, Accumulation::Floored];
    for (kind, floored, observed) in
        kinds.into_iter().flat_map(|kind| [(kind, false, 4.0), (kind, true, 0.0), (kind, false, 0.0)])
    {
        // Terms are straight lines, so that a step of 1 gives the slope up to rounding.
        let step = kind.term(8.0, observed, floored) - kind.term(7.0, observed, floored);
        close(&format!("{kind:?} at {observed}, floored {floored}"), "", 0, kind.slope(observed, floored), step);
    }
    // 1/4, and 1/0.001
    close("relative", "", 0, Accumulation::Relative.slope(4.0, false), 0.25);
    close("relative to the floor", "", 0, Accumulation::Relative.slope(0.0, true), 1000.0);
}

#[test]
fn a_norm_leaves_out_what_is_not_compared() {
    let gof: GoodnessOfFit = "rmse-v:2".parse().expect("a goodness of fit");
    let of = |(_, measured): ([f64; 3], [f64; 3])| Measured::of(&measured, false);
    let norm = gof.norm(&[SPACING, SPEED, ACCELERATION].map(of));
    // sqrt(25/3); the others' divisor is 1, so that nothing divides 0 by 0
    assert_eq!((norm.per_count, norm.weight), ([0.0, 1.0 / 3.0, 0.0], [0.0, 2.0, 0.0]));
    close("rms", "m/s", 0, norm.rms_measured[1], 2.8867513459481288225);
    assert_eq!([norm.rms_measured[0], norm.rms_measured[2]], [1.0; 2]);
}

#[test]
fn eq_18_weights() {
    // beta: 2*0.1 + 0.5*0.11661903789690601 + 4*0.47140452079103168
    check(
        false,
        &[
            ("nrmse-sva:2,0.5,4", 0.2 + 0.0583095189484530047 + 1.8856180831641267316),
            ("nrmse-sva:1,1,0.5", 0.1 + 0.1166190378969060094 + 0.23570226039551584145),
            ("nrmse-sa", 0.1 + 0.4714045207910316829),
            ("nrmse-va:3,1", 0.3498571136907180282 + 0.4714045207910316829),
            ("rmse-s:10", 17.32050807568877294),
            ("rmse-s:0.005", 0.00866025403784438647), // a small weight is a weight
            ("rmspe-a", 0.6454972243679028142),       // 0.5/1, 0, -0.5/0.5: sqrt(1.25/3)
        ],
    );
    assert_eq!(GoodnessOfFit::default(), GoodnessOfFit::NRMSE_SVA, "the paper's objective");
    check(false, &[("nrmse-sva", GoodnessOfFit::NRMSE_SVA.of(&measures(false)))]);
}

#[test]
fn noise_of_the_acceleration_counts_if_it_is_compared() {
    for (name, counts) in [("nrmse-sva", true), ("rmse-a:0.005", true), ("rmse-sv", false)] {
        let gof: GoodnessOfFit = name.parse().expect("a goodness of fit");
        assert_eq!(gof.minds(FindingKind::Noisy), counts, "{name}");
        assert!(gof.minds(FindingKind::SpeedScale), "{name}");
    }
}

#[test]
fn names_are_read_back_and_nonsense_is_not() {
    for name in Measures::NAMES {
        let gof: GoodnessOfFit = name.parse().expect("a goodness of fit");
        assert_eq!(gof.to_string(), name.replace('_', "-"));
        assert_eq!(gof.to_string().parse(), Ok(gof));
    }
    for name in [
        "",
        "nrmse",
        "nrmse-",
        "nrmse-vs",
        "nrmse-ss",
        "mape-s",
        "nrmse-sva:1,1",
        "nrmse-s:1,1",
        "nrmse-s:0",
        "nrmse-s:x",
    ] {
        assert!(name.parse::<GoodnessOfFit>().is_err(), "{name:?}");
    }
}

#[test]
fn the_mean_of_several_cases() {
    // One measure set, and the same with every value of a signal times 3, 5, 7: means times 2, 3, 4.
    let one = measures(false);
    let mut other = one;
    for (signal, factor) in other.0.iter_mut().zip([3.0, 5.0, 7.0]) {
        for value in [&mut signal.rmse, &mut signal.nrmse, &mut signal.rmspe, &mut signal.u, &mut signal.rmse_n] {
            *value *= factor;
        }
    }
    let mean = Measures::mean(&[one, other]).expect("two of them");
    for (name, factor) in [("s", 2.0), ("v", 3.0), ("a", 4.0)] {
        for kind in ["rmse", "nrmse", "rmspe", "u"] {
            let gof: GoodnessOfFit = format!("{kind}-{name}").parse().expect("a goodness of fit");
            close(&format!("mean of {kind}-{name}"), "", 0, gof.of(&mean), factor * gof.of(&one));
        }
    }
    // 2*0.1732050807568877 + 3*0.08416254115301732 + 4*0.2041241452319315
    let gof: GoodnessOfFit = "rmse-sn-vn-an".parse().expect("a goodness of fit");
    close("mean of rmse-sn-vn-an", "", 0, gof.of(&mean), 1.4153943659005533);
    assert_eq!(Measures::mean(&[]), None);
}

#[test]
fn a_signal_that_is_not_compared_cannot_spoil_the_score() {
    // measured a = 0 throughout: NRMSE(a) divides by zero
    let mut all = measures(false);
    all.0[2] = SignalMeasures::compare(&[0.0; 3], &[0.0; 3], false);
    let of = |name: &str| name.parse::<GoodnessOfFit>().expect("a goodness of fit").of(&all);
    assert!(of("nrmse-sva").is_nan());
    close("nrmse-sv", "", 0, of("nrmse-sv"), 0.2166190378969060094);
}

/// Samples from 2 on count: 0, 3, 4, whose squares sum to 25. Relative errors need a value other than 0, or a speed with a floor.
#[test]
fn the_weight_of_a_drive_among_pooled_ones() {
    let signal: Vec<f64> = vec![9.0, 9.0, 0.0, 3.0, 4.0];
    for (convention, floored) in [(Convention::PAPER, 2.0), (Convention::AUTHORS, 3.0)] {
        let case = Case::new(&steady([30.0, 20.0, 20.0]), variant("idm"), None, convention, 0.0).expect("complete");
        let [s, v_f, a_f] = [0, 1, 2].map(|_| signal.clone());
        let case = Case { earliest: 2, s: s.into(), v_f: v_f.into(), a_f: a_f.into(), ..case };
        for (name, weight) in [
            ("pooled-rmse-s", Some(3.0)),
            ("pooled-rmse-v:2", Some(3.0)),
            ("pooled-nrmse-s", Some(25.0)),
            ("pooled-nrmse-a", Some(25.0)),
            ("pooled-rmspe-s", Some(2.0)),
            ("pooled-rmspe-v", Some(floored)),
            ("pooled-rmspe-a", Some(2.0)),
            ("nrmse-s", None),
        ] {
            let gof: GoodnessOfFit = name.parse().expect("a goodness of fit");
            let share = case.share(&gof);
            assert_eq!((gof.is_pooled(), share.samples), (weight.is_some(), 5), "{name}");
            match share.weight.zip(weight) {
                Some((found, expected)) => close(name, "-", 0, found, expected),
                None => assert_eq!(share.weight, weight, "{name}"),
            }
        }
    }
    for name in ["pooled-rmse-sv", "pooled-nrmse-sva", "pooled-u-s"] {
        assert!(name.parse::<GoodnessOfFit>().is_err(), "{name}: one signal, whose denominator is measured");
    }
    let short = Case::new(&steady([30.0, 20.0, 20.0]), variant("idm"), None, Convention::PAPER, 0.0).expect("complete");
    let gof: GoodnessOfFit = "pooled-rmse-s".parse().expect("a goodness of fit");
    assert_eq!(Case { earliest: 99, ..short }.share(&gof).weight, Some(0.0));
}
