//! Figures of a diagnosis: the missing acceleration against signals, and the models of the race.

use crate::diagnose::describe::missing::{Class, Profile, Profiles};
use crate::report::figure::{Anchor, Axis, Figure, INK, PALETTE};
use crate::result::diagnosis::recommended::{ClosedLoopEntry, Trial};

/// Colours of the base and of the extended model.
const BASE: &str = PALETTE[1];
const EXTENDED: &str = PALETTE[0];
/// One panel \[px\].
const PANEL: [f64; 2] = [460.0, 250.0];
/// Room for numbers on the left and below \[px\].
const LEFT: f64 = 62.0;
const BELOW: f64 = 46.0;

/// The missing acceleration of the base model, and of the extended one if there is one, with 95 % bars.
#[must_use]
pub fn missing(title: &str, base: &Profiles, extended: Option<&Profiles>) -> String {
    let count = base.profiles.len();
    let rows = count.div_ceil(2).max(1);
    let height = 84.0 + rows as f64 * PANEL[1];
    let repeats =
        base.repeats_by_place.map_or(String::new(), |r| format!("; repeats by place between runs: r = {r:.2}"));
    let line = format!("mean of the missing acceleration in classes, with 95 % intervals{repeats}");
    let mut figure = Figure::new(2.0 * PANEL[0] + 40.0, height, title, &[&line]);
    let mut entries = vec![("base model", BASE)];
    entries.extend(extended.map(|_| ("extended model", EXTENDED)));
    figure.legend([16.0, 72.0], &entries);
    for (i, profile) in base.profiles.iter().enumerate() {
        let corner = [20.0 + (i % 2) as f64 * PANEL[0], 84.0 + (i / 2) as f64 * PANEL[1]];
        let other = extended.and_then(|e| e.profiles.iter().find(|p| p.name == profile.name));
        panel(&mut figure, corner, profile, other);
    }
    figure.finish()
}

fn panel(figure: &mut Figure, corner: [f64; 2], profile: &Profile, other: Option<&Profile>) {
    let both = || [Some((profile, BASE)), other.map(|p| (p, EXTENDED))].into_iter().flatten();
    let classes = || both().flat_map(|(p, _)| &p.classes);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let room = 0.05 * (high - low).max(1e-6);
        [low - room, high + room]
    };
    let [left, top] = [corner[0] + LEFT, corner[1] + 12.0];
    let [right, bottom] = [corner[0] + PANEL[0] - 12.0, corner[1] + PANEL[1] - BELOW];
    let x = Axis { values: range(&mut classes().map(|c| c.at)), places: [left, right] };
    let ends = &mut classes().flat_map(|c| [c.mean - 1.96 * c.error, c.mean + 1.96 * c.error, 0.0]);
    let y = Axis { values: range(ends), places: [bottom, top] };
    let name = if profile.unit == "-" { profile.name.clone() } else { format!("{} [{}]", profile.name, profile.unit) };
    figure.horizontal(&x, [top, bottom], 3.0, Some(&name));
    figure.vertical(&y, [left, right], 3.0, "d [m/s²]");
    figure.line([left, y.at(0.0)], [right, y.at(0.0)], 1.2, INK);
    figure.line([left, bottom], [right, bottom], 1.0, INK);
    for (own, colour) in both() {
        let points: Vec<[f64; 2]> = own.classes.iter().map(|c| [x.at(c.at), y.at(c.mean)]).collect();
        // Two classes with an empty class between them are not joined by a line.
        let adjoin = |a: &Class, b: &Class| a.number.zip(b.number).is_none_or(|(a, b)| a + 1 == b);
        let mut from = 0;
        for stretch in own.classes.chunk_by(adjoin) {
            if stretch.len() > 1 {
                figure.polyline(&points[from..from + stretch.len()], 1.0, colour);
            }
            from += stretch.len();
        }
        for (class, point) in own.classes.iter().zip(&points) {
            let reach = 1.96 * class.error;
            let [low, high] = [class.mean - reach, class.mean + reach].map(|end| y.at(end));
            figure.line([point[0], low], [point[0], high], 1.4, colour);
            figure.dot(*point, 2.6, colour);
        }
    }
}

/// The models of the race that gain most: the share by which the error on unseen data falls at each horizon, with its 95 % interval.
/// Filled: as good as the best.
#[must_use]
pub fn race(title: &str, race: &ClosedLoopEntry) -> String {
    const SHOWN: usize = 12;
    const ROW: f64 = 20.0;
    const NAMES: f64 = 300.0;
    const WIDTH: f64 = 200.0;
    const APART: f64 = 20.0;
    const TOP: f64 = 88.0;
    let mut trials: Vec<&Trial> = race.trials.iter().collect();
    trials.sort_by(|a, b| b.standard_errors.total_cmp(&a.standard_errors));
    trials.truncate(SHOWN);
    let horizons = trials.first().map_or(0, |trial| trial.horizons.len());
    let bottom = TOP + ROW * trials.len() as f64;
    let line = "reduction of the error on unseen data, corrected towards the measurement within the given time, with 95 % intervals";
    let width = NAMES + (WIDTH + APART) * horizons as f64;
    let mut figure = Figure::new(width, bottom + BELOW, title, &[line]);
    figure.legend([16.0, 70.0], &[("as good as the best", PALETTE[0]), ("worse", PALETTE[5])]);
    for (row, trial) in trials.iter().enumerate() {
        figure.text([NAMES - 10.0, TOP + ROW * (row as f64 + 0.7)], 12.0, Anchor::End, INK, &trial.causes.join(" + "));
    }
    for k in 0..horizons {
        let gains = || trials.iter().map(|trial| &trial.horizons[k]);
        let ends = gains().flat_map(|gain| gain.interval.into_iter().chain([gain.gain, 0.0])).filter(|x| x.is_finite());
        let (low, high) = ends.fold((-0.01, 0.01), |(a, b): (f64, f64), x| (a.min(x), b.max(x)));
        let left = NAMES + (WIDTH + APART) * k as f64;
        let axis = Axis { values: [100.0 * low, 100.0 * high], places: [left, left + WIDTH] };
        let x = |share: f64| axis.at(100.0 * share.clamp(low, high));
        let seconds = gains().next().and_then(|gain| gain.horizon_s);
        let head = seconds.map_or("whole drives [%]".to_owned(), |s| format!("within {s:.0} s [%]"));
        figure.horizontal(&axis, [TOP, bottom], 3.0, Some(&head));
        figure.line([x(0.0), TOP], [x(0.0), bottom], 1.4, INK);
        for (row, (trial, gain)) in trials.iter().zip(gains()).enumerate() {
            let (y, colour) = (TOP + ROW * (row as f64 + 0.5), if trial.in_set { PALETTE[0] } else { PALETTE[5] });
            let [from, to] = gain.interval;
            figure.line([x(from), y], [x(to), y], 1.4, colour);
            figure.dot([x(gain.gain), y], 3.4, colour);
        }
    }
    figure.finish()
}

#[cfg(test)]
mod tests {
    use super::race;
    use crate::result::diagnosis::recommended::{ClosedLoopEntry, HorizonGain, Trial};

    #[test]
    fn every_model_of_the_race_has_a_point_at_every_horizon() {
        let gain =
            |horizon_s, gain| HorizonGain { horizon_s, gain, interval: [gain - 0.1, gain + 0.1], standard_errors: 2.0 };
        let trial = |causes: &[&str], share| Trial {
            causes: causes.iter().map(|&name| name.to_owned()).collect(),
            gain: share,
            horizons: vec![gain(Some(2.0), share), gain(Some(15.0), share), gain(None, -share)],
            standard_errors: share,
            probability: 0.01,
            in_set: share > 0.2,
            checks: Vec::new(),
            passes: false,
            drivers: None,
        };
        let trials = vec![trial(&["grade"], 0.1), trial(&["perception_delay", "leader_accel_ff"], 0.3)];
        let picture = race("Models", &ClosedLoopEntry { trials, ..ClosedLoopEntry::default() });
        assert_eq!(picture.matches("<circle").count(), 6);
        for words in ["perception_delay + leader_accel_ff", "within 15 s [%]", "whole drives [%]"] {
            assert!(picture.contains(words), "{words} in {picture}");
        }
        assert!(picture.find("leader_accel_ff") < picture.find(">grade<"), "the best one first");
        assert!(super::race("None", &ClosedLoopEntry::default()).ends_with("</svg>\n"));
    }
}
