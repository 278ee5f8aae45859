//! The plan: data x variants x goodness-of-fit functions x replicates x validation, as a TOML file (`docs/STUDY.md`).

mod error;
mod extend;
mod several;
mod text;

pub use error::PlanError;
pub use extend::StoredExtension;

use crate::calibrate::{OptimizerKind, Overrides, Stop};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::extension::Extension;
use crate::lanes::LanesPrecision;
use crate::score::GoodnessOfFit;
use crate::select::Kind;
use crate::trajectory::Layout;
use std::path::{Path, PathBuf};

/// Version of the layout of a plan file.
pub const PLAN_VERSION: u32 = 1;

/// A study as its plan describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Name of the study.
    pub name: String,
    /// The measured data.
    pub data: DataPlan,
    /// Settings of the calibrations.
    pub calibration: CalibrationPlan,
    /// Drives of the validation.
    pub validation: Validation,
}

/// The measured data of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct DataPlan {
    /// Folder to which the names of files are relative.
    pub folder: PathBuf,
    /// Vehicle table in that folder; `None`: the built-in one.
    pub vehicles: Option<PathBuf>,
    /// The platoons, in the order of all tables.
    pub platoons: Vec<PlatoonPlan>,
}

/// One measured file of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatoonPlan {
    /// Short name in all tables, such as `P3`.
    pub name: String,
    /// The file; with `is_pattern` a `*` in its name matches anything.
    pub file: PathBuf,
    /// True for a pattern that matches several files.
    pub is_pattern: bool,
    /// Its layout; `None`: by its header.
    pub layout: Option<Layout>,
    /// Column map of a table of another layout: a built-in one, or a `.toml` in the data folder.
    pub columns: Option<String>,
    /// Id of the requested trajectory in a file that holds several; `None`: the only one.
    pub trajectory: Option<String>,
    /// True for every trajectory of the file; unusable ones are left out.
    pub all: bool,
    /// The followers, 1 = right behind the platoon leader; `None`: all.
    pub followers: Option<Vec<usize>>,
    /// Smooth as the paper's authors did.
    pub smooth: bool,
    /// First time that is used \[s\].
    pub from: Option<f64>,
    /// Last time that is used \[s\].
    pub to: Option<f64>,
    /// Grade table, or `level`; `None`: the one beside the file, if any.
    pub grade: Option<String>,
    /// Position of the platoon leader on the grade table at the first row \[m\].
    pub leader_start: Option<f64>,
    /// Name of the followers' vehicle, for files that give none.
    pub vehicle: Option<String>,
}

/// Settings of the calibrations.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationPlan {
    /// The variants, in the order of the plan, with their extensions.
    pub variants: Vec<Variant>,
    /// Extensions of every variant.
    pub extend: Vec<Extend>,
    /// The laws among the base models.
    pub laws: Vec<Extend>,
    /// Measures to minimise, one study each.
    pub gofs: Vec<GoodnessOfFit>,
    pub convention: Convention,
    /// Calibrations per trajectory, variant and goodness of fit.
    pub replicates: u64,
    pub seed: u64,
    pub optimizer: OptimizerKind,
    /// Stopping rules; never a time, so that results do not depend on the machine.
    pub stop: Stop,
    /// Bounds that replace those of Table 3 if a variant has the parameter.
    pub bounds: Overrides,
    /// Which evaluator simulates the candidates.
    pub evaluator: Kind,
    /// Its precision; `None`: plain.
    pub precision: Option<LanesPrecision>,
}

/// An extension of every variant of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Extend {
    /// The name of a built-in one, or the file, as the plan gives it.
    pub given: String,
    pub extension: &'static Extension,
}

/// Drives on which the calibrated variants are validated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Validation {
    /// Nothing.
    None,
    /// The trajectories of the same vehicle in the other platoons of the plan, as in the paper.
    #[default]
    SameVehicle,
}

impl Plan {
    /// Reads a plan; names of files are relative to the folder that the plan names, itself relative to the plan file.
    pub fn read(path: &Path) -> Result<Plan, PlanError> {
        Plan::read_with(path, &[])
    }

    /// [`Plan::read`] for a plan whose extensions are known, wherever their files are.
    pub(super) fn read_with(path: &Path, stored: &[StoredExtension]) -> Result<Plan, PlanError> {
        let shown = path.display().to_string();
        let content = crate::text::bounded::read_to_string(path, crate::text::bounded::TEXT_MAX)
            .map_err(|source| PlanError::Read { path: shown.clone(), source })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        text::read(&content, &shown, folder, &stem, stored)
    }

    /// Parses a plan. `path` is for messages; `folder` is where relative names start, `name` the default name of the study.
    pub fn parse(content: &str, path: &str, folder: &Path, name: &str) -> Result<Plan, PlanError> {
        text::read(content, path, folder, name, &[])
    }
}

/// Bounds of the plan that concern a variant.
pub fn overrides_for(variant: &Variant, bounds: &Overrides) -> Overrides {
    let symbols = variant.parameters();
    let has = |name: &str| symbols.iter().any(|symbol| symbol.name() == name);
    bounds.iter().filter(|(name, _)| has(name)).map(|(name, pair)| (name.clone(), *pair)).collect()
}
