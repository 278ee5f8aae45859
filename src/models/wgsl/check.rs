//! Parsing and validation by naga, with errors that point into the user's file.

use super::compose::Source;
use super::limits;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Module, WithSpan};

/// A text that naga has parsed and validated.
#[derive(Debug, Clone)]
pub struct Checked {
    /// naga's intermediate representation.
    pub module: Module,
    /// Result of its validation.
    pub info: ModuleInfo,
}

/// A text that is not valid WGSL.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}:{column}: {message}{}", if code.is_empty() { String::new() } else { format!("\n  {code}") })]
pub struct ShaderError {
    /// The file as composed.
    pub file: String,
    /// Line in that file, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// The fault, causes included.
    pub message: String,
    /// The line as written.
    pub code: String,
}

/// Parses and validates.
pub fn check(source: &Source) -> Result<Checked, ShaderError> {
    let text = source.text();
    let mut options = naga::front::wgsl::Options::new();
    options.parse_doc_comments = true;
    let module = naga::front::wgsl::Frontend::new_with_options(options).parse(text).map_err(|e| {
        let place = e.location(text).map(|l| (l.line_number as usize, l.line_position as usize));
        // naga's labels have its finding and the place; its message often has only the expectation.
        let empty = ["", "see msg", "unknown identifier", "invalid accessor"];
        let says_more = |label: &&str| !empty.contains(label) && !e.message().contains(*label);
        let labels: Vec<&str> = e.labels().map(|(_, label)| label).filter(says_more).collect();
        // Without a place, naga gives only notes.
        let notes: Vec<&str> = e.notes().filter(|_| place.is_none()).collect();
        let message = match (labels.as_slice(), notes.as_slice()) {
            ([], []) => e.message().to_owned(),
            ([], notes) => format!("{}: {}", e.message(), notes.join("; ")),
            (labels, _) => format!("{} ({})", e.message(), labels.join("; ")),
        };
        match other_precision(source, &message) {
            Some((place, message)) => at(source, Some(place), message),
            None => at(source, place, no_such_parameter(source, place, &message).unwrap_or(message)),
        }
    })?;
    let info =
        Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).map_err(|e: WithSpan<_>| {
            // The function and, if known, the expression in it: the shortest span is the closest to the mistake.
            let spans = e.spans().filter_map(|(span, _)| span.to_range().map(|range| (range.len(), span)));
            let place = spans.min_by_key(|(length, _)| *length).map(|(_, span)| {
                let location = span.location(text);
                (location.line_number as usize, location.line_position as usize)
            });
            let mut message = e.as_inner().to_string();
            let mut cause = std::error::Error::source(e.as_inner());
            while let Some(inner) = cause {
                message = format!("{message}: {inner}");
                cause = inner.source();
            }
            match other_precision(source, &message) {
                Some((place, message)) => at(source, Some(place), message),
                None => at(source, place, message),
            }
        })?;
    Ok(Checked { module, info })
}

impl Source {
    /// An error at a place that naga knows.
    pub(super) fn error_at(&self, span: naga::Span, message: impl Into<String>) -> ShaderError {
        let location = span.location(self.text());
        at(self, Some((location.line_number as usize, location.line_position as usize)), message.into())
    }
}

fn at(source: &Source, place: Option<(usize, usize)>, message: String) -> ShaderError {
    // Checks the text pushed last; the earlier ones are the program's own.
    let (line_of_text, column) = place.unwrap_or((source.last_start(), 1));
    let (file, line, column) = source.written(line_of_text, column);
    let message = source.in_words(message);
    ShaderError { file: file.to_owned(), line, column, message, code: source.shown(line_of_text) }
}

/// Message about numbers of a type that some devices lack, and their place: naga reports types without the places of their names.
fn other_precision(source: &Source, message: &str) -> Option<((usize, usize), String)> {
    let named = message.split_once("Using `").and_then(|(_, rest)| rest.split_once("` values requires"));
    let (start, own) = source.last_text();
    let found = match named {
        Some((found, _)) => found,
        None if message.contains("`f16` enable extension") => "f16",
        // It does not name the target of a conversion.
        None if message.contains("Unable to cast") => {
            let others = ["f64", "f16", "i64", "u64"];
            limits::tokens(own).map(|(_, token)| token).find(|token| others.contains(token))?
        }
        None => return None,
    };
    // The endings of numbers of these types.
    let ending = match found {
        "f64" => "lf",
        "i64" => "li",
        "u64" => "lu",
        _ => "h",
    };
    let is_number = |token: &str| token.starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let (at, _) =
        limits::tokens(own).find(|(_, token)| *token == found || is_number(token) && token.ends_with(ending))?;
    let span = naga::Span::new((start + at) as u32, (start + at + 1) as u32);
    let place = span.location(source.text());
    Some((
        (place.line_number as usize, place.line_position as usize),
        format!("{found}: extensions compute in f32, as GPUs do, so every number is f32 or bool; write f32"),
    ))
}

/// The available members, for a part that reads a missing one.
fn no_such_parameter(source: &Source, place: Option<(usize, usize)>, message: &str) -> Option<String> {
    let (text, own) = (source.text(), source.last_prefix());
    let field = message.strip_prefix("invalid field accessor `")?.split('`').next()?;
    let (line, column) = place?;
    let before = text.lines().nth(line - 1)?.get(..column - 1)?;
    let object = before.strip_suffix('.')?.rsplit(|c: char| !c.is_alphanumeric() && c != '_').next()?;
    // Argument names of parts and extensions.
    let (prefix, kind, whose) = match object {
        "p" | "q" => ("", "Params", "this variant has"),
        "own" => (own, "Parameters", "it has"),
        "state" => (own, "State", "it has"),
        "w" => ("", "World", "it has"),
        "x" => ("", "Perceived", "it has"),
        _ => return None,
    };
    let fields = text.split_once(&format!("struct {prefix}{kind} {{"))?.1.split_once('}')?.0;
    let known: Vec<&str> =
        fields.lines().filter_map(|l| l.trim().strip_suffix(": f32,").filter(|name| !name.contains(' '))).collect();
    Some(format!("{kind} has no field {field}; {whose} {}", known.join(", ")))
}
