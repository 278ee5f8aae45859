//! The generated part of an extended model: what the extensions remember, and the functions that call them stage by stage.

use super::compose::{DECAY, Recipe};
use super::own_names::{member, memory_of, prefix};
use crate::extension::{Argument, Extension, Stage, StageFunction};
use std::fmt::Write;

/// Type of the value that a stage changes.
fn value_type(stage: Stage) -> &'static str {
    match stage {
        Stage::Policy => "Params",
        Stage::Perception => "Perceived",
        Stage::Speed | Stage::Command | Stage::Response => "f32",
    }
}

/// Name of a struct that a stage hands on.
fn handed_on(stage: Stage) -> &'static str {
    match stage {
        Stage::Policy => "PolicyStage",
        Stage::Perception => "PerceptionStage",
        Stage::Speed => "SpeedStage",
        Stage::Command => "CommandStage",
        Stage::Response => "ResponseStage",
    }
}

/// `Memory` and the functions `stage_...`, `missing_acceleration` and `forgetting` that step_extended.wgsl calls.
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
    for stage in Stage::ALL {
        text += &stage_text(stage, extensions);
    }
    let (missing, kept) = match recipe.observed {
        true => ("memory.d", format!("    after.d = after.d * p.{DECAY};\n")),
        false => ("0.0", String::new()),
    };
    text += "fn missing_acceleration(memory: Memory) -> f32 {\n";
    text += &format!("    return {missing};\n}}\n");
    text += "fn forgetting(p: Params, memory: Memory) -> Memory {\n";
    text += &format!("    var after = memory;\n{kept}    return after;\n}}\n");
    text
}

fn stage_text(stage: Stage, extensions: &[&'static Extension]) -> String {
    let (kind, handed) = (value_type(stage), handed_on(stage));
    let mut text = format!("struct {handed} {{\n    value: {kind},\n    memory: Memory,\n}}\n");
    // At the first two stages the value has a place in the list of arguments already.
    let (seen, last) = match stage {
        Stage::Policy => ("x: Perceived", ""),
        Stage::Perception => ("x: Perceived", ""),
        Stage::Speed | Stage::Command | Stage::Response => ("x: Perceived", ", given: f32"),
    };
    let name = stage.name();
    let given = match stage {
        Stage::Policy => "q",
        Stage::Perception => "x",
        Stage::Speed | Stage::Command | Stage::Response => "given",
    };
    text += &format!("fn stage_{name}(p: Params, q: Params, w: World, {seen}{last}, memory: Memory) -> {handed} {{\n");
    text += &format!("    var value = {given};\n    var after = memory;\n");
    let of = |e: &&'static Extension| e.stages.iter().filter(|f| f.stage == stage).map(|f| (*e, f)).collect::<Vec<_>>();
    for (k, (extension, function)) in extensions.iter().flat_map(of).enumerate() {
        text += &call(extension, function, if k % 2 == 0 { "opaque_even" } else { "opaque_odd" });
    }
    text + &format!("    return {handed}(value, after);\n}}\n")
}

/// The call of one stage function, on `value` and `after`; what it gives goes on through `opaque`.
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
        (Argument::Own, _) => {
            let own: Vec<String> = extension.parameters.iter().map(|p| format!("p.{}", member(*p))).collect();
            format!("{}Parameters({})", prefix(name), own.join(", "))
        }
    };
    let arguments: Vec<String> = function.arguments.iter().map(argument).collect();
    let stage = function.stage.name();
    let called = format!("{}{name}_{stage}({})", prefix(name), arguments.join(", "));
    let (value, state) = match &function.with_state {
        None => (format!("{name}_{stage}_done"), String::new()),
        Some([value, state]) => {
            let done = format!("{name}_{stage}_done");
            (format!("{done}.{value}"), format!("    after.{} = {done}.{state};\n", memory_of(extension)))
        }
    };
    // Opaque, or Mesa takes terms of one extension and of what comes after it in another order.
    let seen = match function.stage {
        Stage::Policy => value,
        Stage::Perception => format!("Perceived({opaque}({value}.s), {opaque}({value}.v_f), {opaque}({value}.v_l))"),
        Stage::Speed | Stage::Command | Stage::Response => format!("{opaque}({value})"),
    };
    format!("    let {name}_{stage}_done = {called};\n    value = {seen};\n{state}")
}
