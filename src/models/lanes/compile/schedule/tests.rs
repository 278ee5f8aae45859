use super::*;
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::lanes::compile::code::TRIPLES;
use crate::lanes::compile::flat::{Binary, Flat, Op, Unary};
use crate::lanes::compile::model::Model;
use crate::lanes::run::operation::{self, One, Two};
use crate::lanes::run::simd::{InstructionSet, Instructions, Registers};
use crate::wgsl::{Precision, Recipe, Source, check};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const INPUTS: usize = 6;
const LITERALS: [f32; 3] = [0.0, 1.0, -2.5];
const LANES: usize = 16;

/// Random operations, mostly on recent ones, so that long chains occur.
fn random_ops(random: &mut ChaCha8Rng) -> Ops {
    let mut ops = Ops::default();
    for i in 0..INPUTS {
        ops.push(Op::Input(i));
    }
    for value in LITERALS {
        ops.constant(value);
    }
    for _ in 0..30 {
        let mut operand = || {
            let nearest = [ops.len() - 1, ops.len() - 4, 0, 0][random.random_range(0..4_usize)];
            random.random_range(nearest..ops.len())
        };
        let [a, b, c] = [operand(), operand(), operand()];
        let binary = [
            Binary::Add,
            Binary::Subtract,
            Binary::Multiply,
            Binary::Divide,
            Binary::Min,
            Binary::Max,
            Binary::Less,
            Binary::LessEqual,
        ];
        match random.random_range(0..24) {
            0 => ops.push(Op::Unary(Unary::Negate, a)),
            1 => ops.push(Op::Unary(Unary::Sqrt, a)),
            2 | 3 => {
                let condition = ops.push(Op::Binary(Binary::Less, a, b));
                ops.push(Op::Select { condition, accept: c, reject: a })
            }
            4 => {
                // With a literal, as in a clamp.
                let high = ops.push(Op::Binary(Binary::Max, a, INPUTS));
                ops.push(Op::Binary(Binary::Min, high, INPUTS + 1))
            }
            5 => two_sum(&mut ops, a, b),
            6 => moved(&mut ops, [a, b, c]),
            7 | 8 => {
                let mut chain = a;
                for other in [b, c, a] {
                    let kind = binary[random.random_range(0..6_usize)];
                    let order = random.random::<bool>();
                    chain =
                        ops.push(if order { Op::Binary(kind, chain, other) } else { Op::Binary(kind, other, chain) });
                }
                chain
            }
            k => ops.push(Op::Binary(binary[k % binary.len()], a, b)),
        };
    }
    ops
}

fn two_sum(ops: &mut Ops, a: Id, b: Id) -> Id {
    let high = ops.push(Op::Binary(Binary::Add, a, b));
    let b_seen = ops.push(Op::Binary(Binary::Subtract, high, a));
    let a_seen = ops.push(Op::Binary(Binary::Subtract, high, b_seen));
    let rest_a = ops.push(Op::Binary(Binary::Subtract, a, a_seen));
    let rest_b = ops.push(Op::Binary(Binary::Subtract, b, b_seen));
    ops.push(Op::Binary(Binary::Add, rest_a, rest_b))
}

fn moved(ops: &mut Ops, [s, v, a]: [Id; 3]) -> Id {
    let (dx_l, dt, half_dt, per_dt, zero) = (0, 1, 2, 3, INPUTS);
    let gained = ops.push(Op::Binary(Binary::Multiply, a, dt));
    let v_free = ops.push(Op::Binary(Binary::Add, v, gained));
    let v_next = ops.push(Op::Binary(Binary::Max, v_free, zero));
    let minus_v = ops.push(Op::Unary(Unary::Negate, v));
    let accept = ops.push(Op::Binary(Binary::Multiply, minus_v, per_dt));
    let condition = ops.push(Op::Binary(Binary::Less, v_free, zero));
    ops.push(Op::Select { condition, accept, reject: a });
    let twice_v = ops.push(Op::Binary(Binary::Add, v, v_next));
    let driven = ops.push(Op::Binary(Binary::Multiply, twice_v, half_dt));
    let opened = ops.push(Op::Binary(Binary::Subtract, dx_l, driven));
    ops.push(Op::Binary(Binary::Add, s, opened))
}

/// All operations, one after the other.
fn one_by_one(ops: &Ops, inputs: &[f32; INPUTS]) -> Vec<f32> {
    let mut values: Vec<f32> = Vec::new();
    for id in 0..ops.len() {
        let value = match ops.get(id) {
            Op::Input(i) => inputs[i],
            Op::Constant(bits) => f32::from_bits(bits),
            Op::Unary(Unary::Negate, a) => operation::Negate::of(values[a]),
            Op::Unary(Unary::Sqrt, a) => operation::Sqrt::of(values[a]),
            Op::Select { condition, accept, reject } => values[if values[condition] == 0.0 { reject } else { accept }],
            Op::Binary(kind, left, right) => {
                // Which of two zeros is the larger one does not matter, but a literal is compared last.
                let of_literal = |id: Id| ops.literal(id).is_some();
                let (a, b) = (values[left], values[right]);
                match kind {
                    Binary::Min if of_literal(right) => operation::MinLiteral::of(a, b),
                    Binary::Min if of_literal(left) => operation::MinLiteral::of(b, a),
                    Binary::Max if of_literal(right) => operation::MaxLiteral::of(a, b),
                    Binary::Max if of_literal(left) => operation::MaxLiteral::of(b, a),
                    Binary::Add => a + b,
                    Binary::Subtract => a - b,
                    Binary::Multiply => a * b,
                    Binary::Divide => a / b,
                    Binary::Min => operation::Min::of(a, b),
                    Binary::Max => operation::Max::of(a, b),
                    Binary::Less => f32::from(a < b),
                    Binary::LessEqual => f32::from(a <= b),
                    other => unreachable!("{other:?} is not drawn"),
                }
            }
            other => unreachable!("{other:?} is not drawn"),
        };
        values.push(value);
    }
    values
}

#[test]
fn instructions_do_what_their_operations_do() {
    let mut seen = Vec::new();
    for seed in 0..20_000 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let names: Vec<String> = (0..INPUTS).map(|i| i.to_string()).collect();
        let inputs = names.iter().cloned().zip(0..).collect();
        let flat = Flat { ops: random_ops(&mut random), inputs, outputs: Vec::new() };
        // In half of the cases all lanes share the first four, as Eq. 1 requires of dx_l and dt.
        let common = if seed % 2 == 0 { &names[..4] } else { &[] };
        let shared = flat.shared(&common.iter().map(String::as_str).collect::<Vec<_>>());
        let ops = flat.ops;
        let mut rows = Rows::default();
        let mut bound = HashMap::new();
        let mut registers: Registers<f32, LANES> = Registers::new(200);
        let mut inputs = [[0.0; INPUTS]; LANES];
        for i in 0..INPUTS {
            for lane in 0..LANES {
                let values = [0.0, 1.0, -1.0, 1e-30, random.random_range(-3.0..3.0), random.random_range(-3.0..3.0)];
                let drawn = values[random.random_range(0..6_usize)];
                inputs[lane][i] = if shared[i] && lane > 0 { inputs[0][i] } else { drawn };
            }
            bound.insert(i, rows.pin());
        }
        for id in INPUTS..ops.len() {
            if ops.literal(id).is_some() {
                bound.insert(id, rows.pin());
            }
        }
        for (id, row) in &bound {
            for (x, inputs) in registers.row_mut(*row).iter_mut().zip(&inputs) {
                *x = ops.literal(*id).unwrap_or_else(|| inputs[*id]);
            }
        }
        let mut wanted: Vec<(Id, Option<Row>)> = vec![(ops.len() - 1, None), (ops.len() - 2, Some(rows.pin()))];
        wanted.push((random.random_range(0..ops.len()), None));
        let scheduled = schedule(&ops, &shared, &bound, &wanted, &mut rows);
        for step in scheduled.steps.iter().filter(|step| !matches!(step.code, Code::Unary(_) | Code::Binary(_))) {
            if !seen.contains(&step.code) {
                seen.push(step.code);
            }
        }
        registers.execute(&Instructions::new(&scheduled.steps, InstructionSet::best(), rows.count()));
        for (lane, inputs) in inputs.iter().enumerate() {
            let expected = one_by_one(&ops, inputs);
            for ((id, _), row) in wanted.iter().zip(&scheduled.wanted) {
                let (found, expected) = (registers.row(*row)[lane], expected[*id]);
                let same = found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
                assert!(same, "seed {seed}, {id}, lane {lane}: {found} is not {expected}: {:?}", scheduled.steps);
            }
        }
    }
    let groups = [Code::Moved, Code::TwoSum, Code::Clamp, Code::ClampLiteral, Code::Select, Code::SelectLess];
    let triples = TRIPLES.iter().map(|(a, b, c)| Code::Triple(*a, *b, *c));
    let missing: Vec<Code> = triples.chain(groups).filter(|code| !seen.contains(code)).collect();
    assert!(missing.is_empty(), "no case has {missing:?}");
    let pairs = seen.iter().filter(|code| matches!(code, Code::Pair(..))).count();
    assert_eq!(pairs, 3 * 10, "all pairs");
}

#[test]
fn the_ninety_variants_have_what_there_are_instructions_for() {
    let mut unused = TRIPLES.to_vec();
    for variant in Variant::all() {
        for (precision, code, count) in [(Precision::Plain, Code::Moved, 1), (Precision::Compensated, Code::TwoSum, 4)]
        {
            let recipe = Recipe { variant, precision, radicand: Convention::PAPER.radicand, observed: false };
            let source = Source::model(&recipe);
            let model = Model::compile(&source, &check(&source).expect("it is valid"), &recipe).expect("it runs");
            for step in &model.steps {
                assert_eq!(step.code.iter().filter(|step| step.code == code).count(), count, "{variant}");
                unused.retain(|(a, b, c)| step.code.iter().all(|step| step.code != Code::Triple(*a, *b, *c)));
            }
        }
    }
    assert!(unused.is_empty(), "no variant has {unused:?}");
}
