//! Content and quality of a recording, before any preparation.

mod display;
mod link;
mod signal;

pub use link::LinkInspection;
pub use signal::SignalInspection;

use super::error::step_too_long;
use super::prepare::{STEP_MAX_S, Stretch, median_step, nominal_step, stretches, stretches_of};
use super::soundness::{Finding, LIMITS};
use super::steps::{largest_move, longest_step};
use super::{Car, Layout, Note, Platoon, Preparation, PrepareError, Recording, Source};
use crate::statistics::rms;
use crate::text::option::SEGMENT;
use serde::Serialize;
use std::ops::Range;

/// A slower car is standing \[m/s\].
pub const STANDSTILL_MPS: f64 = 0.1;
/// Share of missing values above which a warning follows.
const MISSING_WARNING: f64 = 0.1;

/// Properties of a recording. Units are in the names; `None` if there is nothing to measure.
#[derive(Debug, Clone, Serialize)]
pub struct Inspection {
    pub source: Source,
    pub layout: Layout,
    pub companions: Vec<Source>,
    /// Length of the closed track whose grade is known.
    pub track_m: Option<f64>,
    pub platoons: Vec<PlatoonInspection>,
}

/// One platoon of the file.
#[derive(Debug, Clone, Serialize)]
pub struct PlatoonInspection {
    pub id: Option<String>,
    pub rows: usize,
    /// Rows in which at least one speed or gap is missing.
    pub rows_with_missing: usize,
    pub t_first_s: f64,
    pub t_last_s: f64,
    pub duration_s: f64,
    pub sampling: Sampling,
    pub cars: Vec<CarInspection>,
    /// One per car with a measured gap to the car ahead.
    pub links: Vec<LinkInspection>,
    /// One per car with a car ahead and a gap to it, measured or by positions.
    pub followers: Vec<FollowerInspection>,
    /// Changes and notes of the importer.
    pub notes: Vec<Note>,
    /// Apparent faults, in words.
    pub warnings: Vec<String>,
}

/// Pieces of a follower between gaps that are too long to be interpolated.
#[derive(Debug, Clone, Serialize)]
pub struct FollowerInspection {
    /// 1 = the car right behind the platoon leader.
    pub follower: usize,
    /// Gaps of more than this are not interpolated by default.
    pub max_gap_s: f64,
    /// The segments that a calibration can use, in the order of time; empty if it would refuse the follower.
    pub segments: Vec<Stretch>,
    /// The reason for a refusal.
    pub refused: Option<String>,
}

/// The time axis.
#[derive(Debug, Clone, Serialize)]
pub struct Sampling {
    pub step_s: f64,
    /// Steps that are not multiples of `step_s`.
    pub irregular_steps: usize,
    /// Rows missing between regular steps.
    pub missing_rows: usize,
    pub longest_step_s: f64,
}

#[derive(Debug, Clone, Serialize)]
pub struct CarInspection {
    pub number: usize,
    /// Its number for `--follower`: 1 = the car right behind the platoon leader. `None` for the leader, for a car behind one that
    /// is not in the file, and in tables of a column map, which use its id.
    pub follower: Option<usize>,
    pub name: String,
    pub length_m: Option<f64>,
    pub speed: SignalInspection,
    /// Gap to the car with the next lower number.
    pub gap: Option<SignalInspection>,
    pub position: Option<SignalInspection>,
    pub acceleration: Option<SignalInspection>,
    pub sin_grade: Option<SignalInspection>,
    /// Time below 0.1 m/s.
    pub standstill_s: f64,
    /// Integral of the measured speed, without missing stretches and pauses.
    pub driven_m: f64,
    /// Change of the position over a second minus the mean speed in it (root mean square), without pauses and the ends of laps.
    pub position_speed_rms_mps: Option<f64>,
    /// Acceleration column minus the difference of the speed to the next sample.
    pub forward_difference_rms_mps2: Option<f64>,
    /// Acceleration column minus the difference of the speed from the previous sample (Eq. 1 of the paper).
    pub backward_difference_rms_mps2: Option<f64>,
}

/// Describes a recording; nothing is changed, and nothing fails.
pub fn inspect(recording: &Recording) -> Inspection {
    Inspection {
        source: recording.source.clone(),
        layout: recording.layout,
        companions: recording.companions.clone(),
        track_m: recording.grade.as_ref().and_then(|grade| grade.period),
        platoons: recording.platoons.iter().map(|p| platoon(p, recording)).collect(),
    }
}

/// The time axis of a platoon and its stretches without missing rows.
struct Axis<'a> {
    t: &'a [f64],
    step: f64,
    stretches: Vec<Range<usize>>,
}

fn platoon(platoon: &Platoon, recording: &Recording) -> PlatoonInspection {
    let t = platoon.t.as_slice();
    let median = median_step(t).unwrap_or(1.0);
    let stretches = stretches(t, 1.5 * median);
    let step = nominal_step(t, &stretches, median);
    let axis = Axis { t, step, stretches };
    let sampling = sampling(&axis);
    let cars: Vec<CarInspection> =
        platoon.cars.iter().map(|c| car(c, follower_of(c, platoon, recording), &axis)).collect();
    let links: Vec<LinkInspection> = platoon
        .cars
        .iter()
        .filter_map(|ego| {
            let lead = platoon.cars.iter().find(|lead| lead.number + 1 == ego.number)?;
            link::inspect(lead, ego, platoon, recording)
        })
        .collect();
    let followers = followers(platoon, recording);
    let missing = |i: usize| {
        let gap_missing = |car: &Car| car.gap.as_ref().is_some_and(|gap| gap[i].is_nan());
        platoon.cars.iter().any(|car| car.v[i].is_nan() || gap_missing(car))
    };
    let (first, last) = (t.first().copied(), t.last().copied());
    let (first, last) = (first.unwrap_or_default(), last.unwrap_or_default());
    PlatoonInspection {
        id: platoon.id.clone(),
        rows: t.len(),
        rows_with_missing: (0..t.len()).filter(|&i| missing(i)).count(),
        t_first_s: first,
        t_last_s: last,
        duration_s: last - first,
        warnings: warnings(t.len(), &sampling, &cars, &links, &followers),
        sampling,
        cars,
        links,
        followers,
        notes: platoon.notes.clone(),
    }
}

fn sampling(axis: &Axis) -> Sampling {
    let steps = || axis.t.windows(2).map(|pair| pair[1] - pair[0]);
    let off = |step: f64| {
        let rows = (step / axis.step).round();
        rows < 1.0 || (step - rows * axis.step).abs() > super::prepare::GRID_TOLERANCE_S
    };
    Sampling {
        step_s: axis.step,
        irregular_steps: steps().filter(|&step| off(step)).count(),
        missing_rows: steps()
            .filter(|&step| !off(step))
            .map(|step| (step / axis.step).round() as usize - 1)
            .fold(0, usize::saturating_add),
        longest_step_s: steps().fold(0.0, f64::max),
    }
}

/// Name of a car as a follower.
fn follower_of(car: &Car, platoon: &Platoon, recording: &Recording) -> Option<usize> {
    let ahead = car
        .number
        .checked_sub(1)
        .filter(|ahead| *ahead > 0 && (recording.layout != Layout::Columns || recording.is_of_numbered_cars()))?;
    platoon.cars.iter().any(|lead| lead.number == ahead).then_some(ahead)
}

fn car(car: &Car, follower: Option<usize>, axis: &Axis) -> CarInspection {
    let describe = |values: &Vec<f64>| signal::inspect(values, axis);
    let v = &car.v;
    let longest = longest_step(axis.t);
    let pairs = || (1..v.len()).map(|i| (i, axis.t[i] - axis.t[i - 1])).filter(|(_, dt)| *dt <= longest);
    let driven = pairs().map(|(i, dt)| (v[i - 1] + v[i]) / 2.0 * dt);
    let position = car.x.as_ref().map(|x| {
        let most = largest_move(x);
        // Over a second, noise of a position that is usual hardly counts.
        let (mut apart, mut time, mut rates) = (0.0, 0.0, Vec::new());
        for (i, dt) in pairs() {
            let moved = x[i] - x[i - 1];
            apart += moved - (v[i - 1] + v[i]) / 2.0 * dt;
            time += dt;
            if moved.abs() > most || !apart.is_finite() {
                (apart, time) = (0.0, 0.0);
            } else if time > 0.99 {
                rates.push(apart / time);
                (apart, time) = (0.0, 0.0);
            }
        }
        rms(rates)
    });
    let difference = |shift: usize| {
        let a = car.a.as_ref()?;
        rms(pairs().map(|(i, dt)| a[i - shift] - (v[i] - v[i - 1]) / dt))
    };
    CarInspection {
        number: car.number,
        follower,
        name: car.name.clone(),
        length_m: car.length,
        speed: describe(v),
        gap: car.gap.as_ref().map(describe),
        position: car.x.as_ref().map(describe),
        acceleration: car.a.as_ref().map(describe),
        sin_grade: car.sin_grade.as_ref().map(describe),
        standstill_s: v.iter().filter(|v| **v < STANDSTILL_MPS).count() as f64 * axis.step,
        driven_m: driven.filter(|d| d.is_finite()).sum(),
        position_speed_rms_mps: position.flatten(),
        forward_difference_rms_mps2: difference(1),
        backward_difference_rms_mps2: difference(0),
    }
}

/// Result of the preparation for each follower.
fn followers(platoon: &Platoon, recording: &Recording) -> Vec<FollowerInspection> {
    let mut followers = Vec::new();
    for ego in platoon.cars.iter().filter(|car| car.number > 1 && (car.gap.is_some() || car.x.is_some())) {
        let follower = ego.number - 1;
        if !platoon.cars.iter().any(|lead| lead.number == follower) {
            continue;
        }
        let (segments, refused) = match stretches_of(recording, platoon, follower) {
            Ok(segments) => (segments, None),
            Err(error) => (Vec::new(), refusal(&error)),
        };
        followers.push(FollowerInspection { follower, max_gap_s: Preparation::default().max_gap_s, segments, refused });
    }
    followers
}

/// Why a follower would be refused, unless other warnings cover the whole file.
fn refusal(error: &PrepareError) -> Option<String> {
    let known = matches!(error, PrepareError::StepTooLong { .. } | PrepareError::Irregular { .. });
    (!known).then(|| error.to_string())
}

/// Warnings about the recording.
fn warnings(
    rows: usize,
    sampling: &Sampling,
    cars: &[CarInspection],
    links: &[LinkInspection],
    followers: &[FollowerInspection],
) -> Vec<String> {
    let mut warnings = Vec::new();
    let too_long = sampling.step_s > STEP_MAX_S;
    if too_long {
        warnings.push(step_too_long(sampling.step_s, STEP_MAX_S));
    }
    if sampling.irregular_steps > 0 {
        warnings.push(format!(
            "{} of {} time steps are irregular (usual step {} s): resample before use",
            sampling.irregular_steps,
            rows.saturating_sub(1),
            rounded(sampling.step_s)
        ));
    }
    if sampling.missing_rows > 0 {
        warnings.push(format!(
            "{} rows are missing, the longest step is {:.1} s",
            sampling.missing_rows, sampling.longest_step_s
        ));
    }
    for car in cars {
        let signals = [("speed", Some(&car.speed)), ("gap", car.gap.as_ref())];
        for (name, signal) in signals {
            let Some(signal) = signal else { continue };
            let share = signal.missing as f64 / rows.max(1) as f64;
            if share > MISSING_WARNING {
                warnings.push(format!(
                    "car {}: {:.0} % of the {name} is missing (longest {:.1} s)",
                    car.number,
                    share * 100.0,
                    signal.longest_missing_s
                ));
            }
        }
        if let Some(rms) = car.position_speed_rms_mps.filter(|&rms| rms > LIMITS.contradiction) {
            warnings.push(format!(
                "car {}: position contradicts speed (rms {rms:.1} m/s over 1 s): check units and columns",
                car.number
            ));
        }
    }
    // A wrong unit of time makes every gap contradict the speeds.
    let of_several = links.len() > 1;
    for link in links.iter().filter(|_| !too_long) {
        let who = if of_several {
            format!("car {} behind car {}: ", link.follower_car, link.follower_car - 1)
        } else {
            String::new()
        };
        let messages = link.findings.iter().filter(|finding| finding.matters).map(Finding::message);
        warnings.extend(messages.map(|text| format!("{who}{text}")));
    }
    warnings.extend(followers.iter().filter_map(FollowerInspection::warning));
    warnings
}

impl PlatoonInspection {
    /// The kinds of faults that change the calibration, each once.
    fn doubts(&self) -> Vec<&'static str> {
        let findings = self.links.iter().flat_map(|link| &link.findings).filter(|finding| finding.matters);
        let mut kinds: Vec<&str> = findings.map(|finding| finding.kind.into_str()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        kinds
    }
}

impl FollowerInspection {
    fn warning(&self) -> Option<String> {
        let FollowerInspection { follower, max_gap_s, segments, refused } = self;
        if let Some(why) = refused {
            return Some(format!("follower {follower} cannot be calibrated: {why}"));
        }
        let (longest, _) = Stretch::longest(segments);
        let first = longest.first().filter(|_| segments.len() > 1)?;
        let joined = segments.windows(2).any(|pair| pair[1].from_s - pair[0].to_s <= *max_gap_s);
        let or = if joined { " or changes of the driver" } else { "" };
        Some(format!(
            "follower {follower}: gaps of more than {max_gap_s} s{or} leave {} segments; the longest, which is used unless \
             {SEGMENT} chooses another, is number {first}",
            segments.len()
        ))
    }
}

/// A time step without insignificant digits \[s\].
fn rounded(step: f64) -> f64 {
    (step * 1e6).round() / 1e6
}
