//! The flexible terms: what the tents stand over, and where.

use super::super::candidate::Setting;

/// Width of the tents on the road \[m\].
const ROAD_M: f64 = 60.0;
/// Most tents in a row.
const MOST: usize = 160;

/// A term: an extension with its tents, and where each of them stands, in words.
#[derive(Debug)]
pub struct Term {
    /// As in a left-over.
    pub kind: &'static str,
    /// What the tents stand over, in words.
    pub over: &'static str,
    /// The tool that adds it.
    pub extension: &'static str,
    /// Values of its parameters but the acceleration, which is the first.
    pub tents: Vec<Vec<f64>>,
    /// Where a tent stands, in words.
    pub place: fn(&[f64]) -> String,
}

fn quantiles(values: impl Iterator<Item = f64>, low: f64, high: f64) -> [f64; 2] {
    let mut sorted: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |q: f64| sorted.get(((sorted.len().max(1) - 1) as f64 * q) as usize).copied().unwrap_or(0.0);
    [at(low), at(high)]
}

/// Centres and half width of so many tents over a range.
fn row([low, high]: [f64; 2], count: usize) -> (Vec<f64>, f64) {
    let width = ((high - low) / (count - 1) as f64).max(0.01);
    ((0..count).map(|i| low + i as f64 * width).collect(), width)
}

fn grid(first: &(Vec<f64>, f64), second: &(Vec<f64>, f64)) -> Vec<Vec<f64>> {
    let pairs = first.0.iter().flat_map(|a| second.0.iter().map(move |b| (*a, *b)));
    pairs.map(|(a, b)| vec![a, first.1, b, second.1]).collect()
}

pub fn terms(setting: &Setting<'_>, states: &[[f64; 5]]) -> Vec<Term> {
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

/// Tents along the road; over one lap where the grade says how long a lap is.
fn road(setting: &Setting<'_>, states: &[[f64; 5]]) -> Option<Term> {
    let [low, high] = quantiles(states.iter().map(|state| state[4]), 0.0, 1.0);
    let lap = lap(setting).filter(|lap| *lap < high - low).unwrap_or(0.0);
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
        place: |tent| format!("{:.0} m", tent[0]),
    })
}

/// Distance of the points at which a grade is compared with itself \[m\].
const NODE: f64 = 5.0;
/// The shortest lap, and the least that a lap has to be driven beyond its end, in such points: 400 m.
const SHORTEST: usize = 80;

/// Length of a lap \[m\]: that of the closed track, or else the shortest one after which the grade repeats.
#[must_use]
pub fn lap(setting: &Setting<'_>) -> Option<f64> {
    if let Some(lap) = setting.question.train.iter().find_map(|drive| drive.lap) {
        return Some(lap);
    }
    let mut best: Option<usize> = None;
    for drive in setting.question.train {
        let grade = drive.trajectory.grade.as_ref()?;
        let (first, last) = (*drive.x_road.first()?, *drive.x_road.last()?);
        let offset = drive.trajectory.x_f[0] - first;
        let count = ((last - first) / NODE) as usize;
        let sin: Vec<f64> = (0..count).map(|i| grade.at(first + offset + i as f64 * NODE)).collect();
        let mean = sin.iter().sum::<f64>() / count.max(1) as f64;
        let variance = sin.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count.max(1) as f64;
        if variance < 1e-8 {
            return None;
        }
        let found = repeats(&sin, variance);
        best = [best, found].into_iter().flatten().min();
    }
    best.map(|shift| shift as f64 * NODE)
}

/// The first shift after which a profile repeats to 2 % of its variance, best of those around it: after two laps it repeats as well,
/// and whether that fits the points better is chance.
fn repeats(sin: &[f64], variance: f64) -> Option<usize> {
    const SAME: f64 = 0.02;
    let share = |shift: usize| {
        let pairs = sin.len() - shift;
        let apart = (0..pairs).map(|i| (sin[i] - sin[i + shift]).powi(2)).sum::<f64>() / pairs as f64;
        // Half the mean squared difference is the scatter around the common profile.
        0.5 * apart / variance
    };
    let shares: Vec<f64> = (SHORTEST..sin.len().saturating_sub(SHORTEST)).map(share).collect();
    let mut from = 0;
    while let Some(begin) = (from..shares.len()).find(|&i| shares[i] < SAME) {
        let end = (begin..shares.len()).find(|&i| shares[i] >= SAME).unwrap_or(shares.len());
        let least = (begin..end).min_by(|&a, &b| shares[a].total_cmp(&shares[b])).expect("one at least");
        // At an end of what can be compared it may fall on.
        if least > 0 && least + 1 < shares.len() {
            return Some(SHORTEST + least);
        }
        from = end;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three laps of the authors' 5757.9 m, 1151.58 points: after two laps the points come closer to each other than after one.
    #[test]
    fn a_lap_is_one_lap() {
        let sin = |i: usize| {
            let place = std::f64::consts::TAU * (i as f64 * NODE) / 5757.9;
            0.02 * place.sin() + 0.01 * (3.0 * place).cos() + 0.008 * (7.0 * place).sin()
        };
        let profile: Vec<f64> = (0..3600).map(sin).collect();
        let variance = 0.5 * (0.02_f64.powi(2) + 0.01_f64.powi(2) + 0.008_f64.powi(2));
        assert_eq!(repeats(&profile, variance), Some(1152));
        // One lap and a bit, and a road that changes so slowly that it nearly repeats after 400 m.
        assert_eq!(repeats(&profile[..1400], variance), Some(1152));
        assert_eq!(repeats(&profile[..1200], variance), None);
        let slow: Vec<f64> = (0..3600).map(|i| (i as f64 / 2000.0).sin()).collect();
        assert_eq!(repeats(&slow, 0.3), None);
    }
}
