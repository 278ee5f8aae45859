//! Reads `result.json`, in bounded memory, and checks that its parts fit together.

use super::{CorrelationEntry, ResultFile, SCHEMA_VERSION};
use crate::catalog::UnknownVariant;
use crate::convention::ConventionError;
use crate::extension::ExtensionConflict;
use crate::simulate::CalibratedVariant;
use crate::text::bounded::{self, RESULT_MAX};
use crate::wgsl::ShaderError;
use serde::Deserialize;

/// A result file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum ResultFileError {
    #[error("{path}: cannot read the result file")]
    Read { path: String, source: std::io::Error },
    #[error("{path}: expected a result.json of `leadlag calibrate`")]
    Json { path: String, source: serde_json::Error },
    #[error("{path}: schema_version {found}; this program reads version {SCHEMA_VERSION}")]
    Version { path: String, found: u64 },
    #[error("{path}: the content does not fit together, so the file was changed or damaged; calibrate again")]
    Content { path: String, source: ContentError },
}

/// A file of any version.
#[derive(Deserialize)]
struct Versioned {
    schema_version: Option<u64>,
}

/// The text of a file from `calibrate` or `diagnose`; reads no more than such a file can have.
///
/// # Errors
/// [`ResultFileError::Read`].
pub fn read_bounded(path: &std::path::Path) -> Result<String, ResultFileError> {
    let failed = |source| ResultFileError::Read { path: path.display().to_string(), source };
    bounded::read_to_string(path, RESULT_MAX).map_err(failed)
}

impl ResultFile {
    /// Reads a result file.
    ///
    /// # Errors [`ResultFileError`] if it cannot be read, has another version, or contradicts itself.
    pub fn read(path: &std::path::Path) -> Result<ResultFile, ResultFileError> {
        let shown = path.display().to_string();
        let text = read_bounded(path)?;
        let json = |source| ResultFileError::Json { path: shown.clone(), source };
        // Without a tree of all values, which would take many times the memory of the text.
        let Versioned { schema_version } = serde_json::from_str(&text).map_err(json)?;
        match schema_version {
            Some(version) if version != u64::from(SCHEMA_VERSION) => {
                Err(ResultFileError::Version { path: shown, found: version })
            }
            _ => {
                let result: ResultFile = serde_json::from_str(&text).map_err(json)?;
                result.check().map_err(|source| ResultFileError::Content { path: shown.clone(), source })?;
                Ok(result)
            }
        }
    }

    /// Repeated entries must agree: the variant by name and by id, parameters by their names, with their units.
    fn check(&self) -> Result<(), ContentError> {
        let CalibratedVariant { variant, .. } = self.calibrated_variant()?;
        if variant.id() != self.model_id {
            let (name, expected) = (self.variant.clone(), variant.id());
            return Err(ContentError::ModelId { name, expected, found: self.model_id });
        }
        if let Some(law) = self.law.as_ref().filter(|law| variant.law().is_none_or(|own| own.name != law.name)) {
            return Err(ContentError::Law { name: law.name.clone(), variant: self.variant.clone() });
        }
        let symbols = variant.parameters();
        let lists: [(&'static str, Vec<&String>); 3] = [
            ("parameters", self.parameters.keys().collect()),
            ("units", self.units.keys().collect()),
            ("bounds", self.bounds.keys().collect()),
        ];
        for (list, found) in lists {
            let foreign = found.iter().find(|name| !symbols.iter().any(|symbol| symbol.name() == **name));
            let missing = symbols.iter().find(|symbol| !found.iter().any(|name| *name == symbol.name()));
            match (foreign, missing) {
                (Some(name), _) => {
                    let variant = self.model();
                    return Err(ContentError::Foreign { list, name: (*name).clone(), variant });
                }
                (None, Some(symbol)) => return Err(ContentError::Missing { list, name: symbol.name() }),
                (None, None) => {}
            }
        }
        let known = self.identifiability.as_ref();
        let correlation = known.and_then(|known| known.correlation.as_ref());
        let some: [(&'static str, Vec<&String>); 5] = [
            ("at_bound", self.at_bound.iter().collect()),
            ("intervals", self.intervals.keys().collect()),
            ("identifiability.parameters", known.map_or(Vec::new(), |known| known.parameters.keys().collect())),
            (
                "identifiability.replicate_range",
                known.map_or(Vec::new(), |known| known.replicate_range.keys().collect()),
            ),
            (
                "identifiability.correlation.parameters",
                correlation.map_or(Vec::new(), |c| c.parameters.iter().collect()),
            ),
        ];
        for (list, found) in some {
            if let Some(name) = found.into_iter().find(|name| !symbols.iter().any(|symbol| symbol.name() == **name)) {
                return Err(ContentError::Foreign { list, name: name.clone(), variant: self.model() });
            }
        }
        if let Some(CorrelationEntry { parameters, matrix, .. }) = correlation {
            let expected = parameters.len();
            if matrix.len() != expected || matrix.iter().any(|row| row.len() != expected) {
                return Err(ContentError::Matrix { expected });
            }
        }
        for symbol in symbols {
            let (name, domain) = (symbol.name(), symbol.domain());
            let found = &self.units[name];
            if found != symbol.unit() {
                return Err(ContentError::Unit { name, expected: symbol.unit(), found: found.clone() });
            }
            let found = self.parameters[name];
            if !domain.contains(found) {
                return Err(ContentError::Domain { name, expected: domain.expected(), found });
            }
        }
        for (list, intervals) in [("bounds", &self.bounds), ("intervals", &self.intervals)] {
            if let Some((name, [lower, upper])) = intervals.iter().find(|(_, [lower, upper])| lower > upper) {
                return Err(ContentError::Reversed { list, name: name.clone(), lower: *lower, upper: *upper });
            }
        }
        Ok(())
    }
}

/// A result file whose content does not fit together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum ContentError {
    #[error(transparent)]
    Variant(#[from] UnknownVariant),
    #[error(transparent)]
    Convention(#[from] ConventionError),
    #[error("extension {0}: no built-in extension has this name, and the file does not contain its text")]
    Extension(String),
    #[error(transparent)]
    Shader(#[from] ShaderError),
    #[error(transparent)]
    Conflict(#[from] ExtensionConflict),
    #[error("parameter {0} is missing")]
    Parameter(&'static str),
    #[error("model_id: expected {expected}, the id of variant {name}, found {found}")]
    ModelId { name: String, expected: u32, found: u32 },
    #[error("{list}: found {name}, which variant {variant} does not have")]
    Foreign { list: &'static str, name: String, variant: String },
    #[error("{list}: {name} is missing")]
    Missing { list: &'static str, name: &'static str },
    #[error("law: found {name}, which is not the base of variant {variant}")]
    Law { name: String, variant: String },
    #[error("parameters: {name}: expected {expected}, found {found:?}")]
    Domain { name: &'static str, expected: String, found: f64 },
    #[error("{list}: {name}: expected a lower and an upper end, found [{lower}, {upper}]")]
    Reversed { list: &'static str, name: String, lower: f64, upper: f64 },
    #[error(
        "identifiability.correlation.matrix: expected {expected} rows of {expected} numbers, one for each of its parameters"
    )]
    Matrix { expected: usize },
    #[error("units: expected {name} in {expected}, found {found}")]
    Unit { name: &'static str, expected: &'static str, found: String },
}
