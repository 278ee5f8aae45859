//! Probes of a driver's arithmetic: one small kernel per known fault.

use super::adapter::Adapter;
use super::device::{Device, Fault};
use super::own_functions::{CpuFunctions, own_exponential, own_logarithm, own_power};
use std::time::Instant;

/// Result of a probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::Display)]
#[strum(serialize_all = "snake_case")]
pub enum ProbeStatus {
    /// As in the standard for floating-point numbers.
    Ok,
    /// Different, but nothing here relies on it.
    Trap,
    /// Different, and results cannot be trusted.
    Fail,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Probe {
    /// Short name.
    pub name: &'static str,
    /// The result.
    pub status: ProbeStatus,
    /// Its meaning for the user.
    pub detail: String,
}

/// A mode of an adapter, and whether the probes allow it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mode {
    /// Short name; for precisions, the value of `--precision`.
    pub name: &'static str,
    /// Whether results can be trusted.
    pub safe: bool,
    /// Its guarantee.
    pub promise: &'static str,
}

/// Modes that are safe on an adapter, by its probes.
pub fn modes(probes: &[Probe]) -> [Mode; 3] {
    let is = |name: &str, wanted: &[ProbeStatus]| {
        probes.iter().any(|probe| probe.name == name && wanted.contains(&probe.status))
    };
    use ProbeStatus::{Ok, Trap};
    let own = ["own_power", "own_exponential", "own_logarithm"];
    let plain = is("nan_by_bits", &[Ok]) && own.iter().all(|name| is(name, &[Ok, Trap]));
    let exact = ["unfused_products", "rounded_quotients", "rounded_roots"];
    let same_bits = plain && own.iter().chain(&exact).all(|name| is(name, &[Ok]));
    [
        Mode { name: "plain", safe: plain, promise: "--precision plain: scores of a search, some 1e-6 from f64" },
        Mode {
            name: "compensated",
            safe: plain && is("hidden_error_terms", &[Ok]),
            promise: "--precision compensated: keeps rounding errors of states and sums",
        },
        Mode { name: "same_bits", safe: same_bits, promise: "the same bits as --evaluator lanes on the CPU" },
    ]
}

/// A kernel that reads `x` and writes `y`.
struct Trap {
    name: &'static str,
    body: &'static str,
    inputs: &'static [f32],
    /// True if the outputs conform to the standard.
    good: fn(&[u32]) -> bool,
    /// The status if they are not.
    otherwise: ProbeStatus,
    yes: &'static str,
    no: &'static str,
}

fn judged(good: bool, otherwise: ProbeStatus, yes: &str, no: &str) -> (ProbeStatus, String) {
    if good { (ProbeStatus::Ok, yes.to_owned()) } else { (otherwise, no.to_owned()) }
}

/// 1 + 2^-12: its square needs one bit more than an f32 has.
const ODD: f32 = 1.000_244_1;

/// 2^-12.
const TINY: f32 = 1.0 / 4096.0;

/// Functions of the kernels below.
pub(super) const COMMON: &str = "
@group(0) @binding(0) var<storage, read> x: array<f32>;
@group(0) @binding(1) var<storage, read_write> y: array<u32>;
fn hide(value: f32, zero: u32) -> f32 { return bitcast<f32>(bitcast<u32>(value) ^ zero); }
fn no_number(value: f32) -> u32 { return select(0u, 1u, (bitcast<u32>(value) & 0x7f800000u) == 0x7f800000u); }
";

const TRAPS: &[Trap] = &[
    Trap {
        name: "nan_by_bits",
        // A compiler that assumes finite results may drop the test of a computed value, but not of a value that is read. The probe does not
        // use the difference of a value to itself, which some drivers assume to be 0.
        body: "y[0] = no_number(x[0]); y[1] = no_number(x[2] - x[3]); y[2] = no_number(x[4] / x[5]);
               y[3] = no_number(sqrt(x[6])); y[4] = no_number(x[2] * x[4] + x[1]); y[5] = no_number(x[7] * x[8]);
               y[6] = no_number(x[1]); y[7] = no_number(x[1] - x[7]);",
        inputs: &[f32::NAN, 1.0, f32::INFINITY, f32::INFINITY, 0.0, 0.0, -1.0, 1e30, 1e30],
        good: |y| y == [1, 1, 1, 1, 1, 1, 0, 0],
        otherwise: ProbeStatus::Fail,
        yes: "the kernels' test by bits detects NaN",
        no: "a result that is not a number (NaN) remains undetected: do not use this driver",
    },
    Trap {
        name: "nan_unequal",
        body: "y[0] = select(0u, 1u, x[0] != x[0]);",
        inputs: &[f32::NAN],
        good: |y| y == [1],
        otherwise: ProbeStatus::Trap,
        yes: "NaN differs from itself, as it should",
        no: "the usual test `x != x` does not find NaN here; the kernels use the bits instead",
    },
    Trap {
        name: "nan_not_equal",
        body: "y[0] = select(0u, 1u, !(x[0] == x[0]));",
        inputs: &[f32::NAN],
        good: |y| y == [1],
        otherwise: ProbeStatus::Trap,
        yes: "NaN is not equal to itself, as it should be",
        no: "the test `!(x == x)` does not find NaN here; the kernels use the bits instead",
    },
    Trap {
        name: "clamps_keep_nan",
        body: "y[0] = bitcast<u32>(max(x[0], 1.0)); y[1] = bitcast<u32>(min(x[0], 1.0));
               y[2] = bitcast<u32>(clamp(x[0], -1.0, 1.0));",
        inputs: &[f32::NAN],
        good: |y| y.iter().all(|bits| f32::from_bits(*bits).is_nan()),
        otherwise: ProbeStatus::Trap,
        yes: "minimum and maximum pass NaN on",
        no: "minimum and maximum turn NaN into an ordinary number; the kernels look for it before they clamp",
    },
    Trap {
        name: "unfused_products",
        body: "y[0] = bitcast<u32>(x[0] * x[0] + x[1]);",
        inputs: &[ODD, -(ODD * ODD)],
        good: |y| f32::from_bits(y[0]) == 0.0,
        otherwise: ProbeStatus::Trap,
        yes: "products are rounded before they are added, so that results can equal the CPU's bit for bit",
        no: "the driver fuses a product with the sum after it; results are good, but differ from the CPU's in the \
             last digits",
    },
    Trap {
        name: "sums_as_written",
        // 1 + (2^-24 + 2^-24) = 1 + 2^-23, but (1 + 2^-24) + 2^-24 = 1.
        body: "y[0] = bitcast<u32>(x[0] + (x[1] * x[2] + x[3] * x[4]));",
        inputs: &[1.0, TINY, TINY, TINY, TINY],
        good: |y| f32::from_bits(y[0]) > 1.0,
        otherwise: ProbeStatus::Trap,
        yes: "sums are computed in the order in which they are written",
        no: "the driver re-orders sums of products; where that matters the kernels are written in its order",
    },
    Trap {
        name: "power_of_zero",
        body: "y[0] = bitcast<u32>(pow(x[0], x[0])); y[1] = bitcast<u32>(pow(x[1], x[2]));",
        inputs: &[0.0, 2.0, 0.5],
        good: |y| f32::from_bits(y[0]) == 1.0,
        otherwise: ProbeStatus::Trap,
        yes: "the driver's own power function has 0^0 = 1",
        no: "the driver's own power function has 0^0 other than 1; the kernels have their own",
    },
    Trap {
        name: "plain_error_terms",
        body: "let sum = x[0] + x[1]; let seen = sum - x[0];
               y[0] = bitcast<u32>((x[0] - (sum - seen)) + (x[1] - seen));",
        inputs: &[1000.0, 1e-5],
        good: |y| f32::from_bits(y[0]) == 1e-5,
        otherwise: ProbeStatus::Trap,
        yes: "the error of a sum can be computed as written",
        no: "the driver simplifies the error of a sum to 0; the kernels hide such terms from it",
    },
    Trap {
        name: "hidden_error_terms",
        body: "let zero = bitcast<u32>(x[2]); let sum = hide(x[0] + x[1], zero); let seen = hide(sum - x[0], zero);
               y[0] = bitcast<u32>((x[0] - hide(sum - seen, zero)) + (x[1] - seen));",
        inputs: &[1000.0, 1e-5, 0.0],
        good: |y| f32::from_bits(y[0]) == 1e-5,
        otherwise: ProbeStatus::Fail,
        yes: "--precision compensated works: it keeps rounding errors of sums",
        no: "--precision compensated is no better than plain on this driver",
    },
];

/// Iterations in the probe of loops.
const TURNS: u32 = 1 << 20;

/// Runs every probe on an adapter.
pub fn probes(adapter: &Adapter, on_the_cpu: &CpuFunctions) -> Vec<Probe> {
    let failed = |name, fault: Fault| Probe {
        name,
        status: ProbeStatus::Fail,
        detail: format!("{}: {}", fault.doing, fault.message.replace('\n', " ")),
    };
    let device = match Device::alone(adapter) {
        Ok(device) => device,
        Err(fault) => return vec![failed("device", fault)],
    };
    let mut found: Vec<Probe> = Vec::new();
    for &Trap { name, body, inputs, good, otherwise, yes, no } in TRAPS {
        let text = format!("{COMMON}@compute @workgroup_size(1) fn main() {{ {body} }}");
        found.push(match run(&device, &text, inputs, body.matches("y[").count()) {
            Ok(y) => {
                let (status, detail) = judged(good(&y), otherwise, yes, no);
                Probe { name, status, detail }
            }
            Err(fault) => failed(name, fault),
        });
    }
    for (name, probed) in [
        ("own_power", own_power(&device, on_the_cpu)),
        ("own_exponential", own_exponential(&device, on_the_cpu)),
        ("own_logarithm", own_logarithm(&device, on_the_cpu)),
        ("rounded_quotients", rounded(&device, "quotients", "x[2u * k] / x[2u * k + 1u]", |x| x[0] / x[1])),
        ("rounded_roots", rounded(&device, "square roots", "sqrt(x[2u * k])", |x| x[0].sqrt())),
        ("loops", loops(&device)),
    ] {
        found.push(match probed {
            Ok((status, detail)) => Probe { name, status, detail },
            Err(fault) => failed(name, fault),
        });
    }
    found
}

pub(super) type Finding = Result<(ProbeStatus, String), Fault>;

/// Number of pairs in the probe of rounding: if one result in five were off by one digit, hardly all would be right.
const PAIRS: usize = 256;

/// Whether an operation is rounded correctly, which Vulkan requires neither for quotients nor for square roots (2.5 digits of the last
/// place).
fn rounded(device: &Device, what: &str, operation: &str, expected: fn([f32; 2]) -> f32) -> Finding {
    // Odd steps through the mantissas, over eight powers of two.
    let of = |k: usize, step: u32| f32::from_bits(0x3e00_0000 + (k as u32 * step) % (8 << 23));
    let pairs: Vec<[f32; 2]> = (0..PAIRS).map(|k| [of(k, 0x000b_3c5d), of(k, 0x0017_a2f1)]).collect();
    let text = format!(
        "{COMMON}@compute @workgroup_size(1) fn main() {{
             for (var k = 0u; k < {PAIRS}u; k++) {{ y[k] = bitcast<u32>({operation}); }}
         }}"
    );
    let found = run(device, &text, pairs.as_flattened(), PAIRS)?;
    let off = pairs.iter().zip(found).filter(|(pair, bits)| expected(**pair).to_bits() != *bits).count();
    let (good, trap) = (
        format!("{what} are rounded as on the CPU"),
        format!("{off} of {PAIRS} {what} differ from the CPU's in the last digits, as Vulkan allows; results are good"),
    );
    Ok(judged(off == 0, ProbeStatus::Trap, &good, &trap))
}

/// The counter that wgpu adds to every loop, so that none is endless; some drivers handle it badly. It adds it to both loops here, and
/// one of them has it once more.
fn loops(device: &Device) -> Finding {
    const CHECK: &str =
        "if (all(left == vec2<u32>(0u))) { break; } left -= vec2<u32>(select(0u, 1u, left.y == 0u), 1u);";
    let time = |check: &str| {
        let text = format!(
            "{COMMON}@compute @workgroup_size(1) fn main() {{
                 var s = 0.0;
                 var left = vec2<u32>(bitcast<u32>(x[1]));
                 for (var k = 0u; k < {TURNS}u; k++) {{ {check} s = s * 0.999 + x[0]; }}
                 y[0] = bitcast<u32>(s) + left.x;
             }}"
        );
        let inputs = [1.0, f32::from_bits(u32::MAX)];
        // The first run compiles.
        run(device, &text, &inputs, 1)?;
        let mut best = f64::INFINITY;
        for _ in 0..3 {
            let began = Instant::now();
            run(device, &text, &inputs, 1)?;
            best = best.min(began.elapsed().as_secs_f64());
        }
        Ok::<f64, Fault>(best)
    };
    let extra = (time(CHECK)? / time("")? - 1.0).max(0.0);
    let (status, judgement) =
        if extra < 1.0 { (ProbeStatus::Ok, "fine") } else { (ProbeStatus::Trap, "expect slow simulations here") };
    Ok((
        status,
        format!(
            "the check that no loop is endless makes the shortest of loops {:.0} % longer: {judgement}",
            100.0 * extra
        ),
    ))
}

/// Runs `main` of a text in one workgroup, which reads `x` and writes `y`; returns `y`. For tests of single functions.
#[doc(hidden)]
pub fn values(adapter: &Adapter, text: &str, x: &[f32], outputs: usize) -> Result<Vec<u32>, String> {
    let found = Device::alone(adapter).and_then(|device| run(&device, text, x, outputs));
    found.map_err(|fault| format!("{}: {}", fault.doing, fault.message))
}

/// Runs `main` in one workgroup; returns `y`.
pub(super) fn run(device: &Device, text: &str, x: &[f32], outputs: usize) -> Result<Vec<u32>, Fault> {
    const DOING: &str = "running a probe";
    use wgpu::BufferUsages as Usages;
    let raw = &device.raw;
    let filters = [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::Internal];
    let scopes = filters.map(|filter| raw.push_error_scope(filter));
    let buffer = |size: usize, usage| {
        let size = size as u64;
        raw.create_buffer(&wgpu::BufferDescriptor { label: Some("probe"), size, usage, mapped_at_creation: false })
    };
    let input = buffer(size_of_val(x), Usages::STORAGE | Usages::COPY_DST);
    let output = buffer(4 * outputs, Usages::STORAGE | Usages::COPY_SRC);
    let back = buffer(4 * outputs, Usages::MAP_READ | Usages::COPY_DST);
    device.queue.write_buffer(&input, 0, bytemuck::cast_slice(x));
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = raw.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("probe"), source });
    let pipeline = raw.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("probe"),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let mut encoder = raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let bind_group = raw.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("probe"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
        ],
    });
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.dispatch_workgroups(1, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &back, 0, 4 * outputs as u64);
    let commands = encoder.finish();
    if let Some(error) = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop())).last() {
        return Err(Fault::new(DOING, error));
    }
    device.queue.submit([commands]);
    back.slice(..).map_async(wgpu::MapMode::Read, |_| ());
    device.wait(None)?;
    let view = back.slice(..).get_mapped_range().map_err(|e| Fault::new(DOING, e))?;
    Ok(view.chunks_exact(4).map(|word| u32::from_ne_bytes(word.try_into().expect("four bytes"))).collect())
}
