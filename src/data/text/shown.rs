//! Displays untrusted text: characters that move a cursor, hide or reorder text become escapes.

use std::borrow::Cow;
use std::fmt::Display;

/// Control characters, those that set the direction of writing, and invisible ones.
fn is_unseen(c: char) -> bool {
    // C0, delete and C1; then marks, embeddings, overrides and isolates of direction, and separators of lines.
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

/// A name on one line: `\u000a` for a line end. Text escaped this way is valid in JSON, too.
pub fn name(text: &str) -> Cow<'_, str> {
    escaped(text, is_unseen)
}

/// Text of several lines: line ends and tabs stay.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| is_unseen(c) && !matches!(c, '\n' | '\t'))
}

fn escaped(text: &str, escape: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(&escape) {
        return Cow::Borrowed(text);
    }
    let one = |c: char| if escape(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Cow::Owned(text.chars().map(one).collect())
}

/// Names in a message, at most: more would hide its sense.
pub const NAMED: usize = 5;

/// The first of these names, and `...` in place of more than `most`: `a, b, ...`.
pub fn first<T: AsRef<str>>(names: &[T], most: usize) -> String {
    let more = if names.len() > most { ", ..." } else { "" };
    names.iter().take(most).map(AsRef::as_ref).collect::<Vec<_>>().join(", ") + more
}

/// A number with the noun that it counts: `1 run`, `2 runs`, `2 trajectories`.
pub fn counted(number: impl Display, word: &str) -> String {
    let number = number.to_string();
    match (number.as_str(), word.strip_suffix('y')) {
        ("1", _) => format!("1 {word}"),
        (_, Some(stem)) => format!("{number} {stem}ies"),
        (_, None) => format!("{number} {word}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_seen_is_shown() {
        assert_eq!(name("car\u{1b}[2J\n2"), "car\\u001b[2J\\u000a2");
        assert_eq!(name("a\u{9b}b\u{202e}c\u{7f}"), "a\\u009bb\\u202ec\\u007f");
        assert_eq!(lines("a\n\tb\r\u{85}"), "a\n\tb\\u000d\\u0085");
        assert!(matches!(name("Škoda Φ (2)"), Cow::Borrowed(_)));
    }
}
