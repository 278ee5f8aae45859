//! Splits drives into parts and folds; each fold is left out of a fit and judged.

use crate::diagnose::Drive;
use crate::trajectory::driver_id;
use std::collections::HashMap;

/// Largest number of folds.
const FOLDS: usize = 5;
/// Number of folds for one or two drives.
const CUT: usize = 4;
/// Shortest part that is cut off \[s\]: a shorter one has too few bins for a mean.
const SHORTEST_S: f64 = 60.0;

/// The units of a race: folds and reports consist of whole units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// The recordings of one car. Bins that are far apart in time are independent.
    Recording,
    /// The drivers of a fleet. All bins of a driver depend on each other.
    Driver,
}

impl Unit {
    /// The unit of a drive.
    fn of(self, drive: &Drive) -> String {
        match (self, driver(drive)) {
            (Unit::Driver, Some(driver)) => driver.to_owned(),
            // Without an id, each drive has another driver.
            (Unit::Driver, None) => format!("{} {}", drive.recording(), drive.trajectory.source.sha256),
            (Unit::Recording, _) => drive.recording(),
        }
    }

    /// Its line in reports.
    fn label(self, drive: &Drive) -> String {
        match self {
            Unit::Recording => drive.file(),
            Unit::Driver => driver(drive).unwrap_or(drive.label()),
        }
        .to_owned()
    }
}

fn driver(drive: &Drive) -> Option<&str> {
    driver_id(&drive.trajectory.name, drive.trajectory.id.as_deref())
}

/// Drives with their folds.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Drives, or parts of them.
    pub drives: Vec<Drive>,
    /// The drive of each part.
    pub of: Vec<usize>,
    /// The kind of unit.
    pub unit: Unit,
    /// The unit of each part.
    pub units: Vec<usize>,
    /// The line of each part in reports: its file, or its driver.
    pub labels: Vec<String>,
    /// The fold of each part.
    pub folds: Vec<usize>,
    /// Number of folds.
    pub count: usize,
}

impl Parts {
    /// Assigns whole units to folds in turn if there are three or more; the drives of one or two are cut into folds.
    #[must_use]
    pub fn of(drives: &[Drive], unit: Unit) -> Parts {
        let mut places = HashMap::new();
        let mut place = |drive: &Drive| {
            let next = places.len();
            *places.entry(unit.of(drive)).or_insert(next)
        };
        let units: Vec<usize> = drives.iter().map(&mut place).collect();
        let count = places.len();
        if count > 2 {
            let labels = drives.iter().map(|drive| unit.label(drive)).collect();
            let folds = units.iter().map(|unit| unit % FOLDS).collect();
            let of = (0..drives.len()).collect();
            return Parts { drives: drives.to_vec(), of, unit, units, labels, folds, count: count.min(FOLDS) };
        }
        let pieces = CUT / count.max(1);
        let mut parts = Parts {
            drives: Vec::new(),
            of: Vec::new(),
            unit,
            units: Vec::new(),
            labels: Vec::new(),
            folds: Vec::new(),
            count: 0,
        };
        for (k, drive) in drives.iter().enumerate() {
            let most = (drive.samples() as f64 * drive.dt() / SHORTEST_S) as usize;
            let pieces = pieces.min(most).max(1);
            let at = |piece: usize| piece * drive.samples() / pieces;
            for piece in 0..pieces {
                parts.drives.push(drive.part(at(piece)..at(piece + 1)));
                parts.of.push(k);
                parts.units.push(units[k]);
                parts.labels.push(unit.label(drive));
                parts.folds.push(parts.folds.len() % CUT);
            }
        }
        parts.count = parts.folds.len().min(CUT);
        parts
    }

    /// Number of units.
    #[must_use]
    pub fn unit_count(&self) -> usize {
        self.units.iter().max().map_or(0, |last| last + 1)
    }

    /// For each fold, the parts that count in a fit without it.
    #[must_use]
    pub fn trained(&self) -> Vec<Vec<bool>> {
        (0..self.count).map(|fold| self.folds.iter().map(|own| *own != fold).collect()).collect()
    }
}
