//! Compares functions on a device with those of the CPU, bit for bit.

use super::device::Device;
use super::probe::{COMMON, Finding, ProbeStatus, run};
use crate::wgsl::shader;

/// The CPU's forms of the functions of shaders/power.wgsl and shaders/exponential.wgsl.
#[derive(Debug, Clone, Copy)]
pub struct CpuFunctions {
    /// x to the power of y.
    pub power: fn(f32, f32) -> f32,
    /// e to the power of x.
    pub exponential: fn(f32) -> f32,
    /// Natural logarithm.
    pub logarithm: fn(f32) -> f32,
}

/// Points at which a function is compared.
const POINTS: i32 = 128 * 128;

pub(super) fn own_power(device: &Device, on_the_cpu: &CpuFunctions) -> Finding {
    let point = |k: i32| [0.001 * 1.058_f32.powi(k / 128), 0.1 + 0.0771 * (k % 128) as f32];
    let power = on_the_cpu.power;
    own(device, "power", "power(a, b)", point, &|[x, y]| power(x, y))
}

pub(super) fn own_exponential(device: &Device, on_the_cpu: &CpuFunctions) -> Finding {
    let exponential = on_the_cpu.exponential;
    own(device, "exponential", "exponential(a)", |k| [0.0106 * k as f32 - 86.9, 0.0], &|[x, _]| exponential(x))
}

pub(super) fn own_logarithm(device: &Device, on_the_cpu: &CpuFunctions) -> Finding {
    let logarithm = on_the_cpu.logarithm;
    own(device, "logarithm", "logarithm(a)", |k| [1e-12 * 1.004_f32.powi(k), 0.0], &|[x, _]| logarithm(x))
}

/// A function on a device and on the CPU.
fn own(
    device: &Device,
    name: &str,
    call: &str,
    point: impl Fn(i32) -> [f32; 2],
    on_the_cpu: &dyn Fn([f32; 2]) -> f32,
) -> Finding {
    let pairs: Vec<[f32; 2]> = (0..POINTS).map(point).collect();
    let text = format!(
        "{COMMON}{}{}
         @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
             for (var k = id.x; k < {POINTS}u; k += 64u) {{
                 let a = x[2u * k];
                 let b = x[2u * k + 1u];
                 y[k] = bitcast<u32>({call});
             }}
         }}",
        shader("shaders/power.wgsl").1,
        shader("shaders/exponential.wgsl").1,
    );
    let y = run(device, &text, pairs.as_flattened(), pairs.len())?;
    let (mut different, mut worst) = (0, 0.0_f32);
    for (pair, bits) in pairs.iter().zip(y) {
        let (cpu, gpu) = (on_the_cpu(*pair), f32::from_bits(bits));
        if cpu.to_bits() != bits {
            different += 1;
            worst = worst.max(if gpu.is_finite() { ((gpu - cpu) / cpu).abs() } else { f32::INFINITY });
        }
    }
    if different == 0 {
        let detail = format!("our {name} function gives the same bits as on the CPU at {POINTS} points");
        return Ok((ProbeStatus::Ok, detail));
    }
    let (status, judgement) = match worst < 1e-5 {
        true => (ProbeStatus::Trap, "differ from the CPU's, by at most"),
        false => (ProbeStatus::Fail, "are wrong, by up to"),
    };
    let which = format!("{different} of {POINTS} values of our {name} function");
    Ok((status, format!("{which} {judgement} {worst:.1e} relative to their size")))
}
