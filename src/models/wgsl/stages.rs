//! The generated part of an extended model: the memory of the extensions, and the functions that call them stage by stage.

use super::compose::{DECAY, Recipe};
use super::extension::EQUILIBRIUM;
use super::own_names::{member, memory_of, prefix};
use crate::extension::{Argument, Extension, Initial, Signal, Stage, StageFunction};
use crate::symbols::Symbol;
use std::fmt::Write;
use strum::VariantArray;

/// Largest spacing \[m\] at which an equilibrium is searched: beyond the range of any sensor.
const EQUILIBRIUM_REACH_M: f32 = 300.0;
/// Number of halvings of the interval: to 0.02 mm.
const HALVINGS: usize = 24;
/// The time step \[s\] for laws that command a speed.
const STEADY_STEP_S: f32 = 0.1;

/// Type of the value that a stage changes.
pub(super) fn value_type(stage: Stage) -> &'static str {
    match stage {
        Stage::Policy => "Params",
        Stage::Perception => "Perceived",
        Stage::Speed | Stage::Law | Stage::Command | Stage::Response => "f32",
    }
}

/// `Memory` and the functions `stage_...`, `driven` and `forgetting` that step_extended.wgsl calls.
pub(super) fn text(recipe: &Recipe) -> String {
    let extensions = recipe.variant.extensions.list();
    let mut text = String::from("struct Memory {\n");
    if recipe.observed {
        text += "    // Missing acceleration [m/s2].\n    d: f32,\n";
    }
    for extension in extensions.iter().filter(|e| !e.state.is_empty()) {
        let (member, own) = (memory_of(extension), prefix(&extension.name));
        writeln!(text, "    {member}: {own}State,").expect("a String takes all");
    }
    if !recipe.observed && extensions.iter().all(|e| e.state.is_empty()) {
        text += "    // A struct needs a member.\n    nothing: f32,\n";
    }
    text += "}\n";
    for &stage in Stage::VARIANTS {
        text += &stage_text(stage, extensions);
    }
    let (driven, kept) = match recipe.observed {
        true => (
            "    var next = moved(now, a + memory.d, dx_l, dt);\n    next.a_f = next.a_f - memory.d;\n    return next;\n",
            format!("    after.d = after.d * p.{DECAY};\n"),
        ),
        false => ("    return moved(now, a, dx_l, dt);\n", String::new()),
    };
    text += &format!("fn driven(now: Motion, a: f32, memory: Memory, dx_l: f32, dt: f32) -> Motion {{\n{driven}}}\n");
    text += "fn forgetting(p: Params, memory: Memory) -> Memory {\n";
    text += &format!("    var after = memory;\n{kept}    return after;\n}}\n");
    text
}

fn stage_text(stage: Stage, extensions: &[&'static Extension]) -> String {
    let (kind, name) = (value_type(stage), stage.into_str());
    let handed = format!("{stage:?}Stage");
    let mut text = format!("struct {handed} {{\n    value: {kind},\n    memory: Memory,\n}}\n");
    // In the first two stages, the value is already in the list of arguments.
    let (given, last) = match stage {
        Stage::Policy => ("q", ""),
        Stage::Perception => ("x", ""),
        Stage::Speed | Stage::Law | Stage::Command | Stage::Response => ("given", ", given: f32"),
    };
    text += &format!(
        "fn stage_{name}(p: Params, q: Params, w: World, x: Perceived{last}, memory: Memory) -> {handed} {{\n"
    );
    text += &format!("    var value = {given};\n    var after = memory;\n");
    let of = |e: &&'static Extension| e.stages.iter().filter(|f| f.stage == stage).map(|f| (*e, f)).collect::<Vec<_>>();
    for (k, (extension, function)) in extensions.iter().flat_map(of).enumerate() {
        text += &call(extension, function, if k % 2 == 0 { "opaque_even" } else { "opaque_odd" });
    }
    text + &format!("    return {handed}(value, after);\n}}\n")
}

/// `law_at`, the acceleration that a law commands in steady driving, and `equilibrium_spacing`: the law's own, or the spacing without
/// acceleration, found by bisection.
pub(super) fn equilibrium(law: &Extension) -> String {
    let (name, own) = (&law.name, own(law, "p"));
    let prefix = prefix(name);
    let function = law.stages.iter().find(|f| f.stage == Stage::Law).expect("a law has the stage");
    let start = |(_, initial): &(String, Initial)| match initial {
        Initial::Value(value) => format!("{value:?}"),
        Initial::Measured(Signal::S) => "s".to_owned(),
        Initial::Measured(Signal::Vf) => "v".to_owned(),
        Initial::Measured(Signal::Vl) => "v_l".to_owned(),
        Initial::Measured(Signal::Af) => "0.0".to_owned(),
    };
    let argument = |argument: &Argument| match argument {
        Argument::Params => "p".to_owned(),
        Argument::Own => own.clone(),
        Argument::State => format!("{prefix}State({})", law.state.iter().map(start).collect::<Vec<_>>().join(", ")),
        Argument::World => format!("World(0.0, {STEADY_STEP_S:?}, 0.0, 0.0, s, v, 0.0, 0.0, v_l, s, v_l, v_l)"),
        Argument::Perceived => "Perceived(s, v, v_l)".to_owned(),
        Argument::Value => "v".to_owned(),
    };
    let arguments: Vec<String> = function.arguments.iter().map(argument).collect();
    let value = function.with_state.as_ref().map_or(String::new(), |[value, _]| format!(".{value}"));
    let mut text = format!(
        "fn law_at(p: Params, s: f32, v: f32, v_l: f32) -> f32 {{\n    return {prefix}{name}_law({}){value};\n}}\n",
        arguments.join(", ")
    );
    text += "fn equilibrium_spacing(p: Params, v: f32) -> f32 {\n";
    if law.equilibrium {
        return text + &format!("    return {prefix}{name}_{EQUILIBRIUM}({own}, v);\n}}\n");
    }
    text += &format!("    var low = 0.0;\n    var high = {EQUILIBRIUM_REACH_M:?};\n");
    for k in 0..HALVINGS {
        text += &format!(
            "    let middle_{k} = 0.5 * (low + high);\n    let is_far_{k} = law_at(p, middle_{k}, v, v) > 0.0;\n    \
             low = select(middle_{k}, low, is_far_{k});\n    high = select(high, middle_{k}, is_far_{k});\n"
        );
    }
    text + "    return 0.5 * (low + high);\n}\n"
}

/// The `Parameters` of an extension. Those of a law that are in the paper's table are values after the policy.
fn own(extension: &Extension, policy: &str) -> String {
    let value = |symbol: &Symbol| match symbol {
        Symbol::Extension(_) => format!("p.{}", member(*symbol)),
        _ => format!("{policy}.{}", member(*symbol)),
    };
    let values: Vec<String> = extension.parameters.iter().map(value).collect();
    format!("{}Parameters({})", prefix(&extension.name), values.join(", "))
}

/// The call of one stage function, on `value` and `after`; its result passes through `opaque`.
fn call(extension: &Extension, function: &StageFunction, opaque: &str) -> String {
    let name = &extension.name;
    let argument = |argument: &Argument| match (argument, function.stage) {
        (Argument::Params, Stage::Policy) | (Argument::Perceived, Stage::Perception) | (Argument::Value, _) => {
            "value".to_owned()
        }
        (Argument::Params, _) => "q".to_owned(),
        (Argument::Perceived, _) => "x".to_owned(),
        (Argument::World, _) => "w".to_owned(),
        (Argument::State, _) => format!("after.{}", memory_of(extension)),
        (Argument::Own, Stage::Policy) => own(extension, "value"),
        (Argument::Own, _) => own(extension, "q"),
    };
    let arguments: Vec<String> = function.arguments.iter().map(argument).collect();
    let stage = function.stage.into_str();
    let called = format!("{}{name}_{stage}({})", prefix(name), arguments.join(", "));
    let done = format!("{name}_{stage}_done");
    let (value, state) = match &function.with_state {
        None => (done.clone(), String::new()),
        Some([value, state]) => {
            (format!("{done}.{value}"), format!("    after.{} = {done}.{state};\n", memory_of(extension)))
        }
    };
    // Opaque, because Mesa would reorder terms of one extension and of the next stage.
    let seen = match function.stage {
        Stage::Policy => value,
        Stage::Perception => format!("Perceived({opaque}({value}.s), {opaque}({value}.v_f), {opaque}({value}.v_l))"),
        Stage::Speed | Stage::Law | Stage::Command | Stage::Response => format!("{opaque}({value})"),
    };
    format!("    let {done} = {called};\n    value = {seen};\n{state}")
}
