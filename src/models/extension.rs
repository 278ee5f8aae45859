//! Extensions: parts of a model that no base model has, and laws, which are separate base models. Each is one WGSL file, built in or the
//! user's own.
//!
//! The properties of an extension that the rest of the program needs; `wgsl` reads them from the text. An extension is read once and kept
//! for the life of the program, so that variants and symbols that name it stay plain values.

use crate::symbols::{SearchKind, Symbol};
use std::hash::{Hash, Hasher};
use std::sync::Mutex;

/// Stage of a step at which an extension acts, in the order of a step. It is a function called by the extension's name, `_` and the
/// stage's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, strum::IntoStaticStr, strum::VariantArray)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Stage {
    /// Changes the parameters of the base model before anything else.
    Policy,
    /// Changes the perceived values.
    Perception,
    /// Changes the present own speed that a controller starts from (Gipps', and laws that command a speed).
    Speed,
    /// The controller: from the present own speed to the commanded acceleration.
    Law,
    /// Changes the commanded acceleration.
    Command,
    /// Changes the response of the vehicle, before its acceleration is constrained.
    Response,
}

/// Arguments of a stage function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Argument {
    /// `Params`: the parameters of the model.
    Params,
    /// `Parameters`: the extension's own.
    Own,
    /// `State`: the extension's memory.
    State,
    /// `World`: other known values.
    World,
    /// `Perceived`: the perceived values.
    Perceived,
    /// `f32`: the speed or acceleration that it changes.
    Value,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageFunction {
    pub stage: Stage,
    /// Its arguments, in order.
    pub arguments: Vec<Argument>,
    /// Members of the struct that it returns, value first, if it returns a new state beside the value.
    pub with_state: Option<[String; 2]>,
}

/// Initial value of a member of `State`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Initial {
    /// This number.
    Value(f32),
    /// The measured spacing, own speed, speed of the preceding vehicle or own acceleration.
    Measured(Signal),
}

/// A measured signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Spacing.
    S,
    /// Speed of the follower.
    Vf,
    /// Speed of the preceding vehicle.
    Vl,
    /// Acceleration of the follower.
    Af,
}

/// What the time loop does for an extension besides calling it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoopNeeds {
    /// Position among the extension's parameters of a delay \[s\] by which everything is perceived later.
    pub delay: Option<usize>,
    /// Position among the extension's parameters of a time \[s\] by which the speed of the preceding vehicle is looked up
    /// earlier (`w.v_l_then`), and half as much earlier (`w.v_l_half`).
    pub look_back: Option<usize>,
}

impl LoopNeeds {
    /// Each need as written in an extension, and its parameter.
    fn by(self) -> [(&'static str, Option<usize>); 2] {
        [("delay by", self.delay), ("look back by", self.look_back)]
    }
}

/// Description of the cause that an extension represents.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Cause {
    /// The effect in plain words.
    pub in_short: Option<String>,
    /// Its term in the loop.
    pub equation: Option<String>,
    /// The family that is named if the data do not distinguish its members.
    pub family: Option<String>,
    /// Its trace in the residuals of a model without it.
    pub looks_like: String,
    /// Similar causes and parameters.
    pub confounded_with: Vec<String>,
    /// How a diagnosis looks for it.
    pub search: SearchKind,
    /// True if none of its sizes can be negative: a negative size is another cause.
    pub positive: bool,
    /// A family that hides it, and is hidden by it.
    pub hides: Option<String>,
    /// Drive that would distinguish it.
    pub experiment: Option<String>,
}

#[derive(Debug)]
pub struct Extension {
    /// Its name: that of its file.
    pub name: String,
    /// The effect in words.
    pub meaning: String,
    /// Source.
    pub reference: Option<String>,
    /// Its text as written.
    pub text: String,
    /// The file it was read from; a path in the project for a built-in one.
    pub file: String,
    pub parameters: Vec<Symbol>,
    /// Its stages, in the order of a step.
    pub stages: Vec<StageFunction>,
    /// Members of its `State` and their initial values.
    pub state: Vec<(String, Initial)>,
    /// Members of `World` that it reads.
    pub reads: Vec<String>,
    /// Parameters of the model that it reads or changes, without its own. A model must have all of them.
    pub model_parameters: Vec<Symbol>,
    /// Its work in the time loop.
    pub needs: LoopNeeds,
    /// True if it gives the spacing of a constant speed (`NAME_equilibrium`); for a law without it, leadlag searches for the spacing.
    pub equilibrium: bool,
    /// The cause that it represents; `None` for laws and for the tools of a diagnosis.
    pub cause: Option<Cause>,
    /// Probable mistakes of its author, each with its place.
    pub warnings: Vec<String>,
    /// Position in the loop: laws first, then the built-in extensions in their order, then a user's.
    pub rank: usize,
}

impl Extension {
    /// True for a base model.
    pub fn is_law(&self) -> bool {
        self.stages.iter().any(|function| function.stage == Stage::Law)
    }

    /// Its parameters that are not in the paper's table.
    pub fn own_parameters(&self) -> impl Iterator<Item = Symbol> {
        self.parameters.iter().copied().filter(|symbol| matches!(symbol, Symbol::Extension(_)))
    }

    /// The family of causes that are hard to distinguish; by default its own name.
    pub fn family(&self) -> &str {
        self.cause.as_ref().and_then(|cause| cause.family.as_deref()).unwrap_or(&self.name)
    }

    /// Shortest description that its file has.
    pub fn in_short(&self) -> &str {
        self.cause.as_ref().and_then(|cause| cause.in_short.as_deref()).unwrap_or(&self.meaning)
    }

    /// How a diagnosis looks for it.
    pub fn search(&self) -> SearchKind {
        self.cause.as_ref().map_or(SearchKind::Size, |cause| cause.search)
    }

    /// True if it reads this member of `World`.
    pub fn reads(&self, member: &str) -> bool {
        self.reads.iter().any(|name| name == member)
    }
}

impl PartialEq for Extension {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.text == other.text
    }
}

impl Eq for Extension {}

impl Hash for Extension {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name.hash(state);
        self.text.hash(state);
    }
}

/// The extensions of a variant, in the order in which they act.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Extensions(&'static [&'static Extension]);

/// Two extensions that exclude each other.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExtensionConflict {
    #[error("extension {name}: the model contains it already")]
    Twice { name: String },
    #[error("{name} is a law, a separate base model: give it as the model, such as `--model {name}.wgsl`")]
    Law { name: String },
    #[error("extension {name}: it uses {parameter}, and {model} has no {parameter}; take a model that has one")]
    Lacks { name: String, model: String, parameter: &'static str },
    #[error("extension {name}: the extensions of a model may have {limit} parameters together, found {found}")]
    Many { name: String, limit: usize, found: usize },
    #[error(
        "extension {name}: its `loop: {what}` cannot act together with that of {other}, because a model has one such line; remove one \
         of them"
    )]
    Loop { name: String, what: &'static str, other: String },
    #[error("extension {name}: its parameter {parameter} is one of {other} already; give it another name")]
    Parameter { name: String, parameter: String, other: String },
}

static KNOWN: Mutex<Vec<&'static [&'static Extension]>> = Mutex::new(Vec::new());

impl Extensions {
    /// No extension.
    pub const NONE: Extensions = Extensions(&[]);

    /// These and one more, in the order in which they act.
    pub fn with(self, extension: &'static Extension) -> Extensions {
        let mut all = self.0.to_vec();
        all.push(extension);
        all.sort_by_key(|e| e.rank);
        Extensions::kept(all)
    }

    /// These without one.
    pub fn without(self, name: &str) -> Extensions {
        Extensions::kept(self.0.iter().copied().filter(|e| e.name != name).collect())
    }

    /// The unique list of these extensions.
    fn kept(all: Vec<&'static Extension>) -> Extensions {
        if all.is_empty() {
            return Extensions::NONE;
        }
        let mut known = KNOWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(list) = known.iter().find(|list| **list == all.as_slice()) {
            return Extensions(list);
        }
        let list: &'static [&'static Extension] = Box::leak(all.into_boxed_slice());
        known.push(list);
        Extensions(list)
    }

    /// In the order in which they act.
    pub fn list(self) -> &'static [&'static Extension] {
        self.0
    }

    /// True without any.
    pub fn is_empty(self) -> bool {
        self.0.is_empty()
    }

    pub fn get(self, name: &str) -> Option<&'static Extension> {
        self.0.iter().copied().find(|e| e.name == name)
    }

    /// Work of the time loop that another extension already requires.
    pub(crate) fn loop_conflict(self, one: &Extension) -> Option<ExtensionConflict> {
        one.needs.by().into_iter().enumerate().find_map(|(k, (what, parameter))| {
            parameter?;
            let other = self.0.iter().find(|e| e.needs.by()[k].1.is_some())?.name.clone();
            Some(ExtensionConflict::Loop { name: one.name.clone(), what, other })
        })
    }

    /// True if one of them reads this member of `World`.
    pub fn read(self, member: &str) -> bool {
        self.0.iter().any(|e| e.reads(member))
    }

    /// The parameter by which perception is later, if any.
    pub fn delay(self) -> Option<Symbol> {
        self.0.iter().find_map(|e| e.needs.delay.map(|k| e.parameters[k]))
    }

    /// The parameter by which the leader is looked up earlier, if any.
    pub fn look_back(self) -> Option<Symbol> {
        self.0.iter().find_map(|e| e.needs.look_back.map(|k| e.parameters[k]))
    }
}
