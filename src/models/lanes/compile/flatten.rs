//! Turns naga's form of a function into a list of scalar operations: calls inlined, structs taken apart, both sides of an `if` computed and
//! selected.

use super::error::LanesError;
use super::flat::{Binary, Flat, Id, Op, Ops, Unary};
use crate::wgsl::{Checked, Source};
use naga::{
    BinaryOperator, Block, Expression, Function, Handle, Literal, LocalVariable, MathFunction, ScalarKind, Span,
    Statement, Type, TypeInner, UnaryOperator,
};

/// A value in pieces.
#[derive(Debug, Clone, PartialEq)]
enum Value {
    Scalar(Id),
    Struct(Vec<Value>),
}

/// Flattens one function. Arguments of one path in `same` are replaced by those of the other path: (`x.s`, `now.s`).
///
/// # Errors
/// [`LanesError::Missing`], or [`LanesError::Unsupported`] for constructs that parts may not use.
pub fn flatten(source: &Source, checked: &Checked, name: &str, same: &[(&str, &str)]) -> Result<Flat, LanesError> {
    let functions = &checked.module.functions;
    let Some((handle, function)) = functions.iter().find(|(_, f)| f.name.as_deref() == Some(name)) else {
        let found = functions.iter().filter_map(|(_, f)| f.name.clone()).collect();
        return Err(LanesError::Missing { name: name.to_owned(), found });
    };
    let mut flattener = Flattener { source, checked, ops: Ops::default() };
    let mut inputs = Vec::new();
    let mut arguments = Vec::new();
    let span = functions.get_span(handle);
    for argument in &function.arguments {
        let path = argument.name.clone().unwrap_or_default();
        arguments.push(flattener.argument(argument.ty, path, span, &mut inputs)?);
    }
    for (i, (path, _)) in inputs.iter().enumerate() {
        if let Some((_, other)) = same.iter().find(|(one, _)| one == path) {
            let k = inputs.iter().position(|(p, _)| p == other).unwrap_or(i);
            replace(&mut arguments, i, k);
        }
    }
    // Up to this point an argument stands for its position.
    let arguments = arguments.into_iter().map(|a| flattener.bound(a)).collect();
    let inputs: Vec<_> = inputs.into_iter().map(|(path, i)| (path, flattener.ops.push(Op::Input(i)))).collect();
    let result = flattener.function(handle, arguments)?;
    let mut outputs = Vec::new();
    if let (Some(value), Some(result)) = (result, &function.result) {
        flattener.leaves(&value, result.ty, String::new(), &mut outputs);
    }
    Ok(Flat { ops: flattener.ops, inputs, outputs })
}

/// Checks that every function of a text can be flattened, whether or not it is called.
///
/// # Errors
/// As [`flatten`].
pub fn check_all(source: &Source, checked: &Checked) -> Result<(), LanesError> {
    for (_, function) in checked.module.functions.iter() {
        if let Some(name) = function.name.as_deref().filter(|name| !is_built_in(name)) {
            flatten(source, checked, name, &[])?;
        }
    }
    Ok(())
}

fn replace(arguments: &mut [Value], from: usize, to: usize) {
    for argument in arguments {
        match argument {
            Value::Scalar(i) if *i == from => *i = to,
            Value::Scalar(_) => {}
            Value::Struct(members) => replace(members, from, to),
        }
    }
}

/// A function while it is inlined.
struct Frame<'a> {
    function: &'a Function,
    handle: Handle<Function>,
    arguments: Vec<Value>,
    locals: Vec<Value>,
    /// Values of expressions met so far.
    values: Vec<Option<Value>>,
    /// True inside an `if`.
    inside: bool,
    /// True after a `return`: later statements are never computed.
    returned: bool,
    result: Option<Value>,
}

struct Flattener<'a> {
    source: &'a Source,
    checked: &'a Checked,
    ops: Ops,
}

impl<'a> Flattener<'a> {
    fn refuse<T>(&self, span: Span, construct: impl Into<String>) -> Result<T, LanesError> {
        Err(LanesError::unsupported(self.source, span, construct))
    }

    /// An argument in pieces; its scalars are numbered through.
    fn argument(
        &self,
        ty: Handle<Type>,
        path: String,
        span: Span,
        inputs: &mut Vec<(String, Id)>,
    ) -> Result<Value, LanesError> {
        match &self.checked.module.types[ty].inner {
            TypeInner::Scalar(scalar) if is_known(*scalar) => {
                inputs.push((path, inputs.len()));
                Ok(Value::Scalar(inputs.len() - 1))
            }
            TypeInner::Struct { members, .. } => {
                let member = |m: &naga::StructMember, inputs: &mut _| {
                    let path = format!("{path}.{}", m.name.as_deref().unwrap_or_default());
                    self.argument(m.ty, path, span, inputs)
                };
                Ok(Value::Struct(members.iter().map(|m| member(m, inputs)).collect::<Result<_, _>>()?))
            }
            other => self.refuse(span, format!("the argument `{path}`, {}", type_name(other))),
        }
    }

    fn bound(&mut self, value: Value) -> Value {
        match value {
            Value::Scalar(i) => Value::Scalar(self.ops.push(Op::Input(i))),
            Value::Struct(members) => Value::Struct(members.into_iter().map(|m| self.bound(m)).collect()),
        }
    }

    fn leaves(&self, value: &Value, ty: Handle<Type>, path: String, leaves: &mut Vec<(String, Id)>) {
        match (value, &self.checked.module.types[ty].inner) {
            (Value::Struct(values), TypeInner::Struct { members, .. }) => {
                for (value, member) in values.iter().zip(members) {
                    let dot = if path.is_empty() { "" } else { "." };
                    let path = format!("{path}{dot}{}", member.name.as_deref().unwrap_or_default());
                    self.leaves(value, member.ty, path, leaves);
                }
            }
            (Value::Scalar(id), _) => leaves.push((path, *id)),
            (Value::Struct(_), _) => unreachable!("only structs come in pieces"),
        }
    }

    fn zero(&mut self, ty: Handle<Type>, span: Span) -> Result<Value, LanesError> {
        match &self.checked.module.types[ty].inner {
            TypeInner::Scalar(scalar) if is_known(*scalar) => Ok(Value::Scalar(self.ops.constant(0.0))),
            TypeInner::Struct { members, .. } => {
                Ok(Value::Struct(members.iter().map(|m| self.zero(m.ty, span)).collect::<Result<_, _>>()?))
            }
            other => self.refuse(span, type_name(other)),
        }
    }

    fn function(&mut self, handle: Handle<Function>, arguments: Vec<Value>) -> Result<Option<Value>, LanesError> {
        let function = &self.checked.module.functions[handle];
        match (function.name.as_deref(), arguments.as_slice()) {
            (Some("power"), [Value::Scalar(x), Value::Scalar(y)]) => {
                return Ok(Some(Value::Scalar(self.ops.push(Op::Binary(Binary::Power, *x, *y)))));
            }
            (Some("exponential"), [Value::Scalar(x)]) => {
                return Ok(Some(Value::Scalar(self.ops.push(Op::Unary(Unary::Exponential, *x)))));
            }
            (Some("logarithm"), [Value::Scalar(x)]) => {
                return Ok(Some(Value::Scalar(self.ops.push(Op::Unary(Unary::Logarithm, *x)))));
            }
            (Some("opaque" | "opaque_even" | "opaque_odd"), [x]) => return Ok(Some(x.clone())),
            _ => {}
        }
        let values = vec![None; function.expressions.len()];
        let (locals, inside, returned, result) = (Vec::new(), false, false, None);
        let mut frame = Frame { function, handle, arguments, locals, values, inside, returned, result };
        for (local, variable) in function.local_variables.iter() {
            let value = match variable.init {
                Some(init) => self.value(&mut frame, init)?,
                None => self.zero(variable.ty, function.local_variables.get_span(local))?,
            };
            frame.locals.push(value);
        }
        self.block(&mut frame, &function.body)?;
        Ok(frame.result)
    }

    fn block(&mut self, frame: &mut Frame<'a>, block: &'a Block) -> Result<(), LanesError> {
        for (statement, span) in block.span_iter() {
            if frame.returned {
                break;
            }
            match statement {
                Statement::Emit(range) => {
                    for expression in range.clone() {
                        if !self.is_pointer(frame, expression) {
                            let value = self.expression(frame, expression)?;
                            frame.values[expression.index()] = Some(value);
                        }
                    }
                }
                Statement::Block(inner) => self.block(frame, inner)?,
                Statement::If { condition, accept, reject } => {
                    let condition = self.scalar(frame, *condition)?;
                    let before = frame.locals.clone();
                    let outside = std::mem::replace(&mut frame.inside, true);
                    self.block(frame, accept)?;
                    let accepted = std::mem::replace(&mut frame.locals, before);
                    self.block(frame, reject)?;
                    frame.inside = outside;
                    let rejected = std::mem::take(&mut frame.locals);
                    let both = accepted.into_iter().zip(rejected);
                    frame.locals = both.map(|(a, r)| self.select(condition, a, r)).collect();
                }
                Statement::Return { .. } if frame.inside => return self.refuse(*span, "`return` inside an `if`"),
                Statement::Return { value } => {
                    frame.result = value.map(|v| self.value(frame, v)).transpose()?;
                    frame.returned = true;
                }
                Statement::Store { pointer, value } => {
                    let value = self.value(frame, *value)?;
                    let (local, path) = self.place(frame, *pointer)?;
                    *part_mut(&mut frame.locals[local.index()], &path) = value;
                }
                Statement::Call { function, arguments, result } => {
                    let values = arguments.iter().map(|a| self.value(frame, *a)).collect::<Result<_, _>>()?;
                    let value = self.function(*function, values)?;
                    if let Some(result) = result {
                        frame.values[result.index()] = value;
                    }
                }
                Statement::Switch { .. } => return self.refuse(*span, "`switch`"),
                Statement::Loop { .. } => return self.refuse(*span, "a loop"),
                other => {
                    let name = format!("{other:?}");
                    let name = name.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default().to_lowercase();
                    return self.refuse(*span, format!("`{name}`"));
                }
            }
        }
        Ok(())
    }

    fn select(&mut self, condition: Id, accept: Value, reject: Value) -> Value {
        match (accept, reject) {
            (Value::Struct(a), Value::Struct(r)) => {
                Value::Struct(a.into_iter().zip(r).map(|(a, r)| self.select(condition, a, r)).collect())
            }
            (Value::Scalar(accept), Value::Scalar(reject)) => {
                Value::Scalar(self.ops.push(Op::Select { condition, accept, reject }))
            }
            _ => unreachable!("both sides have one type"),
        }
    }

    fn is_pointer(&self, frame: &Frame, expression: Handle<Expression>) -> bool {
        let resolution = &self.checked.info[frame.handle][expression].ty;
        matches!(
            resolution.inner_with(&self.checked.module.types),
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. }
        )
    }

    /// The variable that a pointer refers to, and the position in it.
    fn place(
        &self,
        frame: &Frame,
        pointer: Handle<Expression>,
    ) -> Result<(Handle<LocalVariable>, Vec<usize>), LanesError> {
        match frame.function.expressions[pointer] {
            Expression::LocalVariable(local) => Ok((local, Vec::new())),
            Expression::AccessIndex { base, index } => {
                let (local, mut path) = self.place(frame, base)?;
                path.push(index as usize);
                Ok((local, path))
            }
            Expression::GlobalVariable(_) => {
                self.refuse(frame.function.expressions.get_span(pointer), "a variable of the module")
            }
            _ => self.refuse(frame.function.expressions.get_span(pointer), "this place of a variable"),
        }
    }

    fn scalar(&mut self, frame: &mut Frame<'a>, expression: Handle<Expression>) -> Result<Id, LanesError> {
        match self.value(frame, expression)? {
            Value::Scalar(id) => Ok(id),
            Value::Struct(_) => {
                self.refuse(frame.function.expressions.get_span(expression), "a struct where a number is expected")
            }
        }
    }

    fn value(&mut self, frame: &mut Frame<'a>, expression: Handle<Expression>) -> Result<Value, LanesError> {
        if let Some(value) = &frame.values[expression.index()] {
            return Ok(value.clone());
        }
        // Literals, constants, arguments: naga emits none of them.
        let value = self.expression(frame, expression)?;
        frame.values[expression.index()] = Some(value.clone());
        Ok(value)
    }

    fn expression(&mut self, frame: &mut Frame<'a>, handle: Handle<Expression>) -> Result<Value, LanesError> {
        let span = frame.function.expressions.get_span(handle);
        let id = match &frame.function.expressions[handle] {
            Expression::Literal(literal) => self.literal(*literal, span)?,
            Expression::Constant(constant) => {
                return self.global(self.checked.module.constants[*constant].init, span);
            }
            Expression::ZeroValue(ty) => return self.zero(*ty, span),
            Expression::Compose { ty, components } => {
                if !matches!(self.checked.module.types[*ty].inner, TypeInner::Struct { .. }) {
                    return self.refuse(span, type_name(&self.checked.module.types[*ty].inner));
                }
                let values = components.iter().map(|c| self.value(frame, *c)).collect::<Result<_, _>>()?;
                return Ok(Value::Struct(values));
            }
            Expression::AccessIndex { base, index } => {
                return match self.value(frame, *base)? {
                    Value::Struct(mut members) => Ok(members.swap_remove(*index as usize)),
                    Value::Scalar(_) => self.refuse(span, "an element of a vector"),
                };
            }
            Expression::FunctionArgument(i) => return Ok(frame.arguments[*i as usize].clone()),
            Expression::Load { pointer } => {
                let (local, path) = self.place(frame, *pointer)?;
                return Ok(part_mut(&mut frame.locals[local.index()], &path).clone());
            }
            Expression::Unary { op, expr } => {
                let a = self.scalar(frame, *expr)?;
                match op {
                    UnaryOperator::Negate => self.ops.push(Op::Unary(Unary::Negate, a)),
                    UnaryOperator::LogicalNot => self.ops.push(Op::Unary(Unary::Not, a)),
                    UnaryOperator::BitwiseNot => return self.refuse(span, "the operator `~`"),
                }
            }
            Expression::Binary { op, left, right } => {
                let (a, b) = (self.scalar(frame, *left)?, self.scalar(frame, *right)?);
                self.binary(*op, a, b, span)?
            }
            Expression::Select { condition, accept, reject } => {
                let condition = self.scalar(frame, *condition)?;
                let (accept, reject) = (self.value(frame, *accept)?, self.value(frame, *reject)?);
                return Ok(self.select(condition, accept, reject));
            }
            Expression::Math { fun, arg, arg1, arg2, .. } => {
                let a = self.scalar(frame, *arg)?;
                let b = arg1.map(|b| self.scalar(frame, b)).transpose()?;
                let c = arg2.map(|c| self.scalar(frame, c)).transpose()?;
                self.math(*fun, a, b, c, span)?
            }
            Expression::GlobalVariable(_) => return self.refuse(span, "a variable of the module"),
            Expression::As { convert: None, .. } => return self.refuse(span, "`bitcast`"),
            Expression::As { .. } => return self.refuse(span, "a conversion to another type"),
            Expression::Access { .. } => return self.refuse(span, "an element of an array or vector"),
            Expression::Splat { .. } | Expression::Swizzle { .. } => return self.refuse(span, "a vector"),
            Expression::Relational { .. } => return self.refuse(span, "`all` or `any`"),
            Expression::Override(_) => return self.refuse(span, "an `override`"),
            _ => return self.refuse(span, "this expression"),
        };
        Ok(Value::Scalar(id))
    }

    fn literal(&mut self, literal: Literal, span: Span) -> Result<Id, LanesError> {
        match literal {
            Literal::F32(value) => Ok(self.ops.constant(value)),
            Literal::Bool(value) => Ok(self.ops.truth(value)),
            Literal::I32(_) | Literal::AbstractInt(_) => self.refuse(span, "an i32"),
            Literal::U32(_) => self.refuse(span, "a u32"),
            _ => self.refuse(span, "a number of another type than f32"),
        }
    }

    /// A constant of the module; its expressions have a separate arena.
    fn global(&mut self, init: Handle<Expression>, span: Span) -> Result<Value, LanesError> {
        match &self.checked.module.global_expressions[init] {
            Expression::Literal(literal) => Ok(Value::Scalar(self.literal(*literal, span)?)),
            Expression::Constant(constant) => self.global(self.checked.module.constants[*constant].init, span),
            Expression::ZeroValue(ty) => self.zero(*ty, span),
            Expression::Compose { ty, components }
                if matches!(self.checked.module.types[*ty].inner, TypeInner::Struct { .. }) =>
            {
                Ok(Value::Struct(components.iter().map(|c| self.global(*c, span)).collect::<Result<_, _>>()?))
            }
            _ => self.refuse(span, "this constant"),
        }
    }

    fn binary(&mut self, op: BinaryOperator, a: Id, b: Id, span: Span) -> Result<Id, LanesError> {
        let (op, a, b) = match op {
            BinaryOperator::Add => (Binary::Add, a, b),
            BinaryOperator::Subtract => (Binary::Subtract, a, b),
            BinaryOperator::Multiply => (Binary::Multiply, a, b),
            BinaryOperator::Divide => (Binary::Divide, a, b),
            BinaryOperator::Equal => (Binary::Equal, a, b),
            BinaryOperator::NotEqual => (Binary::NotEqual, a, b),
            BinaryOperator::Less => (Binary::Less, a, b),
            BinaryOperator::LessEqual => (Binary::LessEqual, a, b),
            BinaryOperator::Greater => (Binary::Less, b, a),
            BinaryOperator::GreaterEqual => (Binary::LessEqual, b, a),
            BinaryOperator::And | BinaryOperator::LogicalAnd => (Binary::And, a, b),
            BinaryOperator::InclusiveOr | BinaryOperator::LogicalOr => (Binary::Or, a, b),
            BinaryOperator::Modulo => return self.refuse(span, "the operator `%`"),
            BinaryOperator::ExclusiveOr => return self.refuse(span, "the operator `^`"),
            BinaryOperator::ShiftLeft => return self.refuse(span, "the operator `<<`"),
            BinaryOperator::ShiftRight => return self.refuse(span, "the operator `>>`"),
        };
        Ok(self.ops.push(Op::Binary(op, a, b)))
    }

    fn math(&mut self, fun: MathFunction, a: Id, b: Option<Id>, c: Option<Id>, span: Span) -> Result<Id, LanesError> {
        let op = match (fun, b, c) {
            (MathFunction::Min, Some(b), None) => Op::Binary(Binary::Min, a, b),
            (MathFunction::Max, Some(b), None) => Op::Binary(Binary::Max, a, b),
            (MathFunction::Clamp, Some(low), Some(high)) => {
                let above = self.ops.push(Op::Binary(Binary::Max, a, low));
                Op::Binary(Binary::Min, above, high)
            }
            (MathFunction::Abs, None, None) => Op::Unary(Unary::Abs, a),
            (MathFunction::Sqrt, None, None) => Op::Unary(Unary::Sqrt, a),
            (MathFunction::Floor, None, None) => Op::Unary(Unary::Floor, a),
            (MathFunction::Sin, None, None) => Op::Unary(Unary::Sin, a),
            (MathFunction::Cos, None, None) => Op::Unary(Unary::Cos, a),
            (MathFunction::Pow, ..) => return self.differs(span, "pow", "power"),
            (MathFunction::Exp, ..) => return self.differs(span, "exp", "exponential"),
            (MathFunction::Log, ..) => return self.differs(span, "log", "logarithm"),
            _ => return self.refuse(span, format!("`{}`", format!("{fun:?}").to_lowercase())),
        };
        Ok(self.ops.push(op))
    }

    fn differs(&self, span: Span, builtin: &str, own: &str) -> Result<Id, LanesError> {
        self.refuse(span, format!("`{builtin}` (it differs between devices; write `{own}`, which does not)"))
    }
}

/// Functions with their own implementation in `lanes`, and their parts.
fn is_built_in(name: &str) -> bool {
    let own = ["power", "exponential", "logarithm", "opaque", "opaque_even", "opaque_odd"];
    let pieces = ["exponent_of", "log2_of_mantissa", "power_of_two"];
    own.contains(&name) || pieces.contains(&name)
}

fn part_mut<'v>(value: &'v mut Value, path: &[usize]) -> &'v mut Value {
    match (value, path) {
        (Value::Struct(members), [first, rest @ ..]) => part_mut(&mut members[*first], rest),
        (value, _) => value,
    }
}

fn is_known(scalar: naga::Scalar) -> bool {
    scalar == naga::Scalar::F32 || scalar.kind == ScalarKind::Bool
}

fn type_name(inner: &TypeInner) -> &'static str {
    match inner {
        TypeInner::Vector { .. } => "a vector",
        TypeInner::Matrix { .. } => "a matrix",
        TypeInner::Array { .. } => "an array",
        TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. } => "a pointer",
        TypeInner::Scalar(scalar) => match scalar.kind {
            ScalarKind::Sint | ScalarKind::AbstractInt => "an i32",
            ScalarKind::Uint => "a u32",
            _ => "a number of another type than f32",
        },
        _ => "a value of this type",
    }
}
