//! One function of a text alone, for tests and tools.

use super::compile::code::{Row, Step};
use super::compile::error::LanesError;
use super::compile::flat::Id;
use super::compile::flatten::flatten;
use super::compile::schedule::{Rows, schedule};
use super::run::real::Real;
use super::run::simd::{InstructionSet, Instructions, Registers};
use crate::wgsl::{Checked, Source};
use std::collections::HashMap;

/// A function of a text, compiled like the step of a model.
#[derive(Debug, Clone)]
pub struct Function {
    inputs: Vec<String>,
    outputs: Vec<String>,
    rows: usize,
    input_rows: Vec<Row>,
    output_rows: Vec<Row>,
    literals: Vec<(f32, Row)>,
    steps: Vec<Step>,
}

impl Function {
    /// Compiles a function.
    ///
    /// # Errors
    /// [`LanesError::Missing`]; [`LanesError::Unsupported`] for constructs that parts may not use.
    pub fn compile(source: &Source, checked: &Checked, name: &str) -> Result<Function, LanesError> {
        let flat = flatten(source, checked, name, &[])?;
        let mut rows = Rows::default();
        let mut bound = HashMap::new();
        let input_rows: Vec<Row> = flat.inputs.iter().map(|(_, id)| *bound.entry(*id).or_insert(rows.pin())).collect();
        let mut literals = Vec::new();
        for id in 0..flat.ops.len() {
            if let Some(value) = flat.ops.literal(id) {
                let row = rows.pin();
                bound.insert(id, row);
                literals.push((value, row));
            }
        }
        let wanted: Vec<(Id, Option<Row>)> = flat.outputs.iter().map(|(_, id)| (*id, None)).collect();
        let all: Vec<&str> = flat.inputs.iter().map(|(name, _)| name.as_str()).collect();
        let scheduled = schedule(&flat.ops, &flat.shared(&all), &bound, &wanted, &mut rows);
        let names = |list: &[(String, Id)]| list.iter().map(|(name, _)| name.clone()).collect();
        Ok(Function {
            inputs: names(&flat.inputs),
            outputs: names(&flat.outputs),
            rows: rows.count(),
            input_rows,
            output_rows: scheduled.wanted,
            literals,
            steps: scheduled.steps,
        })
    }

    /// Paths of the arguments, structs taken apart: `p.v_0`, `x.s`.
    #[must_use]
    pub fn inputs(&self) -> &[String] {
        &self.inputs
    }

    /// Paths of the result's pieces; one empty path for a plain number.
    #[must_use]
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// Number of instructions.
    #[must_use]
    pub fn instructions(&self) -> usize {
        self.steps.len()
    }

    /// Calls it in f64; truth values are 0 and 1.
    ///
    /// # Panics
    /// Unless there is one value per input.
    #[must_use]
    pub fn call_f64(&self, arguments: &[f64]) -> Vec<f64> {
        self.call::<f64, 16>(arguments)
    }

    /// One lane of a block of a size that evaluators use, too.
    fn call<T: Real, const L: usize>(&self, arguments: &[T]) -> Vec<T> {
        assert_eq!(arguments.len(), self.inputs.len(), "one value per input: {:?}", self.inputs);
        let mut registers: Registers<T, L> = Registers::new(self.rows);
        for (value, row) in arguments.iter().zip(&self.input_rows) {
            registers.row_mut(*row).fill(*value);
        }
        for (value, row) in &self.literals {
            registers.row_mut(*row).fill(T::literal(*value));
        }
        registers.execute(&Instructions::new(&self.steps, InstructionSet::best(), self.rows));
        self.output_rows.iter().map(|row| registers.row(*row)[0]).collect()
    }
}
