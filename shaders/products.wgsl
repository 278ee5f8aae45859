// Sums of products of differences between runs, from which derivatives follow. A group is a candidate and its copies, each with one
// coordinate moved; d_0 is the error of the candidate, d_a is that of copy a minus d_0. One invocation adds d_a d_b of one group over the
// samples that kernel.wgsl left, so that only sums leave the device. `add_in_f32` in src/models/lanes/run/products.rs does the same on the
// CPU; the tests compare every bit. Generated in front of this file: WORKGROUP (u32).

struct Stretch {
    // Samples in `errors`, and numbers from one error of a candidate to its next.
    samples: u32,
    stride: u32,
    groups: u32,
    // Rows of the largest group: its candidates.
    rows: u32,
    // Zero; see opaque.wgsl.
    zero: u32,
}

// `blocks` of kernel.wgsl with LEAVES.
@group(0) @binding(0) var<storage, read> errors: array<f32>;
// First candidate of each group and the number of its candidates.
@group(0) @binding(1) var<storage, read> groups: array<vec2<u32>>;
// Per pair of each group three sums and the three parts that rounding takes from them.
@group(0) @binding(2) var<storage, read_write> sums: array<f32>;
@group(0) @binding(3) var<uniform> stretch: Stretch;

fn error_of(candidate: u32, t: u32) -> vec3<f32> {
    let at = 3u * t * stretch.stride + candidate;
    return vec3<f32>(errors[at], errors[at + stretch.stride], errors[at + 2u * stretch.stride]);
}

fn difference(group: vec2<u32>, row: u32, t: u32) -> vec3<f32> {
    let error = error_of(group.x, t);
    if (row == 0u) {
        return error;
    }
    return error_of(group.x + row, t) - error;
}

fn sum_at(word: u32, k: u32, all: u32) -> vec3<f32> {
    let at = word * all + k;
    return vec3<f32>(sums[at], sums[at + all], sums[at + 2u * all]);
}

fn store(word: u32, k: u32, all: u32, x: vec3<f32>) {
    let at = word * all + k;
    sums[at] = x.x;
    sums[at + all] = x.y;
    sums[at + 2u * all] = x.z;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) workgroups: vec3<u32>) {
    // Pairs (a, b) with a <= b, row by row.
    let pairs = stretch.rows * (stretch.rows + 1u) / 2u;
    let all = stretch.groups * pairs;
    let k = id.y * workgroups.x * WORKGROUP + id.x;
    if (k >= all) {
        return;
    }
    opaque_zero = stretch.zero;
    let group = groups[k / pairs];
    var a = 0u;
    var b = k % pairs;
    while (b >= stretch.rows) {
        a += 1u;
        b = b + a - stretch.rows;
    }
    if (b >= group.y) {
        return;
    }
    var sum = Triple(sum_at(0u, k, all), sum_at(3u, k, all));
    for (var t = 0u; t < stretch.samples; t++) {
        sum = add(sum, difference(group, a, t) * difference(group, b, t));
    }
    store(0u, k, all, sum.high);
    store(3u, k, all, sum.low);
}
