//! The signals of one pair on one time axis, before any of the steps.

use super::Context;
use crate::trajectory::{Car, Note, Platoon, PrepareError};

/// Times may lie this far off the uniform grid \[s\]: files write 6 decimals, or sums of 0.1 with rounding errors.
pub(in crate::trajectory) const GRID_TOLERANCE_S: f64 = 1e-6;

/// A signal of a pair, by its name in notes.
#[derive(Debug, Clone, Copy, PartialEq, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub(super) enum Signal {
    #[strum(serialize = "lead speed")]
    LeadSpeed,
    Speed,
    Spacing,
    #[strum(serialize = "lead position")]
    LeadPosition,
    Position,
    #[strum(serialize = "speed of the second car ahead")]
    Lead2Speed,
    #[strum(serialize = "spacing of the car ahead")]
    Lead2Spacing,
    #[strum(serialize = "grade")]
    SinGrade,
}

impl Signal {
    /// A sample needs this signal.
    pub fn is_required(self) -> bool {
        matches!(self, Signal::LeadSpeed | Signal::Speed | Signal::Spacing)
    }

    pub fn is_speed(self) -> bool {
        matches!(self, Signal::LeadSpeed | Signal::Speed | Signal::Lead2Speed)
    }
}

/// Signals over time; missing values are NaN.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    pub t: Vec<f64>,
    /// Line of each sample in the file; `None` without a row.
    pub lines: Vec<Option<u64>>,
    pub channels: Vec<(Signal, Vec<f64>)>,
}

impl Samples {
    /// The signals that the platoon has for this follower.
    pub fn collect(context: &Context, notes: &mut Vec<Note>) -> Result<Self, PrepareError> {
        let platoon = context.platoon;
        let car = |number: usize| platoon.cars.iter().find(|car| car.number == number);
        let follower = context.follower;
        let ego = follower.checked_add(1).and_then(car);
        let (Some(lead), Some(ego)) = (car(follower), ego.filter(|_| follower > 0)) else {
            return Err(PrepareError::NoFollower { path: context.path(), follower, available: followers(platoon) });
        };
        let faults = platoon.faults_of(follower);
        if !faults.is_empty() {
            let sound = |name: &String| name.parse().is_ok_and(|number| platoon.faults_of(number).is_empty());
            let available = followers(platoon).into_iter().filter(sound).collect();
            return Err(PrepareError::Faulty { path: context.path(), follower, faults, available });
        }
        let mut channels = vec![
            (Signal::LeadSpeed, lead.v.clone()),
            (Signal::Speed, ego.v.clone()),
            (Signal::Spacing, spacing(lead, ego, context, notes)?),
        ];
        let mut add = |signal, values: Option<Vec<f64>>| {
            channels.extend(values.map(|values| (signal, values)));
        };
        let road = context.preparation.grade.is_some() || context.recording.grade.is_some();
        let unplaced = lead.x.is_none() && ego.x.is_none();
        if let Some(start) = context.preparation.lead_start_m {
            add(Signal::LeadPosition, Some(driven(start, &platoon.t, &lead.v)));
        } else if road && unplaced {
            // Counted from the first row, so that every window of a drive lies on the same road.
            notes.push(Note::StartAssumed { position_m: 0.0 });
            add(Signal::LeadPosition, Some(driven(0.0, &platoon.t, &lead.v)));
        } else {
            add(Signal::LeadPosition, lead.x.clone());
            add(Signal::Position, ego.x.clone());
        }
        let lead2 = car(follower - 1).filter(|car| car.faults.is_empty());
        add(Signal::Lead2Speed, lead2.map(|car| car.v.clone()));
        add(Signal::Lead2Spacing, lead.gap.clone().filter(|_| lead.gap_faults.is_empty()));
        add(Signal::SinGrade, ego.sin_grade.clone());
        Ok(Samples { t: platoon.t.clone(), lines: platoon.lines.iter().copied().map(Some).collect(), channels })
    }

    pub fn channel(&self, signal: Signal) -> Option<&[f64]> {
        let found = self.channels.iter().find(|(s, _)| *s == signal);
        found.map(|(_, values)| values.as_slice())
    }

    pub fn required(&self, signal: Signal) -> &[f64] {
        self.channel(signal).expect("collect adds every required signal")
    }

    /// The samples of a range of positions.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let channels = self.channels.iter();
        Samples {
            t: self.t[range.clone()].to_vec(),
            lines: self.lines[range.clone()].to_vec(),
            channels: channels.map(|(s, v)| (*s, v[range.clone()].to_vec())).collect(),
        }
    }

    /// Keeps the time window.
    pub fn cut(&mut self, context: &Context, notes: &mut Vec<Note>) -> Result<(), PrepareError> {
        let (from, to) = (context.preparation.from, context.preparation.to);
        let (Some(&first), Some(&last)) = (self.t.first(), self.t.last()) else {
            return Ok(());
        };
        if from.is_none() && to.is_none() {
            return Ok(());
        }
        let from = from.unwrap_or(first) - GRID_TOLERANCE_S;
        let to = to.unwrap_or(last) + GRID_TOLERANCE_S;
        let start = self.t.partition_point(|&t| t < from);
        let end = self.t.partition_point(|&t| t <= to);
        if start >= end {
            return Err(PrepareError::EmptyWindow {
                path: context.path(),
                from: context.preparation.from.unwrap_or(first),
                to: context.preparation.to.unwrap_or(last),
                first,
                last,
            });
        }
        let rows = self.t.len();
        *self = self.slice(start..end);
        notes.push(Note::Cut { from_s: self.t[0], to_s: self.t[end - start - 1], rows, kept: end - start });
        Ok(())
    }

    /// Small negative speeds become 0: cars of a platoon do not drive back, and neither do the models.
    pub fn clip(&mut self, notes: &mut Vec<Note>) {
        for (signal, values) in self.channels.iter_mut().filter(|(s, _)| s.is_speed()) {
            let lowest = values.iter().copied().fold(0.0, f64::min);
            let mut samples = 0;
            for value in values.iter_mut().filter(|value| **value < 0.0) {
                *value = 0.0;
                samples += 1;
            }
            if samples > 0 {
                notes.push(Note::Clipped { signal: signal.into_str().to_owned(), samples, lowest_mps: lowest });
            }
        }
    }
}

/// Followers that have a car ahead and a gap.
fn followers(platoon: &Platoon) -> Vec<String> {
    platoon
        .cars
        .iter()
        .filter(|car| car.number > 1 && (car.gap.is_some() || car.x.is_some()))
        .filter(|car| platoon.cars.iter().any(|lead| lead.number + 1 == car.number))
        .map(|car| (car.number - 1).to_string())
        .collect()
}

/// Length of the preceding vehicle, if known \[m\].
pub(super) fn lead_length(context: &Context) -> Option<f64> {
    let mut cars = context.platoon.cars.iter();
    let lead = cars.find(|car| car.number == context.follower)?;
    context.preparation.lead_length.or(lead.length)
}

/// The measured gap, else the distance of the two positions less the length of the car ahead \[m\].
fn spacing(lead: &Car, ego: &Car, context: &Context, notes: &mut Vec<Note>) -> Result<Vec<f64>, PrepareError> {
    if let Some(gap) = &ego.gap {
        return Ok(gap.clone());
    }
    let (path, follower) = (context.path(), context.follower);
    let (Some(x_l), Some(x_f)) = (&lead.x, &ego.x) else {
        return Err(PrepareError::NoSpacing { path, follower, available: followers(context.platoon) });
    };
    let len_l = lead_length(context).ok_or(PrepareError::NoLength { path, follower })?;
    notes.push(Note::Derived {
        signal: Signal::Spacing.into_str().to_owned(),
        from: format!("both positions and the length of the car ahead, {len_l} m"),
    });
    Ok(x_l.iter().zip(x_f).map(|(x_l, x_f)| x_l - x_f - len_l).collect())
}

/// Positions from `start` on by the measured speeds over the written times \[m\]; missing speeds repeat the last one.
fn driven(start: f64, t: &[f64], v: &[f64]) -> Vec<f64> {
    let mut v_last = v.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let mut t_last = t.first().copied().unwrap_or_default();
    let mut x = start;
    t.iter()
        .zip(v)
        .map(|(&t, &v)| {
            let v = if v.is_finite() { v } else { v_last };
            x += (v_last + v) / 2.0 * (t - t_last);
            (t_last, v_last) = (t, v);
            x
        })
        .collect()
}
