//! From a list of operations to instructions on rows: dead operations dropped, others fused, rows used again.

use super::code::{Code, Row, Step};
use super::flat::{Id, Ops};
use super::fuse::shortest_ways;
use super::group::{Group, groups};
use std::collections::HashMap;

/// Rows in use so far.
#[derive(Debug, Default)]
pub struct Rows {
    count: Row,
    free: Vec<Row>,
}

impl Rows {
    /// A row that is never used for anything else.
    pub fn pin(&mut self) -> Row {
        self.count += 1;
        self.count - 1
    }

    pub fn count(&self) -> usize {
        usize::from(self.count)
    }

    fn take(&mut self) -> Row {
        self.free.pop().unwrap_or_else(|| self.pin())
    }
}

/// Instructions for one list of wanted operations.
pub struct Schedule {
    pub steps: Vec<Step>,
    /// The row of each wanted operation.
    pub wanted: Vec<Row>,
}

/// Schedules the operations in `wanted`. Operations in `bound` have rows already; a wanted one may name its target row. `shared` marks
/// operations with one result for all lanes.
pub fn schedule(
    ops: &Ops,
    shared: &[bool],
    bound: &HashMap<Id, Row>,
    wanted: &[(Id, Option<Row>)],
    rows: &mut Rows,
) -> Schedule {
    let mut uses = vec![0_usize; ops.len()];
    for (id, _) in wanted {
        uses[*id] += 1;
    }
    for id in (0..ops.len()).rev() {
        if uses[id] > 0 && !bound.contains_key(&id) {
            for operand in ops.get(id).operands() {
                uses[operand] += 1;
            }
        }
    }
    let is_bound = |id: Id| bound.contains_key(&id);
    let mut is_wanted = vec![false; ops.len()];
    for (id, _) in wanted {
        is_wanted[*id] = true;
    }
    let mut users = vec![Vec::new(); ops.len()];
    for id in (0..ops.len()).filter(|id| uses[*id] > 0 && !is_bound(*id)) {
        for operand in ops.get(id).operands() {
            users[operand].push(id);
        }
    }
    let groups = groups(ops, shared, &users, &is_wanted, &is_bound);
    let mut group_of: Vec<Option<&Group>> = vec![None; ops.len()];
    for group in &groups {
        group.inside.iter().for_each(|id| group_of[*id] = Some(group));
    }
    let lone = |id: Id| uses[id] == 1 && !is_bound(id) && !is_wanted[id] && group_of[id].is_none();
    let mut ways = shortest_ways(ops, &lone);
    let mut absorbed = vec![false; ops.len()];
    // The scheduled operation, its form, and its operands.
    let mut plan: Vec<(Vec<Id>, Code, Vec<Id>)> = Vec::new();
    // From the end, so that an operation that was absorbed absorbs nothing.
    for id in (0..ops.len()).rev() {
        if uses[id] == 0 || is_bound(id) || absorbed[id] {
            continue;
        }
        if let Some(group) = group_of[id] {
            if id == group.begin() {
                let Group { code, outputs, sources, .. } = group;
                plan.push((outputs.clone(), *code, sources.clone()));
            }
            continue;
        }
        let way = ways[id].take().expect("inputs and literals are bound to rows");
        for id in way.absorbed {
            absorbed[id] = true;
        }
        plan.push((vec![id], way.code, way.sources));
    }
    plan.reverse();

    let mut last_use: HashMap<Id, usize> = HashMap::new();
    for (position, (_, _, sources)) in plan.iter().enumerate() {
        for source in sources {
            last_use.insert(*source, position);
        }
    }
    for (id, _) in wanted {
        last_use.insert(*id, usize::MAX);
    }
    let mut place: HashMap<Id, Row> = HashMap::new();
    let mut steps = Vec::new();
    let mut taken = Vec::new();
    for (position, (ids, code, sources)) in plan.into_iter().enumerate() {
        let from: Vec<Row> = sources.iter().map(|s| *bound.get(s).unwrap_or_else(|| &place[s])).collect();
        let mut to = Vec::new();
        for id in ids {
            let target = wanted.iter().find_map(|(w, target)| target.filter(|_| *w == id));
            let row = target.unwrap_or_else(|| {
                let row = rows.take();
                taken.push(row);
                row
            });
            place.insert(id, row);
            to.push(row);
        }
        steps.push(Step { code, to, from });
        let mut done: Vec<Id> = sources.into_iter().filter(|s| last_use[s] == position).collect();
        done.sort_unstable();
        done.dedup();
        rows.free
            .extend(done.iter().filter(|s| !bound.contains_key(s)).map(|s| place[s]).filter(|r| taken.contains(r)));
    }
    let mut results = Vec::new();
    for (id, target) in wanted {
        let row = *bound.get(id).unwrap_or_else(|| &place[id]);
        match target {
            Some(target) if *target != row => {
                steps.push(Step { code: Code::Copy, to: vec![*target], from: vec![row] });
                results.push(*target);
            }
            _ => results.push(row),
        }
    }
    // Results are read before another schedule runs, so that all of these rows are scratch again.
    rows.free.extend(taken);
    rows.free.sort_unstable();
    rows.free.dedup();
    Schedule { steps, wanted: results }
}

#[cfg(test)]
mod tests;
