//! Limits on length and nesting of an extension. The parser, and the compilers after it, recurse for every level and every
//! operator of an expression, and inline each call: a short text can fill the stack, or the memory.

use super::check::{Checked, ShaderError};
use super::compose::Source;
use naga::{Block, Statement, TypeInner};
use std::collections::HashMap;

/// Length of a text \[bytes\].
const BYTES: usize = 64 * 1024;
/// Depth of brackets, `<` and branches of `else`, and of calls with the blocks around them. The parser gives up at 127
/// blocks and at 198 brackets, without a place or a reason.
const DEPTH: usize = 100;
/// Operators in a statement, members and elements among them. With 2000 the parser overflows a stack of 1 MB, the size for a main
/// thread on Windows.
const OPERATORS: usize = 500;
/// Number of operators that a level of brackets counts as. It takes as much stack of the parser as seven of them: 3.6 kB to 0.5 kB. So the
/// largest statement, 99 levels and 104 operators, takes 410 kB of the promised 512 kB.
const LEVEL: usize = 4;
/// Largest number of declarations in a text. The parser recurses along a chain of them, and overflows the same stack with 1700 structs.
const DECLARATIONS: usize = 500;
/// Largest number of instructions of all functions with calls inlined, and of numbers in a struct: hundreds of times those of a built-in
/// extension.
const INSTRUCTIONS: u64 = 20_000;

/// Refuses texts that the parser must not see.
pub(super) fn refuse_long_text(file: &str, text: &str) -> Result<(), ShaderError> {
    let refuse = |at: usize, message: String| {
        let span = naga::Span::new(at as u32, at as u32 + 1);
        Err(Source::single(file, text).error_at(span, message))
    };
    if text.len() > BYTES {
        let found = text.len();
        return refuse(
            0,
            format!("expected at most {BYTES} bytes, found {found}: remove unused parts, or split the file"),
        );
    }
    // For each open bracket, the branches of `else` in the chain around it; the first entry stands for the whole file.
    let mut open = vec![0_usize];
    // A `<` may open the arguments of a type, which `>` then closes; only the parser knows which ones do.
    let (mut operators, mut angles, mut deepest, mut declarations, mut before) = (0, 0, 0, 0, "");
    for (at, token) in tokens(text) {
        operators += usize::from(is_operator(token) || token == "[");
        angles += usize::from(token == "<");
        let top = open.len() - 1;
        match token {
            "(" | "[" | "{" => open.push(0),
            ")" | "]" | "}" if top > 0 => drop(open.pop()),
            "else" => open[top] += 1,
            "if" if before != "else" => open[top] = 0,
            _ => {}
        }
        if matches!(token, ";" | "{" | "}") {
            (operators, angles, deepest) = (0, 0, 0);
            declarations += usize::from(open.len() == 1);
        }
        before = token;
        let depth = open.len() - 1 + open.iter().sum::<usize>() + angles;
        if depth > DEPTH {
            let message = format!(
                "more than {DEPTH} nested brackets, branches of `else` and `<` of a statement: give parts \
                 of it a name with `let`, or move them into functions"
            );
            return refuse(at, message);
        }
        // The first operand of a chain of operators lies below all of them: brackets that are closed again count, too. That of the
        // function itself is always open.
        deepest = deepest.max(depth);
        if operators + LEVEL * deepest.saturating_sub(1) > OPERATORS {
            let message = format!(
                "more than {OPERATORS} operators in a statement, each level of its brackets counted as {LEVEL} of them: give parts of it \
                 a name with `let`"
            );
            return refuse(at, message);
        }
        if declarations > DECLARATIONS {
            return refuse(
                at,
                format!("more than {DECLARATIONS} structs, functions and constants: remove unused ones"),
            );
        }
    }
    match wide_struct(text) {
        Some((at, name)) => refuse(at, format!("{name}: a struct of more than {INSTRUCTIONS} numbers: pass on fewer")),
        None => Ok(()),
    }
}

/// The first struct with more numbers than the allowed instructions: the parser processes them one by one, even if they are written in a
/// few lines.
fn wide_struct(text: &str) -> Option<(usize, &str)> {
    // Place and name of each struct and alias, and the types in it.
    let mut declared: Vec<(usize, &str, Vec<&str>)> = Vec::new();
    let (mut inside, mut is_type, mut before) = (false, false, "");
    for (at, token) in tokens(text) {
        match token {
            name if matches!(before, "struct" | "alias") => {
                declared.push((at, name, Vec::new()));
                (inside, is_type) = (true, false);
            }
            ":" | "=" => is_type = inside,
            "," => is_type = false,
            "}" | ";" => (inside, is_type) = (false, false),
            part => declared.last_mut().filter(|_| is_type).into_iter().for_each(|(.., parts)| parts.push(part)),
        }
        before = token;
    }
    let parts = declared.iter().map(|(_, name, parts)| (*name, parts.as_slice())).collect();
    let mut known = HashMap::new();
    declared
        .iter()
        .find(|(_, name, _)| width(name, &parts, &mut known) > INSTRUCTIONS)
        .map(|(at, name, _)| (*at, *name))
}

/// Numbers in a type; one that is not declared in the text counts as one.
fn width<'a>(name: &'a str, parts: &HashMap<&'a str, &[&'a str]>, known: &mut HashMap<&'a str, u64>) -> u64 {
    if let Some(width) = known.get(name) {
        return *width;
    }
    // Value for a struct that contains itself, which the parser refuses, until the number is known.
    known.insert(name, 1);
    let Some(inside) = parts.get(name) else { return 1 };
    let sum = inside.iter().fold(0_u64, |sum, part| sum.saturating_add(width(part, parts, known)));
    known.insert(name, sum);
    sum
}

/// Words, numbers and signs of a text with their places, without comments, as naga tokenises it, except for details that do not matter
/// here.
pub(super) fn tokens(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let rest = &text[at..];
            let mut chars = rest.chars();
            let (first, second) = (chars.next()?, chars.next().unwrap_or(' '));
            let is_number = first.is_ascii_digit() || first == '.' && second.is_ascii_digit();
            let within = |is_part: &dyn Fn(char) -> bool| rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            let length = match (first, second) {
                ('/', '/') => within(&|c| !ends_a_line(c)),
                ('/', '*') => block_comment(rest),
                _ if is_number => within(&|c| c.is_alphanumeric() || c == '.'),
                _ if first.is_alphanumeric() || first == '_' => within(&|c| c.is_alphanumeric() || c == '_'),
                ('-', '>') => 2,
                (_, '=') if is_operator(&rest[..first.len_utf8()]) => 2,
                ('&' | '|' | '<' | '>' | '+' | '-', _) if first == second => 2,
                _ => first.len_utf8(),
            };
            let token = &rest[..length];
            at += length;
            if !(token.starts_with("//") || token.starts_with("/*") || first.is_whitespace()) {
                return Some((at - length, token));
            }
        }
    })
}

fn is_operator(token: &str) -> bool {
    token == "." || token.starts_with(['+', '-', '*', '/', '%', '<', '>', '=', '!', '&', '|', '^', '~'])
}

/// End of a comment in WGSL.
fn ends_a_line(c: char) -> bool {
    matches!(c, '\n'..='\r' | '\u{85}' | '\u{2028}' | '\u{2029}')
}

/// Length of the block comment at the beginning of a text; such comments nest.
fn block_comment(text: &str) -> usize {
    let (bytes, mut depth, mut at) = (text.as_bytes(), 0, 0);
    while at < bytes.len() {
        match &bytes[at..bytes.len().min(at + 2)] {
            b"/*" => depth += 1,
            b"*/" => depth -= 1,
            _ => {
                at += 1;
                continue;
            }
        }
        at += 2;
        if depth == 0 {
            return at;
        }
    }
    text.len()
}

/// Refuses functions that grow too large with calls inlined. Sizes are added up along the calls, without inlining.
pub(super) fn refuse_large_functions(
    source: &Source,
    checked: &Checked,
    is_own: &dyn Fn(Option<&str>) -> bool,
) -> Result<(), ShaderError> {
    let module = &checked.module;
    // naga has types after those that they are made of, and functions after those that they call.
    let mut scalars: Vec<u64> = Vec::new();
    for (_, ty) in module.types.iter() {
        let width = match &ty.inner {
            TypeInner::Struct { members, .. } => {
                members.iter().map(|m| scalars[m.ty.index()]).fold(0, u64::saturating_add)
            }
            _ => 1,
        };
        scalars.push(width);
    }
    let mut known: Vec<(u64, usize)> = Vec::new();
    let mut total = 0_u64;
    for (handle, function) in module.functions.iter() {
        let info = &checked.info[handle];
        let width = |ty: naga::Handle<naga::Type>| scalars[ty.index()];
        let locals = function.local_variables.iter().map(|(_, local)| width(local.ty)).fold(0, u64::saturating_add);
        let values = function.expressions.iter().map(|(value, _)| info[value].ty.handle().map_or(1, width));
        let (mut size, mut depth) = (values.fold(locals, u64::saturating_add), 0);
        visit(&function.body, 0, &mut |statement, blocks| match statement {
            Statement::Call { function, .. } => {
                let (inside, below) = known[function.index()];
                size = size.saturating_add(inside);
                depth = depth.max(blocks + 1 + below);
            }
            // Any variable may have changed, so all of them are selected.
            Statement::If { .. } => size = size.saturating_add(locals),
            _ => {}
        });
        known.push((size, depth));
        if !is_own(function.name.as_deref()) {
            continue;
        }
        let name = function.name.as_deref().unwrap_or("a function");
        let span = module.functions.get_span(handle);
        total = total.saturating_add(size);
        if depth > DEPTH {
            let message = format!(
                "{name}: calls more than {DEPTH} deep, each block around a call counted: put short functions together, or take calls \
                 out of their blocks"
            );
            return Err(source.error_at(span, message));
        }
        if total > INSTRUCTIONS {
            let message = format!(
                "{name}: too large with calls inlined: more than {INSTRUCTIONS} instructions with the functions before it; \
                 keep a repeated result in a `let` instead of calling again"
            );
            return Err(source.error_at(span, message));
        }
    }
    Ok(())
}

/// Calls `each` with every statement, including those in branches, and the number of blocks around it, plus `outside`.
pub(super) fn visit(block: &Block, outside: usize, each: &mut dyn FnMut(&Statement, usize)) {
    for statement in block.iter() {
        each(statement, outside);
        match statement {
            Statement::Block(inner) => visit(inner, outside + 1, each),
            Statement::If { accept, reject, .. } => {
                visit(accept, outside + 1, each);
                visit(reject, outside + 1, each);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_taken_apart() {
        let found = |text| tokens(text).map(|(_, token)| token).collect::<Vec<_>>();
        assert_eq!(found("a+=-.5e3*b.c;"), ["a", "+=", "-", ".5e3", "*", "b", ".", "c", ";"]);
        assert_eq!(found("fn f()->f32{ // }}\n/* { /* { */ { */}"), ["fn", "f", "(", ")", "->", "f32", "{", "}"]);
        // A comment ends where naga ends it; otherwise brackets could hide in it.
        assert_eq!(found("//\u{2028}((\u{85}é→="), ["(", "(", "é", "→", "="]);
        assert_eq!(found("/* open ("), [""; 0]);
        assert_eq!(tokens("a  bc").last(), Some((3, "bc")));
    }

    #[test]
    fn chains_end_where_another_begins() {
        let chain = |branches: usize| "if a { } ".to_owned() + &"else if a { } ".repeat(branches) + "else { } ";
        let text = |branches: usize| format!("fn f() {{ {} }}", chain(branches).repeat(3));
        assert!(refuse_long_text("x.wgsl", &text(90)).is_ok());
        let error = refuse_long_text("x.wgsl", &text(120)).expect_err("too long").to_string();
        assert!(error.contains("more than 100 nested brackets"), "{error}");
    }

    #[test]
    fn numbers_of_a_struct_are_counted_through_what_it_is_made_of() {
        let mut structs: Vec<String> =
            (1..20).map(|i| format!("struct S{i} {{ a: S{0}, b: S{0} }}\n", i - 1)).collect();
        structs.push("alias S0 = f32;".to_owned());
        assert_eq!(wide_struct(&structs.concat()).map(|(_, name)| name), Some("S15"));
        structs.reverse();
        assert_eq!(wide_struct(&structs.concat()).map(|(_, name)| name), Some("S19"));
        assert_eq!(wide_struct("struct A { a: A, b: f32 } fn f(a: A) { let b: A = a; }"), None);
    }
}
