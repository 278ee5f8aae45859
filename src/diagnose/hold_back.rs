//! Without a file of its own, the hold-out is the end of every file.

use crate::trajectory::Trajectory;

/// Share of a file that is trained on.
pub const TRAINED_ON: f64 = 2.0 / 3.0;

/// The beginning of a trajectory, to be trained on, and its end, to be held back.
#[must_use]
pub fn hold_back(trajectory: &Trajectory) -> [Trajectory; 2] {
    let cut = (TRAINED_ON * trajectory.len() as f64).round() as usize;
    let part = |range: std::ops::Range<usize>, name: &str| {
        let of = |values: &[f64]| values[range.clone()].to_vec();
        let optional = |values: &Option<Vec<f64>>| values.as_deref().map(of);
        Trajectory {
            label: format!("{} {name}", trajectory.label),
            t: of(&trajectory.t),
            x_l: of(&trajectory.x_l),
            v_l: of(&trajectory.v_l),
            x_f: of(&trajectory.x_f),
            v_f: of(&trajectory.v_f),
            s: of(&trajectory.s),
            v_l2: optional(&trajectory.v_l2),
            s_l2: optional(&trajectory.s_l2),
            source: trajectory.source.clone(),
            name: trajectory.name.clone(),
            grade: trajectory.grade.clone(),
            notes: trajectory.notes.clone(),
            ..*trajectory
        }
    };
    [part(0..cut, "beginning"), part(cut..trajectory.len(), "end")]
}
