//! Plans that cannot be carried out.

use crate::text::spelling::suggestion;
use crate::wgsl::ShaderError;

/// A plan that cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// It cannot be read.
    #[error("{path}: cannot read the plan")]
    Read {
        /// The file.
        path: String,
        /// The cause of the error.
        source: std::io::Error,
    },
    /// Invalid TOML, or not a plan.
    #[error("{path}:{line}:{column}: {reason}{}", suggestion(nearest.as_deref()))]
    Toml {
        /// The file.
        path: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Message of the reader.
        reason: String,
        /// A known key that looks like the unknown one.
        nearest: Option<String>,
    },
    /// The file of an extension or a law cannot be read.
    #[error("{path}: {key}: {file}: cannot be read; its path is relative to the folder of the plan")]
    ExtensionFile {
        /// The plan.
        path: String,
        /// The key.
        key: &'static str,
        /// The file of the extension.
        file: String,
        /// The cause of the error.
        source: std::io::Error,
    },
    /// The text of an extension or a law is not valid.
    #[error("{path}: {key}")]
    Extension {
        /// The plan.
        path: String,
        /// The key.
        key: &'static str,
        /// The fault and its place.
        source: Box<ShaderError>,
    },
    /// A version of the layout that this program does not know.
    #[error("{path}: schema_version: expected {expected}, found {found}")]
    Version {
        /// The file.
        path: String,
        /// Version that this program reads.
        expected: u32,
        /// Version of the plan.
        found: u32,
    },
    /// An invalid value.
    #[error("{path}: {key}: {reason}{}", suggestion(nearest.as_deref()))]
    Value {
        /// The file.
        path: String,
        /// The key.
        key: String,
        /// Expected and found content.
        reason: String,
        /// A known word that looks like the unknown one.
        nearest: Option<String>,
    },
}
