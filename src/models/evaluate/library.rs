//! A folder of platoon files with their companions, each read once when needed.

use super::Settings;
use crate::catalog::{Constraint, Variant};
use crate::evaluator::{Case, CaseError};
use crate::trajectory::{ImportError, Layout, Preparation, PrepareError, Source, import, prepare};
use crate::vehicle::{Vehicle, VehicleError, read_table};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The copy of the AstaZero platoons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DataLayout {
    /// As the paper's authors processed them (`astazero_c2art`).
    #[default]
    Processed,
    /// Unfiltered speeds and measured gaps (`astazero_rebuilt`).
    Rebuilt,
}

impl DataLayout {
    fn folder(self) -> &'static str {
        match self {
            DataLayout::Processed => "astazero_c2art",
            DataLayout::Rebuilt => "astazero_rebuilt",
        }
    }

    fn layout(self) -> Layout {
        match self {
            DataLayout::Processed => Layout::AstazeroProcessed,
            DataLayout::Rebuilt => Layout::AstazeroRebuilt,
        }
    }
}

/// A data folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// It is not a folder.
    #[error("{0}: expected the folder of the platoon files; there is none")]
    Folder(String),
    /// It is a file.
    #[error(
        "{0}: expected the folder of the platoon files, found a file; give its folder, and name the file, without .csv, in the column \
         platoon of the table"
    )]
    File(String),
    /// Its vehicle table is broken.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
}

/// A platoon that is missing or cannot be used.
#[derive(Debug, Clone, thiserror::Error)]
pub enum LibraryError {
    /// The file is missing.
    #[error("platoon {platoon}: no file {platoon}.csv in {}", searched.join(" or "))]
    NotFound {
        /// The file stem.
        platoon: String,
        /// The folders searched.
        searched: Vec<String>,
    },
    /// The name would leave the folder.
    #[error("platoon `{0}`: expected the name of a file without folder and extension")]
    Name(String),
    /// The file cannot be imported.
    #[error("{0}")]
    Import(#[source] Arc<ImportError>),
    /// The file cannot be prepared.
    #[error("{0}")]
    Prepare(#[source] Arc<PrepareError>),
    /// The file splits into segments, which rows cannot name.
    #[error("platoon {platoon} follower {follower}: long gaps split it into {segments} segments; cut a gap-free file")]
    Segments {
        /// The file stem.
        platoon: String,
        /// The follower.
        follower: usize,
        /// How many.
        segments: usize,
    },
    /// It is too short.
    #[error(transparent)]
    Case(#[from] CaseError),
}

/// Platoons and vehicles of a data folder.
#[derive(Debug)]
pub struct Library {
    folder: PathBuf,
    layout: DataLayout,
    preparation: Preparation,
    vehicles: Vec<Vehicle>,
    notes: Vec<String>,
    /// Faults of the data of each follower in use.
    faults: Vec<String>,
    cases: HashMap<(String, usize), Result<Case, LibraryError>>,
    sources: Vec<Source>,
    /// Vehicles in use: by short name, and whether the MFC curve was needed.
    used: HashSet<(String, bool)>,
}

/// Largest number of printed warnings about rows.
const FAULTS: usize = 100;

impl Library {
    /// Opens a folder, whose files are to be prepared alike. Vehicles come from `vehicles/vehicles.csv` in or beside it, otherwise from the
    /// built-in table.
    ///
    /// # Errors
    /// For a missing folder, or a vehicle table that cannot be read.
    pub fn open(folder: &Path, layout: DataLayout, preparation: Preparation) -> Result<Library, OpenError> {
        if !folder.is_dir() {
            let shown = folder.display().to_string();
            return Err(if folder.exists() { OpenError::File(shown) } else { OpenError::Folder(shown) });
        }
        let parent = folder.join("..");
        let table = [folder, &parent].iter().map(|f| f.join("vehicles").join("vehicles.csv")).find(|p| p.exists());
        let vehicles = table.as_deref().map_or_else(|| Ok(Vehicle::built_in()), read_table)?;
        let (folder, cases, notes, faults) = (folder.to_owned(), HashMap::new(), Vec::new(), Vec::new());
        let (sources, used) = (Vec::new(), HashSet::new());
        Ok(Library { folder, layout, preparation, vehicles, notes, faults, cases, sources, used })
    }

    /// The files used so far, with checksums: data, and the parts of a vehicle that the variants needed.
    #[must_use]
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Faults of the data of each follower used so far, one line each.
    #[must_use]
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    /// Adds the warning of a row once: tables have millions of rows.
    pub(super) fn doubt(&mut self, what: String) {
        if self.faults.len() < FAULTS && !self.faults.contains(&what) {
            self.faults.push(what);
        }
    }

    /// Changes to the data of each follower used so far, one line each.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The case of a follower, for any variant (`Case::for_variant`).
    pub(super) fn case(&mut self, platoon: &str, follower: usize, settings: &Settings) -> Result<Case, LibraryError> {
        let key = (platoon.to_owned(), follower);
        if !self.cases.contains_key(&key) {
            let case = self.read(platoon, follower, settings);
            self.cases.insert(key.clone(), case);
        }
        self.cases[&key].clone()
    }

    /// Lists the files of the vehicle of a case, as far as its variant needs them.
    pub(super) fn uses_vehicle_of(&mut self, case: &Case) {
        let Some(vehicle) = case.vehicle.as_ref().filter(|_| case.variant.needs_vehicle()) else { return };
        let with_curve = case.variant.constraint == Constraint::Mfc;
        if !self.used.insert((vehicle.slug.clone(), with_curve)) {
            return;
        }
        let curve = vehicle.mfc.as_ref().and_then(|mfc| mfc.source.as_ref());
        for source in vehicle.files().into_iter().filter(|source| with_curve || Some(*source) != curve) {
            if !self.sources.contains(source) {
                self.sources.push(source.clone());
            }
        }
    }

    fn read(&mut self, platoon: &str, follower: usize, settings: &Settings) -> Result<Case, LibraryError> {
        if platoon.is_empty() || platoon.contains(['/', '\\']) || platoon.contains("..") {
            return Err(LibraryError::Name(platoon.to_owned()));
        }
        let folders = [self.folder.clone(), self.folder.join(self.layout.folder())];
        let path = folders.iter().map(|f| f.join(format!("{platoon}.csv"))).find(|p| p.exists());
        let Some(path) = path else {
            let searched = folders.iter().map(|f| f.display().to_string()).collect();
            return Err(LibraryError::NotFound { platoon: platoon.to_owned(), searched });
        };
        // The given folder may have files of any layout; the AstaZero folders only theirs.
        let layout = path.starts_with(&folders[1]).then(|| self.layout.layout());
        let recording = import::read(&path, layout).map_err(|e| LibraryError::Import(Arc::new(e)))?;
        for source in std::iter::once(&recording.source).chain(&recording.companions) {
            if !self.sources.contains(source) {
                self.sources.push(source.clone());
            }
        }
        let segments =
            prepare(&recording, follower, &self.preparation).map_err(|e| LibraryError::Prepare(Arc::new(e)))?;
        let [trajectory] = segments.as_slice() else {
            return Err(LibraryError::Segments { platoon: platoon.to_owned(), follower, segments: segments.len() });
        };
        self.notes.extend(trajectory.preparation().map(|note| format!("{}: {note}", trajectory.label)));
        self.faults.extend(trajectory.faults().map(|fault| format!("{}: {fault}", trajectory.label)));
        let vehicle = self.vehicles.iter().find(|v| v.is_called(&trajectory.name));
        let any = Variant::from_id(1).expect("variant 1 exists");
        Ok(Case::new(trajectory, any, vehicle, settings.convention, settings.tau_p_upper)?)
    }
}
