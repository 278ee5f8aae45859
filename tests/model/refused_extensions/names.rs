//! An extension's names are separate: they hide nothing of the program's, and errors show them in their original form.

use crate::common::sample;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Radicand;
use leadlag::internal::gpu::kernel_text;
use leadlag::internal::lanes::check_model;
use leadlag::internal::wgsl::{Precision, Recipe, extension_named, read_extension};
use std::collections::BTreeSet;

/// Every word of the longest kernel, from the shaders and the generated texts, including predeclared names.
fn words_of_ours() -> BTreeSet<String> {
    let mut words = BTreeSet::new();
    for (base, observed) in [("gipps+delay+nonlinear+mfc", true), ("idm+linear+constant", false)] {
        for precision in [Precision::Plain, Precision::Compensated] {
            let named = |name: &str| extension_named(name).expect("built in");
            let bare = base.parse::<Variant>().expect("a variant");
            let extended = bare.with(named("sensor_lowpass")).and_then(|v| v.with(named("time_offset")));
            for variant in [bare, extended.expect("no conflict")] {
                let recipe = Recipe { variant, precision, radicand: Radicand::Shifted, observed };
                let text = kernel_text(&recipe).expect("it is valid");
                words.extend(text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned));
            }
        }
    }
    words.retain(|word| word.starts_with(|c: char| c.is_alphabetic()) && !word.contains("__"));
    words
}

/// A kind of named declaration, and a text that declares one with a name.
type Kind<'a> = (&'a str, &'a dyn Fn(&str) -> String);

/// Whatever names an extension uses, it hides nothing of the program, and nothing of the program hides them.
#[test]
fn every_name_of_ours_may_be_an_extensions_own() {
    let declare: [Kind; 5] = [
        ("a constant", &|n| format!("const {n} = 2.0;\nfn own_command(a: f32) -> f32 {{\n    return a * {n};\n}}\n")),
        ("a function", &|n| {
            format!(
                "fn {n}(b: f32) -> f32 {{\n    return b;\n}}\nfn own_command(a: f32) -> f32 {{\n    return {n}(a);\n}}\n"
            )
        }),
        ("a struct", &|n| {
            format!("struct {n} {{\n    {n}: f32,\n}}\nfn own_command(a: f32) -> f32 {{\n    return {n}(a).{n};\n}}\n")
        }),
        ("an alias", &|n| {
            format!(
                "alias {n} = bool;\nfn own_command(a: f32) -> f32 {{\n    let b: {n} = a > 1.0;\n    return select(a, 1.0, b);\n}}\n"
            )
        }),
        ("a parameter", &|n| {
            format!(
                "struct Parameters {{\n    /// share [-], 0 to 1, neutral 0\n    {n}: f32,\n}}\nfn own_command(own: Parameters, a: f32) -> f32 {{\n    return a * own.{n};\n}}\n"
            )
        }),
    ];
    let remembers = |n: &str| {
        format!(
            "struct State {{\n    /// starts at 0\n    {n}: f32,\n}}\nstruct Done {{\n    a: f32,\n    state: State,\n}}\n\
             fn {n}_command(state: State, a: f32) -> Done {{\n    return Done(a + state.{n}, State(a));\n}}\n"
        )
    };
    let words: Vec<String> = words_of_ours().into_iter().collect();
    assert!(words.len() > 300, "{}", words.len());
    let (words, _) = sample::split(words);
    let mut texts: Vec<(&str, String, String)> = Vec::new();
    for word in &words {
        for (kind, text) in &declare {
            texts.push(("own", text(word), format!("{word} as {kind}")));
        }
        texts.push((word, remembers(word), format!("{word} as an extension")));
    }
    let share = texts.len().div_ceil(std::thread::available_parallelism().map_or(1, Into::into));
    let accepted: usize = std::thread::scope(|scope| {
        let count = |texts: &[(&str, String, String)]| {
            let fits = texts.iter().enumerate().filter(|(k, (name, text, what))| fits_if_valid(name, text, what, *k));
            fits.count()
        };
        let workers: Vec<_> = texts.chunks(share).map(|texts| scope.spawn(move || count(texts))).collect();
        workers.into_iter().map(|worker| worker.join().expect("no text fails")).sum()
    });
    // The rest are keywords, parameters of the base models, built-in extensions, and names that hide `f32` from their own text.
    assert!(10 * accepted > 8 * texts.len(), "only {accepted} of {} texts are valid", texts.len());
}

/// True if a text is valid; it then fits a base, on the CPU and on the GPU. An invalid one is refused with a place in its own lines.
fn fits_if_valid(name: &str, text: &str, what: &str, turn: usize) -> bool {
    let file = format!("{name}.wgsl");
    let extension = match read_extension(&file, text) {
        Ok(extension) => extension,
        Err(error) => {
            assert_eq!(error.file, file, "{what}: {error}");
            assert!(!error.to_string().contains("__"), "{what}: {error}");
            return false;
        }
    };
    let base = ["idm", "gipps+delay+linear+mfc", "l-cth"][turn % 3];
    let variant = base.parse::<Variant>().expect("a base").with(extension).expect("no conflict");
    let observed = turn.is_multiple_of(2);
    let recipe = Recipe { variant, precision: Precision::Plain, radicand: Radicand::Measured, observed };
    check_model(&recipe).unwrap_or_else(|error| panic!("{what}, {base}, lanes: {error}"));
    kernel_text(&recipe).unwrap_or_else(|error| panic!("{what}, {base}, GPU: {error}"));
    true
}

/// The internal names differ from the written ones; messages must not show them.
#[test]
fn errors_show_names_and_places_as_written() {
    let text = "const gain = 2.0;\nfn half(a: f32) -> f32 {\n    return 0.5 * a;\n}\nfn x_command(a: f32) -> f32 {\n    return gain * gain * half(a) * b;\n}\n";
    let error = read_extension("x.wgsl", text).expect_err("no b").to_string();
    assert!(
        error.starts_with(
            "x.wgsl:6:36: no definition in scope for identifier: `b`\n  return gain * gain * half(a) * b;"
        ),
        "{error}"
    );
    let error = read_extension("x.wgsl", &text.replace("* b;", "* gain.s;")).expect_err("a number").to_string();
    assert!(
        error.starts_with("x.wgsl:6:41: ") && error.ends_with("\n  return gain * gain * half(a) * gain.s;"),
        "{error}"
    );
    // If only some of the base models have a parameter, the others refuse extensions that need it.
    let text =
        "const gain = 2.0;\nfn x_command(p: Params, a: f32) -> f32 {\n    return gain * gain * a * p.theta;\n}\n";
    let variant = "idm".parse::<Variant>().expect("a base").with(read_extension("x.wgsl", text).expect("valid"));
    let error = variant.expect_err("IDM has no theta").to_string();
    assert_eq!(error, "extension x: it uses theta, and idm has no theta; take a model that has one");
}
