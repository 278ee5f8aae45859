//! Forbidden parts of an extension give an error with their place, before anything exhausts stack or memory.

mod names;
mod nesting;

use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Radicand;
use leadlag::internal::extension::{Extension, Initial};
use leadlag::internal::lanes::check_model;
use leadlag::internal::symbols::{Bounds, EXTENSION_PARAMETERS};
use leadlag::internal::wgsl::{Precision, Recipe, extension_named, read_extension};
use std::fmt::Write;

#[test]
fn what_an_extension_may_not_have_is_said() {
    let cases: &[(&str, &str, &str)] = &[
        (
            "x.wgsl",
            "fn x_command(a: f32) -> f32 {\n    return b;\n}\n",
            "x.wgsl:2:12: no definition in scope for identifier: `b`",
        ),
        (
            "x.wgsl",
            "fn x_command(a: f32) -> f32 {\n    var b = a;\n    loop { break; }\n    return b;\n}\n",
            "x.wgsl:3:5: a loop",
        ),
        (
            "x.wgsl",
            "fn x_command(a: f32) -> f32 {\n    var b = a;\n    for (var i = 0; i < 3; i++) { b = b + a; }\n    return b;\n}\n",
            "x.wgsl:3:5: a loop",
        ),
        (
            "x.wgsl",
            "var<private> kept: f32;\nfn x_command(a: f32) -> f32 {\n    return a;\n}\n",
            "x.wgsl:1:1: a variable of the module",
        ),
        (
            "x.wgsl",
            "@group(0) @binding(0) var<storage> data: array<f32>;\nfn x_command(a: f32) -> f32 {\n    return data[0];\n}\n",
            "x.wgsl:1:23: a variable of the module",
        ),
        ("x.wgsl", "fn x_command(a: f32) -> f32 {\n    return x_command(a);\n}\n", "x.wgsl:"),
        (
            "x.wgsl",
            "fn y_command(a: f32) -> f32 {\n    return a;\n}\n",
            "x.wgsl:1:1: expected at least one of the functions x_policy, x_perception, x_speed, x_law, x_command, x_response, found none",
        ),
        (
            "x.wgsl",
            "const c = 1.0;\nfn x_comand(a: f32) -> f32 {\n    return a * c;\n}\n",
            "x.wgsl:2:1: expected at least one of the functions x_policy, x_perception, x_speed, x_law, x_command, x_response, found none, but \
             x_comand; did you mean `x_command`?",
        ),
        (
            "x.wgsl",
            "// Not f64.\nfn x_command(a: f64) -> f32 {\n    return 1.0;\n}\n",
            "x.wgsl:2:17: f64: extensions compute in f32, as GPUs do",
        ),
        (
            "x.wgsl",
            "fn x_command(a: f32) -> f32 {\n    let b = 1.5lf;\n    return a;\n}\n",
            "x.wgsl:2:13: f64: extensions compute in f32",
        ),
        (
            "x.wgsl",
            "fn x_command(a: f32) -> f32 {\n    return f32(f64(a) * 2.0lf);\n}\n",
            "x.wgsl:2:16: f64: extensions compute in f32",
        ),
        (
            "x.wgsl",
            "fn x_command(a: f32) -> f32 {\n    let b = 1.5h;\n    return a;\n}\n",
            "x.wgsl:2:13: f16: extensions compute in f32",
        ),
        (
            "x.wgsl",
            "fn x_command(a: f16) -> f32 {\n    return 1.0;\n}\n",
            "x.wgsl:1:17: f16: extensions compute in f32",
        ),
        ("x.wgsl", "fn x_command(a: f32) -> bool {\n    return a > 0.0;\n}\n", "x.wgsl:1:"),
        (
            "x.wgsl",
            "struct Parameters {\n    gain: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.gain;\n}\n",
            "x.wgsl:2:5: gain: expected a doc comment such as",
        ),
        (
            "x.wgsl",
            "struct Parameters {\n    /// speed [m/s], 0 to 1\n    v_0: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.v_0;\n}\n",
            "x.wgsl:3:5: v_0 is a parameter of the base models",
        ),
        (
            "x.wgsl",
            "struct State {\n    /// starts at 0\n    a: f32,\n}\nfn x_command(state: State, a: f32) -> f32 {\n    return a + state.a;\n}\n",
            "x.wgsl:1:1: `State` is declared, but no stage returns a new one",
        ),
        (
            "x.wgsl",
            "fn x_command(p: Params, a: f32) -> f32 {\n    return a * p.tau_g;\n}\n",
            "x.wgsl:2:18: Params has no field tau_g",
        ),
        (
            "x.wgsl",
            "fn x_command(w: World, a: f32) -> f32 {\n    return a * w.slope;\n}\n",
            "x.wgsl:2:18: World has no field slope; it has t, dt, x_f, sin_grade, s, v_f, a_f, a_l, v_l2, s_l2",
        ),
        (
            "grade.wgsl",
            "fn grade_command(a: f32) -> f32 {\n    return a;\n}\n",
            "`grade` is built in; give the file another name",
        ),
        ("My Cause.wgsl", "", "the file's name is the extension's"),
        (
            "x.wgsl",
            "//! loop: delay by d\nstruct Parameters {\n    /// delay [s], -1 to 1, neutral 0\n    d: f32,\n}\n",
            "x.wgsl:1:1: `loop: delay by d`: expected bounds of at least 0, found -1 to 1",
        ),
        (
            "x.wgsl",
            "//! search: limit\nstruct Parameters {\n    /// size [-], 0 to 1, neutral 0\n    q: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.q;\n}\n",
            "x.wgsl:1:1: `//! search: limit`: expected one parameter, whose neutral value is its upper bound",
        ),
        (
            "x.wgsl",
            "//! search: event\nstruct Parameters {\n    /// size [-], 0 to 1, neutral 0\n    q: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.q;\n}\n",
            "x.wgsl:1:1: `//! search: event`: expected the parameters that this takes",
        ),
        (
            "x.wgsl",
            "//! search: limits\nstruct Parameters {\n    /// size [-], 0 to 1, neutral 0\n    q: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.q;\n}\n",
            "x.wgsl:1:1: `//! search:`: expected size, limit, steps, event, stretch, harmonic or integral, found `limits`",
        ),
        (
            "x.wgsl",
            "//! scale: log\nstruct Parameters {\n    /// size [-], 0 to 1, neutral 0\n    q: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.q;\n}\n",
            "x.wgsl:1:1: `//! scale:`: expected linear or ratio, found `log`",
        ),
        (
            "x.wgsl",
            "//! sign: negative\nstruct Parameters {\n    /// size [-], 0 to 1, neutral 0\n    q: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.q;\n}\n",
            "x.wgsl:1:1: `//! sign:`: expected positive, found `negative`",
        ),
        (
            "x.wgsl",
            "//! loop: dely by d\nstruct Parameters {\n    /// delay [s], 0 to 1, neutral 0\n    d: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.d;\n}\n",
            "x.wgsl:1:1: expected `//! loop: delay by NAME` or `//! loop: look back by NAME`, found `//! loop: dely by d`",
        ),
        (
            "x.wgsl",
            "struct Parameters {\n    /// size [-], 0 to 1e39, neutral 0\n    q: f32,\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return a * own.q;\n}\n",
            "x.wgsl:3:5: q: expected bounds of a size below 1e9, found 0e0 to 1e39",
        ),
        // The parameters of `Params` depend on the model.
        (
            "x.wgsl",
            "fn x_policy(p: Params) -> Params {\n    return Params();\n}\n",
            "x.wgsl:2:12: a new `Params`: which parameters it has depends on the model",
        ),
        (
            "x.wgsl",
            "const NONE = Params();\nfn x_policy(p: Params) -> Params {\n    return NONE;\n}\n",
            "x.wgsl:1:14: a new `Params`",
        ),
        // Laws that pass here had nothing to calibrate, or did not compile with one of the parts or causes.
        (
            "x.wgsl",
            "fn x_law(x: Perceived) -> f32 {\n    return 0.5 * (x.v_l - x.v_f);\n}\n",
            "x.wgsl:1:1: a law: expected a `struct Parameters` with at least one parameter, found none",
        ),
        (
            "x.wgsl",
            "struct Parameters {\n    v_0: f32,\n}\nfn x_law(p: Params, own: Parameters, x: Perceived) -> f32 {\n    return own.v_0 - p.t_h * x.v_f;\n}\n",
            "x.wgsl:5:22: p.t_h: a law has the parameters of the paper that its `Parameters` declares, and t_h is none of them",
        ),
    ];
    for (file, text, expected) in cases {
        let error = read_extension(file, text).expect_err(expected).to_string();
        assert!(error.contains(expected), "expected {expected}\nfound {error}");
    }
}

/// A model holds only a limited number of parameters.
#[test]
fn more_parameters_than_a_model_can_have_are_refused_where_they_are_declared() {
    let text = |stage: &str, count: usize| {
        let members: String = (0..count).map(|k| format!("    /// size [-], 0 to 1\n    p{k}: f32,\n")).collect();
        format!(
            "struct Parameters {{\n{members}}}\nfn x_{stage}(own: Parameters, v: f32) -> f32 {{\n    return own.p0;\n}}\n"
        )
    };
    for stage in ["law", "command"] {
        let most = read_extension("x.wgsl", &text(stage, EXTENSION_PARAMETERS)).expect("as many as there may be");
        assert_eq!(most.parameters.len(), EXTENSION_PARAMETERS);
        let error =
            read_extension("x.wgsl", &text(stage, EXTENSION_PARAMETERS + 36)).expect_err("too many").to_string();
        let expected = "x.wgsl:51:5: expected at most 24 parameters in a file, found 60";
        assert!(error.starts_with(expected), "{error}");
    }
}

/// Comments on the members of another struct do not concern `Parameters` and `State`.
#[test]
fn comments_are_those_of_the_struct_that_is_meant() {
    let text = "struct ParametersOld {
    /// old gain [-], 5 to 6, neutral 5
    a: f32,
}
struct StateX {
    /// starts at 7
    kept: f32,
}
/* struct Parameters {
    /// gain that is commented out [-], 2 to 3, neutral 2
    a: f32,
} */
struct Parameters {
    /* a: f32, */
    /// gain
    /// [-], 0 to 1, neutral 0
    a: f32, /// of what stands before
    b : f32,
}
struct State
{
    /// starts at 1
    kept: f32
}
struct Done { value: f32, state: State }
fn x_command(own: Parameters, state: State, v: f32) -> Done {
    return Done(v + own.a + own.b, state);
}
";
    let error = read_extension("x.wgsl", text).expect_err("b has no comment").to_string();
    assert!(
        error.starts_with("x.wgsl:18:5: b: expected a doc comment such as") && error.contains("found none"),
        "{error}"
    );
    let text = text.replace("    b : f32,\n", "").replace(" + own.b", "");
    let read = read_extension("x.wgsl", &text).expect("valid");
    let [gain] = read.parameters[..] else { panic!("{:?}", read.parameters) };
    assert_eq!((gain.meaning(), gain.bounds(), gain.neutral()), ("gain", Bounds::Fixed(0.0, 1.0), Some(0.0)));
    assert_eq!(read.state, [("kept".to_owned(), Initial::Value(1.0))]);
}

/// Texts that naga accepts and that are probably mistakes.
#[test]
fn what_does_nothing_is_warned_of_with_its_place() {
    let parameters = "struct Parameters {\n    /// share [-], 0 to 1, neutral 0\n    k: f32,\n}\n";
    let seen = "fn x_percepton(x: Perceived) -> Perceived {\n    return x;\n}\n";
    let used = "fn x_half(a: f32) -> f32 {\n    return 0.5 * a;\n}\nfn x_command(own: Parameters, a: f32) -> f32 {\n    return x_half(a) * own.k;\n}\n";
    let cases: [(String, &[&str]); 4] = [
        (format!("{parameters}{used}"), &[]),
        (
            format!("{seen}{}", command("return a;")),
            &[
                "x.wgsl:1:1: x_percepton is not a stage, and nothing calls it, so it has no effect; did you mean `x_perception`?",
            ],
        ),
        (
            format!("{}fn x_brakes() -> f32 {{ return 1.0; }}\n", command("return a;")),
            &[
                "x.wgsl:4:1: x_brakes is not a stage, and nothing calls it, so it has no effect; the stages are x_policy, x_perception, x_speed, x_law, x_command, x_response",
            ],
        ),
        (
            format!("{parameters}{}", command("return a;")),
            &["x.wgsl:3:5: no function reads the parameter k, so it has no effect in a calibration: use or remove it"],
        ),
    ];
    for (text, expected) in cases {
        let found = &read_extension("x.wgsl", &text).expect("valid").warnings;
        assert_eq!(found.len(), expected.len(), "{found:?}");
        assert!(found.iter().zip(expected).all(|(found, expected)| found.starts_with(expected)), "{found:?}");
    }
    // Parameters of the time loop count as used, and the built-in ones cause no warning.
    for extension in leadlag::internal::wgsl::library() {
        assert_eq!(extension.warnings, [""; 0], "{}", extension.name);
    }
}

/// The time loop delays once and looks back once; a second request was ignored silently.
#[test]
fn what_the_time_loop_does_for_another_extension_is_a_conflict() {
    for (what, taken) in [("delay by", "perception_delay"), ("look back by", "time_offset")] {
        let text = format!(
            "//! loop: {what} ago\nstruct Parameters {{\n    /// how long [s], 0 to 1, neutral 0\n    ago: f32,\n}}\n{}",
            command("return a;")
        );
        let own = read_extension("x.wgsl", &text).expect("allowed");
        let built_in = extension_named(taken).expect("built in");
        let idm: Variant = "idm".parse().expect("a base");
        let message = idm.with(built_in).expect("no conflict").with(own).expect_err("two of them").to_string();
        let expected = format!("extension x: its `loop: {what}` cannot act together with that of {taken}");
        assert!(message.starts_with(&expected), "{message}");
        assert!(idm.with(own).expect("no conflict").with(extension_named("grade").expect("built in")).is_ok());
    }
}

/// A stage function x_command with this body.
fn command(body: &str) -> String {
    format!("fn x_command(a: f32) -> f32 {{\n    {body}\n}}\n")
}

/// Functions f_0 to f_LAST, each with a body made from the name of the one before it, and a stage that calls the last
/// one.
fn functions(last: usize, body: impl Fn(&str) -> String) -> String {
    let mut text = "fn f_0(a: f32) -> f32 { return a + 1.0; }\n".to_owned();
    for i in 1..=last {
        writeln!(text, "fn f_{i}(a: f32) -> f32 {{ return {}; }}", body(&format!("f_{}", i - 1)))
            .expect("a String takes all");
    }
    text + &command(&format!("return f_{last}(a);"))
}

/// As many functions as that, each of which calls the one before it in this many blocks.
fn calls_in_blocks(functions: usize, blocks: usize) -> String {
    let (open, close) = ("{ ".repeat(blocks), " }".repeat(blocks));
    let one =
        |i: usize| format!("fn f_{i}(a: f32) -> f32 {{ var b = a; {open}b = f_{}(a);{close} return b; }}\n", i - 1);
    let all: String = (1..=functions).map(one).collect();
    format!("fn f_0(a: f32) -> f32 {{ return a + 1.0; }}\n{all}{}", command(&format!("return f_{functions}(a);")))
}

/// Each of these overflowed the stack, ran endlessly, or was refused without a place.
#[test]
fn what_is_too_much_is_said_at_once() {
    let nested =
        |open: &str, inner: &str, close: &str, n: usize| format!("{}{inner}{}", open.repeat(n), close.repeat(n));
    let mut structs = "struct S_0 { a: f32, }\n".to_owned();
    for i in 1..25 {
        writeln!(structs, "struct S_{i} {{ a: S_{0}, b: S_{0}, }}", i - 1).expect("a String takes all");
    }
    let constants: String = (0..600).rev().map(|i| format!("const c_{} = c_{i};\n", i + 1)).collect();
    let cases: &[(String, &str)] = &[
        (
            command("return a;") + &" ".repeat(70_000) + "const c = 1.0;",
            "x.wgsl:1:1: expected at most 65536 bytes, found 70",
        ),
        (
            command(&format!("return {};", vec!["a"; 30_000].join("+"))),
            "x.wgsl:2:1013: more than 500 operators in a statement",
        ),
        (
            command(&format!("return {}a;", "- ".repeat(20_000))),
            "x.wgsl:2:1012: more than 500 operators in a statement",
        ),
        (
            command(&format!("return a{};", ".s".repeat(20_000))),
            "x.wgsl:2:1013: more than 500 operators in a statement",
        ),
        (command(&format!("return {};", nested("(", "a", ")", 20_000))), "x.wgsl:2:111: more than 100 nested brackets"),
        (
            command(&format!("return {};", nested("abs(", "a", ")", 8_000))),
            "x.wgsl:2:411: more than 100 nested brackets",
        ),
        (
            command(&format!("var b = a; {} return b;", nested("{", "", "}", 20_000))),
            "x.wgsl:2:115: more than 100 nested brackets",
        ),
        (
            command(&format!("var b = a; {} {{ b = 1.0; }} return b;", "if b > 1.0 { } else ".repeat(3_000))),
            "more than 100 nested brackets",
        ),
        (
            command(&format!("var b: {}f32{}; return a;", "array<".repeat(200), ">".repeat(200))),
            "x.wgsl:2:611: more than 100 nested brackets",
        ),
        (
            format!("const c_0 = 1.0;\n{constants}{}", command("return a;")),
            "x.wgsl:501:20: more than 500 structs, functions",
        ),
        (functions(22, |f| format!("{f}({f}(a))")), "x.wgsl:12:1: f_11: too large with calls inlined"),
        (
            functions(400, |f| format!("{f}(a)")),
            "x.wgsl:102:1: f_101: calls more than 100 deep, each block around a call counted",
        ),
        (calls_in_blocks(3, 50), "x.wgsl:3:1: f_2: calls more than 100 deep"),
        (
            command(&format!("return {}{};", nested("abs(", "a", ")", 90), "+a".repeat(150))),
            "x.wgsl:2:743: more than 500 operators in a statement, each level of its brackets counted",
        ),
        (structs + &command("var s: S_24; return a;"), "x.wgsl:16:8: S_15: a struct of more than 20000 numbers"),
    ];
    for (text, expected) in cases {
        let error = read_extension("x.wgsl", text).expect_err(expected).to_string();
        assert!(error.contains(expected), "expected {expected}\nfound {error}");
        assert!(error.len() < 700, "a line as long as the text: {} bytes", error.len());
    }
}

/// Texts just within the limits also run: on a thread whose stack is small, in every base model.
#[test]
fn what_is_large_but_allowed_is_compiled() {
    let cases: Vec<&'static Extension> = [
        command(&format!("return {};", vec!["a"; 500].join(" + "))),
        command(&format!("return {}a{};", "(".repeat(98), ")".repeat(98))),
        command(&format!("var b = a; {} {{ b = 1.0; }} return b;", "if b > 1.0 { b = 2.0; } else ".repeat(98))),
        functions(10, |f| format!("{f}({f}(a))")),
        functions(98, |f| format!("{f}(a)")),
    ]
    .iter()
    .map(|text| read_extension("x.wgsl", text).expect("allowed"))
    .collect();
    for base in ["idm", "gipps", "l-cth"] {
        for extension in &cases {
            let variant = base.parse::<Variant>().expect("a base").with(extension).expect("no conflict");
            let recipe = Recipe { variant, precision: Precision::Plain, radicand: Radicand::Measured, observed: true };
            let stack = std::thread::Builder::new().stack_size(1 << 20);
            let compiled = stack.spawn(move || check_model(&recipe)).expect("a thread").join().expect("no overflow");
            assert_eq!(compiled, Ok(()), "{base}");
        }
    }
}
