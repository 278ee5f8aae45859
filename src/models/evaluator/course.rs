//! A case for the evaluators that run the WGSL text: increments instead of positions, tables instead of searches.

use super::Case;
use super::table::Table;
use crate::catalog::Constraint;
use crate::convention::{Delay, Denominators};
use crate::score::{Accumulation, GoodnessOfFit, Measured, Norm, denominator};
use crate::symbols::{Parameters, Symbol};
use crate::text::option::{EVALUATOR, PRECISION};
use std::sync::Arc;

/// A case prepared sample by sample, in f64; the evaluators round it to their own precision.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Time step Δt \[s\].
    pub dt: f64,
    /// Unladen mass of the follower \[kg\]; 1 if the variant needs no vehicle.
    pub m_0: f64,
    /// Its equivalent inertial mass factor; 1 if the variant needs no vehicle.
    pub phi_f: f64,
    /// Speed of the preceding vehicle \[m/s\].
    pub v_l: Vec<f64>,
    /// Distance of the preceding vehicle since the sample before \[m\]; 0 at the first sample.
    pub dx_l: Vec<f64>,
    /// Position at which a follower with spacing 0 would be \[m\], modulo a closed track; empty unless the variant needs the grade.
    pub x_road: Vec<f64>,
    /// Measured spacing \[m\].
    pub s: Vec<f64>,
    /// Spacing from which a run starts \[m\]: the difference of the measured positions, which is `s` up to rounding.
    pub s_start: Vec<f64>,
    /// Measured speed of the follower \[m/s\].
    pub v_f: Vec<f64>,
    /// Measured acceleration of the follower \[m/s²\], by the convention.
    pub a_f: Vec<f64>,
    /// Measured speed as a denominator \[m/s\].
    pub v_denominator: Vec<f64>,
    /// 1/denominator of spacing, speed and acceleration, 0 if a sample has no relative error.
    pub per_denominator: [Vec<f64>; 3],
    /// Sine of the grade over the position; `None` unless the variant needs it.
    pub grade: Option<Table>,
    /// Length of a closed track \[m\]; 0 for an open road.
    pub period: f64,
    /// a_dp and a_ap over the speed; `None` unless the variant needs them.
    pub mfc: Option<Table>,
    /// World of extensions at each sample; `None` for a variant without extensions.
    pub world: Option<WorldSignals>,
    /// Length of the ring of past (v, s): ceil(longest delay / Δt) + 2.
    pub ring: usize,
    /// Sums of the measured signals that the measures need, for each first sample that a run may have.
    measured: Vec<[Measured; 3]>,
}

/// World of extensions at each sample, beyond the other members of a course.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldSignals {
    /// Time in the file \[s\].
    pub t: Vec<f64>,
    /// Acceleration of the preceding vehicle \[m/s²\], smoothed over [`LEADER_SMOOTHING`].
    pub a_l: Vec<f64>,
    /// Speed of the car ahead of the preceding vehicle \[m/s\]; 0, and never read, if it is not measured.
    pub v_l2: Vec<f64>,
    /// Gap between those two \[m\]; likewise.
    pub s_l2: Vec<f64>,
}

/// Time over which the acceleration of the preceding vehicle is smoothed \[s\].
pub const LEADER_SMOOTHING: f64 = 1.1;

impl WorldSignals {
    fn new(case: &Case) -> WorldSignals {
        let count = case.s.len();
        let finite = |x: &f64| if x.is_finite() { *x } else { 0.0 };
        let known = |signal: &Option<Arc<[f64]>>| {
            signal.as_ref().map_or_else(|| vec![0.0; count], |y| y.iter().map(finite).collect())
        };
        WorldSignals {
            t: (0..count).map(|i| case.t_0 + i as f64 * case.dt).collect(),
            a_l: case.a_l.as_deref().map_or_else(|| smoothed_acceleration(&case.v_l, case.dt, 0.0), <[f64]>::to_vec),
            v_l2: known(&case.v_l2),
            s_l2: known(&case.s_l2),
        }
    }
}

/// Acceleration of the preceding vehicle for extensions \[m/s²\]: the slope of its speed \[m/s\] over [`LEADER_SMOOTHING`], shifted earlier
/// by this many samples.
pub fn smoothed_acceleration(v_l: &[f64], dt: f64, ahead: f64) -> Vec<f64> {
    let last = v_l.len().saturating_sub(1) as f64;
    let speed = |place: f64| {
        let k = (place as usize).min(v_l.len().saturating_sub(2));
        v_l[k] + (v_l[k + 1] - v_l[k]) * (place - k as f64)
    };
    let half = 0.5 * LEADER_SMOOTHING / dt;
    let slope = |i: usize| {
        let middle = (i as f64 + ahead).min(last);
        let (from, to) = ((middle - half).max(0.0), (middle + half).min(last));
        (speed(to) - speed(from)) / ((to - from) * dt)
    };
    (0..v_l.len()).map(slope).collect()
}

/// The start of a candidate, and the samples that it perceives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Perception delay in samples.
    pub delay_steps: f64,
    /// The older of the two samples that it perceives is this many samples in the past.
    pub back: usize,
    /// Position of the perceived value between the older and the younger sample, 0..1.
    pub fraction: f64,
    /// First simulated and scored sample.
    pub first: usize,
    /// Where an extension looks up the speed of the preceding vehicle: this many samples before the current one, and the fraction from
    /// there towards the next; first for the whole look-back time, then for half of it.
    pub look_back: [(i32, f64); 2],
}

/// A case that these evaluators cannot use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CourseError {
    #[error(
        "the {what} table has nodes only {closest} apart, which needs {cells} equal cells, expected at most \
         {limit}; thin the table out, or use {EVALUATOR} reference"
    )]
    Table { what: &'static str, cells: f64, limit: f64, closest: f64 },
    #[error(
        "{label}: variant {variant} reads the time, and the clock of the file reaches {t} s in steps of {dt} s, which single precision \
         cannot distinguish; expected at most {limit:.0} s: count the time from the beginning of the recording, or use {EVALUATOR} lanes \
         with {PRECISION} f64"
    )]
    Clock { label: String, variant: String, t: f64, dt: f64, limit: f64 },
}

impl Course {
    /// Lays a case out.
    pub fn new(case: &Case) -> Result<Course, CourseError> {
        let count = case.s.len();
        let needs_grade = case.variant.needs_grade();
        let grade = case.grade.as_ref().filter(|_| needs_grade);
        // The lap counts if the position is used, with or without the grade.
        let period = case.grade.as_ref().filter(|_| case.variant.needs_position()).and_then(|g| g.period);
        let x_road = |x_l: &f64| {
            let x = x_l - case.len_l;
            period.map_or(x, |period| x.rem_euclid(period))
        };
        let mfc = case.vehicle.as_ref().and_then(|v| v.mfc.as_ref());
        let mfc = mfc.filter(|_| case.variant.constraint == Constraint::Mfc);
        let needs_vehicle = case.variant.needs_vehicle();
        let vehicle = case.vehicle.as_ref().filter(|_| needs_vehicle);
        let floored = [false, case.convention.denominators == Denominators::Floored, false];
        let signals = [&case.s, &case.v_f, &case.a_f];
        let per_denominator =
            |i: usize| signals[i].iter().map(|y| Accumulation::Relative.slope(*y, floored[i])).collect();
        let longest = case.longest_delay() / case.dt;
        let ring = (longest - 1e-9).ceil() as usize + 2;
        let measured = (0..=ring.max(case.earliest).min(count - 1))
            .map(|first| [0, 1, 2].map(|i| Measured::of(&signals[i][first..], floored[i])))
            .collect();
        Ok(Course {
            dt: case.dt,
            m_0: vehicle.map_or(1.0, |v| v.m_0),
            phi_f: vehicle.map_or(1.0, |v| v.phi_f),
            v_l: case.v_l.to_vec(),
            dx_l: std::iter::once(0.0).chain(case.x_l.windows(2).map(|w| w[1] - w[0])).collect(),
            x_road: if case.variant.needs_position() { case.x_l.iter().map(x_road).collect() } else { Vec::new() },
            s: case.s.to_vec(),
            s_start: (0..count).map(|i| case.x_l[i] - case.x_f[i] - case.len_l).collect(),
            v_f: case.v_f.to_vec(),
            a_f: case.a_f.to_vec(),
            v_denominator: case.v_f.iter().map(|v| denominator(*v, floored[1])).collect(),
            per_denominator: [0, 1, 2].map(per_denominator),
            grade: grade.map(|g| Table::grade(g, case.convention.grade)).transpose()?,
            period: period.unwrap_or(0.0),
            mfc: mfc.map(|m| Table::mfc(m, case.convention.mfc)).transpose()?,
            world: (!case.variant.extensions.is_empty()).then(|| WorldSignals::new(case)),
            ring,
            measured,
        })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.s.len()
    }

    /// Sums of the measured spacing, speed and acceleration that the measures need, scored from sample `first` on. Panics if `first` is above `ring`.
    pub fn measured(&self, first: usize) -> &[Measured; 3] {
        &self.measured[first]
    }

    /// Number of samples at which a run may begin: 0 and those after it.
    pub fn firsts(&self) -> usize {
        self.measured.len()
    }

    /// Formula of a goodness of fit from the sums, for a run scored from sample `first` on.
    pub fn norm(&self, gof: &GoodnessOfFit, first: usize) -> Norm {
        gof.norm(self.measured(first))
    }

    /// `dx_l` in f32 with error diffusion: the sum of the rounded displacements follows the f64 position to half the last bit of one
    /// displacement.
    pub fn dx_l_f32(&self) -> Vec<f32> {
        let mut behind = 0.0;
        let diffuse = |dx: &f64| {
            let rounded = (dx + behind) as f32;
            behind += dx - f64::from(rounded);
            rounded
        };
        self.dx_l.iter().map(diffuse).collect()
    }
}

/// Largest number of steps from 0 of a clock in single precision: beyond it there are fewer than four values to a step.
const CLOCK_STEPS: f64 = 4_194_304.0;

impl Case {
    /// Checks that single precision resolves the time, if the variant reads it.
    pub fn check_clock(&self) -> Result<(), CourseError> {
        let is_event = |symbol: &Symbol| symbol.is_time() && !symbol.is_length_of_time();
        if !self.variant.extensions.read("t") && !self.variant.parameters().iter().any(is_event) {
            return Ok(());
        }
        let last = self.t_0 + self.s.len() as f64 * self.dt;
        let t = if last.abs() > self.t_0.abs() { last } else { self.t_0 };
        let (dt, limit) = (self.dt, CLOCK_STEPS * self.dt);
        if t.abs() <= limit {
            return Ok(());
        }
        Err(CourseError::Clock { label: self.label.to_string(), variant: self.variant.name(), t, dt, limit })
    }

    /// The start of a candidate, and the samples that it perceives. A delay that is NaN counts as 0; a run marks such a candidate.
    pub fn pace(&self, parameters: &Parameters) -> Pace {
        let delay = self.delay(parameters);
        let (delay_steps, first) = (self.delay_steps(delay), self.first_sample(delay));
        let back = delay_steps.ceil();
        let (back, fraction) = match self.convention.delay {
            // Rounding may put the longest delay slightly before the first sample.
            Delay::Fractional if back >= first as f64 && delay_steps < (first - 1) as f64 + 1e-6 => (first - 1, 0.0),
            Delay::Fractional => (back as usize, back - delay_steps),
            Delay::Floor => (back as usize, 0.0),
        };
        let earlier = self.variant.extensions.look_back().map_or(0.0, |symbol| parameters.get(symbol));
        let earlier = if earlier.is_finite() { earlier / self.dt } else { 0.0 };
        let look = |share: f64| {
            let steps = (delay_steps + share * earlier).clamp(-1e6, 1e6);
            (steps.ceil() as i32, steps.ceil() - steps)
        };
        let look_back = [look(1.0), look(0.5)];
        Pace { delay_steps, back, fraction, first, look_back }
    }
}
