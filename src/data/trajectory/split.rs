//! Two parts of one drive.

use super::Trajectory;
use std::ops::Range;

impl Trajectory {
    /// The start, and the rest from sample `at` on.
    pub fn split(&self, at: usize) -> [Trajectory; 2] {
        let part = |range: Range<usize>, name: &str| {
            let of = |values: &[f64]| values[range.clone()].to_vec();
            let optional = |values: &Option<Vec<f64>>| values.as_deref().map(of);
            Trajectory {
                label: format!("{} {name}", self.label),
                t: of(&self.t),
                x_l: of(&self.x_l),
                v_l: of(&self.v_l),
                x_f: of(&self.x_f),
                v_f: of(&self.v_f),
                s: of(&self.s),
                v_l2: optional(&self.v_l2),
                s_l2: optional(&self.s_l2),
                source: self.source.clone(),
                name: self.name.clone(),
                id: self.id.clone(),
                grade: self.grade.clone(),
                notes: self.notes.clone(),
                ..*self
            }
        };
        [part(0..at, "beginning"), part(at..self.len(), "end")]
    }
}
