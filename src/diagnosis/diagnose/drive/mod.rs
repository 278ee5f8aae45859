//! One measured run, ready for diagnosis.

pub(crate) mod ahead;
pub mod drivers;
pub mod road;
pub(crate) mod smoothing;
mod standstill;

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::diagnose::drive::smoothing::smoothed;
use crate::diagnose::drive::standstill::with_signs;
use crate::evaluator::{Case, CaseError, smoothed_acceleration};
use crate::symbols::Symbol;
use crate::text::option::HOLDOUT;
use crate::trajectory::{Grade, Trajectory, integrate};
use crate::vehicle::Vehicle;
use std::ops::Range;
use std::sync::Arc;

/// Share of a file to train on, if no other file is held back.
pub const TRAINED_ON: f64 = 2.0 / 3.0;
/// Jump of the gap \[m\], beyond that by the speeds, that starts a new drive: another car cut in, or the radar lost the car ahead.
const JUMP_M: f64 = 2.0;
/// Shorter pieces \[s\] are dropped: they show nothing about a law with time constants of seconds.
const SHORTEST_S: f64 = 30.0;
/// Positions closer than this \[m\] count as one point of the road, because the car stands.
const STANDING_M: f64 = 1e-3;
/// Longest perception delay of a base model \[s\]: Table 3 of the paper.
const TAU_P_UPPER: f64 = 0.8;

/// A law reads other quantities of the cars ahead half a step in advance, as the nuisance lead does for gap and speed difference: an
/// acceleration held over a step is late by as much. In samples.
const HALF_STEP: f64 = 0.5;

/// A measured run without jumps: the follower as measured, the leader smoothed.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Input of the evaluators. `v_l` (and `v_l2`, `s_l2`) are smoothed, `x_l` is their integral, and `x_f` follows from it and the
    /// measured spacing; `v_f` (with a sign for its noise at standstill) and `s` are as measured, `t` is the time of the file.
    pub trajectory: Trajectory,
    /// The leader's speed as measured \[m/s\].
    pub v_l_measured: Vec<f64>,
    /// Measured position of the follower along the road \[m\], for the grade; not wrapped on a closed track.
    pub x_road: Vec<f64>,
    /// Length of the closed track \[m\], if its grade gives one; the grade in `trajectory` lies along this drive and does not repeat.
    pub lap: Option<f64>,
    /// The follower, if known.
    pub vehicle: Option<Arc<Vehicle>>,
}

/// A jump of the gap that its speeds do not explain.
#[derive(Debug, Clone, PartialEq)]
pub struct Jump {
    /// Label of the trajectory.
    pub label: String,
    /// Time of the file at the first sample after the jump \[s\].
    pub t: f64,
    /// Size of the jump \[m\].
    pub size: f64,
}

/// A trajectory that cannot be diagnosed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum DriveError {
    #[error("{label}: {}", too_short(*jumps, *longest, *shortest))]
    TooShort { label: String, jumps: usize, longest: f64, shortest: f64 },
    #[error(
        "{label}: it has {whole:.1} s, of which the last third ({held:.1} s) is held back; either part needs a stretch of {SHORTEST_S} s, \
         so {:.0} s in all; give a longer recording, or {HOLDOUT} OTHER.csv, which keeps all of this one for training",
        SHORTEST_S / (1.0 - TRAINED_ON)
    )]
    HeldBack { label: String, whole: f64, held: f64 },
}

fn too_short(jumps: usize, longest: f64, shortest: f64) -> String {
    if jumps == 0 {
        return format!("expected a stretch of {shortest} s, found {longest:.1} s; give a longer recording");
    }
    format!(
        "no piece of {shortest} s without a jump of the gap of more than {JUMP_M} m ({jumps} jumps, the longest piece has \
         {longest:.1} s); give a longer recording, or cut it to a part with a reliable gap"
    )
}

impl Drive {
    /// Cuts a trajectory at jumps of the gap, gives the noise of speeds at standstill a sign, and smooths the leader of every piece.
    ///
    /// # Errors
    /// [`DriveError::TooShort`].
    pub fn of(trajectory: &Trajectory, vehicle: Option<&Vehicle>) -> Result<(Vec<Drive>, Vec<Jump>), DriveError> {
        Drive::pieces(trajectory, vehicle, SHORTEST_S)
    }

    /// The same, with pieces of at least `shortest` \[s\].
    ///
    /// # Errors
    /// [`DriveError::TooShort`].
    pub fn pieces(
        trajectory: &Trajectory,
        vehicle: Option<&Vehicle>,
        shortest: f64,
    ) -> Result<(Vec<Drive>, Vec<Jump>), DriveError> {
        let jumps = jumps(trajectory);
        let Trajectory { v_f, v_l, v_l2, .. } = trajectory;
        let trajectory = &Trajectory {
            v_f: with_signs(v_f, 0),
            v_l: with_signs(v_l, 1),
            v_l2: v_l2.as_ref().map(|v| with_signs(v, 2)),
            ..trajectory.clone()
        };
        let mut cuts: Vec<usize> = jumps.iter().map(|(i, _)| *i).collect();
        cuts.push(trajectory.len());
        let (mut pieces, mut from, mut longest) = (Vec::new(), 0, 0.0_f64);
        for to in cuts {
            let span = (to - from) as f64 * trajectory.dt;
            longest = longest.max(span);
            if span >= shortest {
                pieces.push(from..to);
            }
            from = to;
        }
        let label = || trajectory.label.clone();
        if pieces.is_empty() {
            return Err(DriveError::TooShort { label: label(), jumps: jumps.len(), longest, shortest });
        }
        let vehicle = vehicle.cloned().map(Arc::new);
        let several = pieces.len() > 1;
        let drive = |(k, range): (usize, &Range<usize>)| {
            let name = if several { format!("{} piece {}", trajectory.label, k + 1) } else { label() };
            piece(trajectory, range, name, vehicle.clone())
        };
        let drives = pieces.iter().enumerate().map(drive).collect();
        let jumps = jumps.iter().map(|&(i, size)| Jump { label: label(), t: trajectory.t[i], size }).collect();
        Ok((drives, jumps))
    }

    /// The case of a variant on this drive, under the convention `paper`; the bounds give the longest delay.
    ///
    /// # Errors
    /// As [`Case::new`].
    pub fn case(&self, variant: Variant, bounds: &Overrides) -> Result<Case, CaseError> {
        let upper = |symbol: Symbol| bounds.get(symbol.name()).map(|[_, upper]| *upper);
        self.case_within(variant, upper(Symbol::tau_p), variant.extensions.delay().and_then(upper))
    }

    /// The same for a comparison with another variant: both start where the later one has the past that it needs.
    pub fn case_beside(&self, variant: Variant, other: Variant, bounds: &Overrides) -> Result<Case, CaseError> {
        let [case, other] = [self.case(variant, bounds)?, self.case(other, bounds)?];
        let first = |case: &Case| case.first_sample(case.longest_delay());
        Ok(Case { earliest: first(&case).max(first(&other)), ..case })
    }

    /// The same with the longest perception delay of the base, and of an extension \[s\]; `None`: the usual one.
    pub(crate) fn case_within(
        &self,
        variant: Variant,
        tau_p_upper: Option<f64>,
        extension_delay_upper: Option<f64>,
    ) -> Result<Case, CaseError> {
        let (vehicle, longest) = (self.vehicle.as_deref(), tau_p_upper.unwrap_or(TAU_P_UPPER));
        let case = Case::new(&self.trajectory, variant, vehicle, Convention::PAPER, longest)?;
        // The lead shortens the delay of these quantities, too.
        let ahead = if variant.delay || variant.extensions.delay().is_some() { 0.0 } else { HALF_STEP };
        let case = Case {
            a_l: Some(smoothed_acceleration(&self.v_l_measured, self.dt(), ahead).into()),
            v_l2: self.trajectory.v_l2.as_deref().map(|signal| later(signal, ahead)),
            ..case
        };
        match extension_delay_upper {
            Some(upper) => case.with_extension_delay(Some(upper)),
            None => Ok(case),
        }
    }

    /// Its name.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.trajectory.label
    }

    /// Path of the file that it comes from.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.trajectory.source.path
    }

    /// The recording that this is a piece of. An event in one piece lies in the past of the next.
    #[must_use]
    pub fn recording(&self) -> String {
        let id = self.trajectory.id.as_ref().map_or_else(String::new, |id| format!(" trajectory {id}"));
        format!("{} follower {}{id}", self.file(), self.trajectory.follower)
    }

    /// Number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.trajectory.len()
    }

    /// Time step \[s\].
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.trajectory.dt
    }

    /// Some of its samples.
    ///
    /// # Panics If it has fewer samples.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Drive {
        let cut = |values: &[f64]| values[range.clone()].to_vec();
        let Trajectory { t, x_l, v_l, x_f, v_f, s, v_l2, s_l2, .. } = &self.trajectory;
        let [v_l2, s_l2] = [v_l2, s_l2].map(|signal| signal.as_deref().map(cut));
        let [t, x_l, v_l, x_f, v_f, s] = [t, x_l, v_l, x_f, v_f, s].map(|signal| cut(signal));
        Drive {
            trajectory: Trajectory { t, x_l, v_l, x_f, v_f, s, v_l2, s_l2, ..self.trajectory.clone() },
            v_l_measured: cut(&self.v_l_measured),
            x_road: cut(&self.x_road),
            ..self.clone()
        }
    }

    /// Moves positions and grade along the road \[m\].
    pub(crate) fn move_along_the_road(&mut self, by: f64) {
        let Trajectory { x_l, x_f, grade, .. } = &mut self.trajectory;
        let nodes = grade.iter_mut().flat_map(|grade| &mut grade.x);
        x_l.iter_mut().chain(x_f).chain(&mut self.x_road).chain(nodes).for_each(|x| *x += by);
    }

    /// Sine of the grade under the measured follower, if the road is known.
    #[must_use]
    pub fn sin_grade(&self) -> Option<Vec<f64>> {
        let grade = self.trajectory.grade.as_ref()?;
        Some(self.trajectory.x_f.iter().map(|x| grade.at(*x)).collect())
    }
}

/// Samples after a jump of the gap, with its size \[m\].
fn jumps(trajectory: &Trajectory) -> Vec<(usize, f64)> {
    let Trajectory { s, v_l, v_f, dt, .. } = trajectory;
    let dv = |i: usize| v_l[i] - v_f[i];
    let jump = |i: usize| s[i] - s[i - 1] - 0.5 * (dv(i - 1) + dv(i)) * dt;
    (1..s.len()).map(|i| (i, jump(i))).filter(|(_, size)| size.abs() > JUMP_M).collect()
}

fn piece(whole: &Trajectory, range: &Range<usize>, label: String, vehicle: Option<Arc<Vehicle>>) -> Drive {
    let cut = |values: &[f64]| values[range.clone()].to_vec();
    let speed = |v: &[f64]| -> Vec<f64> { smoothed(v, whole.dt).into_iter().map(|v| v.max(0.0)).collect() };
    let (v_l_measured, s, x_road) = (cut(&whole.v_l), cut(&whole.s), cut(&whole.x_f));
    let v_l = speed(&v_l_measured);
    // The simulated follower keeps its distance to the leader, so only the leader's displacement per sample matters, and that is the
    // integral of its speed. The gap as a second measure of it would add the follower's noise to its leader.
    let x_l = integrate(whole.x_l[range.start], &v_l, whole.dt);
    let x_f: Vec<f64> = x_l.iter().zip(&s).map(|(x_l, s)| x_l - s - whole.len_l).collect();
    let lap = whole.grade.as_ref().and_then(|grade| grade.period);
    let grade = whole.grade.as_ref().map(|grade| along(grade, &x_f, &x_road));
    let trajectory = Trajectory {
        label,
        t: cut(&whole.t),
        x_l,
        v_l,
        x_f,
        v_f: cut(&whole.v_f),
        s,
        v_l2: whole.v_l2.as_ref().map(|v| speed(&cut(v))),
        s_l2: whole.s_l2.as_ref().map(|s| smoothed(&cut(s), whole.dt)),
        grade,
        notes: whole.notes.clone(),
        source: whole.source.clone(),
        name: whole.name.clone(),
        id: whole.id.clone(),
        ..*whole
    };
    Drive { trajectory, v_l_measured, x_road, lap, vehicle }
}

/// A signal later by this share of a sample.
fn later(signal: &[f64], share: f64) -> Arc<[f64]> {
    let next = signal.iter().skip(1).chain(signal.last());
    signal.iter().zip(next).map(|(now, next)| now + share * (next - now)).collect()
}

/// The grade along this drive, over positions from the leader's integrated speed. These drift by metres from the measured positions, which
/// still give the place on the road.
fn along(grade: &Grade, x_f: &[f64], x_road: &[f64]) -> Grade {
    let (mut x, mut sin): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for (&at, &measured) in x_f.iter().zip(x_road) {
        if x.last().is_none_or(|last| at - last >= STANDING_M) {
            x.push(at);
            sin.push(grade.at(measured));
        }
    }
    // Tables need cells of similar width, and a simulated follower may be ahead of the measured one.
    thinned(&x, &sin, grade)
}

/// Nodes about a metre apart: the evaluators tabulate the grade in equal cells, and millions of them would be too many.
fn thinned(x: &[f64], sin: &[f64], grade: &Grade) -> Grade {
    const NODE_M: f64 = 1.0;
    let dense = Grade { x: x.to_vec(), sin: sin.to_vec(), period: None, source: None };
    let (first, last) = (x[0], x[x.len() - 1]);
    let cells = ((last - first) / NODE_M).ceil().max(1.0) as usize;
    let width = ((last - first) / cells as f64).max(STANDING_M);
    let x: Vec<f64> = (0..=cells).map(|i| first + i as f64 * width).collect();
    let sin = x.iter().map(|x| dense.at(*x)).collect();
    Grade { x, sin, period: None, source: grade.source.clone() }
}

/// The first part of a trajectory, to train on, and the rest, to hold back.
#[must_use]
pub fn hold_back(trajectory: &Trajectory) -> [Trajectory; 2] {
    trajectory.split((TRAINED_ON * trajectory.len() as f64).round() as usize)
}

/// The drives of the two parts.
///
/// # Errors As [`Drive::of`]; [`DriveError::HeldBack`] if only the whole file is long enough.
pub fn drives_apart(trajectory: &Trajectory, vehicle: Option<&Vehicle>) -> Result<[Vec<Drive>; 2], DriveError> {
    let parts = hold_back(trajectory);
    let seconds = |part: &Trajectory| part.len() as f64 * part.dt;
    let [beginning, end] = parts.each_ref().map(|part| {
        Drive::of(part, vehicle).map(|(drives, _)| drives).map_err(|error| match error {
            DriveError::TooShort { jumps: 0, .. } => DriveError::HeldBack {
                label: trajectory.label.clone(),
                whole: seconds(trajectory),
                held: seconds(&parts[1]),
            },
            other => other,
        })
    });
    Ok([beginning?, end?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::likelihood::model::Model;
    use crate::synthetic;
    use crate::trajectory::{Preparation, import, prepare};
    use crate::wgsl::extension_named;

    fn trajectory() -> Trajectory {
        driven(200.0, synthetic::Noise { speed_mps: 0.02, gap_m: 0.02 })
    }

    fn driven(seconds: f64, noise: synthetic::Noise) -> Trajectory {
        let drive =
            synthetic::run(&synthetic::Scenario { duration_s: seconds, noise, ..synthetic::Scenario::default() });
        let mut file = Vec::new();
        synthetic::write_pair(&drive.expect("drives"), 1, &mut file).expect("memory");
        let recording = import::read_bytes(&file, "made_up.csv", None).expect("a pair file");
        prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0)
    }

    #[test]
    fn the_leader_is_smoothed_and_the_follower_is_not() {
        let measured = trajectory();
        let (drives, jumps) = Drive::of(&measured, None).expect("long enough");
        assert!((drives.len(), jumps.len()) == (1, 0));
        let drive = &drives[0].trajectory;
        let sizes: Vec<f64> = drive.v_f.iter().map(|v| v.abs()).collect();
        assert!(sizes == measured.v_f && drive.s == measured.s, "as measured");
        assert!(
            drive.v_f.iter().any(|v| *v < 0.0) && drive.v_f.iter().all(|v| *v > -0.1),
            "but for signs at standstill"
        );
        let rough = |v: &[f64]| v.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2)).sum::<f64>();
        assert!(rough(&drive.v_l) < 0.02 * rough(&measured.v_l), "{} {}", rough(&drive.v_l), rough(&measured.v_l));
        for i in 0..drive.len() {
            assert!((drive.x_l[i] - drive.x_f[i] - drive.len_l - drive.s[i]).abs() < 1e-9, "sample {i}");
        }
        let (own, road) = (drives[0].sin_grade().expect("in the file"), measured.grade.as_ref().expect("in the file"));
        for (own, x) in own.iter().zip(&measured.x_f) {
            assert!((own - road.at(*x)).abs() < 1e-3, "{own} at {x}");
        }
    }

    /// The bounds give the longest delay, and the grade gives the length of a lap.
    #[test]
    fn bounds_and_the_closed_track_are_kept() {
        let mut measured = trajectory();
        let usual = Overrides::new();
        let wide = Overrides::from([("tau_p".to_owned(), [0.0, 1.2]), ("tp".to_owned(), [0.0, 2.0])]);
        let delayed: Variant = "idm+delay".parse().expect("a variant");
        let late = "idm".parse::<Variant>().expect("a base");
        let late =
            late.with(extension_named("perception_delay").expect("in the library")).expect("nothing excludes it");
        let grade = measured.grade.as_mut().expect("in the file");
        grade.period = Some(5757.9);
        let drive = Drive::of(&measured, None).expect("long enough").0.remove(0);
        assert_eq!(drive.lap, Some(5757.9));
        for (variant, bounds, longest) in
            [(delayed, &usual, 0.8), (delayed, &wide, 1.2), (late, &usual, 3.0), (late, &wide, 2.0)]
        {
            let case = drive.case(variant, bounds).expect("long enough");
            assert!((case.longest_delay() - longest).abs() < 1e-6, "{variant}: {}", case.longest_delay());
            let model = Model::new(variant, std::slice::from_ref(&drive), bounds, &[]).expect("a model");
            assert_eq!(model.case(&drive).expect("long enough").longest_delay(), case.longest_delay());
        }
    }

    #[test]
    fn jumps_of_the_gap_cut() {
        let mut measured = trajectory();
        for (i, s) in measured.s.iter_mut().enumerate() {
            *s += if i >= 700 { 5.0 } else { 0.0 };
        }
        let (drives, jumps) = Drive::of(&measured, None).expect("long enough");
        assert_eq!(drives.iter().map(Drive::samples).collect::<Vec<_>>(), [700, 1301]);
        assert!(jumps.len() == 1 && (jumps[0].t - 70.0).abs() < 1e-9 && (jumps[0].size - 5.0).abs() < 0.3, "{jumps:?}");
        assert!(drives[1].label().ends_with("piece 2"));
        measured.s.iter_mut().enumerate().for_each(|(i, s)| *s += if (i / 200) % 2 == 0 { 9.0 } else { 0.0 });
        assert!(matches!(Drive::of(&measured, None), Err(DriveError::TooShort { jumps: 10.., .. })));
    }

    #[test]
    fn what_is_too_short_to_be_parted_says_what_would_be_long_enough() {
        let noise = synthetic::Scenario::default().noise;
        assert!(drives_apart(&driven(91.0, noise), None).is_ok());
        let said = drives_apart(&driven(70.0, noise), None).expect_err("too short").to_string();
        for part in ["70.1 s", "the last third (23.4 s) is held back", "90 s in all", "--holdout OTHER.csv"] {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert!(!said.contains("jump"), "{said}");
        let said = Drive::of(&driven(20.0, noise), None).expect_err("too short").to_string();
        assert!(said.contains("20.1 s") && said.contains("30 s") && !said.contains("jump"), "{said}");
    }
}
