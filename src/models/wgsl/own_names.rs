//! Names that an extension declares: in the composed text each begins with the extension's name and `__`, which no other name there has. So
//! an extension may declare any names, and other names refer to those of the program.

use super::limits::tokens;
use crate::extension::Extension;
use crate::symbols::Symbol;
use naga::keywords::wgsl::RESERVED;
use std::collections::HashSet;

const SEPARATOR: &str = "__";

/// Prefix of the names of an extension. No name of an extension contains `__` or ends in `_`, so names of two extensions never coincide.
pub(super) fn prefix(extension: &str) -> String {
    extension.to_owned() + SEPARATOR
}

/// Parts of the member of `Params` for a parameter.
fn parts(symbol: Symbol) -> [&'static str; 3] {
    match symbol {
        Symbol::Extension(row) => [&row.extension, SEPARATOR, &row.name],
        _ => ["", "", symbol.name()],
    }
}

/// Member of `Params` for a parameter.
pub fn member(symbol: Symbol) -> String {
    parts(symbol).concat()
}

/// True for the member of `Params` for a parameter, without composing it.
pub fn is_member(symbol: Symbol, name: &str) -> bool {
    parts(symbol).iter().try_fold(name, |rest, part| rest.strip_prefix(part)) == Some("")
}

/// Member of `Memory` for the state of an extension.
pub(crate) fn memory_of(extension: &Extension) -> String {
    prefix(&extension.name) + "state"
}

/// Changes to the text of an extension: its own names have a prefix.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Prefixed {
    pub(super) prefix: String,
    /// Positions of the prefix: line from 0, and bytes from its start.
    places: Vec<(usize, usize)>,
}

impl Prefixed {
    /// The text of an extension with its own names prefixed, in the original lines.
    pub(super) fn of(extension: &str, text: &str) -> (String, Prefixed) {
        let (prefix, declared) = (prefix(extension), declared(text));
        let mut prefixed = String::with_capacity(text.len() + 64);
        let mut places = Vec::new();
        let all: Vec<(usize, &str)> = tokens(text).collect();
        let (mut copied, mut line, mut line_start) = (0, 0, 0);
        let mut is_struct = false;
        for (k, (at, token)) in all.iter().enumerate() {
            match *token {
                "struct" => is_struct = true,
                "}" => is_struct = false,
                _ => {}
            }
            let before = if k > 0 { all[k - 1].1 } else { "" };
            let is_member = before == "." || is_struct && all.get(k + 1).is_some_and(|(_, next)| *next == ":");
            if is_member || before == "@" || !declared.contains(token) {
                continue;
            }
            for c in text[copied..*at].chars() {
                prefixed.push(c);
                if c == '\n' {
                    line += 1;
                    line_start = prefixed.len();
                }
            }
            places.push((line, prefixed.len() - line_start));
            prefixed.push_str(&prefix);
            copied = *at;
        }
        prefixed.push_str(&text[copied..]);
        (prefixed, Prefixed { prefix, places })
    }

    /// A line of that text, by its number from 1, as it was written.
    pub(super) fn written_line(&self, number: usize, line: &str) -> String {
        let mut written = line.to_owned();
        for (_, at) in self.places.iter().rev().filter(|(l, _)| l + 1 == number) {
            written.replace_range(at..&(at + self.prefix.len()), "");
        }
        written
    }

    /// The column of the original text, from 1, for one in that text; lines are the same.
    pub(super) fn written(&self, line: usize, column: usize) -> usize {
        let before = self.places.iter().filter(|(l, at)| l + 1 == line && at + 1 < column).count();
        column.saturating_sub(before * self.prefix.len()).max(1)
    }
}

/// Names that a text declares outside of functions: words after `fn`, `struct` and so on. Invalid names are left to the parser.
fn declared(text: &str) -> HashSet<&str> {
    let (mut depth, mut before, mut declared) = (0_usize, "", HashSet::new());
    // The address space may be between `var` and its name.
    let mut is_variable = false;
    for (_, token) in tokens(text) {
        match token {
            "{" => depth += 1,
            "}" => depth = depth.saturating_sub(1),
            "var" => is_variable = true,
            ":" | "=" | ";" => is_variable = false,
            _ => {}
        }
        let is_declared =
            matches!(before, "fn" | "struct" | "alias" | "const" | "override" | "var") || is_variable && before == ">";
        if depth == 0 && is_declared && is_name(token) {
            declared.insert(token);
        }
        before = token;
    }
    declared
}

fn is_name(token: &str) -> bool {
    let begins = token.starts_with(|c: char| c.is_alphabetic() || c == '_');
    begins && token != "_" && !token.starts_with("__") && !RESERVED.contains(&token)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_declared_is_prefixed_wherever_it_is_meant() {
        for (text, expected) in [
            (
                "const a = 1; fn f(b: f32) -> f32 { return a + b.a; }",
                "const x__a = 1; fn x__f(b: f32) -> f32 { return x__a + b.a; }",
            ),
            (
                "struct S { a: T, b: f32 } alias T = f32; alias a = T;",
                "struct x__S { a: x__T, b: f32 } alias x__T = f32; alias x__a = x__T;",
            ),
            (
                "fn a() { let c = 1; } // a\n/* a */ const d = c;",
                "fn x__a() { let c = 1; } // a\n/* a */ const x__d = c;",
            ),
            ("var<private> a: f32; var b = a;", "var<private> x__a: f32; var x__b = x__a;"),
            ("const fn = 1; const __a = 2; const _ = 3;", "const fn = 1; const __a = 2; const _ = 3;"),
            ("@must_use fn must_use() -> f32 { return 1.0; }", "@must_use fn x__must_use() -> f32 { return 1.0; }"),
        ] {
            assert_eq!(Prefixed::of("x", text).0, expected);
        }
    }

    #[test]
    fn columns_are_those_of_the_text_as_written() {
        let (text, prefixed) = Prefixed::of("x", "const a = 1;\n  const b = a + a;");
        assert_eq!(text.lines().nth(1), Some("  const x__b = x__a + x__a;"));
        for (found, written) in [(3, 3), (9, 9), (14, 11), (16, 13), (23, 17)] {
            assert_eq!(prefixed.written(2, found), written, "{found}");
        }
        assert_eq!(prefixed.written(1, 7), 7);
        assert_eq!(prefixed.written_line(2, "  const x__b = x__a + x__a;"), "  const b = a + a;");
    }
}
