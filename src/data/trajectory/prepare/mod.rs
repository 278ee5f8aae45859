//! From a [`Recording`] to [`Trajectory`] pairs: window, time grid, gaps, smoothing, consistency (paper, Section 4.2).
//!
//! Every step that changes a number leaves a note.

mod consistency;
mod samples;
mod segments;
mod smooth;
mod stretch;
mod time;

pub use stretch::Stretch;

pub(super) use samples::GRID_TOLERANCE_S;
pub(super) use time::{STEP_MAX_S, median_step, nominal_step, stretches};

use super::soundness::{self, Finding, Link};
use super::{Grade, Note, Platoon, PrepareError, Recording, Trajectory};
use crate::text::spelling::UnknownWord;
use samples::Samples;

/// Stretches between long gaps that are shorter than this are dropped \[s\].
pub const SEGMENT_MIN_S: f64 = 2.0;
/// How a recording is turned into trajectories.
#[derive(Debug, Clone, PartialEq)]
pub struct Preparation {
    /// First time to keep \[s\], as written in the file.
    pub from: Option<f64>,
    /// Last time that is kept \[s\].
    pub to: Option<f64>,
    /// Missing values are interpolated if the measured neighbours are at most this far apart \[s\]; longer gaps split
    /// the data into segments.
    pub max_gap_s: f64,
    /// Smooth speeds and spacing as the paper's authors did: two Savitzky-Golay passes of 51 points, cubic.
    pub smooth: bool,
    /// Interpolate linearly to this time step \[s\].
    pub resample: Option<f64>,
    /// Correct findings of the check of the data if possible.
    pub correct: bool,
    /// How spacing and speeds are made consistent.
    pub reconcile: Reconcile,
    /// Only this trajectory of a file that holds several; `None`: all.
    pub trajectory_id: Option<String>,
    /// Road grade; takes precedence over a grade in or beside the file.
    pub grade: Option<Grade>,
    /// Length of the preceding vehicle \[m\]; takes precedence over a length in or beside the file.
    pub lead_length: Option<f64>,
    /// Position of the preceding vehicle along the road at the first row of the file \[m\]; takes precedence over
    /// measured positions.
    pub lead_start_m: Option<f64>,
}

impl Default for Preparation {
    fn default() -> Self {
        Preparation {
            from: None,
            to: None,
            max_gap_s: 1.0,
            smooth: false,
            resample: None,
            correct: false,
            reconcile: Reconcile::Gap,
            trajectory_id: None,
            grade: None,
            lead_length: None,
            lead_start_m: None,
        }
    }
}

/// A measured gap and two measured speeds are redundant and contradict each other (by metres over a drive); one of
/// them has to be changed. Python parses it; the command line has its own words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, strum::EnumString, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case", parse_err_ty = UnknownWord, parse_err_fn = unknown)]
pub enum Reconcile {
    /// The spacing is the measured gap; the position of the preceding vehicle follows from it.
    #[default]
    Gap,
    /// The spacing is the first measured gap plus the integrated speed difference.
    Speeds,
}

fn unknown(found: &str) -> UnknownWord {
    UnknownWord::of::<Reconcile>("reconcile", found)
}

impl Preparation {
    /// Range of [`max_gap_s`](Self::max_gap_s) \[s\]; more is never interpolated.
    pub const MAX_GAP_S: [f64; 2] = [0.0, 60.0];
    /// Range of [`resample`](Self::resample) \[s\].
    pub const RESAMPLE_S: [f64; 2] = [0.001, time::STEP_MAX_S];
    /// Range of [`lead_length`](Self::lead_length) \[m\].
    pub const LEAD_LENGTH_M: [f64; 2] = [0.0, 30.0];
    /// Range of [`lead_start_m`](Self::lead_start_m) \[m\].
    pub const LEAD_START_M: [f64; 2] = [-1e9, 1e9];

    fn check(&self) -> Result<(), PrepareError> {
        let within = |option, expected, value: Option<f64>, [low, high]: [f64; 2]| match value {
            Some(found) if !(low..=high).contains(&found) => Err(PrepareError::Option { option, expected, found }),
            _ => Ok(()),
        };
        let any = [f64::MIN, f64::MAX];
        within("from", "a finite time", self.from, any)?;
        within("to", "a finite time", self.to, any)?;
        if let (Some(from), Some(to)) = (self.from, self.to)
            && to < from
        {
            return Err(PrepareError::Backwards { from, to });
        }
        within("max gap", "0 to 60 s", Some(self.max_gap_s), Self::MAX_GAP_S)?;
        within("resample", "a step of 0.001 to 5 s", self.resample, Self::RESAMPLE_S)?;
        within("lead length", "0 to 30 m", self.lead_length, Self::LEAD_LENGTH_M)?;
        within("lead start", "a position within 1e9 m", self.lead_start_m, Self::LEAD_START_M)
    }
}

/// Input of the steps for messages.
#[derive(Clone, Copy)]
struct Context<'a> {
    recording: &'a Recording,
    platoon: &'a Platoon,
    follower: usize,
    preparation: &'a Preparation,
}

impl Context<'_> {
    fn path(&self) -> String {
        self.recording.source.path.clone()
    }

    /// `FILE-STEM follower N`, with trajectory id and segment if there are several.
    fn label(&self, segment: usize, segments: usize) -> String {
        let mut label = format!("{} follower {}", self.recording.stem(), self.follower);
        if let Some(id) = &self.platoon.id {
            label += &format!(" trajectory {id}");
        }
        if segments > 1 {
            label += &format!(" segment {segment}");
        }
        label
    }
}

/// The trajectories of one follower: one per segment between long gaps, and per trajectory id.
///
/// Follower 1 is the car right behind the platoon leader, car number 2. If a file holds several trajectories and none is chosen, those that are too
/// short, or broken, are left out unless all are. The error names the available followers, steps or time windows of the file.
pub fn prepare(
    recording: &Recording,
    follower: usize,
    preparation: &Preparation,
) -> Result<Vec<Trajectory>, PrepareError> {
    preparation.check()?;
    let wanted = preparation.trajectory_id.as_deref();
    let chosen: Vec<&Platoon> =
        recording.platoons.iter().filter(|platoon| wanted.is_none() || platoon.id.as_deref() == wanted).collect();
    let mut trajectories = Vec::new();
    let mut too_short = None;
    for &platoon in &chosen {
        let context = Context { recording, platoon, follower, preparation };
        match one(&context) {
            Ok(segments) => trajectories.extend(segments),
            Err(
                error @ (PrepareError::TooShort { .. }
                | PrepareError::Short { .. }
                | PrepareError::EmptyWindow { .. }
                | PrepareError::Faulty { .. }),
            ) if chosen.len() > 1 => {
                too_short.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    if trajectories.is_empty() {
        let ids = recording.platoons.iter().filter_map(|p| p.id.clone());
        return Err(too_short.unwrap_or_else(|| PrepareError::NoTrajectory {
            path: recording.source.path.clone(),
            id: wanted.unwrap_or_default().to_owned(),
            available: ids.collect(),
        }));
    }
    Ok(trajectories)
}

/// The trajectories of one follower of one platoon of a recording, one per segment between long gaps; `trajectory_id` is ignored.
pub fn prepare_platoon(
    recording: &Recording,
    platoon: &Platoon,
    follower: usize,
    preparation: &Preparation,
) -> Result<Vec<Trajectory>, PrepareError> {
    preparation.check()?;
    one(&Context { recording, platoon, follower, preparation })
}

/// The stretches between long gaps into which [`prepare`] cuts a follower of a platoon by default.
pub(in crate::trajectory) fn stretches_of(
    recording: &Recording,
    platoon: &Platoon,
    follower: usize,
) -> Result<Vec<Stretch>, PrepareError> {
    let preparation = &Preparation::default();
    let context = Context { recording, platoon, follower, preparation };
    let (_, segments) = segments_of(&context, &mut Vec::new())?;
    Ok(Stretch::of(segments.iter().map(|segment| segment.samples.t.as_slice())))
}

/// Times of the file at which another driver takes over the follower: a human and a controller are two drivers.
fn takeovers(context: &Context) -> Vec<f64> {
    let ego = context.follower + 1;
    let modes: Vec<(&str, f64)> = context
        .platoon
        .notes
        .iter()
        .filter_map(|note| match note {
            Note::DriverMode { car, t_s, mode } if *car == ego => Some((mode.as_str(), *t_s)),
            _ => None,
        })
        .collect();
    modes.windows(2).filter(|pair| pair[0].0 != pair[1].0).map(|pair| pair[1].1).collect()
}

/// Step \[s\] and segments of one follower of one platoon, before they are smoothed and made consistent.
fn segments_of(context: &Context, notes: &mut Vec<Note>) -> Result<(f64, Vec<segments::Segment>), PrepareError> {
    let preparation = context.preparation;
    let mut samples = Samples::collect(context, notes)?;
    samples.cut(context, notes)?;
    samples.clip(notes);
    let mut blocks = time::uniform(samples, context, notes)?;
    for t_s in takeovers(context) {
        blocks.split(t_s);
    }
    let dt = blocks.dt;
    let least = if preparation.smooth { SEGMENT_MIN_S.max((smooth::POINTS - 1) as f64 * dt) } else { SEGMENT_MIN_S };
    Ok((dt, segments::split(blocks, preparation.max_gap_s, least, context, notes)?))
}

/// Findings of the check of the data between the requested times, and the platoon after correction.
fn checked(context: &Context) -> (Vec<Finding>, Option<Platoon>) {
    let Context { recording, platoon, follower, preparation } = *context;
    let Some(link) = Link::of(recording, platoon, follower, [preparation.from, preparation.to]) else {
        return (Vec::new(), None);
    };
    let mut findings = soundness::check_platoon(platoon, &link).findings;
    let corrected = preparation.correct.then(|| {
        let mut platoon = platoon.clone();
        soundness::correct(&mut platoon, follower, &link, &mut findings);
        platoon
    });
    (findings, corrected)
}

/// The trajectories of one follower of one platoon.
fn one(context: &Context) -> Result<Vec<Trajectory>, PrepareError> {
    let (found, corrected) = checked(context);
    let context = &Context { platoon: corrected.as_ref().unwrap_or(context.platoon), ..*context };
    let preparation = context.preparation;
    let mut notes = context.platoon.notes.clone();
    let ego = context.follower.saturating_add(1);
    notes.retain(|note| !matches!(note, Note::DriverMode { car, .. } | Note::NoGap { car, .. } if *car != ego));
    let (dt, segments) = segments_of(context, &mut notes)?;
    let count = segments.len();
    let mut trajectories = Vec::with_capacity(count);
    for (index, mut segment) in segments.into_iter().enumerate() {
        let mut notes = notes.clone();
        notes.append(&mut segment.notes);
        if preparation.smooth {
            notes.push(smooth::smooth(&mut segment.samples, dt));
        }
        let t = &segment.samples.t;
        let concerns = |finding: &&Finding| {
            finding.when.is_empty() || finding.when.iter().any(|[from, to]| *from <= t[t.len() - 1] && t[0] <= *to)
        };
        notes.extend(found.iter().filter(concerns).map(|finding| Note::Found { finding: Box::new(finding.clone()) }));
        // The first driver of the follower, and those that take over later.
        let begins = |note: &Note| match note {
            Note::DriverMode { t_s, .. } => Some(*t_s),
            _ => None,
        };
        let (first, last) = (t[0] + GRID_TOLERANCE_S, t[t.len() - 1]);
        let driving = notes.iter().filter_map(begins).filter(|t_s| *t_s <= first).fold(f64::NEG_INFINITY, f64::max);
        notes.retain(|note| begins(note).is_none_or(|t_s| (driving..=last).contains(&t_s)));
        let label = context.label(index + 1, count);
        trajectories.push(consistency::trajectory(segment.samples, dt, label, notes, context)?);
    }
    Ok(trajectories)
}
