//! The text of the kernel: the model of a variant, a generated prelude, `shaders/kernel.wgsl`.

use crate::extension::{Extension, Initial, Signal};
use crate::score::Accumulation;
use crate::wgsl::{Precision, Recipe, ShaderError, Source, check, member, memory_of, shader};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Largest number of invocations of a workgroup, for a device on which up to this many execute together. It is small, because small groups
/// spread better over a GPU (an NVIDIA H200, 4096 candidates: a seventh to a quarter faster with 32 than with 64; no difference on software
/// Vulkan).
pub(super) fn workgroup(subgroup: u32) -> u32 {
    subgroup.clamp(SMALLEST_WORKGROUP, LARGEST_WORKGROUP)
}

/// Smallest number of invocations of a workgroup: those of NVIDIA that execute together.
pub(super) const SMALLEST_WORKGROUP: u32 = 32;

/// Largest number: those of AMD.
pub(super) const LARGEST_WORKGROUP: u32 = 64;

/// Longest ring of past states that an invocation keeps in its own memory; large private arrays lose devices
/// (gfx-rs/wgpu#10027).
const PRIVATE_RING: u32 = 64;

/// Samples of which runs leave their errors: so few that the errors of 100,000 candidates take 154 MB, and so many that a submission is not
/// mostly overhead.
pub(super) const STRETCH: u32 = 128;

/// Entries of `samples` that fit into uniform memory, 64 KiB.
pub(super) const WINDOW_LENGTH: u32 = 4096;

/// Words of a candidate that looks back, and of one with an observer.
const LOOK_BACK_WORDS: u32 = 4;
pub(super) const OBSERVER_WORDS: u32 = 10;

/// Words of a result with everything the measures need: status, 2 cuts, 3 × 3 sums, 1 sum.
pub(super) const RAW_WORDS: u32 = 13;

/// Texts in the place of shader files, by path.
pub(super) type Replaced = BTreeMap<String, String>;

/// Sums of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Sums {
    /// Sums for one goodness of fit; the result is a score, 4 bytes.
    Score(Accumulation),
    /// All sums for the measures; the result is [`RAW_WORDS`] words.
    All,
}

/// The samples to read from uniform memory if candidates simulate one trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Windows {
    /// None.
    Nothing,
    /// Those of the sample that all candidates are at. A GPU reads such a value once for all candidates, but one by one if each
    /// candidate looks up another sample (NVIDIA H200: a third faster for IDM, eight times slower if delayed samples are also read this
    /// way).
    Present,
    /// All: a driver on the CPU reads storage lane by lane.
    All,
}

/// Settings of a kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Kernel {
    pub(super) recipe: Recipe,
    pub(super) sums: Sums,
    /// True if runs leave their errors sample by sample.
    pub(super) leaves: bool,
    pub(super) reject: bool,
    /// Number of past samples in memory; a power of two.
    pub(super) ring: u32,
    /// The samples of a chunk, of one trajectory only, to read from uniform memory: at first on hardware, then on the device that
    /// [`Context`](super::context::Context) has.
    pub(super) windows: Windows,
    /// Invocations of a workgroup; the device determines these, too.
    pub(super) workgroup: u32,
}

impl Kernel {
    fn mfc(&self) -> bool {
        self.recipe.variant.constraint == crate::catalog::Constraint::Mfc
    }

    fn ring_in_states(&self) -> bool {
        self.ring > PRIVATE_RING
    }

    fn motion(&self) -> &'static [&'static str] {
        match self.recipe.precision {
            Precision::Plain => &["s", "v_f", "a_f"],
            Precision::Compensated => &["s", "v_f", "a_f", "s_low", "v_low"],
        }
    }

    /// Words of one candidate in `candidates`.
    pub(super) fn candidate_words(&self) -> u32 {
        let look_back = if self.looks_back() { LOOK_BACK_WORDS } else { 0 };
        let observer = if self.recipe.observed { OBSERVER_WORDS } else { 0 };
        self.recipe.variant.parameters().len() as u32 + 4 + look_back + observer
    }

    /// Entries of `samples` per sample.
    fn sample_words(&self) -> u32 {
        if self.recipe.variant.extensions.is_empty() { 3 } else { 4 }
    }

    /// Samples before the first one of a chunk that it has in uniform memory: the last one, or with a delay all that a candidate may
    /// perceive.
    fn before(&self) -> u32 {
        if self.recipe.variant.perceives_late() && self.windows == Windows::All { self.ring } else { 1 }
    }

    /// This kernel, reading these samples from uniform memory unless it looks back so far that little else would fit.
    pub(super) fn with_windows(self, windows: Windows) -> Kernel {
        let kernel = Kernel { windows, ..self };
        let fits = 2 * kernel.before() * kernel.sample_words() <= WINDOW_LENGTH;
        Kernel { windows: if fits { windows } else { Windows::Nothing }, ..self }
    }

    pub(super) fn has_window(&self) -> bool {
        self.windows != Windows::Nothing
    }

    /// Largest number of samples in one submission.
    pub(super) fn longest_chunk(&self) -> u32 {
        let fits = if self.has_window() { WINDOW_LENGTH / self.sample_words() - self.before() } else { u32::MAX };
        if self.leaves { fits.min(STRETCH) } else { fits }
    }

    /// First entry and number of entries that a chunk reads, for a trajectory that begins at this entry.
    pub(super) fn window(&self, begin: u32, [from, to]: [u32; 2]) -> [u32; 2] {
        let from = from.saturating_sub(self.before());
        [begin + from * self.sample_words(), (to - from) * self.sample_words()]
    }

    pub(super) fn looks_back(&self) -> bool {
        self.recipe.variant.extensions.look_back().is_some()
    }

    /// Members of the memory and their initial values.
    fn memory(&self) -> Vec<(String, Initial)> {
        let missing = self.recipe.observed.then(|| ("d".to_owned(), Initial::Value(0.0)));
        let of = |extension: &&'static Extension| {
            let whose = memory_of(extension);
            extension.state.iter().map(move |(member, initial)| (format!("{whose}.{member}"), *initial))
        };
        let extensions = self.recipe.variant.extensions.list();
        missing.into_iter().chain(extensions.iter().flat_map(of)).collect()
    }

    /// Words of one candidate in `results`.
    pub(super) fn result_words(&self) -> u32 {
        match self.sums {
            Sums::Score(_) => 1,
            Sums::All => RAW_WORDS,
        }
    }

    /// Words of one candidate in `states`, as the constants AT_... of the kernel add up.
    pub(super) fn state_words(&self) -> u32 {
        let triple = if self.recipe.precision == Precision::Compensated { 6 } else { 3 };
        let triples = match self.sums {
            Sums::Score(Accumulation::Theil) => 2,
            Sums::Score(_) => 1,
            Sums::All => 4,
        };
        let ring = if self.recipe.variant.perceives_late() { 2 * self.ring } else { 0 };
        let state = (self.motion().len() + self.memory().len()) as u32;
        3 + state + triples * triple + if self.recipe.observed { 2 } else { 0 } + ring
    }

    /// The whole text; `replaced` has other texts for some files.
    pub(super) fn source(&self, replaced: &Replaced) -> Source {
        let mut source = Source::model_with(&self.recipe, &|file, _| replaced.get(file).cloned());
        source.push("generated: constants and load functions", &self.prelude().expect("a String takes all"));
        for path in ["shaders/sums.wgsl", "shaders/kernel.wgsl"] {
            push(&mut source, path, replaced);
        }
        source
    }

    /// Treatment of the memory of extensions and observer in the kernel.
    fn memory_functions(&self, text: &mut String) -> std::fmt::Result {
        let memory = self.memory();
        if !self.recipe.is_extended() {
            text.push_str(shader("shaders/unextended.wgsl").1);
        }
        let all = |of: &dyn Fn(usize, &str, Initial) -> String| -> String {
            memory.iter().enumerate().map(|(k, (member, initial))| of(k, member, *initial)).collect()
        };
        let start = |_, member: &str, initial| {
            let value = match initial {
                Initial::Value(value) => format!("{value:?}"),
                Initial::Measured(Signal::S) => "s".to_owned(),
                Initial::Measured(Signal::Vf) => "v_f".to_owned(),
                Initial::Measured(Signal::Vl) => "v_l".to_owned(),
                Initial::Measured(Signal::Af) => "a_f".to_owned(),
            };
            format!("    memory.{member} = {value};\n")
        };
        writeln!(
            text,
            "fn initial_memory(s: f32, v_f: f32, v_l: f32, a_f: f32) -> Memory {{\n    var memory: Memory;\n{}    \
             return memory;\n}}",
            all(&start)
        )?;
        writeln!(
            text,
            "fn load_memory(at: u32, i: u32) -> Memory {{\n    var memory: Memory;\n{}    return memory;\n}}",
            all(&|k, member, _| format!("    memory.{member} = saved(at + {k}u, i);\n"))
        )?;
        writeln!(
            text,
            "fn save_memory(at: u32, i: u32, memory: Memory) {{\n{}}}",
            all(&|k, member, _| format!("    save(at + {k}u, i, memory.{member});\n"))
        )?;
        let by = if self.recipe.observed { "    after.d = after.d - by;\n" } else { "" };
        writeln!(
            text,
            "fn corrected(memory: Memory, by: f32) -> Memory {{\n    var after = memory;\n{by}    return after;\n}}"
        )?;
        if self.recipe.is_extended() {
            text.push_str(
                "fn stepped(\n    p: Params, x: Perceived, now: Motion, memory: Memory, m_0: f32, phi_f: f32, road: Road, \
                 given: Given, dx_l: f32,\n    dt: f32,\n) -> Step {\n    \
                 return step(p, x, now, memory, m_0, phi_f, road, given, dx_l, dt);\n}\nfn \
                 set_zeros(even: u32, odd: u32) {\n    even_zero = even;\n    odd_zero = odd;\n}\n",
            );
        }
        Ok(())
    }

    fn prelude(&self) -> Result<String, std::fmt::Error> {
        let variant = &self.recipe.variant;
        let mut text = String::new();
        for (name, value) in [
            ("DELAY", variant.perceives_late()),
            ("GRADE", variant.needs_grade()),
            ("MFC", self.mfc()),
            ("REJECT", self.reject),
            ("COMPENSATED", self.recipe.precision == Precision::Compensated),
            ("OBSERVER", self.recipe.observed),
            ("LEAVES", self.leaves),
            ("EXTENDED", self.recipe.is_extended()),
            ("WORLD", !variant.extensions.is_empty()),
            ("LOOKS_BACK", self.looks_back()),
            ("RING_IN_STATES", self.ring_in_states()),
            ("WINDOW", self.has_window()),
            ("PAST_IN_WINDOW", self.windows == Windows::All),
        ] {
            writeln!(text, "const {name} = {value};")?;
        }
        let accumulation = match self.sums {
            Sums::Score(Accumulation::Squared) => "SQUARED",
            Sums::Score(Accumulation::Relative) => "RELATIVE",
            Sums::Score(Accumulation::Theil) => "THEIL",
            Sums::Score(Accumulation::Floored) => "FLOORED",
            Sums::All => "ALL",
        };
        writeln!(text, "const ACCUMULATION = {accumulation};")?;
        let (parameters, motion) = (variant.parameters(), self.motion());
        for (name, value) in [
            ("RING", self.ring),
            ("WORKGROUP", self.workgroup),
            ("PARAMETERS", parameters.len() as u32),
            ("MOTION_WORDS", motion.len() as u32),
            ("MEMORY_WORDS", self.memory().len() as u32),
            ("WINDOW_LENGTH", if self.has_window() { WINDOW_LENGTH } else { 1 }),
        ] {
            writeln!(text, "const {name} = {value}u;")?;
        }
        let list = |of: &dyn Fn(usize, &str) -> String, names: &[&str], between: &str| {
            let all: Vec<String> = names.iter().enumerate().map(|(k, name)| of(k, name)).collect();
            all.join(between)
        };
        let members: Vec<String> = parameters.iter().map(|symbol| member(*symbol)).collect();
        let names: Vec<&str> = members.iter().map(String::as_str).collect();
        let mut loads = list(&|k, _| format!("candidate({k}u, i)"), &names, ", ");
        if self.recipe.observed {
            // The last of the observer's words.
            write!(loads, ", candidate({}u, i)", self.candidate_words() - 1)?;
        }
        writeln!(text, "fn load_params(i: u32) -> Params {{\n    return Params({loads});\n}}")?;
        let finite = list(&|_, name| format!("is_finite(p.{name})"), &names, " && ");
        writeln!(text, "fn params_are_finite(p: Params) -> bool {{\n    return {finite};\n}}")?;
        let loads = list(&|k, _| format!("saved(at + {k}u, i)"), motion, ", ");
        writeln!(text, "fn load_motion(at: u32, i: u32) -> Motion {{\n    return Motion({loads});\n}}")?;
        let saves = list(&|k, name| format!("    save(at + {k}u, i, now.{name});"), motion, "\n");
        writeln!(text, "fn save_motion(at: u32, i: u32, now: Motion) {{\n{saves}\n}}")?;
        self.memory_functions(&mut text)?;
        Ok(text)
    }
}

fn push(source: &mut Source, path: &str, replaced: &Replaced) {
    let (file, text) = shader(path);
    source.push(file, replaced.get(file).map_or(text, String::as_str));
}

/// The text that adds up products of differences; it always keeps what rounding takes.
pub(super) fn summing_source(workgroup: u32, replaced: &Replaced) -> Source {
    let mut source = Source::single(
        "generated: constants",
        &format!("const COMPENSATED = true;\nconst WORKGROUP = {workgroup}u;\n"),
    );
    for path in ["shaders/opaque.wgsl", "shaders/sums.wgsl", "shaders/products.wgsl"] {
        push(&mut source, path, replaced);
    }
    source
}

/// The text of a variant's kernel for scores on a GPU, for a ring of 16 samples and NRMSE, with samples in storage and workgroups of
/// 64, checked.
pub fn kernel_text(recipe: &Recipe) -> Result<String, ShaderError> {
    let sums = Sums::Score(Accumulation::Squared);
    let (windows, workgroup) = (Windows::Nothing, 64);
    let kernel = Kernel { recipe: *recipe, sums, leaves: false, reject: false, ring: 16, windows, workgroup };
    let source = kernel.source(&Replaced::new());
    check(&source).map(|_| source.text().to_owned())
}
