//! Extensions and laws read from WGSL: stages by the names of functions, parameters and state by the doc comments of two structs.

use super::check::{Checked, ShaderError, check};
use super::compose::{Source, shader};
use super::doc;
use super::limits;
use super::lint;
use super::own_names::prefix;
use super::parameters::Declared;
use super::stages::value_type;
use crate::catalog::{BASES, UnknownVariant, Variant, law_files};
use crate::extension::{Argument, Cause, Extension, LoopNeeds, Stage, StageFunction};
use crate::symbols::{ExtensionParameter, Role, Symbol};
use crate::text::spelling::{nearest, suggestion};
use naga::{Arena, Expression, Function, Handle, Span, Statement, Type, TypeInner};
use std::str::FromStr;
use std::sync::{LazyLock, Mutex};
use strum::VariantArray;

macro_rules! names {
    ($($name:ident,)*) => { &[$(stringify!($name)),*] };
}

const LAWS: &[&str] = law_files!(names);

/// The order of a step: world, policy, perception, command, response.
const EXTENSIONS: &[&str] = names! {
    speed_dep_headway,
    headway_mode_change,
    perception_delay,
    time_offset,
    range_scale,
    range_bias,
    speed_scale,
    lead,
    sensor_lowpass,
    dead_zone,
    integral_action,
    multi_anticipation,
    leader_accel_ff,
    periodic,
    gain_mass,
    set_speed_change,
    accel_cap,
    decel_cap,
    power_cap,
    quantised_accel,
    jerk_limit,
    actuation_lag,
    asym_lag,
    grade,
    aero_drag,
    const_decel,
    probe_road,
    probe_speed,
    probe_thrust,
    probe_gap,
    probe_closing,
    probe_history,
};

/// All extensions that are built in: the causes that a diagnosis knows, and its tools. Panics if one of them is not valid, which a test would have
/// noticed.
pub fn library() -> &'static [&'static Extension] {
    static LIBRARY: LazyLock<Vec<&'static Extension>> = LazyLock::new(|| all("extension", EXTENSIONS));
    &LIBRARY
}

/// All laws that are built in.
pub fn laws() -> &'static [&'static Extension] {
    static LIBRARY: LazyLock<Vec<&'static Extension>> = LazyLock::new(|| all("law", LAWS));
    &LIBRARY
}

fn all(folder: &str, names: &[&'static str]) -> Vec<&'static Extension> {
    let read = |(k, name): (usize, &&'static str)| {
        let (file, text) = shader(&format!("shaders/{folder}/{name}.wgsl"));
        // A law comes before all of them.
        kept(name, file, text, k + 1).expect("tests read all of them")
    };
    names.iter().enumerate().map(read).collect()
}

impl FromStr for Variant {
    type Err = UnknownVariant;

    /// An id or a name; the base model may be a built-in law.
    fn from_str(text: &str) -> Result<Variant, UnknownVariant> {
        // Laws are read at their first use.
        Variant::named(text, &[]).or_else(|_| Variant::named(text, laws()))
    }
}

/// The built-in extension or law with this name.
pub fn extension_named(name: &str) -> Option<&'static Extension> {
    let named = |all: &[&'static Extension]| all.iter().copied().find(|extension| extension.name == name);
    named(library()).or_else(|| named(laws()))
}

/// Reads a user's extension or law; `file` is its name in messages, and the extension is named after it, without folder and `.wgsl`.
pub fn read_extension(file: &str, text: &str) -> Result<&'static Extension, ShaderError> {
    let name = std::path::Path::new(file).file_stem().and_then(std::ffi::OsStr::to_str).unwrap_or_default();
    let plain =
        |message: String| ShaderError { file: file.to_owned(), line: 1, column: 1, message, code: String::new() };
    let is_name = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && !name.ends_with('_')
        && !name.contains("__");
    if !is_name {
        return Err(plain(format!(
            "the file's name is the extension's: expected small letters, digits and single `_`, such as `my_cause.wgsl`, \
             found `{name}`"
        )));
    }
    let taken = extension_named(name).is_some_and(|known| known.text != text);
    if taken || BASES.iter().any(|base| base.name == name) {
        return Err(plain(format!("`{name}` is built in; give the file another name")));
    }
    kept(name, file, text, usize::MAX)
}

/// Extensions are read once: the same name and text give the same one.
fn kept(name: &str, file: &str, text: &str, rank: usize) -> Result<&'static Extension, ShaderError> {
    static KNOWN: Mutex<Vec<&'static Extension>> = Mutex::new(Vec::new());
    let mut known = KNOWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(one) = known.iter().find(|one| one.name == name && one.text == text) {
        return Ok(one);
    }
    let read = Reader::read(name, file, text)?;
    let rank = if read.is_law() { 0 } else { rank };
    let extension: &'static Extension = Box::leak(Box::new(Extension { rank, ..read }));
    known.push(extension);
    Ok(extension)
}

/// Name of the function that gives the spacing at constant speed, after the law's name and `_`.
pub(super) const EQUILIBRIUM: &str = "equilibrium";
/// The function of a model that gives it.
const SPACING: &str = "equilibrium_spacing";

/// A text that is read.
pub(super) struct Reader<'a> {
    pub(super) name: &'a str,
    pub(super) source: Source,
    checked: Checked,
}

impl<'a> Reader<'a> {
    fn read(name: &'a str, file: &str, text: &str) -> Result<Extension, ShaderError> {
        limits::refuse_long_text(file, text)?;
        let mut source = Source::around_an_extension();
        source.push_extension(name, file, text);
        let checked = check(&source)?;
        let reader = Reader { name, source, checked };
        reader.refuse_what_cannot_run()?;
        let state = reader.state()?;
        let stages = reader.stages(!state.is_empty())?;
        let is_law = stages.iter().any(|function| function.stage == Stage::Law);
        let mut parameters = reader.parameters(is_law)?;
        let model_parameters = reader.model_parameters(is_law, &parameters)?;
        let head = doc::Head::of(text).map_err(|message| reader.plain(message))?;
        let position = |wanted: &Option<String>| match wanted {
            None => Ok(None),
            Some(wanted) => {
                match parameters.iter().position(|p| matches!(p, Declared::Own(row) if row.name == *wanted)) {
                    Some(k) => Ok(Some(k)),
                    None => Err(reader.plain(format!("`loop:` names {wanted}, which is not a parameter of this file"))),
                }
            }
        };
        let needs = LoopNeeds { delay: position(&head.delay)?, look_back: position(&head.look_back)? };
        if let Some(Declared::Own(delay)) = needs.delay.map(|k| &mut parameters[k]) {
            delay.role = Role::Delay;
            if delay.lower < 0.0 {
                let ExtensionParameter { name, lower, upper, .. } = delay;
                return Err(reader.plain(format!(
                    "`loop: delay by {name}`: expected bounds of at least 0, found {lower} to {upper}; a delay cannot be negative"
                )));
            }
        }
        if stages.is_empty() && needs.delay.is_none() {
            return Err(reader.no_stage());
        }
        let (search, scale) = reader.traits(&head, &parameters)?;
        for declared in &mut parameters {
            if let Declared::Own(row) = declared {
                (row.search, row.scale) = (search, scale);
            }
        }
        // Lives as long as the program, like the extension itself.
        let symbol = |declared| match declared {
            Declared::Table(symbol) => symbol,
            Declared::Own(row) => Symbol::Extension(Box::leak(Box::new(row))),
        };
        let parameters: Vec<Symbol> = parameters.into_iter().map(symbol).collect();
        let warnings = lint::warnings(name, &reader.source, &reader.checked, &parameters, needs);
        Ok(Extension {
            name: name.to_owned(),
            meaning: head.meaning,
            reference: head.reference,
            text: text.to_owned(),
            file: file.to_owned(),
            parameters,
            stages,
            state,
            reads: reader.members_read("World").map(|(name, _)| name).collect(),
            model_parameters,
            needs,
            equilibrium: is_law && reader.equilibrium()?,
            cause: head.cause.filter(|_| !is_law).map(|cause| Cause { search, ..cause }),
            rank: usize::MAX,
            warnings: warnings.iter().map(ToString::to_string).collect(),
        })
    }

    /// Error if no function is a stage; it names a function that was probably meant as one.
    fn no_stage(&self) -> ShaderError {
        let stages = lint::stages_of(self.name);
        let message = format!("expected at least one of the functions {}, found none", stages.join(", "));
        let idle = lint::idle(self.name, &self.checked);
        let near = idle.iter().find_map(|(name, span)| {
            let stage = nearest(name, stages.iter().map(String::as_str))?;
            Some((*span, format!("{message}, but {name}{}", suggestion(Some(stage)))))
        });
        near.map_or_else(|| self.plain(&message), |(span, message)| self.source.error_at(span, message))
    }

    pub(super) fn plain(&self, message: impl Into<String>) -> ShaderError {
        let file = self.source.last_chunk().to_owned();
        ShaderError { file, line: 1, column: 1, message: message.into(), code: String::new() }
    }

    /// The original name of an own declaration.
    fn own_name<'n>(&self, name: Option<&'n str>) -> Option<&'n str> {
        name?.strip_prefix(self.source.last_prefix())
    }

    /// The function whose name has this ending after the extension's name and `_`, and its place.
    fn function(&self, ending: &str) -> Option<(&Function, Span)> {
        let wanted = format!("{}_{ending}", self.name);
        let functions = &self.checked.module.functions;
        let (handle, function) = functions.iter().find(|(_, f)| self.own_name(f.name.as_deref()) == Some(&wanted))?;
        Some((function, functions.get_span(handle)))
    }

    /// Members of one of the program's structs that it reads or writes, each with a place.
    pub(super) fn members_read(&self, wanted: &str) -> impl Iterator<Item = (String, Span)> {
        lint::members_read(&self.checked, self.source.last_prefix(), wanted).into_iter()
    }

    pub(super) fn refuse<T>(&self, span: Span, message: impl Into<String>) -> Result<T, ShaderError> {
        Err(self.source.error_at(span, message))
    }

    /// A function must terminate and must not access anything outside.
    fn refuse_what_cannot_run(&self) -> Result<(), ShaderError> {
        let module = &self.checked.module;
        let foreign = |name: Option<&str>| self.own_name(name).is_some();
        for (handle, variable) in module.global_variables.iter() {
            if foreign(variable.name.as_deref()) {
                let span = module.global_variables.get_span(handle);
                return self
                    .refuse(span, "a variable of the module: an extension remembers in `State`, and reads no buffer");
            }
        }
        if let Some((handle, _)) = module.overrides.iter().next() {
            return self.refuse(module.overrides.get_span(handle), "an `override`: declare a parameter instead");
        }
        if let Some(entry) = module.entry_points.first() {
            return Err(
                self.plain(format!("`{}` is an entry point: the time loop has its own, write functions", entry.name))
            );
        }
        self.refuse_new_params(&module.global_expressions)?;
        for (_, function) in module.functions.iter().filter(|(_, f)| foreign(f.name.as_deref())) {
            self.refuse_new_params(&function.expressions)?;
            self.refuse_loops(&function.body)?;
        }
        limits::refuse_large_functions(&self.source, &self.checked, &foreign)
    }

    /// The available parameters depend on the model.
    fn refuse_new_params(&self, expressions: &Arena<Expression>) -> Result<(), ShaderError> {
        for (handle, expression) in expressions.iter() {
            if let Expression::ZeroValue(ty) | Expression::Compose { ty, .. } = expression
                && self.type_called(*ty) == Some("Params")
            {
                return self.refuse(
                    expressions.get_span(handle),
                    "a new `Params`: which parameters it has depends on the model; change a copy: `var changed = p;`",
                );
            }
        }
        Ok(())
    }

    fn refuse_loops(&self, block: &naga::Block) -> Result<(), ShaderError> {
        for (statement, span) in block.span_iter() {
            match statement {
                Statement::Loop { .. } => {
                    return self.refuse(*span, "a loop: write the steps out, or remember across time steps in `State`");
                }
                Statement::Switch { .. } => return self.refuse(*span, "`switch`: use `if` or `select`"),
                Statement::Block(inner) => self.refuse_loops(inner)?,
                Statement::If { accept, reject, .. } => {
                    self.refuse_loops(accept)?;
                    self.refuse_loops(reject)?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Members of one of its structs: name, comment, where.
    pub(super) fn members(&self, wanted: &str) -> Result<Vec<(String, String, Span)>, ShaderError> {
        let module = &self.checked.module;
        let Some((handle, ty)) = module.types.iter().find(|(_, ty)| self.own_name(ty.name.as_deref()) == Some(wanted))
        else {
            return Ok(Vec::new());
        };
        let TypeInner::Struct { members, .. } = &ty.inner else {
            return self.refuse(module.types.get_span(handle), format!("`{wanted}`: expected a struct"));
        };
        let mut found = Vec::new();
        for member in members {
            let name = member.name.clone().unwrap_or_default();
            let declared = self.source.member(&(prefix(self.name) + wanted), &name);
            let (span, comment) = declared.unwrap_or_else(|| (module.types.get_span(handle), String::new()));
            if module.types[member.ty].inner != TypeInner::Scalar(naga::Scalar::F32) {
                return self.refuse(span, format!("{wanted}.{name}: expected f32"));
            }
            found.push((name, comment, span));
        }
        Ok(found)
    }

    /// True if the law gives the spacing of a constant speed.
    fn equilibrium(&self) -> Result<bool, ShaderError> {
        let module = &self.checked.module;
        let wanted = format!("{}_{EQUILIBRIUM}", self.name);
        let Some((function, span)) = self.function(EQUILIBRIUM) else {
            return match self.asks_for_equilibrium() {
                Some(span) => self.refuse(
                    span,
                    format!(
                        "`{SPACING}` is computed from this law, which cannot call it; define \
                         `fn {wanted}(own: Parameters, v: f32) -> f32`, the spacing at which the speed v is kept, and call that"
                    ),
                ),
                None => Ok(false),
            };
        };
        let arguments: Vec<Argument> =
            (0..function.arguments.len()).map(|k| self.argument(function, k, span)).collect::<Result<_, _>>()?;
        let is_number = |ty: Handle<Type>| module.types[ty].inner == TypeInner::Scalar(naga::Scalar::F32);
        let returns = function.result.as_ref().is_some_and(|result| is_number(result.ty));
        if arguments != [Argument::Own, Argument::Value] || !returns {
            return self.refuse(
                span,
                format!(
                    "expected `fn {wanted}(own: Parameters, v: f32) -> f32`: the spacing at which the speed v is kept"
                ),
            );
        }
        Ok(true)
    }

    /// Where one of its functions asks for the equilibrium spacing of the model.
    fn asks_for_equilibrium(&self) -> Option<Span> {
        let functions = &self.checked.module.functions;
        let own = functions.iter().filter(|(_, function)| self.own_name(function.name.as_deref()).is_some());
        own.flat_map(|(_, function)| function.expressions.iter().map(move |(handle, one)| (function, handle, one)))
            .find(|(.., one)| {
                matches!(one, Expression::CallResult(called) if functions[*called].name.as_deref() == Some(SPACING))
            })
            .map(|(function, handle, _)| function.expressions.get_span(handle))
    }

    fn state(&self) -> Result<Vec<(String, crate::extension::Initial)>, ShaderError> {
        let read = |(name, comment, span): (String, String, Span)| match doc::initial(&comment) {
            Ok(initial) => Ok((name, initial)),
            Err(message) => self.refuse(span, format!("{name}: {message}")),
        };
        self.members("State")?.into_iter().map(read).collect()
    }

    fn type_called(&self, ty: Handle<Type>) -> Option<&str> {
        self.checked.module.types[ty].name.as_deref()
    }

    fn argument(&self, function: &Function, k: usize, span: Span) -> Result<Argument, ShaderError> {
        let argument = &function.arguments[k];
        let ty = &self.checked.module.types[argument.ty];
        let called = ty.name.as_deref();
        Ok(match (called, self.own_name(called), &ty.inner) {
            (Some("Params"), ..) => Argument::Params,
            (_, Some("Parameters"), _) => Argument::Own,
            (_, Some("State"), _) => Argument::State,
            (Some("World"), ..) => Argument::World,
            (Some("Perceived"), ..) => Argument::Perceived,
            (.., inner) if *inner == TypeInner::Scalar(naga::Scalar::F32) => Argument::Value,
            _ => {
                let name = argument.name.as_deref().unwrap_or("an argument");
                return self.refuse(
                    span,
                    format!(
                        "{name}: expected one of Params, Parameters, State, World, Perceived or f32, found another type"
                    ),
                );
            }
        })
    }

    fn stages(&self, has_state: bool) -> Result<Vec<StageFunction>, ShaderError> {
        let module = &self.checked.module;
        let mut stages = Vec::new();
        for &stage in Stage::VARIANTS {
            let wanted = format!("{}_{}", self.name, stage.into_str());
            let Some((function, span)) = self.function(stage.into_str()) else { continue };
            let arguments: Vec<Argument> =
                (0..function.arguments.len()).map(|k| self.argument(function, k, span)).collect::<Result<_, _>>()?;
            let value = value_type(stage);
            if arguments.contains(&Argument::Value) && matches!(stage, Stage::Policy | Stage::Perception) {
                return self.refuse(
                    span,
                    format!("{wanted}: there is no acceleration yet at this stage; remove the f32 argument"),
                );
            }
            let is_value = |ty: Handle<Type>| {
                if value == "f32" {
                    module.types[ty].inner == TypeInner::Scalar(naga::Scalar::F32)
                } else {
                    self.type_called(ty) == Some(value)
                }
            };
            let expected = format!(
                "{wanted}: expected to return {value}, or a struct of a {value} and a State, in this order, as it changes \
                 {}",
                match stage {
                    Stage::Policy => "the parameters",
                    Stage::Perception => "what is perceived",
                    Stage::Speed => "the present speed",
                    Stage::Law => "the present speed into the commanded acceleration",
                    Stage::Command => "the commanded acceleration",
                    Stage::Response => "the acceleration of the vehicle",
                }
            );
            let Some(result) = &function.result else { return self.refuse(span, expected) };
            let with_state = match &module.types[result.ty].inner {
                _ if is_value(result.ty) => None,
                TypeInner::Struct { members, .. }
                    if members.len() == 2
                        && is_value(members[0].ty)
                        && self.own_name(self.type_called(members[1].ty)) == Some("State") =>
                {
                    Some([0, 1].map(|k| members[k].name.clone().unwrap_or_default()))
                }
                _ => return self.refuse(span, expected),
            };
            stages.push(StageFunction { stage, arguments, with_state });
        }
        if has_state && stages.iter().all(|s| s.with_state.is_none()) {
            return Err(self.plain("`State` is declared, but no stage returns a new one, so it never changes"));
        }
        Ok(stages)
    }
}
