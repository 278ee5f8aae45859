//! Data internal consistency (paper, Section 4.2): positions, speeds and spacing that obey Eq. 1 together.

use super::samples::{Samples, Signal, lead_length};
use super::{Context, Reconcile};
use crate::statistics::rms;
use crate::trajectory::{Grade, Layout, Note, PrepareError, Trajectory, integrate};

/// Positions within this length count as one point of a grade profile \[m\], which has their mean: where the car crept, neighbours are
/// millimetres apart, and the last digits of the column would make steep steps of the road.
const GRADE_SPACING_M: f64 = 0.5;

/// A consistent trajectory from the complete samples of one segment.
pub(super) fn trajectory(
    samples: Samples,
    dt: f64,
    label: String,
    mut notes: Vec<Note>,
    context: &Context,
) -> Result<Trajectory, PrepareError> {
    let len_l = lead_length(context).unwrap_or_else(|| {
        notes.push(Note::LengthUnknown);
        0.0
    });
    let dt_raw = samples.t[1] - samples.t[0];
    let (x_l, x_f, s) = positions(&samples, len_l, dt, dt_raw, &mut notes, context);
    if let Some(i) = s.iter().position(|&s_i| s_i.is_nan() || s_i <= 0.0) {
        return Err(PrepareError::Spacing {
            path: context.path(),
            follower: context.follower,
            t: samples.t[i],
            value: s[i],
            advice: match context.preparation.reconcile {
                Reconcile::Gap => "cut the time window to a part with a reliable spacing",
                Reconcile::Speeds => "the speeds contradict the gap: anchor the spacing at the measured gap",
            },
        });
    }
    let grade = grade(&samples, &x_f, &mut notes, context);
    let is_placed =
        [Signal::LeadPosition, Signal::Position].into_iter().any(|signal| start(&samples, signal).is_some());
    let ego = context.platoon.cars.iter().find(|car| car.number == context.follower + 1);
    let optional = |signal| samples.channel(signal).map(<[f64]>::to_vec);
    Ok(Trajectory {
        label,
        source: context.recording.source.clone(),
        follower: context.follower,
        name: ego.map(|car| car.name.clone()).unwrap_or_default(),
        id: context.platoon.id.clone(),
        dt,
        dt_raw,
        x_l,
        v_l: samples.required(Signal::LeadSpeed).to_vec(),
        len_l,
        x_f,
        is_placed,
        v_f: samples.required(Signal::Speed).to_vec(),
        s,
        v_l2: optional(Signal::Lead2Speed),
        s_l2: optional(Signal::Lead2Spacing),
        grade,
        notes,
        t: samples.t,
    })
}

/// The first measured position \[m\].
fn start(samples: &Samples, signal: Signal) -> Option<f64> {
    samples.channel(signal)?.first().copied().filter(|x| x.is_finite())
}

/// Positions of both cars and their spacing \[m\].
fn positions(
    samples: &Samples,
    len_l: f64,
    dt: f64,
    dt_raw: f64,
    notes: &mut Vec<Note>,
    context: &Context,
) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let v_l = samples.required(Signal::LeadSpeed);
    let v_f = samples.required(Signal::Speed);
    let gap = samples.required(Signal::Spacing);
    let [start_l, start_f] = [Signal::LeadPosition, Signal::Position].map(|signal| start(samples, signal));
    let spacing =
        |x_l: &[f64], x_f: &[f64]| -> Vec<f64> { x_l.iter().zip(x_f).map(|(x_l, x_f)| x_l - x_f - len_l).collect() };

    let authors_file = context.recording.layout == Layout::AstazeroProcessed;
    let as_written = context.preparation.lead_length.is_none() && context.preparation.reconcile == Reconcile::Gap;
    if let (true, Some(x_l), Some(x_f)) = (authors_file && as_written, start_l, start_f) {
        // These files are consistent already; the authors integrate both cars from their first positions with the step
        // of the file as a double, so the same sums are made here.
        let (x_l, x_f) = (integrate(x_l, v_l, dt_raw), integrate(x_f, v_f, dt_raw));
        let s = spacing(&x_l, &x_f);
        notes.push(residual(gap, &s, &x_f, "both positions and speeds"));
        return (x_l, x_f, s);
    }

    let start_l = start_l.or(start_f.map(|x_f| x_f + gap[0] + len_l));
    let x_l_0 = start_l.unwrap_or_else(|| {
        if context.preparation.grade.is_some() || context.recording.grade.is_some() {
            notes.push(Note::StartAssumed { position_m: 0.0 });
        }
        0.0
    });
    let x_f = integrate(x_l_0 - len_l - gap[0], v_f, dt);
    let integrated = integrate(x_l_0, v_l, dt);
    let from_speeds = spacing(&integrated, &x_f);
    match context.preparation.reconcile {
        Reconcile::Gap => {
            notes.push(residual(gap, &from_speeds, &x_f, "the measured gap"));
            let x_l = x_f.iter().zip(gap).map(|(x_f, s)| x_f + s + len_l).collect();
            (x_l, x_f, gap.to_vec())
        }
        Reconcile::Speeds => {
            notes.push(residual(gap, &from_speeds, &x_f, "the first gap and both speeds"));
            (integrated, x_f, from_speeds)
        }
    }
}

/// Difference between the measured gap and the integrated speeds.
fn residual(gap: &[f64], integrated: &[f64], x_f: &[f64], anchor: &str) -> Note {
    let residuals: Vec<f64> = gap.iter().zip(integrated).map(|(g, s)| g - s).collect();
    let largest = residuals.iter().fold(0.0, |m: f64, r| if r.abs() > m.abs() { *r } else { m });
    Note::Reconciled {
        anchor: anchor.to_owned(),
        rms_m: rms(residuals.iter().copied()).unwrap_or(0.0),
        largest_m: largest,
        drift_m_per_km: slope(x_f, &residuals) * 1000.0,
    }
}

/// Slope of the least-squares line of `y` over `x`; 0 if `x` does not change.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (x_mean, y_mean) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let spread: f64 = x.iter().map(|x| (x - x_mean).powi(2)).sum();
    let common: f64 = x.iter().zip(y).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    if spread > 1.0 { common / spread } else { 0.0 }
}

/// The requested grade, otherwise the one in the file, otherwise the one beside it.
fn grade(samples: &Samples, x_f: &[f64], notes: &mut Vec<Note>, context: &Context) -> Option<Grade> {
    if let Some(grade) = &context.preparation.grade {
        return Some(grade.clone());
    }
    let Some(sin) = samples.channel(Signal::SinGrade) else {
        return context.recording.grade.clone();
    };
    let (x, sin) = profile(x_f.iter().copied().zip(sin.iter().copied()));
    if x.is_empty() {
        return None;
    }
    notes.push(Note::GradeFromColumn { points: x.len() });
    Some(Grade { x, sin, period: None, source: Some(context.recording.source.clone()) })
}

/// Positions and sines along a path, those of one stretch of [`GRADE_SPACING_M`] as one point in its middle.
fn profile(path: impl Iterator<Item = (f64, f64)>) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut means): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let (mut begin, mut merged) = (f64::NAN, 1.0);
    for (x_i, sin_i) in path.filter(|(_, sin)| sin.is_finite()) {
        match (x.last_mut(), means.last_mut()) {
            (Some(middle), Some(mean)) if x_i - begin < GRADE_SPACING_M => {
                merged += 1.0;
                // Never before its start, so that positions rise even if the car appears to roll back.
                *middle = f64::midpoint(begin, x_i).max(begin);
                *mean += (sin_i - *mean) / merged;
            }
            _ => {
                x.push(x_i);
                means.push(sin_i);
                (begin, merged) = (x_i, 1.0);
            }
        }
    }
    (x, means)
}
