//! Calibrations with clocks that count from 1970, with events of one recording, and of models that start at different samples.

use super::*;
use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::made_up;
use crate::evaluator::Share;
use crate::wgsl::extension_named;

/// L-CTH with a change of headway 60 s after `begin`, and the frequency and phase of a periodic disturbance.
fn extended(begin: f64, r: f64) -> Fitted {
    let values = [("r", r), ("t0", begin + 60.0), ("As", 0.2), ("Ac", 0.1), ("f", 0.05)];
    fitted(&["headway_mode_change", "periodic"], &values)
}

/// L-CTH with some causes and values of their parameters.
fn fitted(causes: &[&str], of_causes: &[(&str, f64)]) -> Fitted {
    let base: Variant = "l-cth".parse().expect("a base");
    let variant = causes.iter().try_fold(base, |variant, name| variant.with(made_up::cause(name)));
    let variant = variant.expect("they go together");
    let values = [("k_s", 0.2), ("k_v", 0.6), ("k_0", 0.2), ("v_0", 40.0), ("d_0", 3.0), ("t_h", 1.5)];
    let mut parameters = Parameters::NONE;
    for symbol in variant.parameters() {
        let known = values.iter().chain(of_causes).find(|(name, _)| *name == symbol.name());
        parameters.set(symbol, known.expect("a parameter of these").1);
    }
    Fitted {
        variant,
        parameters,
        estimates: Vec::new(),
        noise: Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 1e-3 },
        log_likelihood: 0.0,
        inflation: 1.0,
        innovations: Vec::new(),
    }
}

fn change(recording: Option<String>) -> Adopted {
    let extension = extension_named("headway_mode_change").expect("in the library");
    let family = "headway_mode_change".to_owned();
    Adopted { extension, instead_of: None, family, parameters: Vec::new(), evidence: 50.0, threshold: 20.0, recording }
}

#[test]
fn a_clock_that_counts_from_1970_is_calibrated_in_f64() {
    const BEGIN: f64 = 1.7e9;
    let (drives, model) = ([made_up::drive("made_up.csv", BEGIN)], extended(BEGIN, 0.2));
    let settings = GainSettings { seed: 1, max_evaluations: 100 };
    let go_on = &mut |_| ControlFlow::Continue(());
    // One parameter is searched.
    let bound = |symbol: &Symbol| {
        let value = model.parameters.get(*symbol);
        (symbol.name().to_owned(), if symbol.name() == "k_v" { [0.5, 0.7] } else { [value; 2] })
    };
    let bounds: Overrides = model.variant.parameters().iter().map(bound).collect();
    let found = recalibrated(&drives, [&model; 2], &[change(None)], &bounds, &settings, go_on);
    let found = found.expect("a calibration");
    let begins = |parameters: &Parameters| parameters.get(change(None).extension.parameters[1]);
    assert_eq!(begins(&found), begins(&model.parameters));
}

/// The clock of the drive without the event does not change, because the phase of a periodic cause refers to it.
#[test]
fn an_event_of_one_recording_does_nothing_in_another() {
    let drives = ["a.csv", "b.csv"].map(|name| made_up::drive(name, 10.0));
    let adopted = [change(Some(drives[0].recording()))];
    let variant = extended(10.0, 0.4).variant;
    let case = |drive: &Drive| drive.case(variant, &Overrides::new()).expect("long enough");
    let score = |evaluator: &mut dyn Evaluator, r: f64| {
        let model = extended(10.0, r);
        let symbols = variant.parameters();
        let mut one = Population::new(&symbols);
        one.push(&symbols.iter().map(|symbol| model.parameters.get(*symbol)).collect::<Vec<f64>>());
        let mut scores = [Score::Rejected];
        evaluator.evaluate(&one, &mut scores).expect("it runs");
        scores[0]
    };
    let alone = |drive: &Drive, r: f64| {
        let lanes = Lanes::new(vec![case(drive)], GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64);
        (score(&mut lanes.expect("a valid text"), r), Share { samples: drive.samples(), weight: None })
    };
    let both = drives.iter().map(case).collect();
    let found = score(evaluator(both, &drives, &adopted).expect("a valid text").as_mut(), 0.4);
    let expected = Score::joint([alone(&drives[0], 0.4), alone(&drives[1], 0.0)]);
    assert!(matches!(found, Score::Value(_)) && found == expected, "{found:?}, {expected:?}");
    assert_ne!(alone(&drives[1], 0.4), alone(&drives[1], 0.0));
}

/// A model with a delay needs some past. If it started later than its base, it would have one block less of this hold-out.
#[test]
fn base_and_extended_model_resample_the_same_blocks() {
    const BLOCKS: usize = 2;
    let whole = made_up::drive("made_up.csv", 10.0);
    let block = block_length(whole.dt());
    let holdout = [whole.part(0..BLOCKS * block + 5)];
    let (train, models) = ([whole], [fitted(&[], &[]), fitted(&["perception_delay"], &[("tp", 0.2)])]);
    let [base, extended] = &models;
    // The delay is searched, because its bounds determine the length of the past.
    let fixed = |symbol: &Symbol| (symbol.name().to_owned(), [base.parameters.get(*symbol); 2]);
    let bounds: Overrides = base.variant.parameters().iter().map(fixed).collect();
    let first = |drive: &Drive, variant: Variant| {
        let case = drive.case(variant, &bounds).expect("long enough");
        case.first_sample(case.longest_delay())
    };
    let blocks = |variant| (holdout[0].samples() - first(&holdout[0], variant)).div_ceil(block);
    assert_eq!([base, extended].map(|model| blocks(model.variant)), [BLOCKS + 1, BLOCKS], "each alone");
    let question = made_up::question(&train, &holdout, &bounds);
    let settings = GainSettings { seed: 1, max_evaluations: 100 };
    let found = gain(&question, [base, extended], &[], &settings, &mut |_| ControlFlow::Continue(()));
    let found = found.expect("both run");
    let (Some(before), Some(after), Some([low, high])) = (found.base, found.extended, found.interval) else {
        panic!("{}", found.sentence)
    };
    assert!(low <= before - after && before - after <= high, "{found:?}");
}
