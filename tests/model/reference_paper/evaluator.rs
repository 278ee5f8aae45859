//! The reference as an evaluator: scored samples, means over cases, failures, rejection.

use super::bench::{LEN_L, NONE, Sample, X_0, case, close, steady, trajectory};
use leadlag::internal::convention::{BoundRule, Convention};
use leadlag::internal::evaluator::{Evaluator, Failure, FailureKind, Job, Population, Score};
use leadlag::internal::reference::{Reference, Trace};
use leadlag::internal::score::{GoodnessOfFit, Signal};
use leadlag::internal::symbols::{Parameters, Symbol};

/// No gains: the simulated car keeps 20 m/s: x_f = 100, 102, 104, 106.
const COAST: Parameters = Parameters { k_s: 0.0, k_v: 0.0, k_0: 0.0, v_0: 30.0, d_0: 2.0, t_h: 1.5, ..NONE };

/// Measured: v_f = 20, 60, 0, 20; x_f = 100, 104, 107, 108; so x_l = x_f + 5 + s = 135, 139, 112.0005, 143.
const SAMPLES: [Sample; 4] = [[30.0, 20.0, 20.0], [30.0, 60.0, 20.0], [0.0005, 0.0, 20.0], [30.0, 20.0, 20.0]];

#[test]
fn eq_18_over_the_simulated_samples() {
    // Samples 1 to 3. Simulated s = 32, 3.0005, 32: errors 2, 3, 2: RMSE = sqrt(17/3), NRMSE = sqrt(17/(900 + 0.0005^2 + 900)),
    //   RMSPE without the sample below 0.001 m: 2/30.
    // v: errors -40, 20, 0: RMSE = sqrt(2000/3), NRMSE = sqrt(2000/(3600 + 0 + 400)), RMSPE: sqrt(((40/60)^2 + 0)/2);
    //   floored (the authors; speed only): NRMSE = sqrt(2000/4000.000001), RMSPE = sqrt(((40/60)^2 + (20/0.001)^2 + 0)/3)
    // a: simulated 0; measured backward 400, -600, 200: RMSE = sqrt(560000/3); forward -600, 200, 0: sqrt(400000/3);
    //   NRMSE = 1; RMSPE 1 (of the samples above 0.001 m/s²)
    let expected = [
        (Convention::PAPER, 0.7071067811865475244, 0.4714045207910316829, 432.0493798938573487),
        (Convention::AUTHORS, 0.7071067810981591768, 11547.00539020751828, 365.1483716701107423),
    ];
    for (convention, nrmse_v, rmspe_v, rmse_a) in expected {
        let outcome =
            Reference::outcome(&case("l-cth", &trajectory(&SAMPLES), convention), &COAST, &mut Trace::default());
        let measures = outcome.result.expect("no failure");
        assert_eq!((outcome.delay_steps, outcome.n_cut_acc, outcome.n_cut_dec), (0.0, 0, 0));
        let [s, v, a] = [Signal::Spacing, Signal::Speed, Signal::Acceleration].map(|signal| *measures.signal(signal));
        let check =
            |name: &str, found: f64, by_hand: f64| close(&format!("{convention}: {name}"), "", 0, found, by_hand);
        check("rmse_s", s.rmse, 2.380476142847616666);
        check("nrmse_s", s.nrmse, 0.09718253157400622093);
        check("rmspe_s", s.rmspe, 2.0 / 30.0);
        check("rmse_v", v.rmse, 25.81988897471611257);
        check("nrmse_v", v.nrmse, nrmse_v);
        check("rmspe_v", v.rmspe, rmspe_v);
        check("rmse_a", a.rmse, rmse_a);
        check("nrmse_a", a.nrmse, 1.0);
        check("rmspe_a", a.rmspe, 1.0);
        check("nrmse_sva", GoodnessOfFit::NRMSE_SVA.of(&measures), 0.09718253157400622093 + nrmse_v + 1.0);
    }
}

fn population(candidates: &[Parameters]) -> Population {
    let symbols = [Symbol::k_s, Symbol::k_v, Symbol::k_0, Symbol::v_0, Symbol::d_0, Symbol::t_h];
    let mut population = Population::new(&symbols);
    for candidate in candidates {
        population.push(&symbols.map(|symbol| candidate.get(symbol)));
    }
    population
}

fn scores(evaluator: &mut Reference, candidates: &[Parameters]) -> Vec<Score> {
    let mut scores = vec![Score::Value(f64::NAN); candidates.len()];
    evaluator.evaluate(&population(candidates), &mut scores).expect("as many scores as candidates");
    scores
}

/// Measured: 20 m/s throughout, and a spacing that the coasting car keeps up to `error` metres.
fn keeps(error: f64) -> leadlag::internal::trajectory::Trajectory {
    let mut data = steady([30.0, 20.0, 20.0]);
    for s in &mut data.s {
        *s = 30.0 - error;
    }
    data
}

#[test]
fn the_score_is_the_mean_over_the_cases() {
    // RMSE(s) = 1 and 4 on the two: 2.5; the second candidate brakes at 0.2*(v_0 - 20) = -400 m/s²: stands, s only grows.
    let rmse_s: GoodnessOfFit = "rmse-s".parse().expect("a goodness of fit");
    let cases: Vec<_> = [1.0, -4.0].map(|e| case("l-cth", &keeps(e), Convention::PAPER)).into();
    let mut both = Reference::new(cases.clone(), rmse_s);
    let stop = Parameters { k_0: 0.2, v_0: -1980.0, ..COAST };
    let found = scores(&mut both, &[COAST, stop]);
    let Score::Value(value) = found[0] else { panic!("{found:?}") };
    close("mean of RMSE(s)", "m", 0, value, 2.5);
    // Standing from sample 1 on: 30 + (1 + 2*(i - 1)) = 29 + 2*i: against 29: 2*i; against 34: 2*i - 5; samples 1 to 12.
    // sum of 4*i^2 = 4*650 = 2600; sum of (2*i - 5)^2 = 2600 - 20*78 + 300 = 1340
    // (sqrt(2600/12) + sqrt(1340/12))/2 = (14.719601443879744 + 10.567244989431569)/2
    let Score::Value(value) = found[1] else { panic!("{found:?}") };
    close("mean of RMSE(s)", "m", 0, value, 12.643423216655656);
    assert_eq!((both.variant().id(), both.name(), both.precision(), both.cases().len()), (37, "reference", "f64", 2));
    let one = population(&[COAST]);
    let outcomes = both.outcomes(&[0, 1].map(|case| Job { case, population: &one })).expect("it runs");
    assert_eq!(outcomes.len(), 2);
    close("RMSE(s)", "m", 0, outcomes[1].result.expect("no failure").signal(Signal::Spacing).rmse, 4.0);
    assert!(both.evaluate(&population(&[COAST]), &mut []).is_err(), "room for no score");
}

#[test]
fn one_failed_case_fails_the_candidate() {
    let mut wall = steady([30.0, 20.0, 0.0]);
    wall.x_l.fill(X_0 + LEN_L + 3.0);
    let cases = vec![case("l-cth", &keeps(1.0), Convention::PAPER), case("l-cth", &wall, Convention::PAPER)];
    let mut evaluator = Reference::new(cases, GoodnessOfFit::NRMSE_SVA);
    // At its sample 2, after the 13 samples of the previous case.
    let crash = Failure { kind: FailureKind::Crash, step: 13 + 2 };
    assert_eq!(scores(&mut evaluator, &[COAST]), [Score::Failed(crash)]);
}

/// The preceding vehicle brakes or pulls away by `jumps` m/s at those steps: k_v = 1, so that each is a command of as many m/s².
fn cut_case(jumps: &[(usize, f64)], convention: Convention) -> Reference {
    let mut data = steady([30.0, 20.0, 20.0]);
    // every command is relative to the simulated speed, which the bounds -7 and 5 m/s² change by -0.7 and 0.5
    let mut v = 20.0;
    for i in 0..data.v_l.len() {
        let jump = jumps.iter().find(|(step, _)| *step == i + 1).map_or(0.0, |(_, dv)| *dv);
        data.v_l[i] = v + jump;
        v += jump.clamp(-7.0, 5.0) / 10.0;
    }
    Reference::new(vec![case("l-cth+constant", &data, convention)], GoodnessOfFit::NRMSE_SVA)
}

#[test]
fn a_touched_bound_rejects_where_the_convention_says_so() {
    let p = Parameters { k_v: 1.0, k_0: 100.0, v_0: 1000.0, ..COAST };
    let rejecting = Convention { bounds: BoundRule::Reject, ..Convention::PAPER };
    let upper = [(1, 9.0)];
    let lower = [(2, -9.0)];
    let both = [(1, 9.0), (3, -9.0)];
    for (jumps, cuts) in [(&[][..], [0, 0]), (&upper, [1, 0]), (&lower, [0, 1]), (&both, [1, 1])] {
        for convention in [Convention::PAPER, Convention::AUTHORS, rejecting] {
            let mut evaluator = cut_case(jumps, convention);
            let outcome = evaluator.outcomes(&[Job { case: 0, population: &population(&[p]) }]).expect("it runs")[0];
            assert_eq!([outcome.n_cut_acc, outcome.n_cut_dec], cuts, "{convention}: cuts for {jumps:?}");
            let rejected = scores(&mut evaluator, &[p])[0] == Score::Rejected;
            assert_eq!(rejected, convention.bounds == BoundRule::Reject && cuts != [0, 0], "{convention}: {jumps:?}");
        }
    }
}
