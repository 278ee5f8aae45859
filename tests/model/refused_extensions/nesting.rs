//! Nesting is bounded before a parser sees it, so that half a megabyte of stack is enough for every text.
//!
//! `LEADLAG_FUZZ_SECONDS=600` generates texts for that time; by default a second. (fuzz/ has a target that learns from coverage.)

use super::{calls_in_blocks, command, functions};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Radicand;
use leadlag::internal::lanes::check_model;
use leadlag::internal::wgsl::{Precision, Recipe, library, read_extension};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::{Duration, Instant};

/// Every way in which the grammar allows nesting: as much as is allowed, and far more, on the smallest promised stack.
#[test]
fn nothing_that_nests_overflows_a_small_stack() {
    let chain = |first: &str, link: &str, last: &str, n: usize| format!("{first}{}{last}", link.repeat(n));
    let nested = |open: &str, inner: &str, close: &str, n: usize| chain("", open, inner, n) + &close.repeat(n);
    let returned = |value: String| command(&format!("return {value};"));
    let chained = |last: usize, of: &dyn Fn(usize, usize) -> String| -> String {
        (1..=last).map(|i| of(i, i - 1) + "\n").collect::<String>() + &command("return a;")
    };
    type Kind<'a> = (&'a str, Box<dyn Fn(usize) -> String + 'a>);
    let kinds: Vec<Kind> = vec![
        ("elements", Box::new(|n| returned(chain("a", "[0]", "", n)))),
        (
            "elements to write",
            Box::new(|n| command(&format!("var b = a; {} = 1.0; return b;", chain("b", "[0]", "", n)))),
        ),
        ("members", Box::new(|n| returned(chain("a", ".s", "", n)))),
        ("minus", Box::new(|n| returned(chain("", "- ", "a", n)))),
        ("not", Box::new(|n| returned(chain("f32(", "!", "true)", n)))),
        ("complements", Box::new(|n| returned(chain("f32(", "~", "1u)", n)))),
        ("pointers", Box::new(|n| returned(chain("", "*&", "a", n / 2)))),
        (
            "pointers to write",
            Box::new(|n| command(&format!("var b = a; {} = 1.0; return b;", chain("", "*&", "b", n / 2)))),
        ),
        ("sums", Box::new(|n| returned(chain("a", "+a", "", n)))),
        ("powers", Box::new(|n| returned(chain("f32(1u", "<<1u", ")", n)))),
        ("conditions", Box::new(|n| returned(chain("f32(true", "&&true", ")", n)))),
        ("comparisons", Box::new(|n| returned(chain("a", "<a", "", n)))),
        ("parentheses", Box::new(|n| returned(nested("(", "a", ")", n)))),
        (
            "parentheses to write",
            Box::new(|n| command(&format!("var b = a; {} = 1.0; return b;", nested("(", "b", ")", n)))),
        ),
        ("calls", Box::new(|n| returned(nested("abs(", "a", ")", n)))),
        ("calls and operators", Box::new(|n| returned(nested("-abs(a*a+", "a", ").s[0]", n)))),
        ("elements of elements", Box::new(|n| returned(nested("a[", "0", "]", n)))),
        ("types", Box::new(|n| command(&format!("var b: {}; return a;", nested("array<", "f32", ",2>", n))))),
        ("types in brackets", Box::new(|n| returned(nested("(array<f32,1<", "a", ">)", n)))),
        ("blocks", Box::new(|n| command(&format!("var b = a; {} return b;", nested("{", "", "}", n))))),
        (
            "branches",
            Box::new(|n| command(&format!("var b = a; {} {{ }} return b;", "if b > 1.0 { } else ".repeat(n)))),
        ),
        ("loops", Box::new(|n| command(&format!("{} return a;", nested("loop {", "", "}", n))))),
        ("switches", Box::new(|n| command(&format!("{} return a;", nested("switch 1 { default: {", "", "}}", n / 2))))),
        ("attributes", Box::new(|n| chain("", "@must_use ", "", n) + &command("return a;"))),
        ("attributes with expressions", Box::new(|n| nested("@align(", "4", ")", n) + &command("return a;"))),
        ("comments", Box::new(|n| nested("/*", "", "*/", n) + &command("return a;"))),
        (
            "structs",
            Box::new(|n| {
                format!("struct S_0 {{ a: f32 }} {}", chained(n, &|i, k| format!("struct S_{i} {{ a: S_{k} }}")))
            }),
        ),
        (
            "structs backwards",
            Box::new(|n| {
                let all: String = (1..=n).rev().map(|i| format!("struct S_{i} {{ a: S_{} }} ", i - 1)).collect();
                all + "struct S_0 { a: f32 }\n" + &command("return a;")
            }),
        ),
        ("aliases", Box::new(|n| format!("alias T_0 = f32; {}", chained(n, &|i, k| format!("alias T_{i} = T_{k};"))))),
        (
            "constants",
            Box::new(|n| format!("const c_0 = 1.0; {}", chained(n, &|i, k| format!("const c_{i} = c_{k} + 1.0;")))),
        ),
        (
            "constants backwards",
            Box::new(|n| {
                let all: String = (1..=n).rev().map(|i| format!("const c_{i} = c_{}; ", i - 1)).collect();
                all + "const c_0 = 1.0;\n" + &command("return a;")
            }),
        ),
        ("operators after brackets", Box::new(|n| returned(nested("abs(", "a", ")", n.min(97)) + &"+a".repeat(n)))),
        ("calls in blocks", Box::new(|n| calls_in_blocks(n.min(60), n.min(97)))),
        ("functions", Box::new(|n| functions(n, |f| format!("{f}(a)")))),
    ];
    for (kind, text) in &kinds {
        for n in [50, 90, 98, 99, 100, 101, 198, 249, 250, 480, 498, 499, 500, 501, 2000, 20_000] {
            let text = text(n);
            let stack = std::thread::Builder::new().name(format!("{n} {kind}")).stack_size(SMALL_STACK);
            let done = stack.spawn(move || used(&text)).expect("a thread").join();
            assert!(done.is_ok(), "{n} {kind}");
        }
    }
}

/// The stack that must be enough for every text \[bytes\].
const SMALL_STACK: usize = 512 << 10;

/// Reads an extension and compiles the models that it fits; false if it is refused.
fn used(text: &str) -> bool {
    match read_extension("x.wgsl", text) {
        Ok(extension) => {
            let variant = "gipps".parse::<Variant>().expect("a base").with(extension).expect("no conflict");
            let recipe = Recipe { variant, precision: Precision::Plain, radicand: Radicand::Measured, observed: true };
            drop(check_model(&recipe));
            true
        }
        Err(error) => {
            assert!(error.line > 0 && error.column > 0, "{error}");
            false
        }
    }
}

/// Generates texts that nest in many ways at once.
struct Author {
    rng: ChaCha8Rng,
    /// Writes numbers only, so that many texts are valid and the compilers after the parser see them, too.
    is_sane: bool,
}

impl Author {
    fn pick<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.rng.random_range(0..of.len())]
    }

    /// Mostly a small number, sometimes a large one.
    fn often(&mut self) -> usize {
        let most = [3, 12, 60, 130, 700][self.rng.random_range(0..5)];
        self.rng.random_range(1..=most)
    }

    /// A number.
    fn sane_expression(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.pick(&["a", "1.0"]).to_owned();
        }
        let (inner, times) = (self.sane_expression(depth - 1), self.often());
        match self.rng.random_range(0..4) {
            0 => "- ".repeat(times) + &inner,
            1 => inner + &self.pick(&["+a", "*a", " - a"]).repeat(times),
            2 => self.pick(&["(", "abs(", "max(a,"]).repeat(times) + &inner + &")".repeat(times),
            _ => format!("{inner} * ({})", self.sane_expression(depth - 1)),
        }
    }

    fn expression(&mut self, depth: usize) -> String {
        if self.is_sane {
            return self.sane_expression(depth);
        }
        if depth == 0 {
            return self
                .pick(&["a", "1.0", "1u", "true", "x.s", "a[0]", "f32", "g(a)", "array<f32,2>(a,a)"])
                .to_owned();
        }
        let inner = self.expression(depth - 1);
        let times = self.often();
        match self.rng.random_range(0..8) {
            0 => self.pick(&["-", "- ", "!", "~", "&", "*", "*&", "!-~"]).repeat(times) + &inner,
            1 => inner + &self.pick(&["[0]", ".s", ".xy", "[a]", "[1u][0]"]).repeat(times),
            2 => {
                inner
                    + &self
                        .pick(&["+a", "*a", "&&true", "||a", "<a", ">>1u", "<<1u", "==a", "|a", "^ a", "%a", "-a"])
                        .repeat(times)
            }
            3 => {
                let open = self.pick(&[
                    "(",
                    "abs(",
                    "max(a,",
                    "f32(",
                    "vec2<f32>(",
                    "array<f32,1>(",
                    "a[",
                    "-(",
                    "select(a,a,",
                ]);
                let close = if open == "a[" { "]" } else { ")" };
                open.repeat(times) + &inner + &close.repeat(times)
            }
            4 => {
                self.pick(&["array<", "vec2<", "ptr<function,", "(array<"]).repeat(times) + &inner + &">".repeat(times)
            }
            5 => format!("{inner}{}{}", self.pick(&["+", "<", ">", "&&", "*", "-"]), self.expression(depth - 1)),
            6 => format!("select({inner}, {}, {})", self.expression(depth - 1), self.expression(depth - 1)),
            _ => format!("({inner})"),
        }
    }

    fn statement(&mut self, depth: usize) -> String {
        let value = self.expression(2);
        if depth == 0 && self.is_sane {
            return format!("b = {value};");
        }
        if depth == 0 {
            return match self.rng.random_range(0..4) {
                0 => format!("let c = {value};"),
                1 => format!("b = {value};"),
                2 => format!("var d: {value} = a;"),
                _ => format!("{value} = a;"),
            };
        }
        let (inner, times) = (self.statement(depth - 1), self.often());
        match self.rng.random_range(0..if self.is_sane { 3 } else { 5 }) {
            0 => "{".repeat(times) + &inner + &"}".repeat(times),
            1 => "if a > 1.0 { b = a; } else ".repeat(times) + "{" + &inner + "}",
            2 => "if true {".repeat(times) + &inner + &"}".repeat(times),
            3 => "loop {".repeat(times) + &inner + &"}".repeat(times),
            _ => inner + &self.statement(depth - 1),
        }
    }

    fn text(&mut self) -> String {
        let mut text = String::new();
        let times = self.often();
        match if self.is_sane { self.rng.random_range(3..5) } else { self.rng.random_range(0..7) } {
            0 => (0..times).rev().for_each(|i| text += &format!("struct S{} {{ a: S{i} }} ", i + 1)),
            1 => (0..times).rev().for_each(|i| text += &format!("const c{} = c{i} + 1.0; ", i + 1)),
            2 => (0..times).rev().for_each(|i| text += &format!("alias T{} = T{i}; ", i + 1)),
            3 => text = functions(times.min(600), |f| format!("{f}(a)")).replace("x_command", "y"),
            4 => text = calls_in_blocks(times.min(60), self.often()).replace("x_command", "y"),
            5 => text = format!("const c0 = {};", self.expression(3)),
            _ => {}
        }
        let body = self.statement(2);
        text += &command(&format!("var b = a; {body} return {};", self.expression(3)));
        // A part of a real one in the middle of it, cut anywhere.
        let real = library()[self.rng.random_range(0..library().len())].text.as_str();
        let at = self.rng.random_range(0..real.len());
        if !self.is_sane && self.rng.random_range(0..4) == 0 && real.is_char_boundary(at) {
            let to = self.rng.random_range(0..text.len());
            let to = (0..=to).rev().find(|to| text.is_char_boundary(*to)).unwrap_or(0);
            text.insert_str(to, &real[at..]);
        }
        text
    }
}

#[test]
fn made_up_texts_do_with_a_small_stack() {
    let seconds = std::env::var("LEADLAG_FUZZ_SECONDS").map_or(1, |seconds| seconds.parse().expect("a number"));
    let (began, mut count, mut valid) = (Instant::now(), 0_u64, 0_u64);
    while began.elapsed() < Duration::from_secs(seconds) {
        // Many per thread, with the seed as its name, so that a stack overflow shows which ones.
        let stack = std::thread::Builder::new().name(format!("texts of seed {count}")).stack_size(SMALL_STACK);
        let work = move || {
            let mut author = Author { rng: ChaCha8Rng::seed_from_u64(count), is_sane: count.is_multiple_of(100) };
            (0..50).filter(|_| used(&author.text())).count() as u64
        };
        valid += stack.spawn(work).expect("a thread").join().expect("no text panics");
        count += 50;
    }
    eprintln!("{count} texts, {valid} of them valid, in {:?}", began.elapsed());
    assert!(valid > 0, "some of {count} must be valid");
}
