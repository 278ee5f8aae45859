//! Extensions and laws of a plan: built-in ones by name, users' files.

use super::super::merge::{calibration_columns, column_clash};
use super::text::{Reader, VARIANTS};
use super::{Extend, PlanError};
use crate::catalog::Variant;
use crate::extension::Extension;
use crate::symbols::Symbol;
use crate::text::spelling::nearest;
use crate::wgsl::{ShaderError, extension_named, law_file, law_with, library, read_extension};
use serde::{Deserialize, Serialize};
use std::path::Path;

const EXTEND: &str = "calibration.extend";

/// An extension as stored in the files of a study, which need no other file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredExtension {
    /// As the plan gives it.
    pub given: String,
    pub name: String,
    /// The whole text of a user's own; none for a built-in one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
}

impl StoredExtension {
    /// Stored data of an extension.
    pub fn of(extend: &Extend) -> StoredExtension {
        let Extend { given, extension } = extend;
        let is_own = extension_named(&extension.name).is_none();
        let (given, name) = (given.clone(), extension.name.clone());
        StoredExtension { given, name, text: is_own.then(|| extension.text.clone()) }
    }

    /// The extension; `None` for a built-in one that this program lacks. Fails when this program does not accept its text.
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
            let extension = self.extension(EXTEND, &given)?;
            self.has_own_name(EXTEND, extension)?;
            Ok(Extend { given, extension })
        };
        entries.into_iter().map(read).collect()
    }

    /// A variant whose base model may be a file with a law, which is added to `laws`.
    pub(super) fn variant(&self, name: &str, laws: &mut Vec<Extend>) -> Result<Variant, PlanError> {
        let mut given = name;
        let variant = if let Some((file, parts)) = law_file(name) {
            given = file;
            let law = self.extension(VARIANTS, file)?;
            if !law.is_law() {
                let reason = format!("{file} is an extension, not a law: give it as calibration.extend");
                return Err(self.value(VARIANTS, reason, None));
            }
            law_with(law, parts).map_err(|e| self.value(VARIANTS, e, None))?
        } else {
            self.parse(VARIANTS, name, &[])?
        };
        if let Some(law) = variant.law().filter(|law| !laws.iter().any(|known| known.extension == *law)) {
            self.has_own_name(VARIANTS, law)?;
            for other in laws.iter().map(|known| known.extension) {
                Self::go_together(law, other).map_err(|reason| self.value(VARIANTS, reason, None))?;
            }
            laws.push(Extend { given: given.to_owned(), extension: law });
        }
        Ok(variant)
    }

    /// Two laws of one study: their names distinguish them, and parameters of the same name share a column.
    fn go_together(law: &Extension, other: &Extension) -> Result<(), String> {
        if law.name == other.name {
            return Err(format!("two laws have the name {}; rename one of the files", law.name));
        }
        let clash =
            |one: Symbol| other.own_parameters().find(|two| two.name() == one.name() && two.unit() != one.unit());
        match law.own_parameters().find_map(|one| Some((one, clash(one)?))) {
            None => Ok(()),
            Some((one, two)) => Err(format!(
                "{} is in {} in {} and in {} in {}, and both would be one column of the tables; give one another name",
                one.name(),
                one.unit(),
                law.name,
                two.unit(),
                other.name
            )),
        }
    }

    /// Refuses the name of a part: names of variants would be ambiguous.
    fn has_own_name(&self, key: &'static str, extension: &Extension) -> Result<(), PlanError> {
        let name = &extension.name;
        if format!("idm+{name}").parse::<Variant>().is_ok() {
            let reason = format!("{name} is a part of the paper's variants; give the file another name");
            return Err(self.value(key, reason, None));
        }
        Ok(())
    }

    /// Refuses parameters whose column belongs to another value of the tables.
    pub(super) fn have_own_columns(&self, laws: &[Extend], extend: &[Extend]) -> Result<(), PlanError> {
        let taken: Vec<String> = calibration_columns().collect();
        let columns = |all: &[Extend]| -> Vec<(Symbol, String)> {
            let own = all.iter().flat_map(|one| one.extension.own_parameters());
            own.map(|symbol| (symbol, symbol.column())).collect()
        };
        let of_laws = columns(laws);
        for (key, columns) in [(VARIANTS, of_laws.clone()), (EXTEND, [of_laws, columns(extend)].concat())] {
            if let Some(reason) = column_clash(&taken, &columns) {
                return Err(self.value(key, reason, None));
            }
        }
        Ok(())
    }

    fn extension(&self, key: &'static str, given: &str) -> Result<&'static Extension, PlanError> {
        let shader = |source| PlanError::Extension { path: self.path.to_owned(), key, source: Box::new(source) };
        let stored = self.stored.iter().find(|stored| stored.given == given);
        if let Some(extension) = stored.map(StoredExtension::read).transpose().map_err(shader)?.flatten() {
            return Ok(extension);
        }
        if Path::new(given).extension().is_none_or(|ending| ending != "wgsl") {
            let names = library().iter().filter(|e| e.cause.is_some()).map(|e| e.name.as_str());
            let reason = format!(
                "expected a built-in extension (`leadlag list causes`) or a file that ends in .wgsl, found `{given}`"
            );
            return extension_named(given).ok_or_else(|| self.value(key, reason, nearest(given, names)));
        }
        let file = self.folder.join(given);
        let shown = file.display().to_string();
        let text = crate::text::bounded::read_to_string(&file, crate::text::bounded::TEXT_MAX).map_err(|source| {
            PlanError::ExtensionFile { path: self.path.to_owned(), key, file: shown.clone(), source }
        })?;
        read_extension(&shown, &text).map_err(shader)
    }

    /// The variants, each with all extensions.
    pub(super) fn extended(&self, variants: Vec<Variant>, extend: &[Extend]) -> Result<Vec<Variant>, PlanError> {
        let all = |variant: Variant| {
            let with = |variant: Variant, one: &Extend| variant.with(one.extension);
            extend.iter().try_fold(variant, with).map_err(|conflict| self.value(EXTEND, conflict, None))
        };
        variants.into_iter().map(all).collect()
    }
}
