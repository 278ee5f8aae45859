//! Table look-ups: road grade by position, MFC curves by speed.

use crate::convention::{GradeLookup, MfcLookup};
use crate::trajectory::Grade;
use crate::vehicle::Mfc;

/// Sine of the grade at position `x` \[m\].
pub fn sin_grade(grade: &Grade, x: f64, rule: GradeLookup) -> f64 {
    match rule {
        GradeLookup::Linear => grade.at(x),
        GradeLookup::Held => {
            let u = grade.period.map_or(x, |period| x.rem_euclid(period));
            let n = grade.x.len();
            if n < 4 || (grade.x[1]..=grade.x[n - 2]).contains(&u) {
                return grade.at(x);
            }
            if u < grade.x[1] { grade.sin[1] } else { grade.sin[n - 2] }
        }
    }
}

/// (a_dp, a_ap) at speed `v` \[m/s²\].
pub fn mfc_bounds(mfc: &Mfc, v: f64, rule: MfcLookup) -> (f64, f64) {
    let last = mfc.v.len() - 1;
    let k = match rule {
        MfcLookup::Linear => {
            if v <= mfc.v[0] {
                return (mfc.a_dp[0], mfc.a_ap[0]);
            }
            mfc.v.partition_point(|node| *node <= v) - 1
        }
        MfcLookup::Bisection => last_visited(&mfc.v, v),
    };
    if k >= last {
        return (mfc.a_dp[last], mfc.a_ap[last]);
    }
    let fraction = (v - mfc.v[k]) / (mfc.v[k + 1] - mfc.v[k]);
    let along = |y: &[f64]| y[k] + (y[k + 1] - y[k]) * fraction;
    (along(&mfc.a_dp), along(&mfc.a_ap))
}

/// The last node that a bisection for `v` looks at: the authors interpolate on the segment that starts there, which
/// lies above `v` about half the time.
fn last_visited(nodes: &[f64], v: f64) -> usize {
    let (mut low, mut high, mut middle) = (0, nodes.len(), 0);
    while low < high {
        middle = usize::midpoint(low, high);
        if nodes[middle] < v {
            low = middle + 1;
        } else if nodes[middle] > v {
            high = middle;
        } else {
            break;
        }
    }
    middle
}
