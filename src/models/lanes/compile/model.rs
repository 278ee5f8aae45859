//! The block program of a composed model: rows, and instructions for the start, the candidate and the step.

use super::code::{Row, Step};
use super::error::LanesError;
use super::flat::{Binary, Flat, Id, Op};
use super::flatten::{check_all, flatten};
use super::schedule::{Rows, schedule};
use crate::extension::Initial;
use crate::wgsl::{Checked, DECAY, Recipe, Source, memory_of};
use std::collections::HashMap;

/// Rows of the state: spacing, speed, acceleration, then the second words of compensated sums, then the memory of extensions.
pub type Home = Vec<Row>;

/// Rows of the time loop's look-ups for extensions; unused ones are missing.
#[derive(Debug, Clone, Copy, Default)]
pub struct GivenRows {
    pub t: Option<Row>,
    pub x_f: Option<Row>,
    /// a_l, v_l2, s_l2.
    pub ahead: [Option<Row>; 3],
    /// Speed of the preceding vehicle in the past: at the whole look-back time, and at half of it.
    pub look_back: [Option<Row>; 2],
}

/// Everything the time loop runs.
#[derive(Debug, Clone)]
pub struct Model {
    /// Rows in all.
    pub rows: usize,
    /// Number of rows that a step touches; they have to fit into the first-level cache.
    pub busy: usize,
    /// Row of each parameter that is read, by its symbol's name.
    pub parameters: Vec<(String, Row)>,
    /// Row of the observer's decay.
    pub decay: Option<Row>,
    /// Rows of m_0, phi_f and dt.
    pub job: [Row; 3],
    /// Literals and their rows.
    pub literals: Vec<(f32, Row)>,
    /// Values that depend only on parameters and the job.
    pub prologue: Vec<Step>,
    /// Spacing, speed, leader's speed as perceived.
    pub perceived: [Row; 3],
    /// Displacement of the preceding vehicle.
    pub dx_l: Row,
    /// True if only the first lane is read.
    pub dx_l_is_shared: bool,
    /// sin_grade, a_dp, a_ap.
    pub road: [Row; 3],
    /// The time loop's look-ups for extensions.
    pub given: GivenRows,
    /// Initial values of the memory of extensions; its rows are the last of a home.
    pub memory: Vec<Initial>,
    /// Place of the missing acceleration in a home.
    pub missing: Option<usize>,
    /// The state alternates between the two homes.
    pub homes: [Home; 2],
    /// Step from the first home to the second, and back.
    pub steps: [StepCode; 2],
    /// Computes the spacing at a sample before the first simulated one, from `perceived`.
    pub start: Vec<Step>,
    /// The row of that spacing.
    pub start_s: Row,
    /// True if a candidate perceives the current sample.
    pub undelayed: bool,
    /// True if steps read the speed of the preceding vehicle.
    pub reads_v_l: bool,
}

/// A step from one home to the other.
#[derive(Debug, Clone)]
pub struct StepCode {
    pub code: Vec<Step>,
    pub a_free: Row,
    pub a: Row,
    /// `None` if every step is feasible.
    pub feasible: Option<Row>,
    /// If a step is feasible where a number reaches a literal: the number.
    pub reaching: Option<Row>,
}

/// Largest number of operations of a model: each may need a row for the whole run and a temporary one, and row numbers have 16 bits.
const OPERATIONS: usize = 30_000;

const JOB: [&str; 3] = ["m_0", "phi_f", "dt"];
const ROAD: [&str; 3] = ["road.sin_grade", "road.a_dp", "road.a_ap"];
const PERCEIVED: [&str; 3] = ["x.s", "x.v_f", "x.v_l"];

/// The fixed rows of a function's inputs.
fn bind(flat: &Flat, paths: &[(&str, Row)], bound: &mut HashMap<Id, Row>) {
    for (path, row) in paths {
        if let Some(id) = flat.input(path) {
            bound.entry(id).or_insert(*row);
        }
    }
}

impl Model {
    /// Compiles `step` and `starting_spacing` of a text, composed for this recipe.
    ///
    /// # Errors
    /// [`LanesError`] for a text with constructs that parts may not use.
    pub fn compile(source: &Source, checked: &Checked, recipe: &Recipe) -> Result<Model, LanesError> {
        check_all(source, checked)?;
        // A candidate then perceives another sample than the current one.
        let delay = recipe.variant.perceives_late();
        let same: &[_] = if delay { &[] } else { &[("x.s", "now.s"), ("x.v_f", "now.v_f")] };
        let step = flatten(source, checked, "step", same)?;
        let start = flatten(source, checked, "starting_spacing", &[])?;
        let operations = step.ops.len() + start.ops.len();
        if operations > OPERATIONS {
            return Err(LanesError::TooLarge { operations, most: OPERATIONS });
        }
        let mut rows = Rows::default();
        let shared = step.shared(&[&JOB[..], &["dx_l"]].concat());

        let mut parameters: Vec<(String, Row)> = Vec::new();
        for flat in [&step, &start] {
            for (path, _) in &flat.inputs {
                if let Some(name) = path.strip_prefix("p.").filter(|n| parameters.iter().all(|(p, _)| p != n)) {
                    parameters.push((name.to_owned(), rows.pin()));
                }
            }
        }
        let job = [(); 3].map(|()| rows.pin());
        let perceived = [(); 3].map(|()| rows.pin());
        let dx_l = rows.pin();
        let road = [(); 3].map(|()| rows.pin());
        // Each part of the state: as an input, as an output.
        let state = |before: &str, after: &str| -> Vec<(String, String)> {
            let part = |path: &str| Some((path.to_owned(), format!("{after}{}", path.strip_prefix(before)?)));
            step.inputs.iter().filter_map(|(path, _)| part(path)).collect()
        };
        let motion = state("now.", "next.");
        let names = [motion.clone(), state("memory.", "memory.")].concat();
        let initial = |(path, _): &(String, String)| initial(recipe, path);
        let memory = names[motion.len()..].iter().map(initial).collect();
        let missing = names.iter().position(|(path, _)| path == "memory.d");
        let homes = [(); 2].map(|()| names.iter().map(|_| rows.pin()).collect::<Home>());

        let mut literals: Vec<(f32, Row)> = Vec::new();
        let mut fixed = HashMap::new();
        let mut start_bound = HashMap::new();
        for (flat, bound) in [(&step, &mut fixed), (&start, &mut start_bound)] {
            for (name, row) in &parameters {
                bind(flat, &[(&format!("p.{name}"), *row)], bound);
            }
            for (name, row) in JOB.iter().zip(job) {
                bind(flat, &[(name, row)], bound);
            }
            for id in 0..flat.ops.len() {
                if let Some(value) = flat.ops.literal(id) {
                    let known = literals.iter().find(|(v, _)| v.to_bits() == value.to_bits()).map(|(_, row)| *row);
                    let row = known.unwrap_or_else(|| rows.pin());
                    if known.is_none() {
                        literals.push((value, row));
                    }
                    bound.insert(id, row);
                }
            }
        }

        // Results that depend only on constant rows are computed once per run.
        let wanted = once_per_candidate(&step, &fixed);
        let targets: Vec<(Id, Option<Row>)> = wanted.iter().map(|id| (*id, Some(rows.pin()))).collect();
        let prologue = schedule(&step.ops, &shared, &fixed, &targets, &mut rows).steps;
        fixed.extend(targets.iter().map(|(id, row)| (*id, row.expect("all have one"))));

        for (path, row) in PERCEIVED.iter().zip(perceived).chain(ROAD.iter().zip(road)).chain([(&"dx_l", dx_l)]) {
            bind(&step, &[(path, row)], &mut fixed);
            bind(&start, &[(path, row)], &mut start_bound);
        }
        let is_live = live(&step);
        let mut given = |name: &str| {
            let path = format!("given.{name}");
            let id = step.input(&path).filter(|id| is_live[*id])?;
            let row = rows.pin();
            fixed.insert(id, row);
            Some(row)
        };
        let given = GivenRows {
            t: given("t"),
            x_f: given("x_f"),
            ahead: ["a_l", "v_l2", "s_l2"].map(&mut given),
            look_back: ["v_l_then", "v_l_half"].map(&mut given),
        };
        for (path, id) in step.inputs.iter().filter(|(path, _)| path.starts_with("given.")) {
            debug_assert!(!is_live[*id] || fixed.contains_key(id), "{path} has a row");
        }
        let output = |path: &str| step.output(path).expect("shaders/step.wgsl returns it");
        let mut busy: Vec<Row> = Vec::new();
        let steps = [0, 1].map(|from| {
            let mut bound = fixed.clone();
            for ((before, _), row) in names.iter().zip(&homes[from]) {
                bound.insert(step.input(before).expect("listed above"), *row);
            }
            let mut targets: Vec<(Id, Option<Row>)> =
                names.iter().zip(&homes[1 - from]).map(|((_, after), row)| (output(after), Some(*row))).collect();
            let feasible = output("feasible");
            let reaching = match step.ops.get(feasible) {
                Op::Binary(Binary::LessEqual, least, number) if step.ops.literal(least).is_some() => Some(number),
                _ => None,
            };
            targets.extend([(output("a_free"), None), (output("a"), None), (feasible, None)]);
            targets.extend(reaching.map(|number| (number, None)));
            let scheduled = schedule(&step.ops, &shared, &bound, &targets, &mut rows);
            busy.extend(scheduled.steps.iter().flat_map(|s| s.from.iter().chain(&s.to).copied()));
            let [a_free, a, feasible_row, ref number @ ..] = scheduled.wanted[names.len()..] else {
                unreachable!("at least three were asked for")
            };
            let feasible = (step.ops.literal(feasible) != Some(1.0)).then_some(feasible_row);
            StepCode { code: scheduled.steps, a_free, a, feasible, reaching: number.first().copied() }
        });
        busy.sort_unstable();
        busy.dedup();
        let start_output = start.output("").expect("starting_spacing returns a number");
        let start = schedule(&start.ops, &start.shared(&JOB), &start_bound, &[(start_output, None)], &mut rows);
        let own = |step: &Step| step.from[..step.code.own()].contains(&dx_l);
        let dx_l_is_shared = !steps.iter().flat_map(|step| &step.code).chain(&start.steps).any(own);
        let reads_v_l = busy.contains(&perceived[2]);
        Ok(Model {
            rows: rows.count(),
            busy: busy.len(),
            decay: parameters.iter().find(|(name, _)| name == DECAY).map(|(_, row)| *row),
            parameters,
            job,
            literals,
            prologue,
            perceived,
            dx_l,
            dx_l_is_shared,
            road,
            given,
            memory,
            missing,
            homes,
            steps,
            start: start.steps,
            start_s: start.wanted[0],
            undelayed: !delay,
            reads_v_l,
        })
    }
}

/// Composes and checks a model without running it.
///
/// # Errors
/// [`LanesError`] at the first problem.
pub fn check_model(recipe: &Recipe) -> Result<(), LanesError> {
    let source = Source::model(recipe);
    let checked = crate::wgsl::check(&source)?;
    Model::compile(&source, &checked, recipe).map(|_| ())
}

/// Initial value of a part of the memory; the missing acceleration begins with 0.
fn initial(recipe: &Recipe, path: &str) -> Initial {
    let of_extension =
        path.strip_prefix("memory.").and_then(|path| path.split_once('.')).and_then(|(whose, member)| {
            let extension = recipe.variant.extensions.list().iter().find(|extension| memory_of(extension) == whose)?;
            extension.state.iter().find(|(known, _)| known == member).map(|(_, initial)| *initial)
        });
    of_extension.unwrap_or(Initial::Value(0.0))
}

/// Operations that depend only on `fixed` rows, and have readers that do not.
fn once_per_candidate(flat: &Flat, fixed: &HashMap<Id, Row>) -> Vec<Id> {
    let mut is_fixed = vec![false; flat.ops.len()];
    let mut wanted = Vec::new();
    for id in 0..flat.ops.len() {
        is_fixed[id] = match flat.ops.get(id) {
            Op::Input(_) | Op::Constant(_) => fixed.contains_key(&id),
            op => op.operands().all(|operand| is_fixed[operand]),
        };
    }
    let computed = |id: Id| is_fixed[id] && !fixed.contains_key(&id);
    let live = live(flat);
    for id in (0..flat.ops.len()).filter(|id| live[*id] && !is_fixed[*id]) {
        wanted.extend(flat.ops.get(id).operands().filter(|operand| computed(*operand)));
    }
    wanted.extend(flat.outputs.iter().map(|(_, id)| *id).filter(|id| computed(*id)));
    wanted.sort_unstable();
    wanted.dedup();
    wanted
}

fn live(flat: &Flat) -> Vec<bool> {
    let mut live = vec![false; flat.ops.len()];
    for (_, id) in &flat.outputs {
        live[*id] = true;
    }
    for id in (0..flat.ops.len()).rev() {
        if live[id] {
            for operand in flat.ops.get(id).operands() {
                live[operand] = true;
            }
        }
    }
    live
}
