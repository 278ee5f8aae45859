//! The flexible terms: the quantities of their tents, and the positions.

use crate::diagnose::drive::road::lap;
use crate::diagnose::search::fitted_model::Context;

/// Width of the tents on the road \[m\].
const ROAD_M: f64 = 60.0;
/// Largest number of tents in a row.
const MOST: usize = 160;

/// A term: an extension with its tents, and the position of each in words.
#[derive(Debug)]
pub struct Term {
    /// As `kind` of a `LeftOver`.
    pub kind: &'static str,
    /// The quantity of the tents, in words.
    pub over: &'static str,
    /// The extension that adds it.
    pub extension: &'static str,
    /// Values of its parameters except the acceleration, which is the first.
    pub tents: Vec<Vec<f64>>,
    /// Position of a tent, in words.
    pub place: fn(&[f64]) -> String,
}

fn quantiles(values: impl Iterator<Item = f64>, low: f64, high: f64) -> [f64; 2] {
    let mut sorted: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |q: f64| sorted.get(((sorted.len().max(1) - 1) as f64 * q) as usize).copied().unwrap_or(0.0);
    [at(low), at(high)]
}

/// Centres and half width of `count` tents over a range.
fn row([low, high]: [f64; 2], count: usize) -> (Vec<f64>, f64) {
    let width = ((high - low) / (count - 1) as f64).max(0.01);
    ((0..count).map(|i| low + i as f64 * width).collect(), width)
}

fn grid(first: &(Vec<f64>, f64), second: &(Vec<f64>, f64)) -> Vec<Vec<f64>> {
    let pairs = first.0.iter().flat_map(|a| second.0.iter().map(move |b| (*a, *b)));
    pairs.map(|(a, b)| vec![a, first.1, b, second.1]).collect()
}

pub fn terms(setting: &Context<'_>, states: &[[f64; 5]]) -> Vec<Term> {
    let moving = || states.iter().filter(|state| state[1] > 1.0);
    let speeds = quantiles(moving().map(|state| state[1]), 0.01, 0.99);
    let mut terms = Vec::new();
    let (at, width) = row(speeds, 9);
    terms.push(Term {
        kind: "speed",
        over: "the speed",
        extension: "probe_speed",
        tents: at.iter().map(|v| vec![*v, width]).collect(),
        place: |tent| format!("{:.1} m/s", tent[0]),
    });
    let count = ((speeds[1] - speeds[0]).ceil() as usize).clamp(4, 30);
    let (at, width) = row(speeds, count);
    terms.push(Term {
        kind: "thrust",
        over: "the speed while accelerating",
        extension: "probe_thrust",
        tents: at.iter().map(|v| vec![*v, width]).collect(),
        place: |tent| format!("{:.1} m/s", tent[0]),
    });
    let gaps = quantiles(moving().map(|state| state[0] / state[1]), 0.02, 0.98);
    terms.push(Term {
        kind: "gap",
        over: "time gap and speed",
        extension: "probe_gap",
        tents: grid(&row(gaps, 6), &row(speeds, 5)),
        place: |tent| format!("{:.1} s and {:.1} m/s", tent[0], tent[2]),
    });
    let closing = quantiles(moving().map(|state| state[2]), 0.02, 0.98);
    terms.push(Term {
        kind: "closing",
        over: "speed difference and speed",
        extension: "probe_closing",
        tents: grid(&row(closing, 6), &row(speeds, 4)),
        place: |tent| format!("{:.1} m/s difference and {:.1} m/s", tent[0], tent[2]),
    });
    let commands = quantiles(moving().map(|state| state[3]), 0.02, 0.98);
    let span = commands[1] - commands[0];
    terms.push(Term {
        kind: "history",
        over: "the command and its change",
        extension: "probe_history",
        tents: grid(&row(commands, 6), &row([-0.25 * span, 0.25 * span], 4)),
        place: |tent| format!("{:.2} m/s² changing by {:.2} m/s²", tent[0], tent[2]),
    });
    terms.extend(road(setting, states));
    terms
}

/// Tents along the road, over one lap if the grade gives the length of a lap.
fn road(setting: &Context<'_>, states: &[[f64; 5]]) -> Option<Term> {
    let [low, high] = quantiles(states.iter().map(|state| state[4]), 0.0, 1.0);
    let lap = lap(setting.question.train).filter(|lap| *lap < high - low).unwrap_or(0.0);
    let length = if lap > 0.0 { lap } else { high - low };
    if length < 4.0 * ROAD_M {
        return None;
    }
    let count = ((length / ROAD_M).round() as usize).min(MOST);
    let width = length / count as f64;
    Some(Term {
        kind: "road",
        over: "the place on the road",
        extension: "probe_road",
        tents: (0..count).map(|i| vec![low + i as f64 * width, width, lap]).collect(),
        // Counted from the start of the lap, as in the error breakdown.
        place: |tent| format!("{:.0} m", if tent[2] > 0.0 { tent[0].rem_euclid(tent[2]) } else { tent[0] }),
    })
}
