//! Every small change of a WGSL text, one at a time.

/// A change, with the whole file that has it; files such as `shaders/controller/idm.wgsl`.
pub type Mutant = crate::common::mutant::Mutant<String>;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Word,
    Number,
    Sign,
}

#[derive(Debug, Clone, Copy)]
struct Token {
    kind: Kind,
    start: usize,
    end: usize,
}

/// Signs of more than one character, the longer ones first.
const LONG_SIGNS: [&str; 14] = ["->", "<=", ">=", "==", "!=", "&&", "||", "<<", ">>", "+=", "-=", "*=", "/=", "++"];

/// Tokens outside of comments.
fn tokens(text: &str) -> Vec<Token> {
    let bytes = text.as_bytes();
    let (mut tokens, mut at) = (Vec::new(), 0);
    let while_ =
        |from: usize, keep: &dyn Fn(usize) -> bool| (from..bytes.len()).find(|i| !keep(*i)).unwrap_or(bytes.len());
    while at < bytes.len() {
        let start = at;
        let c = bytes[at];
        if text[at..].starts_with("//") {
            at = while_(at, &|i| bytes[i] != b'\n');
        } else if c.is_ascii_whitespace() || !c.is_ascii() {
            at += 1;
        } else if c.is_ascii_alphabetic() || c == b'_' {
            at = while_(at, &|i| bytes[i].is_ascii_alphanumeric() || bytes[i] == b'_');
            tokens.push(Token { kind: Kind::Word, start, end: at });
        } else if c.is_ascii_digit() {
            let exponent =
                |i: usize| matches!(bytes[i], b'+' | b'-') && bytes[i - 1] == b'e' && !text[start..i].starts_with("0x");
            at = while_(at, &|i| bytes[i].is_ascii_alphanumeric() || bytes[i] == b'.' || exponent(i));
            tokens.push(Token { kind: Kind::Number, start, end: at });
        } else {
            at += LONG_SIGNS.iter().find(|sign| text[at..].starts_with(**sign)).map_or(1, |sign| sign.len());
            tokens.push(Token { kind: Kind::Sign, start, end: at });
        }
    }
    tokens
}

/// Replacements of a constant; `None` for one outside the computation.
fn other_number(number: &str) -> Option<(String, String)> {
    if let Some(digits) = number.strip_prefix("0x") {
        let value = u32::from_str_radix(digits.trim_end_matches('u'), 16).expect("a hexadecimal number");
        // A mask with one bit more or less, and the next bit pattern.
        return Some((format!("0x{:x}u", value ^ 1), "last bit".to_owned()));
    }
    if number.contains('.') || number.contains('e') {
        let value: f64 = number.trim_end_matches('f').parse().expect("a float literal is a number");
        return Some(if value == 0.0 {
            ("0.01".to_owned(), "0.01".to_owned())
        } else {
            (format!("({number} * 1.01)"), format!("{number} * 1.01"))
        });
    }
    let value: u32 = number.trim_end_matches(['u', 'i']).parse().expect("a whole number");
    let suffix = if number.ends_with('u') { "u" } else { "" };
    Some((format!("{}{suffix}", value + 1), format!("{}{suffix}", value + 1)))
}

/// Replacements of a sign between two operands.
fn other_signs(sign: &str) -> &'static [&'static str] {
    match sign {
        "+" => &["-"],
        "-" => &["+"],
        "*" => &["/"],
        "/" => &["*"],
        "<" => &["<=", ">"],
        "<=" => &["<", ">"],
        ">" => &[">=", "<"],
        ">=" => &[">", "<"],
        "==" => &["!="],
        "!=" => &["=="],
        "&&" => &["||"],
        "||" => &["&&"],
        "&" => &["|"],
        "|" => &["&"],
        "^" => &["&"],
        "<<" => &[">>"],
        ">>" => &["<<"],
        "+=" => &["-="],
        _ => &[],
    }
}

/// Types whose `<` opens a list of types.
const GENERIC: [&str; 6] = ["var", "array", "bitcast", "vec2", "vec3", "vec4"];

/// Every mutant of a text.
pub fn mutants(file: &str, text: &str) -> Vec<Mutant> {
    let tokens = tokens(text);
    let word = |i: usize| tokens.get(i).map_or("", |t| &text[t.start..t.end]);
    let mut found: Vec<Mutant> = Vec::new();
    let mut add = |start: usize, end: usize, new: &str, change: String| {
        let before = &text[..start];
        let line = before.matches('\n').count() + 1;
        let column = start - before.rfind('\n').map_or(0, |i| i + 1) + 1;
        let same = |m: &&Mutant| m.line == line && m.change.split(" (").next() == Some(&change);
        let change = match found.iter().filter(same).count() {
            0 => change,
            earlier => format!("{change} ({})", earlier + 1),
        };
        let source = text.lines().nth(line - 1).expect("the token is on a line").trim().to_owned();
        let text = format!("{before}{new}{}", &text[end..]);
        found.push(Mutant { file: file.to_owned(), line, column, source, change, made: text });
    };
    // Depth of `<` that belong to types, whose `>` are not comparisons, and of `@attribute(...)`.
    let (mut types, mut attribute_until) = (0, 0);
    for (i, token) in tokens.iter().enumerate() {
        let here = word(i);
        let before = if i == 0 { "" } else { word(i - 1) };
        if here == "@" && word(i + 2) == "(" {
            attribute_until = closing(&tokens, text, i + 2);
        }
        if i <= attribute_until && attribute_until > 0 {
            continue;
        }
        match token.kind {
            Kind::Number if types == 0 => {
                if let Some((new, shown)) = other_number(here) {
                    add(token.start, token.end, &new, format!("{here} -> {shown}"));
                }
            }
            Kind::Word => match here {
                "min" | "max" => {
                    let other = if here == "min" { "max" } else { "min" };
                    add(token.start, token.end, other, format!("{here} -> {other}"));
                }
                "true" | "false" => {
                    let other = if here == "true" { "false" } else { "true" };
                    add(token.start, token.end, other, format!("{here} -> {other}"));
                }
                "sqrt" | "abs" | "exp" | "log" | "sin" | "cos" if word(i + 1) == "(" => {
                    add(token.start, token.end, "", format!("{here} -> left out"));
                }
                "floor" => add(token.start, token.end, "ceil", "floor -> ceil".to_owned()),
                "select" => {
                    let [one, two, _] = arguments(&tokens, text, i + 1)[..] else {
                        panic!("{file}: select takes three")
                    };
                    let (a, b) = (&text[one.0..one.1], &text[two.0..two.1]);
                    add(one.0, two.1, &format!("{b}, {a}"), "select -> swapped".to_owned());
                }
                _ => {}
            },
            Kind::Sign => match here {
                "<" if GENERIC.contains(&before) => types += 1,
                ">" if types > 0 => types -= 1,
                ">>" if types > 1 => types -= 2,
                "!" => add(token.start, token.end, "", "! -> left out".to_owned()),
                "-" if !ends_operand(&tokens, text, i) => add(token.start, token.end, "", "- -> left out".to_owned()),
                _ => {
                    for other in other_signs(here) {
                        add(token.start, token.end, other, format!("{here} -> {other}"));
                    }
                }
            },
            Kind::Number => {}
        }
    }
    found
}

/// True if token `i` follows an operand, so that a `-` there subtracts.
fn ends_operand(tokens: &[Token], text: &str, i: usize) -> bool {
    let Some(before) = i.checked_sub(1).map(|k| tokens[k]) else { return false };
    let word = &text[before.start..before.end];
    match before.kind {
        Kind::Number => true,
        Kind::Word => word != "return",
        Kind::Sign => word == ")" || word == "]",
    }
}

/// The token that closes the bracket at token `open`.
fn closing(tokens: &[Token], text: &str, open: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        match &text[token.start..token.end] {
            "(" | "[" => depth += 1,
            ")" | "]" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i;
        }
    }
    panic!("a bracket is not closed");
}

/// Start and end of each argument of the call whose bracket is token `open`.
fn arguments(tokens: &[Token], text: &str, open: usize) -> Vec<(usize, usize)> {
    let (close, mut depth, mut first) = (closing(tokens, text, open), 0, open + 1);
    let mut found = Vec::new();
    for i in open..=close {
        match &text[tokens[i].start..tokens[i].end] {
            "(" | "[" => depth += 1,
            ")" | "]" => depth -= 1,
            "," if depth == 1 => {
                found.push((tokens[first].start, tokens[i - 1].end));
                first = i + 1;
            }
            _ => {}
        }
    }
    if first < close {
        found.push((tokens[first].start, tokens[close - 1].end));
    }
    found
}

#[test]
fn the_changes_of_a_text() {
    let text = "// 1.0 + 2.0 is a comment\n@group(0) var<private> z: array<f32, 8>;\nfn f(x: vec2<f32>) -> f32 {\n    \
                return select(-x.x, max(x.y, 0.0) * 2.5e-1, x.x <= 1e-3);\n}\n";
    let changes: Vec<(usize, usize, String)> =
        mutants("f.wgsl", text).into_iter().map(|m| (m.line, m.column, m.change)).collect();
    let expected = [
        (19, "select -> swapped"),
        (19, "- -> left out"),
        (25, "max -> min"),
        (34, "0.0 -> 0.01"),
        (39, "* -> /"),
        (41, "2.5e-1 -> 2.5e-1 * 1.01"),
        (53, "<= -> <"),
        (53, "<= -> >"),
        (56, "1e-3 -> 1e-3 * 1.01"),
    ];
    let expected: Vec<(usize, usize, String)> = expected.iter().map(|(c, m)| (4, *c, (*m).to_owned())).collect();
    assert_eq!(changes, expected);
    let swapped = &mutants("f.wgsl", text)[0].made;
    assert!(swapped.contains("select(max(x.y, 0.0) * 2.5e-1, -x.x, x.x <= 1e-3)"), "{swapped}");
}
