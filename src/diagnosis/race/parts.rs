//! Splits drives into parts and folds; each fold is left out of a fit and judged.

use crate::diagnose::Drive;

/// Largest number of folds.
const FOLDS: usize = 5;
/// Number of folds for one or two drives.
const CUT: usize = 4;
/// Shortest part that is cut off \[s\]: a shorter one has too few bins for a mean.
const SHORTEST_S: f64 = 60.0;

/// Drives with their folds.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Drives, or parts of them.
    pub drives: Vec<Drive>,
    /// The drive of each part.
    pub of: Vec<usize>,
    /// The fold of each part.
    pub folds: Vec<usize>,
    /// Number of folds.
    pub count: usize,
}

impl Parts {
    /// Assigns whole recordings to folds in turn if there are three or more; one or two are cut into folds.
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
            let of = (0..drives.len()).collect();
            return Parts { drives: drives.to_vec(), of, count: recordings.len().min(FOLDS), folds };
        }
        let pieces = CUT / recordings.len().max(1);
        let mut parts = Parts { drives: Vec::new(), of: Vec::new(), folds: Vec::new(), count: 0 };
        for (k, drive) in drives.iter().enumerate() {
            let most = (drive.samples() as f64 * drive.dt() / SHORTEST_S) as usize;
            let pieces = pieces.min(most).max(1);
            let at = |piece: usize| piece * drive.samples() / pieces;
            for piece in 0..pieces {
                parts.drives.push(drive.part(at(piece)..at(piece + 1)));
                parts.of.push(k);
                parts.folds.push(parts.folds.len() % CUT);
            }
        }
        parts.count = parts.folds.len().min(CUT);
        parts
    }

    /// For each fold, the parts that count in a fit without it.
    #[must_use]
    pub fn trained(&self) -> Vec<Vec<bool>> {
        (0..self.count).map(|fold| self.folds.iter().map(|own| *own != fold).collect()).collect()
    }
}
