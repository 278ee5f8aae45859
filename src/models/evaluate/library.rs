//! A folder of platoon files with their companions, each read once when needed.

use super::Settings;
use crate::catalog::{Constraint, Variant};
use crate::evaluator::{Case, CaseError};
use crate::text::option::DATA;
use crate::trajectory::import::{ColumnMap, read_mapped};
use crate::trajectory::{
    ImportError, Layout, Preparation, PrepareError, Recording, Source, Trajectory, Treatment, import, prepare,
};
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
    #[error("{0}: expected the folder of the platoon files, or one file; there is none")]
    Missing(String),
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
}

/// A platoon that is missing or cannot be used.
#[derive(Debug, Clone, thiserror::Error)]
pub enum LibraryError {
    #[error("platoon {platoon}: no file {platoon}.csv in {}", searched.join(" or "))]
    NotFound { platoon: String, searched: Vec<String> },
    #[error("platoon `{0}`: expected the name of a file without folder and extension")]
    Name(String),
    #[error("platoon {0}: its folder is unknown; give it by {DATA}")]
    NoFolder(String),
    #[error("{0}: no such file; {DATA} gives its folder, or the file of all rows")]
    NoFile(String),
    #[error("platoon {platoon}: expected {file}, the file of all rows")]
    OtherFile { platoon: String, file: String },
    #[error(
        "{file}: expected the id of one of its trajectories in the column trajectory, such as {example}; found none"
    )]
    NoTrajectory { file: String, example: String },
    #[error("{0}")]
    Import(#[source] Arc<ImportError>),
    #[error("{0}")]
    Prepare(#[source] Arc<PrepareError>),
    #[error("platoon {platoon} follower {follower}: long gaps split it into {segments} segments; cut a gap-free file")]
    Segments { platoon: String, follower: usize, segments: usize },
    #[error(transparent)]
    Case(#[from] CaseError),
}

/// Where the files of the rows are.
#[derive(Debug, Default)]
enum Place {
    Folder(PathBuf),
    /// This is the file of all rows.
    File(PathBuf),
    /// A folder; each row names its file.
    #[default]
    Named,
}

/// The drive that a row requests.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Wanted {
    pub(super) file: NamedFile,
    /// Of files with several trajectories.
    pub(super) trajectory: Option<String>,
    pub(super) follower: usize,
}

/// How a row names its file.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum NamedFile {
    /// By its stem.
    Platoon(String),
    /// By its path, as the table of a fleet does. As there, the longest segment is taken.
    Path(String),
}

/// The files and vehicles of the rows.
#[derive(Debug, Default)]
pub struct Library {
    place: Place,
    layout: DataLayout,
    columns: Option<ColumnMap>,
    preparation: Preparation,
    vehicles: Vec<Vehicle>,
    /// Changes to the data of each follower used so far, one line each.
    pub notes: Vec<String>,
    /// Faults of the data of each follower used so far, one line each.
    pub faults: Vec<String>,
    cases: HashMap<Wanted, Result<Case, LibraryError>>,
    /// The file read last, because rows of one file are usually adjacent.
    last: Option<(PathBuf, Recording)>,
    /// The files used so far, with checksums: data, and the parts of a vehicle that the variants needed.
    pub sources: Vec<Source>,
    /// Vehicles in use: by short name, and whether the MFC curve was needed.
    used: HashSet<(String, bool)>,
    /// Models that a table may name besides those that have a name everywhere, such as those with the user's own law, each with the upper
    /// bound of the delay of its extensions \[s\].
    pub models: HashMap<String, (Variant, Option<f64>)>,
    /// The car of every follower, instead of the one that is called as the follower is.
    pub vehicle: Option<Vehicle>,
    /// The treatment of the data of the calibration that made the rows; data that are treated otherwise get a warning.
    pub treatment: Option<Treatment>,
}

/// Largest number of printed warnings about rows.
const FAULTS: usize = 100;

impl Library {
    /// Opens a folder, whose files are to be prepared alike. Vehicles come from `vehicles/vehicles.csv` in or beside it, otherwise from the built-in
    /// table. Fails when there is no such folder or file, or a vehicle table exists but cannot be read.
    pub fn open(
        data: Option<&Path>,
        layout: DataLayout,
        columns: Option<ColumnMap>,
        preparation: Preparation,
    ) -> Result<Library, OpenError> {
        let (place, folder) = match data {
            None => (Place::Named, Path::new(".")),
            Some(path) if path.is_dir() => (Place::Folder(path.to_owned()), path),
            Some(path) if path.exists() => {
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
                (Place::File(path.to_owned()), folder.unwrap_or(Path::new(".")))
            }
            Some(path) => return Err(OpenError::Missing(path.display().to_string())),
        };
        let parent = folder.join("..");
        let table = [folder, &parent].iter().map(|f| f.join("vehicles").join("vehicles.csv")).find(|p| p.exists());
        let vehicles = table.as_deref().map_or_else(|| Ok(Vehicle::built_in()), read_table)?;
        Ok(Library { place, layout, columns, preparation, vehicles, ..Library::default() })
    }

    /// True if every row is simulated on the same file, so that none has to name it.
    pub(super) fn is_one_file(&self) -> bool {
        matches!(self.place, Place::File(_))
    }

    /// Adds the warning of a row once: tables have millions of rows.
    pub(super) fn doubt(&mut self, what: String) {
        if self.faults.len() < FAULTS && !self.faults.contains(&what) {
            self.faults.push(what);
        }
    }

    /// The case of a follower, for any variant (`Case::for_variant`).
    pub(super) fn case(&mut self, wanted: Wanted, settings: &Settings) -> Result<Case, LibraryError> {
        if let Some(known) = self.cases.get(&wanted) {
            return known.clone();
        }
        let case = self.read(&wanted, settings);
        self.cases.insert(wanted, case.clone());
        case
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

    /// The file of a row, and its layout if known.
    fn find(&self, file: &NamedFile) -> Result<(PathBuf, Option<Layout>), LibraryError> {
        let found = match (&self.place, file) {
            (Place::File(path), NamedFile::Platoon(stem)) if !stem.is_empty() && !is_called(path, stem) => {
                return Err(LibraryError::OtherFile { platoon: stem.clone(), file: path.display().to_string() });
            }
            (Place::File(path), _) => path.clone(),
            (Place::Named, NamedFile::Platoon(stem)) => return Err(LibraryError::NoFolder(stem.clone())),
            (Place::Named, NamedFile::Path(path)) => PathBuf::from(path),
            (Place::Folder(folder), NamedFile::Path(path)) => {
                folder.join(Path::new(path).file_name().unwrap_or_default())
            }
            (Place::Folder(folder), NamedFile::Platoon(stem)) => return self.platoon(folder, stem),
        };
        if found.is_file() { Ok((found, None)) } else { Err(LibraryError::NoFile(found.display().to_string())) }
    }

    /// The file of a platoon in a folder.
    fn platoon(&self, folder: &Path, stem: &str) -> Result<(PathBuf, Option<Layout>), LibraryError> {
        if stem.is_empty() || stem.contains(['/', '\\']) || stem.contains("..") {
            return Err(LibraryError::Name(stem.to_owned()));
        }
        let folders = [folder.to_owned(), folder.join(self.layout.folder())];
        let path = folders.iter().map(|f| f.join(format!("{stem}.csv"))).find(|p| p.exists());
        let Some(path) = path else {
            let searched = folders.iter().map(|f| f.display().to_string()).collect();
            return Err(LibraryError::NotFound { platoon: stem.to_owned(), searched });
        };
        // The given folder may have files of any layout; the AstaZero folders only theirs.
        let layout = path.starts_with(&folders[1]).then(|| self.layout.layout());
        Ok((path, layout))
    }

    fn recording(&mut self, path: &Path, layout: Option<Layout>) -> Result<&Recording, LibraryError> {
        if self.last.as_ref().is_none_or(|(read, _)| read != path) {
            let recording = match &self.columns {
                Some(map) => read_mapped(path, map),
                None => import::read(path, layout),
            };
            let recording = recording.map_err(|e| LibraryError::Import(Arc::new(e)))?;
            for source in std::iter::once(&recording.source).chain(&recording.companions) {
                if !self.sources.contains(source) {
                    self.sources.push(source.clone());
                }
            }
            self.last = Some((path.to_owned(), recording));
        }
        Ok(&self.last.as_ref().expect("read above at the latest").1)
    }

    fn read(&mut self, wanted: &Wanted, settings: &Settings) -> Result<Case, LibraryError> {
        let (path, layout) = self.find(&wanted.file)?;
        let mut preparation = self.preparation.clone();
        let recording = self.recording(&path, layout)?;
        let mut ids = recording.platoons.iter().filter_map(|platoon| platoon.id.as_deref());
        // A column of this name in the table has no meaning for files without ids.
        if let Some(example) = ids.next() {
            preparation.trajectory_id.clone_from(&wanted.trajectory);
            if wanted.trajectory.is_none() && ids.next().is_some() {
                let (file, example) = (recording.source.path.clone(), example.to_owned());
                return Err(LibraryError::NoTrajectory { file, example });
            }
        }
        let segments =
            prepare(recording, wanted.follower, &preparation).map_err(|e| LibraryError::Prepare(Arc::new(e)))?;
        if let (NamedFile::Platoon(platoon), true) = (&wanted.file, segments.len() > 1) {
            let (platoon, follower, segments) = (platoon.clone(), wanted.follower, segments.len());
            return Err(LibraryError::Segments { platoon, follower, segments });
        }
        let trajectory = &Trajectory::longest(segments);
        self.notes.extend(trajectory.preparation().map(|note| format!("{}: {note}", trajectory.label)));
        self.faults.extend(trajectory.faults().map(|fault| format!("{}: {fault}", trajectory.label)));
        let told = self.treatment.as_ref().and_then(|then| then.differs(&Treatment::of(trajectory)));
        told.into_iter().for_each(|told| self.doubt(format!("these parameters were {told}")));
        let by_name = || self.vehicles.iter().find(|v| v.is_called(&trajectory.name));
        let vehicle = self.vehicle.as_ref().or_else(by_name);
        let any = Variant::from_id(1).expect("variant 1 exists");
        Ok(Case::new(trajectory, any, vehicle, settings.convention, settings.tau_p_upper)?)
    }
}

/// Whether a file has this name without its ending.
fn is_called(path: &Path, stem: &str) -> bool {
    path.file_stem().is_some_and(|own| own == stem)
}
