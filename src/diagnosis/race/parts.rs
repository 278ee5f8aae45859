//! Drives in parts and folds: a fold is left out of the fits and judged.

use crate::diagnose::Drive;

/// Folds at most.
const FOLDS: usize = 5;
/// Folds that one or two drives are cut into.
const CUT: usize = 4;
/// Shorter parts are not cut off \[s\]: too few bins for a mean.
const SHORTEST_S: f64 = 60.0;

/// Drives with their folds.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Drives, or parts of them.
    pub drives: Vec<Drive>,
    /// The fold of each.
    pub folds: Vec<usize>,
    /// Number of folds.
    pub count: usize,
}

impl Parts {
    /// Whole recordings in turn where there are three or more; one or two are cut, so that there is something to leave out.
    #[must_use]
    pub fn of(drives: &[Drive]) -> Parts {
        let mut recordings: Vec<String> = Vec::new();
        for drive in drives {
            if !recordings.contains(&drive.recording()) {
                recordings.push(drive.recording());
            }
        }
        if recordings.len() > 2 {
            let fold = |drive: &Drive| {
                recordings.iter().position(|name| *name == drive.recording()).expect("collected above") % FOLDS
            };
            let folds: Vec<usize> = drives.iter().map(fold).collect();
            return Parts { drives: drives.to_vec(), count: recordings.len().min(FOLDS), folds };
        }
        let pieces = CUT / recordings.len().max(1);
        let mut parts = Parts { drives: Vec::new(), folds: Vec::new(), count: 0 };
        for drive in drives {
            let most = (drive.samples() as f64 * drive.dt() / SHORTEST_S) as usize;
            let pieces = pieces.min(most).max(1);
            for k in 0..pieces {
                let at = |k: usize| k * drive.samples() / pieces;
                parts.drives.push(drive.part(at(k)..at(k + 1)));
                parts.folds.push(parts.folds.len() % CUT);
            }
        }
        parts.count = parts.folds.len().min(CUT);
        parts
    }

    /// Drives as they are, in one fold.
    #[must_use]
    pub fn whole(drives: &[Drive]) -> Parts {
        Parts { drives: drives.to_vec(), folds: vec![0; drives.len()], count: 1 }
    }

    /// For each fold the parts that a fit without it counts.
    #[must_use]
    pub fn trained(&self) -> Vec<Vec<bool>> {
        (0..self.count).map(|fold| self.folds.iter().map(|own| *own != fold).collect()).collect()
    }
}
