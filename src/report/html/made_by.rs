//! The command that made a result, and its warnings.

use super::escape;
use serde::{Deserialize, Serialize};

/// Content of `run.json`: properties of the run, which are therefore separate from the result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MadeBy {
    /// Version of the file.
    pub schema_version: u32,
    /// The command, quoted for a shell.
    pub command: String,
    /// Its warnings, in that order.
    pub warnings: Vec<String>,
}

/// Version of `run.json`.
pub const RUN_VERSION: u32 = 1;

impl MadeBy {
    /// The warnings, for the top of a page.
    pub(super) fn warnings(&self) -> String {
        if self.warnings.is_empty() {
            return String::new();
        }
        let items: String = self.warnings.iter().map(|text| format!("<li>{}</li>", escape(text))).collect();
        format!("<div class=\"verdict bad_base\"><strong>Warnings of the command</strong><ul>{items}</ul></div>")
    }

    /// The command, for its end.
    pub(super) fn command(&self) -> String {
        format!("<p>The command: <code>{}</code></p>", escape(&self.command))
    }
}
