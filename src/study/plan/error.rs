//! Plans that cannot be carried out.

use crate::text::spelling::suggestion;
use crate::wgsl::ShaderError;

/// A plan that cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    #[error("{path}: cannot read the plan")]
    Read { path: String, source: std::io::Error },
    #[error("{path}:{line}:{column}: {reason}{}", suggestion(nearest.as_deref()))]
    Toml { path: String, line: usize, column: usize, reason: String, nearest: Option<String> },
    #[error("{path}: {key}: {file}: cannot be read; its path is relative to the folder of the plan")]
    ExtensionFile { path: String, key: &'static str, file: String, source: std::io::Error },
    #[error("{path}: {key}")]
    Extension { path: String, key: &'static str, source: Box<ShaderError> },
    #[error("{path}: schema_version: expected {expected}, found {found}")]
    Version { path: String, expected: u32, found: u32 },
    #[error("{path}: {key}: {reason}{}", suggestion(nearest.as_deref()))]
    Value { path: String, key: String, reason: String, nearest: Option<String> },
}
