//! Selects the samples that a model is fitted to, and those that it is scored on.

use super::robust::Mask;
use crate::diagnose::policy::POLICY;

/// Samples that count when all data are used: all but the first seconds of a drive.
#[must_use]
pub fn whole(samples: &[usize], dt: &[f64]) -> Vec<Mask> {
    let mask = |(&samples, &dt): (&usize, &f64)| {
        let guard = (POLICY.fold_guard / dt).round() as usize;
        (0..samples).map(|t| t >= guard).collect()
    };
    samples.iter().zip(dt).map(mask).collect()
}

/// The two folds: alternating stretches of a minute, counted through all drives, without the seconds after every seam.
#[must_use]
pub fn folds(samples: &[usize], dt: &[f64]) -> [Vec<Mask>; 2] {
    [0, 1].map(|fold| {
        let mut stretches = 0;
        let mask = |(&samples, &dt): (&usize, &f64)| {
            let (stretch, guard) =
                ((POLICY.fold_stretch / dt).round() as usize, (POLICY.fold_guard / dt).round() as usize);
            let first = stretches;
            stretches += samples.div_ceil(stretch);
            (0..samples).map(|t| (first + t / stretch) % 2 == fold && t % stretch >= guard).collect()
        };
        samples.iter().zip(dt).map(mask).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_share_no_sample_and_guard_every_seam() {
        let [a, b] = folds(&[1500, 900], &[0.1, 0.1]);
        assert_eq!((a[0].len(), a[1].len()), (1500, 900));
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!(!(a & b));
        }
        assert!(!a[0][49] && a[0][50] && a[0][599] && !a[0][600] && b[0][650] && !b[0][649]);
        // The first drive has three stretches, so the second one begins with the other fold.
        assert!(b[1][50] && !a[1][50] && a[1][650]);
        let used = a.iter().chain(&b).flatten().filter(|counts| **counts).count();
        assert_eq!(used, 2400 - 5 * 50);
    }
}
