// Sums that keep what f32 rounding takes from them, if COMPENSATED. Needs opaque.wgsl.

// Sums of one signal triple, with the part that f32 rounding loses.
struct Triple {
    high: vec3<f32>,
    low: vec3<f32>,
}

fn opaque3(x: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(x) ^ vec3<u32>(opaque_zero));
}

fn add(sum: Triple, term: vec3<f32>) -> Triple {
    if (!COMPENSATED) {
        return Triple(sum.high + term, sum.low);
    }
    let high = opaque3(sum.high + term);
    let term_seen = opaque3(high - sum.high);
    let sum_seen = opaque3(high - term_seen);
    return Triple(high, sum.low + ((sum.high - sum_seen) + (term - term_seen)));
}
