//! The block program of a composed model: rows, and instructions for the start, the candidate and the step.

use super::error::LanesError;
use super::flat::{Flat, Id, Op};
use super::flatten::{check_all, flatten};
use super::schedule::{Row, Rows, Step, schedule};
use crate::wgsl::{Checked, Source};
use std::collections::HashMap;

/// Rows of the state: spacing, speed, acceleration, then what compensated sums carry.
pub type Home = Vec<Row>;

/// Everything the time loop runs.
#[derive(Debug, Clone)]
pub struct Model {
    /// Rows in all.
    pub rows: usize,
    /// Rows that a step touches; what has to fit into the nearest cache.
    pub busy: usize,
    /// Row of each parameter that is read, by its symbol's name.
    pub parameters: Vec<(String, Row)>,
    /// Rows of m_0, phi_f and dt.
    pub job: [Row; 3],
    /// Literals and their rows.
    pub literals: Vec<(f32, Row)>,
    /// What depends on parameters and the job only.
    pub prologue: Vec<Step>,
    /// Spacing, speed, leader's speed as perceived.
    pub perceived: [Row; 3],
    /// Way of the preceding vehicle.
    pub dx_l: Row,
    /// sin_grade, a_dp, a_ap.
    pub road: [Row; 3],
    /// The state lives in either home by turns.
    pub homes: [Home; 2],
    /// Step from the first home to the second, and back.
    pub steps: [StepCode; 2],
    /// Computes the spacing at a sample before the first simulated one, from `perceived`.
    pub start: Vec<Step>,
    /// Where that spacing is.
    pub start_s: Row,
    /// True where a candidate perceives the current sample.
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
    /// `None` where every step is feasible.
    pub feasible: Option<Row>,
}

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
    /// Compiles `step` and `starting_spacing` of a text. With `delay` a candidate perceives another sample than the current one.
    ///
    /// # Errors
    /// [`LanesError`] for a text that is more than parts may be.
    pub fn compile(source: &Source, checked: &Checked, delay: bool) -> Result<Model, LanesError> {
        check_all(source, checked)?;
        let same: &[_] = if delay { &[] } else { &[("x.s", "now.s"), ("x.v_f", "now.v_f")] };
        let step = flatten(source, checked, "step", same)?;
        let start = flatten(source, checked, "starting_spacing", &[])?;
        let mut rows = Rows::default();

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
        let names: Vec<&str> =
            step.inputs.iter().filter_map(|(path, _)| path.strip_prefix("now.")).collect::<Vec<_>>();
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

        // What follows from rows that stay the same all along a run is computed once.
        let wanted = once_per_candidate(&step, &fixed);
        let targets: Vec<(Id, Option<Row>)> = wanted.iter().map(|id| (*id, Some(rows.pin()))).collect();
        let prologue = schedule(&step.ops, &fixed, &targets, &mut rows).steps;
        fixed.extend(targets.iter().map(|(id, row)| (*id, row.expect("all have one"))));

        for (path, row) in PERCEIVED.iter().zip(perceived).chain(ROAD.iter().zip(road)).chain([(&"dx_l", dx_l)]) {
            bind(&step, &[(path, row)], &mut fixed);
            bind(&start, &[(path, row)], &mut start_bound);
        }
        let output = |path: &str| step.output(path).expect("shaders/step.wgsl returns it");
        let mut busy: Vec<Row> = Vec::new();
        let steps = [0, 1].map(|from| {
            let mut bound = fixed.clone();
            for (name, row) in names.iter().zip(&homes[from]) {
                bound.insert(step.input(&format!("now.{name}")).expect("listed above"), *row);
            }
            let mut targets: Vec<(Id, Option<Row>)> =
                names.iter().zip(&homes[1 - from]).map(|(n, row)| (output(&format!("next.{n}")), Some(*row))).collect();
            let feasible = output("feasible");
            targets.extend([(output("a_free"), None), (output("a"), None), (feasible, None)]);
            let scheduled = schedule(&step.ops, &bound, &targets, &mut rows);
            busy.extend(scheduled.steps.iter().flat_map(|s| s.from.into_iter().chain([s.to])));
            let [a_free, a, feasible_row] = scheduled.wanted[names.len()..] else { unreachable!("three were asked for") };
            let feasible = (step.ops.literal(feasible) != Some(1.0)).then_some(feasible_row);
            StepCode { code: scheduled.steps, a_free, a, feasible }
        });
        busy.sort_unstable();
        busy.dedup();
        let start_output = start.output("").expect("starting_spacing returns a number");
        let start = schedule(&start.ops, &start_bound, &[(start_output, None)], &mut rows);
        let reads_v_l = busy.contains(&perceived[2]);
        Ok(Model {
            rows: rows.count(),
            busy: busy.len(),
            parameters,
            job,
            literals,
            prologue,
            perceived,
            dx_l,
            road,
            homes,
            steps,
            start: start.steps,
            start_s: start.wanted[0],
            undelayed: !delay,
            reads_v_l,
        })
    }
}

/// Operations that depend on nothing but `fixed` rows, and are read by others than such operations.
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
