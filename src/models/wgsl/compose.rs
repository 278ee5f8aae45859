//! One text per variant: a generated `Params`, then one file of each folder.

use super::limits::tokens;
use super::own_names::{Prefixed, member};
use super::stages;
use crate::catalog::{Controller, Variant};
use crate::convention::Radicand;
use crate::symbols::Symbol;
use std::fmt::Write;

/// Member of `Params` that a model with an observer has in addition to its parameters.
pub const DECAY: &str = "observer_decay";

/// Path and text of a part.
fn part(folder: &str, name: &str) -> (&'static str, &'static str) {
    shader(&format!("shaders/{folder}/{name}.wgsl"))
}

/// Path and text of a built-in file. Panics for a missing file.
pub(crate) fn shader(path: &str) -> (&'static str, &'static str) {
    leadlag_shaders::file(path).unwrap_or_else(|| panic!("no file {path}"))
}

/// How f32 carries the state, by its name on the command line and in results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Precision {
    /// One f32 per state; the default inside an optimiser.
    #[default]
    Plain,
    /// Two f32 for spacing, speed and every sum: rounding errors are kept and do not accumulate.
    Compensated,
}

/// Purpose of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Recipe {
    /// The variant: one part of each folder.
    pub variant: Variant,
    /// How f32 carries the state.
    pub precision: Precision,
    /// How a Gipps run starts.
    pub radicand: Radicand,
    /// True for runs that an observer corrects: they carry a missing acceleration.
    pub observed: bool,
}

impl Recipe {
    /// True if a step has a memory: that of extensions or of an observer.
    pub fn is_extended(&self) -> bool {
        self.observed || !self.variant.extensions.is_empty()
    }
}

/// A composed text that knows which file each line came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    text: String,
    chunks: Vec<Chunk>,
}

/// A part of a composed text.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Chunk {
    name: String,
    /// The line of the text it begins at, from 1.
    first: usize,
    /// Prefixes of the names of an extension.
    own: Option<Prefixed>,
}

impl Source {
    /// The model of a variant: everything up to and including `step`, without a time loop.
    pub fn model(recipe: &Recipe) -> Source {
        Source::model_with(recipe, &|_, _| None)
    }

    /// As [`Source::model`], but `replace` may replace the text of a file, given its path and its text.
    pub fn model_with(recipe: &Recipe, replace: &dyn Fn(&str, &str) -> Option<String>) -> Source {
        let Recipe { variant, precision, radicand, observed } = recipe;
        let mut source = Source { text: String::new(), chunks: Vec::new() };
        source.push("generated: Params", &params(&variant.parameters(), *observed));
        let motion = match precision {
            Precision::Plain => shader("shaders/motion/plain.wgsl"),
            Precision::Compensated => shader("shaders/motion/compensated.wgsl"),
        };
        let start = match (variant.base.controller, radicand) {
            (Controller::Gipps, Radicand::Shifted) => shader("shaders/start/shifted.wgsl"),
            _ => shader("shaders/start/measured.wgsl"),
        };
        let add = |source: &mut Source, (file, text): (&str, &str)| {
            source.push(file, replace(file, text).as_deref().unwrap_or(text));
        };
        for file in [
            shader("shaders/types.wgsl"),
            shader("shaders/power.wgsl"),
            shader("shaders/opaque.wgsl"),
            part("spacing", variant.base.spacing.name()),
            part("controller", variant.base.controller.name()),
            part("dynamics", variant.dynamics.name()),
            part("constraint", variant.constraint.name()),
            start,
            motion,
        ] {
            add(&mut source, file);
        }
        if !recipe.is_extended() {
            add(&mut source, shader("shaders/step.wgsl"));
            return source;
        }
        for path in ["shaders/exponential.wgsl", "shaders/between.wgsl", "shaders/world.wgsl"] {
            add(&mut source, shader(path));
        }
        if variant.law().is_none() {
            add(&mut source, equilibrium(variant));
        }
        for extension in variant.extensions.list() {
            let text = replace(&extension.file, &extension.text);
            source.push_extension(&extension.name, &extension.file, text.as_deref().unwrap_or(&extension.text));
        }
        source.push("generated: stages", &stages::text(recipe));
        if let Some(law) = variant.law() {
            source.push("generated: equilibrium", &stages::equilibrium(law));
        }
        add(&mut source, shader("shaders/step_extended.wgsl"));
        source
    }

    /// Text against which an extension is checked before it is part of a model: a `Params` with every symbol of the table.
    pub(super) fn around_an_extension() -> Source {
        let mut source = Source { text: String::new(), chunks: Vec::new() };
        source.push("generated: Params", &params(Symbol::ALL, false));
        for name in ["types", "power", "exponential", "opaque", "spacing/cth", "world", "equilibrium/policy"] {
            let (file, text) = shader(&format!("shaders/{name}.wgsl"));
            source.push(file, text);
        }
        source
    }

    /// A user's text, in one chunk.
    pub fn single(name: &str, text: &str) -> Source {
        let mut source = Source { text: String::new(), chunks: Vec::new() };
        source.push(name, text);
        source
    }

    /// Appends a chunk; `name` stands for it in messages.
    pub fn push(&mut self, name: &str, text: &str) {
        let first = self.text.lines().count() + 1;
        self.chunks.push(Chunk { name: name.to_owned(), first, own: None });
        self.text.push_str(text.trim_end());
        self.text.push('\n');
    }

    /// Appends an extension; its declarations hide nothing of the rest.
    pub(super) fn push_extension(&mut self, extension: &str, file: &str, text: &str) {
        // Comments of the whole file may be at the top of a text only.
        let (text, own) = Prefixed::of(extension, &text.replace("//!", "// "));
        self.push(file, &text);
        self.chunks.last_mut().expect("just pushed").own = Some(own);
    }

    /// Name of the chunk pushed last.
    pub(super) fn last_chunk(&self) -> &str {
        self.chunks.last().map_or("", |chunk| &chunk.name)
    }

    /// First line of the chunk pushed last.
    pub(super) fn last_start(&self) -> usize {
        self.chunks.last().map_or(1, |chunk| chunk.first)
    }

    /// Prefix of the names of the extension that was pushed last.
    pub(super) fn last_prefix(&self) -> &str {
        self.chunks.last().and_then(|chunk| chunk.own.as_ref()).map_or("", |own| &own.prefix)
    }

    /// The text of the chunk pushed last, and its start.
    pub(super) fn last_text(&self) -> (usize, &str) {
        let start = self.text.lines().take(self.last_start() - 1).map(|line| line.len() + 1).sum();
        (start, &self.text[start..])
    }

    /// The declaration of a struct's member in the last chunk, and the `///` lines above it. (naga counts comments, not members, and gives
    /// a member without a comment those of the next one.)
    pub(super) fn member(&self, of: &str, member: &str) -> Option<(naga::Span, String)> {
        let (start, text) = self.last_text();
        let mut tokens = tokens(text);
        while tokens.next()?.1 != "struct" || tokens.next()?.1 != of {}
        // End of the previous token; the comment is between it and the member.
        let mut before = 0;
        let at = tokens.take_while(|(_, token)| *token != "}").find_map(|(at, token)| {
            let is_member = token == member && text[..before].ends_with(['{', ',', ')']);
            before = if is_member { before } else { at + token.len() };
            is_member.then_some(at)
        })?;
        let mut comment: Vec<&str> = Vec::new();
        let above = text[before..at].rsplit_once('\n').map_or("", |(above, _)| above);
        // A comment after another member on its line does not belong to this one.
        for line in above.split('\n').skip(1) {
            match line.trim_start().strip_prefix("///") {
                Some(words) => comment.push(words.trim()),
                None => comment.clear(),
            }
        }
        let from = start + at;
        Some((naga::Span::new(from as u32, (from + member.len()) as u32), comment.join(" ")))
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// A line of the whole text for messages, cut before it would fill the screen.
    pub(crate) fn shown(&self, line: usize) -> String {
        const LONGEST: usize = 160;
        let found = self.text.lines().nth(line - 1).unwrap_or_default();
        let chunk = self.chunk(line);
        let written = chunk.own.as_ref().map(|own| own.written_line(line - chunk.first + 1, found));
        let line = written.as_deref().unwrap_or(found).trim();
        match line.char_indices().nth(LONGEST) {
            Some((end, _)) => format!("{} …", &line[..end]),
            None => line.to_owned(),
        }
    }

    fn chunk(&self, line: usize) -> &Chunk {
        self.chunks.iter().rev().find(|chunk| chunk.first <= line).expect("chunks begin at line 1")
    }

    /// File and line in it of a line of the whole text; both lines count from 1.
    pub fn locate(&self, line: usize) -> (&str, usize) {
        let chunk = self.chunk(line);
        (&chunk.name, line - chunk.first + 1)
    }

    /// File, line and column, as written, of a place in the whole text.
    pub(crate) fn written(&self, line: usize, column: usize) -> (&str, usize, usize) {
        let (file, number) = self.locate(line);
        let own = self.chunk(line).own.as_ref();
        (file, number, own.map_or(column, |own| own.written(number, column)))
    }

    /// A message with the original names of extensions.
    pub(crate) fn in_words(&self, message: String) -> String {
        let own = self.chunks.iter().filter_map(|chunk| chunk.own.as_ref());
        own.fold(message, |message, own| message.replace(&own.prefix, ""))
    }
}

fn equilibrium(variant: &Variant) -> (&'static str, &'static str) {
    match variant.base.controller {
        Controller::Idm => part("equilibrium", "idm"),
        Controller::Gipps => part("equilibrium", "gipps"),
        // Controllers that keep the spacing which their policy asks for.
        _ => part("equilibrium", "policy"),
    }
}

/// Parameters as a struct, in the order given.
fn params(symbols: &[Symbol], observed: bool) -> String {
    let mut text = String::from("struct Params {\n");
    for symbol in symbols {
        writeln!(text, "    // {} [{}]", symbol.meaning(), symbol.unit()).expect("a String takes all");
        writeln!(text, "    {}: f32,", member(*symbol)).expect("a String takes all");
    }
    if observed {
        text += "    // share of the missing acceleration that is left after a step [-]\n";
        writeln!(text, "    {DECAY}: f32,").expect("a String takes all");
    }
    text + "}\n"
}
