//! Quantities at every sample of a drive by which errors are sorted.

use crate::diagnose::drive::Drive;

/// Half width of the window for the slope that gives an acceleration \[s\]: differences of neighbouring samples are mostly noise.
const SLOPE_S: f64 = 0.5;

/// Quantities at every sample; all vectors are as long as the drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariates {
    /// Name of the drive.
    pub label: String,
    /// Time of the file \[s\].
    pub t: Vec<f64>,
    /// Time step \[s\].
    pub dt: f64,
    /// Measured speed \[m/s\].
    pub v: Vec<f64>,
    /// Measured spacing \[m\].
    pub s: Vec<f64>,
    /// Speed difference to the car ahead \[m/s\], positive when the gap opens.
    pub dv: Vec<f64>,
    /// Acceleration of the follower \[m/s²\].
    pub a: Vec<f64>,
    /// Acceleration of the car ahead \[m/s²\].
    pub a_l: Vec<f64>,
    /// Sine of the grade under the follower, if the road is known.
    pub sin_grade: Option<Vec<f64>>,
    /// Position on the road \[m\], modulo the lap, if positions are measured or the grade repeats after a lap; otherwise every drive begins
    /// at 0, and this is the distance driven.
    pub place: Option<Vec<f64>>,
}

impl Covariates {
    /// Quantities of a drive; `lap` is the length of a closed track \[m\].
    #[must_use]
    pub fn of(drive: &Drive, lap: Option<f64>) -> Covariates {
        let trajectory = &drive.trajectory;
        let v_l = &trajectory.v_l;
        let sin_grade = drive.sin_grade();
        let wrapped = |x: &f64| lap.map_or(*x, |lap| x.rem_euclid(lap));
        Covariates {
            label: trajectory.label.clone(),
            t: trajectory.t.clone(),
            dt: trajectory.dt,
            v: trajectory.v_f.clone(),
            s: trajectory.s.clone(),
            dv: v_l.iter().zip(&trajectory.v_f).map(|(v_l, v)| v_l - v).collect(),
            a: slopes(&trajectory.v_f, trajectory.dt),
            a_l: slopes(v_l, trajectory.dt),
            place: (trajectory.is_placed || lap.is_some()).then(|| drive.x_road.iter().map(wrapped).collect()),
            sin_grade,
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// True without samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

/// Slope of a signal around every sample.
fn slopes(y: &[f64], dt: f64) -> Vec<f64> {
    let half = ((SLOPE_S / dt).round() as usize).max(1);
    (0..y.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half).min(y.len() - 1));
            if b > a { (y[b] - y[a]) / ((b - a) as f64 * dt) } else { 0.0 }
        })
        .collect()
}
