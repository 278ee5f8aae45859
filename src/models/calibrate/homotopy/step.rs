//! The minimum of a quadratic model in a box.

use nalgebra::{DMatrix, DVector};

/// Sweeps over the coordinates, at most.
const SWEEPS: usize = 200;
/// Number of sweeps after which the coordinates on no bound are solved for together.
const TOGETHER: usize = 10;
/// A sweep that moves no coordinate, each of a range of 1, by more than this is the last one.
const STANDS: f64 = 1e-12;

/// The step d from `lower` to `upper` with the least g'd + d'Hd/2, H symmetric with a diagonal above 0.
pub fn lowest(gradient: &DVector<f64>, curvature: &DMatrix<f64>, lower: &[f64], upper: &[f64]) -> DVector<f64> {
    let n = gradient.len();
    let value = |d: &DVector<f64>| gradient.dot(d) + 0.5 * d.dot(&(curvature * d));
    let mut step = DVector::zeros(n);
    for sweep in 1..=SWEEPS {
        let mut moved = 0.0_f64;
        for j in 0..n {
            let slope = gradient[j] + curvature.column(j).dot(&step);
            let next = (step[j] - slope / curvature[(j, j)]).clamp(lower[j], upper[j]);
            moved = moved.max((next - step[j]).abs());
            step[j] = next;
        }
        if moved < STANDS {
            break;
        }
        if sweep % TOGETHER != 0 {
            continue;
        }
        let inside: Vec<usize> = (0..n).filter(|&j| step[j] > lower[j] && step[j] < upper[j]).collect();
        if let Some(together) = solve(gradient, curvature, &step, &inside)
            && inside.iter().all(|&j| together[j] >= lower[j] && together[j] <= upper[j])
            && value(&together) <= value(&step)
        {
            return together;
        }
    }
    step
}

/// The step with the coordinates `inside` at the minimum, given the others.
fn solve(
    gradient: &DVector<f64>,
    curvature: &DMatrix<f64>,
    step: &DVector<f64>,
    inside: &[usize],
) -> Option<DVector<f64>> {
    let mut fixed = step.clone();
    inside.iter().for_each(|&j| fixed[j] = 0.0);
    let slope = gradient + curvature * &fixed;
    let small = DMatrix::from_fn(inside.len(), inside.len(), |a, b| curvature[(inside[a], inside[b])]);
    let right = DVector::from_fn(inside.len(), |a, _| -slope[inside[a]]);
    let solved = small.cholesky()?.solve(&right);
    inside.iter().zip(solved.iter()).for_each(|(&j, x)| fixed[j] = *x);
    fixed.iter().all(|x| x.is_finite()).then_some(fixed)
}

#[cfg(test)]
mod tests {
    use super::lowest;
    use nalgebra::{DMatrix, DVector};

    /// Worked by hand: free, H d = -g gives (2, -1); with d_2 at its bound of -0.5, d_1 is (3 + 0.5) / 2.
    #[test]
    fn a_bound_moves_the_other_coordinate() {
        let (g, h) = (DVector::from_vec(vec![-3.0, 0.0]), DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]));
        for (lower, upper, expected) in [
            ([-9.0, -9.0], [9.0, 9.0], [2.0, -1.0]),
            ([-9.0, -0.5], [9.0, 9.0], [1.75, -0.5]),
            ([-9.0, -0.5], [1.0, 9.0], [1.0, -0.5]),
            ([0.0, 0.0], [0.0, 0.0], [0.0, 0.0]),
        ] {
            let step = lowest(&g, &h, &lower, &upper);
            assert!((step - DVector::from_row_slice(&expected)).amax() < 1e-9, "{lower:?} {upper:?}");
        }
    }
}
