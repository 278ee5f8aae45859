//! Valid parts of an extension that are probably mistakes: a function that is not a stage and that nothing calls, a parameter that
//! nothing reads.

use super::check::{Checked, ShaderError};
use super::compose::Source;
use super::extension::EQUILIBRIUM;
use super::limits::visit;
use super::own_names::prefix;
use crate::extension::{LoopNeeds, Stage};
use crate::symbols::Symbol;
use crate::text::spelling::{nearest, suggestion};
use naga::{Expression, Function, Statement, TypeInner};
use strum::VariantArray;

/// Names that the stage functions of an extension have.
pub(super) fn stages_of(name: &str) -> Vec<String> {
    Stage::VARIANTS.iter().map(|stage| format!("{name}_{}", stage.into_str())).collect()
}

/// Warnings about the extension that was pushed last.
pub(super) fn warnings(
    name: &str,
    source: &Source,
    checked: &Checked,
    parameters: &[Symbol],
    needs: LoopNeeds,
) -> Vec<ShaderError> {
    let mut warnings: Vec<ShaderError> = idle(name, checked)
        .into_iter()
        .map(|(function, span)| {
            let stages = stages_of(name);
            let meant = match nearest(&function, stages.iter().map(String::as_str)) {
                None => format!("; the stages are {}", stages.join(", ")),
                near => suggestion(near),
            };
            source
                .error_at(span, format!("{function} is not a stage, and nothing calls it, so it has no effect{meant}"))
        })
        .collect();
    let prefix = prefix(name);
    let read = members_read(checked, &prefix, &format!("{prefix}Parameters"));
    let in_loop = |k: usize| [needs.delay, needs.look_back].contains(&Some(k));
    for (k, symbol) in parameters.iter().enumerate() {
        let parameter = symbol.name();
        if !in_loop(k) && !read.iter().any(|(member, _)| member == parameter) {
            let declared = source.member(&format!("{prefix}Parameters"), parameter);
            let span = declared.map(|(span, _)| span).unwrap_or_default();
            let message = format!(
                "no function reads the parameter {parameter}, so it has no effect in a calibration: use or remove it"
            );
            warnings.push(source.error_at(span, message));
        }
    }
    warnings
}

/// Own functions that are not stages and that nothing calls, and their places.
pub(super) fn idle(name: &str, checked: &Checked) -> Vec<(String, naga::Span)> {
    let functions = &checked.module.functions;
    let mut called = Vec::new();
    for (_, function) in functions.iter() {
        visit(&function.body, 0, &mut |statement, _| {
            if let Statement::Call { function, .. } = statement {
                called.push(*function);
            }
        });
    }
    let (mut stages, own) = (stages_of(name), prefix(name));
    stages.push(format!("{name}_{EQUILIBRIUM}"));
    let left = functions.iter().filter(|(handle, _)| !called.contains(handle)).filter_map(|(handle, function)| {
        let own = function.name.as_deref()?.strip_prefix(&own)?;
        (!stages.iter().any(|stage| stage == own)).then(|| (own.to_owned(), functions.get_span(handle)))
    });
    left.collect()
}

/// Members of a struct that the functions of an extension read or write, each with the first place.
pub(super) fn members_read(checked: &Checked, prefix: &str, wanted: &str) -> Vec<(String, naga::Span)> {
    let module = &checked.module;
    let mut read: Vec<(String, naga::Span)> = Vec::new();
    let is_own = |function: &Function| function.name.as_deref().is_some_and(|name| name.starts_with(prefix));
    for (handle, function) in module.functions.iter().filter(|(_, function)| is_own(function)) {
        let info = &checked.info[handle];
        for (place, expression) in function.expressions.iter() {
            let Expression::AccessIndex { base, index } = expression else { continue };
            // A variable is reached through a pointer.
            let ty = match info[*base].ty.inner_with(&module.types) {
                TypeInner::Pointer { base, .. } => Some(*base),
                _ => info[*base].ty.handle(),
            };
            let Some(ty) = ty.map(|ty| &module.types[ty]) else { continue };
            if let (Some(name), TypeInner::Struct { members, .. }) = (ty.name.as_deref(), &ty.inner)
                && name == wanted
                && let Some(member) = &members[*index as usize].name
                && read.iter().all(|(known, _)| known != member)
            {
                read.push((member.clone(), function.expressions.get_span(place)));
            }
        }
    }
    read
}
