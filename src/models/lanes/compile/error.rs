//! Reasons to refuse a text.

use crate::wgsl::{ShaderError, Source};
use naga::Span;

/// A text that cannot become a block program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LanesError {
    /// Not WGSL at all.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// Valid WGSL, but more than parts may use.
    #[error(
        "{file}:{line}:{column}: {construct} cannot run on the CPU; parts use f32, bool, structs, let, var, if without \
         return, calls, select, arithmetic, comparisons, power exponential logarithm, and min max clamp abs sqrt sin cos floor\n  {code}"
    )]
    Unsupported {
        /// The file as composed.
        file: String,
        /// Line in that file, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The construct.
        construct: String,
        /// The line as written.
        code: String,
    },
    /// More operations than rows.
    #[error(
        "the model has {operations} operations with calls inlined, and the CPU allows at most {most}; use fewer extensions, \
         or shorter ones"
    )]
    TooLarge {
        /// Operations of a step and of a start.
        operations: usize,
        /// Most of them.
        most: usize,
    },
    /// A function that the time loop needs is missing.
    #[error("function `{name}` is missing; the text has {}", if found.is_empty() { "none".to_owned() } else { found.join(", ") })]
    Missing {
        /// Its name.
        name: String,
        /// The functions there are.
        found: Vec<String>,
    },
}

impl LanesError {
    pub(super) fn unsupported(source: &Source, span: Span, construct: impl Into<String>) -> LanesError {
        let place = span.location(source.text());
        let (line_of_text, column) = (place.line_number as usize, place.line_position as usize);
        let (file, line, column) = source.written(line_of_text, column);
        let code = source.shown(line_of_text);
        let construct = source.in_words(construct.into());
        LanesError::Unsupported { file: file.to_owned(), line, column, construct, code }
    }
}
