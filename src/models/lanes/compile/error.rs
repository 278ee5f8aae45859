//! Reasons to refuse a text.

use crate::wgsl::{ShaderError, Source};
use naga::Span;

/// A text that cannot become a block program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum LanesError {
    #[error(transparent)]
    Shader(#[from] ShaderError),
    #[error(
        "{file}:{line}:{column}: {construct} cannot run on the CPU; parts use f32, bool, structs, let, var, if without \
         return, calls, select, arithmetic, comparisons, power exponential logarithm, and min max clamp abs sqrt sin cos floor\n  {code}"
    )]
    Unsupported { file: String, line: usize, column: usize, construct: String, code: String },
    #[error(
        "the model has {operations} operations with calls inlined, and the CPU allows at most {most}; use fewer extensions, \
         or shorter ones"
    )]
    TooLarge { operations: usize, most: usize },
    #[error("function `{name}` is missing; the text has {}", if found.is_empty() { "none".to_owned() } else { found.join(", ") })]
    Missing { name: String, found: Vec<String> },
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
