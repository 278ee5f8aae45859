//! Parts computed again: a checksum distinguishes a torn file from a complete one, but does not reveal a number that was changed together
//! with it.

use super::folder::Folder;
use super::inventory::Inventory;
use super::log::Progress;
use super::part::Part;
use super::run::{Assignment, Event, RunSettings, run};
use super::{StudyError, inventory, sha256};

/// Parts that were computed again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Verified {
    /// Their number.
    pub parts: usize,
    /// Differing parts: as found, and as computed now.
    pub differing: Vec<(Part, Part)>,
    /// True if it was interrupted before the last one.
    pub interrupted: bool,
}

/// The tasks of a random share of the present parts, at least one, in the order of the plan.
pub fn drawn(inventory: &Inventory, share: f64, seed: u64) -> Vec<usize> {
    let there = inventory.parts.iter().enumerate().filter_map(|(i, part)| Some((i, part.as_ref()?)));
    let mut shuffled: Vec<(String, usize)> =
        there.map(|(i, part)| (sha256(format!("{seed} {}", part.id).as_bytes()), i)).collect();
    shuffled.sort_unstable();
    shuffled.truncate(((share * shuffled.len() as f64).ceil() as usize).max(1));
    let mut chosen: Vec<usize> = shuffled.into_iter().map(|(_, i)| i).collect();
    chosen.sort_unstable();
    chosen
}

/// Computes these tasks again, in a temporary folder of the system, and compares. Another program may have computed a part.
pub fn verify(
    assignment: Assignment,
    inventory: &Inventory,
    settings: &RunSettings,
    progress: &Progress,
    interrupted: &(dyn Fn() -> bool + Sync),
    tell: &mut dyn FnMut(Event),
) -> Result<Verified, StudyError> {
    // Removed when dropped. It is outside of the study, which may be read-only, or be verified by several processes at once.
    let place = tempfile::Builder::new().prefix("leadlag-verify-").tempdir();
    let place = place.map_err(StudyError::file(&std::env::temp_dir(), "make a temporary folder"))?;
    let folder = Folder::bare(place.path());
    let summary = run(Assignment { folder: &folder, ..assignment }, settings, progress, interrupted, tell)?;
    let now = inventory::look(&folder, assignment.tasks, &[])?;
    let pairs = inventory.parts.iter().zip(now.parts).filter_map(|(then, now)| Some((then.clone()?, now?)));
    let (mut parts, mut differing) = (0, Vec::new());
    for (then, now) in pairs {
        parts += 1;
        if !is_same(&then, &now) {
            differing.push((then, now));
        }
    }
    Ok(Verified { parts, differing, interrupted: summary.left > 0 })
}

/// The same result, from any program, evaluator and device.
fn is_same(then: &Part, now: &Part) -> bool {
    let mut then = then.clone();
    let (by, of) = (&mut then.calibration, &now.calibration);
    (by.program, by.evaluator) = (of.program.clone(), of.evaluator.clone());
    (by.precision, by.adapter) = (of.precision.clone(), of.adapter.clone());
    then == *now
}
