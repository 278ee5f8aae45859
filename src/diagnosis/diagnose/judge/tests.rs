//! Checks of a cause, without a fit.

use super::*;
use crate::calibrate::Overrides;
use crate::diagnose::made_up::{self, candidate, cause};

/// Held-out likelihoods with these sums in each fold.
fn held(folds: [f64; 2]) -> CrossValidated {
    CrossValidated { folds: folds.map(|fold| vec![vec![fold]]) }
}

/// Checks of a cause that gains 900 nats on all data and `folds` in each fold, where 20 are needed.
fn judged(name: &str, sizes: &[f64], folds: [f64; 2]) -> (Vec<Check>, Option<Rejection>) {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let bounds = Overrides::new();
    let question = made_up::question(&drives, &[], &bounds);
    let base = candidate(&drives, &[]);
    let mut with = candidate(&drives, &[name]);
    with.fit.log_likelihood = base.fit.log_likelihood + 900.0;
    let positions = with.model.positions(cause(name));
    positions.into_iter().zip(sizes).for_each(|(k, size)| with.fit.point.values[k] = *size);
    let setting = Context::new(&question, None);
    let (with, without) = ((&with, &held(folds)), (&base, &held([0.0; 2])));
    let Judgement { checks, objection, .. } = Judgement::of(&setting, cause(name), with, without, 20.0);
    (checks, objection)
}

#[test]
fn a_limit_that_limits_nothing_is_no_name() {
    let objection = |name: &str, sizes: &[f64]| judged(name, sizes, [400.0; 2]).1;
    assert!(matches!(objection("accel_cap", &[4.0]), Some(Rejection::OnBound(_))));
    assert_eq!(objection("accel_cap", &[1.3]), None);
    // One of two lags may be zero.
    assert_eq!(objection("asym_lag", &[0.4, 0.0]), None);
    assert!(matches!(objection("asym_lag", &[0.0, 0.0]), Some(Rejection::OnBound(_))));
}

/// Both folds have to gain, whatever the sum. The list ends with the first check that fails.
#[test]
fn a_fold_that_loses_objects() {
    let asked = |folds: [f64; 2]| judged("accel_cap", &[1.3], folds);
    let (checks, objection) = asked([30.0, 12.0]);
    assert_eq!((checks.len(), objection), (3, None));
    assert_eq!(
        checks[..2],
        [Check::above("evidence", 42.0, 20.0), Check::above("evidence of the weaker fold", 12.0, 0.0)]
    );
    let (checks, objection) = asked([60.0, -2.0]);
    assert_eq!((checks.len(), objection), (2, Some(Rejection::OneFold)));
    let weak = Rejection::Weak { evidence: 18.0, need: 20.0 };
    assert_eq!(asked([12.0, 6.0]), (vec![Check::above("evidence", 18.0, 20.0)], Some(weak)));
}

/// The hold-out shows the effect of drag, and nothing about an event.
#[test]
fn an_event_need_not_recur() {
    let (train, holdout) = ([made_up::drive("made_up.csv", 0.0)], [made_up::drive("held.csv", 0.0)]);
    let bounds = Overrides::new();
    let question = made_up::question(&train, &holdout, &bounds);
    let setting = Context::new(&question, None);
    let current = made_up::candidate(&train, &[]);
    let objects = |name: &str| {
        let candidate = made_up::candidate(&train, &[name]);
        let (with, without) = ((&candidate, &held([1.0; 2])), (&current, &held([0.0; 2])));
        let mut judgement = Judgement::of(&setting, made_up::cause(name), with, without, 0.0);
        (judgement.objection, judgement.checks) = (None, Vec::new());
        judgement.ask_holdout(&setting, &mut None).expect("it runs");
        judgement.objection.is_some()
    };
    assert_eq!(["aero_drag", "set_speed_change"].map(objects), [true, false]);
}
