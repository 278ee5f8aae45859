//! The minimum of a quadratic model in a box.

use nalgebra::{DMatrix, DVector};

/// Changes of the set of coordinates on bounds, at most, per coordinate: far more than it takes, in case rounding makes one come and go.
const CHANGES: usize = 4;
/// Share of a curvature that rounding may leave.
const ROUNDING: f64 = 1e-14;

/// The step d from `lower` to `upper`, which include 0, with the least g'd + d'Hd/2, H symmetric and positive semidefinite with a diagonal above 0: from 0 to the minimum
/// of the free coordinates; one that reaches a bound stays there until its slope points inwards.
pub fn lowest(gradient: &DVector<f64>, curvature: &DMatrix<f64>, lower: &[f64], upper: &[f64]) -> DVector<f64> {
    let n = gradient.len();
    let mut step = DVector::zeros(n);
    let outwards = |j: usize, x: f64, slope: f64| x <= lower[j] && slope >= 0.0 || x >= upper[j] && slope <= 0.0;
    let mut free: Vec<usize> = (0..n).filter(|&j| lower[j] < upper[j] && !outwards(j, 0.0, gradient[j])).collect();
    for _ in 0..CHANGES * (n + 1) {
        let target = solve(gradient, curvature, &step, &free);
        let mut share = 1.0;
        let mut first = None;
        for (place, (&j, target)) in free.iter().zip(&target).enumerate() {
            let bound = if *target < step[j] { lower[j] } else { upper[j] };
            // Without a sign, or a negative zero would reach its bound first.
            let reached = ((bound - step[j]) / (target - step[j])).abs();
            if reached < share {
                (share, first) = (reached, Some((place, bound)));
            }
        }
        for (&j, target) in free.iter().zip(&target) {
            step[j] = (step[j] + share * (target - step[j])).clamp(lower[j], upper[j]);
        }
        if let Some((place, bound)) = first {
            step[free.remove(place)] = bound;
            continue;
        }
        let gain = |j: usize| {
            let slope = gradient[j] + curvature.column(j).dot(&step);
            (!outwards(j, step[j], slope)).then(|| (slope * slope / curvature[(j, j)], j))
        };
        let bound = (0..n).filter(|j| lower[*j] < upper[*j] && !free.contains(j));
        let Some((_, freed)) = bound.filter_map(gain).max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        free.push(freed);
    }
    step
}

/// Values of the free coordinates at the minimum, given the others; 0 for one whose curvature follows, but for rounding, from those before,
/// where nalgebra gives no factor.
fn solve(gradient: &DVector<f64>, curvature: &DMatrix<f64>, step: &DVector<f64>, free: &[usize]) -> Vec<f64> {
    let m = free.len();
    let held =
        |i: usize| (0..step.len()).filter(|k| !free.contains(k)).map(|k| curvature[(i, k)] * step[k]).sum::<f64>();
    let mut x: Vec<f64> = free.iter().map(|&i| -(gradient[i] + held(i))).collect();
    // Cholesky's factor, row by row.
    let mut factor = vec![0.0; m * m];
    for a in 0..m {
        for b in 0..=a {
            let products: f64 = (0..b).map(|k| factor[a * m + k] * factor[b * m + k]).sum();
            let whole = curvature[(free[a], free[b])];
            let rest = whole - products;
            factor[a * m + b] = match a == b {
                true if rest > ROUNDING * whole => rest.sqrt(),
                true => f64::INFINITY,
                false => rest / factor[b * m + b],
            };
        }
        x[a] = (x[a] - (0..a).map(|k| factor[a * m + k] * x[k]).sum::<f64>()) / factor[a * m + a];
    }
    for a in (0..m).rev() {
        x[a] = (x[a] - (a + 1..m).map(|k| factor[k * m + a] * x[k]).sum::<f64>()) / factor[a * m + a];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::lowest;
    use crate::optimize::{normal, stream};
    use nalgebra::{DMatrix, DVector};

    /// Neither gradient nor curvature, as of a parameter that a drive does not determine.
    #[test]
    fn a_coordinate_without_effect_stays() {
        let (g, h) = (
            DVector::from_vec(vec![-1.0, 0.0, 0.0]),
            DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 1e-9, 1e-9])),
        );
        assert_eq!(lowest(&g, &h, &[-0.5; 3], &[0.5; 3]).as_slice(), [0.25, 0.0, 0.0]);
    }

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

    /// Slopes inside the box vanish, and those on bounds point out of it, whatever the matrix.
    #[test]
    fn the_step_is_the_lowest_of_the_box() {
        let mut rng = stream(3, 0, 0, 0);
        for n in (1..=12).cycle().take(600) {
            let factor = DMatrix::from_fn(n, n, |_, _| normal(&mut rng));
            let curvature = &factor * factor.transpose() + DMatrix::identity(n, n) * 1e-3;
            let gradient = DVector::from_fn(n, |_, _| normal(&mut rng));
            let mut side = |j: usize| if j % 5 == 4 { 0.0 } else { normal(&mut rng).abs() };
            let lower: Vec<f64> = (0..n).map(|j| -side(j)).collect();
            let upper: Vec<f64> = (0..n).map(|j| side(j + 1)).collect();
            let step = lowest(&gradient, &curvature, &lower, &upper);
            let slopes = gradient + curvature * &step;
            for (j, slope) in slopes.iter().enumerate() {
                assert!(lower[j] <= step[j] && step[j] <= upper[j], "{n} {j}");
                let (down, up) = (*slope > 1e-9 && step[j] > lower[j], *slope < -1e-9 && step[j] < upper[j]);
                assert!(!down && !up, "{n} {j}: slope {slope} at {}", step[j]);
            }
        }
    }

    /// One of two equal coordinates stays where it is.
    #[test]
    fn a_singular_matrix_has_a_step() {
        let (g, h) = (DVector::from_vec(vec![-1.0, -1.0]), DMatrix::from_element(2, 2, 1.0));
        assert_eq!(lowest(&g, &h, &[-9.0; 2], &[9.0; 2]), DVector::from_vec(vec![1.0, 0.0]));
    }
}
