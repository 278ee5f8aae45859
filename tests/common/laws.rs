//! Built-in laws point by point: their texts against the reference.

use super::cars::Random;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Radicand;
use leadlag::internal::extension::Extension;
use leadlag::internal::lanes::Function;
use leadlag::internal::reference::Perceived;
use leadlag::internal::reference::law::{Memory, Seen, named};
use leadlag::internal::symbols::{Bounds, Parameters, Symbol};
use leadlag::internal::wgsl::{Precision, Recipe, Source, check, laws};

/// States of a law.
const POINTS: usize = 2500;
/// Largest difference relative to the size of the subtracted terms.
const TOLERANCE: f64 = 1e-12;
/// Of the spacing at constant speed: an inverse hyperbolic tangent of a value close to one loses digits.
const EQUILIBRIUM: f64 = 1e-9;

/// A law, its states, and the results of the reference.
pub struct Judge {
    law: &'static Extension,
    points: Vec<Point>,
}

struct Point {
    parameters: Parameters,
    own: Vec<f64>,
    x: Perceived,
    v_f: f64,
    a_f: f64,
    a_l: f64,
    v_l_then: f64,
    v_l_half: f64,
    dt: f64,
    memory: Memory,
    expected: f64,
    after: Memory,
    equilibrium: f64,
}

/// One of the critical values in half of the draws, otherwise uniform between them.
fn edgy(random: &mut Random, edges: &[f64], [lower, upper]: [f64; 2]) -> f64 {
    if random.next() < 0.5 {
        edges[((random.next() * edges.len() as f64) as usize).min(edges.len() - 1)]
    } else {
        lower + (upper - lower) * random.next()
    }
}

/// All built-in laws.
pub fn judges() -> Vec<Judge> {
    laws().iter().map(|law| Judge::new(law)).collect()
}

impl Judge {
    pub fn new(law: &'static Extension) -> Judge {
        let reference = named(&law.name).expect("every built-in law has a transcription");
        let mut random = Random(11);
        let mut points = Vec::new();
        while points.len() < POINTS {
            let mut parameters = Parameters::NONE;
            for symbol in &law.parameters {
                let Bounds::Fixed(lower, upper) = symbol.bounds() else { panic!("{}", symbol.name()) };
                parameters.set(*symbol, edgy(&mut random, &[lower, upper], [lower, upper]));
            }
            let own: Vec<f64> = law.own_parameters().map(|symbol| parameters.get(symbol)).collect();
            let s = edgy(&mut random, &[0.0005, 0.02, 0.5, 3.0, 8.0, 30.0, 101.0, 118.0, 130.0], [1.0, 140.0]);
            let seen = edgy(&mut random, &[0.0, 0.005, 0.05, 20.0, parameters.v_0, 40.0], [0.0, 36.0]);
            let v = if seen.is_finite() { seen } else { 20.0 };
            // At the same speed, or slightly faster or slower.
            let v_l = match random.next() {
                share if share < 0.3 => (v + [0.0, 0.005, -0.005][(share * 10.0) as usize]).max(0.0),
                _ => edgy(&mut random, &[0.0, 0.005, 15.0], [0.0, 36.0]),
            };
            let v_f = if random.next() < 0.5 { v } else { (v + 2.0 * random.next() - 1.0).max(0.0) };
            let past = |random: &mut Random| (v_l + 4.0 * random.next() - 2.0).max(0.0);
            let (v_l_then, v_l_half) = (past(&mut random), past(&mut random));
            let x = Perceived { s, v_f: v, v_l };
            let a_f = edgy(&mut random, &[0.0, 0.005, -3.0, 2.0], [-4.0, 3.0]);
            let a_l = edgy(&mut random, &[0.0, -0.0001, 0.99, 1.01, -4.0], [-4.0, 3.0]);
            let dt = edgy(&mut random, &[0.1, 0.04], [0.02, 0.5]);
            let memory = if law.state.is_empty() || random.next() < 0.5 { [0.0; 4] } else { [1.0, 0.0, 0.0, 0.0] };
            let mut after = memory;
            let p = &parameters;
            let seen = Seen { p, own: &own, x, v_f, a_f, a_l, v_l_then, v_l_half, dt };
            let expected = (reference.acceleration)(&seen, &mut after);
            let equilibrium = (reference.equilibrium)(p, &own, v);
            points.push(Point {
                own: own.clone(),
                x,
                v_f,
                a_f,
                a_l,
                v_l_then,
                v_l_half,
                dt,
                memory,
                expected,
                after,
                equilibrium,
                parameters,
            });
        }
        Judge { law, points }
    }

    /// True for the text that is judged.
    pub fn judges(&self, file: &str) -> bool {
        self.law.file == file
    }

    /// Differences with other texts in place of files.
    pub fn verdict(&self, replace: &dyn Fn(&str, &str) -> Option<String>) -> Result<(), String> {
        let variant = Variant::of_law(self.law);
        let (precision, radicand) = (Precision::Plain, Radicand::Measured);
        let recipe = Recipe { variant, precision, radicand, observed: true };
        let source = Source::model_with(&recipe, replace);
        let checked = check(&source).map_err(|e| e.to_string())?;
        let name = &self.law.name;
        let compile = |function: &str| Function::compile(&source, &checked, function).map_err(|e| e.to_string());
        let (law, equilibrium) = (compile(&format!("{name}__{name}_law"))?, compile("equilibrium_spacing")?);
        for point in &self.points {
            let found = law.call_f64(&law.inputs().iter().map(|path| self.input(point, path)).collect::<Vec<_>>());
            let scale = point.expected.abs().max(point.v_f / point.dt).max(1.0);
            let is_near = |found: f64, expected: f64| {
                (found - expected).abs() <= TOLERANCE * scale || found.is_nan() && expected.is_nan()
            };
            if !is_near(found[0], point.expected) {
                return Err(format!("{name} at {point}: {} not {}", found[0], point.expected));
            }
            for (k, after) in found[1..].iter().enumerate() {
                if !is_near(*after, point.after[k]) {
                    return Err(format!("{name} at {point}: remembers {after} not {}", point.after[k]));
                }
            }
            let inputs = equilibrium.inputs().iter().map(|path| self.input(point, path));
            let found = equilibrium.call_f64(&inputs.collect::<Vec<_>>())[0];
            let expected = point.equilibrium;
            let is_near = (found - expected).abs() <= EQUILIBRIUM * expected.abs().max(1.0);
            // Without an equilibrium both are infinite or NaN.
            if !(is_near || found == expected || found.is_nan() && expected.is_nan()) {
                return Err(format!("{name} at {point}: keeps {found} m not {}", point.equilibrium));
            }
        }
        Ok(())
    }

    /// The value of an argument of the text.
    fn input(&self, point: &Point, path: &str) -> f64 {
        let (owner, member) = path.rsplit_once('.').unwrap_or(("", path));
        match (owner, member) {
            ("x", "s") => point.x.s,
            ("x", "v_f") => point.x.v_f,
            ("x", "v_l") => point.x.v_l,
            ("w", "a_f") => point.a_f,
            ("w", "a_l") => point.a_l,
            ("w", "dt") => point.dt,
            ("w", "v_l_then") => point.v_l_then,
            ("w", "v_l_half") => point.v_l_half,
            ("state", _) => point.memory[self.law.state.iter().position(|(name, _)| name == member).expect("its own")],
            ("own", _) => self.parameter(point, member),
            // Of `equilibrium_spacing`, whose own parameters have the name of the law.
            ("p", _) => self.parameter(point, member.rsplit("__").next().unwrap_or(member)),
            ("", "v") => point.x.v_f,
            ("", _) => point.v_f,
            // The law reads none of it.
            _ => f64::NAN,
        }
    }

    fn parameter(&self, point: &Point, name: &str) -> f64 {
        let symbol: Option<&Symbol> = self.law.parameters.iter().find(|symbol| symbol.name() == name);
        symbol.map_or(f64::NAN, |symbol| point.parameters.get(*symbol))
    }
}

impl std::fmt::Display for Point {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Point { own, x, v_f, a_f, a_l, dt, memory, .. } = self;
        write!(f, "{x:?}, present {v_f}, a_f {a_f}, a_l {a_l}, dt {dt}, own {own:?}, memory {:?}", &memory[..1])
    }
}
