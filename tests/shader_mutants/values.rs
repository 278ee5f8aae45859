//! Tests whether the functions of shaders/power.wgsl and shaders/exponential.wgsl still have the same values, to the bit, at many points
//! and all edge cases.
//!
//! tests/equality/power.rs, and the probes of `leadlag doctor`, which compare it with its twin, check that the unchanged text is right.

use leadlag::internal::gpu::{Adapter, AdapterChoice, values};
use std::collections::BTreeMap;
use std::f32::consts::{FRAC_1_SQRT_2, SQRT_2};

/// The files that are judged here.
pub const FILES: [&str; 2] = ["shaders/power.wgsl", "shaders/exponential.wgsl"];

/// Points of each function.
const POINTS: usize = 600;

pub struct Values {
    adapter: Adapter,
    texts: BTreeMap<String, String>,
    inputs: Vec<f32>,
    expected: Vec<u32>,
}

/// These points first, then a geometric row of this many others between two values.
fn points(edges: &[f32], from: f64, to: f64) -> Vec<f32> {
    let others = POINTS - edges.len();
    let between = |k: usize| (from * (to / from).powf(k as f64 / others as f64)) as f32;
    edges.iter().copied().chain((0..others).map(between)).collect()
}

impl Values {
    pub fn new(shaders: &[(String, String)]) -> Values {
        const NAN: f32 = f32::NAN;
        const MIN: f32 = f32::MIN_POSITIVE;
        let adapter = Adapter::choose(&AdapterChoice::Best).unwrap_or_else(|e| panic!("{e}"));
        // Around the place where the mantissa is split, and bits that only a mask distinguishes.
        let around = |x: f32| [x.next_down(), x, x.next_up()];
        let splits = [FRAC_1_SQRT_2, SQRT_2, 1.0].map(around).concat();
        let edges = [0.0, -0.0, -1.0, 0.5 * MIN, MIN, 1.005 * MIN, 1.02 * MIN, f32::INFINITY, NAN];
        let bases = points(&[&splits[..], &edges[..]].concat(), 1e-30, 1e30);
        let exponents: Vec<f32> = (0..POINTS).map(|k| 0.1 + 0.0333 * (k * 7 % POINTS) as f32 / 2.0).collect();
        let ends =
            [-100.0, -100.5, -99.5, 100.0, 100.5, 99.5, 88.5, 89.0, -87.0, -88.0, f32::INFINITY, -f32::INFINITY, NAN];
        let mut powers_of_e = points(&ends, 1e-4, 95.0);
        powers_of_e.iter_mut().skip(ends.len()).step_by(2).for_each(|x| *x = -*x);
        let logarithms = points(&[&splits[..], &edges[..]].concat(), 2e-38, 3e38);
        let inputs = (0..POINTS).flat_map(|k| [bases[k], exponents[k], powers_of_e[k], logarithms[k]]).collect();
        let texts = shaders.iter().filter(|(file, _)| FILES.contains(&file.as_str())).cloned().collect();
        let mut all = Values { adapter, texts, inputs, expected: Vec::new() };
        all.expected = all.computed("", "").expect("the texts as they are");
        all
    }

    fn computed(&self, file: &str, replaced: &str) -> Result<Vec<u32>, String> {
        let texts = self.texts.iter().map(|(name, text)| if name == file { replaced } else { text.as_str() });
        let text = format!(
            "{}
            @group(0) @binding(0) var<storage, read> x: array<f32>;
            @group(0) @binding(1) var<storage, read_write> y: array<u32>;
            @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
                for (var k = id.x; k < {POINTS}u; k += 64u) {{
                    y[3u * k] = bitcast<u32>(power(x[4u * k], x[4u * k + 1u]));
                    y[3u * k + 1u] = bitcast<u32>(exponential(x[4u * k + 2u]));
                    y[3u * k + 2u] = bitcast<u32>(logarithm(x[4u * k + 3u]));
                }}
            }}",
            texts.collect::<String>()
        );
        values(&self.adapter, &text, &self.inputs, 3 * POINTS)
    }

    /// Differences that are detected with another text in place of a file.
    pub fn verdict(&self, file: &str, text: &str) -> Result<(), String> {
        let found = self.computed(file, text)?;
        let is_nan = |bits: u32| f32::from_bits(bits).is_nan();
        let same = |(a, b): (&u32, &u32)| a == b || (is_nan(*a) && is_nan(*b));
        let differing = found.iter().zip(&self.expected).filter(|pair| !same(*pair)).count();
        if differing == 0 { Ok(()) } else { Err(format!("{differing} of {} values differ", found.len())) }
    }
}
