use super::evidence::{ConfidenceSet, Rows, Table, table};
use super::own::OwnLaw;
use super::*;
use crate::diagnose::drive::ahead::{BRAKING, GENTLE_BRAKING};
use crate::diagnose::{Effort, Verdict, made_up};
use crate::judge::{Resamples, mean};
use crate::pooling::SPREAD;
use crate::result::diagnosis::Outcome;
use crate::wgsl::extension_named;
use std::cmp::Ordering;

fn cause(name: &str) -> &'static Extension {
    extension_named(name).expect("in the library")
}

#[test]
fn pairs_are_causes_that_hide_each_other() {
    let causes = ["dead_zone", "actuation_lag", "leader_accel_ff", "set_speed_change", LEAD].map(cause);
    let sets = |named: &[&'static Extension]| -> Vec<Vec<String>> {
        super::sets(&causes, named).iter().map(|set| names(set)).collect()
    };
    // No fold can judge an event, and the lead is not a property of a car.
    let expected: [&[&str]; 4] =
        [&["dead_zone"], &["actuation_lag"], &["leader_accel_ff"], &["actuation_lag", "leader_accel_ff"]];
    assert_eq!(sets(&[]), expected);
    // The model with the named causes is judged, too, once, and only if no cause of one drive is among them.
    let [dead_zone, lag, ahead, event, _] = causes;
    assert_eq!(sets(&[lag, dead_zone])[4..], [["actuation_lag", "dead_zone"]]);
    for known in [&[ahead, lag][..], &[dead_zone], &[dead_zone, event]] {
        assert_eq!(sets(known), expected);
    }
}

/// Losses of 90 bins at each horizon: a part common to all models and a small separate one, minus `less`.
fn rows(less: f64, own: f64) -> Rows {
    let loss = |k: usize, h: usize| {
        let t = k as f64 + 100.0 * h as f64;
        1.0 + 0.3 * (0.37 * t).sin() + 0.02 * (own + 1.7 * t).sin() - less
    };
    std::array::from_fn(|h| (0..90).map(|k| loss(k, h)).collect())
}

#[test]
fn a_better_model_leaves_the_reference_and_worse_laws_behind() {
    let resamples = Resamples::new(&[90], 3.0, 999, 1);
    let (reference, models) = (rows(0.0, 0.0), [rows(0.1, 1.0), rows(0.0, 2.0), rows(0.1, 3.0)]);
    let found = table(&reference, &models, &[], &[rows(-0.2, 4.0)], &resamples, &Policy::DEFAULT);
    let p: Vec<f64> = found.rows.iter().map(|row| row.p).collect();
    assert!(p[0] < 0.01 && p[1] > 0.05 && p[2] < 0.01, "{p:?}");
    for set in &found.sets {
        assert!(set.models[0] && !set.models[1] && set.models[2] && !set.reference && !set.laws[0], "{set:?}");
    }
    // Over whole drives a gain is a share of the loss; at shorter horizons it is a share of the logarithm of squared errors.
    let gains = &found.rows[0].gains;
    assert!(
        (gains[2].share - 0.1).abs() < 0.01 && (gains[0].share - (1.0 - (-0.05_f64).exp())).abs() < 0.01,
        "{gains:?}"
    );
    let none = table(&reference, &[rows(0.0, 2.0)], &[], &[], &resamples, &Policy::DEFAULT);
    assert!(none.rows[0].p > 0.05 && none.sets.iter().all(|set| set.reference), "{none:?}");
    // A single model is found from about three standard errors on, each of which is at most 1 % of the error here.
    let [needed, gain] = none.found;
    assert!((2.5..6.0).contains(&needed) && gain > 0.0 && gain < 0.06, "{none:?}");
}

#[test]
fn a_model_that_is_worse_over_whole_drives_is_left_behind() {
    let resamples = Resamples::new(&[90], 3.0, 999, 1);
    let models = [rows(0.1, 1.0), rows(0.0, 2.0), rows(0.1, 3.0)];
    let best = best_over_whole_drives(&models.each_ref(), &resamples, &Policy::DEFAULT);
    assert_eq!(best, [true, false, true]);
}

/// A linear law and two members of one family on two made-up minutes, judged.
fn judged_models() -> (Field, Entry, Vec<Entry>) {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let field = Field::new(Parts::of(&drives, Unit::Recording), &Overrides::new(), 1);
    let mut silent = |_: Progress| ControlFlow::Continue(());
    let watching = Watching::new(&mut silent);
    let law = field.law("l-cth".parse().expect("a law"), &watching).expect("fits");
    let mut base = field.again(&law, None, &watching).expect("fits");
    let member = |name| {
        field
            .with_causes(&base, &[cause(name)], &[], &Horizon::ALL, &watching)
            .expect("fits")
            .expect("has all it needs")
    };
    let mut models: Vec<Entry> = ["sensor_lowpass", "actuation_lag"].map(member).into();
    field.judge(&mut base, None, &watching).expect("can be judged");
    models.iter_mut().for_each(|entry| field.judge(entry, Some(&base), &watching).expect("can be judged"));
    (field, base, models)
}

/// Without one of four similar drives a fit gains less than the tolerance of a search, but moves.
#[test]
fn intervals_have_a_width() {
    let driver =
        |k: usize| made_up::linear_driver(&format!("{k}.csv"), [0.12, 0.5, 2.2, 1.5], 15.0 + 0.05 * k as f64, 0.2);
    let drives: Vec<Drive> = (0..4).map(driver).collect();
    let field = Field::new(Parts::of(&drives, Unit::Recording), &Overrides::new(), 1);
    let mut silent = |_: Progress| ControlFlow::Continue(());
    let watching = Watching::new(&mut silent);
    let law = field.law("l-cth".parse().expect("a law"), &watching).expect("fits");
    let mut base = field.again(&law, None, &watching).expect("fits");
    field.judge(&mut base, None, &watching).expect("can be judged");
    for (k, symbol) in
        base.model.symbols.iter().enumerate().filter(|(_, symbol)| ["k_s", "t_h"].contains(&symbol.name()))
    {
        let intervals: Vec<[f64; 2]> = (0..HORIZONS).filter_map(|horizon| base.interval(k, horizon)).collect();
        assert!(
            intervals.len() == HORIZONS && intervals.iter().all(|[low, high]| low < high),
            "{symbol:?} {intervals:?}"
        );
    }
}

#[test]
fn a_cause_counts_where_its_interval_excludes_no_effect() {
    let (_, _, mut models) = judged_models();
    let gain = Gain { share: 0.2, interval: [0.1, 0.3], t: 5.0 };
    let rows = vec![Evidence { gains: [gain; HORIZONS], t: 5.0, p: 0.001, in_set: true }; 2];
    let sought_at = |models: &[Entry], horizons, sought| {
        let set = ConfidenceSet { horizons, models: vec![true; 2], reference: false, laws: Vec::new() };
        let table = Table { rows: rows.clone(), sets: vec![set], found: [3.0, 0.1] };
        named(models, &table, &Policy::DEFAULT, sought, (1, 1)).map(|named| names(&named.causes))
    };
    let named_at = |models: &[Entry], horizons| sought_at(models, horizons, Sought::Name(&[]));
    for (entry, sizes) in models.iter_mut().zip([[1.0, 0.0], [1.0, 1.0]]) {
        let k = entry.model.positions(entry.causes[0])[0];
        for (fit, size) in entry.fits.iter_mut().flatten().zip(sizes) {
            fit.whole[k] = size;
        }
    }
    assert_eq!(named_at(&models, &[0, 1]), Some(vec!["actuation_lag".to_owned()]));
    assert_eq!(named_at(&models, &[1]), None, "the interval of the filter at 15 s contains 0");
    let lag = models[1].model.positions(models[1].causes[0])[0];
    let upper = models[1].model.axes[lag].upper;
    let mut sized = |size: f64| {
        let fit = models[1].fits[1].as_mut().expect("fitted");
        fit.whole[lag] = size;
        fit.judged.as_mut().expect("judged").folds.iter_mut().for_each(|fold| fold[lag] = size);
        [Sought::Name(&[]), Sought::Support].map(|sought| sought_at(&models, &[0, 1], sought))
    };
    let lag_alone = Some(vec!["actuation_lag".to_owned()]);
    assert_eq!(sized(upper), [None, lag_alone.clone()], "the lag at 15 s lies on its bound");
    assert_eq!(sized(1.0), [lag_alone.clone(), lag_alone]);
    let judged = models[1].fits[1].as_mut().and_then(|fit| fit.judged.as_mut()).expect("judged");
    judged.folds.iter_mut().step_by(2).for_each(|fold| fold[lag] += 2.0);
    assert_eq!(named_at(&models, &[0, 1]), None, "the interval of the lag at 15 s contains 0");
}

/// A model outside the confidence set may have more standard errors.
#[test]
fn the_named_cause_is_that_of_one_of_the_best_models() {
    let (_, _, mut models) = judged_models();
    for entry in &mut models {
        let k = entry.model.positions(entry.causes[0])[0];
        entry.fits.iter_mut().flatten().for_each(|fit| fit.whole[k] = 1.0);
    }
    let gain = Gain { share: 0.2, interval: [0.1, 0.3], t: 5.0 };
    let rows = [6.0, 5.0].map(|t| Evidence { gains: [gain; HORIZONS], t, p: 0.001, in_set: true });
    let named_of = |in_set: [bool; 2]| {
        let set = ConfidenceSet { horizons: &[0, 1], models: in_set.to_vec(), reference: false, laws: Vec::new() };
        let table = Table { rows: rows.to_vec(), sets: vec![set], found: [3.0, 0.1] };
        named(&models, &table, &Policy::DEFAULT, Sought::Name(&[]), (1, 1)).map(|named| names(&named.causes))
    };
    assert_eq!(named_of([true, true]), Some(vec!["sensor_lowpass".to_owned()]));
    assert_eq!(named_of([false, true]), Some(vec!["actuation_lag".to_owned()]));
}

#[test]
fn of_equally_simple_models_that_of_a_named_cause_is_recommended() {
    let (_, base, models) = judged_models();
    let order = |named: &[&'static Extension]| preferred(&models, &base, named, &|k| [0.3, 0.2][k], 0, 1);
    assert_eq!(order(&[]), Ordering::Less);
    assert_eq!(order(&[cause("actuation_lag")]), Ordering::Greater);
}

#[test]
fn a_model_that_collides_is_not_recommended() {
    let (field, mut base, mut models) = judged_models();
    let unmet = |base: &Entry, entry: &Entry| {
        let gain = Gain { share: 0.2, interval: [0.1, 0.3], t: 5.0 };
        let evidence = Evidence { gains: [gain; HORIZONS], t: 5.0, p: 0.001, in_set: true };
        let checks = checks(&Policy::DEFAULT, base, entry, &evidence, &entry.causes);
        let unmet = checks.into_iter().filter(|check| !check.met).map(|check| check.name);
        unmet.filter(|name| name.starts_with("collisions")).collect::<Vec<String>>()
    };
    let lag = &mut models[1];
    assert_eq!(unmet(&base, lag), Vec::<String>::new());
    // Without a distance at standstill, a car that follows with a headway touches the car that stops.
    let fit = lag.fits[HORIZONS - 1].clone().expect("fitted");
    let judged = fit.judged.clone().expect("it is judged");
    let mut values = fit.whole;
    for (name, value) in [("k_s", 0.1), ("d_0", 0.0)] {
        values[lag.model.symbols.iter().position(|symbol| symbol.name() == name).expect("of the law")] = value;
    }
    let collisions =
        |braking: f64| field.collisions_at_stops(lag.model.variant, &values, braking).expect("can be simulated");
    let [stops, gentle_stops] = [BRAKING, GENTLE_BRAKING].map(collisions);
    assert_eq!(
        [judged.stops, judged.gentle_stops, stops, gentle_stops],
        [0, 0, field.parts.drives.len(), field.parts.drives.len()]
    );
    for (own, check) in [
        (Judged { stops, ..judged.clone() }, "collisions behind a car that stops, in excess of the base"),
        (Judged { gentle_stops, ..judged.clone() }, "collisions behind a car that stops gently, in excess of the base"),
    ] {
        lag.fits[HORIZONS - 1].as_mut().expect("fitted").judged = Some(own);
        assert_eq!(unmet(&base, lag), [check]);
    }
    // It may do so where the base does.
    base.fits[HORIZONS - 1].as_mut().expect("fitted").judged.as_mut().expect("judged").gentle_stops = gentle_stops;
    assert_eq!(unmet(&base, lag), Vec::<String>::new());
    let mut held = judged.held.clone();
    held.parts[0].as_mut().expect("left out once").shortfall = 1.0;
    lag.fits[HORIZONS - 1].as_mut().expect("fitted").judged = Some(Judged { held, ..judged });
    assert_eq!(unmet(&base, lag), ["collisions on left-out drives"]);
}

#[test]
fn every_cause_of_a_recommended_model_has_a_size() {
    let (field, base, _) = judged_models();
    let causes = ["actuation_lag", "leader_accel_ff"].map(cause);
    let mut silent = |_: Progress| ControlFlow::Continue(());
    let watching = Watching::new(&mut silent);
    let pair = field.with_causes(&base, &causes, &[], &Horizon::ALL, &watching).expect("fits");
    let mut pair = pair.expect("has all it needs");
    field.judge(&mut pair, Some(&base), &watching).expect("can be judged");
    let mut spread = |sizes: [f64; 2]| {
        for (cause, size) in causes.iter().zip(sizes) {
            let k = pair.model.positions(cause)[0];
            for fit in pair.fits.iter_mut().flatten() {
                let folds = fit.judged.iter_mut().flat_map(|judged| &mut judged.folds);
                folds.chain([&mut fit.whole]).for_each(|values| values[k] = size);
            }
        }
        let gain = Gain { share: 0.2, interval: [0.1, 0.3], t: 5.0 };
        let evidence = Evidence { gains: [gain; HORIZONS], t: 5.0, p: 0.001, in_set: true };
        let checks = checks(&Policy::DEFAULT, &base, &pair, &evidence, &causes);
        checks.iter().find(|check| check.name.starts_with("largest size")).expect("it is asked").met
    };
    assert_eq!([[0.5, 0.5], [0.0, 0.5], [0.5, 0.0]].map(&mut spread), [true, false, false]);
}

/// A named model that is not recommended is delivered with its gain, and with the drives that would tell its rivals apart.
#[test]
fn a_named_model_has_a_gain() {
    let (field, base, mut models) = judged_models();
    let [filter, lag] = ["sensor_lowpass", "actuation_lag"].map(cause);
    let (drives, bounds) = ([made_up::drive("made_up.csv", 0.0)], Overrides::new());
    let request = Request {
        drives: &drives,
        unit: Unit::Recording,
        base: "l-cth".parse().expect("a law"),
        causes: &[filter, lag],
        named: &[],
        sensor_noise: None,
        bounds: &bounds,
        seed: 1,
        rounds: 1,
    };
    let mut answer = unjudged(&request, &Policy::DEFAULT, field, Vec::new(), 0);
    answer.entries.push(base);
    answer.entries.append(&mut models);
    let rivals = vec![Alternative { of: lag, cause: filter, entry: 1 }];
    answer.named = Some(Named { causes: vec![lag], rivals, evidence: [5.0, 0.0], entry: 2 });
    let mut outcome = Outcome::new(Effort::Quick, 1);
    combine(&mut outcome, &answer);
    let gain = outcome.gain.take().expect("it is judged");
    let [before, after] = [0, 2].map(|k| {
        let held = &answer.entries[k].whole_drives().expect("fitted").judged.as_ref().expect("judged").held;
        mean(&held.roots(&answer.entries[k].scales))
    });
    assert_eq!((gain.base, gain.extended, outcome.recommended.take()), (before, after, None));
    assert_eq!(answer.extended().expect("it is judged").causes, [lag]);
    assert!(outcome.reason.contains("p < 0.001. Drives that would distinguish them: a leader"), "{}", outcome.reason);
    // An alternative has the size that it has in its own model.
    let own =
        answer.entries[1].fits[OF_A_NAME].as_ref().expect("fitted").whole[answer.entries[1].model.positions(filter)[0]];
    let sizes: Vec<f64> = outcome.confounded_with[0].parameters.iter().map(|parameter| parameter.value).collect();
    assert_eq!(sizes, [own]);
    // A cause of one drive is named by the likelihood only, and the race does not judge it.
    answer.likely = vec![cause("set_speed_change")];
    assert!(answer.extended().is_none());
    // Sensor noise is a reason for silence.
    let mut outcome = Outcome::new(Effort::Quick, 1);
    (answer.named, answer.sensor_noise) = (None, Some(1.2));
    (outcome.verdict, outcome.reason) = (Verdict::Nothing, "no cause passes".to_owned());
    combine(&mut outcome, &answer);
    assert_eq!(outcome.reason, "no cause passes; the missing acceleration lasts 1.2 s, as sensor noise does");
}

/// A law common to drivers of different headways hardly reacts to the gap. The middle of their own laws does.
#[test]
fn drivers_who_differ_have_a_middle_that_no_common_law_has() {
    let settings = |k: usize| [0.12, 0.5, 2.2, 0.8 + 0.8 * (0.618 * k as f64).fract()];
    let driver = |k: usize| made_up::linear_driver(&format!("{k}.csv"), settings(k), 10.0 + 0.5 * k as f64, 0.0);
    let drives: Vec<Drive> = (0..24).map(driver).collect();
    let field = Field::new(Parts::of(&drives, Unit::Driver), &Overrides::new(), 1);
    let mut silent = |_: Progress| ControlFlow::Continue(());
    let watching = Watching::new(&mut silent);
    let base = field.law("l-cth".parse().expect("a law"), &watching).expect("fits");
    let model = field.model(base.model.variant).expect("a model");
    let surface = field.surface(&model, field.all(), Horizon::Window);
    let common = &base.fits[OF_A_NAME].as_ref().expect("fitted").whole;
    let middle = surface.values(&field.middle(&surface, surface.place(common), &watching).expect("can be simulated"));
    let of = |values: &[f64], name: &str| {
        values[model.symbols.iter().position(|symbol| symbol.name() == name).expect("of the law")]
    };
    assert!(of(common, "k_s") < 0.06, "{common:?}");
    assert!((of(&middle, "k_s") - 0.12).abs() < 0.02 && (of(&middle, "t_h") - 1.2).abs() < 0.1, "{middle:?}");
}

/// Own parameters have a price, which grows with their number.
#[test]
fn own_parameters_have_a_price() {
    let drives = [made_up::drive("made_up.csv", 0.0)];
    let field = Field::new(Parts::of(&drives, Unit::Driver), &Overrides::new(), 1);
    let mut silent = |_: Progress| ControlFlow::Continue(());
    let watching = Watching::new(&mut silent);
    let model = field.model("l-cth".parse().expect("a law")).expect("a model");
    let surface = field.surface(&model, field.all(), Horizon::Window);
    let middle = vec![0.4; model.axes.len()];
    let position = |name: &str| model.symbols.iter().position(|symbol| symbol.name() == name).expect("of the law");
    let prices: Vec<f64> = [&["t_h"][..], &["t_h", "k_s"], &["t_h", "k_s", "d_0"]]
        .into_iter()
        .map(|own| {
            let own: Vec<usize> = own.iter().map(|name| position(name)).collect();
            let held: Vec<usize> = (0..middle.len()).filter(|k| !own.contains(k)).collect();
            let law = OwnLaw::new(surface, (&middle, SPREAD), &held);
            let found = law.found(&watching).expect("can be simulated").expect("completes the drive");
            let (cost, losses) = law.judged(&watching).expect("can be simulated").expect("completes the drive");
            assert!(mean(&losses.logs()) > found.cost, "the losses of the bins have it, too");
            cost - found.cost
        })
        .collect();
    assert!(prices[0] > 0.01 && prices.windows(2).all(|pair| pair[1] > pair[0]), "{prices:?}");
}
