//! Many rows at once: grouped by variant and trajectory, so that an evaluator gets whole populations.

use super::row::Task;
use super::{Build, Computed};
use crate::evaluator::{Case, EvaluateError, Evaluator, Job, Outcome, Population};
use crate::reference::{Reference, Trace};
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The evaluators made so far, by variant.
#[derive(Default)]
pub(super) struct Batch {
    evaluators: BTreeMap<String, Box<dyn Evaluator>>,
}

/// The rows of one variant on one case.
struct Group {
    case: Case,
    rows: Vec<usize>,
    population: Population,
}

/// Cases made from one reading of a trajectory share its signals.
fn same(a: &Case, b: &Case) -> bool {
    std::sync::Arc::ptr_eq(&a.s, &b.s)
}

impl Batch {
    /// Runs the tasks; results in their order.
    pub(super) fn run(
        &mut self,
        tasks: Vec<Task>,
        rescore: bool,
        build: &mut Build,
    ) -> Result<Vec<Result<Computed, String>>, EvaluateError> {
        let mut results: Vec<Option<Result<Computed, String>>> = tasks.iter().map(|_| None).collect();
        // Ordered by variant, then by first row, so that the same rows always share a population.
        let mut by_variant: BTreeMap<(u32, String), Vec<Group>> = BTreeMap::new();
        for (row, task) in tasks.into_iter().enumerate() {
            match task {
                Err(reason) => results[row] = Some(Err(reason.to_string())),
                Ok((case, parameters)) => {
                    // Two files with laws may have one name.
                    let texts = case.variant.law().map_or("", |law| law.text.as_str());
                    let key = (case.variant.id(), format!("{} {texts}", case.variant));
                    add(by_variant.entry(key).or_default(), row, case, &parameters);
                }
            }
        }
        for ((_, name), groups) in by_variant {
            let evaluator = self.evaluator(name, &groups, build)?;
            let index = |group: &Group| {
                evaluator.cases().iter().position(|case| same(case, &group.case)).expect("the evaluator has every case")
            };
            let jobs: Vec<Job> =
                groups.iter().map(|group| Job { case: index(group), population: &group.population }).collect();
            let outcomes = evaluator.outcomes(&jobs)?;
            let (name, precision) = (evaluator.name(), evaluator.precision());
            let rescored = if rescore { rescored(&groups, precision, &outcomes) } else { vec![None; outcomes.len()] };
            let rows = groups.iter().flat_map(|group| &group.rows);
            for ((row, outcome), rescored) in rows.zip(outcomes).zip(rescored) {
                results[*row] = Some(Ok(Computed { outcome, evaluator: name, precision, rescored }));
            }
        }
        Ok(results.into_iter().map(|result| result.expect("every row is bad or in a group")).collect())
    }

    /// The evaluator of a variant that has at least the cases of these groups.
    fn evaluator(
        &mut self,
        variant: String,
        groups: &[Group],
        build: &mut Build,
    ) -> Result<&mut Box<dyn Evaluator>, EvaluateError> {
        let mut cases = self.evaluators.get(&variant).map_or(Vec::new(), |e| e.cases().to_vec());
        let known = cases.len();
        for group in groups {
            if !cases.iter().any(|case| same(case, &group.case)) {
                cases.push(group.case.clone());
            }
        }
        if cases.len() > known {
            self.evaluators.insert(variant.clone(), build(cases)?);
        }
        Ok(self.evaluators.get_mut(&variant).expect("made above at the latest"))
    }
}

fn add(groups: &mut Vec<Group>, row: usize, case: Case, parameters: &Parameters) {
    let symbols = case.variant.parameters();
    let values: Vec<f64> = symbols.iter().map(|symbol| parameters.get(*symbol)).collect();
    let group = match groups.iter().position(|group| same(&group.case, &case)) {
        Some(found) => &mut groups[found],
        None => {
            groups.push(Group { case, rows: Vec::new(), population: Population::new(&symbols) });
            groups.last_mut().expect("pushed")
        }
    };
    group.rows.push(row);
    group.population.push(&values);
}

/// NRMSE(s,v,a) of every row by the f64 reference, computed again unless it is already the result.
fn rescored(groups: &[Group], precision: &str, outcomes: &[Outcome]) -> Vec<Option<f64>> {
    let nrmse = |outcome: &Outcome| outcome.result.ok().map(|m| GoodnessOfFit::NRMSE_SVA.of(&m));
    if precision == "f64" {
        return outcomes.iter().map(nrmse).collect();
    }
    let candidates: Vec<(&Case, Parameters)> = groups
        .iter()
        .flat_map(|group| (0..group.population.len()).map(|i| (&group.case, group.population.parameters(i))))
        .collect();
    candidates
        .into_par_iter()
        .map_init(Trace::default, |trace, (case, p)| nrmse(&Reference::outcome(case, &p, trace)))
        .collect()
}
