//! Every composed text is valid WGSL, errors give their own file, and a review sees the text that runs.

use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Radicand;
use leadlag::internal::wgsl::{Precision, Recipe, Source, check};
use std::path::Path;

fn recipe(variant: &str, precision: Precision) -> Recipe {
    Recipe { variant: variant.parse().expect("a variant"), precision, radicand: Radicand::Measured, observed: false }
}

#[test]
fn every_variant_composes() {
    for variant in Variant::all() {
        for precision in [Precision::Plain, Precision::Compensated] {
            for radicand in [Radicand::Measured, Radicand::Shifted] {
                let source = Source::model(&Recipe { variant, precision, radicand, observed: false });
                check(&source).unwrap_or_else(|e| panic!("{variant}: {e}"));
            }
        }
    }
}

/// A part that is broken in one place: file, replaced text, replacement, message.
const BROKEN: &[(&str, &str, &str, &str)] = &[
    (
        "shaders/controller/idm.wgsl",
        "let per_v_0 = 1.0 / p.v_0;",
        "let per_v_0 = 1.0 / p.v_0",
        "shaders/controller/idm.wgsl:4:5: expected `;`, found \"let\"\n  let closeness = s_des / x.s;",
    ),
    (
        "shaders/controller/idm.wgsl",
        "p.delta",
        "p.theta",
        "shaders/controller/idm.wgsl:5:62: Params has no field theta; this variant has delta, v_0, d_0, t_h, a_max, a_min, tau_a\n  return Command(p.a_max * (1.0 - power(x.v_f * per_v_0, p.theta) - closeness * closeness), true);",
    ),
    (
        "shaders/controller/idm.wgsl",
        "s_des / x.s",
        "s_des / x.gap",
        "shaders/controller/idm.wgsl:4:31: Perceived has no field gap; it has s, v_f, v_l\n  let closeness = s_des / x.gap;",
    ),
    (
        "shaders/controller/idm.wgsl",
        ", true)",
        ")",
        "shaders/controller/idm.wgsl:5:12: Function [6] 'commanded_acceleration' is invalid: Expression [19] is invalid: Composing expects 2 components but 1 were given\n  return Command(p.a_max * (1.0 - power(x.v_f * per_v_0, p.delta) - closeness * closeness));",
    ),
    (
        "shaders/controller/idm.wgsl",
        "power(",
        "powr(",
        "shaders/controller/idm.wgsl:5:37: no definition in scope for identifier: `powr`\n  return Command(p.a_max * (1.0 - powr(x.v_f * per_v_0, p.delta) - closeness * closeness), true);",
    ),
    (
        "shaders/spacing/idm_desired.wgsl",
        "max(",
        "maximum(",
        "shaders/spacing/idm_desired.wgsl:5:20: no definition in scope for identifier: `maximum`\n  return p.d_0 + maximum(p.t_h * x.v_f - x.v_f * dv * brake, 0.0);",
    ),
    (
        "shaders/spacing/idm_desired.wgsl",
        "-> f32",
        "-> i32",
        "shaders/spacing/idm_desired.wgsl:5:12: Function [5] 'desired_spacing' is invalid: The `return` expression Some([24]) does not match the declared return type Some([7])\n  return p.d_0 + max(p.t_h * x.v_f - x.v_f * dv * brake, 0.0);",
    ),
    (
        "shaders/spacing/idm_desired.wgsl",
        "desired_spacing(",
        "wanted_spacing(",
        "shaders/step.wgsl:15:17: no definition in scope for identifier: `desired_spacing`\n  let s_des = desired_spacing(p, x);",
    ),
    (
        "shaders/dynamics/linear.wgsl",
        "ego: Ego",
        "ego: Car",
        "shaders/dynamics/linear.wgsl:2:49: no definition in scope for identifier: `Car`\n  fn vehicle_response(p: Params, a_cmd: f32, ego: Car, road: Road) -> f32 {",
    ),
    (
        "shaders/dynamics/linear.wgsl",
        "+ a_cmd",
        "+ true",
        "shaders/dynamics/linear.wgsl:5:13: Function [7] 'vehicle_response' is invalid: Expression [14] is invalid: Operation Add can't work with [12] (of type Scalar(Scalar { kind: Float, width: 4 })) and [13] (of type Scalar(Scalar { kind: Bool, width: 1 }))\n  return (r * ego.a_f + true) * per_step;",
    ),
    (
        "shaders/constraint/constant.wgsl",
        "-7.0",
        "1e39",
        "shaders/constraint/constant.wgsl:3:23: the concrete type `f32` cannot represent the abstract value `1e39` accurately\n  return min(max(a, 1e39), 5.0);",
    ),
    (
        "shaders/constraint/constant.wgsl",
        "min(max(a, -7.0), 5.0)",
        "min(max(a, 7), 5u)",
        "shaders/constraint/constant.wgsl:3:12: inconsistent type passed as argument #2 to `min` (argument #2 has type u32; this argument has type f32, which constrains subsequent arguments)\n  return min(max(a, 7), 5u);",
    ),
    (
        "shaders/constraint/constant.wgsl",
        "return",
        "retrun",
        "shaders/constraint/constant.wgsl:3:12: expected assignment or increment/decrement, found \"min\"\n  retrun min(max(a, -7.0), 5.0);",
    ),
    (
        "shaders/step.wgsl",
        "let a_free = ",
        "let command = ",
        "shaders/step.wgsl:18:9: redefinition of `command` (previous definition of `command`)\n  let command = vehicle_response(p, command.a_cmd, ego, road);",
    ),
];

#[test]
fn errors_point_into_the_file_of_the_part() {
    for (file, old, new, expected) in BROKEN {
        let source = Source::model_with(&recipe("idm+linear+constant", Precision::Plain), &|name, text| {
            (name == *file).then(|| {
                assert_eq!(text.matches(old).count(), 1, "{file} has `{old}` once");
                text.replace(old, new)
            })
        });
        let message = check(&source).map(|_| "no error".to_owned()).unwrap_or_else(|e| e.to_string());
        assert_eq!(message, *expected, "{file}: `{old}` -> `{new}`");
    }
}

#[test]
fn a_text_of_ones_own_is_named_as_given() {
    let source = Source::single("my.wgsl", "fn f() -> f32 {\n    return 1.0 +;\n}\n");
    let error = check(&source).expect_err("an operand is missing");
    assert_eq!((error.file.as_str(), error.line, error.column), ("my.wgsl", 2, 17));
}

#[test]
fn lines_are_found_in_their_files() {
    let source = Source::model(&recipe("gipps+linear+mfc", Precision::Compensated));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (i, line) in source.text().lines().enumerate() {
        let (file, number) = source.locate(i + 1);
        if let Ok(text) = std::fs::read_to_string(root.join(file)) {
            assert_eq!(text.lines().nth(number - 1), Some(line), "{file}:{number}");
        } else {
            assert_eq!(file, "generated: Params");
        }
    }
}
