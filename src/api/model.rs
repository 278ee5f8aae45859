//! Models: the ninety variants, laws, and their extensions.

use super::calibration::Calibration;
use super::diagnosis::Diagnosis;
use super::error::{Error, Usage, refuse, usage};
use super::extension::extend;
use crate::catalog;
#[cfg(feature = "cli")]
use crate::catalog::UnknownVariant;
use crate::extension::Extension;
use crate::reference::knows;
use crate::select::Kind;
use crate::text::bounded::{TEXT_MAX, read_to_string};
#[cfg(feature = "cli")]
use crate::wgsl::law_file;
use crate::wgsl::{ModelError, extension_named, law_with, laws, read_extension, read_law, read_model};
use anyhow::Context;
use std::fmt;
use std::path::Path;

/// A model: a base, with or without perception delay, vehicle dynamics, an acceleration constraint and extensions.
///
/// ```
/// let model = leadlag::Variant::named("gipps+delay+linear+mfc")?.extend("leader_accel_ff")?;
/// assert_eq!((model.id(), model.parameters().len()), (Some(33), 10));
/// # Ok::<(), leadlag::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant(pub(crate) catalog::Variant);

/// A model by its id, its name or the file of a law. An unknown name is an invalid request; a file that is unreadable or faulty
/// is an error of the file.
pub(crate) fn model(asked: &str) -> anyhow::Result<catalog::Variant> {
    read_model(asked).map_err(|error| match error {
        ModelError::Unknown(_) | ModelError::NoLaw { .. } => Usage(error.to_string()).into(),
        ModelError::File { .. } | ModelError::Shader(_) => error.into(),
    })
}

/// Refuses unknown names of models; files are read when needed.
#[cfg(feature = "cli")]
pub(crate) fn known(asked: &str) -> Result<String, UnknownVariant> {
    if law_file(asked).is_none() {
        asked.parse::<catalog::Variant>()?;
    }
    Ok(asked.to_owned())
}

impl Variant {
    /// A model by name or id, `idm`, `gipps+delay+linear+mfc`, `31`, or by the file of a law: `my_law.wgsl+delay`.
    ///
    /// # Errors
    /// For an unknown model, or a faulty text of a law.
    pub fn named(model: &str) -> Result<Variant, Error> {
        Ok(Variant(self::model(model)?))
    }

    /// The ninety of the paper's Table 1, in its order.
    pub fn all() -> impl Iterator<Item = Variant> {
        catalog::Variant::all().map(Variant)
    }

    /// The same with an extension: the name of a built-in cause, such as `actuation_lag`, or your own WGSL file.
    ///
    /// # Errors
    /// For an unknown name, a faulty text, or an extension that the model has already.
    pub fn extend(self, extension: &str) -> Result<Variant, Error> {
        Ok(Variant(extend(self.0, &[extension.to_owned()])?))
    }

    /// The same with your own extension by its WGSL text; `name` is what its functions begin with.
    ///
    /// # Errors
    /// When the text is faulty, or the model has the extension already.
    pub fn extend_text(self, name: &str, text: &str) -> Result<Variant, Error> {
        let own = read_extension(&format!("{name}.wgsl"), text).map_err(anyhow::Error::from)?;
        self.0.with(own).map(Variant).map_err(usage)
    }

    /// A calibration of it, with all settings at their defaults.
    #[must_use]
    pub fn calibration(self) -> Calibration {
        Calibration::of_variant(self.0)
    }

    /// A diagnosis of this model, with all settings at their defaults.
    #[must_use]
    pub fn diagnosis(self) -> Diagnosis {
        Diagnosis::of_variant(self.0)
    }

    /// Its id in Table 1; `None` for a law.
    #[must_use]
    pub fn id(&self) -> Option<u32> {
        Some(self.0.id()).filter(|id| *id > 0)
    }

    /// Its name, such as `gipps+delay+linear+mfc`; extensions come last.
    #[must_use]
    pub fn name(&self) -> String {
        self.0.name()
    }

    /// The names of its parameters, in the order of all tables.
    #[must_use]
    pub fn parameters(&self) -> Vec<&'static str> {
        self.0.parameters().into_iter().map(crate::symbols::Symbol::name).collect()
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A law: a base model that is none of the paper's, built in or in your own WGSL file.
///
/// ```
/// let text = "
/// struct Parameters {
///     v_0: f32,
///     /// gain for the speed [1/s], 0.05 to 2
///     gain: f32,
/// }
/// fn cruise_law(own: Parameters, x: Perceived) -> f32 {
///     return own.gain * (own.v_0 - x.v_f);
/// }";
/// let model = leadlag::Law::from_text("cruise", text)?.with("+delay")?;
/// assert_eq!(model.parameters(), ["v_0", "tau_p", "gain"]);
/// # Ok::<(), leadlag::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Law(&'static Extension);

impl Law {
    /// The laws that are built in.
    pub fn built_in() -> impl Iterator<Item = Law> {
        laws().iter().copied().map(Law)
    }

    /// Reads a file; its name without `.wgsl` is the law's and the prefix of its functions.
    ///
    /// # Errors
    /// For an unreadable or faulty file, or one that is not a law.
    pub fn read(file: impl AsRef<Path>) -> Result<Law, Error> {
        let shown = file.as_ref().display().to_string();
        let text = read_to_string(file.as_ref(), TEXT_MAX).with_context(|| format!("{shown}: cannot be read"))?;
        read_law(&shown, &text).map(Law).map_err(usage)
    }

    /// A law by its WGSL text; `name` is what its functions begin with.
    ///
    /// # Errors
    /// For a faulty text, or one that is not a law.
    pub fn from_text(name: &str, text: &str) -> Result<Law, Error> {
        read_law(&format!("{name}.wgsl"), text).map(Law).map_err(usage)
    }

    /// The same model with other parts, such as `+delay+linear`, or with none: "".
    ///
    /// # Errors
    /// For an unknown part.
    pub fn with(&self, parts: &str) -> Result<Variant, Error> {
        law_with(self.0, parts).map(Variant).map_err(usage)
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        &self.0.name
    }

    /// The effect in words.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
        &self.0.meaning
    }

    /// The source, if the text names one.
    #[must_use]
    pub fn reference(&self) -> Option<&'static str> {
        self.0.reference.as_deref()
    }

    /// Its text.
    #[must_use]
    pub fn text(&self) -> &'static str {
        &self.0.text
    }
}

/// In the plan of a study, an evaluator, and one that can replace the reference.
pub(crate) const BY_PLAN: [&str; 2] = ["evaluator = \"reference\"", "evaluator = \"lanes\" and precision = \"f64\""];

/// Refuses the reference for a variant with a user's extension, of which it has no transcription.
pub(crate) fn transcribed(kind: Kind, variant: &catalog::Variant, [asked, instead]: [&str; 2]) -> anyhow::Result<()> {
    if kind != Kind::Reference || knows(variant) {
        return Ok(());
    }
    let own = variant.extensions.list().iter().filter(|e| extension_named(&e.name).is_none());
    let files: Vec<&str> = own.map(|e| e.file.as_str()).collect();
    let (is, files) = (if files.len() == 1 { "is" } else { "are" }, files.join(", "));
    refuse!("`{asked}` knows the built-in causes only; {files} {is} your own: use `{instead}`");
}
