//! Groups of operations that every step of every model has, in one instruction: it writes several rows, and intermediate results stay in
//! registers. Each operation is rounded separately, as in the text.
//!
//! A group is recognised by its operations, not by its file. The same formula in another form runs as single instructions.

use super::code::Code;
use super::flat::{Binary, Id, Op, Ops, Unary};

/// Operations that one instruction does.
#[derive(Debug)]
pub struct Group {
    pub code: Code,
    /// Written rows, in the order of the instruction.
    pub outputs: Vec<Id>,
    /// Read rows, in the order of the instruction.
    pub sources: Vec<Id>,
    /// All of its operations.
    pub inside: Vec<Id>,
}

/// The groups among the needed operations. `shared` marks those with one result for all lanes, `users` has the needed readers of each
/// operation, `is_wanted` marks those that need a separate row.
pub fn groups(
    ops: &Ops,
    shared: &[bool],
    users: &[Vec<Id>],
    is_wanted: &[bool],
    is_bound: &impl Fn(Id) -> bool,
) -> Vec<Group> {
    let search = Search { ops, users };
    let needed = |id: &Id| is_wanted[*id] || !users[*id].is_empty();
    let stands_alone = |group: &Group| {
        let is_hidden = |id: &Id| {
            group.outputs.contains(id) || !is_wanted[*id] && users[*id].iter().all(|user| group.inside.contains(user))
        };
        let begin = group.begin();
        group.inside.iter().all(|id| needed(id) && !is_bound(*id) && is_hidden(id))
            && group.sources[group.code.own()..].iter().all(|source| shared[*source])
            && group.sources.iter().all(|source| *source < begin && !group.inside.contains(source))
    };
    let found = |id: Id| search.moved(id).or_else(|| search.two_sum(id)).filter(stands_alone);
    let mut groups: Vec<Group> = Vec::new();
    for group in (0..ops.len()).filter(needed).filter_map(found) {
        if groups.iter().all(|other| other.inside.iter().all(|id| !group.inside.contains(id))) {
            groups.push(group);
        }
    }
    groups
}

impl Group {
    /// The first of its results: where the group is computed.
    pub fn begin(&self) -> Id {
        *self.outputs.iter().min().expect("a group has results")
    }
}

struct Search<'a> {
    ops: &'a Ops,
    users: &'a [Vec<Id>],
}

impl Search<'_> {
    /// The operands of an operation of this kind.
    fn operands(&self, id: Id, kind: Binary) -> Option<[Id; 2]> {
        match self.ops.get(id) {
            Op::Binary(found, a, b) if found == kind => Some([a, b]),
            _ => None,
        }
    }

    /// The other operand of a sum or product of `one`.
    fn other(&self, id: Id, kind: Binary, one: Id) -> Option<Id> {
        match self.operands(id, kind)? {
            [a, b] if a == one => Some(b),
            [a, b] if b == one => Some(a),
            _ => None,
        }
    }

    /// A reader of `id` that is a sum or product with another operand, and that operand.
    fn reader(&self, id: Id, kind: Binary) -> Option<(Id, Id)> {
        self.users[id].iter().find_map(|user| Some((*user, self.other(*user, kind, id)?)))
    }

    /// Eq. 1, from the choice of the acceleration on (shaders/motion/plain.wgsl).
    fn moved(&self, a_next: Id) -> Option<Group> {
        let ops = self.ops;
        let Op::Select { condition: stops, accept: stopping, reject: a } = ops.get(a_next) else { return None };
        let [v_free, zero] = self.operands(stops, Binary::Less)?;
        // Compared by bits: of two zeros this one is the larger.
        if ops.literal(zero).map(f32::to_bits) != Some(0.0_f32.to_bits()) {
            return None;
        }
        let minus_v = |id: Id| match ops.get(id) {
            Op::Unary(Unary::Negate, v) => Some(v),
            _ => None,
        };
        let [left, right] = self.operands(stopping, Binary::Multiply)?;
        let (minus, v, per_dt) = match (minus_v(left), minus_v(right)) {
            (Some(v), _) => (left, v, right),
            (_, Some(v)) => (right, v, left),
            _ => return None,
        };
        let gained = self.other(v_free, Binary::Add, v)?;
        let dt = self.other(gained, Binary::Multiply, a)?;
        let v_next = *self.users[v_free].iter().find(|user| self.other(**user, Binary::Max, v_free) == Some(zero))?;
        let twice_v = *self.users[v_next].iter().find(|user| self.other(**user, Binary::Add, v_next) == Some(v))?;
        let (driven, half_dt) = self.reader(twice_v, Binary::Multiply)?;
        let (opened, dx_l) = self.users[driven].iter().find_map(|user| {
            let [dx_l, less] = self.operands(*user, Binary::Subtract)?;
            (less == driven).then_some((*user, dx_l))
        })?;
        let (s_next, s) = self.reader(opened, Binary::Add)?;
        Some(Group {
            code: Code::Moved,
            outputs: vec![s_next, v_next, a_next],
            sources: vec![s, v, a, dx_l, dt, half_dt, per_dt],
            inside: vec![gained, v_free, stops, minus, stopping, a_next, v_next, twice_v, driven, opened, s_next],
        })
    }

    /// A sum and its rounding error, from the error on (shaders/motion/compensated.wgsl).
    fn two_sum(&self, low: Id) -> Option<Group> {
        let [left, right] = self.operands(low, Binary::Add)?;
        [[left, right], [right, left]].into_iter().find_map(|[rest_a, rest_b]| {
            let [a, a_seen] = self.operands(rest_a, Binary::Subtract)?;
            let [b, b_seen] = self.operands(rest_b, Binary::Subtract)?;
            let [high, also_a] = self.operands(b_seen, Binary::Subtract)?;
            let [also_high, also_b_seen] = self.operands(a_seen, Binary::Subtract)?;
            let is_sum = self.other(high, Binary::Add, a) == Some(b);
            (is_sum && also_a == a && also_high == high && also_b_seen == b_seen).then(|| Group {
                code: Code::TwoSum,
                outputs: vec![high, low],
                sources: vec![a, b],
                inside: vec![high, b_seen, a_seen, rest_a, rest_b, low],
            })
        })
    }
}
