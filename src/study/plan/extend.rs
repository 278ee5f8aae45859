//! Extensions of a plan: built-in ones by name, files of one's own.

use super::super::merge::{calibration_columns, parameter_column};
use super::text::Reader;
use super::{Extend, PlanError};
use crate::catalog::Variant;
use crate::extension::Extension;
use crate::near::nearest;
use crate::wgsl::{ShaderError, extension_named, library, read_extension};
use serde::{Deserialize, Serialize};
use std::path::Path;

const KEY: &str = "calibration.extend";

/// An extension as the files of a study keep it, so that they need no other file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredExtension {
    /// As the plan gives it.
    pub given: String,
    /// Its name.
    pub name: String,
    /// The whole text of a user's own; none for a built-in one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

impl StoredExtension {
    /// What is kept of an extension.
    #[must_use]
    pub fn of(extend: &Extend) -> StoredExtension {
        let Extend { given, extension } = extend;
        let is_own = extension_named(&extension.name).is_none();
        let (given, name) = (given.clone(), extension.name.clone());
        StoredExtension { given, name, text: is_own.then(|| extension.text.clone()) }
    }

    /// The extension; `None` for a built-in one that this program does not have.
    ///
    /// # Errors
    /// When this program does not accept its text.
    pub fn read(&self) -> Result<Option<&'static Extension>, ShaderError> {
        match &self.text {
            Some(text) => read_extension(&format!("{}.wgsl", self.name), text).map(Some),
            None => Ok(extension_named(&self.name)),
        }
    }
}

impl Reader<'_> {
    pub(super) fn extensions(&self, entries: Vec<String>) -> Result<Vec<Extend>, PlanError> {
        let read = |given: String| {
            let extension = self.extension(&given)?;
            // Names of variants would no longer say what a variant is made of.
            if format!("idm+{}", extension.name).parse::<Variant>().is_ok() {
                let reason =
                    format!("{} is a part of the paper's variants; give the file another name", extension.name);
                return Err(self.value(KEY, reason, None));
            }
            let column = extension.parameters.iter().map(|symbol| parameter_column(*symbol));
            if let Some(twice) = column.into_iter().find(|name| calibration_columns().any(|other| other == *name)) {
                let reason = format!(
                    "a parameter of {} would be the column {twice}, which the tables of a study have already; give it another name",
                    extension.name
                );
                return Err(self.value(KEY, reason, None));
            }
            Ok(Extend { given, extension })
        };
        entries.into_iter().map(read).collect()
    }

    fn extension(&self, given: &str) -> Result<&'static Extension, PlanError> {
        let shader = |source| PlanError::Extension { path: self.path.to_owned(), source: Box::new(source) };
        let stored = self.stored.iter().find(|stored| stored.given == given);
        if let Some(extension) = stored.map(StoredExtension::read).transpose().map_err(shader)?.flatten() {
            return Ok(extension);
        }
        if Path::new(given).extension().is_none_or(|ending| ending != "wgsl") {
            let names = library().iter().filter(|e| e.cause.is_some()).map(|e| e.name.as_str());
            let reason = format!(
                "expected a built-in extension (`leadlag list causes`) or a file that ends in .wgsl, found `{given}`"
            );
            return extension_named(given).ok_or_else(|| self.value(KEY, reason, nearest(given, names)));
        }
        let file = self.folder.join(given);
        let shown = file.display().to_string();
        let text = crate::bounded::read_to_string(&file, crate::bounded::TEXT_MAX)
            .map_err(|source| PlanError::ExtensionFile { path: self.path.to_owned(), file: shown.clone(), source })?;
        read_extension(&shown, &text).map_err(shader)
    }

    /// The variants, each with all extensions.
    pub(super) fn extended(&self, variants: Vec<Variant>, extend: &[Extend]) -> Result<Vec<Variant>, PlanError> {
        let all = |variant: Variant| {
            let with = |variant: Variant, one: &Extend| variant.with(one.extension);
            extend.iter().try_fold(variant, with).map_err(|conflict| self.value(KEY, conflict, None))
        };
        variants.into_iter().map(all).collect()
    }
}
